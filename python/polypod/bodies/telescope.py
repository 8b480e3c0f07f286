"""Telescopic legs as they are drawn: cylinder and piston."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polypod.bodies.drawing import Bar, Clip, DrawnLeg, Placed, moved
from polypod.bodies.pieces import JOINT, STEEL, Piece, on_leg
from polypod.bodies.solids import lathe, tube

Array = NDArray[np.float64]

NOMINAL_STROKE = (0.75, 1.35)
"""Shortest and longest length drawn for a leg whose file gives no stroke, by its length at home."""
PART = 0.6
"""Length of cylinder and piston as bars, by the leg's length at home."""


def way(leg: Mapping[str, Any], home: float) -> Array | None:
    """None: the base joint does not move."""
    return None


def pieces(drawn: DrawnLeg) -> tuple[list[Piece], list[Piece]]:
    """Cylinder and piston along the second axis, one from B, the other from b."""
    leg, radius = drawn.leg, drawn.radius
    size = _leg_sizes(drawn.stroke, drawn.home, radius)
    bore, seat, wall = 0.6 * radius, 0.8 * radius, 0.3 * radius
    rim, mouth = size.body - size.collar, size.body
    barrel = [
        *((0.0, size.neck), (radius, size.neck), (radius, rim), (seat, rim)),
        *((seat, mouth), (bore, mouth), (bore, size.neck + wall), (0.0, size.neck + wall)),
    ]
    # A little off the barrel's faces: two bodies with a face in common are no closed surface.
    inner, low, high = 0.97 * seat, rim - 0.02 * radius, mouth + 0.02 * radius
    collar = [(inner, low), (1.18 * radius, low), (1.18 * radius, high), (inner, high)]
    neck = [(0.0, 0.0), (0.5 * radius, 0.0), (0.5 * radius, size.neck + 0.1 * radius)]
    cylinder = [
        Piece("neck", STEEL, lathe([*neck, (0.0, size.neck + 0.1 * radius)])),
        Piece("barrel", drawn.color, lathe(barrel)),
        Piece("collar", JOINT, lathe(collar, closed=True)),
    ]
    shaft = tube((0.0, -size.shaft, 0.0), (0.0, 0.0, 0.0), 0.55 * radius)
    return (
        [*cylinder, *on_leg(leg["base"], radius)],
        [Piece("shaft", STEEL, shaft), *on_leg(leg["platform"], radius)],
    )


def bars(leg: Mapping[str, Any], radius: float, home: float) -> tuple[Bar, Bar]:
    """Cylinder and piston as bars of one length."""
    part = PART * home
    cylinder, piston = (np.array([[0.0, 0.0, 0.0], [0.0, end, 0.0]]) for end in (part, -part))
    return Bar(cylinder, radius), Bar(piston, 0.55 * radius)


def clips(leg: Mapping[str, Any], first: Placed, second: Placed) -> dict[tuple[str, str], Clip]:
    """Nothing of either link inside the barrel."""
    barrel = next(piece for piece in first.pieces if piece.name == "barrel")
    within = np.linalg.inv(first.frame) @ second.frame
    return {
        (first.name, ""): partial(_drawn_out, barrel, np.eye(4)),
        (second.name, ""): partial(_drawn_out, barrel, within),
    }


def _drawn_out(barrel: Piece, place: Array, corners: Array) -> tuple[Array, NDArray[np.bool_]]:
    """A piston's faces (k, 4, 3), in axes at `place` in the cylinder's, ended at the barrel's mouth.

    And which of them are left; of the cylinder's own faces only that.
    """
    (_, low, _), (radius, high, _) = barrel.mesh.bounds
    at = moved(corners, place)
    within = (np.hypot(at[..., 0], at[..., 2]) < 0.9 * radius) & (low < at[..., 1]) & (at[..., 1] <= high)
    left = ~within.all(axis=1)
    if np.array_equal(place, np.eye(4)):
        return corners, left
    at[..., 1] = np.where(within, high, at[..., 1])
    back = np.asarray(np.linalg.inv(place), np.float64)
    return moved(at, back), left


class _LegSizes(NamedTuple):
    neck: float
    """From B to the barrel, m."""
    body: float
    """From B to the barrel's mouth."""
    collar: float
    """Length of the collar at the mouth."""
    shaft: float
    """Of the piston, from b into the barrel."""


def _leg_sizes(stroke: Array, home: float, radius: float) -> _LegSizes:
    """Lengths of cylinder and piston, m.

    The barrel has four fifths of the shortest length, or as much more, up to nine tenths, as the piston needs
    to stay in it at the longest.
    """
    shortest, longest = float(stroke[0]), float(stroke[1])
    if not shortest > 0.0:
        shortest = min(NOMINAL_STROKE[0] * home, longest / 2.0)
    if not np.isfinite(longest):
        longest = max(NOMINAL_STROKE[1] * home, shortest)
    neck = min(2.4 * radius, 0.15 * shortest)
    guide = min(2.0 * radius, 0.1 * shortest)
    body = float(np.clip(longest - shortest + neck + guide + 0.5 * radius, 0.8 * shortest, 0.9 * shortest))
    return _LegSizes(neck, body, min(1.5 * radius, 0.3 * (body - neck)), longest - body + guide)
