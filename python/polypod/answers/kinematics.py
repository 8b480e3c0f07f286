"""What a mechanism answers: named arrays over a batch of states, SI, base axes; and its mobility.

The shapes are written with n legs, k rods or constraints, and `...` for the batch. Vectors are in base axes
unless another frame is named. Every answer has a `Status` per state, knows the mechanism that was asked, and
goes to xarray by `to_xarray`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from polypod.answers.answer import Answer, Quantity, whole_rows
from polypod.answers.notebook import Rows, numbers
from polypod.answers.variables import COMPONENTS, variable

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]


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
    """(..., k): turn of each rod about its line, zero at home, rad."""
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


@dataclass(eq=False, repr=False)
class InverseDynamics(Answer):
    """What balances a motion [Eq. 43]."""

    forces: Array
    """(..., n): active forces, N; zero for passive legs.

    Positive when they push the platform away; of a slider when they push the carriage along its rail's axis.
    """
    constraint: Array
    """(..., k): multipliers of the independent constraints, N, of kind D N m; for the paper's machine f_c."""
    idle_torques: Array
    """(..., idle freedoms): torques about their lines on the platform that the motion needs and no leg gives,
    N m, such as a spindle's motor [T70]; in the order of `Mobility.idle`."""
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
    """What forces do to the platform [T49]."""

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


@dataclass(frozen=True)
class Joint:
    """A joint between two links, whose reaction is told of."""

    name: str
    """Such as "platform joint 3" or "rod L"."""
    kind: str
    """R, S, U or P; F where two links are one, so that the reaction is the load of their connection."""
    links: tuple[str, str]
    """The link on the base's side, which acts, and that on the platform's, which is acted on."""


@dataclass(eq=False, repr=False)
class JointReactions(Answer):
    """What joints do to links [T44-T48]; j joints: rods first, then each leg's from base to platform.

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


@dataclass(eq=False, repr=False)
class Conditioning(Answer):
    """Singular values of the leg Jacobian on the twists that the constraints allow [T24]; pure numbers."""

    sigma_min: Array
    """(...): the smallest: near zero the platform moves with hardly any change of the leg lengths."""
    sigma_max: Array
    """(...): the largest."""
    condition: Array
    """(...): their quotient, sigma_max / sigma_min."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "sigma_min": "sigma_min",
        "sigma_max": "sigma_max",
        "condition": "condition",
        "status": "status",
    }


@dataclass(eq=False, repr=False)
class Limits(Answer):
    """How far states are from the limits of their mechanism [T35]; m limits in the order of `limit_list`."""

    names: tuple[str, ...]
    """Such as "stroke max of leg 3"."""
    margins: Array
    """(..., m): signed slack of each in its own unit (m, rad, 1 or N), positive inside; NaN where it is not
    determined."""
    relative: Array
    """(..., m): the same as a part of the limit's scale, a pure number."""
    binding: NDArray[np.int64]
    """(...): index of the limit with the least relative slack; -1 where there is none."""
    within: NDArray[np.bool_]
    """(...): whether no limit is passed; False where a margin is NaN or the state has no answer."""
    status: Codes
    """(...): `Status` of each state."""

    _variables: ClassVar = {
        "margins": "limit_margin",
        "relative": "limit_relative",
        "binding": "binding_limit",
        "within": "within_limits",
        "status": "status",
    }


@dataclass(frozen=True)
class Limit:
    """One limit of a mechanism."""

    name: str
    """Such as "stroke max of leg 3"."""
    kind: str
    """stroke min, stroke max, base cone, platform cone, base angle, platform angle, rod angle, leg clearance,
    platform clearance, conditioning, force min or force max."""
    legs: tuple[str, ...]
    """Names of the legs that it concerns."""
    unit: str
    """m, rad, N or 1: of bounds, scale and margins."""
    least: float
    """-inf where it has no lower bound."""
    greatest: float
    """inf where it has no upper bound."""
    scale: float
    """What relative slack is measured by."""


@dataclass(frozen=True)
class GraphLink:
    """A link of the topology graph."""

    name: str
    """Such as "cylinder 1", "carriage 2", "rod L" or "platform"."""
    joints: tuple[int, ...]
    """Indices of its joints in `Mobility.graph_joints`."""


@dataclass(frozen=True)
class GraphJoint:
    """A joint of the topology graph between two links."""

    kind: str
    """R, S, U, P or F."""
    name: str
    """Such as "platform joint 3"."""
    links: tuple[int, int]
    """Indices of both links in `Mobility.graph_links`."""


@dataclass(frozen=True)
class Published:
    """The accounting that the mechanism's publication gives, in the terms of Eq. 1."""

    dof: int
    """Freedoms M."""
    redundant: int
    """Redundant constraints ς."""
    passive: int
    """Passive freedoms M_0."""


@dataclass(frozen=True)
class IdleFreedom:
    """A turn of the platform that no leg feels at any pose: the spin of a rod that all legs end on [T70]."""

    body: str
    """What the line is fixed in: "platform" or "base"."""
    point: tuple[float, float, float]
    """A point of the line in the axes of the body, m."""
    axis: tuple[float, float, float]
    """Its unit direction there: the spin is the angular velocity along it."""

    def __str__(self) -> str:
        point, axis = (f"({', '.join(f'{x:.6g}' for x in v)})" for v in (self.point, self.axis))
        return f"spin about the line through {point} m along {axis}, {self.body} axes, felt by no leg"


@dataclass(frozen=True)
class Mobility:
    """Freedoms of the mechanism from ranks at generic poses, in the terms of Eq. 1 [T18]."""

    dof: int
    """Freedoms of the platform: M of Eq. 1."""
    links: int
    """Number of links, base and platform among them: n_0 of Eq. 1."""
    joints: int
    """Number of joints: n_k of Eq. 1."""
    joint_freedoms: int
    """Freedoms of all joints together: ΣM_i of Eq. 1."""
    loops: int
    """Independent loops, n_k - n_0 + 1: each has six closure equations."""
    closure_rank: int
    """Number of closure equations that are independent."""
    redundant: int
    """Loop-closure equations that say nothing new: ς of Eq. 1."""
    redundant_legs: tuple[str, ...]
    """The legs whose constraints they couple."""
    passive: int
    """Freedoms that leave the platform where it is: M_0 of Eq. 1."""
    passive_legs: tuple[str, ...]
    """The legs that spin freely about their own line."""
    uncontrolled: int
    """Freedoms, idle ones apart, that remain at generic poses with all actuators locked: zero unless the
    design is singular."""
    idle: tuple[IdleFreedom, ...]
    """Freedoms that no leg feels, by design [T70]."""
    constraint_rows: tuple[tuple[str, str], ...]
    """Leg and kind (A-E) of every scalar constraint."""
    independent_rows: tuple[int, ...]
    """Indices of those that are independent."""
    graph_links: tuple[GraphLink, ...]
    """The links of the topology graph, base and platform first."""
    graph_joints: tuple[GraphJoint, ...]
    """Its joints."""
    published: Published | None
    """The accounting of the file's `[published]`, if there is one."""

    def _repr_html_(self) -> str:
        from polypod.cards import of_mobility

        return of_mobility(self)
