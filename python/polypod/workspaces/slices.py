"""Slices of the pose space: two or three coordinates vary over fixed others, dependent ones follow [T42].

The constant-orientation workspace, the orientation workspace at a point and every mixture of both are slices.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from polypod.errors import WorkspaceError
from polypod.files.units import coordinate_unit, readable
from polypod.mechanism import Mechanism
from polypod.workspaces.boundary import Cuts, open_edges
from polypod.workspaces.causes import EDGE_OF_GRID, label_names
from polypod.workspaces.enclosing import Boundary, enclosed
from polypod.workspaces.extremes import optimum, roomiest
from polypod.workspaces.search_region import Grid, Progress, bounds_of, check_size, checked_start, grid_of
from polypod.workspaces.slice_states import Aspects, SliceSpace, SliceStates
from polypod.workspaces.workspace import Workspace, with_floor

Array = NDArray[np.float64]
Bounds = Mapping[str, tuple[float, float]]

CELLS = {2: 200, 3: 60}
"""Cells along each of the bounds by default, by the number of coordinates that vary.

Without a step the grid is laid again about what the first found, until that is whole.
"""

_MARGIN = 3.5
"""Cells that are at least added to what a first grid found."""

_ZOOMS = 6
"""Times that the grid is laid closer."""

_CHUNK = 50_000
"""States evaluated at once: memory does not grow with the grid."""

_BISECTIONS = 36
"""Halvings of an edge: 2e-11 of its length remains."""


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
    cut = SliceStates(mech, vary, fix or {}, branch, pose, keep_aspect)
    box = bounds_of(mech, cut.vary, bounds)
    grid = check_size(grid_of(box, step, CELLS[len(cut.vary)]))
    aspects = _evaluate(cut, grid, progress)
    if not aspects.any():
        region = _region(cut, box)
        if step is not None or region is None:
            raise WorkspaceError(_nothing_inside(grid, region))
        grid = grid_of(region, None, CELLS[len(cut.vary)])
        aspects = _evaluate(cut, grid, progress)
    mask, aspect = _component(cut, grid, aspects)
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

    def space(boundary: Boundary) -> SliceSpace:
        return SliceSpace(cut, boundary.values, grid.bounds(), aspect)

    return enclosed("slice", mech, grid, mask, cuts, labels, poses, inputs, space)


def _region(cut: SliceStates, box: Bounds) -> Bounds | None:
    """Bounds about the ends that optimisation from home or the start finds; none where nothing is inside."""
    sides = np.array(list(box.values()))
    home = cut.coordinates(cut.mech.home if cut.start is None else cut.start)
    about = SliceSpace(cut, np.clip(home, *sides.T)[None], sides, +1, size=np.ptp(sides, axis=1))
    first = about.search(0, +1, 0)
    x = roomiest(first, np.zeros(len(box))) if np.isfinite(home).all() else None
    if x is None:
        return None
    inside = SliceSpace(cut, first.values(x)[None], sides, +1, size=np.ptp(sides, axis=1))
    ends = np.repeat(inside.boundary.T, 2, axis=1)
    for k in range(len(box)):
        for end, sense in enumerate((-1, 1)):
            search = inside.search(k, sense, 0)
            found = optimum(search)
            if found is not None:
                ends[k, end] = sense * max(sense * ends[k, end], sense * search.value(found))
    more = 0.2 * np.ptp(ends, axis=1)
    low, high = np.maximum(ends[:, 0] - more, sides[:, 0]), np.minimum(ends[:, 1] + more, sides[:, 1])
    return None if (low >= high).any() else dict(zip(box, zip(low, high, strict=True), strict=True))


def _nothing_inside(grid: Grid, region: Bounds | None) -> str:
    """That no node is inside, and bounds that hold some, if they are known."""
    told = f"no node of the grid of {' x '.join(map(str, grid.counts))} is inside all limits"
    if region is None:
        return f"{told}: other fixed values, or other bounds, may help"
    steps = (
        f"{name} {readable((high - low) / CELLS[len(region)], coordinate_unit(name))}"
        for name, (low, high) in region.items()
    )
    return f"{told}; with steps of {', '.join(steps)} some are, or without a step"


def _evaluate(cut: SliceStates, grid: Grid, progress: Progress | None) -> Aspects:
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


def _component(cut: SliceStates, grid: Grid, aspects: Aspects) -> tuple[NDArray[np.bool_], int]:
    """The connected nodes of one aspect with the start, or without a start the most; and the aspect."""
    shaped = aspects.reshape(grid.counts)
    found = [(np.asarray(ndimage.label(shaped == aspect)[0]), aspect) for aspect in (1, -1)]
    if cut.start is None:
        sizes = [np.bincount(labels.ravel())[1:] for labels, _ in found]
        best = max(range(2), key=lambda i: sizes[i].max(initial=0))
        if not len(sizes[best]):
            raise WorkspaceError(_nothing_inside(grid, None))
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
    cut: SliceStates, grid: Grid, mask: NDArray[np.bool_], aspect: int
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
