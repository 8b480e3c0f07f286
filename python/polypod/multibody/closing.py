"""Platform joints as joints: degrees of freedom in series that a closure allows, not its constraints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polypod.legs.joints import JointLetter
from polypod.multibody.tree import POINT, Closure, Freedom, Multibody, Y
from polypod.vectors import cross, frame_at, unit

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ClosingJoint:
    """The joint between a piston or strut and the platform that closes the loop of a leg."""

    name: str
    kind: JointLetter
    bodies: tuple[str, str]
    """Piston and platform."""
    frames: tuple[Array, Array]
    """(4, 4) each: the joint's frame in the axes of piston and platform; at zero the two coincide."""
    freedoms: tuple[Freedom, ...]
    """From the piston to the platform, with axes in the joint's frame; none for a fixed joint."""


def closing_joints(tree: Multibody) -> tuple[ClosingJoint, ...]:
    """The platform joints of all legs, in the order of the legs."""
    return tuple(closing_joint(tree, closure) for closure in tree.closures)


def closing_joint(tree: Multibody, closure: Closure) -> ClosingJoint:
    """The joint of a closure with a point in common.

    Its axes are exact in both bodies, also where the home pose closes the loops to the file's digits only.
    """
    if closure.points is None:
        raise ValueError(f"{closure.name}: no joint, its bodies share no point")
    piston, platform = (tree.zero[body][:3, :3] for body in closure.bodies)
    across = piston.T @ platform
    """From the platform's axes to the piston's, at zero."""

    def as_at_zero(mine: Array, other: Array) -> Array:
        """An axis of the platform, with the sign that it has in the piston at zero."""
        return other * np.sign((across @ other) @ mine)

    freedoms: tuple[Freedom, ...] = ()
    kind: JointLetter
    match closure.squares:
        case ():
            kind, freedoms, turn = "S", (Freedom("spherical", POINT),), across.T
        case ((n, axis),):
            kind = "U"
            seen = across @ axis
            own = unit(seen - n * (n @ seen))
            freedoms = (Freedom("revolute", n), Freedom("revolute", own))
            turn = _turn(own, axis, n, across.T @ n)
        case ((n, first), (_, second)):
            kind, freedoms = "R", (Freedom("revolute", n),)
            turn = _turn(n, as_at_zero(n, cross(first, second)), Y, across.T @ Y)
        case ((n, direction), (_, side), (delta, _)):
            kind = "F"
            normal = as_at_zero(n, cross(direction, side))
            turn = _turn(n, normal, delta, as_at_zero(delta, direction))
        case _:
            raise ValueError(f"{closure.name}: no joint keeps {len(closure.squares)} rotations")
    a, b = closure.points
    return ClosingJoint(
        closure.name, kind, closure.bodies, (frame_at(np.eye(3), a), frame_at(turn, b)), freedoms
    )


def _turn(axis: Array, to: Array, near: Array, near_to: Array) -> Array:
    """(3, 3): the rotation that takes one unit vector to another, and a second as near as can be."""
    return _axes(to, near_to) @ _axes(axis, near).T


def _axes(first: Array, second: Array) -> Array:
    second = unit(second - first * (first @ second))
    return np.column_stack([first, second, cross(first, second)])
