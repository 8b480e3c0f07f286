"""The part of a mesh on one side of a plane across a coordinate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Part(NamedTuple):
    """A part of a mesh of triangles, open where it was cut."""

    vertices: Array
    """(v, d): those of the mesh that the part has, then those where the plane cuts an edge."""
    faces: Indices
    """(f, 3): vertices of each triangle, in the same sense as before."""
    parent: Indices
    """(f,): the face of the mesh that each one is, or is a part of."""


def above(vertices: Array, faces: Indices, axis: int, value: float) -> Part:
    """The part of a mesh, vertices (v, d) and faces (f, 3), with coordinate `axis` at or above a value."""
    up = vertices[:, axis] >= value
    count = up[faces].sum(axis=1)
    whole = np.flatnonzero(count == 3)
    cut = np.flatnonzero((count == 1) | (count == 2))
    # Turned so that first comes the corner that is alone on its side of the plane.
    alone = np.argmax(up[faces[cut]] == (count[cut] == 1)[:, None], axis=1)
    turned = faces[cut][np.arange(len(cut))[:, None], (alone[:, None] + np.arange(3)) % 3]
    ends = np.stack([turned[:, [0, 1]], turned[:, [0, 2]]], axis=1).reshape(-1, 2)
    edges, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    first, second = vertices[edges[:, 0]], vertices[edges[:, 1]]
    share = (value - first[:, axis]) / (second[:, axis] - first[:, axis])
    points = first + share[:, None] * (second - first)
    points[:, axis] = value
    towards_second, towards_third = len(vertices) + edge.reshape(-1, 2).T
    one, two = count[cut] == 1, count[cut] == 2
    corners = [
        faces[whole],
        np.stack([turned[:, 0], towards_second, towards_third], axis=1)[one],
        np.stack([towards_second, turned[:, 1], turned[:, 2]], axis=1)[two],
        np.stack([towards_second, turned[:, 2], towards_third], axis=1)[two],
    ]
    parent = np.concatenate([whole, cut[one], cut[two], cut[two]])
    used, named = np.unique(np.concatenate(corners), return_inverse=True)
    return Part(np.concatenate([vertices, points])[used], named.reshape(-1, 3), parent)
