"""The reachable workspace: all positions of o, whatever the orientation [T39, T40]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from polypod import _core
from polypod.errors import WorkspaceError
from polypod.mechanism import Mechanism
from polypod.workspaces.boundary import Cuts
from polypod.workspaces.search_region import (
    Progress,
    bounds_of,
    check_threads,
    grid_of,
    own_coordinates,
    start_of,
)
from polypod.workspaces.workspace import (
    EDGE_OF_GRID,
    NO_POSE,
    SINGULARITY,
    Workspace,
    enclosed,
    label_names,
    with_floor,
)

CELLS = 64
"""Cells along the longest side of the bounds by default."""


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
    grid = grid_of(bounds_of(mech, ("x", "y", "z"), bounds), _one(step), CELLS, cubic=True)
    box = grid.bounds()
    pose = start_of(mech, start, box, regular=keep_aspect)
    if not ((pose[:3, 3] >= box[:, 0]) & (pose[:3, 3] <= box[:, 1])).all():
        raise WorkspaceError(f"start: o is at {_place(pose[:3, 3])}, outside the bounds")
    flood = _core.Flood.begin(
        mech._core,
        grid.origin.tolist(),
        float(grid.steps[0]),
        list(grid.counts),
        np.ascontiguousarray(pose).reshape(-1),
        keep_aspect,
        threads,
    )
    if flood is None:
        own = f", or a slice over {', '.join(own_coordinates(mech))}" if mech.dof in (2, 3) else ""
        raise WorkspaceError(
            f"start: from o at {_place(pose[:3, 3])} the nearest node of the grid cannot be reached within "
            f"the limits; a smaller step or another start may help{own}"
        )
    inside = 1
    while new := flood.wave() or flood.retry():
        inside += new
        if progress is not None:
            progress(inside, grid.nodes)
    edges = flood.edges()
    # The core's codes below zero count from the end, in this order.
    names = label_names(mech)
    ends = np.array([names.index(name) for name in (NO_POSE, EDGE_OF_GRID, SINGULARITY)])
    stop = edges["stop"]
    labels = np.where(stop >= 0, stop, ends[np.minimum(stop, -1) + 3])
    return enclosed(
        "reachable",
        mech,
        grid,
        flood.mask().reshape(grid.counts),
        Cuts(edges["node"], edges["direction"], edges["share"]),
        labels,
        edges["pose"],
        {"start": pose.tolist(), "keep_aspect": keep_aspect, "sigma_min": sigma_min},
    )


def _one(step: float | None) -> float | None:
    if isinstance(step, Mapping):
        raise WorkspaceError("step: the cells of the reachable workspace are cubes; give one number, m")
    return step


def _place(o: ArrayLike) -> str:
    return "({}) mm".format(", ".join(f"{1e3 * x:.1f}" for x in np.asarray(o)))
