"""Exudyn's initial accelerations, from Python.

It has no inverse dynamics for loops. The system of each state is made and assembled beforehand and not
timed; timed is its solver's start, in which Exudyn solves for accelerations and constraints, with two
widths of its differences, because one does not give the same answer [T63].
"""

import exudyn
import numpy as np

from polypod.multibody.placement import PLATFORM
from polypod.multibody.tree import describe
from polypod.verify.exudyn import System, Twin


class Exudyn:
    """Forward dynamics at given states, under the forces given."""

    version = exudyn.__version__
    count = 5
    tolerance = 1e-6
    tasks = ("forward_dynamics",)

    def __init__(self, states):
        self.states = states
        mech = states.mech
        load = mech.geometry["load"]
        wrench = np.concatenate([load["force"], load["torque"]])
        twin = Twin(describe(mech))
        self.platform = twin.numbers[PLATFORM]
        self.systems = [
            System(twin, twin.links.start(pose, twist), lambda t, force=force: (force, wrench))
            for pose, twist, force in zip(states.pose, states.twist, states.forces, strict=True)
        ]

    def forward_dynamics(self):
        return (np.array([system.accelerations()[self.platform] for system in self.systems]),)
