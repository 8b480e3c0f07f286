"""Derivatives of inverse dynamics, the regressor, and the inertial parameters that forces can tell apart.

The shapes are written with n legs, k multipliers, m coordinates, p parameters, b base parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from polypod.answers.answer import Answer, Array, Codes


@dataclass(eq=False, repr=False)
class InverseDynamicsDerivatives(Answer):
    """Exact derivatives of active forces and multipliers [T56, T57]; the last axis is what is varied.

    By pose: m for a move of o, rad for a rotation about axes of the base through o, whose components twist
    and acceleration keep. On a mechanism with constraints only changes that keep them have a meaning: of
    pose, twist and acceleration together. Those by coordinates keep them. Forces are in N (multipliers of
    kind D: N m); each derivative is in that unit by the unit of what is varied.

    By geometry the load, the home pose, and the coordinates with their rates and second rates are kept, and
    dependent coordinates follow. Where constraints are redundant (legs on one rod) the independent ones alone
    are used: the others are taken to stay compatible. One number changed by itself, such as one joint's point
    off the line of its rod, would lock or strain such a mechanism. There, and for the two axes of an F joint,
    which must stay perpendicular, sums over changes that fit have a meaning, single columns none.
    """

    coordinates: tuple[str, ...]
    """Names of the m coordinates that are varied; dependent ones follow."""
    bodies: tuple[str, ...]
    """Names of the p numbers of the bodies, such as "piston 1 center_y": in the axes of the link, inertia
    about the mass centre. Where a leg spins freely only those of a body symmetric about it."""
    geometry: tuple[str, ...]
    """Names of the g numbers of points and axes, such as "leg 1 base point_x" or "rod L axis_z", in the axes
    of the body, base or platform. Axes stay unit vectors: a change along the axis is none. Legs on a rod have
    its axis."""
    forces_by_pose: Array
    """(..., n, 6), N/m and N/rad."""
    constraint_by_pose: Array
    """(..., k, 6)."""
    forces_by_twist: Array
    """(..., n, 6), N s/m and N s/rad."""
    constraint_by_twist: Array
    """(..., k, 6)."""
    forces_by_acceleration: Array
    """(..., n, 6), N s^2/m and N s^2/rad."""
    constraint_by_acceleration: Array
    """(..., k, 6)."""
    forces_by_coordinates: Array
    """(..., n, m): rates and second rates of these coordinates kept; NaN where the status is FOLD."""
    constraint_by_coordinates: Array
    """(..., k, m)."""
    forces_by_rates: Array
    """(..., n, m): coordinates and second rates kept."""
    constraint_by_rates: Array
    """(..., k, m)."""
    forces_by_second_rates: Array
    """(..., n, m): the rows of the actuated legs are the mass matrix as their actuators feel it."""
    constraint_by_second_rates: Array
    """(..., k, m)."""
    forces_by_bodies: Array
    """(..., n, p), N/kg, N/m and N/(kg m^2)."""
    constraint_by_bodies: Array
    """(..., k, p)."""
    forces_by_geometry: Array
    """(..., n, g), N/m for points, N for axes: coordinates, their rates and second rates kept; NaN where the
    status is FOLD, as are the two below."""
    constraint_by_geometry: Array
    """(..., k, g)."""
    lengths_by_geometry: Array
    """(..., n, g), of all legs, m/m and m; with six degrees of freedom the pose is kept."""
    status: Codes
    """(...): FOLD where the coordinates do not determine the motion: all other derivatives stand."""

    _variables: ClassVar = {
        "forces_by_pose": "forces_by_pose",
        "constraint_by_pose": "constraint_by_pose",
        "forces_by_twist": "forces_by_twist",
        "constraint_by_twist": "constraint_by_twist",
        "forces_by_acceleration": "forces_by_acceleration",
        "constraint_by_acceleration": "constraint_by_acceleration",
        "forces_by_coordinates": "forces_by_coordinates",
        "constraint_by_coordinates": "constraint_by_coordinates",
        "forces_by_rates": "forces_by_rates",
        "constraint_by_rates": "constraint_by_rates",
        "forces_by_second_rates": "forces_by_second_rates",
        "constraint_by_second_rates": "constraint_by_second_rates",
        "forces_by_bodies": "forces_by_bodies",
        "constraint_by_bodies": "constraint_by_bodies",
        "forces_by_geometry": "forces_by_geometry",
        "constraint_by_geometry": "constraint_by_geometry",
        "lengths_by_geometry": "lengths_by_geometry",
        "status": "status",
    }

    def labels(self) -> dict[str, Sequence[str]]:
        """Names of the variables of differentiation."""
        return {
            "coordinate": self.coordinates,
            "body_parameter": self.bodies,
            "geometry_parameter": self.geometry,
        }


@dataclass(eq=False, repr=False)
class Regressor(Answer):
    """Active forces and multipliers as linear functions of the inertial parameters [T57].

    `inverse_dynamics(...).forces` is `forces @ values + forces_offset`, and so for `constraint`.
    """

    names: tuple[str, ...]
    """Names of the p parameters, such as "piston 1 mc_y": mass, first moments and inertia about the origin of
    the link's axes, which is o, B, b or the rod's point. For a leg that spins freely only m, mc_y,
    I_xx = I_zz and I_yy of a body symmetric about it."""
    values: Array
    """(p,): their values in the mechanism file; kg, kg m, kg m^2."""
    forces: Array
    """(..., n, p): Y, zero for passive legs; N/kg, N/(kg m), N/(kg m^2)."""
    constraint: Array
    """(..., k, p): the same for the multipliers; N/kg, N/(kg m), N/(kg m^2), of kind D with N m for N."""
    forces_offset: Array
    """(..., n): forces of load and damping alone, N."""
    constraint_offset: Array
    """(..., k): multipliers of load and damping alone, N, of kind D N m."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "values": "parameter_value",
        "forces": "regressor",
        "constraint": "constraint_regressor",
        "forces_offset": "force_offset",
        "constraint_offset": "constraint_offset",
        "status": "status",
    }
    _same_for_all: ClassVar = frozenset({"values"})

    def labels(self) -> dict[str, Sequence[str]]:
        """The parameters."""
        return {"parameter": self.names}


@dataclass(eq=False, repr=False)
class BaseParameters(Answer):
    """The minimal set of inertial parameters: combinations that active forces can tell apart [T58].

    With the regressor's names, values and columns: `forces[..., columns] @ values` are the forces of all
    parameters, whatever the motion.
    """

    names: tuple[str, ...]
    """Names of the b parameters that are kept, in the order of the regressor's."""
    columns: NDArray[np.int64]
    """(b,): their places in the regressor."""
    combination: Array
    """(b, p): `combination @ regressor.values` are the base parameters; 1, m and m^2; the identity on
    `columns`."""
    values: Array
    """(b,): the base parameters of the mechanism file; kg, kg m and kg m^2, as their names tell."""
    parameters: tuple[str, ...]
    """Names of all p parameters."""
    remainders: Array
    """(p,): what is left of each parameter's column after the ones kept before it, as a part of itself: 0
    where it is dependent. How clear the rank is shows in the gap between both kinds."""

    _variables: ClassVar = {
        "columns": "base_column",
        "combination": "combination",
        "values": "base_value",
        "remainders": "remainder",
    }

    def labels(self) -> dict[str, Sequence[str]]:
        """Base parameters and all parameters."""
        return {"base_parameter": self.names, "parameter": self.parameters}

    def expression(self, index: int, digits: int = 4) -> str:
        """A base parameter as a sum of parameters by name, such as "platform mc_x + 0.14 piston 1 m"."""
        terms = []
        kept = self.columns[index]
        for j in [kept, *(j for j in np.flatnonzero(self.combination[index]) if j != kept)]:
            factor, name = self.combination[index, j], self.parameters[j]
            size = f"{abs(factor):.{digits}g}"
            size = "" if size == "1" else f"{size} "
            terms.append(f"{'-' if factor < 0 else '+'} {size}{name}")
        return " ".join(terms).removeprefix("+ ")
