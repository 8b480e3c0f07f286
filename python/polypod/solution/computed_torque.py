"""Control laws for simulations: computed torque."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from polypod.answers.kinematics import Kinematics
from polypod.errors import PolypodError, UnsupportedError
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ComputedTorque:
    """Forces that make a mechanism follow a motion: the law for `forces` of `polypod.simulate` [T55].

    Legs are given the accelerations ℓ'' = ℓ_d'' + 2ζω (ℓ_d' - ℓ') + ω² (ℓ_d - ℓ), d for desired, and inverse
    dynamics gives their forces. With the masses of the mechanism that is driven, the error of every leg's
    length is a damped oscillation. Lengths determine a pose within one aspect only: start in that of the
    motion.

    >>> import polypod as pp
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> motion = pp.load_motion("lu-3spu-2rpu-r", mech)
    >>> start = mech.pose({"x": -0.325, "y": 0.21, "z": 0.6, "alpha": -0.279, "beta": 0.454})
    >>> law = pp.ComputedTorque(mech, motion, frequency=20.0)
    >>> end = pp.simulate(mech, start, forces=law, until=0.5, step=0.1, tolerance=1e-6).dataset.isel(time=-1)
    >>> bool(abs(end.length - law.desired(0.5).lengths).max() < 1e-4)
    True
    """

    mech: Mechanism
    """The model: what the controller knows of the mechanism."""
    motion: Motion
    """Desired motion; before and after it, its first and last state."""
    frequency: float
    """ω, rad/s."""
    damping: float = 1.0
    """ζ: 1 for the fastest decay without overshoot."""

    def __post_init__(self) -> None:
        why = None
        if self.mech.redundantly_actuated:
            why = "redundant legs that each follow a law of their own would contradict one another"
        elif self.mech.mobility().idle:
            why = "no leg gives the torque about the line of a local degree of freedom, which the law needs"
        if why is not None:
            raise UnsupportedError(f"{self.mech.name}: no computed torque in leg lengths: {why}")
        for name in ("frequency", "damping"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise PolypodError(f"{name} is {getattr(self, name)!r}; must be a positive number")

    @cached_property
    def _poses(self) -> Array:
        """(N, 4, 4): those of the motion's samples, in their order."""
        motion = self.motion
        return self.mech.state(motion.coordinates, branch=motion.branch, continued=True).pose

    def desired(self, time: float) -> Kinematics:
        """Motion of the legs (n, ...) that is wanted at a time, s."""
        return self._desired(time)[0]

    def _desired(self, time: float) -> tuple[Kinematics, Motion]:
        """Desired motion of the legs at a time, s, and that of the coordinates."""
        first, last = self.motion.time[[0, -1]].tolist()
        sample = self.motion.sample([min(max(time, first), last)])
        rates, second_rates = sample.rates, sample.second_rates
        if not first <= time <= last:
            rates = second_rates = {name: np.zeros(1) for name in rates}
        before = max(int(np.searchsorted(self.motion.time, time, side="right")) - 1, 0)
        state = self.mech.state(
            sample.coordinates, rates, second_rates, branch=sample.branch, guess=self._poses[before]
        )
        return self.mech.kinematics(state.pose[0], state.twist[0], state.acceleration[0]), sample

    def __call__(self, time: float, pose: Array, twist: Array) -> Array:
        """The forces (n,), N, at a time, s, for the pose (4, 4) and twist (6,) that the mechanism has then.

        NaN where the model has none: in a singularity, or where the motion has no pose.
        """
        mech, (wanted, sample) = self.mech, self._desired(time)
        lengths, rates = mech.inverse_kinematics(pose).lengths, np.zeros(mech.n_legs)
        rates[mech.actuated] = mech.jacobian(pose)[: int(mech.actuated.sum())] @ twist
        # [T55] ℓ'' = ℓ_d'' + 2ζω (ℓ_d' - ℓ') + ω² (ℓ_d - ℓ); those of passive legs are not read
        accelerations = (
            wanted.accelerations
            + 2.0 * self.damping * self.frequency * (wanted.rates - rates)
            + self.frequency**2 * (wanted.lengths - lengths)
        )
        acceleration = mech.platform_acceleration(pose, twist, accelerations).acceleration
        wrench = None if sample.wrench is None else sample.wrench[0]
        return mech.inverse_dynamics(pose, twist, acceleration, wrench, sample.wrench_axes).forces
