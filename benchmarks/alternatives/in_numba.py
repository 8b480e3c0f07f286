"""The script that a skilled user writes in a day: one compiled loop over the states."""

import numba
import numpy as np

from benchmarks.alternatives.equations import (
    add,
    constraint_row,
    constraint_value,
    cross,
    data_of,
    dot,
    leg_of,
    platform_wrench,
    position,
    register_jitable,
    times,
    wrench,
)

# Division by zero gives infinity as in numpy, which saves the checks; no re-ordering of arithmetic.
loop = numba.njit(error_model="numpy", fastmath=False)

SMALL_STEP = 1e-9
"""Newton step, relative to the characteristic length, after which one more ends in rounding."""
MAX_STEPS = 20


class Numba:
    """The operations at given states; the first call compiles."""

    version = numba.__version__
    count = 100_000
    tolerance = 1e-9
    tasks = ("inverse_dynamics", "inverse_kinematics", "jacobian", "forward_kinematics")

    def __init__(self, states):
        (self.table, self.rest), self.states = data_of(states.mech), states

    def inverse_dynamics(self):
        s, n = self.states, len(self.states.pose)
        out = np.empty((n, 5)), np.empty((n, 1))
        _inverse_dynamics(self.table, self.rest, s.pose, s.twist, s.acceleration, *out)
        return out

    def inverse_kinematics(self):
        n = len(self.states.pose)
        out = np.empty((n, 5)), np.empty((n, 5, 3)), np.empty((n, 5, 3))
        _inverse_kinematics(self.table, self.states.pose, *out)
        return out

    def jacobian(self):
        out = np.empty((len(self.states.pose), 6, 6))
        _jacobian(self.table, self.rest, self.states.pose, out)
        return (out,)

    def forward_kinematics(self):
        out = np.empty_like(self.states.guess)
        _forward_kinematics(self.table, self.rest, self.states.lengths, self.states.guess, out)
        return (out,)


@register_jitable
def _column(m, i, j):
    return m[i, 0, j], m[i, 1, j], m[i, 2, j]


@register_jitable
def _pose(m, i):
    """Columns of R, and o."""
    return (_column(m, i, 0), _column(m, i, 1), _column(m, i, 2)), _column(m, i, 3)


@register_jitable
def _vector(table, i, first):
    return table[i, first], table[i, first + 1], table[i, first + 2]


@register_jitable
def _put_row(m, i, force, torque):
    m[i, 0], m[i, 1], m[i, 2] = force
    m[i, 3], m[i, 4], m[i, 5] = torque


@register_jitable
def _put_column(m, j, force, torque):
    m[0, j], m[1, j], m[2, j] = force
    m[3, j], m[4, j], m[5, j] = torque


@register_jitable
def _solve(m, x):
    """Solves m x = x in place by elimination with partial pivoting."""
    for k in range(6):
        best = k
        for i in range(k + 1, 6):
            if abs(m[i, k]) > abs(m[best, k]):
                best = i
        if best != k:
            for j in range(k, 6):
                m[k, j], m[best, j] = m[best, j], m[k, j]
            x[k], x[best] = x[best], x[k]
        inverse = 1.0 / m[k, k]
        for i in range(k + 1, 6):
            factor = m[i, k] * inverse
            for j in range(k + 1, 6):
                m[i, j] -= factor * m[k, j]
            x[i] -= factor * x[k]
    for k in range(5, -1, -1):
        total = x[k]
        for j in range(k + 1, 6):
            total -= m[k, j] * x[j]
        x[k] = total / m[k, k]


@loop
def _inverse_kinematics(table, poses, lengths, vectors, directions):
    for i in range(len(poses)):
        R, o = _pose(poses, i)
        for k in range(5):
            _, r, length, delta = position(leg_of(table, k), R, o)
            lengths[i, k] = length
            vectors[i, k, 0], vectors[i, k, 1], vectors[i, k, 2] = r
            directions[i, k, 0], directions[i, k, 1], directions[i, k, 2] = delta


@loop
def _jacobian(table, rest, poses, out):
    for i in range(len(poses)):
        R, o = _pose(poses, i)
        for k in range(5):
            e, _, _, delta = position(leg_of(table, k), R, o)
            _put_row(out[i], k, delta, cross(e, delta))
        _put_row(out[i], 5, *constraint_row(leg_of(table, 0), rest, R, o))


@loop
def _inverse_dynamics(table, rest, poses, twists, accelerations, forces, multipliers):
    m, x = np.empty((6, 6)), np.empty(6)
    for i in range(len(poses)):
        R, o = _pose(poses, i)
        v, omega = _vector(twists, i, 0), _vector(twists, i, 3)
        a, eps = _vector(accelerations, i, 0), _vector(accelerations, i, 3)
        force, torque = platform_wrench(rest, a, eps)
        for k in range(5):
            delta, moment, f, t = wrench(leg_of(table, k), rest.gravity, R, o, v, omega, a, eps)
            force, torque = add(force, f), add(torque, t)
            _put_column(m, k, delta, moment)
        c, tau = constraint_row(leg_of(table, 0), rest, R, o)
        _put_column(m, 5, c, tau)
        x[0], x[1], x[2] = times(force, -1.0)
        x[3], x[4], x[5] = times(torque, -1.0)
        _solve(m, x)
        for k in range(5):
            forces[i, k] = x[k]
        multipliers[i, 0] = x[5]


@loop
def _forward_kinematics(table, rest, lengths, guesses, poses):
    """Newton's method on (r·r - ℓ²)/2 and g, rotations by the Cayley map [T25, T26]."""
    m, x = np.empty((6, 6)), np.empty(6)
    for i in range(len(lengths)):
        R, o = _pose(guesses, i)
        for _ in range(MAX_STEPS):
            for k in range(5):
                e, r, _, _ = position(leg_of(table, k), R, o)
                _put_row(m, k, times(r, rest.scale), cross(e, r))
                x[k] = 0.5 * (lengths[i, k] * lengths[i, k] - dot(r, r))
            c, tau = constraint_row(leg_of(table, 0), rest, R, o)
            _put_row(m, 5, times(c, rest.scale), tau)
            x[5] = -constraint_value(leg_of(table, 0), rest, R, o)
            _solve(m, x)
            shift, w = (x[0], x[1], x[2]), (x[3], x[4], x[5])
            size = dot(shift, shift) + dot(w, w)
            part = 1.0 / (1.0 + 0.25 * dot(w, w))
            o = add(o, times(shift, rest.scale))
            R = _cayley(w, R[0], part), _cayley(w, R[1], part), _cayley(w, R[2], part)
            if size < SMALL_STEP * SMALL_STEP:
                break
        for j in range(3):
            poses[i, j, 0], poses[i, j, 1], poses[i, j, 2], poses[i, j, 3] = R[0][j], R[1][j], R[2][j], o[j]
            poses[i, 3, j] = 0.0
        poses[i, 3, 3] = 1.0


@register_jitable
def _cayley(w, column, part):
    """A column of R after the rotation by w."""
    turn = cross(w, column)
    return add(column, times(add(turn, times(cross(w, turn), 0.5)), part))
