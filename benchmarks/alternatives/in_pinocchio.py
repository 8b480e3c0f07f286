"""Pinocchio with assembled closed-loop inverse dynamics, from Python.

The tree has a floating platform, and its loops are closed by as many equations as there are other joints.
The joints' configurations at the poses are found beforehand and not timed. From there each state takes
the closures' Jacobian, how the joints follow the platform, their velocities and accelerations, the tree's
inverse dynamics carried to the platform, and the solve for active forces and multiplier [T60-T62].
"""

import numpy as np
import pinocchio as pin

from polypod.multibody.tree import describe, release
from polypod.vectors import cross
from polypod.verify.pinocchio import Tree


class Pinocchio:
    """Inverse dynamics at given states."""

    version = pin.__version__
    count = 50
    tolerance = 1e-9
    tasks = ("inverse_dynamics",)
    parts = ("compiled_calls",)

    def __init__(self, states):
        geometry = states.mech.geometry
        first, load = geometry["legs"][0], geometry["load"]
        self.rod, self.base = np.array(geometry["rods"][0]["axis"]), np.array(first["base"]["point"])
        self.end, self.cross_axis = (np.array(first["platform"][key]) for key in ("point", "axis"))
        self.load = np.concatenate([load["force"], load["torque"]])
        self.tree = Tree(release(describe(states.mech)))
        starts = (self.tree.start(self.tree.tree.start(pose)) for pose in states.pose)
        self.configurations = [self.tree.close(q)[0] for q in starts]
        self.states, self.motions = states, []

    def inverse_dynamics(self):
        self.motions.clear()
        s = self.states
        states = zip(self.configurations, s.pose, s.twist, s.acceleration, strict=True)
        found = np.array([self._state(*state) for state in states])
        return found[:, :5], found[:, 5:]

    def compiled_calls(self):
        """The calls into compiled code alone: what the same way takes in C++ at least."""
        model, data = self.tree.model, self.tree.data
        still = np.zeros(model.nv)
        for q, v, a in self.motions:
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            pin.forwardKinematics(model, data, q, v, still)
            pin.updateFramePlacements(model, data)
            pin.rnea(model, data, q, v, a)

    def _state(self, q, pose, twist, acceleration):
        tree, model, data = self.tree, self.tree.model, self.tree.data
        passive = tree.passive
        turn = np.zeros((6, 6))  # from base axes to the platform's
        turn[:3, :3] = turn[3:, 3:] = pose[:3, :3].T
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        closures = tree.jacobian() / tree.units
        inverse = np.linalg.inv(closures[:, passive])
        follow = np.empty((model.nv, 6))
        follow[tree.platform] = turn
        follow[passive] = -inverse @ (closures[:, tree.platform] @ turn)

        # The floating joint has the acceleration of its frame, not of its point.
        of_frame = acceleration - np.array([*cross(twist[3:], twist[:3]), 0.0, 0.0, 0.0])
        v, a = follow @ twist, follow @ of_frame
        a[passive] -= inverse @ tree._drift(q, v)
        self.motions.append((q, v, a))
        wrench = follow.T @ pin.rnea(model, data, q, v, a) - self.load
        rows = np.vstack([follow[tree.slides], self._constraint_row(pose)])
        return np.linalg.solve(rows.T, wrench)

    def _constraint_row(self, pose):
        """(c, τ) of leg 1 [T10]."""
        e, cross_axis = pose[:3, :3] @ self.end, pose[:3, :3] @ self.cross_axis
        r, c = pose[:3, 3] + e - self.base, cross(self.rod, cross_axis)
        return np.concatenate([c, cross(e, c) - cross(cross_axis, cross(self.rod, r))])
