"""The skeleton of a model file for MuJoCo: a tree of bodies with joints, and equalities that close the loops.

`polypod.export.mjcf` makes a whole model of it, `polypod.verify.mujoco` one for checks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from polypod.multibody.closing import ClosingJoint, closing_joints
from polypod.multibody.placement import BASE, Placements
from polypod.multibody.tree import POINT, Body, Freedom, Multibody, joint_values
from polypod.vectors import inverse, turn_about

Array = NDArray[np.float64]
Inertial = tuple[float, Array]
"""Mass, and inertia (3, 3) about the mass centre."""


@dataclass(frozen=True, eq=False)
class Settings:
    """Differences between the two uses of a skeleton."""

    option: Mapping[str, str]
    """Attributes of `option` beside gravity."""
    constraint: Mapping[str, str]
    """Attributes of all equalities."""
    inertial: Callable[[Body], Inertial]
    """Mass and inertia of a body in the model's units; MuJoCo takes none without mass."""
    light: Inertial
    """Those of the cross of a universal joint."""
    name: Callable[[str, str], str] = field(default=lambda kind, name: name)
    """A name as the file has it, from its kind (model, link, joint, site) and what it is called here."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A model's elements, to add to: `nodes` by the names of the bodies."""

    root: ElementTree.Element
    nodes: dict[str, ElementTree.Element]

    def text(self) -> str:
        """The model file."""
        return ElementTree.tostring(self.root, encoding="unicode")


def skeleton(tree: Multibody, settings: Settings) -> Skeleton:
    """Bodies, joints, inertias and an equality for each closure [T64]."""
    root = ElementTree.Element("mujoco", model=settings.name("model", tree.name))
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    gravity = {"gravity": numbers(tree.geometry["gravity"])}
    ElementTree.SubElement(root, "option", gravity | dict(settings.option))
    nodes = {BASE: ElementTree.SubElement(root, "worldbody")}
    for body in tree.bodies:
        place = inverse(tree.zero[body.parent]) @ body.zero
        node = add_body(nodes[body.parent], settings.name("link", body.name), place)
        for i, freedom in enumerate(body.freedoms):
            _joint(node, settings.name("joint", joint_name(body, i)), freedom)
        _inertial(node, body.center, settings.inertial(body))
        nodes[body.name] = node
    equalities = ElementTree.SubElement(root, "equality")
    for joint in closing_joints(tree):
        _close(equalities, nodes, tree.scale, joint, settings)
    return Skeleton(root, nodes)


def configuration(tree: Multibody, placements: Placements) -> dict[str, Array]:
    """The position (qpos) of every joint with the bodies at `placements`, by the joint's name.

    Of `joint_name` and `cross_name`; m and rad; w, x, y, z of a rotation; the platform's point before its
    rotation.
    """
    found = {}
    placements = placements | {BASE: np.eye(4)}
    for body in tree.bodies:
        zero = inverse(tree.zero[body.parent]) @ body.zero
        now = inverse(placements[body.parent]) @ placements[body.name]
        if body.freedoms and body.freedoms[0].kind == "free":
            found[joint_name(body, 0)] = np.array([*now[:3, 3], *quaternion(now)])
            continue
        for i, value in enumerate(joint_values(body, zero, now)):
            position = quaternion(value) if isinstance(value, np.ndarray) else [value]
            found[joint_name(body, i)] = np.array(position)
    for joint in closing_joints(tree):
        if joint.kind == "U":
            first, second = (placements[body][:3, :3] for body in joint.bodies)
            hinge, own = (freedom.axis for freedom in joint.freedoms)
            angle = turn_about(hinge, own, first.T @ second @ joint.frames[1][:3, :3] @ own)
            found[f"{cross_name(joint)} 0"] = np.array([angle])
    return found


def joint_name(body: Body, i: int) -> str:
    """Of a body's degree of freedom, counted from 0."""
    return f"{body.name} {i}"


def cross_name(joint: ClosingJoint) -> str:
    """Of the link between the two axes of a universal joint; its own joint has this name and a 0."""
    return f"{joint.name} cross"


def _close(
    equalities: ElementTree.Element,
    nodes: Mapping[str, ElementTree.Element],
    scale: float,
    joint: ClosingJoint,
    settings: Settings,
) -> None:
    first, second = (nodes[body] for body in joint.bodies)
    if joint.kind == "U":
        # A body of hardly any mass, whose pairs of points then lie on the other axis.
        name = cross_name(joint)
        first = add_body(first, settings.name("link", name), joint.frames[0])
        _joint(first, settings.name("joint", f"{name} 0"), joint.freedoms[0])
        _inertial(first, POINT, settings.light)
    for k, points in enumerate(_pairs(joint, scale)):
        names = [settings.name("site", f"{joint.name} {k} {side}") for side in (0, 1)]
        for node, name, point in zip((first, second), names, points, strict=True):
            ElementTree.SubElement(node, "site", name=name, pos=numbers(point))
        sites = {"site1": names[0], "site2": names[1]}
        ElementTree.SubElement(equalities, "connect", sites | dict(settings.constraint))


def _pairs(joint: ClosingJoint, scale: float) -> list[tuple[Array, Array]]:
    """Points that coincide, in the frames of the two bodies; of the cross and the platform for U [T64].

    MuJoCo's "connect" alone leaves out no term of the acceleration.
    """
    here, there = joint.frames
    if joint.kind == "U":
        here = np.eye(4)
    along: dict[str, list[Array]] = {
        "S": [],
        "U": [freedom.axis for freedom in joint.freedoms[1:]],
        "R": [freedom.axis for freedom in joint.freedoms],
        "F": [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])],
    }
    ends = [POINT, *(scale * axis for axis in along[joint.kind])]
    return [tuple(frame[:3, :3] @ end + frame[:3, 3] for frame in (here, there)) for end in ends]  # type: ignore[misc]


def add_body(parent: ElementTree.Element, name: str, place: Array) -> ElementTree.Element:
    """A body at `place` (4, 4) in its parent."""
    attributes = {"name": name, "pos": numbers(place[:3, 3]), "quat": numbers(quaternion(place))}
    return ElementTree.SubElement(parent, "body", attributes)


def _inertial(node: ElementTree.Element, center: Array, inertial: Inertial) -> None:
    mass, inertia = inertial
    six = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    ElementTree.SubElement(
        node, "inertial", pos=numbers(center), mass=repr(float(mass)), fullinertia=numbers(six)
    )


def _joint(node: ElementTree.Element, name: str, freedom: Freedom) -> None:
    match freedom.kind:
        case "free":
            ElementTree.SubElement(node, "freejoint", name=name)
        case "spherical":
            ElementTree.SubElement(node, "joint", name=name, type="ball")
        case kind:
            kinds = {"revolute": "hinge", "prismatic": "slide"}
            ElementTree.SubElement(node, "joint", name=name, type=kinds[kind], axis=numbers(freedom.axis))


def numbers(values: ArrayLike) -> str:
    """Numbers as a file has them, with all their digits."""
    return " ".join(repr(float(x)) for x in np.ravel(values))


def quaternion(frame: Array) -> Array:
    """(4,): w, x, y, z of the rotation of a frame (4, 4) or (3, 3)."""
    return np.asarray(np.roll(Rotation.from_matrix(frame[:3, :3]).as_quat(), 1))
