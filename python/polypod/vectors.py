"""Vectors of space, rotations and frames: for solids, drawings and the multibody model.

The core has its own; what checks it must not lean on it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def frame_at(axes: Array, origin: ArrayLike) -> Array:
    """(4, 4): the homogeneous matrix of axes (3, 3), as columns, at an origin (3,)."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = axes, origin
    return frame


def inverse(frame: Array) -> Array:
    """Of a homogeneous matrix (4, 4)."""
    return frame_at(frame[:3, :3].T, -frame[:3, :3].T @ frame[:3, 3])


def unit(vector: ArrayLike) -> Array:
    """The direction of a vector (3,); NaN for one of no length."""
    array = np.asarray(vector, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        return np.asarray(array / np.linalg.norm(array))


def cross(a: Array, b: Array) -> Array:
    """The vector a×b of two vectors (3,): numpy's own takes ten times as long for so few numbers."""
    (x, y, z), (u, v, w) = a, b
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def perpendiculars(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors perpendicular to a unit vector and to each other."""
    first = unit(cross(axis, np.eye(3)[np.argmin(np.abs(axis))]))
    return first, cross(axis, first)


def turn_about(axis: Array, start: Array, end: Array) -> float:
    """The angle, rad, by which a rotation about a unit axis takes one direction to another."""
    across_start = start - axis * (axis @ start)
    return float(np.arctan2(cross(axis, start) @ end, across_start @ end))


def turned(axis: Array, angle: float) -> Array:
    """(3, 3): the rotation about a unit axis."""
    hat = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + np.sin(angle) * hat + (1.0 - np.cos(angle)) * (hat @ hat))
