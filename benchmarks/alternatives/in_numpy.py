"""Vectorised numpy: each number of the equations is an array over the states."""

import numpy as np

from benchmarks.alternatives.equations import (
    add,
    constraint_row,
    cross,
    data_of,
    leg_of,
    platform_wrench,
    position,
    wrench,
)

BLOCK = 1024
"""States at once, so that intermediate arrays stay in the cache: fastest of the powers of two."""


class Numpy:
    """The operations at given states."""

    version = np.__version__
    count = 100_000
    tolerance = 1e-9
    tasks = ("inverse_dynamics", "inverse_kinematics", "jacobian")

    def __init__(self, states):
        (table, self.rest), self.states = data_of(states.mech), states
        self.legs = [leg_of(table, k) for k in range(5)]

    def inverse_dynamics(self):
        states, n = self.states, len(self.states.pose)
        forces, multipliers = np.empty((n, 5)), np.empty((n, 1))
        for part, (R, o) in _blocks(states.pose):
            motion = [*_parts(states.twist[part]), *_parts(states.acceleration[part])]
            force, torque = platform_wrench(self.rest, *motion[2:])
            transposed, right = np.empty((len(o[0]), 6, 6)), np.empty((len(o[0]), 6, 1))
            for k, leg in enumerate(self.legs):
                delta, moment, f, t = wrench(leg, self.rest.gravity, R, o, *motion)
                force, torque = add(force, f), add(torque, t)
                _put(transposed[..., k], delta, moment)
            _put(transposed[..., 5], *constraint_row(self.legs[0], self.rest, R, o))
            _put(right[..., 0], force, torque)
            found = np.linalg.solve(transposed, -right)[..., 0]
            forces[part], multipliers[part] = found[:, :5], found[:, 5:]
        return forces, multipliers

    def inverse_kinematics(self):
        n = len(self.states.pose)
        lengths, vectors, directions = np.empty((n, 5)), np.empty((n, 5, 3)), np.empty((n, 5, 3))
        for part, (R, o) in _blocks(self.states.pose):
            for k, leg in enumerate(self.legs):
                _, r, lengths[part, k], delta = position(leg, R, o)
                _put(vectors[part, k], r)
                _put(directions[part, k], delta)
        return lengths, vectors, directions

    def jacobian(self):
        out = np.empty((len(self.states.pose), 6, 6))
        for part, (R, o) in _blocks(self.states.pose):
            for k, leg in enumerate(self.legs):
                e, _, _, delta = position(leg, R, o)
                _put(out[part, k], delta, cross(e, delta))
            _put(out[part, 5], *constraint_row(self.legs[0], self.rest, R, o))
        return (out,)


def _blocks(poses):
    """Slices of the states, with the columns of R and o in each."""
    for first in range(0, len(poses), BLOCK):
        part = slice(first, first + BLOCK)
        x, y, z, o = np.ascontiguousarray(poses[part, :3].transpose(2, 1, 0))
        yield part, ((tuple(x), tuple(y), tuple(z)), tuple(o))


def _parts(six):
    """Two vectors from (N, 6)."""
    columns = np.ascontiguousarray(six.T)
    return tuple(columns[:3]), tuple(columns[3:])


def _put(out, *vectors):
    """Writes vectors one after the other into the last axis."""
    for i, number in enumerate(number for vector in vectors for number in vector):
        out[..., i] = number
