"""Rotations, and what moves with them: twists, motions, and differences along them."""

from __future__ import annotations

import numpy as np

from support.oracle.jets import Jet, columns, cos, jet, side_by_side, sin


def skew(u):
    """The matrix u× of Eq. 14."""
    u = np.asarray(u, float)
    x, y, z, o = u[..., 0], u[..., 1], u[..., 2], np.zeros(u.shape[:-1])
    return np.stack([np.stack([o, -z, y], -1), np.stack([z, o, -x], -1), np.stack([-y, x, o], -1)], -2)


def vee(W):
    """The vector of the antisymmetric part of W, the inverse of `skew`."""
    parts = [W[..., 2, 1] - W[..., 1, 2], W[..., 0, 2] - W[..., 2, 0], W[..., 1, 0] - W[..., 0, 1]]
    return 0.5 * np.stack(parts, -1)


def turn(phi):
    """The rotation matrix of a rotation vector (..., 3), by Rodrigues."""
    phi = np.asarray(phi, float)
    angle = np.linalg.norm(phi, axis=-1)[..., None, None]
    K = skew(phi)
    half = np.sinc(angle / (2 * np.pi))  # sin(angle/2) / (angle/2)
    return np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * half**2 * K @ K


def axis_turn(axis: int, angle) -> Jet:
    """The rotation by `angle` (...,) about a coordinate axis."""
    a = jet(angle)
    a = Jet(a.x[..., None], a.d[..., None], a.dd[..., None])
    basis = np.eye(3)
    e = [basis[k] for k in range(3)]
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    cols = [None, None, None]
    cols[i] = Jet(e[i])
    cols[j] = cos(a) * e[j] + sin(a) * e[k]
    cols[k] = cos(a) * e[k] - sin(a) * e[j]
    return columns(*cols)


def spin_of(frame: Jet):
    """Angular velocity and acceleration of a frame: E' Eᵀ = [ω]; E'' Eᵀ = [ε] + [ω][ω], last symmetric."""
    Et = np.swapaxes(frame.x, -1, -2)
    return vee(frame.d @ Et), vee(frame.dd @ Et)


def twist_of(pose):
    """Twist and acceleration (..., 6) of a pose with rates."""
    omega, eps = spin_of(pose[0])
    return side_by_side([pose[1].d, omega]), side_by_side([pose[1].dd, eps])


def moving(pose, twist, acceleration=None):
    """The pose as jets along a motion with this twist and acceleration."""
    R, o = np.asarray(pose[0], float), np.asarray(pose[1], float)
    twist = np.asarray(twist, float)
    acceleration = np.zeros_like(twist) if acceleration is None else np.asarray(acceleration, float)
    W, E = skew(twist[..., 3:]), skew(acceleration[..., 3:])
    return Jet(R, W @ R, (E + W @ W) @ R), Jet(o, twist[..., :3], acceleration[..., :3])


def along(pose, twist, acceleration, t):
    """The pose at time t on a true motion that starts with this twist and acceleration."""
    twist, acceleration = np.asarray(twist), np.asarray(acceleration)
    step = twist * t + acceleration * t**2 / 2
    return turn(step[..., 3:]) @ pose[0], pose[1] + step[..., :3]


# Eighth-order central differences: weights of f(t + k h), k = 1..4; antisymmetric and symmetric.
_FIRST = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
_SECOND = np.array([8 / 5, -1 / 5, 8 / 315, -1 / 560])
_SECOND_0 = -205 / 72


def differentiate(f, h):
    """f', f'' at 0 by eighth-order central differences with step h."""
    plus = [np.asarray(f(k * h)) for k in range(1, 5)]
    minus = [np.asarray(f(-k * h)) for k in range(1, 5)]
    middle = np.asarray(f(0.0))
    first = sum(w * (p - m) for w, p, m in zip(_FIRST, plus, minus, strict=True)) / h
    second = sum(w * (p + m) for w, p, m in zip(_SECOND, plus, minus, strict=True)) + _SECOND_0 * middle
    return first, second / h**2
