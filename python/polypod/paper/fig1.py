"""Poses for the paper's Fig. 1c-e: two positions far from Z and a large orientation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polypod.answers.answer import Array
from polypod.mechanism import Mechanism
from polypod.paper.section4 import PRINTED
from polypod.paper.table_i import table_i

_GRID = {
    "alpha": np.radians(np.arange(-60, 61, 10)),
    "p": 1e-3 * np.arange(-700, 701, 50),
    "h": 1e-3 * np.arange(300, 851, 50),
    "beta": np.radians(np.arange(-60, 61, 10)),
    "gamma": np.radians(np.arange(-60, 61, 10)),
}
"""Natural coordinates of the states among which positions are sought, m and rad."""

SIGMA_MIN = 0.03
"""Least singular value that a position must have, as the built-in motion has all along."""

_STEEPEST = np.radians(70.0)
"""Greatest angle between a leg and the platform's normal: legs come from below, none lies in the plate."""


def fig1_poses(mech: Mechanism) -> dict[str, Array]:
    """Poses as in Fig. 1c-e, (4, 4) each, with their captions.

    The positions are those of a grid in natural coordinates that are farthest from Z, and farthest from the
    first, among those that are within all limits, at most the printed height of the workspace below the
    highest of them, and clear of singularities. The large orientation is the largest of Table I.

    Raises CoordinateError and ShapeError for mechanisms that are not of the paper's kind.
    """
    coordinates = dict(zip(_GRID, np.meshgrid(*_GRID.values(), indexing="ij"), strict=True))
    poses = mech.pose({name: values.ravel() for name, values in coordinates.items()})
    poses = poses[_reached(mech, poses)]
    poses = poses[poses[:, 2, 3] >= poses[:, 2, 3].max() - PRINTED[2]]
    poses = poses[mech.conditioning(poses).sigma_min >= SIGMA_MIN]
    o = poses[:, :3, 3]
    away = np.linalg.norm(o[:, :2], axis=1)
    first = int(np.argmax(away))
    second = int(np.argmax(np.linalg.norm(o - o[first], axis=1)))
    rows = table_i(mech).pose
    tilt = np.degrees(np.arccos(rows[:, 2, 2]))
    row = int(np.nanargmax(tilt))
    far = {f"{1e3 * away[i]:.0f} mm from $Z$: $o$ at {_place(o[i])}": poses[i] for i in (first, second)}
    return {**far, rf"$\varphi_{{zZ}}$ = {tilt[row]:.0f}°: row {row + 1} of Table I": rows[row]}


def _reached(mech: Mechanism, poses: Array) -> NDArray[np.bool_]:
    """Which poses are within the limits, with all legs from below."""
    cosines = np.einsum("...nk,...k->...n", mech.inverse_kinematics(poses).directions, poses[..., :3, 2])
    return np.asarray(mech.limits(poses).within & (cosines > np.cos(_STEEPEST)).all(axis=-1))


def _place(o: Array) -> str:
    """A point in mm."""
    return "({}) mm".format(", ".join(f"{1e3 * x:.0f}".replace("-", "−") for x in o))
