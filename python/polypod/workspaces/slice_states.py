"""Coordinates of a slice as functions of which states are judged [T42], and the search for its ends [T76]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from polypod.errors import CoordinateError, WorkspaceError, alternatives
from polypod.mechanism import Mechanism
from polypod.workspaces.causes import NO_POSE, SINGULARITY, label_names
from polypod.workspaces.extremes import Bounded, between

Array = NDArray[np.float64]
Aspects = NDArray[np.int8]

DIMENSIONS = (2, 3)
"""How many coordinates may vary."""

TILT = ("x", "y", "z", "azimuth", "tilt", "torsion")
"""Position of the tool tip, direction of the tool axis in spherical angles, rotation about it [T42]."""

_DIFFERENCE = 1e-6
"""Half the step of a difference quotient, as a part of the slice's size."""

INSIDE = 1e-10
"""Margin, relative to its scale, by which limits are kept: rounding of dependent coordinates."""

_PIECES = 33
"""Places between two states at which the way is tried."""

_FEW = 10
"""Places between two states a cell or so apart."""

_NEARBY = 4
"""Places of the boundary from which the way to another one is tried."""


class Judged(NamedTuple):
    """States of the nodes of a slice."""

    pose: Array
    """(n, 4, 4)."""
    aspect: Aspects
    """(n,): 0 for a state that is not inside; else 1, or the sign of det J if aspects are kept apart."""


class SliceStates:
    """Some coordinates as functions of which states are judged."""

    def __init__(
        self,
        mech: Mechanism,
        vary: Sequence[str],
        fix: Mapping[str, float],
        branch: int,
        start: Array | None,
        keep_aspect: bool,
    ) -> None:
        self.mech, self.vary, self.fix = mech, tuple(vary), dict(fix)
        self.branch, self.start, self.keep_aspect = branch, start, keep_aspect
        self.tilted = check_names(mech, self.vary, self.fix)

    def states(self, values: Array) -> tuple[Array, NDArray[np.uint8]]:
        """Poses (n, 4, 4) and status of values (n, d)."""
        given: dict[str, ArrayLike] = dict(zip(self.vary, values.T, strict=True)) | self.fix
        if self.tilted:
            given = _tool(given)
        state = self.mech.state(given, branch=self.branch, guess=self.start)
        return state.pose, state.status

    def judge(self, values: Array) -> Judged:
        """Which values (n, d) are inside: they have a pose, and it keeps all limits."""
        pose, _ = self.states(values)
        inside = self.mech.limits(pose).within
        if not self.keep_aspect:
            return Judged(pose, inside.astype(np.int8))
        sign = np.sign(self.mech.determinant(pose).determinant)
        return Judged(pose, np.where(inside & np.isfinite(sign), sign, 0).astype(np.int8))

    def coordinates(self, pose: Array) -> Array:
        """(d,): the values of a pose."""
        if not self.tilted:
            chosen = self.mech.coordinates(
                pose, self.mech._set_of(dict.fromkeys((*self.vary, *self.fix), 0.0))
            )
        else:
            tool = self.mech.coordinates(pose, "tool")
            x, y, z = (tool[f"axis_{k}"] for k in "xyz")
            chosen = {k: tool[f"tip_{k}"] for k in "xyz"}
            chosen["azimuth"], chosen["tilt"] = np.arctan2(y, x), np.arctan2(np.hypot(x, y), z)
            chosen["torsion"] = tool.get("turn", np.asarray(np.nan))
        return np.array([float(chosen[name]) for name in self.vary])

    def stops(self, values: Array) -> NDArray[np.int64]:
        """For values just outside, the index of what ends the workspace there, in `label_names`."""
        names = label_names(self.mech)
        pose, _ = self.states(values)
        limits = self.mech.limits(pose)
        result = np.full(len(values), names.index(SINGULARITY))
        result[~np.isfinite(pose[:, 0, 0])] = names.index(NO_POSE)
        passed = ~limits.within & (limits.binding >= 0) & np.isfinite(pose[:, 0, 0])
        result[passed] = limits.binding[passed]
        return result


class SliceSpace:
    """The states of a slice about its boundary."""

    samples = 16384
    """Places of each kind that are tried for the error of the volume: each takes some states of a batch."""

    def __init__(
        self, cut: SliceStates, boundary: Array, box: Array, aspect: int, *, size: Array | None = None
    ) -> None:
        """About places (v, d) of one aspect in a box (d, 2); `size` (d,) is that of the places by default."""
        self.cut, self.boundary, self.box, self.aspect = cut, boundary, box, aspect
        spread = np.ptp(boundary, axis=0) if size is None else size
        self._size = np.maximum(spread, np.finfo(float).tiny)

    def search(self, axis: int, sense: int, start: int) -> SliceSearch:
        """The search for an end of a coordinate from a place of the boundary."""
        return SliceSearch(
            self.cut, self.boundary[start], axis, sense, size=self._size, box=self.box, aspect=self.aspect
        )

    def reaches(self, values: Array) -> NDArray[np.bool_]:
        """(n,): which values (n, d) are inside, and joined to the boundary by straight ways inside."""
        reached = np.zeros(len(values), bool)
        inside = np.flatnonzero(self.cut.judge(values).aspect == self.aspect)
        scale = self._size
        known = self.boundary
        while len(known) and len(left := inside[~reached[inside]]):
            near = KDTree(known / scale).query(values[left] / scale, k=min(_NEARBY, len(known)))[1]
            for nearby in near.reshape(len(left), -1).T:
                still = left[~reached[left]]
                starts = known[nearby[~reached[left]]]
                t = np.linspace(0.0, 1.0, _FEW)[1:-1, None, None]
                way = (1.0 - t) * starts + t * values[still]
                judged = self.cut.judge(way.reshape(-1, way.shape[-1])).aspect.reshape(way.shape[:2])
                reached[still] = (judged == self.aspect).all(axis=0)
            known = values[left[reached[left]]]
        return reached


class SliceSearch:
    """Coordinates about a place of the boundary, each as a part of the slice's size along it."""

    def __init__(
        self, cut: SliceStates, start: Array, axis: int, sense: int, *, size: Array, box: Array, aspect: int
    ) -> None:
        """Of a coordinate towards a sense, from a place (d,) on the boundary of a slice of one aspect."""
        self._cut, self._start, self._size, self._aspect = cut, start, size, aspect
        self.scale, self._axis = float(size[axis]), axis
        self._objective = np.zeros(len(size))
        self._objective[axis] = sense
        self.box = (box - start[:, None]) / size[:, None]
        limits = [limit.name for limit in cut.mech.limit_list]
        self.names = (*limits, *[SINGULARITY] * cut.keep_aspect)
        self.least = np.array([INSIDE] * len(limits) + [0.0] * cut.keep_aspect)
        det = cut.mech.determinant(cut.states(start[None])[0]).determinant if cut.keep_aspect else np.ones(1)
        self._det = float(det[0])

    def _positive(self, x: Array) -> Array:
        """(n, p): margins of the limits, relative to their scales, and det J if its sign is kept."""
        pose, _ = self._cut.states(self._start + self._size * x)
        margins = self._cut.mech.limits(pose).relative - INSIDE
        if not self._cut.keep_aspect:
            return margins
        det = self._cut.mech.determinant(pose).determinant / self._det
        return np.concatenate([margins, det[:, None]], axis=1)

    def at(self, x: Array) -> Bounded | None:
        """What bounds the coordinates; none where they have no pose."""
        d = len(x)
        off = _DIFFERENCE * np.eye(d)
        values = self._positive(np.concatenate([x[None], x + off, x - off]))
        if not np.isfinite(values).all():
            return None
        rows = ((values[1 : d + 1] - values[d + 1 :]) / (2.0 * _DIFFERENCE)).T
        none = np.zeros(0), np.zeros((0, d))
        return Bounded(none, (values[0], rows), (float(self._objective @ x), self._objective))

    def values(self, x: Array) -> Array:
        """(d,): the coordinates."""
        return self._start + self._size * x

    def value(self, x: Array) -> float:
        """The coordinate."""
        return float(self.values(x)[self._axis])

    def reached(self, way: Array) -> Array | None:
        """The pose at the end of straight ways from place to place (w, d), if all are inside; else none."""
        judged = self._cut.judge(self._start + self._size * between(way, _PIECES))
        return judged.pose[-1] if (judged.aspect == self._aspect).all() else None


def check_names(mech: Mechanism, vary: tuple[str, ...], fix: Mapping[str, float]) -> bool:
    """Whether the names are those of `TILT`. Raises for names that make up no coordinates."""
    if len(vary) not in DIMENSIONS or len({*vary}) < len(vary):
        raise WorkspaceError(
            f"vary is {', '.join(vary) or 'empty'}; needs two or three different coordinates"
        )
    if twice := {*vary} & {*fix}:
        raise WorkspaceError(f"fix.{min(twice)}: varies, and cannot be fixed")
    for name, value in fix.items():
        if not np.isfinite(np.float64(value)):
            raise WorkspaceError(f"fix.{name} is {value!r}; must be a finite number, m or rad")
    names = {*vary, *fix}
    if not names & {*TILT[3:]}:
        mech._set_of(dict.fromkeys((*vary, *fix), 0.0))
        return False
    if "tool" not in mech.coordinate_sets:
        raise CoordinateError(f"{mech.name} has no tool axis to tilt: that needs 5 or 6 degrees of freedom")
    needed = TILT[: mech.dof]
    if names != {*needed}:
        wrong = [n for n in (*vary, *fix) if n not in needed]
        hint = f"; {wrong[0]!r} is none: {alternatives(wrong[0], needed)}" if wrong else ""
        raise CoordinateError(f"tilt and torsion need all of {', '.join(needed)}, varied or fixed{hint}")
    return True


def _tool(given: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
    """The tool coordinates of azimuth, tilt and torsion [T42]."""
    azimuth, tilt = (np.asarray(given[name], dtype=np.float64) for name in ("azimuth", "tilt"))
    tool = {f"tip_{k}": given[k] for k in "xyz"}
    tool["axis_x"], tool["axis_y"] = np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth)
    tool["axis_z"] = np.cos(tilt)
    if "torsion" in given:
        tool["turn"] = given["torsion"]
    return tool
