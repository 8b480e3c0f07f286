"""Virtual work: active forces, energies, conditioning."""

from __future__ import annotations

import numpy as np

from support.oracle.geometry import (
    Link,
    feasible_directions,
    gradient,
    legs_at,
    links_at,
    six_directions,
    times,
)
from support.oracle.jets import Jet, concat
from support.oracle.rotations import moving, spin_of


def load_at(spec, pose, wrench=None, axes="base"):
    """The load on the platform at o, in base axes: the given one, else the file's."""
    R = np.asarray(pose[0])
    if wrench is None:
        wrench = np.concatenate([spec["load"]["force"], spec["load"]["torque"]])
        axes = spec["load"]["axes"]
    wrench = np.broadcast_to(wrench, (*R.shape[:-2], 6))
    if axes == "platform":
        turned = [np.einsum("...ij,...j->...i", R, wrench[..., s]) for s in (slice(0, 3), slice(3, 6))]
        wrench = np.concatenate(turned, axis=-1)
    return wrench


def link_wrench(link: Link, gravity):
    """Weight and inertia of a moving link, by Newton and Euler: force at the mass centre, and torque."""
    omega, eps = spin_of(link.frame)
    E = link.frame.x
    inertia = E @ link.body["inertia"] @ np.swapaxes(E, -1, -2)
    spin = np.einsum("...ij,...j->...i", inertia, omega)
    torque = -np.einsum("...ij,...j->...i", inertia, eps) - np.cross(omega, spin)
    return link.body["mass"] * (gravity - link.center.dd), torque


def generalised_force(spec, pose, twist, acceleration, wrench=None, axes="base"):
    """All given forces' work on the six unit twists (..., 6), which actuators and constraints balance.

    And the platform's own share: load, weight, inertia and damping, not yet divided by the efficiency.
    """
    now = links_at(spec, moving(pose, twist, acceleration))
    shifted = links_at(spec, six_directions(pose))
    twist = np.asarray(twist)
    platform = load_at(spec, pose, wrench, axes) - np.concatenate(
        [spec["linear_damping"] * twist[..., :3], spec["angular_damping"] * twist[..., 3:]], axis=-1
    )
    rest = np.zeros_like(platform)
    for link, moved in zip(now, shifted, strict=True):
        force, torque = link_wrench(link, spec["gravity"])
        work = np.moveaxis(np.sum(moved.center.d * force + spin_of(moved.frame)[0] * torque, axis=-1), 0, -1)
        if link.name == "platform":
            platform = platform + work
        else:
            rest = rest + work
    return platform / spec["efficiency"] + rest, platform


def actuated(spec):
    return [i for i, leg in enumerate(spec["legs"]) if leg["actuated"]]


def lengths(spec, pose) -> Jet:
    return concat([at.length for at in legs_at(spec, pose)])


def leg_gradient(spec, pose):
    """Gradient (..., n, 6) of the actuated legs' lengths."""
    return gradient(lambda p: lengths(spec, p), pose)[..., actuated(spec), :]


def active_forces(spec, pose, twist, acceleration, wrench=None, axes="base"):
    """Forces (..., n) of the actuated legs, by virtual work on independent feasible directions only."""
    W, _ = generalised_force(spec, pose, twist, acceleration, wrench, axes)
    Z, scale = feasible_directions(spec, pose)
    Zt = np.swapaxes(Z, -1, -2) / scale
    columns_ = Zt @ np.swapaxes(leg_gradient(spec, pose), -1, -2)
    return np.linalg.solve(columns_, -times(Zt, W)[..., None])[..., 0]


def reaction_wrench(spec, pose, twist, acceleration, wrench=None, axes="base"):
    """The wrench (..., 6) of all constraints on the platform: what actuators and given forces leave over."""
    W, _ = generalised_force(spec, pose, twist, acceleration, wrench, axes)
    f = active_forces(spec, pose, twist, acceleration, wrench, axes)
    return -W - times(np.swapaxes(leg_gradient(spec, pose), -1, -2), f)


def conditioning(spec, pose):
    """Singular values, largest first, of the actuated legs' rates on the feasible unit twists (v, Λω)."""
    Z, scale = feasible_directions(spec, pose)
    return np.linalg.svd(leg_gradient(spec, pose) / scale @ Z, compute_uv=False)


def energy(spec, pose, twist, acceleration):
    """Kinetic and potential energy and their rates."""
    K = P = dK = dP = 0.0
    for link in links_at(spec, moving(pose, twist, acceleration)):
        omega, eps = spin_of(link.frame)
        v, a, m = link.center.d, link.center.dd, link.body["mass"]
        E = link.frame.x
        inertia = E @ link.body["inertia"] @ np.swapaxes(E, -1, -2)
        K = K + 0.5 * m * np.sum(v * v, -1) + 0.5 * np.einsum("...i,...ij,...j->...", omega, inertia, omega)
        dK = dK + m * np.sum(v * a, -1) + np.einsum("...i,...ij,...j->...", omega, inertia, eps)
        P = P - m * link.center.x @ spec["gravity"]
        dP = dP - m * v @ spec["gravity"]
    return K, P, dK, dP
