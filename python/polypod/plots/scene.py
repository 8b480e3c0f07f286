"""A mechanism at a pose as a picture in space: bodies, labels, and the view that fills the axes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray
from trimesh import Trimesh

from polypod.bodies.drawing import Clip, Placed, moved
from polypod.bodies.drives import DRAWINGS
from polypod.bodies.links import Link, leg_radii, link_frames, links_of
from polypod.bodies.palette import INK
from polypod.bodies.pieces import JOINT
from polypod.bodies.solids import four_sided, tube
from polypod.legs.joints import JOINTS
from polypod.mechanism import Mechanism
from polypod.plots.canvas import size_of
from polypod.plots.labels import Name, spread
from polypod.vectors import unit

Array = NDArray[np.float64]

LIGHT = np.array([-0.35, -0.55, 0.76])
"""Direction towards the light, base axes."""

_HALO = [withStroke(linewidth=2.2, foreground="white", alpha=0.85)]


class Label(NamedTuple):
    """A name in the picture, m, base axes."""

    text: str
    point: Array
    """(3,): what it names."""
    wanted: Array
    """(3,): where it should stand."""


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


class Faces:
    """Faces of bodies with their colours; m, base axes."""

    def __init__(self) -> None:
        self._corners: list[Array] = []
        self._normals: list[Array] = []
        self._colors: list[Array] = []

    def add(self, mesh: Trimesh, color: str, place: Array | None = None, clip: Clip | None = None) -> None:
        """The faces of a body in axes that stand at `place` (4, 4), as far as nothing hides them."""
        place = np.eye(4) if place is None else place
        corners, normals = four_sided(mesh)
        if clip is not None:
            corners, shown = clip(corners)
            corners, normals = corners[shown], normals[shown]
        self._corners.append(moved(corners, place))
        self._normals.append(normals @ place[:3, :3].T)
        self._colors.append(np.broadcast_to(to_rgb(color), (len(corners), 3)))

    def corners(self) -> Array:
        """(N, 4, 3), m."""
        return np.concatenate(self._corners)

    def seen(self, viewer: Array) -> tuple[Array, Array]:
        """Corners (k, 4, 3) and colours (k, 3) in the light of the faces that look towards a viewer.

        Red, green, blue from 0 to 1. In perspective some that look a little away are seen, too.
        """
        normals = np.concatenate(self._normals)
        front = normals @ viewer > -0.25
        towards = normals[front] @ (LIGHT / np.linalg.norm(LIGHT))
        diffuse = 0.58 + 0.42 * (0.5 + 0.5 * towards)
        gloss = 0.32 * np.clip(towards, 0.0, 1.0) ** 12
        shaded = np.concatenate(self._colors)[front] * diffuse[:, None]
        return self.corners()[front], np.clip(shaded + (1.0 - shaded) * gloss[:, None], 0.0, 1.0)


class Scene:
    """A mechanism at a pose as faces in space, and where the labels go."""

    def __init__(self, mech: Mechanism, pose: Array) -> None:
        spec = mech.geometry
        self.faces = Faces()
        self.overlay = Faces()
        """Lines and labels drawn over the bodies even where they hide them."""
        self.labels: list[Label] = []
        self.lines: list[tuple[Array, Array]] = []
        """Ends of what names should not cover, m."""
        self._size, thick = mech.characteristic_length, max(leg_radii(mech))
        self._add_links(mech, links_of(mech), link_frames(mech, pose).frames)
        vectors = mech.inverse_kinematics(pose).vectors
        platform = np.array([leg["platform"]["point"] for leg in spec["legs"]]) @ pose[:3, :3].T + pose[:3, 3]
        # A drive below the base joint moves it.
        base = platform - vectors
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
        self._triad(self.faces, np.eye(4), "O", "XYZ")
        self._triad(self.overlay, pose, "o", "xyz")

    def corners(self) -> Array:
        """(n, 3): two corners of each face, and the labels, m."""
        bodies = [faces.corners()[:, ::2].reshape(-1, 3) for faces in (self.faces, self.overlay)]
        return np.concatenate([*bodies, [label.wanted for label in self.labels]])

    def _add_links(self, mech: Mechanism, links: tuple[Link, ...], frames: Array) -> None:
        """All links; but nothing inside a barrel or a carriage: faces sorted by depth would not hide it."""
        found = [Placed(link.name, link.pieces, place) for link, place in zip(links, frames, strict=True)]
        placed = [
            bool(np.isfinite(each.frame).all()) for each in found
        ]  # a leg without length has no direction
        clips: dict[tuple[str, str], Clip] = {}
        for i, (leg, drive) in enumerate(zip(mech.geometry["legs"], mech.drives, strict=True)):
            first = 1 + len(mech.rod_names) + 2 * i
            if placed[first] and placed[first + 1]:
                clips |= DRAWINGS[drive].clips(leg, found[first], found[first + 1])
        for link, has_place in zip(found, placed, strict=True):
            for piece in link.pieces if has_place else ():
                clip = clips.get((link.name, piece.name)) or clips.get((link.name, ""))
                self.faces.add(piece.mesh, piece.color, link.frame, clip)

    def _rod_label(self, rod: dict[str, Any], points: Array, thick: float) -> None:
        axis, start = unit(rod["axis"]), np.array(rod["point"])
        along = (points - start) @ axis
        side = start + (0.7 * along.min() + 0.3 * along.max()) * axis
        above = np.array([0.0, 0.0, 2.2 * thick])
        self.labels.append(Label(f"${math_name(rod['name'])}$", side, side + above))
        self.lines.append((start + along.min() * axis, start + along.max() * axis))

    def _triad(self, faces: Faces, pose: Array, origin: str, names: str) -> None:
        size = 0.66 * self._size
        start = pose[:3, 3]
        for column, name in enumerate(names):
            tip, neck = (start + part * size * pose[:3, column] for part in (1.0, 0.78))
            faces.add(tube(start, neck, 0.018 * self._size, sides=10), INK)
            faces.add(tube(neck, tip, 0.055 * self._size, end_radius=0.0), INK)
            self.labels.append(Label(f"${name}$", tip, start + 1.17 * (tip - start)))
            self.lines.append((start, tip))
        self.labels.append(Label(f"${origin}$", start, start - 0.16 * size * pose[:3, :3].sum(axis=1)))


def draw(ax: Axes3D, scene: Scene, half: Array, zoom: float, labels: bool) -> None:
    """A scene, centred in its axes, at a scale that `half` and `zoom` set (see `frame`)."""
    ax.computed_zorder = False
    for part, zorder in ((scene.faces, 1.0), (scene.overlay, 2.0)):
        corners, shades = part.seen(np.cross(*right_and_up()))
        # Edges of the same colour close the seams; as a picture inside the SVG the many faces stay small.
        faces = Poly3DCollection(
            corners, facecolors=shades, edgecolors=shades, linewidths=0.25, rasterized=True
        )
        faces.set(zorder=zorder, clip_on=False)
        ax.add_collection3d(faces, autolim=False)
    frame(ax, scene.corners(), half, zoom)
    ax.set_axis_off()
    if labels:
        write(ax, scene.labels, scene.lines)


def write(ax: Axes3D, labels: list[Label], lines: list[tuple[Array, Array]], color: str = INK) -> None:
    """Names in framed axes, each near its wanted place, where they cover neither one another nor lines."""
    names = [Name(label.text, *_on_paper(ax, np.array([label.point, label.wanted]))) for label in labels]
    seen = _on_paper(ax, np.array(lines).reshape(-1, 3)).reshape(-1, 2, 2)
    size, (right, up) = float(mpl.rcParams["font.size"]), right_and_up()
    for label, name, place in zip(labels, names, spread(names, seen, size), strict=True):
        # From the paper back into space, in the plane through the wanted place that faces the viewer.
        step = 1e-3 * float(np.ptp(ax.get_zlim()))
        moved_by = _on_paper(ax, label.wanted + step * np.array([right, up])) - name.wanted
        across, along = np.linalg.solve(moved_by.T, place - name.wanted) * step
        at = label.wanted + across * right + along * up
        ax.text(*at, label.text, ha="center", va="center", color=color, path_effects=_HALO, zorder=10)


def frame(ax: Axes3D, corners: Array, half: Array, zoom: float | None = None) -> float:
    """Rotates the axes to the view and centres the corners in them, with the same scale along all axes.

    The limits span `half` to each side of the centre; with `zoom` that is the scale. Without it the corners
    fill the axes. Returns the zoom.
    """
    right, up = right_and_up()
    ax.set_proj_type("persp", focal_length=1.6)
    ax.view_init(elev=_ELEVATION, azim=_AZIMUTH)
    center, scale = (corners.min(axis=0) + corners.max(axis=0)) / 2, zoom or 1.0
    cell = ax.get_position(original=True).size * size_of(ax.get_figure(root=False))
    for _ in range(4):  # perspective: each step is a little off
        for i, name in enumerate("xyz"):
            getattr(ax, f"set_{name}lim")(center[i] - half[i], center[i] + half[i])
        ax.set_box_aspect(tuple(half), zoom=scale)
        seen = _seen(ax, np.vstack([corners, center, center + right]))
        middle, unit = seen[-2], float(seen[-1, 0] - seen[-2, 0])
        first, last = seen[:-2].min(axis=0), seen[:-2].max(axis=0)
        shift = (first + last) / 2 - middle
        center = center + (shift[0] * right + shift[1] * up) / unit
        # The axes are the largest square in their cell; their limits are those of the projection.
        window = np.diff(ax.transLimits.inverted().transform([(0, 0), (1, 1)]), axis=0)[0]
        if zoom is None:
            scale *= _FILL * float(np.min(window * cell / min(cell) / (last - first)))
    return scale


def right_and_up() -> tuple[Array, Array]:
    """Directions in the picture, base axes."""
    (se, ce), (sa, ca) = ((math.sin(a), math.cos(a)) for a in map(math.radians, (_ELEVATION, _AZIMUTH)))
    return np.array([-sa, ca, 0.0]), np.array([-se * ca, -se * sa, ce])


_ELEVATION, _AZIMUTH = 19.0, -62.0
_FILL = 0.86


def _on_paper(ax: Axes3D, points: Array) -> Array:
    """(n, 2): points in points of the picture."""
    ax.apply_aspect()
    seen: Array = ax.transData.transform(_seen(ax, points)) * 72.0 / ax.get_figure(root=True).dpi
    return seen


def _seen(ax: Axes3D, points: Array) -> Array:
    """(n, 2): points as the axes project them."""
    flat = np.hstack([points, np.ones((len(points), 1))]) @ ax.get_proj().T
    seen: Array = flat[:, :2] / flat[:, 3:]
    return seen


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
