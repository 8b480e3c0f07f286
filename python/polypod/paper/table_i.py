"""Table I of the paper: the platform's orientation at six sets of leg lengths, published and computed."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from polypod.answers.answer import Array
from polypod.answers.kinematics import AssemblyModes
from polypod.errors import UnsupportedError
from polypod.files.units import cos_sin, to_si
from polypod.mechanism import Mechanism

MECHANISM = "lu-3spu-2rpu-r"
"""The built-in mechanism that is the paper's."""

TABLE_I: tuple[tuple[float, ...], ...] = (
    (708.14, 650.00, 715.46, 850.00, 850.00, 90.00, 27.17, 62.86),
    (769.10, 850.00, 769.10, 650.00, 650.00, 90.00, 136.94, 46.94),
    (650.00, 719.17, 850.00, 850.00, 734.64, 56.40, 93.10, 33.78),
    (850.00, 720.70, 650.00, 732.91, 850.00, 122.19, 88.85, 32.21),
    (850.00, 850.00, 732.44, 650.00, 720.05, 113.51, 114.00, 34.72),
    (732.59, 850.00, 850.00, 719.93, 650.00, 66.25, 113.89, 34.83),
)
"""As printed (Lu, Liu, Zhang, Ye, Wang, Table I): r_1 … r_5 in mm; angles of z with X, Y and Z in degrees."""

_STEP = 1e-6
"""Relative step of the fit's central differences: the angles are exact to some 1e-12, so this is ample."""


@dataclass(frozen=True)
class Orientations:
    """Table I, published beside computed: six rows, angles of z with X, Y and Z in rad."""

    lengths: Array
    """(6, n): as published, m."""
    published: Array
    """(6, 3)."""
    modes: AssemblyModes
    """All poses with these lengths; m is the largest number of a row."""
    mode_angles: Array
    """(6, m, 3): of every mode."""
    chosen: NDArray[np.int64]
    """(6,): the mode whose angles are nearest to the published among those above the base; -1 without one."""
    pose: Array
    """(6, 4, 4): that mode; NaN without one."""
    computed: Array
    """(6, 3): its angles."""

    @property
    def difference(self) -> Array:
        """(6, 3): computed less published, rad."""
        return self.computed - self.published

    @property
    def rms(self) -> float:
        """Root of the mean square of the differences, rad."""
        return float(np.sqrt(np.mean(self.difference**2)))

    @property
    def row_rms(self) -> Array:
        """(6,): the same for each row, rad."""
        result: Array = np.sqrt(np.mean(self.difference**2, axis=-1))
        return result

    @property
    def largest(self) -> float:
        """The largest size of a difference, rad."""
        return float(np.max(np.abs(self.difference)))

    @property
    def squared_cosines(self) -> Array:
        """(6,): sum of the squared cosines of the published angles, 1 for the angles of one direction."""
        result: Array = np.sum(np.cos(self.published) ** 2, axis=-1)
        return result


@dataclass(frozen=True)
class Fit:
    """The geometry that comes nearest to Table I."""

    radii: Array
    """(3,): e of the platform, E_1 of the base joints on the rod, E_2 of the others; m."""
    start: Array
    """(3,): the same of the mechanism that the search began with, m."""
    mechanism: Mechanism
    orientations: Orientations
    """Of that mechanism, from all its assembly modes."""


def table_i(mech: Mechanism) -> Orientations:
    """The published orientations of Table I beside those that `mech` has at the published leg lengths.

    Every row has several assembly modes [T28]; the print does not say which it means. Chosen is, of the modes
    above the base, the one with the least sum of squared differences of the three angles.

    Raises:
        ShapeError: `mech` has not five legs.
        UnsupportedError: `mech` has no finite set of assembly modes.
    """
    lengths, published = _published()
    modes = mech.assembly_modes(lengths)
    angles = _angles(modes.pose)
    misfit = np.sum((angles - published[:, None]) ** 2, axis=-1)
    misfit = np.where((modes.above == 1) & np.isfinite(misfit), misfit, np.inf)
    # A row of NaN at the end stands for a mode that is not there.
    pose = np.concatenate([modes.pose, np.full((len(lengths), 1, 4, 4), np.nan)], axis=1)
    misfit = np.concatenate([misfit, np.full((len(lengths), 1), np.inf)], axis=1)
    best = np.argmin(misfit, axis=1)
    chosen = np.where(np.isfinite(np.min(misfit, axis=1)), best, -1)
    pose = pose[np.arange(len(lengths)), chosen]
    return Orientations(lengths, published, modes, angles, chosen, pose, _angles(pose))


def fit_table_i(mech: Mechanism) -> Fit:
    """The radii e, E_1 and E_2 with the least sum of squares of the 18 differences to Table I.

    The search begins with the radii of `mech` and ends at the least sum near them. The modes are those of
    `table_i(mech)`, followed from pose to pose [T27]. With the radii, rod and home move so that the
    rod passes through its base joints and the plane of r_1 and r_3 is upright at home: their y is E_1 sin θ
    and (E_1 - e) sin θ, θ the angle of the first leg on the rod.

    Raises:
        UnsupportedError: the joints' centres are not given by radius and angle with three radii in all, as in
            the paper's design, or a row of Table I has no mode.
    """
    data = mech.to_dict()
    unit = data["units"]["length"]
    start = _radii(data, mech.name)
    first = table_i(mech)
    if np.any(first.chosen < 0):
        raise UnsupportedError(f"{mech.name}: has no assembly mode above the base for every row of Table I")
    lengths, published = first.lengths, first.published
    poses = first.pose.copy()

    def difference(radii: Array) -> Array:
        found = _with_radii(data, radii).forward_kinematics(lengths, poses).pose
        if np.all(np.isfinite(found)):
            poses[:] = found  # the guess for the next geometry; what is not finite makes the search step back
        return (_angles(found) - published).ravel()

    search = least_squares(
        difference, start, jac="3-point", diff_step=[_STEP] * 3, xtol=1e-12, ftol=1e-12, gtol=1e-12
    )
    fitted = _with_radii(data, search.x)
    return Fit(to_si(search.x, "length", unit), to_si(start, "length", unit), fitted, table_i(fitted))


def fit_markdown(first: Orientations, fit: Fit) -> str:
    """Table I in Markdown, in degrees: published, computed before the fit, and computed after it."""
    columns = (first.published, first.computed, fit.orientations.computed)
    lines = ["| row | φ_zX, φ_zY, φ_zZ / °, published | computed | fitted |", "|---|---|---|---|"]
    for row, angles in enumerate(np.degrees(np.stack(columns, axis=1)), 1):
        cells = (", ".join(f"{angle:.2f}" for angle in three) for three in angles)
        lines.append(f"| {row} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _published() -> tuple[Array, Array]:
    """Lengths (6, 5), m, and angles (6, 3), rad, of Table I."""
    table = np.array(TABLE_I)
    return to_si(table[:, :5], "length", "mm"), np.radians(table[:, 5:])


def _angles(pose: Array) -> Array:
    """(..., 3): angles of the platform's z with X, Y and Z of (..., 4, 4), rad."""
    result: Array = np.arccos(np.clip(pose[..., :3, 2], -1.0, 1.0))
    return result


def _radii(data: dict[str, Any], name: str) -> Array:
    """(3,): e, E_1 and E_2 in the file's unit."""
    groups: tuple[set[float], ...] = (set(), set(), set())
    for leg in data["legs"]:
        for end, group in ((leg["platform"], 0), (leg["base"], 1 if "rod" in leg["base"] else 2)):
            point = end["point"]
            if not isinstance(point, dict) or "radius" not in point:
                raise UnsupportedError(f"{name}: the joints of its legs must be given by radius and angle")
            groups[group].add(float(point["radius"]))
    if [len(group) for group in groups] != [1, 1, 1] or len(data.get("rods", [])) != 1:
        raise UnsupportedError(
            f"{name}: must have one rod, one radius for all platform joints, one for the base joints on the "
            "rod and one for the other base joints"
        )
    return np.array([group.pop() for group in groups])


def _with_radii(data: dict[str, Any], radii: Array) -> Mechanism:
    """The mechanism of a file's content with other radii e, E_1, E_2, in the file's unit."""
    mech = copy.deepcopy(data)
    e, rod, base = (float(radius) for radius in radii)
    for leg in mech["legs"]:
        leg["platform"]["point"]["radius"] = e
        leg["base"]["point"]["radius"] = rod if "rod" in leg["base"] else base
    on_rod = next(leg for leg in mech["legs"] if "rod" in leg["base"])
    _, sine = cos_sin(on_rod["base"]["point"]["angle"], mech["units"]["angle"])
    mech["rods"][0]["point"][1] = rod * sine
    mech["home"]["position"][1] = (rod - e) * sine
    return Mechanism.from_dict(mech)
