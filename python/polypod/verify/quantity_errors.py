"""The quantities that are compared, and the errors of each over all states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polypod.mechanism import Mechanism

Array = NDArray[np.float64]

# name → words, unit, what errors are relative to
QUANTITIES: dict[str, tuple[str, str, str]] = {
    "freedoms": ("freedoms", "1", "freedoms"),
    "lengths": ("leg lengths", "m", "length"),
    "rates": ("leg rates", "m/s", "speed"),
    "accelerations": ("leg accelerations", "m/s^2", "acceleration"),
    "platform_acceleration": ("platform, accel.", "m/s^2", "acceleration"),
    "platform_eps": ("platform, ang. accel.", "rad/s^2", "angular acceleration"),
    "leg_omega": ("legs, ang. velocity", "rad/s", "angular speed"),
    "leg_eps": ("legs, ang. accel.", "rad/s^2", "angular acceleration"),
    "piston_velocity": ("pistons, velocity", "m/s", "speed"),
    "piston_acceleration": ("pistons, accel.", "m/s^2", "acceleration"),
    "cylinder_velocity": ("cylinders, velocity", "m/s", "speed"),
    "cylinder_acceleration": ("cylinders, accel.", "m/s^2", "acceleration"),
    "rod_omega": ("rods, ang. velocity", "rad/s", "angular speed"),
    "rod_eps": ("rods, ang. accel.", "rad/s^2", "angular acceleration"),
    "forces": ("active forces", "N", "force"),
    "idle_torques": ("idle torques", "N m", "torque"),
    "constraint_force": ("constraint forces", "N", "force"),
    "constraint_torque": ("constraint torques", "N m", "torque"),
}

RELATIVE_TO = (
    "the greatest value of the quantity among all parts at the same state, or where that is greater to the "
    "platform's own motion there; constraint forces and torques also to the greatest active force, "
    "accelerations under given forces also to gravity, or where there is none to the load over the "
    "platform's mass"
)


class States(NamedTuple):
    """States of the platform, and the load on it; SI."""

    pose: Array
    """(N, 4, 4)."""
    twist: Array
    """(N, 6)."""
    acceleration: Array
    """(N, 6)."""
    load: tuple[Array | None, str]
    """Wrench at o, (N, 6), or None for the mechanism's own; and its axes."""
    time: Array | None = None
    """(N,), s."""
    status: NDArray[np.integer[Any]] | None = None
    """(N,): of the coordinates that they come from."""


@dataclass(frozen=True)
class Row:
    """The errors of one quantity over all states that are compared."""

    quantity: str
    title: str
    unit: str
    max: float
    """Largest error; for vectors its length."""
    rms: float
    """Root mean square over states and parts."""
    greatest: float
    """Greatest value at all states, in `unit`."""
    relative_max: float
    """Largest error as a part of what `RELATIVE_TO` says of its state."""
    relative_rms: float
    tolerance: float
    """Largest relative error that counts as agreement."""
    approximate: bool
    """Whether the tolerance is the engine's own, because it has no more digits."""
    part: str
    """The leg or rod with the largest relative error; empty for quantities of the whole."""
    index: int
    """The state with it."""
    time: float | None
    """Its time, s, where the states have times."""
    pose: Array
    """(4, 4)."""


def scales_of(
    mech: Mechanism, states: States, forces: Array, weight: Array, chosen: NDArray[np.int64]
) -> dict[str, Array]:
    """(N,): what each kind of quantity is at least compared with, so that rounding of zero is no error."""
    size = mech.characteristic_length
    twist, acceleration = states.twist[chosen], states.acceleration[chosen]
    velocity, turning, gain, turning_gain = (
        np.linalg.norm(array[:, part], axis=-1)
        for array in (twist, acceleration)
        for part in (slice(0, 3), slice(3, 6))
    )
    speed = velocity + size * turning
    gain = gain + size * turning_gain + speed**2 / size + weight
    force = np.max(np.abs(forces), axis=-1)
    return {
        "freedoms": np.ones(len(chosen)),
        "length": np.full(len(chosen), size),
        "speed": speed,
        "acceleration": gain,
        "angular speed": speed / size,
        "angular acceleration": gain / size,
        "force": force,
        "torque": force * size,
    }


_VECTORS = ("omega", "eps", "velocity", "acceleration", "constraint_force", "constraint_torque")


def _sizes(quantity: str, values: Array) -> Array:
    """Of numbers or vectors: (N, parts)."""
    sizes = np.linalg.norm(values, axis=-1) if quantity.endswith(_VECTORS) else np.abs(values)
    return sizes.reshape(len(sizes), -1)


def row_of(
    mech: Mechanism,
    states: States,
    quantity: str,
    mine: Array,
    theirs: Array,
    scales: Mapping[str, Array],
    limit: tuple[float, bool],
    chosen: NDArray[np.int64],
) -> Row:
    """The errors of one quantity: Polypod's values and those of an engine at the `chosen` states."""
    title, unit, kind = QUANTITIES[quantity]
    errors, values = _sizes(quantity, mine - theirs), _sizes(quantity, theirs)
    reference = np.maximum(values.max(axis=-1), scales[kind])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(errors == 0.0, 0.0, errors / reference)
    at, part = np.unravel_index(int(np.argmax(relative)), relative.shape)
    names = {"rod": mech.rod_names}.get(quantity[:3], mech.leg_names)
    whole = quantity == "freedoms" or quantity.startswith(("constraint", "platform"))
    i = int(chosen[at])
    return Row(
        quantity=quantity,
        title=title,
        unit=unit,
        max=float(errors.max()),
        rms=_rms(errors),
        greatest=float(values.max()),
        relative_max=float(relative.max()),
        relative_rms=_rms(relative),
        tolerance=limit[0],
        approximate=limit[1],
        part="" if whole else names[int(part)],
        index=i,
        time=None if states.time is None else float(states.time[i]),
        pose=states.pose[i],
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
