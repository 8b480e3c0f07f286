"""Smoothness of the results along a motion: whether steps shrink with the interval, at its ends, at poles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from polypod.answers.answer import Array
from polypod.errors import UnsupportedError
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion, minimum_jerk
from polypod.solution.solve import solve, states_along

SERIES = {
    "twist": "twist of m",
    "acceleration": "acceleration of m",
    "length": "leg lengths",
    "rate": "leg rates",
    "leg_acceleration": "leg accelerations",
    "force": "active forces",
    "coupled_force": "f_c1, f_c3",
    "coupled_torque": "T_c",
}
"""Variables of a solution that the paper calls smooth, in its words."""

INTERVALS = 800
"""Of the coarser sampling; the finer one has twice as many."""

_BEFORE = (1e-2, 1e-3, 1e-4)
"""Before a singular instant, s."""

_DURATION = 8.0
"""Of the motion to the singularity, s: that of the built-in motion."""


@dataclass(frozen=True)
class Steps:
    """The largest step of a series between neighbouring samples, as a part of its range."""

    coarse: float
    """With the interval Δt."""
    fine: float
    """With Δt/2: half of it for a continuous series with a bounded rate, the same at a jump."""

    @property
    def ratio(self) -> float:
        """2 for a continuous series, 1 at a jump."""
        return self.coarse / self.fine


@dataclass(frozen=True)
class Ends:
    """What a motion from rest to rest starts and ends with, as parts of the greatest along it."""

    rates: float
    """Leg rates."""
    accelerations: float
    """Leg accelerations."""
    forces: float
    """Active forces less those that hold the load at rest there."""


@dataclass(frozen=True)
class Pole:
    """A smooth motion across a singularity."""

    time: float
    """Of the singular instant, s."""
    before: Array
    """(k,): intervals before it, s."""
    forces: Array
    """(k,): the greatest active force at each, N."""


def steps_of(coarse: ArrayLike, fine: ArrayLike) -> Steps:
    """Of a series sampled at N intervals (N + 1, ...) and at 2 N (2 N + 1, ...): the worst of its columns."""
    series = [np.asarray(values, dtype=float).reshape(len(values), -1) for values in (coarse, fine)]  # type: ignore[arg-type]
    span = np.ptp(series[1], axis=0)
    first, second = (np.max(np.abs(np.diff(values, axis=0)), axis=0) / span for values in series)
    worst = int(np.argmin(first / second))
    return Steps(float(first[worst]), float(second[worst]))


def steps_along(mech: Mechanism, motion: Motion, intervals: int = INTERVALS) -> dict[str, Steps]:
    """Steps of every one of `SERIES` along a motion, by its name."""
    start, end = float(motion.time[0]), float(motion.time[-1])
    sampled = [
        solve(mech, motion.sample(np.linspace(start, end, n + 1))).dataset for n in (intervals, 2 * intervals)
    ]
    return {name: steps_of(*(data[name].to_numpy() for data in sampled)) for name in SERIES}


def ends_of(mech: Mechanism, motion: Motion) -> Ends:
    """What a motion starts and ends with beside rest."""
    state = states_along(mech, motion)
    legs = mech.kinematics(state.pose, state.twist, state.acceleration)
    forces = mech.inverse_dynamics(state.pose, state.twist, state.acceleration).forces
    held = mech.inverse_dynamics(state.pose, np.zeros(6), np.zeros(6)).forces

    def part(values: Array, whole: Array) -> float:
        return float(np.max(np.abs(values[[0, -1]])) / np.max(np.abs(whole)))

    return Ends(
        part(legs.rates, legs.rates),
        part(legs.accelerations, legs.accelerations),
        part(forces - held, forces),
    )


def across_singularity(mech: Mechanism, start: Array, poses: Array) -> Pole:
    """Active forces on a smooth motion from a pose (4, 4) to one of poses (N, 4, 4) beyond a singularity.

    Beyond: det J has the other sign there. The motion is straight in the natural coordinates and of least
    jerk, from rest to rest and inside all limits; of those that are, it is the shortest, with a radian
    counted as the characteristic length.

    Raises:
        UnsupportedError: no such motion.
    """
    sign = np.sign(mech.determinant(start).determinant)
    first, there = _natural(mech, start), _natural(mech, poses)
    there = there[np.sign(mech.determinant(poses).determinant) == -sign]
    names = mech.coordinate_sets["natural"]
    scale = np.array([1.0 if name in ("p", "h") else mech.characteristic_length for name in names])
    ends = np.array([0.0, _DURATION])
    times = np.linspace(0.0, _DURATION, INTERVALS + 1)
    for last in there[np.argsort(np.linalg.norm(scale * (there - first), axis=-1))]:
        curve = minimum_jerk(ends, np.stack([first, last]))
        motion = Motion.along(curve, times, names, set="natural", name="across a singularity")
        if mech.limits(states_along(mech, motion).pose).within.all():
            return _pole(mech, motion)
    raise UnsupportedError(f"{mech.name}: no straight motion inside the limits crosses a singularity")


def _natural(mech: Mechanism, pose: Array) -> Array:
    """(..., 5): natural coordinates of poses (..., 4, 4)."""
    return np.stack([*mech.coordinates(pose, "natural").values()], axis=-1)


def _pole(mech: Mechanism, motion: Motion) -> Pole:
    """The first singularity that a motion crosses."""
    time = float(solve(mech, motion).singularities["crossings"][0]["time"])
    before = np.array(_BEFORE)
    state = states_along(mech, motion.sample(np.sort(time - before)))
    forces = mech.inverse_dynamics(state.pose, state.twist, state.acceleration).forces
    return Pole(time, before, np.max(np.abs(forces), axis=-1))
