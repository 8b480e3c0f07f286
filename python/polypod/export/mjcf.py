"""A mechanism as a model file for MuJoCo (MJCF): loops closed by equalities, motors along legs and rails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.export.model import Model
from polypod.export.names import add_comment, xml
from polypod.export.omissions import FORCES, STROKES, TURNS, lost
from polypod.export.shapes import Shape
from polypod.mechanism import Mechanism
from polypod.multibody.mjcf import (
    Settings,
    Skeleton,
    configuration,
    cross_name,
    joint_name,
    numbers,
    quaternion,
    skeleton,
)

Array = NDArray[np.float64]

STEP = 0.001
"""s."""
OPTION = {"timestep": repr(STEP), "integrator": "implicitfast", "tolerance": "1e-12"}
CLOSURE = {"solref": f"{2 * STEP!r} 1", "solimp": "0.9999 0.9999 0.001 0.5 2"}
"""MuJoCo's loops are springs: a time constant of two steps, the shortest that is stable, critically damped,
and the highest impedance. At rest they give way by 1e-4 (2 STEP)^2 times the acceleration that they hold."""


def mjcf(
    model: Model, shapes: Mapping[str, Sequence[Shape]], pose: Array | None = None
) -> tuple[str, list[str]]:
    """The model file, and what it leaves out.

    Args:
        model: the mechanism.
        shapes: what each body looks like; meshes stand in the file itself.
        pose: (4, 4); a second keyframe, "pose", beside "home".
    """
    settings = Settings(OPTION, CLOSURE, model.inertial, model.light, model.names)
    made = skeleton(model.tree, settings)
    compiler = made.root.find("compiler")
    assert compiler is not None
    compiler.set("inertiafromgeom", "false")
    _add_ranges(made, model)
    _add_shapes(made, model, shapes)
    _add_motors(made, model)
    notes = lost(model, STROKES | TURNS | FORCES, gravity=True)
    crosses = [joint for joint in model.closing if joint.kind == "U"]
    if crosses:
        names = ", ".join(model.names("link", cross_name(joint)) for joint in crosses)
        notes.append(
            f"universal joints at the platform have a cross of {model.light[0]:g} kg, no link of the "
            f"mechanism: {names}."
        )
    poses = {"home": model.mech.home} | ({} if pose is None else {"pose": pose})
    notes += _add_keys(made, model, poses)
    add_comment(made.root, model.about("MJCF model for MuJoCo", notes))
    return xml(made.root), notes


def _add_ranges(made: Skeleton, model: Model) -> None:
    joints = {node.get("name"): node for node in made.root.iter("joint")}
    for body in model.tree.bodies:
        for i in range(len(body.freedoms)):
            allowed = model.range_of(body, i)
            if allowed is not None:
                node = joints[model.names("joint", joint_name(body, i))]
                node.set("range", numbers([allowed.least, allowed.greatest]))


def _add_shapes(made: Skeleton, model: Model, shapes: Mapping[str, Sequence[Shape]]) -> None:
    """Geometries that collide with nothing and weigh nothing, in the group of visuals."""
    assets = ElementTree.Element("asset")
    look = {"contype": "0", "conaffinity": "0", "group": "1"}
    for body, of in shapes.items():
        for shape in of:
            name = model.names("shape", shape.name)
            attributes = {"name": name, "rgba": " ".join(f"{c:.4g}" for c in shape.rgba)}
            if shape.mesh is not None:
                # A shell: of overlapping pieces, the mass of which does not count, any inertia will do.
                mesh = {"name": name, "inertia": "shell", "vertex": _brief(shape.mesh.vertices)}
                mesh["face"] = " ".join(map(str, shape.mesh.faces.ravel().tolist()))
                ElementTree.SubElement(assets, "mesh", mesh)
                attributes |= {"type": "mesh", "mesh": name}
            else:
                half = [size / 2 if i else size for i, size in enumerate(shape.size)]
                attributes |= {"type": shape.kind, "size": numbers(half)}
                attributes |= {"pos": numbers(shape.frame[:3, 3]), "quat": numbers(quaternion(shape.frame))}
            ElementTree.SubElement(made.nodes[body], "geom", attributes | look)
    if len(assets):
        made.root.insert(list(made.root).index(made.nodes["base"]), assets)


def _brief(values: Any) -> str:
    """Numbers as a single float has them: of meshes."""
    return " ".join(f"{x:.9g}" for x in np.ravel(values).tolist())


def _add_motors(made: Skeleton, model: Model) -> None:
    """A motor along each actuated leg or its rail: its control is the active force, N."""
    motors = ElementTree.SubElement(made.root, "actuator")
    bodies = {body.name: body for body in model.tree.bodies}
    for i, leg in enumerate(model.tree.legs):
        if not leg.actuated:
            continue
        joint = model.names("joint", joint_name(bodies[leg.slide], 0))
        attributes = {"name": model.names("motor", f"leg {leg.name}"), "joint": joint}
        allowed = model.force_of(i)
        if allowed is not None:
            attributes["ctrlrange"] = numbers([allowed.least, allowed.greatest])
        ElementTree.SubElement(motors, "motor", attributes)


def _add_keys(made: Skeleton, model: Model, poses: Mapping[str, Array]) -> list[str]:
    """A keyframe for each pose, with the forces that hold the mechanism there without a load."""
    keys, notes = ElementTree.SubElement(made.root, "keyframe"), []
    order = [node.get("name") for node in made.root.iter() if node.tag in ("joint", "freejoint")]
    for name, pose in poses.items():
        found = configuration(model.tree, model.tree.start(pose))
        positions = {model.names("joint", joint): value for joint, value in found.items()}
        qpos = np.concatenate([positions[joint] for joint in order if joint in positions])
        attributes = {"name": name, "qpos": numbers(qpos)}
        forces = holding_forces(model.mech, pose)
        if forces is None:
            notes.append(f"the keyframe {name} has no forces that hold it: the pose is singular.")
        else:
            attributes["ctrl"] = numbers(forces[model.mech.actuated])
        ElementTree.SubElement(keys, "key", attributes)
    return notes


def holding_forces(mech: Mechanism, pose: Array) -> Array | None:
    """(n,): active forces at rest without a load and at efficiency 1, N; None where none are determined."""
    tables = mech.to_dict()
    tables["dynamics"] = tables.get("dynamics", {}) | {"efficiency": 1.0}
    rest = np.zeros(6)
    found = type(mech).from_dict(tables).inverse_dynamics(pose, rest, rest, rest)
    return found.forces if Status(int(found.status)).has_answer else None
