"""From a mask over a grid and the cuts around it to a workspace: mesh, ends, volume, and their errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from polypod.mechanism import Mechanism
from polypod.workspaces.boundary import Cuts, content_with_error, surface
from polypod.workspaces.causes import label_names
from polypod.workspaces.extremes import Search, extremes
from polypod.workspaces.sampling import sampled_difference
from polypod.workspaces.search_region import Grid
from polypod.workspaces.workspace import Workspace

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Boundary(NamedTuple):
    """Places on the boundary of a workspace."""

    values: Array
    """(v, d): coordinates."""
    poses: Array
    """(v, 4, 4)."""


class Space(Protocol):
    """What a workspace is a part of, in which single places can be asked about, from its boundary."""

    samples: int
    """Places of each kind that are tried for the error of the volume."""

    def search(self, axis: int, sense: int, start: int) -> Search:
        """The search for an end of a coordinate from a place of the boundary."""

    def reaches(self, values: Array) -> NDArray[np.bool_]:
        """(n,): which values (n, d) belong to the workspace."""


def enclosed(
    kind: str,
    mech: Mechanism,
    grid: Grid,
    mask: NDArray[np.bool_],
    cuts: Cuts,
    labels: Indices,
    poses: Array,
    inputs: dict[str, Any],
    space: Callable[[Boundary], Space],
) -> Workspace:
    """The workspace of a mask and the cuts around it; labels and poses are those of the cuts."""
    shape = surface(mask, cuts)
    names = label_names(mech)
    boundary = Boundary(grid.origin + grid.steps * shape.places, poses[shape.cut])
    searched = space(boundary)
    ends = extremes(
        boundary.values, grid.steps, boundary.poses, [names[i] for i in labels[shape.cut]], searched.search
    )
    cell = float(np.prod(grid.steps))
    volume, error = content_with_error(mask, cuts, shape)
    difference = sampled_difference(
        mask,
        shape,
        (ends.values - grid.origin[:, None]) / grid.steps[:, None],
        lambda places: searched.reaches(grid.origin + grid.steps * places),
        searched.samples,
    )
    return Workspace(
        kind=kind,
        names=grid.names,
        axes=grid.axes(),
        mask=mask,
        vertices=boundary.values,
        faces=shape.faces,
        labels=labels[shape.cut],
        label_names=names,
        poses=boundary.poses,
        extremes=ends,
        volume=cell * volume,
        volume_error=cell * max(error, difference.bound),
        inputs={
            "mechanism": mech.name,
            "mechanism_file": mech.to_toml(),
            "bounds": dict(zip(grid.names, grid.bounds().tolist(), strict=True)),
            "step": dict(zip(grid.names, grid.steps.tolist(), strict=True)),
            **inputs,
        },
    )
