"""The links of a mechanism as solid bodies, true to scale, each in its own axes, and where they are at poses.

The one description of what a mechanism looks like: drawings, the page in the browser and files for other
tools all place these.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from trimesh import Trimesh

from polypod.answers.answer import Codes
from polypod.answers.kinematics import InverseKinematics
from polypod.bodies.drawing import DrawnLeg
from polypod.bodies.drives import DRAWINGS
from polypod.bodies.palette import PALE, color_of
from polypod.bodies.pieces import BASE, JOINT, PLATFORM, ROD, Piece, on_body, sunk
from polypod.bodies.rail import Rail, behind, flat_normal, lower_ends
from polypod.bodies.solids import plate, tube
from polypod.mechanism import Mechanism
from polypod.vectors import perpendiculars, unit

Array = NDArray[np.float64]

RADIUS = 0.085
"""Of a strut where the file gives none, by the characteristic length."""


@dataclass(frozen=True, eq=False)
class Link:
    """A link as solid pieces.

    Axes of the links: those of the base and of the platform are their own; a rod has (L, n, L×n) at its
    point, n of the first leg that it carries; cylinder and piston have (n, δ, n×δ) at B and at b. Of a slider
    the carriage has the base's axes and the strut (n, δ, n×δ), both at the base joint.
    """

    name: str
    """Such as "base", "rod L", "cylinder 1", "piston 1", "carriage 2", "strut 2", "platform"."""
    kind: str
    """The name's first word."""
    index: int
    """Of the rod or leg, from 0; 0 for base and platform."""
    pieces: tuple[Piece, ...]

    def mesh(self) -> Trimesh:
        """All pieces in one mesh, with the colours of its faces; watertight, although pieces overlap."""
        return _joined(self.pieces)


class LinkFrames(NamedTuple):
    """Where the links are, in the order of `links_of`."""

    frames: Array
    """(..., l, 4, 4): the link's axes and origin in base axes, m; NaN where a link has no place."""
    turn_known: NDArray[np.bool_]
    """(..., l): False where the core does not tell the link's rotation about its own line; any one stands
    then.

    So at poses where balance determines no reactions, and where a leg lies along its universal joint's axis.
    """
    status: Codes
    """(...): `Status` of the pose."""


def links_of(mech: Mechanism) -> tuple[Link, ...]:
    """The links as solids: base, rods, each leg's cylinder and piston or carriage and strut, platform.

    Joints are part of them and look like what they are: S a ball, U a cross of two pins, one for each of its
    links, R a pin, F a cube. Lengths are those of the file; thicknesses follow `radius`, or without one the
    characteristic length. The cylinder is as long as the shortest leg allows, and the piston stays in it over
    the stroke as far as one piston can. Rails are part of the base and as long as the stroke.
    """
    return _Shapes(mech).links()


def link_frames(mech: Mechanism, pose: ArrayLike) -> LinkFrames:
    """Where the links are at poses (..., 4, 4).

    Also at singular poses. Rods and legs have no place where `Mechanism.inverse_kinematics` has no answer.
    """
    return LinkPlaces(mech).at(pose)


class LinkPlaces:
    """Frames of `link_frames`, computed once and kept."""

    def __init__(self, mech: Mechanism) -> None:
        self._mech, geometry = mech, mech.geometry
        legs = geometry["legs"]
        self._starts = np.array([leg["base"]["point"] for leg in legs])
        self._ends = np.array([leg["platform"]["point"] for leg in legs])
        self._legs, self._moved = legs, mech.moves_feet
        # Which of the base joint's axes is n.
        self._normals = [int(leg["base"]["joint"] == "U") for leg in legs]
        self._rod_points = np.array([rod["point"] for rod in geometry["rods"]]).reshape(-1, 3)
        lines = np.array([rod["axis"] for rod in geometry["rods"]]).reshape(-1, 3)
        self._rod_lines = lines / np.linalg.norm(lines, axis=-1, keepdims=True)

    def at(self, pose: ArrayLike) -> LinkFrames:
        """Where the links are at poses (..., 4, 4)."""
        pose = np.asarray(pose, float)
        legs = self._mech.inverse_kinematics(pose)
        joints = self._mech.joint_reactions(pose, np.zeros(6), np.zeros(6))
        rods, n = len(self._rod_points), self._mech.n_legs
        axes, known = _filled(self._leg_axes(joints.axes[..., rods:, :, :], legs), legs.directions, column=1)
        b = (pose[..., None, :3, :3] @ self._ends[..., None])[..., 0] + pose[..., None, :3, 3]
        starts = np.where(self._moved[:, None], b - legs.vectors, self._starts)
        lines = np.broadcast_to(self._rod_lines, (*pose.shape[:-2], rods, 3))
        rod_axes, rod_known = _filled(joints.axes[..., :rods, :, :], lines, column=0)

        frames = np.zeros((*pose.shape[:-2], 2 + rods + 2 * n, 4, 4))
        frames[..., 3, 3] = 1.0
        turn_known = np.ones(frames.shape[:-2], bool)
        frames[..., 0, :3, :3] = np.eye(3)
        frames[..., 1 : 1 + rods, :3, :3], turn_known[..., 1 : 1 + rods] = rod_axes, rod_known
        frames[..., 1 : 1 + rods, :3, 3] = self._rod_points
        # What carries a base joint, such as a carriage, has axes of its own; a strut begins at that joint.
        lower = axes.copy()
        for i in np.flatnonzero(self._moved):
            lower[..., i, :, :] = self._mech.drives[i].first_axes(self._legs[i], starts[..., i, :])
        for first, turned, origin in (
            (1 + rods, lower, starts),
            (2 + rods, axes, np.where(self._moved[:, None], starts, starts + legs.vectors)),
        ):
            span = slice(first, 1 + rods + 2 * n, 2)
            frames[..., span, :3, :3], frames[..., span, :3, 3] = turned, origin
            turn_known[..., span] = known
        turn_known[..., 1 + rods : 1 + rods + 2 * n : 2] |= self._moved
        frames[..., -1, :, :] = pose
        lost = np.isnan(frames).any(axis=(-2, -1))
        frames[lost] = np.nan
        return LinkFrames(frames, turn_known & ~lost, legs.status)

    def _leg_axes(self, joints: Array, legs: InverseKinematics) -> Array:
        """(..., n, 3, 3): (n, δ, n×δ) of all legs, from the axes of their joints (..., 3 n, 3, 3)."""
        # A drive's joint between the links has the axes of its leg.
        axes = joints[..., 1::3, :, :].copy()
        for i in np.flatnonzero(self._moved):
            normal, delta = joints[..., 3 * i, :, self._normals[i]], legs.directions[..., i, :]
            axes[..., i, :, :] = np.stack([normal, delta, np.cross(normal, delta)], axis=-1)
        return axes


def _filled(axes: Array, lines: Array, column: int) -> tuple[Array, NDArray[np.bool_]]:
    """Axes (..., k, 3, 3), and where there are none, any that have `lines` (..., k, 3) for one column."""
    known = np.asarray(~np.isnan(axes).any(axis=(-2, -1)))
    result = axes.copy()
    for at in np.argwhere(~known & np.isfinite(lines).all(axis=-1)):
        line = lines[tuple(at)]
        first, second = perpendiculars(line)
        # Both orders are right-handed: (a, line, a×line) and (line, a, line×a).
        columns = [-first, line, second] if column == 1 else [line, first, second]
        result[tuple(at)] = np.stack(columns, axis=-1)
    return result, known


def _joined(pieces: tuple[Piece, ...]) -> Trimesh:
    meshes = []
    for piece in pieces:
        mesh = piece.mesh.copy()
        mesh.visual = trimesh.visual.ColorVisuals(
            mesh, face_colors=trimesh.visual.color.hex_to_rgba(piece.color)
        )
        meshes.append(mesh)
    joined: Trimesh = trimesh.util.concatenate(meshes)  # type: ignore[assignment]
    return joined


class _Shapes:
    """The sizes of a mechanism's solids, and the solids; each link in its own axes."""

    def __init__(self, mech: Mechanism) -> None:
        self._mech, self._spec = mech, mech.geometry
        legs = self._spec["legs"]
        self._base = np.array([leg["base"]["point"] for leg in legs])
        self._platform = np.array([leg["platform"]["point"] for leg in legs])
        self._radii = leg_radii(mech)
        self._thick = max(self._radii)
        home = mech.inverse_kinematics(mech.home)
        self._home_lengths = home.lengths
        ends = self._platform @ mech.home[:3, :3].T + mech.home[:3, 3]
        ways = {
            i: way
            for i, (leg, drive) in enumerate(zip(legs, mech.drives, strict=True))
            if (way := DRAWINGS[drive].way(leg, float(home.lengths[i]))) is not None
        }
        middle = self._base.copy()
        for i in np.flatnonzero(mech.moves_feet):
            middle[i] = ends[i] - home.vectors[i]
        # Of a planar mechanism, whose joints lie in one plane, the base is below and the platform above.
        above = 1e-6 * mech.characteristic_length * np.array([0.0, 0.0, 1.0])
        towards = ends.mean(axis=0) + above - middle.mean(axis=0)
        base = (middle.mean(axis=0) - mech.home[:3, 3] - above) @ mech.home[:3, :3]
        self._down = _plate_normal(self._platform, base - self._platform.mean(axis=0))
        self._lay_rails(ways, middle, towards, ends)

    def _lay_rails(self, ways: dict[int, Array], joints: Array, towards: Array, platform: Array) -> None:
        """The base's plate, and the rails: they lie on it if all are in one plane, else they stand."""
        still = [i for i in range(len(joints)) if i not in ways]
        stands = np.concatenate([self._base[still], *ways.values()])
        plane = flat_normal(stands) if ways else None
        if plane is None and ways:
            down = np.array(self._spec["gravity"])
            down = down if down.any() else -towards
            stands = np.concatenate([self._base[still], lower_ends([*ways.values()], down)])
            towards = -down
        self._up = _plate_normal(stands, towards)
        self._rails = {}
        for i, ends in ways.items():
            axis = unit(ends[1] - ends[0])
            away = joints[i] - platform.mean(axis=0) if plane is None else -self._up
            self._rails[i] = Rail(ends, axis, behind(axis, away), self._radii[i])
        self._standing = plane is None
        self._lowest = float(np.min(platform @ self._up))

    def links(self) -> tuple[Link, ...]:
        legs = range(self._mech.n_legs)
        return (
            Link("base", "base", 0, tuple(self._base_body())),
            *(
                Link(f"rod {name}", "rod", i, tuple(self._rod(i)))
                for i, name in enumerate(self._mech.rod_names)
            ),
            *(link for i in legs for link in self._leg(i, self._mech.leg_names[i])),
            Link(
                "platform", "platform", 0, tuple(self._body("platform", self._platform, self._down, PLATFORM))
            ),
        )

    def _base_body(self) -> list[Piece]:
        """The base with the rails on it, each with a post at its ends, or at the lower one if it stands."""
        up, thick, names = self._up, self._thick, self._mech.leg_names
        feet = [
            (f"rail post {names[i]} {k}", end)
            for i, rail in self._rails.items()
            for k, end in enumerate(sorted(rail.bar_ends(), key=lambda end: float(end @ up)), 1)
            if k == 1 or not self._standing
        ]
        ends = np.array([end for _, end in feet]).reshape(-1, 3)
        # Below the platform, too, where that hangs between the rails.
        over = (
            np.maximum(ends @ up - self._lowest + 5.0 * thick, 0.0) if self._standing else np.zeros(len(ends))
        )
        pieces = self._body("base", self._base, up, BASE, ends - over[:, None] * up)
        low = float(np.min(pieces[0].mesh.vertices @ up)) + 0.1 * thick
        for name, end in feet:
            pieces.append(Piece(name, BASE, tube(end - (float(end @ up) - low) * up, end, 0.9 * thick)))
        pieces += [Piece(f"rail {names[i]}", ROD, rail.bar()) for i, rail in self._rails.items()]
        return pieces

    def _body(
        self, side: str, points: Array, normal: Array, color: str, extra: Array | None = None
    ) -> list[Piece]:
        """A plate behind the joints, with a post for each of them, and what the joints have on this body.

        The plate is also behind `extra` points (k, 3). What moves on a rail is no part of the base.
        """
        thick = self._thick
        on = [i for i in range(len(points)) if side == "platform" or i not in self._rails]
        all_points = points[on] if extra is None else np.concatenate([points[on], extra])
        behind = all_points - 2.0 * thick * normal
        pieces = [Piece("plate", color, plate(behind, normal, 0.9 * thick, 2.4 * thick))]
        height = float(np.min(behind @ normal))
        for i in on:
            name, point, radius = self._mech.leg_names[i], points[i], self._radii[i]
            # Its foot is a little inside the plate: two bodies with a face in common are no closed surface.
            foot = point - (float(point @ normal) - height + 0.1 * thick) * normal
            joint = self._spec["legs"][i][side]
            carried = side == "base" and self._mech.moves_feet[i]
            head = point if carried else point - sunk(joint, radius) * normal
            post = tube(foot, head, 1.1 * thick, end_radius=0.75 * thick)
            pieces.append(Piece(f"post {name}", color, post))
            if not carried:
                pieces += on_body(joint, radius, name, point, normal)
        return pieces

    def _rod(self, index: int) -> list[Piece]:
        """A bar along the first axis through the joints that it carries, and a bearing at each end."""
        rod, thick = self._spec["rods"][index], self._thick
        axis = unit(rod["axis"])
        on = [i for i, leg in enumerate(self._spec["legs"]) if leg["base"]["rod"] == index]
        along = (self._base[on] - rod["point"]) @ axis
        low, high = along.min() - 3.2 * thick, along.max() + 3.2 * thick
        x = np.array([1.0, 0.0, 0.0])
        return [
            Piece("bar", ROD, tube(low * x, high * x, 0.6 * thick)),
            Piece("bearing 1", JOINT, tube((low - 0.1 * thick) * x, (low + 0.9 * thick) * x, thick)),
            Piece("bearing 2", JOINT, tube((high - 0.9 * thick) * x, (high + 0.1 * thick) * x, thick)),
        ]

    def _leg(self, index: int, name: str) -> list[Link]:
        """The two links of a leg; a passive one is pale."""
        leg, drive = self._spec["legs"][index], self._mech.drives[index]
        drawn = DrawnLeg(
            leg,
            self._radii[index],
            color_of(index) if leg["actuated"] else PALE,
            self._mech.stroke[index],
            float(self._home_lengths[index]),
            self._rails.get(index),
        )
        pieces = zip(drive.links, DRAWINGS[drive].pieces(drawn), strict=True)
        return [Link(f"{kind} {name}", kind, index, tuple(own)) for kind, own in pieces]


def leg_radii(mech: Mechanism) -> list[float]:
    """Radii with which the struts are drawn, m."""
    return [leg["radius"] or RADIUS * mech.characteristic_length for leg in mech.geometry["legs"]]


def _plate_normal(points: Array, towards: Array) -> Array:
    """Unit normal of the plane through points as well as can be, on the side of `towards`."""
    _, sizes, axes = np.linalg.svd(points - points.mean(axis=0))
    flat = len(sizes) > 1 and sizes[1] > 1e-9 * max(sizes[0], 1e-300)
    if flat:
        normal = axes[2]
    else:  # joints on one line, or in one point
        along = axes[0] if sizes[0] > 0 else np.zeros(3)
        normal = towards - (towards @ along) * along
        normal = normal / np.linalg.norm(normal)
    normal = np.asarray(normal)
    return normal if normal @ towards >= 0 else -normal
