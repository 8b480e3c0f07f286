"""A mechanism at a pose as a picture in space: its links, with the names of joints, rods and axes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from polypod.bodies.links import leg_radii
from polypod.bodies.pieces import JOINT
from polypod.legs.joints import JOINTS
from polypod.mechanism import Mechanism
from polypod.plots.picture import Label, Picture
from polypod.plots.view import right_and_up
from polypod.vectors import unit

Array = NDArray[np.float64]


class Scene(Picture):
    """A mechanism at a pose, with the names of joints, rods and axes."""

    def __init__(self, mech: Mechanism, pose: Array) -> None:
        super().__init__()
        spec, thick = mech.geometry, max(leg_radii(mech))
        self.add_links(mech, pose)
        base, platform = joint_points(mech, pose)
        for i, name in enumerate(mech.leg_names):
            below = "Q" if mech.moves_feet[i] else "B"
            for letter, points, leg_side in ((below, base, 1), ("b", platform, -1)):
                text = f"${letter}_{{{math_name(name)}}}$"
                away = points[i] - points.mean(axis=0)
                self.labels.append(joint_label(text, points[i], away, leg_side, 5.2 * thick))
            self.lines.append((base[i], platform[i]))
        for i, rod in enumerate(spec["rods"]):
            on = [j for j, leg in enumerate(spec["legs"]) if leg["base"]["rod"] == i]
            self._rod_label(rod, base[on], thick)
        size = 0.66 * mech.characteristic_length
        self.add_triad(self.faces, np.eye(4), size, "O", "XYZ")
        self.add_triad(self.overlay, pose, size, "o", "xyz")

    def _rod_label(self, rod: dict[str, Any], points: Array, thick: float) -> None:
        axis, start = unit(rod["axis"]), np.array(rod["point"])
        along = (points - start) @ axis
        side = start + (0.7 * along.min() + 0.3 * along.max()) * axis
        above = np.array([0.0, 0.0, 2.2 * thick])
        self.labels.append(Label(f"${math_name(rod['name'])}$", side, side + above))
        self.lines.append((start + along.min() * axis, start + along.max() * axis))


def joint_label(text: str, point: Array, away: Array, leg_side: int, distance: float) -> Label:
    """The name of a joint: outwards as seen, but not on the leg, which is above or below.

    `away` is from the middle of the plate; `leg_side` is +1 where the leg is above the joint, -1 where it is
    below.
    """
    right, up = right_and_up()
    x, y = float(away @ right), float(away @ up)
    if y * leg_side > 0.0:
        x, y = math.copysign(1.0, x), 0.0
    size = math.hypot(x, y) or 1.0
    return Label(text, point, point + distance * (x * right + y * up) / size)


def joint_points(mech: Mechanism, pose: Array) -> tuple[Array, Array]:
    """(n, 3) each: joints of the legs on the base's side and on the platform's at a pose, m, base axes."""
    legs = mech.geometry["legs"]
    platform = np.array([leg["platform"]["point"] for leg in legs]) @ pose[:3, :3].T + pose[:3, 3]
    base = np.array([leg["base"]["point"] for leg in legs])
    # A drive below the base joint moves it.
    moved_to = platform - mech.inverse_kinematics(pose).vectors
    known = mech.moves_feet & np.isfinite(moved_to).all(axis=1)
    return np.where(known[:, None], moved_to, base), platform


def joint_handles(mech: Mechanism) -> list[Line2D]:
    """The legend of the joints that a mechanism's legs have at their ends."""
    kinds = {leg[side]["joint"] for leg in mech.geometry["legs"] for side in ("base", "platform")}
    return [
        Line2D(
            [],
            [],
            linestyle="none",
            color=JOINT,
            marker=marker,
            markersize=size,
            label=f"{letter}  {kind.name}",
        )
        for letter, kind in JOINTS.items()
        for marker, size in (kind.marker,)
        if letter in kinds
    ]


def math_name(name: str) -> str:
    """A leg's name inside a formula; words stand upright."""
    safe = "".join(c if c.isalnum() or c in " -." else "\\_" if c == "_" else "" for c in name)
    return safe if len(safe) == 1 else rf"\mathrm{{{safe}}}".replace(" ", r"\ ")
