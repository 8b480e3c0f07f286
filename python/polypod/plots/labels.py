"""Names in a picture, moved round what they name until they cover neither one another nor lines."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TURNS = np.radians([0, 20, -20, 40, -40, 65, -65, 90, -90, 120, -120, 150, -150, 180])
_FARTHER = np.array([0.0, -0.3, 0.4, 0.8, 1.3, 2.0])
"""How much farther away than wanted, in sizes of the letters."""

_SWEEPS = 6

_ON_NAME, _ON_LINE, _ON_POINT, _TURNED, _MOVED = 40.0, 1.0, 6.0, 0.6, 0.9
"""What a place costs: by the share of a name's area under another one, by the length of a line under it in
heights of the name, by a point under it, by the angle from the wanted place in rad, and by how much farther
or nearer it is in sizes of the letters."""


class Name(NamedTuple):
    """A name and what it names, in points of the picture."""

    text: str
    point: Array
    """(2,): what it names."""
    wanted: Array
    """(2,): where its middle should be."""


@cache
def size_of_text(text: str, size: float) -> tuple[float, float]:
    """Width and height of a text in points."""
    box = TextPath((0.0, 0.0), text, size=size, prop=FontProperties(family="DejaVu Sans")).get_extents()
    return box.width, max(box.height, 0.7 * size)


def spread(names: list[Name], lines: Array, size: float) -> Array:
    """(n, 2): places of the names' middles in points, near the wanted ones.

    Each name goes round its point, or a little away, to where it covers least; the same input gives the same
    places.

    Args:
        names: with their points and wanted places.
        lines: (k, 2, 2), ends of lines that should stay visible.
        size: of the letters, points.
    """
    if not names:
        return np.zeros((0, 2))
    half = np.array([size_of_text(name.text, size) for name in names]) / 2 + 0.08 * size
    points = np.array([name.point for name in names])
    candidates, price = _candidates(names, size)
    fixed = np.stack(
        [_under(candidates[i], half[i], lines, np.delete(points, i, axis=0)) for i in range(len(names))]
    )
    places = candidates[:, 0].copy()
    for _ in range(_SWEEPS):
        before = places.copy()
        for i in range(len(names)):
            others = np.arange(len(names)) != i
            gap = np.abs(candidates[i][:, None] - places[others]) - (half[i] + half[others])
            shared = np.prod(np.clip(-gap, 0.0, 2.0 * half[i]), axis=2) / np.prod(2.0 * half[i])
            cost = price + fixed[i] + _ON_NAME * shared.sum(axis=1)
            places[i] = candidates[i][np.argmin(cost)]
        if np.array_equal(before, places):
            break
    return places


def _candidates(names: list[Name], size: float) -> tuple[Array, Array]:
    """(n, c, 2): places for each name, the wanted one first; and (c,) what each costs."""
    cos, sin = np.cos(_TURNS), np.sin(_TURNS)
    rotations = np.stack([np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)], axis=1)
    places = []
    for name in names:
        away = name.wanted - name.point
        distance = float(np.hypot(*away))
        way = away / distance if distance > 0.0 else np.array([0.0, 1.0])
        distances = np.maximum(distance + size * _FARTHER, 0.0)
        places.append(name.point + (distances[:, None, None] * (rotations @ way)).reshape(-1, 2))
    return np.stack(places), np.add.outer(_MOVED * np.abs(_FARTHER), _TURNED * np.abs(_TURNS)).ravel()


def _under(places: Array, half: Array, lines: Array, points: Array) -> Array:
    """(c,): cost of lines and points under a name at these places."""
    cost = _ON_LINE * _lengths_inside(places, half, lines).sum(axis=1) / (2.0 * half[1])
    covered = (np.abs(places[:, None] - points) < half).all(axis=2)
    return np.asarray(cost + _ON_POINT * covered.sum(axis=1))


def _lengths_inside(places: Array, half: Array, lines: Array) -> Array:
    """(c, k): the length of each line within the box at each place."""
    start, way = lines[:, 0], lines[:, 1] - lines[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        first = (places[:, None] - half - start) / way
        last = (places[:, None] + half - start) / way
    enter, leave = np.minimum(first, last), np.maximum(first, last)
    # A line along an axis of the picture is within the box's other two sides all along, or never.
    along = np.abs(way) < 1e-12
    within = np.abs(places[:, None] - start) <= half
    enter = np.where(along, np.where(within, -np.inf, np.inf), enter)
    leave = np.where(along, np.where(within, np.inf, -np.inf), leave)
    share = np.clip(leave.min(axis=2), 0.0, 1.0) - np.clip(enter.max(axis=2), 0.0, 1.0)
    return np.asarray(np.clip(share, 0.0, 1.0) * np.linalg.norm(way, axis=1))
