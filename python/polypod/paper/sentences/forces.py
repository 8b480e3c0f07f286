"""Couple-constrained against active forces, and what the redundant constraints leave open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from polypod.answers.answer import Array
from polypod.mechanism import Mechanism


@dataclass(frozen=True)
class RedundantForces:
    """Reactions of the joints of which balance leaves parts open."""

    redundant: int
    """Redundant constraints, from ranks [T18]."""
    active_determined: bool
    """Whether balance determines every active force, at all states."""
    open_joints: tuple[str, ...]
    """Joints with a component that is not determined."""
    without_couples: Array
    """(N,): the greatest open force, N, without couples in the U joints: the paper's assumption."""
    least: Array
    """(N,): the same with the least sum of squares [T47]."""


def coupled_forces(mech: Mechanism, pose: Array, constraint: Array, *, as_printed: bool = False) -> Array:
    """(N, 2): f_c1 and f_c3, N, of the multipliers (N, k); as Eq. 44 prints them where asked."""
    return mech.coupled_forces(pose, constraint, as_printed=as_printed).forces


def coupled_share(
    mech: Mechanism,
    pose: Array,
    twist: ArrayLike = 0.0,
    acceleration: ArrayLike = 0.0,
    wrench: Array | None = None,
) -> Array:
    """(N,): the greater of |f_c1|, |f_c3| over the greatest |f_ai|, where forces are determined; no unit.

    At poses (N, 4, 4), by default at rest and under the mechanism's own load.
    """
    twist, acceleration = (np.broadcast_to(motion, (len(pose), 6)) for motion in (twist, acceleration))
    found = mech.inverse_dynamics(pose, twist, acceleration, wrench)
    coupled = coupled_forces(mech, pose, found.constraint)
    share = np.max(np.abs(coupled), axis=-1) / np.max(np.abs(found.forces), axis=-1)
    known: Array = share[np.isfinite(share)]
    return known


def printed_share(mech: Mechanism, pose: Array, twist: Array, acceleration: Array) -> Array:
    """(N,): f_c1 of the balance over that of Eq. 44 as printed, along states (N)."""
    constraint = mech.inverse_dynamics(pose, twist, acceleration).constraint
    right, printed = (coupled_forces(mech, pose, constraint, as_printed=which) for which in (False, True))
    return right[:, 0] / printed[:, 0]


def parallel_wrench(mech: Mechanism, pose: Array) -> tuple[Array, Array]:
    """|c| (N,), no unit, and the greater |cosine| (N,) of τ with L and with R_1, where l is parallel to L.

    (c, τ) is the constraint wrench, the last row of J; R_1 is perpendicular to the rod L and to r_1.
    """
    c, torque = np.split(mech.jacobian(pose)[:, -1], 2, axis=-1)
    rod = np.array(mech.geometry["rods"][0]["axis"])
    first = next(i for i, leg in enumerate(mech.geometry["legs"]) if leg["base"]["rod"] is not None)
    pin = np.cross(rod, mech.inverse_kinematics(pose).directions[:, first])
    pin /= np.linalg.norm(pin, axis=-1, keepdims=True)
    along = np.stack([torque @ rod, np.sum(torque * pin, axis=-1)], axis=-1)
    return np.linalg.norm(c, axis=-1), np.max(np.abs(along), axis=-1) / np.linalg.norm(torque, axis=-1)


def redundant_forces(mech: Mechanism, pose: Array, twist: Array, acceleration: Array) -> RedundantForces:
    """Reactions that the redundant constraints leave open along states (N), chosen in two ways."""
    answer = mech.joint_reactions(pose, twist, acceleration)
    kinds = np.array([joint.kind for joint in answer.joints])
    determinate = np.logical_and.reduce(answer.determinate_in_joint, axis=0)
    forces = np.where(determinate[:, :3], 0.0, 1.0)
    greatest = [
        np.max(np.abs(reactions[..., :3] * forces), axis=(-1, -2))
        for reactions in (answer.reactions_in_joint, answer.least_in_joint)
    ]
    return RedundantForces(
        mech.mobility().redundant,
        bool(determinate[kinds == "P", 1].all()),
        tuple(joint.name for joint, row in zip(answer.joints, determinate, strict=True) if not row.all()),
        *greatest,
    )
