"""MuJoCo's forward dynamics with loops closed by equality constraints, from Python.

It has no inverse dynamics for loops. Positions, velocities and applied forces of all joints are set up
beforehand and not timed; timed is `mj_forward`, as often as it takes. Its loops are soft, so that one
pass does not give the same answer: the loops' forces of a pass are applied in the next, until the
platform's acceleration stays the same [T64].
"""

import mujoco
import numpy as np

from polypod.multibody.placement import PLATFORM
from polypod.multibody.tree import describe
from polypod.verify.mujoco import Twin

SETTLED = 1e-7
"""Largest change of the platform's acceleration from pass to pass, as a part of it and of gravity."""
PASSES = 50


class MuJoCo:
    """Forward dynamics at given states, under the forces given."""

    version = mujoco.__version__
    count = 30
    tolerance = 1e-6
    tasks = ("forward_dynamics",)

    def __init__(self, states):
        self.states = states
        mech, twin = states.mech, Twin(describe(states.mech))
        self.model, self.data = twin.hard.model, twin.hard.data
        load = mech.geometry["load"]
        wrench = np.concatenate([load["force"], load["torque"]])
        platform = self.model.body(PLATFORM).dofadr[0]
        self.platform = slice(platform, platform + 6)
        self.gravity = np.linalg.norm(mech.geometry["gravity"])
        self.turns = states.pose[:, :3, :3]
        self.joints = []
        for pose, twist, force in zip(states.pose, states.twist, states.forces, strict=True):
            next(twin.hard.passes(twin.links.start(pose, twist), twist, wrench, force))
            # A pass leaves the state and the applied forces as they were set.
            self.joints.append(
                [np.array(x) for x in (self.data.qpos, self.data.qvel, self.data.qfrc_applied)]
            )
        self.passes = 0

    def forward_dynamics(self):
        self.passes = 0
        found = np.array([self._state(*state) for state in self.joints])
        # The free joint rotates in the platform's own axes.
        found[:, 3:] = np.einsum("nij,nj->ni", self.turns, found[:, 3:])
        return (found,)

    def note(self):
        return f"{self.passes / len(self.joints):.1f} passes of `mj_forward` on average"

    def _state(self, position, velocity, applied):
        data, last = self.data, np.full(6, np.inf)
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = position, velocity, applied
        for _ in range(PASSES):
            mujoco.mj_forward(self.model, data)
            self.passes += 1
            now = data.qacc[self.platform].copy()
            if np.abs(now - last).max() <= SETTLED * (np.abs(now).max() + self.gravity):
                return now
            data.qfrc_applied += data.qfrc_constraint
            last = now
        return np.full(6, np.nan)
