"""The reachable workspace: all positions of o, whatever the orientation [T39, T40]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod import _core
from polypod.errors import WorkspaceError
from polypod.files.units import readable
from polypod.mechanism import Mechanism
from polypod.workspaces.boundary import Cuts
from polypod.workspaces.causes import EDGE_OF_GRID, NO_POSE, SINGULARITY, label_names
from polypod.workspaces.enclosing import Boundary, enclosed
from polypod.workspaces.extremes import Extremes, extremes
from polypod.workspaces.pose_search import PoseSpace
from polypod.workspaces.reachable_region import moves_freely, region_from, wider
from polypod.workspaces.search_region import (
    MOST_NODES,
    ROUNDING,
    Grid,
    Progress,
    bounds_of,
    check_size,
    check_threads,
    grid_of,
    own_coordinates,
    start_of,
)
from polypod.workspaces.workspace import Workspace, with_floor

Array = NDArray[np.float64]

CELLS = 64
"""Cells along the longest side of the workspace by default."""

_TRIALS = 8
"""Times that the grid is laid: wider where the workspace leaves it, finer where it fills little of it."""

_MUCH = 0.6
"""Part of a grid's longest side that the workspace fills, at least, without a finer grid."""

_MORE = 0.2
"""Part of what was found that is added on each side for the finer grid."""

_FINER = 8
"""By how much a default grid is finer at most, where from the start no node of a coarser one is reached."""

_HALVINGS = 12
"""Times that a step that is too coarse is halved to find one that is not."""


def reachable(
    mech: Mechanism,
    *,
    step: float | None = None,
    bounds: Mapping[str, Sequence[float]] | None = None,
    start: ArrayLike | None = None,
    keep_aspect: bool = False,
    sigma_min: float | None = None,
    threads: int = 0,
    progress: Progress | None = None,
) -> Workspace:
    """The positions of o that can be reached from a start pose; see `polypod.workspace`."""
    mech = with_floor(mech, sigma_min)
    check_threads(threads)
    outer = bounds_of(mech, ("x", "y", "z"), bounds)
    most = (
        np.array(list(outer.values()))
        if _one(step) is None
        else grid_of(outer, step, CELLS, cubic=True).bounds()
    )
    pose = start_of(mech, start, most, regular=keep_aspect)
    if not ((pose[:3, 3] >= most[:, 0]) & (pose[:3, 3] <= most[:, 1])).all():
        raise WorkspaceError(f"start: o is at {_place(pose[:3, 3])}, outside the bounds")
    if not moves_freely(mech, pose):
        raise WorkspaceError(_not_free(mech, pose))
    region = region_from(mech, pose, most)
    flood, grid, box = _whole(mech, pose, outer, step, region, keep_aspect, threads, progress)
    mask = flood.mask().reshape(grid.counts)
    edges = flood.edges()
    # The core's codes below zero count from the end, in this order.
    names = label_names(mech)
    ends = np.array([names.index(name) for name in (NO_POSE, EDGE_OF_GRID, SINGULARITY)])
    stop = edges["stop"]
    labels = np.where(stop >= 0, stop, ends[np.minimum(stop, -1) + 3])

    def space(boundary: Boundary) -> PoseSpace:
        return PoseSpace(mech, boundary.poses, box, aspect=keep_aspect, threads=threads)

    return enclosed(
        "reachable",
        mech,
        grid,
        mask,
        Cuts(edges["node"], edges["direction"], edges["share"]),
        labels,
        edges["pose"],
        {"start": pose.tolist(), "keep_aspect": keep_aspect, "sigma_min": sigma_min},
        space,
    )


def extremes_within(found: Workspace, bounds: Mapping[str, Sequence[float]]) -> Extremes:
    """The ends of the part of a reachable workspace that lies within bounds of x, y, z, m [T76].

    Raises WorkspaceError where no vertex of the boundary lies there.
    """
    mech = with_floor(found.mechanism, found.inputs["sigma_min"])
    grid = {name: tuple(found.inputs["bounds"][name]) for name in found.names}
    box = np.array(list(bounds_of(mech, found.names, grid | dict(bounds)).values()))
    part = ((found.vertices >= box[:, 0]) & (found.vertices <= box[:, 1])).all(axis=1)
    if not part.any():
        raise WorkspaceError("bounds: no place of the boundary lies within them")
    space = PoseSpace(mech, found.poses[part], box, aspect=found.inputs["keep_aspect"])
    steps = np.array([found.inputs["step"][name] for name in found.names])
    labels = [found.label_names[i] for i in found.labels[part]]
    return extremes(found.vertices[part], steps, found.poses[part], labels, space.search)


def _whole(
    mech: Mechanism,
    pose: Array,
    outer: Mapping[str, tuple[float, float]],
    step: float | None,
    region: Array,
    keep_aspect: bool,
    threads: int,
    progress: Progress | None,
) -> tuple[_core.Flood, Grid, Array]:
    """The flood from a pose, its grid, and the box (3, 2) of the outer bounds.

    The grid lies about a region (3, 2); it is laid again where the workspace leaves it, and without a step
    where the workspace fills little of it.
    """
    most = grid_of(outer, step, CELLS, cubic=True).bounds()
    if not np.ptp(region, axis=1).all():
        region = most
    finer = 1
    for trial in range(_TRIALS):
        width = float(np.ptp(region, axis=1).max()) / (CELLS * finer) if step is None else step
        whole = grid_of(outer, width, CELLS, cubic=True)
        grid = check_size(whole.within(region))
        if step is None and _begin(mech, grid, pose, keep_aspect, threads) is None and finer < _FINER:
            finer *= 2
            continue
        flood = _flood(mech, grid, pose, keep_aspect, threads, progress)
        mask = flood.mask().reshape(grid.counts)
        cut_off, found = _cut_off(mask, grid, whole.bounds()), _found(mask, grid)
        if cut_off.any():
            region = most if trial == _TRIALS - 2 else np.where(cut_off, wider(region, 1.0, most), region)
        elif step is None and np.ptp(found, axis=1).max() < _MUCH * np.ptp(region, axis=1).max():
            region = wider(found, _MORE, most)
        else:
            break
    return flood, grid, whole.bounds()


def _flood(
    mech: Mechanism, grid: Grid, pose: Array, keep_aspect: bool, threads: int, progress: Progress | None
) -> _core.Flood:
    """The flood from a pose to its end."""
    flood = _begin(mech, grid, pose, keep_aspect, threads)
    if flood is None:
        raise WorkspaceError(_too_coarse(mech, grid, pose, keep_aspect, threads))
    inside = 1
    while new := flood.wave() or flood.retry():
        inside += new
        if progress is not None:
            progress(inside, grid.nodes)
    return flood


def _begin(mech: Mechanism, grid: Grid, pose: Array, keep_aspect: bool, threads: int) -> _core.Flood | None:
    return _core.Flood.begin(
        mech._core,
        grid.origin.tolist(),
        float(grid.steps[0]),
        list(grid.counts),
        np.ascontiguousarray(pose).reshape(-1),
        keep_aspect,
        threads,
    )


def _cut_off(mask: NDArray[np.bool_], grid: Grid, box: Array) -> NDArray[np.bool_]:
    """(3, 2): which sides of the grid the workspace reaches that are no sides of the box."""
    ends = grid.bounds()
    inner = np.abs(ends - box) > ROUNDING * grid.steps[:, None]
    inner &= np.stack([ends[:, 0] > box[:, 0], ends[:, 1] < box[:, 1]], axis=1)
    reached = [[mask.take(end, axis=k).any() for end in (0, -1)] for k in range(3)]
    return np.asarray(inner & np.array(reached))


def _found(mask: NDArray[np.bool_], grid: Grid) -> Array:
    """(3, 2): ends of the cells that were reached."""
    ends = [np.flatnonzero(mask.any(axis=tuple(i for i in range(3) if i != k)))[[0, -1]] for k in range(3)]
    return grid.origin[:, None] + grid.steps[:, None] * np.add(ends, (-0.5, 0.5))


def _too_coarse(mech: Mechanism, grid: Grid, pose: Array, keep_aspect: bool, threads: int) -> str:
    """That no node can be reached from the start, and a step with which one can."""
    place, width = _place(pose[:3, 3]), float(grid.steps[0])
    told = f"step: from o at {place} no node of a grid of {readable(width, 'm')} is reached inside the limits"
    bounds = dict(zip(grid.names, grid.bounds().tolist(), strict=True))
    for _ in range(_HALVINGS):
        width *= 0.5
        finer = grid_of(bounds, width, CELLS, cubic=True)
        if finer.nodes > MOST_NODES:
            break
        if _begin(mech, finer, pose, keep_aspect, threads) is not None:
            return f"{told}; with {readable(width, 'm')} one is"
    return f"{told}; another start may help"


def _not_free(mech: Mechanism, pose: Array) -> str:
    """That o does not move freely, and what to do instead."""
    told = f"o cannot move in every direction from {_place(pose[:3, 3])}: its positions fill no volume there"
    if mech.dof in (2, 3):
        return f"{told}; take a slice over {', '.join(own_coordinates(mech))}"
    return f"{told}; take a slice over two or three coordinates, or another start"


def _one(step: float | None) -> float | None:
    if isinstance(step, Mapping):
        raise WorkspaceError("step: the cells of the reachable workspace are cubes; give one number, m")
    return step


def _place(o: ArrayLike) -> str:
    return "({}) mm".format(", ".join(f"{1e3 * x:.1f}" for x in np.asarray(o)))
