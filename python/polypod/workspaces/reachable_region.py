"""Where the reachable workspace is looked for: as far as o goes from a start pose [T40]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polypod import _core
from polypod.mechanism import Mechanism
from polypod.workspaces.extremes import optimum
from polypod.workspaces.pose_search import PoseSpace

Array = NDArray[np.float64]

_MORE = 0.02
"""Part of a region's size that is added on each side: the boundary lies within the grid."""

_FLAT = 1e-6
"""Velocities of o, relative to the largest by a unit of twist in characteristic lengths, that are none."""


def region_from(mech: Mechanism, start: Array, outer: Array) -> Array:
    """(3, 2): ends of the positions of o that optimisation from a start pose finds, within `outer` (3, 2).

    They may be too near where the optimum is a local one, and too far where it lies behind a limit.
    """
    space = PoseSpace(mech, start[None], outer)
    ends = np.array(outer)
    for axis in range(3):
        for end, sense in enumerate((-1, 1)):
            search = space.search(axis, sense, 0)
            x = optimum(search)
            if x is not None:
                ends[axis, end] = search.value(x)
    o = start[:3, 3]
    ends = np.stack([np.minimum(ends[:, 0], o), np.maximum(ends[:, 1], o)], axis=1)
    return wider(ends, _MORE, outer)


def wider(region: Array, share: float, outer: Array) -> Array:
    """A region (3, 2) with more of its size on each side, within `outer`."""
    more = share * np.ptp(region, axis=1).max()
    return np.stack(
        [np.maximum(region[:, 0] - more, outer[:, 0]), np.minimum(region[:, 1] + more, outer[:, 1])], axis=1
    )


def moves_freely(mech: Mechanism, pose: Array) -> bool:
    """Whether o can move in every direction from a pose (4, 4)."""
    coordinates = np.zeros(np.count_nonzero(mech.moves_feet))
    bounds = _core.pose_bounds(mech._core, np.ascontiguousarray(pose).reshape(-1), coordinates)
    count = 6 - mech.dof  # those of the drives follow
    rows = bounds["constraints"][1][:count, :6] * np.repeat([mech.characteristic_length, 1.0], 3)
    _, sizes, axes = np.linalg.svd(np.concatenate([rows, np.zeros((6, 6))]))
    free = axes[np.count_nonzero(sizes > _FLAT * max(float(sizes[0]), 1.0)) :]
    velocities = np.linalg.svd(free[:, :3], compute_uv=False)
    return len(velocities) == 3 and bool(velocities[2] > _FLAT)
