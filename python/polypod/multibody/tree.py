"""A mechanism as links, elementary joints and loop closures, which any multibody engine can build.

Made from the mechanism file's numbers and what the file's format says of them, without Polypod's equations
of motion. Every leg hangs on the base, on its rod or on its carriage, the platform floats, and the platform
joints close the loops [T59].
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from polypod.legs.drive import Drive
from polypod.legs.drives import drive_of
from polypod.mechanism import Mechanism
from polypod.multibody.placement import (
    BASE,
    PLATFORM,
    Placements,
    leg_bodies,
    placements,
    rod_body,
    turning_of,
)
from polypod.vectors import cross, inverse, perpendiculars, turn_about, turned, unit

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
"""Axes of a leg's links, n, δ, n×δ; and of a rod's: L, n, L×n."""
POINT = np.zeros(3)


@dataclass(frozen=True, eq=False)
class Freedom:
    """An elementary joint at the origin of its body; "free" is no joint at all."""

    kind: Literal["revolute", "prismatic", "spherical", "free"]
    axis: Array
    """(3,): unit vector in the axes of the body; of no meaning for spherical and free."""


@dataclass(frozen=True, eq=False)
class Body:
    """A link, and how it hangs on its parent: by degrees of freedom in series, the first at the parent."""

    name: str
    parent: str
    zero: Array
    """(4, 4): its frame in base axes where all joints are at zero."""
    freedoms: tuple[Freedom, ...]
    """Where there is none the link is one with its parent."""
    mass: float
    center: Array
    """(3,): mass centre in the body's frame, m."""
    inertia: Array
    """(3, 3): about the mass centre, in the body's axes, kg m^2."""


@dataclass(frozen=True, eq=False)
class Closure:
    """Constraints of a joint that closes a loop, on two bodies."""

    name: str
    bodies: tuple[str, str]
    points: tuple[Array, Array] | None
    """(3,) each, in the frames of the two bodies: they coincide. None where the bodies share no point."""
    squares: tuple[tuple[Array, Array], ...]
    """Axes of the first and of the second body, in their own axes, that stay perpendicular: a pair for each
    rotation that the joint does not allow."""


@dataclass(frozen=True, eq=False)
class LegParts:
    """The links of a leg, its drive and its base joint."""

    name: str
    first: str
    """The link on the base's side: the cylinder, or of a slider the carriage."""
    second: str
    """That on the platform's side: the piston, or the strut."""
    actuated: bool
    coordinate: float
    """The drive's coordinate where its joint is at zero, m or rad."""
    spins: bool
    """Whether the leg may rotate freely about its own axis."""
    drive: Drive
    geometry: Mapping[str, Any]
    """The leg in `Mechanism.geometry`."""

    @property
    def slide(self) -> str:
        """The link that the drive moves: the piston, or the carriage."""
        return self.first if self.drive.moves_foot else self.second

    @property
    def hinge(self) -> str:
        """The link that the base joint rotates: the cylinder, or the strut."""
        return self.second if self.drive.moves_foot else self.first

    @property
    def axis(self) -> Array:
        """(3,): of the drive's joint, a unit vector in the axes of the link that it moves."""
        return self.drive.axis(self.geometry)

    def coordinate_at(self, placements: Placements) -> float:
        """The drive's coordinate with the links at `placements`."""
        return self.drive.coordinate_at(self.geometry, placements[self.first], placements[self.second])


@dataclass(frozen=True, eq=False)
class Multibody:
    """Links in depth-first order, and the closures of their loops; SI, at home all joints are near zero."""

    name: str
    bodies: tuple[Body, ...]
    closures: tuple[Closure, ...]
    legs: tuple[LegParts, ...]
    rods: tuple[str, ...]
    scale: float
    """Length that makes lengths comparable with angles, m."""
    geometry: Mapping[str, Any]
    """The mechanism file's numbers in SI, as `Mechanism.geometry`."""
    idle: tuple[tuple[str, Array], ...] = ()
    """Rotations of the platform that no leg feels: the body that their line is fixed in, BASE or PLATFORM,
    and the line's direction (3,) in its axes."""

    @property
    def zero(self) -> Placements:
        """Frame (4, 4) of the base and of each body in base axes where all joints are at zero."""
        return {BASE: np.eye(4)} | {body.name: body.zero for body in self.bodies}

    def start(self, pose: Array) -> Placements:
        """Frame (4, 4) of each body in base axes with the platform at `pose` (4, 4), from points and axes.

        A start for an engine, which solves the closures by itself.
        """
        return placements(self.geometry, pose)


def describe(mech: Mechanism) -> Multibody:
    """The mechanism as bodies, joints and closures [T59]."""
    geometry = mech.geometry
    zero = placements(geometry, mech.home, zero=True)
    bodies, closures, parts = _rods(geometry, zero), [], []
    for leg in geometry["legs"]:
        part = _leg_parts(geometry, leg, zero)
        bodies += _leg(geometry, part, zero)
        squares = _platform_squares(leg["platform"])
        name = f"leg {part.name} platform joint"
        closures.append(Closure(name, (part.second, PLATFORM), _leg_ends(leg), squares))
        parts.append(part)
    bodies.append(_body(PLATFORM, BASE, zero, (Freedom("free", POINT),), geometry["platform"]))
    return Multibody(
        name=mech.name,
        bodies=depth_first(bodies),
        closures=tuple(closures),
        legs=tuple(parts),
        rods=tuple(rod_body(rod) for rod in geometry["rods"]),
        scale=mech.characteristic_length,
        geometry=geometry,
        idle=tuple((idle.body, np.array(idle.axis)) for idle in mech.mobility().idle),
    )


def release(tree: Multibody) -> Multibody:
    """The bodies with the platform set free: their motion off the constraints, by convention [T62].

    Each leg follows its point of the platform, a carriage on its rail, and rotates by the joint that keeps it
    from spinning, the base joint if it does; a rod follows the first leg that it carries.
    """
    bodies, closures = [], []
    parents = {leg.hinge: leg.first if leg.drive.moves_foot else BASE for leg in tree.legs}
    for body in tree.bodies:
        ball = (Freedom("spherical", POINT),)
        freed = body.name in parents
        bodies.append(replace(body, parent=parents[body.name], freedoms=ball) if freed else body)
    for leg, parts in zip(tree.geometry["legs"], tree.legs, strict=True):
        closures.append(Closure(f"leg {parts.name} end", (parts.second, PLATFORM), _leg_ends(leg), ()))
        turning = turning_of(tree.geometry, leg)
        if turning is not None:
            # U: n is perpendicular to the axis; R and F: n is the axis, or n×δ is perpendicular to it.
            other = BASE if turning.side == "base" else PLATFORM
            pair = (Z if turning.along else X, turning.axis)
            closures.append(Closure(f"leg {parts.name} spin", (parts.second, other), None, (pair,)))
    for k, rod in enumerate(tree.rods):
        leader = next(
            parts
            for leg, parts in zip(tree.geometry["legs"], tree.legs, strict=True)
            if leg["base"]["rod"] == k
        )
        closures.append(Closure(f"{rod} turn", (rod, leader.first), None, ((Y, Y),)))
    return replace(tree, bodies=depth_first(bodies), closures=tuple(closures))


def joint_values(body: Body, zero: Array, now: Array) -> list[float | Array]:
    """The value of each degree of freedom of a body: angle, displacement, or rotation (3, 3); none for free.

    `zero` and `now` are the body's frame (4, 4) in its parent's, with all joints at zero and now. Where no
    values give `now`, they are some nearby.
    """
    moved = inverse(zero) @ now
    rotation = moved[:3, :3]
    values: list[float | Array] = []
    for i, freedom in enumerate(body.freedoms):
        match freedom.kind:
            case "prismatic":
                values.append(float(freedom.axis @ moved[:3, 3]))
            case "spherical":
                values.append(rotation)
            case "revolute":
                # The rotation that brings the next axis, which rotates with this one alone, to where it is.
                rest = body.freedoms[i + 1 :]
                seen = rest[0].axis if rest else perpendiculars(freedom.axis)[0]
                angle = turn_about(freedom.axis, seen, rotation @ seen)
                values.append(angle)
                rotation = turned(freedom.axis, -angle) @ rotation
    return values


def depth_first(bodies: Iterable[Body]) -> tuple[Body, ...]:
    """Each body directly followed by all that hangs on it, in the given order otherwise."""
    bodies = list(bodies)

    def below(parent: str) -> list[Body]:
        return [b for child in bodies if child.parent == parent for b in [child, *below(child.name)]]

    return tuple(below(BASE))


def _rods(geometry: Mapping[str, Any], zero: Placements) -> list[Body]:
    turn = (Freedom("revolute", X),)
    return [_body(rod_body(rod), BASE, zero, turn, rod["body"]) for rod in geometry["rods"]]


def _body(
    name: str,
    parent: str,
    zero: Placements,
    freedoms: tuple[Freedom, ...],
    given: Mapping[str, Any] | None,
) -> Body:
    """A body with the file's mass, or none."""
    if given is None:
        return Body(name, parent, zero[name], freedoms, 0.0, np.zeros(3), np.zeros((3, 3)))
    center, inertia = np.array(given["center"]), np.array(given["inertia"])
    return Body(name, parent, zero[name], freedoms, float(given["mass"]), center, inertia)


def _leg_parts(geometry: Mapping[str, Any], leg: Mapping[str, Any], zero: Placements) -> LegParts:
    spins = turning_of(geometry, leg) is None
    parts = LegParts(leg["name"], *leg_bodies(leg), leg["actuated"], 0.0, spins, drive_of(leg), leg)
    return replace(parts, coordinate=parts.coordinate_at(zero))


def _leg_ends(leg: Mapping[str, Any]) -> tuple[Array, Array]:
    """The platform joint in the axes of the piston, which begins there, or strut, and of the platform."""
    return drive_of(leg).reach(leg) * Y, np.array(leg["platform"]["point"])


def _leg(geometry: Mapping[str, Any], parts: LegParts, zero: Placements) -> list[Body]:
    """The two links, with the base joint and the drive's joint, the one below the other."""
    leg, drive = parts.geometry, parts.drive
    rod = leg["base"]["rod"]
    parent = BASE if rod is None else rod_body(geometry["rods"][rod])
    turns = _base_freedoms(leg["base"], zero[parts.hinge])
    moves = (Freedom(drive.joint, parts.axis),)
    lower, upper = (moves, turns) if drive.moves_foot else (turns, moves)
    first, second = drive.solid_bodies(leg)
    return [
        _body(parts.first, parent, zero, lower, first),
        _body(parts.second, parts.first, zero, upper, second),
    ]


def _base_freedoms(joint: Mapping[str, Any], zero: Array) -> tuple[Freedom, ...]:
    """Degrees of freedom of a base joint, to the cylinder or strut with the frame `zero`."""
    about_n = Freedom("revolute", X)
    match joint["joint"]:
        case "S":
            return (Freedom("spherical", POINT),)
        case "U":
            axis = unit(joint["axis"])
            return (Freedom("revolute", zero[:3, :3].T @ axis), about_n)
        case "R":
            return (about_n,)
    return ()


def _platform_squares(joint: Mapping[str, Any]) -> tuple[tuple[Array, Array], ...]:
    """Axes of the piston and of the platform that a platform joint keeps square."""
    match joint["joint"]:
        case "S":
            return ()
        case "U":
            return ((X, unit(joint["axis"])),)
        case "R":
            first, second = perpendiculars(unit(joint["axis"]))
            return ((X, first), (X, second))
    normal = unit(joint["normal"])
    along = np.array(joint["axis"]) - normal * (normal @ joint["axis"])
    direction = unit(along)
    side = cross(normal, direction)
    return ((X, direction), (X, side), (Y, side))
