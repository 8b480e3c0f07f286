"""Slices of the pose space: two or three coordinates vary over fixed others, dependent ones follow [T42].

The constant-orientation workspace, the orientation workspace at a point and every mixture of both are slices.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from polypod.errors import CoordinateError, WorkspaceError, alternatives
from polypod.mechanism import Mechanism
from polypod.workspaces.boundary import Cuts, open_edges
from polypod.workspaces.search_region import Grid, Progress, bounds_of, checked_start, grid_of
from polypod.workspaces.workspace import (
    EDGE_OF_GRID,
    NO_POSE,
    SINGULARITY,
    Workspace,
    enclosed,
    label_names,
    with_floor,
)

Array = NDArray[np.float64]
Aspects = NDArray[np.int8]

CELLS = {2: 200, 3: 60}
"""Cells along each of the bounds by default, by the number of coordinates that vary.

Without a step the grid is laid again about what the first found, until that is whole.
"""

TILT = ("x", "y", "z", "azimuth", "tilt", "torsion")
"""Position of the tool tip, direction of the tool axis in spherical angles, rotation about it [T42]."""

_MARGIN = 3.5
"""Cells that are at least added to what a first grid found."""

_ZOOMS = 6
"""Times that the grid is laid closer."""

_CHUNK = 50_000
"""States evaluated at once: memory does not grow with the grid."""

_BISECTIONS = 36
"""Halvings of an edge: 2e-11 of its length remains."""


class _Judged(NamedTuple):
    """States of the nodes of a slice."""

    pose: Array
    """(n, 4, 4)."""
    aspect: Aspects
    """(n,): 0 for a state that is not inside; else 1, or the sign of det J if aspects are kept apart."""


class _Slice:
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
        self.tilted = _check_names(mech, self.vary, self.fix)

    def states(self, values: Array) -> tuple[Array, NDArray[np.uint8]]:
        """Poses (n, 4, 4) and status of values (n, d)."""
        given: dict[str, ArrayLike] = dict(zip(self.vary, values.T, strict=True)) | self.fix
        if self.tilted:
            given = _tool(given)
        state = self.mech.state(given, branch=self.branch, guess=self.start)
        return state.pose, state.status

    def judge(self, values: Array) -> _Judged:
        """Which values (n, d) are inside: they have a pose, and it keeps all limits."""
        pose, _ = self.states(values)
        inside = self.mech.limits(pose).within
        if not self.keep_aspect:
            return _Judged(pose, inside.astype(np.int8))
        sign = np.sign(self.mech.determinant(pose).determinant)
        return _Judged(pose, np.where(inside & np.isfinite(sign), sign, 0).astype(np.int8))

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


def sliced(
    mech: Mechanism,
    vary: Sequence[str],
    fix: Mapping[str, float] | None = None,
    *,
    step: float | Mapping[str, float] | None = None,
    bounds: Mapping[str, Sequence[float]] | None = None,
    start: ArrayLike | None = None,
    branch: int = +1,
    keep_aspect: bool = False,
    sigma_min: float | None = None,
    progress: Progress | None = None,
) -> Workspace:
    """The values that two or three coordinates can take together; see `polypod.workspace`."""
    mech = with_floor(mech, sigma_min)
    pose = None if start is None else checked_start(mech, start)
    cut = _Slice(mech, vary, fix or {}, branch, pose, keep_aspect)
    box = bounds_of(mech, cut.vary, bounds)
    grid = grid_of(box, step, CELLS[len(cut.vary)])
    mask, aspect = _component(cut, grid, _evaluate(cut, grid, progress))
    if step is None:
        for _ in range(_ZOOMS):
            closer = _around(grid, mask, box, bounds or {})
            grid = grid_of(closer, None, CELLS[len(cut.vary)])
            mask, aspect = _component(cut, grid, _evaluate(cut, grid, progress))
            if not _cut_off(mask, closer, box):
                break
    cuts, labels, poses = _bisect(cut, grid, mask, aspect)
    inputs = {
        "fixed": {name: float(value) for name, value in cut.fix.items()},
        "branch": branch,
        "start": None if pose is None else pose.tolist(),
        "keep_aspect": keep_aspect,
        "sigma_min": sigma_min,
    }
    return enclosed("slice", mech, grid, mask, cuts, labels, poses, inputs)


def _check_names(mech: Mechanism, vary: tuple[str, ...], fix: Mapping[str, float]) -> bool:
    """Whether the names are those of `TILT`. Raises for names that make up no coordinates."""
    if len(vary) not in CELLS or len({*vary}) < len(vary):
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


def _evaluate(cut: _Slice, grid: Grid, progress: Progress | None) -> Aspects:
    """The aspect of every node, flat."""
    axes = grid.axes()
    result = np.zeros(grid.nodes, dtype=np.int8)
    for first in range(0, grid.nodes, _CHUNK):
        nodes = np.arange(first, min(first + _CHUNK, grid.nodes))
        places = np.unravel_index(nodes, grid.counts)
        values = np.stack([axis[place] for axis, place in zip(axes, places, strict=True)], axis=1)
        result[nodes] = cut.judge(values).aspect
        if progress is not None:
            progress(int(nodes[-1]) + 1, grid.nodes)
    return result


def _component(cut: _Slice, grid: Grid, aspects: Aspects) -> tuple[NDArray[np.bool_], int]:
    """The connected nodes of one aspect with the start, or without a start the most; and the aspect."""
    shaped = aspects.reshape(grid.counts)
    found = [(np.asarray(ndimage.label(shaped == aspect)[0]), aspect) for aspect in (1, -1)]
    if cut.start is None:
        sizes = [np.bincount(labels.ravel())[1:] for labels, _ in found]
        best = max(range(2), key=lambda i: sizes[i].max(initial=0))
        if not len(sizes[best]):
            raise WorkspaceError(
                f"no node of the grid of {' x '.join(map(str, grid.counts))} is inside all limits: other "
                "fixed values, other bounds or a smaller step may help"
            )
        labels, aspect = found[best]
        return labels == 1 + int(np.argmax(sizes[best])), aspect
    values = cut.coordinates(cut.start)
    place = np.rint((values - grid.origin) / grid.steps).astype(np.int64)
    if (place < 0).any() or (place >= np.array(grid.counts)).any():
        raise WorkspaceError(f"start: {_named(cut.vary, values)} is outside the bounds")
    for labels, aspect in found:
        if number := labels[tuple(place)]:
            return labels == number, aspect
    raise WorkspaceError(f"start: the node next to {_named(cut.vary, values)} is not inside all limits")


def _around(
    grid: Grid, mask: NDArray[np.bool_], box: Mapping[str, tuple[float, float]], given: Mapping[str, Any]
) -> dict[str, tuple[float, float]]:
    """Bounds some cells wider than what was found, for coordinates whose bounds are not given."""
    bounds = {}
    for k, (name, (least, greatest)) in enumerate(box.items()):
        others = tuple(i for i in range(mask.ndim) if i != k)
        nodes = grid.axes()[k][mask.any(axis=others)]
        margin = max(_MARGIN * grid.steps[k], 0.2 * (nodes[-1] - nodes[0]))
        low, high = nodes[0] - margin, nodes[-1] + margin
        bounds[name] = (least, greatest) if name in given else (max(least, low), min(greatest, high))
    return bounds


def _cut_off(
    mask: NDArray[np.bool_], closer: Mapping[str, tuple[float, float]], box: Mapping[str, tuple[float, float]]
) -> bool:
    """Whether the mask reaches an end of the closer bounds that lies within the first ones."""
    return any(
        mask.take(node, axis=k).any() and closer[name][end] != box[name][end]
        for k, name in enumerate(box)
        for end, node in enumerate((0, -1))
    )


def _named(names: Sequence[str], values: Array) -> str:
    return ", ".join(f"{name} = {value:.4g}" for name, value in zip(names, values, strict=True))


def _bisect(
    cut: _Slice, grid: Grid, mask: NDArray[np.bool_], aspect: int
) -> tuple[Cuts, NDArray[np.int64], Array]:
    """The cuts of all open edges, what ends the workspace there, and the last poses."""
    node, direction = open_edges(mask)
    place = np.stack(np.unravel_index(node, grid.counts), axis=1)
    axis, rows = direction // 2, np.arange(len(node))
    way = np.zeros(place.shape)
    way[rows, axis] = np.where(direction % 2, 1.0, -1.0)
    beyond = place[rows, axis] + way[rows, axis]
    ends = (beyond < 0) | (beyond >= np.array(grid.counts)[axis])
    whole = np.where(
        ends, 0.5, 1.0
    )  # nodes are the middles of cells: where the grid ends, so does the last cell

    share = np.empty(len(node))
    labels = np.empty(len(node), dtype=np.int64)
    poses = np.empty((len(node), 4, 4))
    edge_of_grid = label_names(cut.mech).index(EDGE_OF_GRID)
    for first in range(0, len(node), _CHUNK):
        part = slice(first, first + _CHUNK)

        def at(t: Array, part: slice = part) -> Array:
            return grid.origin + grid.steps * (place[part] + t[:, None] * way[part])

        high = whole[part].copy()
        open = ends[part] & (cut.judge(at(high)).aspect == aspect)
        low = np.where(open, high, 0.0)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            inside = cut.judge(at(middle)).aspect == aspect
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        share[part], poses[part] = low, cut.judge(at(low)).pose
        labels[part] = np.where(open, edge_of_grid, cut.stops(at(high)))
    return Cuts(node, direction, share), labels, poses
