"""Answers of singularity analysis at poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from polypod import _core
from polypod.answers.answer import Answer, Array, Codes
from polypod.answers.singularity_kind import SingularityKind as SingularityKind

Kinds = NDArray[np.int8]

TOLERANCE = _core.SINGULAR
"""A measure of nearness (a pure number) up to which a pose is singular: poses are as exact as that [T77]."""

NEAR_SINGULAR = 0.01
"""Smallest singular value (a pure number) below which a pose is called nearly singular."""


@dataclass(eq=False, repr=False)
class Singularity(Answer):
    """Distance of poses from singularity, and its kind [T24, T30-T33]; base axes.

    Where a leg has no direction (LEG_LENGTH), or a slider's strut is perpendicular to its rail
    (STRUT_ACROSS_RAIL), the status is SINGULAR, and only the kind, its leg, and the measures of legs and
    constraints stand. Elsewhere singular poses have the status OK: the question has its answer.
    """

    determinant: Array
    """(...): det J in pure numbers; its sign tells the aspect, the side of the singular poses."""
    sigma_min: Array
    """(...): smallest singular value of the legs' rows on the twists that the constraints allow, 1."""
    sigma_max: Array
    """(...): the largest, 1."""
    condition: Array
    """(...): sigma_max / sigma_min."""
    constraint_sigma: Array
    """(...): smallest singular value of the constraints' rows, 1; inf without constraints."""
    leg_length: Array
    """(..., n): lengths of the legs by the characteristic length, 1."""
    leg_sine: Array
    """(..., n): sine of the angle between leg and axis of its universal joint or rod; about 1 for others."""
    transmission: Array
    """(..., n): cosine of the angle between strut and prismatic joint; 1 for a telescopic leg [T68].

    Positive where a slider's strut leans along its rail's axis, negative where against it.
    """
    kind: Kinds
    """(...): `SingularityKind`."""
    leg: Kinds
    """(...): index of the leg that the kind speaks of; -1 where it speaks of none."""
    uncontrolled: Kinds
    """(...): degrees of freedom that the locked actuators leave; -1 where not known."""
    twist: Array
    """(..., 6): the allowed twist at o that the legs notice least, m/s and rad/s.

    (v, Λω) has the length 1 m/s. No leg notices it where `uncontrolled` is not 0; it is one of several where
    that exceeds 1.
    """
    axis: Array
    """(..., 3): direction of that twist's axis; of its translation where the pitch is infinite."""
    pitch: Array
    """(...): slide per rotation, m/rad; inf for a pure translation."""
    point: Array
    """(..., 3): the axis's point nearest to o, m; o for a pure translation."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "determinant": "determinant",
        "sigma_min": "sigma_min",
        "sigma_max": "sigma_max",
        "condition": "condition",
        "constraint_sigma": "constraint_sigma",
        "leg_length": "relative_length",
        "leg_sine": "leg_sine",
        "transmission": "transmission",
        "kind": "singularity_kind",
        "leg": "singular_leg",
        "uncontrolled": "uncontrolled",
        "twist": "uncontrolled_twist",
        "axis": "screw_axis",
        "pitch": "screw_pitch",
        "point": "screw_point",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class Determinant(Answer):
    """det J in pure numbers along a motion [T30]."""

    determinant: Array
    """(...): det J; its sign tells the aspect."""
    rate: Array
    """(...): exact rate along the twist, 1/s."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "determinant": "determinant",
        "rate": "determinant_rate",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class SingularityDistance(Answer):
    """Distance from singularity along each coordinate, the others kept: until det J = 0 [T34]; m and rad."""

    coordinates: tuple[str, ...]
    """Names of the k coordinates."""
    value: Array
    """(..., k): their values at the pose, m or rad."""
    singular: Array
    """(..., k, 2): the nearest singular value below and above, m or rad; -inf and inf where there is none in
    reach."""
    distance: Array
    """(..., k, 2): |singular - value|, m or rad."""
    kind: Kinds
    """(..., k, 2): `SingularityKind` there; NONE where there is none in reach.

    UNKNOWN where det J changes its sign, but no singular pose is known.
    """
    searched: Array
    """(..., k, 2): value up to which poses were looked at, m or rad: the reach, or where poses end."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "value": "coordinate_value",
        "singular": "singular_value",
        "distance": "singular_distance",
        "kind": "singular_kind",
        "searched": "searched_value",
        "status": "status",
    }

    def labels(self) -> dict[str, Sequence[str]]:
        """The coordinates."""
        return {"coordinate": self.coordinates}


def codes(values: Array) -> Kinds:
    """Small integers from the core's numbers, -1 for NaN."""
    return np.where(np.isfinite(values), values, -1).astype(np.int8)
