"""The telescope: a prismatic joint along the leg, between cylinder and piston.

The coordinate is the length of the leg.
"""

from __future__ import annotations

import numpy as np

from polypod.legs.drive import Array, Drive, Leg


class Telescope(Drive):
    """The drive of a leg without a table for one."""

    key = ""
    name = "telescopic leg"
    links = ("cylinder", "piston")
    letter = "P"
    joint = "prismatic"
    moves_foot = False
    coordinate = "length"
    coordinates = "lengths"
    coordinates_of_legs = "leg lengths"
    least = 0.0

    def foot(self, leg: Leg, end: Array) -> Array:
        """The base point."""
        return np.array(leg["base"]["point"])

    def feet(self, leg: Leg, stroke: Array) -> Array:
        """The base point."""
        point = np.array(leg["base"]["point"])
        return np.stack([point, point])

    def longest(self, leg: Leg, stroke: Array) -> float:
        """The stroke's end."""
        return float(stroke[1])

    def reach(self, leg: Leg) -> float:
        """The piston begins at the platform joint."""
        return 0.0

    def axis(self, leg: Leg) -> Array:
        """δ."""
        return np.array([0.0, 1.0, 0.0])

    def coordinate_at(self, leg: Leg, first: Array, second: Array) -> float:
        """From B to b."""
        return float(np.linalg.norm(second[:3, 3] - first[:3, 3]))

    def bodies(self, leg: Leg) -> tuple[Leg | None, Leg | None]:
        """Cylinder and piston."""
        return leg["cylinder"], leg["piston"]
