"""Base class of forward-dynamics twins: forces in, accelerations out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.multibody.placement import PLATFORM
from polypod.multibody.tree import Body, Multibody
from polypod.verify.constraints import Links, Start

Array = NDArray[np.float64]

LIGHT = 1e-10
"""Mass of a link that has none, as a part of the platform's: engines divide by masses. Its moments of inertia
are that times the square of the characteristic length."""


class Forced(ABC):
    """A mechanism in an engine that is given forces; subclasses are `Twin` of their modules."""

    def __init__(self, tree: Multibody) -> None:
        self.tree = tree
        self.links = Links(tree)
        self.numbers = {body.name: i for i, body in enumerate(tree.bodies)}

    @abstractmethod
    def accelerations(self, start: Start, twist: Array, wrench: Array, forces: Array) -> Array | Status:
        """(bodies, 6): of mass centres, of o for the platform, and angular; or why there are none."""

    def answer(
        self, pose: Array, twist: Array, wrench: Array, forces: Array
    ) -> tuple[dict[str, Any], Status]:
        """Accelerations at one state under the forces given, SI, base axes; and what became of it.

        Args:
            pose: (4, 4).
            twist: (6,).
            wrench: (6,), load at o in base axes.
            forces: (legs,), of the prismatic joints.
        """
        if not all(np.isfinite(a).all() for a in (pose, twist, wrench, forces)):
            return {}, Status.INVALID_INPUT
        start = self.links.start(pose, twist)
        found: dict[str, Any] = {"closure": start.closure, "freedoms": start.freedoms}
        if start.status is not Status.OK:
            return found, start.status
        moved = self.accelerations(start, twist, wrench, forces)
        if isinstance(moved, Status):
            return found, moved
        cylinders = [self.numbers[leg.first] for leg in self.tree.legs]
        pistons = [self.numbers[leg.second] for leg in self.tree.legs]
        platform = moved[self.numbers[PLATFORM]]
        found |= {
            "platform_acceleration": platform[:3],
            "platform_eps": platform[3:],
            "leg_eps": moved[pistons, 3:],
            "piston_acceleration": moved[pistons, :3],
            "cylinder_acceleration": moved[cylinders, :3],
            "rod_eps": moved[[self.numbers[rod] for rod in self.tree.rods], 3:],
        }
        return found, Status.OK


def inertial(tree: Multibody, body: Body) -> tuple[float, Array]:
    """Mass, and inertia (3, 3) about the mass centre, of a link that moves under forces.

    The efficiency divides the platform's own term alone [T15], as if it had more mass. A leg that spins
    freely does not begin to, whatever its inertia about its axis: much of it keeps rounding from spinning it.
    """
    if body.mass == 0.0:
        mass, inertia = light(tree)
        if any(leg.spins and body.name in (leg.first, leg.second) for leg in tree.legs):
            inertia[1, 1] = mass / LIGHT * tree.scale**2
        return mass, inertia
    share = 1.0 / tree.geometry["efficiency"] if body.name == PLATFORM else 1.0
    return share * body.mass, share * body.inertia


def pull(tree: Multibody, wrench: Array) -> Array:
    """(...,): gravity or, where there is none, what a load (..., 6) would give the platform alone, m/s^2.

    What accelerations under forces are measured by where there is no motion.
    """
    gravity = float(np.linalg.norm(tree.geometry["gravity"]))
    if gravity > 0.0:
        return np.full(wrench.shape[:-1], gravity)
    mass = next(body.mass for body in tree.bodies if body.name == PLATFORM)
    force, torque = (np.linalg.norm(wrench[..., part], axis=-1) for part in (slice(0, 3), slice(3, 6)))
    return np.asarray((force + torque / tree.scale) / mass)


def light(tree: Multibody) -> tuple[float, Array]:
    """Mass and inertia (3, 3) of a link without mass."""
    mass = LIGHT * next(body.mass for body in tree.bodies if body.name == PLATFORM)
    return mass, mass * tree.scale**2 * np.eye(3)
