"""Common basis of all model formats: the multibody description, names, light masses, and omissions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod import _core
from polypod.export.names import Names, printable
from polypod.legs.drives import kinds_among
from polypod.mechanism import Mechanism
from polypod.multibody.closing import ClosingJoint, closing_joints
from polypod.multibody.mjcf import cross_name, joint_name
from polypod.multibody.placement import PLATFORM
from polypod.multibody.tree import Body, LegParts, Multibody, describe

Array = NDArray[np.float64]

LIGHT = 1e-6
"""Mass of a body between two axes of a joint, as a part of the heaviest link's: engines divide by masses. Its
moments of inertia are that mass times the square of the characteristic length."""
THIN = 1e-4
"""Mass of a link that has none in the mechanism, as a part of the heaviest link's: loops that are springs
hold with the mass of what they tie, so that lighter legs let a heavy platform sink, and shake."""
MASSLESS = 1.0
"""kg: what stands for the heaviest link where no link has a mass."""


@dataclass(frozen=True, eq=False)
class Range:
    """Least and greatest value of a joint, m or rad, counted from home."""

    least: float
    greatest: float


class Model:
    """A mechanism on its way into a file."""

    def __init__(self, mech: Mechanism) -> None:
        self.mech = mech
        self.tree: Multibody = describe(mech)
        self.closing: tuple[ClosingJoint, ...] = closing_joints(self.tree)
        self.names = Names(_labels(self.tree, self.closing))

    @cached_property
    def light(self) -> tuple[float, Array]:
        """Mass, kg, and inertia (3, 3), kg m^2, of what only joins two axes."""
        return self._part_of_heaviest(LIGHT)

    @cached_property
    def thin(self) -> tuple[float, Array]:
        """Mass, kg, and inertia (3, 3), kg m^2, of links that have none in the mechanism."""
        return self._part_of_heaviest(THIN)

    def _part_of_heaviest(self, part: float) -> tuple[float, Array]:
        mass = part * (max(body.mass for body in self.tree.bodies) or MASSLESS)
        return mass, mass * self.tree.scale**2 * np.eye(3)

    def inertial(self, body: Body) -> tuple[float, Array]:
        """Mass and inertia about the mass centre as the mechanism has them, or the thin ones."""
        return (body.mass, body.inertia) if body.mass > 0.0 else self.thin

    @property
    def massless(self) -> list[str]:
        """Links for which the mechanism has no mass."""
        return [body.name for body in self.tree.bodies if body.mass == 0.0]

    def leg_of(self, body: Body) -> tuple[LegParts, dict[str, Any]] | None:
        """The leg that a link belongs to, and what the mechanism says of it."""
        legs = self.mech.geometry["legs"]
        for parts, leg in zip(self.tree.legs, legs, strict=True):
            if body.name in (parts.first, parts.second):
                return parts, leg
        return None

    def range_of(self, body: Body, i: int) -> Range | None:
        """Limits of a body's degree of freedom: a stroke, the angle of a base R joint, or that of a rod."""
        if body.name in self.tree.rods:
            return _range(self.mech.geometry["rods"][self.tree.rods.index(body.name)]["range"])
        found = self.leg_of(body)
        if found is None:
            return None
        parts, leg = found
        if body.name == parts.slide:
            stroke = _range(leg["stroke"])
            return stroke and Range(stroke.least - parts.coordinate, stroke.greatest - parts.coordinate)
        return _range(leg["base"]["range"]) if i == 0 else None

    def closing_range(self, index: int) -> Range | None:
        """The limits of a leg's platform joint, if it is revolute."""
        return _range(self.mech.geometry["legs"][index]["platform"]["range"])

    def force_of(self, index: int) -> Range | None:
        """The limits of a leg's active force, N."""
        return _range(self.mech.geometry["legs"][index]["force"])

    def about(self, format: str, notes: Iterable[str]) -> str:
        """The comment at the head of a file."""
        facts = [
            f"{self.mech.name}: {format}, written by Polypod {_core.__version__}.",
            "Units: m, kg, s, rad. A leg's links have the axes (n, delta, n x delta) at B and at b.",
        ]
        facts += [drive.frames for drive in kinds_among(self.mech.drives) if drive.frames]
        renamed = [f"{given} is {name}" for given, name in self.names.changed("link").items()]
        if renamed:
            facts.append(f"Names: {'; '.join(renamed)}.")
        return "\n".join(map(printable, [*facts, *(f"Note: {note}" for note in notes)]))


def _labels(tree: Multibody, closing: Sequence[ClosingJoint]) -> dict[tuple[str, str], str]:
    """Labels of joints and crosses in place of their names in the multibody description."""
    labels: dict[tuple[str, str], str] = {}
    bodies = {body.name: body for body in tree.bodies}
    labels |= {("joint", joint_name(bodies[rod], 0)): f"{rod} turn" for rod in tree.rods}
    labels["joint", joint_name(bodies[PLATFORM], 0)] = "platform free"
    for leg, joint in zip(tree.legs, closing, strict=True):
        hinge, slide = bodies[leg.hinge], bodies[leg.slide]
        for i in range(len(hinge.freedoms)):
            labels["joint", joint_name(hinge, i)] = f"leg {leg.name} base joint {i + 1}"
        labels["joint", joint_name(slide, 0)] = f"leg {leg.name} slide"
        labels["link", cross_name(joint)] = f"leg {leg.name} cross"
        labels["joint", f"{cross_name(joint)} 0"] = f"leg {leg.name} platform joint 1"
    return labels


def _range(given: Sequence[float] | None) -> Range | None:
    return None if given is None else Range(float(given[0]), float(given[1]))
