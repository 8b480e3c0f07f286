"""Answers of dynamics: forces, accelerations, equations of motion, joint reactions, powers; SI, base axes.

The shapes are written with n legs, k constraints, and `...` for the batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from polypod.answers.answer import Answer, Array, Codes
from polypod.answers.parts import Joint
from polypod.answers.variables import COMPONENTS


@dataclass(eq=False, repr=False)
class InverseDynamics(Answer):
    """Active forces and multipliers that balance a motion [Eq. 43]."""

    forces: Array
    """(..., n): active forces, N; zero for passive legs.

    Positive when they push the platform away; of a slider when they push the carriage along its rail's axis.
    """
    constraint: Array
    """(..., k): multipliers of the independent constraints, N, of kind D N m; for the paper's machine f_c."""
    idle_torques: Array
    """(..., local degrees of freedom): torques about their lines on the platform that the motion needs and no
    leg gives, N m, such as a spindle's motor [T70]; in the order of `Mobility.idle`."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "forces": "force",
        "constraint": "constraint",
        "idle_torques": "idle_torque",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class ForwardDynamics(Answer):
    """Acceleration of the platform for given forces [T49]."""

    acceleration: Array
    """(..., 6): a of o in m/s^2, ε in rad/s^2."""
    constraint: Array
    """(..., k): multipliers of the independent constraints, N, of kind D N m."""
    status: Codes
    """(...): `Status` of each state; SINGULAR where the constraints depend on one another: actuators need not
    control the platform."""

    _variables: ClassVar = {
        "acceleration": "acceleration",
        "constraint": "constraint",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class EquationsOfMotion(Answer):
    """The terms of M q'' + C q' + D q' + g = Jᵀ f + Sᵀ W/η in d velocities q' of the platform [T49-T52].

    In platform space q' is the twist V, and the multipliers of the constraints push, too:
    M A + C V + D V + g = (rows of `mech.jacobian`)ᵀ (f, f_c) + W/η. The efficiency η divides the
    platform's own mass, weight and damping in M, C, D and g, as it does in `inverse_dynamics`. Units are
    those of a twist, v in m/s before ω in rad/s, or of the coordinates' rates, m/s and rad/s.
    """

    coordinates: tuple[str, ...]
    """Names of the d independent coordinates; empty in platform space."""
    mass: Array
    """(..., d, d): M, kg, kg m and kg m^2; symmetric, positive definite on the motions that the constraints
    allow."""
    coriolis: Array
    """(..., d, d): C, kg/s, kg m/s and kg m^2/s; M' - 2C is skew-symmetric on the motions that the
    constraints allow."""
    damping: Array
    """(..., d, d): D, of the platform, N s/m, N s and N m s."""
    gravity: Array
    """(..., d): g, N and N m; the gradient of the potential energy where η is 1."""
    twist_jacobian: Array
    """(..., 6, d): S of V = S q', 1, m and 1/m; of a load W on the platform it takes Sᵀ W/η."""
    leg_jacobian: Array
    """(..., n, d): J of ℓ' = J q', all legs, 1 and m; of their forces it takes Jᵀ f."""
    rates: Array
    """(..., d): q' of the twist, m/s and rad/s."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "mass": "mass_matrix",
        "coriolis": "coriolis_matrix",
        "damping": "damping_matrix",
        "gravity": "gravity_forces",
        "twist_jacobian": "twist_jacobian",
        "leg_jacobian": "leg_jacobian",
        "rates": "coordinate_rates",
        "status": "status",
    }

    def labels(self) -> dict[str, Sequence[str]]:
        """The coordinates; the components of the twist in platform space."""
        names = self.coordinates or COMPONENTS
        return {"coordinate": names, "by_coordinate": names}


@dataclass(eq=False, repr=False)
class CoupledForces(Answer):
    """Forces of two legs on one rod, and the torque on the rod [T16]."""

    legs: tuple[str, str]
    """Their names."""
    forces: Array
    """(..., 2): f_c1 and f_c3 on the platform at b_1 and b_3 along c_1 = r_1×L/|r_1×L|, N.

    As printed, f_c3 is along c_3 = -c_1.
    """
    torque: Array
    """(...): T_c about the rod's line, N m."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "forces": "coupled_force",
        "torque": "coupled_torque",
        "status": "status",
    }

    def labels(self) -> dict[str, Sequence[str]]:
        """The two legs."""
        return {"coupled_leg": self.legs}


@dataclass(eq=False, repr=False)
class JointReactions(Answer):
    """Joint reactions [T44-T48]; j joints: rods first, then each leg's from base to platform.

    A reaction is the wrench (F, T), N and N m, of the link on the base's side on that on the platform's, with
    T about the joint's point. Joint axes: (n, δ, n×δ) of the leg; of a U joint (u, n, u×n), u its own axis;
    of a rod (L, n, L×n). So R is free about its first axis, U about its first and second; P carries the
    active force along its second.

    Where redundant constraints leave components open, `reactions` are those without couples in U joints, as
    far as balance allows (the paper's assumption), and `least` those with the least sum of squares; at
    determinate components both agree.
    """

    joints: tuple[Joint, ...]
    """The j joints, as in `Mechanism.joint_list`."""
    points: Array
    """(..., j, 3): the joints' points in base axes, m: B, and b for prismatic and platform joints.

    Of a slider the strut's foot for base and prismatic joint.
    """
    axes: Array
    """(..., j, 3, 3): joint axes to base axes, the axes as columns."""
    reactions: Array
    """(..., j, 6): without couples in U joints [T47], in base axes, N and N m."""
    reactions_in_joint: Array
    """(..., j, 6): the same in joint axes, N and N m."""
    least: Array
    """(..., j, 6): least sum of |F|^2 + |T/length|^2 over all joints [T47], in base axes, N and N m."""
    least_in_joint: Array
    """(..., j, 6): the same in joint axes, N and N m."""
    determinate: NDArray[np.bool_]
    """(..., j, 6): which components in base axes balance alone determines [T46]; False without answer."""
    determinate_in_joint: NDArray[np.bool_]
    """(..., j, 6): the same in joint axes."""
    constraint_wrench: Array
    """(..., 6): on the platform, at o in base axes, of all legs that constrain it, less their active forces;
    N and N m.

    Determinate, and no matter of convention; of legs and rods without mass it is the sum of f_c (c, τ) [T48].
    """
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "points": "joint_point",
        "axes": "joint_axes",
        "reactions": "reaction",
        "reactions_in_joint": "reaction_in_joint",
        "least": "least_reaction",
        "least_in_joint": "least_reaction_in_joint",
        "determinate": "determinate_in_base",
        "determinate_in_joint": "reaction_determinate",
        "constraint_wrench": "constraint_wrench",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class Power(Answer):
    """Energies and powers of a motion [T17]; W and J."""

    kinetic: Array
    """(...): kinetic energy of all links, J."""
    potential: Array
    """(...): potential energy of their weights, J; zero in the base's origin."""
    kinetic_rate: Array
    """(...): exact rate along the motion, W."""
    potential_rate: Array
    """(...): exact rate along the motion, W."""
    actuators: Array
    """(...): active forces times leg rates, W, positive where they drive; NaN where SINGULAR."""
    load: Array
    """(...): power of the load, W, positive where it drives."""
    damping: Array
    """(...): power of the damping, W, never positive."""
    friction: Array
    """(...): power that the efficiency η stands for, W, negative where it takes."""
    residual: Array
    """(...): actuators + load + damping + friction - kinetic_rate - potential_rate, W; 0 up to rounding."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "kinetic": "kinetic_energy",
        "potential": "potential_energy",
        "kinetic_rate": "kinetic_rate",
        "potential_rate": "potential_rate",
        "actuators": "actuator_power",
        "load": "load_power",
        "damping": "damping_power",
        "friction": "friction_power",
        "residual": "power_residual",
        "status": "status",
    }
