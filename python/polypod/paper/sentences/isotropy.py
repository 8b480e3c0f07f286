"""Isotropy of the horizontal motion: how speed, force and stiffness depend on the direction in X-Y."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polypod.answers.answer import Array
from polypod.mechanism import Mechanism
from polypod.paper.sentences.poses import level_poses

HEIGHTS = (0.60, 0.65, 0.70, 0.75, 0.80)
"""Of o above the base at which the level platform is looked at, m."""

SPACING = 0.025
"""Of the grid in X and Y at each height, m."""


@dataclass(frozen=True)
class LevelIsotropy:
    """Isotropy over positions at one height with the platform level; 1 where all directions are alike."""

    height: float
    """Of o, m."""
    pose: Array
    """(N, 4, 4): inside all limits."""
    kept_level: Array
    """(N,): of the leg rates that move o horizontally and keep the platform's orientation."""
    free: Array
    """(N,): of the motion of o that leg rates give, whatever the platform's rotation with it."""


def horizontal_rates(mech: Mechanism, pose: Array) -> Array:
    """(..., n, 2): leg rates for o moving at 1 m/s along X and along Y, the orientation kept; no unit.

    NaN where the constraints do not let the platform translate so.
    """
    along = np.eye(2, 6)
    rates = mech.kinematics(pose[..., None, :, :], along, np.zeros(6)).rates
    return np.swapaxes(rates, -1, -2)


def horizontal_velocities(mech: Mechanism, pose: Array) -> Array:
    """(..., 2, n): v_x and v_y of o for each leg's rate of 1 m/s, the other legs at rest; no unit.

    The transpose gives the active forces that hold a horizontal force at o, but for the sign. The square of a
    singular value is the horizontal compliance at o times the stiffness of a leg, if all legs have the same
    stiffness and the rest is rigid. NaN where the legs do not control the platform.
    """
    rates = np.eye(mech.n_legs)
    twist = mech.platform_twist(pose[..., None, :, :], rates).twist
    return np.swapaxes(twist[..., :2], -1, -2)


def isotropy(matrix: Array) -> Array:
    """(...): the least singular value over the greatest of matrices (..., a, b); NaN where they are."""
    known = np.logical_and.reduce(np.isfinite(matrix), axis=(-1, -2), keepdims=True)
    stand_in: Array = np.where(known, matrix, 1.0)
    values = np.linalg.svd(stand_in, compute_uv=False)
    return np.where(known[..., 0, 0], values[..., -1] / values[..., 0], np.nan)


def level_isotropy(mech: Mechanism, height: float, spacing: float = SPACING) -> LevelIsotropy:
    """Isotropy with the platform level at a height of o, over a grid in X and Y; m."""
    pose = level_poses(mech, height, spacing)
    return LevelIsotropy(
        height,
        pose,
        isotropy(horizontal_rates(mech, pose)),
        isotropy(horizontal_velocities(mech, pose)),
    )
