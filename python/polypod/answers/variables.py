"""Name, unit and dimensions of every quantity: the one definition for all datasets.

The dimensions stand without those of the states (time, or the batch), which come first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from typing import Any, NamedTuple, Protocol

from polypod.answers.mobility import Mobility
from polypod.answers.parts import Joint, Limit
from polypod.answers.singularity_kind import SingularityKind
from polypod.answers.status import Status
from polypod.files.units import coordinate_unit, si_unit
from polypod.legs.drive import Drive
from polypod.legs.drives import kinds_among

Dims = tuple[str, ...]

POSE: Dims = ("row", "column")
HALVES = ("component", "joint_component", "move")
"""Dimensions of six, whose first three have another unit than the last three."""

_ONE: Dims = ()
_LEG, _ROD, _LIMIT, _AXIS = ("leg",), ("rod",), ("limit",), ("axis",)
_LEG3, _ROD3, _SIX, _PAIR = ("leg", "axis"), ("rod", "axis"), ("component",), ("leg", "joint_axis")
_JOINT, _JOINT_AXES = ("joint", "component"), ("joint", "joint_component")
_ROW = ("constraint_row",)
_MODE, _COORDINATE, _SIDES = ("mode",), ("coordinate",), ("coordinate", "side")


class HasParts(Protocol):
    """Interface that answers need of a mechanism: the names of its parts."""

    name: str
    leg_names: tuple[str, ...]
    rod_names: tuple[str, ...]

    @property
    def drives(self) -> tuple[Drive, ...]:
        """What drives each leg."""

    @property
    def coupled_legs(self) -> tuple[str, str] | None:
        """The two legs on one rod that share a constraint, or None."""

    @property
    def joint_list(self) -> tuple[Joint, ...]:
        """All joints."""

    @property
    def limit_list(self) -> tuple[Limit, ...]:
        """All limits that the file sets."""

    def mobility(self) -> Mobility:
        """Degrees of freedom, constraints and the topology graph."""


class Variable(NamedTuple):
    """A quantity as datasets, tables and axes tell of it."""

    dims: Dims
    unit: str
    """SI; several, such as "N and N m", where they differ between components."""
    symbol: str
    long_name: str
    flags: type[IntEnum] | None = None
    """Meanings of its numbers, if they are codes."""

    @property
    def attributes(self) -> dict[str, Any]:
        """Those of the variable of a dataset."""
        if self.flags is None:
            return {"units": self.unit, "symbol": self.symbol, "long_name": self.long_name}
        meanings = " ".join(flag.name for flag in self.flags)
        return {
            "long_name": self.long_name,
            "flag_values": [*map(int, self.flags)],
            "flag_meanings": meanings,
        }


def _variables(entries: dict[str, tuple[Any, ...]]) -> dict[str, Variable]:
    return {name: Variable(*entry) for name, entry in entries.items()}


TIME = {"units": "s", "symbol": "t", "long_name": "time"}
STATUS = Variable(_ONE, "", "", "outcome of the state", Status)

# Those of solutions, in their order.
VARIABLES = _variables(
    {
        "pose": (POSE, "1 and m", "", "pose of the platform, homogeneous matrix"),
        "twist": (_SIX, "m/s and rad/s", "V", "velocity of o and angular velocity of the platform"),
        "acceleration": (
            _SIX,
            "m/s^2 and rad/s^2",
            "A",
            "acceleration of o and angular acceleration of the platform",
        ),
        "length": (_LEG, "m", "r", "leg length"),
        "rate": (_LEG, "m/s", "v_r", "leg rate"),
        "leg_acceleration": (_LEG, "m/s^2", "a_r", "leg acceleration"),
        "direction": (_LEG3, "1", "δ", "unit vector of the leg"),
        "leg_omega": (_LEG3, "rad/s", "ω_r", "angular velocity of the leg"),
        "leg_eps": (_LEG3, "rad/s^2", "ε_r", "angular acceleration of the leg"),
        "leg_spin": (_LEG, "rad/s", "s", "spin of the leg about its line"),
        "leg_spin_rate": (_LEG, "rad/s^2", "s'", "rate of the leg's spin"),
        "piston_velocity": (_LEG3, "m/s", "v_p", "velocity of the piston's mass centre"),
        "piston_acceleration": (_LEG3, "m/s^2", "a_p", "acceleration of the piston's mass centre"),
        "cylinder_velocity": (_LEG3, "m/s", "v_q", "velocity of the cylinder's mass centre"),
        "cylinder_acceleration": (_LEG3, "m/s^2", "a_q", "acceleration of the cylinder's mass centre"),
        "base_joint_angle": (_PAIR, "rad", "ψ", "angles of the base joint since home"),
        "base_joint_rate": (_PAIR, "rad/s", "ψ'", "rates of the base joint"),
        "platform_joint_angle": (_PAIR, "rad", "φ", "angles of the platform joint since home"),
        "platform_joint_rate": (_PAIR, "rad/s", "φ'", "rates of the platform joint"),
        "base_cone_angle": (_LEG, "rad", "", "angle between leg and cone axis of the base joint"),
        "platform_cone_angle": (_LEG, "rad", "", "angle between leg and cone axis of the platform joint"),
        "rod_angle": (_ROD, "rad", "", "rotation of the rod about its line since home"),
        "rod_omega": (_ROD3, "rad/s", "ω_L", "angular velocity of the rod"),
        "rod_eps": (_ROD3, "rad/s^2", "ε_L", "angular acceleration of the rod"),
        "wrench": (_SIX, "N and N m", "(F_o, T_o)", "load on the platform at o, in its own axes"),
        "force": (_LEG, "N", "f_a", "active force of the leg"),
        "constraint": (_ROW, "N or N m", "f_c", "multiplier of the constraint"),
        "idle_torque": (("idle",), "N m", "", "torque about the line of a local degree of freedom"),
        "coupled_force": (("coupled_leg",), "N", "f_c1, f_c3", "couple-constrained force"),
        "coupled_torque": (_ONE, "N m", "T_c", "couple-constrained torque on the rod"),
        "coupled_force_as_printed": (("coupled_leg",), "N", "f_c1, f_c3", "the same, Eq. 44 as printed"),
        "coupled_torque_as_printed": (_ONE, "N m", "T_c", "the same, Eq. 44 as printed"),
        "kinetic_energy": (_ONE, "J", "K", "kinetic energy"),
        "potential_energy": (_ONE, "J", "P", "potential energy"),
        "actuator_power": (_ONE, "W", "", "power of the actuators"),
        "load_power": (_ONE, "W", "", "power of the load"),
        "damping_power": (_ONE, "W", "", "power of the damping"),
        "friction_power": (_ONE, "W", "", "power that the efficiency stands for"),
        "power_residual": (_ONE, "W", "", "what is left of the power balance"),
        "actuator_work": (_ONE, "J", "", "work of the actuators since the start"),
        "sigma_min": (_ONE, "1", "σ_min", "smallest singular value of the leg Jacobian"),
        "condition": (_ONE, "1", "", "condition number of the leg Jacobian"),
        "limit_margin": (_LIMIT, "m, rad, 1 or N", "", "slack of the limit, negative beyond it"),
        "limit_relative": (_LIMIT, "1", "", "slack of the limit relative to its scale"),
        "binding_limit": (_ONE, "1", "", "index of the limit with the least relative slack; -1 for none"),
        "determinant": (_ONE, "1", "det J", "determinant of the Jacobian in pure numbers"),
        "determinant_rate": (_ONE, "1/s", "(det J)'", "rate of the determinant"),
        "reaction": (
            _JOINT,
            "N and N m",
            "(F, T)",
            "reaction of the joint without couples in U joints, base axes",
        ),
        "reaction_in_joint": (_JOINT_AXES, "N and N m", "(F, T)", "the same in joint axes"),
        "least_reaction": (_JOINT, "N and N m", "(F, T)", "reaction of the joint, least in size, base axes"),
        "least_reaction_in_joint": (_JOINT_AXES, "N and N m", "(F, T)", "the same in joint axes"),
        "reaction_determinate": (_JOINT_AXES, "1", "", "whether balance alone determines it, in joint axes"),
        "constraint_wrench": (_SIX, "N and N m", "W_c", "wrench of the constraining legs less active forces"),
    }
)

# Those that answers have beside them.
FURTHER = _variables(
    {
        "leg_vector": (_LEG3, "m", "r", "from base joint to platform joint"),
        "pose_error": (_ONE, "m", "", "largest error of a length or of a constraint"),
        "iterations": (_ONE, "1", "", "Newton steps"),
        "mode_pose": (("mode", *POSE), "1 and m", "", "pose of the assembly mode, homogeneous matrix"),
        "mode_number": (_ONE, "1", "", "number of assembly modes"),
        "mode_sign": (_MODE, "1", "sgn det J", "sign of the determinant, 0 where modes meet"),
        "mode_above": (_MODE, "1", "", "1 on the side of the base joints where home is, else 0"),
        "mode_multiplicity": (_MODE, "1", "", "modes that meet in this one"),
        "mode_error": (_MODE, "m", "", "largest error of a length or of a constraint"),
        "mode_status": (_MODE, "", "", "outcome of the mode", Status),
        "kinetic_rate": (_ONE, "W", "K'", "rate of the kinetic energy"),
        "potential_rate": (_ONE, "W", "P'", "rate of the potential energy"),
        "sigma_max": (_ONE, "1", "σ_max", "largest singular value of the leg Jacobian"),
        "constraint_sigma": (_ONE, "1", "", "smallest singular value of the constraints' rows"),
        "relative_length": (_LEG, "1", "", "leg length by the characteristic length"),
        "leg_sine": (_LEG, "1", "", "sine of the angle between leg and axis of its joint or rod"),
        "transmission": (_LEG, "1", "", "cosine between strut and prismatic joint; 1 for a telescopic leg"),
        "singularity_kind": (_ONE, "", "", "kind of the singularity", SingularityKind),
        "singular_leg": (_ONE, "1", "", "index of the leg that the kind speaks of; -1 for none"),
        "uncontrolled": (_ONE, "1", "", "degrees of freedom that locked actuators leave; -1 where not known"),
        "uncontrolled_twist": (_SIX, "m/s and rad/s", "", "allowed twist that the legs notice least"),
        "screw_axis": (_AXIS, "1", "", "direction of that twist's axis"),
        "screw_pitch": (_ONE, "m/rad", "", "slide per rotation; inf for a translation"),
        "screw_point": (_AXIS, "m", "", "point of the axis nearest to o, from o"),
        "within_limits": (_ONE, "1", "", "whether no limit is passed"),
        "coordinate_value": (_COORDINATE, "m or rad", "", "coordinate at the pose"),
        "singular_value": (_SIDES, "m or rad", "", "nearest singular value below and above"),
        "singular_distance": (_SIDES, "m or rad", "", "how far it is to that value"),
        "singular_kind": (_SIDES, "", "", "kind of the singularity there", SingularityKind),
        "searched_value": (_SIDES, "m or rad", "", "value up to which poses were looked at"),
        "mass_matrix": (("coordinate", "by_coordinate"), "kg, kg m and kg m^2", "M", "mass matrix"),
        "coriolis_matrix": (
            ("coordinate", "by_coordinate"),
            "kg/s, kg m/s and kg m^2/s",
            "C",
            "Coriolis matrix",
        ),
        "damping_matrix": (
            ("coordinate", "by_coordinate"),
            "N s/m, N s and N m s",
            "D",
            "damping matrix of the platform",
        ),
        "gravity_forces": (_COORDINATE, "N and N m", "g", "gradient of the potential energy"),
        "twist_jacobian": (("component", "coordinate"), "1, m and 1/m", "S", "twist by rates: V = S q'"),
        "leg_jacobian": (("leg", "coordinate"), "1 and m", "J", "leg rates by rates: ℓ' = J q'"),
        "coordinate_rates": (_COORDINATE, "m/s and rad/s", "q'", "rates of the coordinates"),
        "joint_point": (("joint", "axis"), "m", "", "point of the joint, base axes"),
        "joint_axes": (("joint", "axis", "joint_axis_number"), "1", "", "axes of the joint, as columns"),
        "determinate_in_base": (_JOINT, "1", "", "whether balance alone determines it, base axes"),
        "parameter_value": (("parameter",), "kg, kg m and kg m^2", "", "inertial parameter of the file"),
        "regressor": (
            ("leg", "parameter"),
            "N/kg, N/(kg m) and N/(kg m^2)",
            "Y",
            "active force by parameter",
        ),
        "constraint_regressor": (
            ("constraint_row", "parameter"),
            "N/kg, N/(kg m) and N/(kg m^2); N m for N in rows of kind D",
            "Y_c",
            "multiplier by parameter",
        ),
        "force_offset": (_LEG, "N", "", "active force of load and damping alone"),
        "constraint_offset": (_ROW, "N or N m", "", "multiplier of load and damping alone"),
        "base_column": (("base_parameter",), "1", "", "place of the base parameter in the regressor"),
        "combination": (("base_parameter", "parameter"), "1, m and m^2", "", "parameters in base parameters"),
        "base_value": (("base_parameter",), "kg, kg m and kg m^2", "", "base parameter of the file"),
        "remainder": (("parameter",), "1", "", "part of its column that those before it leave"),
        "lengths_by_geometry": (("leg", "geometry_parameter"), "m/m and m", "", "leg length by geometry"),
    }
)
_VARIED = {  # by what: dimension, units of that, in words
    "pose": ("move", "N/m and N/rad", "pose"),
    "twist": ("component", "N s/m and N s/rad", "twist"),
    "acceleration": ("component", "N s^2/m and N s^2/rad", "acceleration"),
    "coordinates": ("coordinate", "N/m and N/rad", "coordinate"),
    "rates": ("coordinate", "N s/m and N s/rad", "rate of the coordinate"),
    "second_rates": ("coordinate", "N s^2/m and N s^2/rad", "second rate of the coordinate"),
    "bodies": ("body_parameter", "N/kg, N/m and N/(kg m^2)", "mass, mass centre and inertia"),
    "geometry": ("geometry_parameter", "N/m and N", "points and axes"),
}
for _by, (_dim, _units, _words) in _VARIED.items():
    FURTHER[f"forces_by_{_by}"] = Variable(("leg", _dim), _units, "", f"active force by {_words}")
    FURTHER[f"constraint_by_{_by}"] = Variable(
        ("constraint_row", _dim), f"{_units}; N m for N in rows of kind D", "", f"multiplier by {_words}"
    )

# prefix of the variable, in words, unit, primes
_ORDERS = (
    ("coordinate_second_rate_", "second rate of ", "/s^2", "''"),
    ("coordinate_rate_", "rate of ", "/s", "'"),
    ("coordinate_", "", "", ""),
)
_SYMBOLS = {"alpha": "α", "beta": "β", "gamma": "γ", "x": "X_o", "y": "Y_o", "z": "Z_o"}


def variable(name: str) -> Variable:
    """The quantity of a name, that of a coordinate such as coordinate_rate_alpha too."""
    if name == "status":
        return STATUS
    found = VARIABLES.get(name) or FURTHER.get(name)
    if found is not None:
        return found
    prefix, before, per, primes = next(order for order in _ORDERS if name.startswith(order[0]))
    base = name.removeprefix(prefix)
    symbol = _SYMBOLS.get(base, base) + primes
    return Variable(_ONE, coordinate_unit(base) + per, symbol, f"{before}coordinate {base}")


_OF_DRIVES = {
    "length": ("coordinate_kind", ""),
    "rate": ("coordinate_kind", "/s"),
    "leg_acceleration": ("coordinate_kind", "/s^2"),
    "force": ("force_kind", ""),
}
"""Variables whose unit is that of the drives' coordinates or forces, and what that is divided by."""


def attributes_of(name: str, about: Variable, drives: Sequence[Drive]) -> dict[str, Any]:
    """Those of a variable of a dataset of a mechanism with these drives; some have other names for it."""
    found, kinds = about.attributes, kinds_among(drives)
    if name in _OF_DRIVES:
        quantity, per = _OF_DRIVES[name]
        units = (si_unit(getattr(drive, quantity)) + per for drive in kinds)
        found |= {"units": " or ".join(dict.fromkeys(units))}
    own = [drive.variables[name] for drive in kinds if name in drive.variables]
    if not own:
        return found
    names = [long_name for _, long_name in own]
    if len(own) < len(kinds):
        names = [about.long_name, *names]
    return found | {"symbol": own[0][0], "long_name": ", or ".join(names)}


# --- labels along dimensions --------------------------------------------------------------------------------

_XYZ = ("x", "y", "z")
COMPONENTS = ("linear x", "linear y", "linear z", "angular x", "angular y", "angular z")
_LABELS: dict[str, Callable[[HasParts], Sequence[Any]]] = {
    "leg": lambda mech: mech.leg_names,
    "axis": lambda mech: _XYZ,
    "component": lambda mech: COMPONENTS,
    "joint_axis": lambda mech: ("body", "leg"),
    "joint": lambda mech: [joint.name for joint in mech.joint_list],
    "joint_component": lambda mech: ("force 1", "force 2", "force 3", "torque 1", "torque 2", "torque 3"),
    "row": lambda mech: range(4),
    "column": lambda mech: range(4),
    "rod": lambda mech: mech.rod_names,
    "constraint_row": lambda mech: constraint_rows(mech),
    "limit": lambda mech: [limit.name for limit in mech.limit_list],
    "coupled_leg": lambda mech: mech.coupled_legs or (),
    "joint_axis_number": lambda mech: (1, 2, 3),
    "move": lambda mech: ("x", "y", "z", "about x", "about y", "about z"),
    "side": lambda mech: ("below", "above"),
}

DIMENSIONS = frozenset(dim for about in (*VARIABLES.values(), *FURTHER.values()) for dim in about.dims)
"""Names of all dimensions but those of the states."""


def _unit_along(name: str) -> str:
    """Of a coordinate, or of a component of the platform's motion."""
    return "m" if name.startswith("linear") else coordinate_unit(name)


def constraint_rows(mech: HasParts) -> list[str]:
    """Names of the independent constraints, such as "A of leg 1"."""
    mobility = mech.mobility()
    rows = [mobility.constraint_rows[i] for i in mobility.independent_rows]
    return [f"{kind} of leg {leg}" for leg, kind in rows]


def coords_of(mech: HasParts, dims: set[str], own: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    """The labels along dimensions as coordinates of a dataset; `own` are those that no mechanism knows."""
    labels = {dim: list(of(mech)) for dim, of in _LABELS.items() if dim in dims and dim not in own}
    labels |= {dim: list(names) for dim, names in own.items() if dim in dims}
    coords: dict[str, Any] = labels
    if "limit" in dims:
        coords["limit_unit"] = ("limit", [limit.unit for limit in mech.limit_list])
    if "coordinate" in dims:
        coords["coordinate_unit"] = ("coordinate", [_unit_along(name) for name in own["coordinate"]])
    return coords
