"""Shapes of links in a model file: meshes of their pieces by colour, or simple shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh
from numpy.typing import NDArray

from polypod.bodies.drives import DRAWINGS
from polypod.bodies.links import Link, leg_radii, links_of
from polypod.bodies.palette import PALE, color_of
from polypod.legs.drives import LINK_PLACE
from polypod.mechanism import Mechanism
from polypod.multibody.placement import leg_bodies, rod_body
from polypod.vectors import perpendiculars, unit

Array = NDArray[np.float64]

PLAIN = "#9AA0A6"
"""Of simple shapes that are no legs."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A visible part of a link."""

    name: str
    kind: Literal["mesh", "cylinder", "sphere"]
    frame: Array
    """(4, 4): in the link's axes; a cylinder lies along its third axis, about its origin."""
    size: tuple[float, ...]
    """Radius and length of a cylinder, radius of a sphere, m; none for a mesh."""
    color: str
    """Such as #C9CDD3."""
    mesh: trimesh.Trimesh | None = None

    @property
    def rgba(self) -> tuple[float, float, float, float]:
        """Parts from 0 to 1."""
        red, green, blue = (int(self.color[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
        return red, green, blue, 1.0


def body_name(mech: Mechanism, link: Link) -> str:
    """The multibody description's name of a link."""
    spec = mech.geometry
    if link.kind == "rod":
        return rod_body(spec["rods"][link.index])
    place = LINK_PLACE.get(link.kind)
    return link.kind if place is None else leg_bodies(spec["legs"][link.index])[place]


def meshes(mech: Mechanism) -> dict[str, list[Shape]]:
    """Of each body, its pieces of one colour as one mesh, in the body's axes."""
    shapes = {}
    for link in links_of(mech):
        body = body_name(mech, link)
        by_color: dict[str, list[trimesh.Trimesh]] = {}
        for piece in link.pieces:
            by_color.setdefault(piece.color, []).append(piece.mesh)
        shapes[body] = [
            Shape(f"{body} mesh {i}", "mesh", np.eye(4), (), color, _joined(pieces))
            for i, (color, pieces) in enumerate(by_color.items(), 1)
        ]
    return shapes


def _joined(pieces: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    joined: trimesh.Trimesh = trimesh.util.concatenate([piece.copy() for piece in pieces])  # type: ignore[assignment]
    return joined


def simple(mech: Mechanism) -> dict[str, list[Shape]]:
    """Of each body some cylinders and spheres, in the body's axes."""
    spec, radii = mech.geometry, leg_radii(mech)
    lengths = mech.inverse_kinematics(mech.home).lengths
    shapes: dict[str, list[Shape]] = {"base": [], "platform": []}
    for k, rod in enumerate(spec["rods"]):
        points = [np.array(leg["base"]["point"]) for leg in spec["legs"] if leg["base"]["rod"] == k]
        line = unit(rod["axis"])
        along = [float((point - rod["point"]) @ line) for point in points]
        radius = max(radii)
        ends = np.array([[min(along) - radius, 0.0, 0.0], [max(along) + radius, 0.0, 0.0]])
        shapes[rod_body(rod)] = [_bar(f"{rod_body(rod)} bar", ends, 0.6 * radius, PLAIN)]
    for i, leg in enumerate(spec["legs"]):
        color = color_of(i) if leg["actuated"] else PALE
        drawing, home = DRAWINGS[mech.drives[i]], float(lengths[i])
        for body, bar in zip(leg_bodies(leg), drawing.bars(leg, radii[i], home), strict=True):
            shapes[body] = [_bar(f"{body} bar", bar.ends, bar.radius, color)]
        way = drawing.way(leg, home)
        shapes["base"].append(
            _ball(f"base ball {leg['name']}", leg["base"]["point"], 1.2 * radii[i])
            if way is None
            else _bar(f"base rail {leg['name']}", way, 0.6 * radii[i], PLAIN)
        )
        shapes["platform"].append(
            _ball(f"platform ball {leg['name']}", leg["platform"]["point"], 1.2 * radii[i])
        )
        spoke = np.array([[0.0, 0.0, 0.0], leg["platform"]["point"]])
        if np.linalg.norm(spoke[1]) > radii[i]:
            shapes["platform"].append(_bar(f"platform spoke {leg['name']}", spoke, 0.5 * radii[i], PLAIN))
    return shapes


def _ball(name: str, center: list[float], radius: float) -> Shape:
    frame = np.eye(4)
    frame[:3, 3] = center
    return Shape(name, "sphere", frame, (radius,), PLAIN)


def _bar(name: str, ends: Array, radius: float, color: str) -> Shape:
    """A cylinder between two points (2, 3)."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    axis = (ends[1] - ends[0]) / length
    frame = np.eye(4)
    frame[:3, :3] = np.column_stack([*perpendiculars(axis), axis])
    frame[:3, 3] = ends.mean(axis=0)
    return Shape(name, "cylinder", frame, (radius, length), color)
