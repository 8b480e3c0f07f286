"""The boundary of a set of grid nodes as a closed mesh whose vertices are cuts of grid edges [T43].

Nodes are counted flat, last axis fastest. Directions along axis k are 2k (down), 2k + 1 (up). Places are in
steps of the grid, from its first node.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from skimage.measure import find_contours, marching_cubes

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]


class Cuts(NamedTuple):
    """Where the boundary cuts the grid edges from nodes inside to nodes outside, one entry for each edge."""

    node: Indices
    """(c,): the node inside."""
    direction: Indices
    """(c,): of the node outside, which may lie beyond the grid."""
    share: Array
    """(c,): share of the edge that is inside."""


class Surface(NamedTuple):
    """A closed mesh."""

    places: Array
    """(v, d): vertices, in steps."""
    faces: Indices
    """(f, d): vertices of each triangle, counter-clockwise from outside; or segment, with the inside left."""
    cut: Indices
    """(v,): index of the cut that each vertex is."""


def open_edges(mask: Mask) -> tuple[Indices, Indices]:
    """Node and direction of every edge between a node inside and one outside, or beyond the grid."""
    flat = np.arange(mask.size, dtype=np.int64).reshape(mask.shape)
    nodes, directions = [], []
    for axis in range(mask.ndim):
        for up in (0, 1):
            found = flat[mask & ~_neighbours(mask, 2 * axis + up)]
            nodes.append(found)
            directions.append(np.full(len(found), 2 * axis + up, dtype=np.int64))
    return np.concatenate(nodes), np.concatenate(directions)


def _neighbours(mask: Mask, direction: int) -> Mask:
    """For each node whether its neighbour is inside."""
    axis, up = divmod(direction, 2)
    result = np.zeros_like(mask)
    to, of = [slice(None)] * mask.ndim, [slice(None)] * mask.ndim
    to[axis], of[axis] = (slice(None, -1), slice(1, None)) if up else (slice(1, None), slice(None, -1))
    result[tuple(to)] = mask[tuple(of)]
    return result


def surface(mask: Mask, cuts: Cuts) -> Surface:
    """The boundary of a mask of two or three dimensions; it needs the cut of each of its open edges.

    Marching cubes [T43] on the mask as ±1 with a layer of nodes outside around it; its table has a vertex on
    every cut edge and no others, and two cells agree on the face between them, so that the mesh is closed.
    """
    corner, span = _bounding_box(mask)
    padded = np.where(np.pad(mask[span], 1), np.float32(1), np.float32(-1))
    if mask.ndim == 3:
        middles, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
            padded, 0.0, method="lorensen", gradient_direction="ascent"
        )
        faces = faces.astype(np.int64)
    else:
        middles, faces = _contours(padded)
    # Vertices stand at the middles of edges: one coordinate is a half, the others are whole.
    twice = np.rint(2.0 * middles).astype(np.int64)
    axis = np.argmax(twice % 2, axis=1)
    low = twice // 2
    rows = np.arange(len(low))
    down = padded[tuple(low.T)] < 0  # the node inside is the upper one
    inside = low.copy()
    inside[rows, axis] += down
    inside += corner - 1
    direction = 2 * axis + ~down
    cut = _lookup(mask, cuts, np.ravel_multi_index(tuple(inside.T), mask.shape), direction)
    places = inside.astype(np.float64)
    places[rows, axis] += np.where(down, -1.0, 1.0) * cuts.share[cut]
    return Surface(places, faces, cut)


def _bounding_box(mask: Mask) -> tuple[Indices, tuple[slice, ...]]:
    """The first node of the smallest box around the nodes inside, and the box."""
    ends = []
    for axis in range(mask.ndim):
        some = np.flatnonzero(mask.any(axis=tuple(k for k in range(mask.ndim) if k != axis)))
        ends.append((int(some[0]), int(some[-1]) + 1))
    return np.array([first for first, _ in ends]), tuple(slice(*end) for end in ends)


def _contours(padded: NDArray[np.float32]) -> tuple[Array, Indices]:
    """All contours of a picture: points, and pairs of them."""
    points: list[Array] = []
    pairs: list[Indices] = []
    start = 0
    contours = find_contours(padded, 0.0, positive_orientation="high")  # type: ignore[no-untyped-call]
    for contour in contours:
        n = len(contour) - 1  # the last point is the first
        ring = start + np.arange(n)
        points.append(contour[:-1])
        pairs.append(np.stack([ring, np.roll(ring, -1)], axis=1))
        start += n
    return np.concatenate(points), np.concatenate(pairs)


def _lookup(mask: Mask, cuts: Cuts, node: Indices, direction: Indices) -> Indices:
    """Indices of the cuts of these edges."""
    keys = cuts.node * (2 * mask.ndim) + cuts.direction
    order = np.argsort(keys)
    wanted = node * (2 * mask.ndim) + direction
    found = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)]
    if not np.array_equal(keys[found], wanted):
        raise ValueError("the mask has open edges without a cut")
    return found


def content(shape: Surface) -> float:
    """Volume (area in two dimensions) within the mesh, in steps: a sum of simplices over its faces."""
    corners = (shape.places - shape.places.mean(axis=0))[shape.faces]
    n = shape.places.shape[1]
    return float(np.linalg.det(corners).sum() / (6 if n == 3 else 2))


def coarsened(mask: Mask, cuts: Cuts) -> tuple[Mask, Cuts]:
    """Every second node along each axis, and the cuts of that grid's edges, exact from the finer ones.

    A coarse edge is cut on its first half if its middle node is outside, else on its second half.
    """
    coarse = mask[(slice(None, None, 2),) * mask.ndim]
    node, direction = open_edges(coarse)
    fine = 2 * np.stack(np.unravel_index(node, coarse.shape), axis=1)
    middle = fine.copy()
    middle[np.arange(len(middle)), direction // 2] += 2 * (direction % 2) - 1
    shape = np.array(mask.shape)
    beyond: Mask = np.any((middle < 0) | (middle >= shape), axis=1)
    second: Mask = ~beyond & mask[tuple(np.where(beyond[:, None], 0, middle).T)]
    at = np.where(second[:, None], middle, fine)
    cut = _lookup(mask, cuts, np.ravel_multi_index(tuple(at.T), mask.shape), direction)
    return coarse, Cuts(node, direction, 0.5 * (cuts.share[cut] + second))


def content_with_error(mask: Mask, cuts: Cuts, shape: Surface) -> tuple[float, float]:
    """Volume or area in steps, and its estimated error, from the grid coarsened twice [T43].

    The error is the larger of |V_h - V_2h| and |V_2h - V_4h| / 4. Where it falls with the square of the step,
    each is three times the error of V_h.
    """
    volumes, scale = [content(shape)], 1.0
    for _ in range(2):
        mask, cuts = coarsened(mask, cuts)
        scale *= 2.0**mask.ndim
        volumes.append(scale * content(surface(mask, cuts)) if mask.any() else 0.0)
    fine, coarse, coarsest = volumes
    return fine, max(abs(fine - coarse), abs(coarse - coarsest) / 4.0)
