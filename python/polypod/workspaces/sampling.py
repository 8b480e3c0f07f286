"""How far the volume of a workspace's mesh is off, from places tried one by one [T43].

The mesh knows the workspace at the nodes of its grid and along the edges between them. Places in between,
drawn at random, are tried on their own; where these and the mesh disagree, parts thinner than a cell or nodes
that the search missed show up.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polypod.workspaces.boundary import Surface

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]

SEED = 1
"""Of the places: the same workspace has the same error each time."""


class Difference(NamedTuple):
    """Of the true volume and that of the mesh, in cells."""

    mean: float
    """True volume less that of the mesh."""
    deviation: float
    """Standard deviation of the mean."""

    @property
    def bound(self) -> float:
        """What the difference does not exceed, at about 95 of 100 drawings."""
        return abs(self.mean) + 2.0 * self.deviation


def sampled_difference(
    mask: Mask, shape: Surface, box: Array, reaches: Callable[[Array], Mask], samples: int
) -> Difference:
    """The difference of the true volume and that of the mesh.

    Three strata: cells that the boundary passes, those inside and those outside. In each, the variance is
    that of a share of as many places, with one more of either outcome, so that it is never zero.

    Args:
        mask: (n_1, ..., n_d) nodes inside.
        shape: the mesh, in steps.
        box: (d, 2) where the workspace can be, in steps.
        reaches: whether places (n, d), in steps, are reached.
        samples: places in each stratum.
    """
    low = np.floor(box[:, 0]).astype(np.int64)
    high = np.maximum(np.ceil(box[:, 1]).astype(np.int64), low + 1)
    corners = _corners(mask, low, high)
    count = 2**mask.ndim
    rng = np.random.default_rng(SEED)
    mean = variance = 0.0
    for stratum in ((corners > 0) & (corners < count), corners == count, corners == 0):
        cells = np.argwhere(stratum)
        if not len(cells):
            continue
        places = low + cells[rng.integers(len(cells), size=samples)] + rng.random((samples, mask.ndim))
        within = np.all((places >= box[:, 0]) & (places <= box[:, 1]), axis=1)
        reached = np.zeros(samples, bool)
        reached[within] = reaches(places[within])
        meshed = enclosed(shape, places)
        more, less = int((reached & ~meshed).sum()), int((meshed & ~reached).sum())
        mean += len(cells) * (more - less) / samples
        share = (more + less + 1.0) / (samples + 2.0)
        variance += len(cells) ** 2 * share / samples
    return Difference(mean, float(np.sqrt(variance)))


def _corners(mask: Mask, low: Indices, high: Indices) -> Indices:
    """How many corners inside each cell between nodes has, in a box of nodes that may leave the grid."""
    size = high - low + 1
    nodes = np.zeros(size, np.int64)
    to = tuple(
        slice(max(-a, 0), max(min(n, b + 1) - a, 0)) for a, b, n in zip(low, high, mask.shape, strict=True)
    )
    of = tuple(slice(max(a, 0), min(n, b + 1)) for a, b, n in zip(low, high, mask.shape, strict=True))
    nodes[to] = mask[of]
    for axis in range(mask.ndim):
        first, second = [slice(None)] * mask.ndim, [slice(None)] * mask.ndim
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        nodes = nodes[tuple(first)] + nodes[tuple(second)]
    return nodes


def enclosed(shape: Surface, places: Array) -> Mask:
    """Which places (n, d) lie within a closed mesh, by the faces that a ray along the last axis crosses.

    Faces lie between neighbouring nodes, so that a ray meets those of its own column of cells only.
    """
    d = places.shape[1]
    corners = shape.places[shape.faces]
    column = np.floor(corners[..., :-1].mean(axis=1)).astype(np.int64)
    own = np.floor(places[:, :-1]).astype(np.int64)
    low = np.minimum(column.min(axis=0, initial=0), own.min(axis=0, initial=0))
    span = np.maximum(column.max(axis=0, initial=0), own.max(axis=0, initial=0)) - low + 1
    faces, keys = (np.ravel_multi_index(tuple((of - low).T), tuple(span)) for of in (column, own))
    order = np.argsort(faces, kind="stable")
    first, last = (np.searchsorted(faces[order], keys, side) for side in ("left", "right"))
    number = last - first
    place = np.repeat(np.arange(len(places)), number)
    face = order[np.repeat(first - (np.cumsum(number) - number), number) + np.arange(len(place))]
    # Weights of the corners that make up the place, seen along the ray.
    base = np.ones((len(face), d, d))
    base[:, :-1] = corners[face][..., :-1].transpose(0, 2, 1)
    along_ray = np.linalg.det(base) == 0.0
    base[along_ray] = np.eye(d)
    aim = np.concatenate([places[place, :-1], np.ones((len(place), 1))], axis=1)
    weights = np.linalg.solve(base, aim[..., None])[..., 0]
    above = np.sum(weights * corners[face][..., -1], axis=1) > places[place, -1]
    crossed = ~along_ray & above & (weights >= 0.0).all(axis=1)
    crossings = np.bincount(place[crossed], minlength=len(places))
    return np.asarray(crossings % 2 == 1)
