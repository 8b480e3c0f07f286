"""Simple bodies as small four-sided faces, for drawings in which nearer faces hide those behind them."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

LIGHT = np.array([-0.35, -0.55, 0.76])
"""Direction towards the light, base axes."""


class Solids:
    """Bodies in one list of faces; lengths in m, base axes."""

    def __init__(self) -> None:
        self._faces: list[Array] = []
        self._normals: list[Array] = []
        self._colors: list[Array] = []

    def faces(self) -> Array:
        """(N, 4, 3): corners, m. A three-sided face has one corner twice."""
        return np.concatenate(self._faces)

    def shades(self) -> Array:
        """(N, 3): colours in the light, red, green, blue from 0 to 1."""
        normals, colors = np.concatenate(self._normals), np.concatenate(self._colors)
        towards = normals @ (LIGHT / np.linalg.norm(LIGHT))
        diffuse = 0.58 + 0.42 * (0.5 + 0.5 * towards)
        gloss = 0.32 * np.clip(towards, 0.0, 1.0) ** 12
        shaded = colors * diffuse[:, None]
        lit: Array = np.clip(shaded + (1.0 - shaded) * gloss[:, None], 0.0, 1.0)
        return lit

    def tube(
        self,
        start: ArrayLike,
        end: ArrayLike,
        radius: float,
        color: str,
        *,
        end_radius: float | None = None,
        sides: int = 20,
    ) -> None:
        """A round bar with flat ends, or a cone."""
        start, end = np.asarray(start, float), np.asarray(end, float)
        length = float(np.linalg.norm(end - start))
        if length == 0.0:
            return
        last = radius if end_radius is None else end_radius
        # Faces about as long as wide: long ones would be hidden or shown as a whole.
        pieces = int(np.clip(length / (4.0 * max(radius, last)), 1, 30))
        axis = (end - start) / length
        x, y = _across(axis)
        turn = np.linspace(0.0, 2.0 * np.pi, sides + 1)
        ring = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
        along = np.linspace(0.0, 1.0, pieces + 1)[:, None, None]
        side = start + along * (end - start) + (radius + along * (last - radius)) * ring
        inside = (start + end) / 2
        self._grid(side, inside, color)
        for center, rim in ((start, side[0]), (end, side[-1])):
            self._grid(np.stack([np.broadcast_to(center, rim.shape), rim]), inside, color)

    def ball(self, center: ArrayLike, radius: float, color: str) -> None:
        """A sphere."""
        turn, height = np.linspace(0, 2 * np.pi, 21)[None, :], np.linspace(0, np.pi, 11)[:, None]
        x, y = np.sin(height) * np.cos(turn), np.sin(height) * np.sin(turn)
        z = np.cos(height) * np.ones_like(turn)
        center = np.asarray(center, float)
        self._grid(center + radius * np.stack([x, y, z], axis=-1), center, color)

    def block(self, center: ArrayLike, axis: ArrayLike, size: float, color: str) -> None:
        """A cube with one edge along `axis`."""
        center, axis = np.asarray(center, float), np.asarray(axis, float) * size / 2
        self.tube(center - axis, center + axis, size / np.sqrt(2), color, sides=4)

    def plate(
        self, points: Array, normal: Array, thickness: float, margin: float, color: str, viewer: Array
    ) -> None:
        """A flat plate with round corners under (k, 3) points; `normal` points from it to them.

        Of its two sides only the one on the side of the direction `viewer` has faces: both are too near one
        another, for their size, to be sorted.
        """
        x, y = _across(normal)
        height = float(np.min(points @ normal))
        flat = points @ np.stack([x, y], axis=-1)
        turn = np.linspace(0.0, 2.0 * np.pi, 144, endpoint=False)
        ways = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        # The farthest point each way, and the margin on top: the points' hull, grown by a disc.
        outline = flat[np.argmax(flat @ ways.T, axis=0)] + margin * ways
        outline = np.vstack([outline, outline[:1]])
        steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=-1))])
        even = np.linspace(0.0, steps[-1], 97)
        outline = np.stack([np.interp(even, steps, outline[:, i]) for i in range(2)], axis=-1)
        middle = outline[:-1].mean(axis=0)
        inwards = np.linspace(0.0, 1.0, 11)[:, None, None]
        disc = middle + inwards * (outline - middle)
        top = disc[..., :1] * x + disc[..., 1:] * y + height * normal
        bottom = top - thickness * normal
        inside = (top[0, 0] + bottom[0, 0]) / 2
        for grid in (top if normal @ viewer > 0 else bottom, np.stack([bottom[-1], top[-1]])):
            self._grid(grid, inside, color)

    def _grid(self, corners: Array, inside: Array, color: str) -> None:
        """Faces between neighbours of an (m, n, 3) grid on a convex body around the point `inside`."""
        a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
        faces = np.stack([a, b, c, d], axis=-2).reshape(-1, 4, 3)
        normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
        size = np.linalg.norm(normals, axis=-1, keepdims=True)
        normals = np.divide(normals, size, out=np.zeros_like(normals), where=size > 0)
        outwards = np.sum(normals * (faces.mean(axis=1) - inside), axis=-1, keepdims=True)
        normals = np.where(outwards < 0, -normals, normals)
        self._faces.append(faces)
        self._normals.append(normals)
        self._colors.append(np.broadcast_to(to_rgb(color), (len(faces), 3)))


def _across(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors at right angles to a unit vector and to one another."""
    other = np.eye(3)[np.argmin(np.abs(axis))]
    x = np.cross(axis, other)
    x /= np.linalg.norm(x)
    return x, np.cross(axis, x)
