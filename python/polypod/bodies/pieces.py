"""Pieces of links: closed surfaces of one colour, and what joints look like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from trimesh import Trimesh

from polypod.bodies.solids import ball, block, tube

Array = NDArray[np.float64]

STEEL, JOINT, BASE, PLATFORM, ROD = "#E8ECF0", "#4A4F57", "#C9CDD3", "#9CC3DF", "#8A6D3B"


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a link, a closed surface of one colour, in the link's axes, m."""

    name: str
    color: str
    """Such as #C9CDD3."""
    mesh: Trimesh


def on_leg(joint: Mapping[str, Any], radius: float, at: ArrayLike = (0.0, 0.0, 0.0)) -> list[Piece]:
    """Solid of a joint on the leg: the ball, or the pin along n."""
    match joint["joint"]:
        case "S":
            return [Piece("ball", JOINT, ball(at, 1.45 * radius))]
        case "U" | "R":
            return [Piece("pin", JOINT, pin(at, (1.0, 0.0, 0.0), radius))]
    return []


def on_body(joint: Mapping[str, Any], radius: float, name: str, point: Array, normal: Array) -> list[Piece]:
    """What a joint has on base or platform, whose plate has a normal: the other pin, or a block."""
    match joint["joint"]:
        case "U":
            return [Piece(f"pin {name}", JOINT, pin(point, joint["axis"], radius))]
        case "F":
            return [Piece(f"block {name}", JOINT, block(point, normal, 2.4 * radius))]
    return []


def on_first_link(joint: Mapping[str, Any], radius: float) -> list[Piece]:
    """What a base joint has on a link that carries it, at its origin, in base axes: the other pin."""
    if joint["joint"] == "U":
        return [Piece("axis", JOINT, pin((0.0, 0.0, 0.0), joint["axis"], radius))]
    return []


def sunk(joint: Mapping[str, Any], radius: float) -> float:
    """How far below a joint's point its post ends: at the ball, or not at all."""
    return 1.1 * radius if joint["joint"] == "S" else 0.0


def pin(at: ArrayLike, axis: ArrayLike, radius: float) -> Trimesh:
    """A pin about a point."""
    at, step = np.asarray(at, float), np.asarray(axis, float) * (2.0 * radius / np.linalg.norm(axis))
    return tube(at - step, at + step, 0.75 * radius)
