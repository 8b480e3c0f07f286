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
from polypod.answers.answer import Answer
from polypod.answers.kinematics import State
from polypod.answers.singularity import Determinant
from polypod.answers.status import Status
from polypod.answers.variables import TIME, attributes_of, coords_of, variable
from polypod.answers.variables import VARIABLES as VARIABLES
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.solution.motion_plausibility import warnings_about
from polypod.solution.singularity_crossings import find_passages
from polypod.solution.solution import Solution

CHUNK = 20_000
"""States solved between two reports of progress."""

Array = NDArray[np.float64]


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
        Its `singularities` list the singular poses that the motion crosses or comes near, also between
        samples.

    >>> import polypod as pp
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> solution = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech))
    >>> dict(solution.dataset.force.sizes)
    {'time': 801, 'leg': 5}
    """
    state = states_along(mech, motion)
    total = len(motion.time)
    values: dict[str, NDArray[Any]] = {}
    for start in range(0, total, CHUNK):
        chunk = slice(start, min(start + CHUNK, total))
        part = _solve_chunk(mech, motion, state, chunk)
        if reactions:
            part |= _solve_reactions(mech, motion, state, chunk)
        for name, column in part.items():
            # The whole at once: long motions need their memory once, and what a part needed serves the next.
            if name not in values:
                values[name] = np.empty((total, *column.shape[1:]), column.dtype)
            values[name][chunk] = column
        if progress is not None:
            progress(chunk.stop, total)
    values["actuator_work"] = work_of(motion.time, values["actuator_power"])
    determinant = Determinant(
        mech,
        determinant=values["determinant"],
        rate=values["determinant_rate"],
        status=values["status"],
    )
    passages = find_passages(mech, motion, state.pose, determinant)
    attrs: dict[str, str | int] = {
        "title": f"{mech.name} along {motion.name}",
        "motion": motion.name,
        "coordinate_set": motion.set,
        "branch": motion.branch,
        "wrench_axes": mech.geometry["load"]["axes"] if motion.wrench is None else motion.wrench_axes,
    }
    dataset = dataset_of(mech, motion.time, values, attrs)
    return Solution(
        dataset.assign_attrs(
            singularities=json.dumps(passages, ensure_ascii=False),
            warnings=json.dumps(warnings_about(mech, motion, state.pose), ensure_ascii=False),
        )
    )


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
    part = State(mech, **{name: of(column) for name, column in vars(state).items() if name != "mech"})
    return variables_of(mech, part, wrench, motion.wrench_axes)


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
    load = (wrench, wrench_axes)
    dynamics = mech.inverse_dynamics(pose, twist, acceleration, *load)
    limits = mech.limits(pose, *load, twist=twist, acceleration=acceleration)
    values = _by_quantity(
        state,
        mech.kinematics(pose, twist, acceleration),
        mech.inverse_kinematics(pose),
        dynamics,
        mech.power(pose, twist, acceleration, *load),
        mech.conditioning(pose),
        mech.determinant(pose, twist),
        limits,
    )
    own = mech.geometry["load"]
    own_load = np.broadcast_to([*own["force"], *own["torque"]], twist.shape)
    values["wrench"] = own_load if wrench is None else wrench
    for suffix, as_printed in (("", False), ("_as_printed", True)) if mech.coupled_legs else ():
        coupled = mech.coupled_forces(pose, dynamics.constraint, as_printed=as_printed)
        values[f"coupled_force{suffix}"] = coupled.forces
        values[f"coupled_torque{suffix}"] = coupled.torque
    if limits.names:
        values["binding_limit"] = limits.binding.astype(np.int32)
    else:
        del values["binding_limit"]
    # The first thing that went wrong explains the rest.
    status = np.where(state.status != Status.OK, state.status, dynamics.status)
    chosen = {name: values[name] for name in VARIABLES if name in values}
    coordinates = {name: column for name, column in values.items() if name.startswith("coordinate_")}
    return {**chosen, "status": status.astype(np.int8), **coordinates}


def _by_quantity(*answers: Answer) -> dict[str, NDArray[Any]]:
    """The arrays of answers by the names that they have in datasets; the last counts."""
    return {quantity.key: quantity.values for answer in answers for quantity in answer.quantities()}


def _solve_reactions(mech: Mechanism, motion: Motion, state: State, chunk: slice) -> dict[str, NDArray[Any]]:
    """The reactions of all joints at some states."""
    wrench = None if motion.wrench is None else motion.wrench[chunk]
    answer = mech.joint_reactions(
        state.pose[chunk], state.twist[chunk], state.acceleration[chunk], wrench, motion.wrench_axes
    )
    values = _by_quantity(answer)
    values["reaction_determinate"] = values["reaction_determinate"].astype(np.int8)
    return {name: values[name] for name in VARIABLES if name in values}


def dataset_of(
    mech: Mechanism, time: Array, values: dict[str, NDArray[Any]], attrs: dict[str, str | int]
) -> xr.Dataset:
    """The variables with their dimensions, units, names and the inputs that they came from."""
    data: dict[str, Any] = {}
    for name, array in values.items():
        about = variable(name)
        # A mechanism without rods or constraints has no such variables.
        if 0 not in array.shape[1:]:
            data[name] = (("time", *about.dims), array, attributes_of(name, about, mech.drives))
    dims = {dim for of, _, _ in data.values() for dim in of}
    instants = {"time": ("time", time, TIME)}
    source = {
        "mechanism": mech.name,
        "mechanism_file": mech.to_toml(),
        "polypod_version": _core.__version__,
    }
    return xr.Dataset(data, {**instants, **coords_of(mech, dims, {})}, {**attrs, **source})
