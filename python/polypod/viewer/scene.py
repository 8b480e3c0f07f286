"""The scene in the browser: links that stand where the view says, arrows, colours, overlays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polypod.answers.singularity import NEAR_SINGULAR
from polypod.bodies.drives import DRAWINGS
from polypod.bodies.links import Link, leg_radii
from polypod.bodies.palette import SKY, YELLOW, Rgb, rgb
from polypod.bodies.pieces import PLATFORM, STEEL
from polypod.legs.drives import LINK_PLACE
from polypod.mechanism import Mechanism
from polypod.viewer.model import Level, Model, View
from polypod.workspaces.workspace import Workspace

if TYPE_CHECKING:
    import viser

Array = NDArray[np.float64]

RED = "#C1121F"
"""Beyond a limit: no leg has this colour."""

SINGULAR = "#A6246E"
"""The platform at a singular pose."""

FORCE, CONSTRAINT, TORQUE, LOOSE = "#101418", "#7B3FA0", "#B8860B", "#D6006C"
LEVEL_COLORS = {Level.FINE: STEEL, Level.NEAR: YELLOW, Level.BEYOND: RED}

ARROW = 1.8
"""Length of the longest arrow, by the characteristic length."""

ELEVATION, AZIMUTH = np.radians(19.0), np.radians(-62.0)
"""Where the camera stands at first: as in the figures."""

FLAT, ABOVE = 0.35, np.radians(50.0)
"""A machine that is lower than so much of its width, and from where above it is seen then."""

FIELD_OF_VIEW = np.radians(40.0)

_CREASE = np.radians(30.0)
_FADE = 10.0
"""The platform begins to change its colour at so many times `NEAR_SINGULAR`."""


def platform_color(sigma_min: float) -> Rgb:
    """The platform's colour: its own far from singular poses, more and more magenta near them."""
    if not np.isfinite(sigma_min):
        return rgb(SINGULAR)
    share = np.log(max(sigma_min, 1e-12) / NEAR_SINGULAR) / np.log(_FADE)
    share = float(np.clip(share, 0.0, 1.0))
    mixed = share * np.array(rgb(PLATFORM)) + (1.0 - share) * np.array(rgb(SINGULAR))
    red, green, blue = (round(float(part)) for part in mixed)
    return red, green, blue


class Machine:
    """The links as nodes under one frame; names are numbers, whatever a file calls its legs."""

    def __init__(self, api: viser.SceneApi, links: tuple[Link, ...], root: str = "/machine") -> None:
        self._root = api.add_frame(root, show_axes=False)
        self._links = links
        self._frames: list[viser.FrameHandle] = []
        self._legs: list[list[viser.MeshHandle]] = [[] for _ in links]
        self._platform: list[viser.MeshHandle] = []
        for k, link in enumerate(links):
            self._frames.append(api.add_frame(f"{root}/{k}", show_axes=False))
            for j, piece in enumerate(link.pieces):
                smooth = trimesh.graph.smooth_shade(piece.mesh, angle=_CREASE)
                node = api.add_mesh_simple(
                    f"{root}/{k}/{j}",
                    smooth.vertices,
                    smooth.faces,
                    color=rgb(piece.color),
                )
                if link.kind in LINK_PLACE and piece.color == STEEL:
                    self._legs[link.index].append(node)
                elif piece.color == PLATFORM:
                    self._platform.append(node)

    def show(self, view: View) -> None:
        """Places the links and colours them."""
        self.place(view.frames)
        for nodes, level in zip(self._legs, view.leg_levels, strict=False):
            _paint(nodes, rgb(LEVEL_COLORS[level]))
        _paint(self._platform, platform_color(view.sigma_min))

    def place(self, frames: Array) -> None:
        """Puts the links where frames (l, 4, 4) say, and hides those without a place."""
        known = np.asarray(np.isfinite(frames).all(axis=(1, 2)))
        turns = np.zeros((len(frames), 4))
        turns[known] = Rotation.from_matrix(frames[known, :3, :3]).as_quat(scalar_first=True)
        for node, frame, turn, has_place in zip(self._frames, frames, turns, known, strict=True):
            visible = bool(has_place)
            if visible:
                node.wxyz, node.position = turn, frame[:3, 3]
            if node.visible != visible:
                node.visible = visible


def _paint(nodes: list[viser.MeshHandle], color: Rgb) -> None:
    for node in nodes:
        if node.color != color:
            node.color = color


class Arrows:
    """Arrows at the platform: forces of the legs, the constraint wrench, the motion that nothing resists."""

    def __init__(self, api: viser.SceneApi, mech: Mechanism) -> None:
        self._size, n = mech.characteristic_length, mech.n_legs
        self._thick = 0.7 * max(leg_radii(mech))  # thicker than a piston, in which an arrow may lie
        self.force_scale = 0.0
        """Force of the longest arrow, N; 0 where every pose sets its own."""
        self._forces = self._arrows(api, "/forces", n, FORCE)
        self._wrench = self._arrows(api, "/wrench/force", 1, CONSTRAINT)
        self._torque = self._arrows(api, "/wrench/torque", 1, TORQUE)
        self._loose = self._arrows(api, "/loose", 1, LOOSE)
        self.wanted = {"forces": True, "wrench": False, "loose": True}

    def _arrows(self, api: viser.SceneApi, name: str, count: int, color: str) -> viser.ArrowsHandle:
        return api.add_arrows(
            name,
            np.zeros((count, 2, 3)),
            rgb(color),
            shaft_radius=self._thick,
            head_radius=2.2 * self._thick,
            head_length=5.0 * self._thick,
            visible=False,
        )

    def largest(self, view: View) -> float:
        """The force that the longest arrow stands for, N."""
        force = max((float(abs(f)) for f in view.forces if np.isfinite(f)), default=0.0)
        return self.force_scale or force

    def show(self, view: View) -> None:
        """Draws those that are wanted and known."""
        largest, reach = self.largest(view), ARROW * self._size
        by_newton = reach / largest if largest > 0.0 else 0.0
        tips = view.joints + by_newton * view.forces[:, None] * view.directions
        known = np.isfinite(tips).all()
        self._draw(self._forces, view.joints, tips, bool(known) and self.wanted["forces"])
        o = view.pose[:3, 3]
        wanted = self.wanted["wrench"] and bool(np.isfinite(view.wrench).all())
        self._draw(self._wrench, o[None], o + by_newton * view.wrench[None, :3], wanted)
        self._draw(self._torque, o[None], o + by_newton / self._size * view.wrench[None, 3:], wanted)
        screw = view.screw
        self._loose.visible = screw is not None and self.wanted["loose"]
        if screw is not None:
            # The axis itself, if it passes near the platform; else the way that the platform's point o goes.
            near = bool(np.linalg.norm(screw.point - o) < 4.0 * self._size)
            middle, way = (screw.point, screw.axis) if near else (o, screw.velocity)
            way = 1.4 * reach * way / max(float(np.linalg.norm(way)), 1e-12)
            self._loose.points = np.stack([middle - way, middle + way])[None].astype(np.float32)

    def _draw(self, node: viser.ArrowsHandle, starts: Array, tips: Array, wanted: bool) -> None:
        long = np.linalg.norm(tips - starts, axis=1) > 0.02 * self._size
        wanted = wanted and bool(long.any())
        if wanted:
            # One that is too short to be seen has no length; none is longer than twice the longest.
            step = np.where(long[:, None], tips - starts, 0.0)
            size = np.linalg.norm(step, axis=1, keepdims=True)
            step *= np.minimum(1.0, 2.0 * ARROW * self._size / np.maximum(size, 1e-12))
            node.points = np.stack([starts, starts + step], axis=1).astype(np.float32)
        node.visible = wanted


def furnish(server: viser.ViserServer, model: Model, frames: Array) -> None:
    """Light, ground and the camera's first place, for a machine and a motion of this size."""
    corners = [
        piece.mesh.bounds @ frame[:3, :3].T + frame[:3, 3]
        for link, frame in zip(model.links, frames, strict=True)
        if np.isfinite(frame).all()
        for piece in link.pieces
    ]
    extent = np.ptp(np.concatenate(corners), axis=0)
    if model.track is not None and len(model.track.positions):
        around = model.mech.characteristic_length
        corners += [model.track.positions - around, model.track.positions + around]
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    cell = float(10.0 ** np.floor(np.log10(size / 4.0)))
    server.scene.add_grid(
        "/ground",
        width=30.0 * cell,
        height=30.0 * cell,
        cell_size=cell,
        section_size=5.0 * cell,
        cell_color=(232, 235, 239),
        section_color=(212, 216, 222),
        position=(float(middle[0]), float(middle[1]), float(low[2])),
    )
    # Shadows and mirrored surroundings would take nine of ten pictures where there is no graphics card.
    server.scene.configure_default_lights(True, cast_shadow=False)
    server.scene.configure_environment_map(None)
    server.scene.add_light_hemisphere(
        "/sky", sky_color=(255, 255, 255), ground_color=(170, 175, 185), intensity=1.6
    )
    elevation = ABOVE if extent[2] < FLAT * extent[:2].max() else ELEVATION
    way = np.array(
        [np.cos(elevation) * np.cos(AZIMUTH), np.cos(elevation) * np.sin(AZIMUTH), np.sin(elevation)]
    )
    server.initial_camera.fov = FIELD_OF_VIEW
    server.initial_camera.look_at = (float(middle[0]), float(middle[1]), float(middle[2]))
    eye = middle + 1.6 * size * way
    server.initial_camera.position = (float(eye[0]), float(eye[1]), float(eye[2]))


def add_triads(api: viser.SceneApi, mech: Mechanism) -> tuple[viser.FrameHandle, viser.FrameHandle]:
    """The axes of the base, and those of the platform under its node, which comes last."""
    size = mech.characteristic_length
    parent = f"/machine/{1 + len(mech.rod_names) + 2 * mech.n_legs}"
    frames = [
        api.add_frame(name, axes_length=0.6 * size, axes_radius=0.014 * size, origin_radius=0.028 * size)
        for name in ("/base axes", f"{parent}/axes")
    ]
    return frames[0], frames[1]


def add_labels(api: viser.SceneApi, mech: Mechanism) -> list[viser.LabelHandle]:
    """Names of the legs at their base joints, or at the ends of their rails."""
    size = mech.characteristic_length
    labels = []
    home = mech.inverse_kinematics(mech.home).lengths
    for i, leg in enumerate(mech.geometry["legs"]):
        way = DRAWINGS[mech.drives[i]].way(leg, float(home[i]))
        point = np.array(leg["base"]["point"]) if way is None else way[0]
        at = point * (1.0 + 0.25 * size / max(float(np.linalg.norm(point)), size))
        labels.append(api.add_label(f"/labels/{i}", mech.leg_names[i], position=tuple(at)))
    return labels


def add_workspace(api: viser.SceneApi, workspace: Workspace) -> viser.MeshHandle:
    """A workspace of positions of o, so that one can look through it."""
    return api.add_mesh_simple(
        "/workspace",
        workspace.vertices,
        workspace.faces,
        color=rgb(SKY),
        opacity=0.28,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
    )
