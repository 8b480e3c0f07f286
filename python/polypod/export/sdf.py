"""A mechanism as an SDF model: every joint as what it is, those that close loops too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.export.model import Model, Range
from polypod.export.names import add_comment, xml
from polypod.export.omissions import FORCES, PLATFORM_TURNS, STROKES, TURNS, lost
from polypod.export.shapes import Shape
from polypod.export.xml_common import INERTIA, child, effort, lopsided, roll_pitch_yaw
from polypod.multibody.mjcf import numbers
from polypod.multibody.placement import BASE
from polypod.multibody.tree import POINT, Body, Freedom

Array = NDArray[np.float64]

VERSION = "1.7"


def sdf(
    model: Model, shapes: Mapping[str, Sequence[Shape]], uris: Mapping[str, str]
) -> tuple[str, list[str]]:
    """The model file, and what it leaves out.

    Args:
        model: the mechanism.
        shapes: what each body looks like.
        uris: where the meshes are, by the names of the shapes.
    """
    root = ElementTree.Element("sdf", version=VERSION)
    node = child(root, "model", name=model.names("model", model.tree.name))
    _add_link(node, model, BASE, np.eye(4), (*model.light, POINT), shapes.get(BASE, ()), uris)
    for body in model.tree.bodies:
        inertial = (*model.inertial(body), body.center)
        _add_link(node, model, body.name, body.zero, inertial, shapes.get(body.name, ()), uris)
    world = child(node, "joint", name=model.names("joint", "base on the world"), type="fixed")
    child(world, "parent", "world")
    child(world, "child", model.names("link", BASE))
    for body in model.tree.bodies:
        _add_tree_joint(node, model, body)
    for i, joint in enumerate(model.closing):
        name = model.names("joint", f"leg {model.tree.legs[i].name} platform joint")
        made = _add_joint(node, model, name, joint.bodies, joint.freedoms, [model.closing_range(i)], [None])
        child(made, "pose", _pose(joint.frames[1]))
        simbody = child(child(made, "physics"), "simbody")
        child(simbody, "must_be_loop_joint", "true")
    notes = lost(model, STROKES | TURNS | PLATFORM_TURNS | FORCES, gravity=False)
    notes += lopsided(model)
    notes.append(
        f"the base is fixed to the world; the mechanism knows no mass of it, here {model.light[0]:g} kg."
    )
    add_comment(root, model.about("SDF model", notes))
    return xml(root), notes


def _add_tree_joint(node: ElementTree.Element, model: Model, body: Body) -> None:
    """The joint by which a body hangs on its parent; none for the platform."""
    if any(freedom.kind == "free" for freedom in body.freedoms):
        return
    ranges = [model.range_of(body, i) for i in range(len(body.freedoms))]
    efforts: list[float | None] = [None] * len(body.freedoms)
    name = f"{body.name} joint"
    for i, leg in enumerate(model.tree.legs):
        if body.name == leg.slide:
            # No effort is no limit; a passive leg has none to give.
            limited = model.force_of(i) is not None
            greatest = effort(model, i) if limited else None
            name, efforts = f"leg {leg.name} slide", [greatest if leg.actuated else 0.0]
        elif body.name == leg.hinge:
            name = f"leg {leg.name} base joint"
    _add_joint(
        node, model, model.names("joint", name), (body.parent, body.name), body.freedoms, ranges, efforts
    )


def _add_joint(
    node: ElementTree.Element,
    model: Model,
    name: str,
    bodies: tuple[str, str],
    freedoms: Sequence[Freedom],
    ranges: Sequence[Range | None],
    efforts: Sequence[float | None],
) -> ElementTree.Element:
    """A joint in the frame of its child, until it gets a pose."""
    kinds = [freedom.kind for freedom in freedoms]
    names = {
        (): "fixed",
        ("spherical",): "ball",
        ("revolute",): "revolute",
        ("prismatic",): "prismatic",
        ("revolute", "revolute"): "universal",
    }
    joint = child(node, "joint", name=name, type=names[tuple(kinds)])
    child(joint, "parent", model.names("link", bodies[0]))
    child(joint, "child", model.names("link", bodies[1]))
    if kinds == ["spherical"]:
        return joint
    for tag, i in zip(("axis", "axis2"), range(len(freedoms)), strict=False):
        axis = child(joint, tag)
        child(axis, "xyz", numbers(freedoms[i].axis))
        allowed, greatest = ranges[min(i, len(ranges) - 1)], efforts[min(i, len(efforts) - 1)]
        if allowed is not None or greatest is not None:
            limit = child(axis, "limit")
            if allowed is not None:
                child(limit, "lower", numbers([allowed.least]))
                child(limit, "upper", numbers([allowed.greatest]))
            if greatest is not None:
                child(limit, "effort", numbers([greatest]))
    return joint


def _add_link(
    node: ElementTree.Element,
    model: Model,
    name: str,
    place: Array,
    inertial: tuple[float, Array, Array],
    shapes: Sequence[Shape],
    uris: Mapping[str, str],
) -> None:
    """A link at `place` (4, 4) in the model's axes, those of the base."""
    link = child(node, "link", name=model.names("link", name))
    child(link, "pose", _pose(place))
    mass, inertia, center = inertial
    weight = child(link, "inertial")
    child(weight, "pose", f"{numbers(center)} 0 0 0")
    child(weight, "mass", repr(float(mass)))
    tensor = child(weight, "inertia")
    for component, index in INERTIA.items():
        child(tensor, component, repr(float(inertia[index])))
    for shape in shapes:
        visual = child(link, "visual", name=model.names("shape", shape.name))
        child(visual, "pose", _pose(shape.frame))
        geometry = child(visual, "geometry")
        if shape.kind == "mesh":
            child(child(geometry, "mesh"), "uri", uris[shape.name])
        else:
            form = child(geometry, shape.kind)
            for tag, size in zip(("radius", "length"), shape.size, strict=False):
                child(form, tag, repr(size))
        material = child(visual, "material")
        for tag in ("ambient", "diffuse"):
            child(material, tag, numbers(shape.rgba))


def _pose(frame: ArrayLike) -> str:
    frame = np.asarray(frame)
    return f"{numbers(frame[:3, 3])} {numbers(roll_pitch_yaw(frame))}"
