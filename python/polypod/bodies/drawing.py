"""How a leg of a kind of drive is drawn: what `polypod.bodies.drives` has for each kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from polypod.bodies.pieces import Piece
from polypod.bodies.rail import Rail

Array = NDArray[np.float64]
Leg = Mapping[str, Any]
"""In `Mechanism.geometry`."""
Clip = Callable[[Array], tuple[Array, NDArray[np.bool_]]]
"""Faces (k, 4, 3) → the same without what another piece hides, and which are left (k,)."""


class DrawnLeg(NamedTuple):
    """What the links of a leg are drawn from."""

    leg: Leg
    radius: float
    """m."""
    color: str
    stroke: Array
    """(2,)."""
    home: float
    """The coordinate at the centre pose."""
    rail: Rail | None
    """Along the way of the base joint, if it has one."""


class Placed(NamedTuple):
    """A link that has a place."""

    name: str
    pieces: tuple[Piece, ...]
    frame: Array
    """(4, 4), base axes."""

    def moved(self, points: Array) -> Array:
        """Points (..., 3) of the link in base axes."""
        return moved(points, self.frame)


class Bar(NamedTuple):
    """A link at its simplest."""

    ends: Array
    """(2, 3), in the link's axes, m."""
    radius: float


class Drawing(Protocol):
    """Functions of a module for a kind of drive."""

    def way(self, leg: Leg, home: float) -> Array | None:
        """(2, 3): ends of the line along which the base joint moves, base axes; None where there is no line.

        `home` is the coordinate at the centre pose. A rail is drawn there.
        """

    def pieces(self, drawn: DrawnLeg) -> tuple[list[Piece], list[Piece]]:
        """Those of the two links, each in its own axes."""

    def bars(self, leg: Leg, radius: float, home: float) -> tuple[Bar, Bar]:
        """The two links at their simplest."""

    def clips(self, leg: Leg, first: Placed, second: Placed) -> dict[tuple[str, str], Clip]:
        """What hides faces in pictures that sort them by depth.

        By the names of link and piece; "" stands for all pieces.
        """


def moved(points: Array, place: Array) -> Array:
    """Points (..., 3) in axes that stand at `place` (4, 4)."""
    return np.asarray(points @ place[:3, :3].T + place[:3, 3])
