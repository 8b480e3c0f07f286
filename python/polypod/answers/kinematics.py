"""Answers of kinematics: states, legs at a pose, poses of leg lengths, motion of legs and joints; SI.

The shapes are written with n legs, k rods, and `...` for the batch. Vectors are in base axes unless another
frame is named. Every answer has a `Status` per state, knows its mechanism, and goes to xarray
by `to_xarray`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from polypod.answers.answer import Answer, Array, Codes, Quantity, whole_rows
from polypod.answers.notebook import Rows, numbers
from polypod.answers.variables import variable


@dataclass(eq=False, repr=False)
class State(Answer):
    """A platform's motion, and all numbers of its coordinate set."""

    pose: Array
    """(..., 4, 4): platform axes to base axes, o in m."""
    twist: Array
    """(..., 6): v of o in m/s, ω in rad/s."""
    acceleration: Array
    """(..., 6): a of o in m/s^2, ε in rad/s^2."""
    coordinates: dict[str, Array]
    """By name, (...) each: given and dependent ones, m and rad."""
    coordinate_rates: dict[str, Array]
    """By name, (...) each: m/s and rad/s."""
    coordinate_second_rates: dict[str, Array]
    """By name, (...) each: m/s^2 and rad/s^2."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "pose": "pose",
        "twist": "twist",
        "acceleration": "acceleration",
        "status": "status",
    }

    def quantities(self) -> list[Quantity]:
        """Pose, twist and acceleration, then the coordinates with their rates and second rates."""
        series = {
            "coordinate_": self.coordinates,
            "coordinate_rate_": self.coordinate_rates,
            "coordinate_second_rate_": self.coordinate_second_rates,
        }
        columns = {prefix + name: column for prefix, of in series.items() for name, column in of.items()}
        found = super().quantities()
        return found + [Quantity(name, name, variable(name), column) for name, column in columns.items()]

    def _tables(self) -> list[Rows]:
        """Coordinates as rows."""
        motion = (self.coordinates, self.coordinate_rates, self.coordinate_second_rates)
        headers = ("coordinate", "value", "rate", "second rate")
        rows = []
        for name in self.coordinates:
            unit = variable(f"coordinate_{name}").unit
            values = (numbers(of[name]) if name in of else "" for of in motion)
            rows.append((f"{name} / {unit}" if unit != "1" else name, *values))
        return [Rows(headers, rows), whole_rows(super().quantities()[:3])]


@dataclass(eq=False, repr=False)
class InverseKinematics(Answer):
    """Legs at a pose [Eq. 3]."""

    lengths: Array
    """(..., n), m; of a slider the place q of its carriage on the rail [T67]."""
    vectors: Array
    """(..., n, 3): r from B to b, m; of a slider from the strut's foot."""
    directions: Array
    """(..., n, 3): δ, unit vectors along r."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "lengths": "length",
        "vectors": "leg_vector",
        "directions": "direction",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class ForwardKinematics(Answer):
    """The platform for given leg lengths [T25-T27]."""

    pose: Array
    """(..., 4, 4): platform axes to base axes, o in m; NaN where none was found."""
    residual: Array
    """(...): the largest error of a length or of a constraint, m."""
    iterations: Array
    """(...): Newton steps."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "pose": "pose",
        "residual": "pose_error",
        "iterations": "iterations",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class AssemblyModes(Answer):
    """All real poses for given leg lengths, highest first [T28]; NaN beyond `number`."""

    pose: Array
    """(..., m, 4, 4): o in m; m is the largest number in the batch."""
    number: NDArray[np.int64]
    """(...): number of modes."""
    determinant_sign: Array
    """(..., m): sign of det J, 0 where modes meet."""
    above: Array
    """(..., m): 1 on that side of the base joints where the platform is at home, 0 on the other."""
    multiplicity: Array
    """(..., m): modes that meet in this one; 1 for a regular one."""
    residual: Array
    """(..., m): the largest error of a length or of a constraint, m."""
    mode_status: Codes
    """(..., m): `Status` of each pose: within its limits or not; INVALID_INPUT beyond `number`."""
    status: Codes
    """(...): SINGULAR where modes meet, NOT_CONVERGED where one may be missing."""

    _variables: ClassVar = {
        "pose": "mode_pose",
        "number": "mode_number",
        "determinant_sign": "mode_sign",
        "above": "mode_above",
        "multiplicity": "mode_multiplicity",
        "residual": "mode_error",
        "mode_status": "mode_status",
        "status": "status",
    }

    def labels(self) -> dict[str, Sequence[int]]:
        """The modes, from 1."""
        return {"mode": range(1, self.pose.shape[-3] + 1)}


@dataclass(eq=False, repr=False)
class Kinematics(Answer):
    """Motion of legs, rods, links and joints [Eq. 2-39], base axes, SI."""

    lengths: Array
    """(..., n): ℓ, m [Eq. 3]; of a slider the place q of its carriage on the rail [T67]."""
    rates: Array
    """(..., n): ℓ', m/s [Eq. 6], or q' [T68]."""
    accelerations: Array
    """(..., n): ℓ'', m/s^2 [Eq. 15], or q'' [T68]."""
    directions: Array
    """(..., n, 3): δ, unit vectors along the legs."""
    leg_omega: Array
    """(..., n, 3): angular velocity of the legs, rad/s [Eq. 26, 33]."""
    leg_eps: Array
    """(..., n, 3): angular acceleration of the legs, rad/s^2 [Eq. 28, 35]."""
    leg_spin: Array
    """(..., n): share of the leg's angular velocity along δ, rad/s [T6]."""
    leg_spin_rate: Array
    """(..., n): its rate, rad/s^2."""
    piston_velocity: Array
    """(..., n, 3): of the piston's or strut's mass centre, m/s [Eq. 38]."""
    piston_acceleration: Array
    """(..., n, 3): of the piston's or strut's mass centre, m/s^2 [Eq. 39]."""
    cylinder_velocity: Array
    """(..., n, 3): of the cylinder's or carriage's mass centre, m/s [Eq. 38]."""
    cylinder_acceleration: Array
    """(..., n, 3): of the cylinder's or carriage's mass centre, m/s^2 [Eq. 39]."""
    base_joint_angles: Array
    """(..., n, 2): leg against base, zero at home, rad: about the axis in the base, then n; or NaN."""
    base_joint_rates: Array
    """(..., n, 2): their rates, rad/s [Eq. 24, 25]."""
    platform_joint_angles: Array
    """(..., n, 2): platform against leg, zero at home, rad: about the axis in it, then n [Eq. 29]."""
    platform_joint_rates: Array
    """(..., n, 2): their rates, rad/s [Eq. 32]."""
    base_cone_angle: Array
    """(..., n): between leg and cone axis of the base joint, rad."""
    platform_cone_angle: Array
    """(..., n): between leg and cone axis of the platform joint, rad."""
    rod_angle: Array
    """(..., k): rotation of each rod about its line, zero at home, rad."""
    rod_omega: Array
    """(..., k, 3): angular velocity of the rods, rad/s [Eq. 36]."""
    rod_eps: Array
    """(..., k, 3): angular acceleration of the rods, rad/s^2 [Eq. 37]."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "lengths": "length",
        "rates": "rate",
        "accelerations": "leg_acceleration",
        "directions": "direction",
        "leg_omega": "leg_omega",
        "leg_eps": "leg_eps",
        "leg_spin": "leg_spin",
        "leg_spin_rate": "leg_spin_rate",
        "piston_velocity": "piston_velocity",
        "piston_acceleration": "piston_acceleration",
        "cylinder_velocity": "cylinder_velocity",
        "cylinder_acceleration": "cylinder_acceleration",
        "base_joint_angles": "base_joint_angle",
        "base_joint_rates": "base_joint_rate",
        "platform_joint_angles": "platform_joint_angle",
        "platform_joint_rates": "platform_joint_rate",
        "base_cone_angle": "base_cone_angle",
        "platform_cone_angle": "platform_cone_angle",
        "rod_angle": "rod_angle",
        "rod_omega": "rod_omega",
        "rod_eps": "rod_eps",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class PlatformTwist(Answer):
    """The platform's motion for given leg rates [Eq. 13]."""

    twist: Array
    """(..., 6): v of o in m/s, ω in rad/s."""
    status: Codes
    """(...): `Status` of each state; SINGULAR where the rates do not determine it."""

    _variables: ClassVar = {"twist": "twist", "status": "status"}


@dataclass(eq=False, repr=False)
class PlatformAcceleration(Answer):
    """The platform's acceleration for given second rates of the legs [Eq. 19]."""

    acceleration: Array
    """(..., 6): a of o in m/s^2, ε in rad/s^2."""
    status: Codes
    """(...): `Status` of each state; SINGULAR where the legs do not determine it."""

    _variables: ClassVar = {"acceleration": "acceleration", "status": "status"}
