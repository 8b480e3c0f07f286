"""A mechanism as URDF, which knows trees only, and beside it a file that says how the loops are closed.

The platform hangs on one leg. Every other leg ends at its platform joint, in a frame that coincides with one
of the platform. Which frames do is in the side-car, a YAML file of the form that the parallel-robot tools for
Pinocchio read: `closed_loop` pairs of frames, `type` "3d" (their points coincide) or "6d" (their axes, too),
and `name_mot` the joints with a motor.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from polypod.export.model import Model, Range
from polypod.export.names import add_comment, xml
from polypod.export.omissions import FORCES, PLATFORM_TURNS, STROKES, TURNS, lost
from polypod.export.shapes import Shape
from polypod.export.xml_common import INERTIA, NO_LIMIT, bounds, child, effort, lopsided, roll_pitch_yaw
from polypod.multibody.mjcf import joint_name, numbers
from polypod.multibody.placement import BASE, PLATFORM
from polypod.multibody.tree import POINT, Body, Freedom
from polypod.vectors import inverse

Array = NDArray[np.float64]

FREE_TURN = math.pi
"""rad: the limit of a rotation, to either side, where the mechanism has none."""


def urdf(
    model: Model, shapes: Mapping[str, Sequence[Shape]], uris: Mapping[str, str], sidecar: str
) -> tuple[str, str, list[str]]:
    """The tree, the side-car, and what they leave out.

    Args:
        model: the mechanism.
        shapes: what each body looks like.
        uris: where the meshes are, by the names of the shapes.
        sidecar: the side-car's name, to point to.
    """
    return _Writer(model, shapes, uris).files(sidecar)


class _Writer:
    def __init__(self, model: Model, shapes: Mapping[str, Sequence[Shape]], uris: Mapping[str, str]) -> None:
        self._model, self._shapes, self._uris = model, shapes, uris
        self._root = ElementTree.Element("robot", name=model.names("model", model.tree.name))
        self._loops: list[tuple[str, str]] = []
        self._types: list[str] = []
        self._light = 0
        """Number of links between the axes of joints."""

    def files(self, sidecar: str) -> tuple[str, str, list[str]]:
        model = self._model
        self._link(BASE, None)
        for body in model.tree.bodies:
            if body.name != PLATFORM:
                self._tree_body(body)
        # The fewest degrees of freedom leave the fewest joints between the leg and the platform.
        main = min(range(len(model.closing)), key=lambda i: sum(_size(f) for f in model.closing[i].freedoms))
        for i in [main, *(i for i in range(len(model.closing)) if i != main)]:
            self._platform_joint(i, carries=i == main)
        notes = lost(model, STROKES | TURNS | PLATFORM_TURNS | FORCES, gravity=False)
        notes += [*lopsided(model), *self._notes(main, sidecar)]
        add_comment(self._root, model.about("URDF", notes))
        return xml(self._root), self._sidecar(notes), notes

    def _notes(self, main: int, sidecar: str) -> list[str]:
        leg = self._model.tree.legs[main].name
        notes = [
            f"URDF knows no loops: the platform hangs on leg {leg}, and {sidecar} tells how the other legs "
            "are tied to it.",
            f"{NO_LIMIT:g} stands for no limit, {FREE_TURN:.6g} rad for rotations without one.",
        ]
        if self._light:
            notes.append(
                f"{self._light} links of {self._model.light[0]:g} kg between the axes of joints, with names "
                "that end in part_1, part_2 or end, are no links of the mechanism."
            )
        return notes

    def _sidecar(self, notes: Sequence[str]) -> str:
        model = self._model
        comment = "".join(
            f"# {line}\n" for line in model.about("loop closures of the URDF", notes).splitlines()
        )
        bodies = {body.name: body for body in model.tree.bodies}
        actuated = [bodies[leg.slide] for leg in model.tree.legs if leg.actuated]
        motors = [model.names("joint", joint_name(body, 0)) for body in actuated]
        values = {
            "closed_loop": [list(pair) for pair in self._loops],
            "type": self._types,
            "name_mot": motors,
        }
        # Lists of words in JSON are YAML.
        return comment + "".join(f"{key}: {json.dumps(value)}\n" for key, value in values.items())

    # --- links and joints --------------------------------------------------------------------------------

    def _tree_body(self, body: Body) -> None:
        """A body on its parent: an elementary joint for each degree of freedom, light links between them."""
        model = self._model
        place = inverse(model.tree.zero[body.parent]) @ body.zero
        ranges = [model.range_of(body, i) for i in range(len(body.freedoms))]
        greatest = NO_LIMIT
        for i, leg in enumerate(model.tree.legs):
            if body.name == leg.slide:
                greatest = effort(model, i) if leg.actuated else 0.0
        self._chain(body.parent, body.name, place, body.freedoms, ranges, body, greatest)

    def _platform_joint(self, index: int, *, carries: bool) -> None:
        """The platform on a leg, or the frames of leg and platform that coincide."""
        model, joint = self._model, self._model.closing[index]
        leg, (piston, platform) = model.tree.legs[index].name, joint.bodies
        body = next(body for body in model.tree.bodies if body.name == platform)
        if carries:
            end = f"leg {leg} platform joint end"
            if joint.freedoms:
                ranges = [model.closing_range(index)]
                self._chain(piston, end, joint.frames[0], joint.freedoms, ranges, None, NO_LIMIT, True)
                self._fixed(f"leg {leg} platform", end, PLATFORM, inverse(joint.frames[1]), body)
            else:
                place = joint.frames[0] @ inverse(joint.frames[1])
                self._fixed(f"leg {leg} platform", piston, PLATFORM, place, body)
            return
        number = len(self._loops) + 1
        start, place = piston, joint.frames[0]
        if any(freedom.kind == "revolute" for freedom in joint.freedoms):
            start, place = f"leg {leg} platform joint end", np.eye(4)
            ranges = [model.closing_range(index)]
            self._chain(piston, start, joint.frames[0], joint.freedoms, ranges, None, NO_LIMIT)
        names = [f"closedloop{number}_{side}" for side in "AB"]
        for name, parent, frame in zip(names, (start, platform), (place, joint.frames[1]), strict=True):
            self._fixed(name, parent, f"{name} frame", frame, None)
        self._loops.append((model.names("joint", names[0]), model.names("joint", names[1])))
        self._types.append("3d" if joint.kind == "S" else "6d")

    def _chain(
        self,
        parent: str,
        end: str,
        place: Array,
        freedoms: Sequence[Freedom],
        ranges: Sequence[Range | None],
        body: Body | None,
        greatest: float,
        carries: bool = False,
    ) -> None:
        """Links from `parent` to `end`, one elementary joint each; a spherical one is three."""
        if not freedoms:
            self._fixed(f"{end} fixed", parent, end, place, body)
            return
        names = [joint_name(body, i) for i in range(len(freedoms))] if body else []
        axes = [("revolute", axis) for axis in np.eye(3)]
        if freedoms[0].kind != "spherical":
            axes = [(freedom.kind, freedom.axis) for freedom in freedoms]
        for i, (kind, axis) in enumerate(axes):
            last = i == len(axes) - 1
            link = end if last else f"{end} part {i + 1}"
            name = names[i] if len(names) == len(axes) else f"{end} joint {i + 1}"
            allowed = ranges[i] if i < len(ranges) else None
            self._joint(name, kind, parent, link, place, axis, allowed, greatest)
            # The end of the leg that carries the platform is one with it.
            self._link(link, body if last else None, light=not last or (body is None and not carries))
            parent, place = link, np.eye(4)

    def _joint(
        self,
        name: str,
        kind: str,
        parent: str,
        link: str,
        place: Array,
        axis: Array,
        allowed: Range | None,
        greatest: float,
    ) -> None:
        joint = self._connect(name, kind, parent, link, place)
        child(joint, "axis", xyz=numbers(axis))
        low, high = bounds(allowed, FREE_TURN if kind == "revolute" else NO_LIMIT)
        limits = {"lower": low, "upper": high, "effort": greatest, "velocity": NO_LIMIT}
        child(joint, "limit", **{key: repr(float(value)) for key, value in limits.items()})

    def _fixed(self, name: str, parent: str, link: str, place: Array, body: Body | None) -> None:
        self._connect(name, "fixed", parent, link, place)
        self._link(link, body)

    def _connect(self, name: str, kind: str, parent: str, link: str, place: Array) -> ElementTree.Element:
        names = self._model.names
        joint = child(self._root, "joint", name=names("joint", name), type=kind)
        child(joint, "origin", xyz=numbers(place[:3, 3]), rpy=numbers(roll_pitch_yaw(place)))
        child(joint, "parent", link=names("link", parent))
        child(joint, "child", link=names("link", link))
        return joint

    def _link(self, name: str, body: Body | None, *, light: bool = False) -> None:
        """A link with a body's inertia, a light one, or one that is a frame only."""
        model = self._model
        link = child(self._root, "link", name=model.names("link", name))
        self._light += light
        if light or body is not None:
            mass, inertia = model.inertial(body) if body else model.light
            weight = child(link, "inertial")
            child(weight, "origin", xyz=numbers(body.center if body else POINT), rpy="0 0 0")
            child(weight, "mass", value=repr(float(mass)))
            child(weight, "inertia", **{key: repr(float(inertia[at])) for key, at in INERTIA.items()})
        for shape in self._shapes.get(name, ()):
            visual = child(link, "visual", name=model.names("shape", shape.name))
            place = {"xyz": numbers(shape.frame[:3, 3]), "rpy": numbers(roll_pitch_yaw(shape.frame))}
            child(visual, "origin", **place)
            geometry = child(visual, "geometry")
            if shape.kind == "mesh":
                child(geometry, "mesh", filename=self._uris[shape.name])
            else:
                sizes = dict(zip(("radius", "length"), map(repr, shape.size), strict=False))
                child(geometry, shape.kind, **sizes)
            material = child(visual, "material", name=f"color_{shape.color[1:]}")
            child(material, "color", rgba=numbers(shape.rgba))


def _size(freedom: Freedom) -> int:
    return 3 if freedom.kind == "spherical" else 1
