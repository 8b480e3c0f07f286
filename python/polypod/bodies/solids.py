"""Closed surfaces of simple bodies, in faces about as long as wide.

Faces so small because a drawing that shows nearer faces over those behind them would hide or show a long one
as a whole.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray
from trimesh import Trimesh

from polypod.vectors import cross, perpendiculars, unit

Array = NDArray[np.float64]

SIDES = 20
"""Of whatever is round."""


def skin(rings: Array, *, closed: bool = False) -> Trimesh:
    """The closed surface through rings of points (m, n, 3).

    The first and the last ring are a single point n times over, the ends of the body; or with `closed` the
    last ring is followed by the first, as round a torus. Normals point outwards whatever the order.
    """
    count, around = rings.shape[:2]
    number = np.arange(count * around).reshape(count, around)
    for i in () if closed else (0, count - 1):
        number[i] = number[i, 0]
    number = np.vstack([number, number[:1]]) if closed else number
    a, b = number[:-1], number[1:]
    a_next, b_next = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    halves = [np.stack(corners, axis=-1) for corners in ((a, a_next, b_next), (a, b_next, b))]
    faces = np.stack(halves, axis=2).reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    mesh = Trimesh(rings.reshape(-1, 3)[used], faces.reshape(-1, 3), process=False)
    return mesh if mesh.volume >= 0.0 else skin(rings[:, ::-1], closed=closed)


def four_sided(mesh: Trimesh) -> tuple[Array, Array]:
    """Corners (k, 4, 3) and unit normals (k, 3) of the faces, two halves of a four-sided one as one.

    The halves are those that `skin` makes; a three-sided face has its last corner twice.
    """
    faces = mesh.faces
    half = np.append((faces[:-1, 0] == faces[1:, 0]) & (faces[:-1, 2] == faces[1:, 1]), False)
    last = np.where(half, np.append(faces[1:, 2], 0), faces[:, 2])
    whole = np.column_stack([faces, last])
    first = ~np.roll(half, 1)
    return mesh.vertices[whole[first]], mesh.face_normals[first]


def lathe(
    profile: ArrayLike,
    start: ArrayLike = (0.0, 0.0, 0.0),
    axis: ArrayLike = (0.0, 1.0, 0.0),
    *,
    sides: int = SIDES,
    closed: bool = False,
) -> Trimesh:
    """Solid of revolution of a profile about an axis.

    Args:
        profile: (k, 2): distances from the axis, and along it from `start`, m. It begins and ends on the
            axis, or with `closed` it is a closed line that stays clear of the axis.
        start: (3,), m.
        axis: (3,), of any length.
        sides: of the polygon in place of each circle.
        closed: whether the last point is followed by the first.
    """
    points = np.asarray(profile, float)
    points = _finer(np.vstack([points, points[:1]]) if closed else points)
    points = points[:-1] if closed else points
    origin, line = np.asarray(start, float), unit(axis)
    x, y = perpendiculars(line)
    turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    ring = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    rings = origin + points[:, 1, None, None] * line + points[:, 0, None, None] * ring
    return skin(rings, closed=closed)


def _finer(points: Array) -> Array:
    """A profile whose long stretches are cut into pieces; the distance from the axis sets their length."""
    found = [points[:1]]
    for start, end in itertools.pairwise(points):
        pieces = int(np.clip(np.linalg.norm(end - start) / (4.0 * max(start[0], end[0], 1e-300)), 1, 30))
        found.append(start + np.linspace(0.0, 1.0, pieces + 1)[1:, None] * (end - start))
    return np.concatenate(found)


def tube(
    start: ArrayLike, end: ArrayLike, radius: float, *, end_radius: float | None = None, sides: int = SIDES
) -> Trimesh:
    """A round bar with flat ends, or a cone."""
    along = np.asarray(end, float) - np.asarray(start, float)
    length = float(np.linalg.norm(along))
    last = radius if end_radius is None else end_radius
    rim = [(last, length)] if last > 0.0 else []
    return lathe([(0.0, 0.0), (radius, 0.0), *rim, (0.0, length)], start, along, sides=sides)


def ball(center: ArrayLike, radius: float) -> Trimesh:
    """A sphere."""
    turn = np.linspace(0.0, np.pi, SIDES // 2 + 1)
    circle = radius * np.stack([np.sin(turn), -np.cos(turn)], axis=-1)
    circle[[0, -1], 0] = 0.0
    return lathe(circle, center)


def block(center: ArrayLike, axis: ArrayLike, size: float) -> Trimesh:
    """A cube with one edge along `axis`."""
    center, half = np.asarray(center, float), np.asarray(axis, float) * (size / 2 / np.linalg.norm(axis))
    return tube(center - half, center + half, size / np.sqrt(2), sides=4)


def beam(start: ArrayLike, end: ArrayLike, width: float, side: ArrayLike) -> Trimesh:
    """A square bar, a face of which looks along the unit vector `side`, perpendicular to the bar."""
    start, side = np.asarray(start, float), np.asarray(side, float)
    along = np.asarray(end, float) - start
    length = float(np.linalg.norm(along))
    other = cross(along / length, side)
    mesh = tube((0.0, 0.0, 0.0), (0.0, 0.0, length), width / np.sqrt(2), sides=4)
    place = np.eye(4)
    # Its edges are at the first and second axis.
    place[:3, :3] = np.column_stack(
        [(side - other) / np.sqrt(2), (side + other) / np.sqrt(2), along / length]
    )
    place[:3, 3] = start
    mesh.apply_transform(place)
    return mesh


def plate(points: Array, normal: Array, thickness: float, margin: float) -> Trimesh:
    """A flat plate with round corners under (k, 3) points; the unit `normal` points from it to them."""
    x, y = perpendiculars(normal)
    height = float(np.min(points @ normal))
    flat = points @ np.stack([x, y], axis=-1)
    turn = np.linspace(0.0, 2.0 * np.pi, 144, endpoint=False)
    ways = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    # The farthest point each way, and the margin on top: the points' hull, grown by a disc.
    outline = flat[np.argmax(flat @ ways.T, axis=0)] + margin * ways
    outline = np.vstack([outline, outline[:1]])
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=-1))])
    even = np.linspace(0.0, steps[-1], 97)[:-1]
    outline = np.stack([np.interp(even, steps, outline[:, i]) for i in range(2)], axis=-1)
    middle = outline.mean(axis=0)
    inwards = np.linspace(1.0, 0.0, 9)[:, None, None]
    disc = middle + inwards * (outline - middle)
    top = disc[..., :1] * x + disc[..., 1:] * y + height * normal
    return skin(np.concatenate([top[::-1], top - thickness * normal]))
