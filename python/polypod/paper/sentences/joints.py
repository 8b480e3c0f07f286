"""Revolute against spherical joints of the base: rotations that are asked of them, and what they carry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from polypod.answers.answer import Array
from polypod.mechanism import Mechanism


@dataclass(frozen=True)
class BaseJoints:
    """Of each leg's base joint over many poses (N), n legs."""

    kinds: tuple[str, ...]
    """R or S, and so on."""
    rotation: Array
    """(n, 2): least and greatest angle of an R joint from home about its axis, rad; NaN for other kinds."""
    cone: Array
    """(n,): half-angle of the narrowest cone about a line of the base in which the leg stays, rad."""
    off_axis: Array
    """(N, n): angle between a leg and the axis of that cone, rad."""


def narrowest_cone(directions: Array) -> tuple[Array, float]:
    """Axis (3,) and half-angle, rad, of the narrowest cone that holds unit vectors (N, 3) within 90° of it.

    max over |a| ≤ 1 of min a·δ is the distance of the convex hull of the δ from the origin. Least squares of
    (Σ λ δ, Σ λ - 1) over λ ≥ 0 give a multiple of the hull's point next to the origin.
    """
    share, _ = nnls(np.vstack([directions.T, np.ones(len(directions))]), np.array([0.0, 0.0, 0.0, 1.0]))
    nearest = directions.T @ share / share.sum()
    distance = float(np.linalg.norm(nearest))
    return nearest / distance, float(np.arccos(distance))


def base_joints(mech: Mechanism, pose: Array) -> BaseJoints:
    """Rotations of the base joints over poses (N, 4, 4)."""
    found = mech.kinematics(pose, np.zeros(6), np.zeros(6))
    kinds = tuple(leg["base"]["joint"] for leg in mech.geometry["legs"])
    cones = [narrowest_cone(found.directions[:, i]) for i in range(mech.n_legs)]
    axes = np.array([axis for axis, _ in cones])
    turned = found.base_joint_angles[..., 1]
    rotation = np.stack([turned.min(axis=0), turned.max(axis=0)], axis=-1)
    return BaseJoints(
        kinds,
        np.where((np.array(kinds) == "R")[:, None], rotation, np.nan),
        np.array([angle for _, angle in cones]),
        np.arccos(np.clip(np.einsum("nij,ij->ni", found.directions, axes), -1.0, 1.0)),
    )


def base_reactions(mech: Mechanism, pose: Array, twist: Array, acceleration: Array) -> tuple[Array, Array]:
    """Pull along the leg (N, n), N, and couple (N, n), N m, in each base joint under the own load.

    The pull is positive where the joint keeps the leg from leaving the base. The couple is that without
    couples in the U joints at the platform, the paper's assumption: balance alone leaves it open [T47].
    """
    answer = mech.joint_reactions(pose, twist, acceleration)
    names = [joint.name for joint in answer.joints]
    reactions = answer.reactions_in_joint[:, [names.index(f"base joint {leg}") for leg in mech.leg_names]]
    return -reactions[..., 1], np.linalg.norm(reactions[..., 3:], axis=-1)
