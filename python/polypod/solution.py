"""A motion through a mechanism: every quantity of its kinematics and dynamics as one labelled dataset."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson

from polypod import _core
from polypod.answers import State
from polypod.mechanism import Mechanism
from polypod.motion import Motion
from polypod.passages import find_passages
from polypod.results import Solution
from polypod.singularity import Determinant
from polypod.status import Status
from polypod.units import coordinate_unit

CHUNK = 20_000
"""States solved between two reports of progress."""

Array = NDArray[np.float64]

_TIME, _LEG, _ROD = ("time",), ("time", "leg"), ("time", "rod")
_LEG3, _ROD3, _SIX = ("time", "leg", "axis"), ("time", "rod", "axis"), ("time", "component")
_LIMIT = ("time", "limit")
_PAIR = ("time", "leg", "joint_axis")
_JOINT, _JOINT_AXES = ("time", "joint", "component"), ("time", "joint", "joint_component")

# name → dimensions, unit, symbol, long name
VARIABLES: dict[str, tuple[tuple[str, ...], str, str, str]] = {
    "pose": (("time", "row", "column"), "1 and m", "", "pose of the platform, homogeneous matrix"),
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
    "rod_angle": (_ROD, "rad", "", "turn of the rod about its line since home"),
    "rod_omega": (_ROD3, "rad/s", "ω_L", "angular velocity of the rod"),
    "rod_eps": (_ROD3, "rad/s^2", "ε_L", "angular acceleration of the rod"),
    "wrench": (_SIX, "N and N m", "(F_o, T_o)", "load on the platform at o, in its own axes"),
    "force": (_LEG, "N", "f_a", "active force of the leg"),
    "constraint": (("time", "constraint_row"), "N or N m", "f_c", "multiplier of the constraint"),
    "coupled_force": (("time", "coupled_leg"), "N", "f_c1, f_c3", "couple-constrained force"),
    "coupled_torque": (_TIME, "N m", "T_c", "couple-constrained torque on the rod"),
    "coupled_force_as_printed": (("time", "coupled_leg"), "N", "f_c1, f_c3", "the same, Eq. 44 as printed"),
    "coupled_torque_as_printed": (_TIME, "N m", "T_c", "the same, Eq. 44 as printed"),
    "kinetic_energy": (_TIME, "J", "K", "kinetic energy"),
    "potential_energy": (_TIME, "J", "P", "potential energy"),
    "actuator_power": (_TIME, "W", "", "power of the actuators"),
    "load_power": (_TIME, "W", "", "power of the load"),
    "damping_power": (_TIME, "W", "", "power of the damping"),
    "friction_power": (_TIME, "W", "", "power that the efficiency stands for"),
    "power_residual": (_TIME, "W", "", "what is left of the power balance"),
    "actuator_work": (_TIME, "J", "", "work of the actuators since the start"),
    "sigma_min": (_TIME, "1", "σ_min", "smallest singular value of the leg Jacobian"),
    "condition": (_TIME, "1", "", "condition number of the leg Jacobian"),
    "limit_margin": (_LIMIT, "m, rad, 1 or N", "", "slack of the limit, negative beyond it"),
    "limit_relative": (_LIMIT, "1", "", "slack of the limit relative to its scale"),
    "binding_limit": (_TIME, "1", "", "index of the limit with the least relative slack; -1 for none"),
    "determinant": (_TIME, "1", "det J", "determinant of the Jacobian in pure numbers"),
    "determinant_rate": (_TIME, "1/s", "(det J)'", "rate of the determinant"),
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
# prefix of the variable, in words, unit, primes
_ORDERS = (
    ("coordinate_second_rate_", "second rate of ", "/s^2", "''"),
    ("coordinate_rate_", "rate of ", "/s", "'"),
    ("coordinate_", "", "", ""),
)
_SYMBOLS = {"alpha": "α", "beta": "β", "gamma": "γ", "x": "X_o", "y": "Y_o", "z": "Z_o"}


def solve(
    mech: Mechanism,
    motion: Motion,
    *,
    reactions: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Solution:
    """Kinematics, inverse dynamics, power and conditioning along a motion.

    Args:
        mech: the mechanism.
        motion: its motion; its own load, where it has one, stands for the mechanism's.
        reactions: also the reactions of all joints, see `Mechanism.joint_reactions`.
        progress: called now and then with the number of states done and the number of all.

    Returns:
        A `Solution`, whose dataset has one variable for each quantity, SI, and the `Status` of every state.
        Its `singularities` tell which singular poses the motion crosses or comes near, also between samples.

    >>> import polypod as pp
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> solution = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech))
    >>> dict(solution.dataset.force.sizes)
    {'time': 801, 'leg': 5}
    """
    state = states_along(mech, motion)
    total, parts = len(motion.time), []
    for start in range(0, total, CHUNK):
        chunk = slice(start, min(start + CHUNK, total))
        part = _solve_chunk(mech, motion, state, chunk)
        parts.append(part | _solve_reactions(mech, motion, state, chunk) if reactions else part)
        if progress is not None:
            progress(chunk.stop, total)
    # Each part goes when its whole is there: long motions need their memory once, not twice.
    values = {name: np.concatenate([part.pop(name) for part in parts]) for name in [*parts[0]]}
    values["actuator_work"] = work_of(motion.time, values["actuator_power"])
    determinant = Determinant(values["determinant"], values["determinant_rate"], values["status"])
    passages = find_passages(mech, motion, state.pose, determinant)
    attrs: dict[str, str | int] = {
        "title": f"{mech.name} along {motion.name}",
        "motion": motion.name,
        "coordinate_set": motion.set,
        "branch": motion.branch,
        "wrench_axes": mech.geometry["load"]["axes"] if motion.wrench is None else motion.wrench_axes,
    }
    dataset = dataset_of(mech, motion.time, values, attrs)
    return Solution(dataset.assign_attrs(singularities=json.dumps(passages, ensure_ascii=False)))


def states_along(mech: Mechanism, motion: Motion) -> State:
    """Pose, twist and acceleration of the platform at the times of a motion."""
    return mech.state(
        motion.coordinates, motion.rates, motion.second_rates, branch=motion.branch, continued=True
    )


def _solve_chunk(mech: Mechanism, motion: Motion, state: State, chunk: slice) -> dict[str, NDArray[Any]]:
    """All variables of some states."""

    def of(part: Any) -> Any:
        return {name: of(column) for name, column in part.items()} if isinstance(part, dict) else part[chunk]

    wrench = None if motion.wrench is None else motion.wrench[chunk]
    return variables_of(mech, State(*map(of, state)), wrench, motion.wrench_axes)


def work_of(time: Array, power: Array) -> Array:
    """Work since the start (N,), J, by Simpson's rule through the states before the first without a power."""
    work = np.full(len(time), np.nan)
    known = len(time) if np.isfinite(power).all() else int(np.argmax(~np.isfinite(power)))
    if known > 2:
        work[:known] = cumulative_simpson(power[:known], x=time[:known], initial=0.0)
    return work


def variables_of(
    mech: Mechanism, state: State, wrench: Array | None, wrench_axes: str
) -> dict[str, NDArray[Any]]:
    """The variables of a solution at states (N,) under a load (N, 6), the mechanism's own for None."""
    pose, twist, acceleration = state.pose, state.twist, state.acceleration
    legs = mech.inverse_kinematics(pose)
    kin = mech.kinematics(pose, twist, acceleration)
    own = mech.geometry["load"]
    loads = np.broadcast_to([*own["force"], *own["torque"]], twist.shape) if wrench is None else wrench
    load = (wrench, wrench_axes)
    dynamics = mech.inverse_dynamics(pose, twist, acceleration, *load)
    power = mech.power(pose, twist, acceleration, *load)
    conditioning, determinant = mech.conditioning(pose), mech.determinant(pose, twist)
    limits = mech.limits(pose, *load, twist=twist, acceleration=acceleration)
    # The first thing that went wrong explains the rest.
    status = np.where(state.status != Status.OK, state.status, dynamics.status)
    values: dict[str, NDArray[Any]] = {
        "pose": pose,
        "twist": twist,
        "acceleration": acceleration,
        "length": legs.lengths,
        "rate": kin.rates,
        "leg_acceleration": kin.accelerations,
        "direction": legs.directions,
        "leg_omega": kin.leg_omega,
        "leg_eps": kin.leg_eps,
        "leg_spin": kin.leg_spin,
        "leg_spin_rate": kin.leg_spin_rate,
        "piston_velocity": kin.piston_velocity,
        "piston_acceleration": kin.piston_acceleration,
        "cylinder_velocity": kin.cylinder_velocity,
        "cylinder_acceleration": kin.cylinder_acceleration,
        "base_joint_angle": kin.base_joint_angles,
        "base_joint_rate": kin.base_joint_rates,
        "platform_joint_angle": kin.platform_joint_angles,
        "platform_joint_rate": kin.platform_joint_rates,
        "base_cone_angle": kin.base_cone_angle,
        "platform_cone_angle": kin.platform_cone_angle,
        "rod_angle": kin.rod_angle,
        "rod_omega": kin.rod_omega,
        "rod_eps": kin.rod_eps,
        "wrench": loads,
        "force": dynamics.forces,
        "constraint": dynamics.constraint,
        "kinetic_energy": power.kinetic,
        "potential_energy": power.potential,
        "actuator_power": power.actuators,
        "load_power": power.load,
        "damping_power": power.damping,
        "friction_power": power.friction,
        "power_residual": power.residual,
        "sigma_min": conditioning.sigma_min,
        "condition": conditioning.condition,
        "determinant": determinant.determinant,
        "determinant_rate": determinant.rate,
        "status": status.astype(np.int8),
    }
    if limits.names:
        values["limit_margin"], values["limit_relative"] = limits.margins, limits.relative
        values["binding_limit"] = limits.binding.astype(np.int32)
    for suffix, as_printed in (("", False), ("_as_printed", True)) if mech.coupled_legs else ():
        coupled = mech.coupled_forces(pose, dynamics.constraint, as_printed=as_printed)
        values[f"coupled_force{suffix}"] = coupled.forces
        values[f"coupled_torque{suffix}"] = coupled.torque
    for prefix, series in (
        ("coordinate_", state.coordinates),
        ("coordinate_rate_", state.coordinate_rates),
        ("coordinate_second_rate_", state.coordinate_second_rates),
    ):
        values |= {prefix + name: column for name, column in series.items()}
    return values


def _solve_reactions(mech: Mechanism, motion: Motion, state: State, chunk: slice) -> dict[str, NDArray[Any]]:
    """The reactions of all joints at some states."""
    wrench = None if motion.wrench is None else motion.wrench[chunk]
    answer = mech.joint_reactions(
        state.pose[chunk], state.twist[chunk], state.acceleration[chunk], wrench, motion.wrench_axes
    )
    return {
        "reaction": answer.reactions,
        "reaction_in_joint": answer.reactions_in_joint,
        "least_reaction": answer.least,
        "least_reaction_in_joint": answer.least_in_joint,
        "reaction_determinate": answer.determinate_in_joint.astype(np.int8),
        "constraint_wrench": answer.constraint_wrench,
    }


def dataset_of(
    mech: Mechanism, time: Array, values: dict[str, NDArray[Any]], attrs: dict[str, str | int]
) -> xr.Dataset:
    """The variables with their dimensions, units, names and the inputs that they came from."""
    data: dict[str, Any] = {}
    for name, array in values.items():
        if name == "status":
            flags = {"flag_values": [*map(int, Status)], "flag_meanings": " ".join(s.name for s in Status)}
            data[name] = (_TIME, array, {"long_name": "outcome of the state", **flags})
        elif name.startswith("coordinate_"):
            data[name] = (_TIME, array, _coordinate_attributes(name))
        else:
            dims, unit, symbol, long_name = VARIABLES[name]
            data[name] = (dims, array, {"units": unit, "symbol": symbol, "long_name": long_name})
    mobility = mech.mobility()
    rows = [mobility.constraint_rows[i] for i in mobility.independent_rows]
    coords: dict[str, Any] = {
        "time": (_TIME, time, {"units": "s", "symbol": "t", "long_name": "time"}),
        "leg": list(mech.leg_names),
        "axis": ["x", "y", "z"],
        "component": ["linear x", "linear y", "linear z", "angular x", "angular y", "angular z"],
        "joint_axis": ["body", "leg"],
        "joint": [joint.name for joint in mech.joint_list],
        "joint_component": ["force 1", "force 2", "force 3", "torque 1", "torque 2", "torque 3"],
        "row": [0, 1, 2, 3],
        "column": [0, 1, 2, 3],
        "rod": list(mech.rod_names),
        "constraint_row": [f"{kind} of leg {leg}" for leg, kind in rows],
        "limit": [limit.name for limit in mech.limit_list],
        "limit_unit": ("limit", [limit.unit for limit in mech.limit_list]),
    }
    if mech.coupled_legs:
        coords["coupled_leg"] = list(mech.coupled_legs)
    coords = {name: value for name, value in coords.items() if _used(name, value, data)}
    source = {
        "mechanism": mech.name,
        "mechanism_file": mech.to_toml(),
        "polypod_version": _core.__version__,
    }
    # A mechanism without rods or constraints has no such variables.
    data = {name: variable for name, variable in data.items() if 0 not in variable[1].shape[1:]}
    return xr.Dataset(data, coords, {**attrs, **source})


def _used(name: str, value: Any, data: dict[str, Any]) -> bool:
    """Whether a coordinate has a dimension of some size that a variable uses."""
    dim = value[0] if isinstance(value, tuple) else name
    dim = dim if isinstance(dim, str) else dim[0]
    return any(dim in variable[0] and 0 not in variable[1].shape[1:] for variable in data.values())


def _coordinate_attributes(name: str) -> dict[str, str]:
    """Unit and names of a variable such as coordinate_rate_alpha."""
    prefix, before, per, primes = next(order for order in _ORDERS if name.startswith(order[0]))
    base = name.removeprefix(prefix)
    symbol = _SYMBOLS.get(base, base) + primes
    return {"units": coordinate_unit(base) + per, "symbol": symbol, "long_name": f"{before}coordinate {base}"}
