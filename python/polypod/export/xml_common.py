"""Common XML parts of SDF and URDF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polypod.export.model import Model, Range
from polypod.export.shapes import Shape

Array = NDArray[np.float64]

NO_LIMIT = 1e9
"""m, N, N m or rad/s: where a format demands a limit and the mechanism has none."""
INERTIA = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
"""Components by their names."""


def child(
    parent: ElementTree.Element, tag: str, text: str | None = None, **attributes: str
) -> ElementTree.Element:
    """A new element, with a text if there is one."""
    node = ElementTree.SubElement(parent, tag, attributes)
    node.text = text
    return node


def roll_pitch_yaw(frame: Array) -> Array:
    """(3,): angles, rad, of rotations about the fixed x, y and z of a frame's parent."""
    return np.asarray(Rotation.from_matrix(frame[:3, :3]).as_euler("xyz", suppress_warnings=True))


def effort(model: Model, index: int) -> float:
    """N: the greatest force of a leg's actuator, either way."""
    allowed = model.force_of(index)
    return NO_LIMIT if allowed is None else max(abs(allowed.least), abs(allowed.greatest))


def lopsided(model: Model) -> list[str]:
    """A note on legs whose actuators do not push as much as they pull: formats have one number for both."""
    names = [
        leg.name
        for i, leg in enumerate(model.tree.legs)
        if (allowed := model.force_of(i)) is not None and allowed.least != -allowed.greatest
    ]
    if not names:
        return []
    return [
        f"the limits of the active forces of legs {', '.join(names)} differ for push and pull; effort is the "
        "greater of the two."
    ]


def save_meshes(model: Model, shapes: Mapping[str, list[Shape]], folder: Path) -> dict[str, Path]:
    """Writes the meshes as STL files, m, each in its body's axes; where they are, by the shapes' names."""
    found = {}
    for of in shapes.values():
        for shape in of:
            if shape.mesh is not None:
                folder.mkdir(exist_ok=True)
                path = folder / f"{model.names('shape', shape.name)}.stl"
                shape.mesh.export(path, file_type="stl")
                found[shape.name] = path
    return found


def bounds(allowed: Range | None, otherwise: float) -> tuple[float, float]:
    """Least and greatest value, with `otherwise` to either side where there are none."""
    return (-otherwise, otherwise) if allowed is None else (allowed.least, allowed.greatest)
