"""Sliders as they are drawn: carriage and strut, and the rail's way."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.bodies.drawing import Bar, Clip, DrawnLeg, Placed
from polypod.bodies.pieces import JOINT, STEEL, Piece, on_first_link, on_leg
from polypod.bodies.solids import lathe, tube
from polypod.vectors import unit

Array = NDArray[np.float64]

NOMINAL_WAY = 0.6
"""How far a rail is drawn to each side of home where the file gives no stroke, by the length of the strut."""


def way(leg: Mapping[str, Any], home: float) -> Array:
    """(2, 3): the ends of a carriage's way, base axes, m; `home` is its place at the centre pose."""
    axis, stroke = unit(leg["slider"]["axis"]), leg["stroke"]
    if stroke is None:
        half = NOMINAL_WAY * leg["slider"]["strut"]
        stroke = (home - half, home + half)
    return np.asarray(leg["base"]["point"] + np.outer(stroke, axis))


def pieces(drawn: DrawnLeg) -> tuple[list[Piece], list[Piece]]:
    """The carriage in base axes, and the strut along the second axis, both from the base joint."""
    leg, radius, color, rail = drawn.leg, drawn.radius, drawn.color, drawn.rail
    assert rail is not None
    length = float(leg["slider"]["strut"])
    carriage = [
        Piece("shoe", color, rail.shoe()),
        Piece("bracket", JOINT, rail.bracket()),
        *on_first_link(leg["base"], radius),
    ]
    y = np.array([0.0, length, 0.0])
    end = min(2.6 * radius, 0.15 * length)
    sleeve = [(0.0, end), (0.8 * radius, end), (0.8 * radius, length - end), (0.0, length - end)]
    strut = [
        Piece("neck 1", STEEL, tube(0.0 * y, 1.02 * end / length * y, 0.55 * radius)),
        Piece("sleeve", color, lathe(sleeve)),
        Piece("neck 2", STEEL, tube((1.0 - 1.02 * end / length) * y, y, 0.55 * radius)),
        *on_leg(leg["base"], radius),
        *on_leg(leg["platform"], radius, y),
    ]
    return carriage, strut


def bars(leg: Mapping[str, Any], radius: float, home: float) -> tuple[Bar, Bar]:
    """Carriage and strut as bars."""
    half = radius * unit(leg["slider"]["axis"])
    strut = np.array([[0.0, 0.0, 0.0], [0.0, leg["slider"]["strut"], 0.0]])
    return Bar(np.array([-half, half]), 1.4 * radius), Bar(strut, 0.6 * radius)


def clips(leg: Mapping[str, Any], first: Placed, second: Placed) -> dict[tuple[str, str], Clip]:
    """No rail inside the carriage's block."""
    shoe = first.moved(np.array(first.pieces[0].mesh.vertices))
    return {("base", f"rail {leg['name']}"): partial(_bared, unit(leg["slider"]["axis"]), shoe)}


def _bared(axis: Array, shoe: Array, corners: Array) -> tuple[Array, NDArray[np.bool_]]:
    """A rail's faces (k, 4, 3) outside the block with the corners `shoe` (m, 3); and which are left."""
    low, high = (shoe @ axis).min(), (shoe @ axis).max()
    at = corners @ axis
    within = (low < at) & (at < high)
    ends = np.where((at <= low).any(axis=1), low, high)[:, None]
    moved = corners + np.where(within, ends - at, 0.0)[..., None] * axis
    return moved, ~within.all(axis=1)
