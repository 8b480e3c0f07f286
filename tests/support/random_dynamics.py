"""Inverse dynamics of mechanisms that are given as screws: virtual power on all motions that the loops allow.

Nothing here is shared with Polypod or with its twins. Velocities, accelerations and wrenches of links are
spatial ones at the origin of the base, linear part first (Featherstone, Rigid Body Dynamics Algorithms).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from support.random_screws import RANK, Array, Drawn, Leg, chains, closures, exponentials, skew, slides, unit

GRAVITY = np.array([0.0, 0.0, -9.81, 0.0, 0.0, 0.0])


@dataclass
class State:
    """A motion of the platform at o, base axes, and the forces that it needs."""

    pose: Array
    twist: Array
    acceleration: Array
    forces: Array
    """(legs,): the least ones, zero without an actuator."""
    torques: Array
    """About the lines of local degrees of freedom."""
    unbalanced: float
    """Share of the motion's power that no forces give."""


@dataclass
class Link:
    """A moving body."""

    jacobian: Array
    """(6, joints + 6): its twist from joint rates and the platform's twist."""
    inertia: Array
    """(6, 6)."""
    spins: Array | None = None
    """Direction of a strut with S at both ends."""


def state(
    drawn: Drawn, q: Array, idle: list[tuple[str, Array]], rng: np.random.Generator, wrench: Array
) -> State:
    """A random motion at joint values q, under a load on the platform at o. Free struts do not spin.

    idle: body and unit axis of each local degree of freedom, in the body's axes.
    """
    ends, joints = chains(drawn, q)
    matrix, bodies = closures(drawn, joints), links(drawn, q, joints)
    spins = [(b.spins @ b.jacobian[3:])[None] for b in bodies if b.spins is not None]
    _, s, vt = np.linalg.svd(np.vstack([matrix, *spins]))
    free = vt[int(np.sum(s > RANK * s[0])) :].T
    rates = free @ rng.normal(size=free.shape[1])
    drift = np.concatenate([_drift(row, rates) for row in matrix.reshape(len(drawn.legs), 6, -1)])
    second = np.linalg.lstsq(matrix, -drift, rcond=RANK)[0] + free @ rng.normal(size=free.shape[1]) * 5.0

    needed = np.zeros(len(rates))
    for link in bodies:
        velocity = link.jacobian @ rates
        acceleration = link.jacobian @ second + _drift(link.jacobian, rates) - GRAVITY
        force = link.inertia @ acceleration - _cross(velocity).T @ link.inertia @ velocity
        needed += link.jacobian.T @ force
    pose = ends[0] @ drawn.home
    o, turn = pose[:3, 3], pose[:3, :3]
    needed[-6:] -= [*wrench[:3], *(wrench[3:] + np.cross(o, wrench[:3]))]

    actuated = [i for i, leg in enumerate(drawn.legs) if leg.actuated]
    axes = [u if body == "base" else turn @ u for body, u in idle]
    felt = np.hstack([free[slides(drawn)[actuated]].T, free[-3:].T @ np.reshape(axes, (-1, 3)).T])
    power = free.T @ needed
    found = np.linalg.lstsq(felt, power, rcond=RANK)[0]
    left = float(np.linalg.norm(felt @ found - power) / np.linalg.norm(power))
    forces = np.zeros(len(drawn.legs))
    forces[actuated] = found[: len(actuated)]
    (v, omega), (a, eps) = rates[-6:].reshape(2, 3), second[-6:].reshape(2, 3)
    v = v + np.cross(omega, o)
    a = a + np.cross(eps, o) + np.cross(omega, v)
    return State(
        pose,
        np.concatenate([v, omega]),
        np.concatenate([a, eps]),
        forces,
        found[len(actuated) :],
        left,
    )


def _cross(twist: Array) -> Array:
    """(6, 6): the rate of a screw that moves with a twist; minus its transpose gives that of a wrench."""
    turn = skew(twist[3:])
    return np.block([[turn, skew(twist[:3])], [np.zeros((3, 3)), turn]])


def _drift(screws: Array, rates: Array) -> Array:
    """(6,): acceleration at the end of joints (6, n), in their order, without accelerations of their own."""
    velocity, out = np.zeros(6), np.zeros(6)
    for k in np.flatnonzero(screws[:, :-6].any(axis=0)):
        out += _cross(velocity) @ screws[:, k] * rates[k]
        velocity = velocity + screws[:, k] * rates[k]
    return out


# --- links --------------------------------------------------------------------------------------------------


def links(drawn: Drawn, q: Array, joints: Array) -> list[Link]:
    """All bodies with mass, and all struts that could spin."""
    end = chains(drawn, q)[0][0]
    still = np.zeros((6, joints.shape[1] + 6))
    platform = still.copy()
    platform[:, -6:] = np.eye(6)
    found = [Link(platform, _inertia(drawn.data["platform"], end @ drawn.home))]
    rods = exponentials(np.reshape(drawn.rods, (-1, 6)), q[: len(drawn.rods)])
    frames = [_frame(drawn, leg) for leg in drawn.legs]
    for i, (table, by) in enumerate(zip(drawn.data["rods"], rods, strict=True)):
        axis = unit(np.array(table["axis"]))
        normal = next(frame for frame, leg in zip(frames, drawn.legs, strict=True) if leg.rod == i)[:, 0]
        at = _placed(np.array([axis, normal, np.cross(axis, normal)]).T, np.array(table["point"]))
        jacobian = still.copy()
        jacobian[:, i] = drawn.rods[i]
        found.append(Link(jacobian, _inertia(table, by @ at)))
    first = len(drawn.rods)
    for i, (leg, frame) in enumerate(zip(drawn.legs, frames, strict=True)):
        each = exponentials(np.array(leg.screws), q[first : first + len(leg.screws)])
        below, above = _ends(drawn, leg)
        feet = np.eye(3) if leg.slider else frame
        names = ("carriage", "strut") if leg.slider else ("cylinder", "piston")
        # Each link with the number of joints of its leg below it, and its axes at home.
        for name, count, at in (
            (names[0], 1 if leg.slider else leg.lower, _placed(feet, below)),
            (names[1], leg.lower + 1, _placed(frame, above)),
        ):
            by = np.linalg.multi_dot(
                [np.eye(4), np.eye(4) if leg.rod is None else rods[leg.rod], *each[:count]]
            )
            jacobian = still.copy()
            jacobian[:, :-6] = joints[6 * i : 6 * i + 6]
            jacobian[:, first + count : -6] = 0.0
            letters = leg.table["base"]["joint"] + leg.table["platform"]["joint"]
            free = letters == "SS" and count == leg.lower + 1
            if free or name in leg.table:
                inertia = _inertia(leg.table[name], by @ at) if name in leg.table else np.zeros((6, 6))
                found.append(Link(jacobian, inertia, by[:3, :3] @ frame[:, 1] if free else None))
        first += len(leg.screws)
    return found


def _placed(axes: Array, point: Array) -> Array:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = axes, point
    return out


def _ends(drawn: Drawn, leg: Leg) -> tuple[Array, Array]:
    """Foot and upper joint at home."""
    below = np.array(leg.table["base"]["point"])
    if leg.slider:
        below = below + leg.coordinate * leg.screws[0][:3]
    return below, drawn.home[:3, :3] @ np.array(leg.table["platform"]["point"]) + drawn.home[:3, 3]


def _frame(drawn: Drawn, leg: Leg) -> Array:
    """(3, 3): the leg's axes n, delta, n x delta at home, in columns; n is any normal where it is free."""
    below, above = _ends(drawn, leg)
    delta = unit(above - below)
    normal = np.cross(delta, np.eye(3)[np.argmin(abs(delta))])
    sides: list[tuple[dict[str, Any], Array]] = [
        (leg.table["platform"], drawn.home[:3, :3]),
        (leg.table["base"], np.eye(3)),
    ]
    for joint, turn in sides:
        if leg.rod is not None and joint is leg.table["base"]:
            normal = np.cross(drawn.data["rods"][leg.rod]["axis"], delta)
        elif joint["joint"] == "U":
            normal = np.cross(turn @ joint["axis"], delta)
        elif joint["joint"] != "S":
            normal = turn @ joint["normal" if joint["joint"] == "F" else "axis"]
    n = unit(normal)
    return np.array([n, delta, np.cross(n, delta)]).T


def _inertia(table: dict[str, Any], at: Array) -> Array:
    """(6, 6): of a body whose frame (4, 4) is there; a carriage has no inertia of its own."""
    mass, turn = table["mass"], at[:3, :3]
    arm = skew(turn @ np.array(table["center"]) + at[:3, 3])
    own = turn @ np.array(table.get("inertia", np.zeros((3, 3)))) @ turn.T
    return np.block([[mass * np.eye(3), -mass * arm], [mass * arm, own - mass * arm @ arm]])
