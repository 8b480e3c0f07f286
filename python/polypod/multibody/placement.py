"""Where the links of a mechanism are at a pose of the platform, from points and axes alone.

A leg's frame is (n, δ, n×δ), as the mechanism file's format defines it; a rod's is (L, n, L×n). A link that
carries the base joint, such as a carriage, has those of its drive. The origin is at the base joint, of a
piston at the platform joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from polypod.legs.drives import drive_of
from polypod.legs.joints import JOINTS
from polypod.vectors import cross, frame_at, perpendiculars, unit

Array = NDArray[np.float64]
Placements = dict[str, Array]
"""Frame (4, 4) of each body in base axes, by the body's name."""

BASE, PLATFORM = "base", "platform"
"""Names of these two bodies."""

PARALLEL = 1e-6
"""rad: planes of legs on one rod that are as parallel as this at home are parallel [T9]."""


@dataclass(frozen=True, eq=False)
class Turning:
    """The axis that a leg's normal n comes from."""

    side: Literal["base", "platform"]
    axis: Array
    """(3,): unit vector in the axes of base or platform."""
    along: bool
    """n is the axis itself (R, F), or perpendicular to it and to the leg (U)."""


def leg_bodies(leg: Mapping[str, Any]) -> tuple[str, str]:
    """Names of a leg's two links, from the base on: cylinder and piston, or carriage and strut."""
    first, second = drive_of(leg).links
    return f"leg {leg['name']} {first}", f"leg {leg['name']} {second}"


def rod_body(rod: Mapping[str, Any]) -> str:
    """Name of a rod's body."""
    return f"rod {rod['name']}"


def turning_of(geometry: Mapping[str, Any], leg: Mapping[str, Any]) -> Turning | None:
    """Joint that keeps a leg from spinning: its base joint if that is U, R or F, else its platform joint."""
    if leg["base"]["rod"] is not None:
        return Turning("base", unit(geometry["rods"][leg["base"]["rod"]]["axis"]), along=False)
    sides: tuple[Literal["base", "platform"], ...] = ("base", "platform")
    for side in sides:
        joint = leg[side]
        kind = JOINTS[joint["joint"]]
        if kind.normal != "free":
            axis = joint["normal"] if kind.has_normal else joint["axis"]
            return Turning(side, unit(axis), along=kind.normal == "along")
    return None


def placements(geometry: Mapping[str, Any], pose: Array, *, zero: bool = False) -> Placements:
    """Frame of each body, in base axes, with the platform at `pose` (4, 4).

    With `zero` the legs on a rod have the planes that the rod holds them in: parallel where they nearly are.
    """
    found: Placements = {PLATFORM: np.array(pose)}
    normals: dict[int, Array] = {}
    for leg in geometry["legs"]:
        end = pose[:3, :3] @ leg["platform"]["point"] + pose[:3, 3]
        drive = drive_of(leg)
        start = drive.foot(leg, end)
        delta = unit(end - start)
        n = _normal(turning_of(geometry, leg), pose, delta)
        rod = leg["base"]["rod"]
        if rod is not None:
            first = normals.setdefault(rod, n)
            if zero and np.linalg.norm(n - first) <= PARALLEL:
                n = first
        delta = unit(delta - n * (n @ delta))
        axes = np.column_stack([n, delta, cross(n, delta)])
        lower, upper = leg_bodies(leg)
        if drive.moves_foot:
            found[lower] = frame_at(drive.first_axes(leg, start), start)
            found[upper] = frame_at(axes, start)
        else:
            found[lower] = frame_at(axes, start)
            found[upper] = frame_at(axes, start + delta * np.linalg.norm(end - start))
    for k, rod in enumerate(geometry["rods"]):
        line, n = unit(rod["axis"]), normals[k]
        found[rod_body(rod)] = frame_at(np.column_stack([line, n, cross(line, n)]), rod["point"])
    return found


def _normal(turning: Turning | None, pose: Array, delta: Array) -> Array:
    if turning is None:
        return perpendiculars(delta)[0]
    axis = turning.axis if turning.side == "base" else pose[:3, :3] @ turning.axis
    return axis if turning.along else unit(cross(axis, delta))
