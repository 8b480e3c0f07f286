"""The slider: a carriage on a rail fixed in the base, the base joint on it, and a strut of constant length.

The coordinate is the carriage's place q on the rail, from the base point along the rail's axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from polypod.legs.drive import Array, Drive, Leg, Parameter
from polypod.vectors import unit

CARRIAGE = 0.1
"""Radius of gyration of a carriage, by the length of its strut."""


class Slider(Drive):
    """The drive of a leg with the table `slider`."""

    key = "slider"
    name = "slider"
    links = ("carriage", "strut")
    letter = "P"
    joint = "prismatic"
    moves_foot = True
    coordinate = "place"
    coordinates = "places"
    coordinates_of_legs = "places"
    least = -math.inf
    variables: ClassVar[Mapping[str, tuple[str, str]]] = {
        "length": ("q", "place of the carriage"),
        "rate": ("q'", "rate of the carriage's place"),
        "leg_acceleration": ("q''", "second rate of the carriage's place"),
        "piston_velocity": ("v_p", "velocity of the strut's mass centre"),
        "piston_acceleration": ("a_p", "acceleration of the strut's mass centre"),
        "cylinder_velocity": ("v_q", "velocity of the carriage's mass centre"),
        "cylinder_acceleration": ("a_q", "acceleration of the carriage's mass centre"),
        "force": ("f_a", "active force along the rail"),
    }
    signs = "Of a slider, forces and speeds are positive along its rail's axis."
    frames = "Carriages have the base's axes, struts (n, delta, n x delta), both at the base joint."
    assumed_inertia = (
        "carriages, which do not rotate, have no moment of inertia in the mechanism file; here they have "
        f"those of a radius of gyration of {CARRIAGE:g} of their struts' lengths, of no effect"
    )
    parameters_title = "Rails, through the base points, and struts"
    parameters: ClassVar[Mapping[str, Parameter]] = {"axis": "direction", "strut": "length", "branch": "sign"}

    def foot(self, leg: Leg, end: Array) -> Array:
        """One of the two points on the rail that are a strut's length away from the platform joint.

        The one from which the strut leans along the axis (branch 1) or against it (-1).
        """
        start, slider, axis = np.array(leg["base"]["point"]), leg["slider"], self.axis(leg)
        nearest = start + axis * (axis @ (end - start))
        with np.errstate(invalid="ignore"):
            half_chord = np.sqrt(slider["strut"] ** 2 - np.sum((end - nearest) ** 2))
        return np.asarray(nearest - slider["branch"] * half_chord * axis)

    def feet(self, leg: Leg, stroke: Array) -> Array:
        """The ends of the carriage's way."""
        point, axis = np.array(leg["base"]["point"]), self.axis(leg)
        if not np.isfinite(stroke).all():
            # Anywhere along the axes that the rail is not perpendicular to.
            return np.array([np.where(axis == 0.0, point, -np.inf), np.where(axis == 0.0, point, np.inf)])
        return np.asarray(point + np.outer(stroke, axis))

    def longest(self, leg: Leg, stroke: Array) -> float:
        """The strut."""
        return float(leg["slider"]["strut"])

    def reach(self, leg: Leg) -> float:
        """The strut begins at the base joint."""
        return float(leg["slider"]["strut"])

    def axis(self, leg: Leg) -> Array:
        """The rail's axis."""
        return unit(leg["slider"]["axis"])

    def coordinate_at(self, leg: Leg, first: Array, second: Array) -> float:
        """The carriage's place."""
        return float(self.axis(leg) @ (first[:3, 3] - np.array(leg["base"]["point"])))

    def bodies(self, leg: Leg) -> tuple[Leg | None, Leg | None]:
        """Carriage and strut."""
        return leg["slider"]["carriage"], leg["piston"]

    def solid_bodies(self, leg: Leg) -> tuple[Leg | None, Leg | None]:
        """The carriage with some inertia, the strut with its mass centre from the base joint."""
        carriage, strut = self.bodies(leg)
        if carriage is not None:
            # It does not rotate, so that its inertia is of no effect; but engines want some.
            side = CARRIAGE * float(leg["slider"]["strut"])
            carriage = {**carriage, "inertia": carriage["mass"] * side**2 * np.eye(3)}
        # The file counts from the platform joint, where a strut without mass has its point.
        strut = strut or {"mass": 0.0, "center": np.zeros(3), "inertia": np.zeros((3, 3))}
        return carriage, {**strut, "center": strut["center"] + np.array([0.0, self.reach(leg), 0.0])}

    def first_axes(self, leg: Leg, foot: Array) -> Array:
        """Those of the base: a carriage does not rotate."""
        return np.eye(3)

    def push(self, leg: Leg, foot: Array) -> Array:
        """Along the rail."""
        return self.axis(leg)
