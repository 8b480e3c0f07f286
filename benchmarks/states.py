"""The states that all is measured at: the built-in motion of the published manipulator at random times."""

from dataclasses import dataclass, fields

import numpy as np

import polypod as pp

NAME = "lu-3spu-2rpu-r"
DIFFERENT = 100_000
"""States; larger batches repeat them."""
EARLIER = 0.01
"""s: guesses for forward kinematics are the poses that much earlier, about a millimetre away."""


@dataclass(frozen=True)
class States:
    mech: pp.Mechanism
    coordinates: dict
    rates: dict
    second_rates: dict
    pose: np.ndarray
    twist: np.ndarray
    acceleration: np.ndarray
    lengths: np.ndarray
    guess: np.ndarray
    forces: np.ndarray

    def sized(self, count):
        """As many in contiguous arrays: the first ones, or all of them again and again."""
        return self._each(lambda values: np.resize(values, (count, *values.shape[1:])))

    def single(self):
        """The first one, without an axis for states."""
        return self._each(lambda values: values[0].copy())

    def _each(self, change):
        def of(values):
            if isinstance(values, dict):
                return {name: change(column) for name, column in values.items()}
            return change(values)

        return States(self.mech, *(of(getattr(self, field.name)) for field in fields(self)[1:]))


def states():
    """The states, the same in every run."""
    mech = pp.load(NAME)
    motion = pp.load_motion(NAME, mech)
    draw = np.random.default_rng(0)
    time = np.sort(draw.uniform(EARLIER, 8.0, DIFFERENT))
    order = draw.permutation(DIFFERENT)  # neighbours in a batch are no neighbours in time
    now, before = (_shuffled(motion.sample(t), order) for t in (time, time - EARLIER))
    state = mech.state(*now)
    driven = mech.inverse_dynamics(state.pose, state.twist, state.acceleration)
    if np.any(driven.status != pp.Status.OK):
        raise RuntimeError("a state of the motion has no answer")
    lengths = mech.inverse_kinematics(state.pose).lengths
    guess = mech.pose(before[0])
    return States(mech, *now, state.pose, state.twist, state.acceleration, lengths, guess, driven.forces)


def _shuffled(sampled, order):
    series = sampled.coordinates, sampled.rates, sampled.second_rates
    return [{name: values[order] for name, values in numbers.items()} for numbers in series]
