"""Rails on the base, along which joints move, as solid pieces, and how they lie.

A rail stands behind the line of the joints, so that the carriage is between rail and joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from trimesh import Trimesh

from polypod.bodies.solids import beam, tube
from polypod.vectors import perpendiculars

Array = NDArray[np.float64]

FLAT = 0.05
"""Rails lie on a plate if their ends leave its plane by less than this part of their width."""
GAP, SHOE, OVERHANG = 2.9, 2.4, 2.0
"""By the radius of the strut: from joint to rail, width of the carriage's block, and its half length."""


class Rail(NamedTuple):
    """A drawn rail, in base axes."""

    ends: Array
    """(2, 3): on the line of the joints, where a carriage at the end of its way has its joint, m."""
    axis: Array
    back: Array
    """Unit vector perpendicular to the axis, from the joint to the rail."""
    radius: float
    """Of the strut, m."""

    def bar_ends(self) -> Array:
        """(2, 3): of the bar, m."""
        beyond = (OVERHANG + 0.5) * self.radius * np.array([[-1.0], [1.0]]) * self.axis
        return np.asarray(self.ends + beyond + GAP * self.radius * self.back)

    def bar(self) -> Trimesh:
        """Solid of the rail."""
        start, end = self.bar_ends()
        return beam(start, end, 1.1 * self.radius, self.back)

    def shoe(self) -> Trimesh:
        """The carriage's block about the rail, with the joint at the origin."""
        middle, half = GAP * self.radius * self.back, OVERHANG * self.radius * self.axis
        return beam(middle - half, middle + half, SHOE * self.radius, self.back)

    def bracket(self) -> Trimesh:
        """From the block to the joint."""
        top = (GAP - 0.4 * SHOE) * self.radius * self.back
        return tube(top, np.zeros(3), 0.95 * self.radius, end_radius=0.75 * self.radius)


def flat_normal(points: Array) -> Array | None:
    """Unit normal of the plane in which points (k, 3) lie, or None where they do not."""
    _, sizes, axes = np.linalg.svd(points - points.mean(axis=0))
    return np.asarray(axes[2]) if sizes[1] > FLAT * sizes[0] and sizes[2] < FLAT * sizes[1] else None


def lower_ends(ways: Sequence[Array], down: Array) -> Array:
    """(k, 3): of each rail the end that is farther in the direction `down`."""
    return np.array([ends[int(np.argmax(ends @ down))] for ends in ways])


def behind(axis: Array, away: Array) -> Array:
    """Unit vector perpendicular to a rail, as near to `away` as can be."""
    square = away - axis * (axis @ away)
    size = np.linalg.norm(square)
    return perpendiculars(axis)[0] if size <= 1e-9 * np.linalg.norm(away) else np.asarray(square / size)
