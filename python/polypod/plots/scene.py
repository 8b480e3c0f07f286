"""A mechanism at a pose as a picture in space: bodies, labels, and the view that fills the axes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray
from trimesh import Trimesh

from polypod.bodies.links import JOINT, Link, leg_radii, link_frames, links_of
from polypod.bodies.palette import INK
from polypod.bodies.solids import four_sided, tube
from polypod.mechanism import Mechanism
from polypod.plots.canvas import size_of
from polypod.vectors import unit

Array = NDArray[np.float64]
DrawnOut = Callable[[Array], tuple[Array, NDArray[np.bool_]]]

LIGHT = np.array([-0.35, -0.55, 0.76])
"""Direction towards the light, base axes."""

_HALO = [withStroke(linewidth=2.2, foreground="white", alpha=0.85)]


def _moved(points: Array, place: Array) -> Array:
    """Points (..., 3) in axes that stand at `place` (4, 4)."""
    return np.asarray(points @ place[:3, :3].T + place[:3, 3])


def _drawn_out(cylinder: Link, place: Array, corners: Array) -> tuple[Array, NDArray[np.bool_]]:
    """A piston's faces (k, 4, 3), in axes at `place` in the cylinder's, ended at the barrel's mouth.

    And which of them are left; of the cylinder's own faces only that.
    """
    barrel = next(piece.mesh for piece in cylinder.pieces if piece.name == "barrel")
    (_, low, _), (radius, high, _) = barrel.bounds
    at = _moved(corners, place)
    within = (np.hypot(at[..., 0], at[..., 2]) < 0.9 * radius) & (low < at[..., 1]) & (at[..., 1] <= high)
    left = ~within.all(axis=1)
    if np.array_equal(place, np.eye(4)):
        return corners, left
    at[..., 1] = np.where(within, high, at[..., 1])
    back = np.asarray(np.linalg.inv(place), np.float64)
    return _moved(at, back), left


def _bared(axis: Array, shoe: Array, corners: Array) -> tuple[Array, NDArray[np.bool_]]:
    """A rail's faces (k, 4, 3) outside the block with the corners `shoe` (m, 3); and which are left."""
    low, high = (shoe @ axis).min(), (shoe @ axis).max()
    at = corners @ axis
    within = (low < at) & (at < high)
    ends = np.where((at <= low).any(axis=1), low, high)[:, None]
    moved = corners + np.where(within, ends - at, 0.0)[..., None] * axis
    return moved, ~within.all(axis=1)


class _JointLabel(NamedTuple):
    at: Array
    away: Array
    """From the middle of the plate."""
    leg_side: int
    """+1 where the leg is above the joint, -1 where it is below."""
    distance: float
    text: str

    def place(self, right: Array, up: Array) -> Array:
        """Outwards as seen, but not on the leg, which is above or below."""
        x, y = float(self.away @ right), float(self.away @ up)
        if y * self.leg_side > 0.0:
            x, y = math.copysign(1.0, x), 0.0
        size = math.hypot(x, y) or 1.0
        return self.at + self.distance * (x * right + y * up) / size


class Faces:
    """Faces of bodies with their colours; m, base axes."""

    def __init__(self) -> None:
        self._corners: list[Array] = []
        self._normals: list[Array] = []
        self._colors: list[Array] = []

    def add(
        self, mesh: Trimesh, color: str, place: Array | None = None, drawn_out: DrawnOut | None = None
    ) -> None:
        """The faces of a body in axes that stand at `place` (4, 4), as far as they are drawn out."""
        place = np.eye(4) if place is None else place
        corners, normals = four_sided(mesh)
        if drawn_out is not None:
            corners, shown = drawn_out(corners)
            corners, normals = corners[shown], normals[shown]
        self._corners.append(_moved(corners, place))
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
        self.labels: list[tuple[Array, str]] = []
        self.joint_labels: list[_JointLabel] = []
        sides = [leg[side]["joint"] for leg in spec["legs"] for side in ("base", "platform")]
        self.kinds = dict.fromkeys(sides)  # joint kinds in use, in order
        self._rail_axes = {
            f"rail {leg['name']}": unit(leg["slider"]["axis"])
            for leg in spec["legs"]
            if leg["slider"] is not None
        }
        self._size, thick = mech.characteristic_length, max(leg_radii(mech))
        self._add_links(links_of(mech), link_frames(mech, pose).frames)
        vectors = mech.inverse_kinematics(pose).vectors
        platform = np.array([leg["platform"]["point"] for leg in spec["legs"]]) @ pose[:3, :3].T + pose[:3, 3]
        # A slider's base joint is on its carriage.
        base = platform - vectors
        for i, name in enumerate(mech.leg_names):
            below = "B" if spec["legs"][i]["slider"] is None else "Q"
            for letter, points, leg_side in ((below, base, 1), ("b", platform, -1)):
                text = f"${letter}_{{{math_name(name)}}}$"
                away = points[i] - points.mean(axis=0)
                self.joint_labels.append(_JointLabel(points[i], away, leg_side, 5.2 * thick, text))
        for i, rod in enumerate(spec["rods"]):
            on = [j for j, leg in enumerate(spec["legs"]) if leg["base"]["rod"] == i]
            self._rod_label(rod, base[on], thick)
        self._triad(self.faces, np.eye(4), "O", "XYZ")
        self._triad(self.overlay, pose, "o", "xyz")

    def corners(self) -> Array:
        """(n, 3): two corners of each face, and the labels, m."""
        bodies = [faces.corners()[:, ::2].reshape(-1, 3) for faces in (self.faces, self.overlay)]
        return np.concatenate([*bodies, [at for at, _ in self.placed_labels()]])

    def placed_labels(self) -> list[tuple[Array, str]]:
        """All labels and where they go in the house view."""
        right, up = _right_and_up()
        return [*self.labels, *((label.place(right, up), label.text) for label in self.joint_labels)]

    def _add_links(self, links: tuple[Link, ...], frames: Array) -> None:
        """All links; but nothing inside a barrel or a carriage: faces sorted by depth would not hide it."""
        shoes = {
            f"rail {link.name.removeprefix('carriage ')}": _moved(
                np.array(link.pieces[0].mesh.vertices), place
            )
            for link, place in zip(links, frames, strict=True)
            if link.kind == "carriage" and np.isfinite(place).all()
        }
        for k, (link, place) in enumerate(zip(links, frames, strict=True)):
            if not np.isfinite(place).all():
                continue  # a leg without length, which has no direction
            # A piston comes right after its cylinder.
            cylinder = {"cylinder": k, "piston": k - 1}.get(link.kind)
            drawn_out = None
            if cylinder is not None:
                within = np.eye(4) if cylinder == k else np.linalg.inv(frames[cylinder]) @ place
                drawn_out = partial(_drawn_out, links[cylinder], within)
            for piece in link.pieces:
                bared = None
                if link.kind == "base" and piece.name in shoes:
                    bared = partial(_bared, self._rail_axes[piece.name], shoes[piece.name])
                self.faces.add(piece.mesh, piece.color, place, bared or drawn_out)

    def _rod_label(self, rod: dict[str, Any], points: Array, thick: float) -> None:
        axis, start = unit(rod["axis"]), np.array(rod["point"])
        along = (points - start) @ axis
        side = start + (0.7 * along.min() + 0.3 * along.max()) * axis
        self.labels.append((side + np.array([0.0, 0.0, 2.2 * thick]), f"${math_name(rod['name'])}$"))

    def _triad(self, faces: Faces, pose: Array, origin: str, names: str) -> None:
        size = 0.66 * self._size
        start = pose[:3, 3]
        for column, name in enumerate(names):
            tip, neck = (start + part * size * pose[:3, column] for part in (1.0, 0.78))
            faces.add(tube(start, neck, 0.018 * self._size, sides=10), INK)
            faces.add(tube(neck, tip, 0.055 * self._size, end_radius=0.0), INK)
            self.labels.append((start + 1.17 * (tip - start), f"${name}$"))
        self.labels.append((start - 0.16 * size * pose[:3, :3].sum(axis=1), f"${origin}$"))


def draw(ax: Axes3D, scene: Scene, half: Array, zoom: float, labels: bool) -> None:
    """A scene, centred in its axes, at a scale that `half` and `zoom` set (see `frame`)."""
    ax.computed_zorder = False
    for part, zorder in ((scene.faces, 1.0), (scene.overlay, 2.0)):
        corners, shades = part.seen(np.cross(*_right_and_up()))
        # Edges of the same colour close the seams; as a picture inside the SVG the many faces stay small.
        faces = Poly3DCollection(
            corners, facecolors=shades, edgecolors=shades, linewidths=0.25, rasterized=True
        )
        faces.set(zorder=zorder, clip_on=False)
        ax.add_collection3d(faces, autolim=False)
    frame(ax, scene.corners(), half, zoom)
    ax.set_axis_off()
    if labels:
        for at, text in scene.placed_labels():
            ax.text(*at, text, ha="center", va="center", fontsize=8, path_effects=_HALO, zorder=10)


def frame(ax: Axes3D, corners: Array, half: Array, zoom: float | None = None) -> float:
    """Rotates the axes to the view and centres the corners in them, with the same scale along all axes.

    The limits span `half` to each side of the centre; with `zoom` that is the scale. Without it the corners
    fill the axes. Returns the zoom.
    """
    right, up = _right_and_up()
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


def _right_and_up() -> tuple[Array, Array]:
    """Directions in the picture, base axes."""
    (se, ce), (sa, ca) = ((math.sin(a), math.cos(a)) for a in map(math.radians, (_ELEVATION, _AZIMUTH)))
    return np.array([-sa, ca, 0.0]), np.array([-se * ca, -se * sa, ce])


_ELEVATION, _AZIMUTH = 19.0, -62.0
_FILL = 0.86


def _seen(ax: Axes3D, points: Array) -> Array:
    """(n, 2): points as the axes project them."""
    flat = np.hstack([points, np.ones((len(points), 1))]) @ ax.get_proj().T
    seen: Array = flat[:, :2] / flat[:, 3:]
    return seen


_JOINTS = {
    "S": ("o", 6.0, "S  spherical"),
    "U": ("P", 7.5, "U  universal"),
    "R": ("$\u25ac$", 8.0, "R  revolute"),
    "F": ("s", 5.5, "F  fixed"),
}


def joint_handles(kinds: Iterable[str]) -> list[Line2D]:
    """The legend of joints."""
    return [
        Line2D([], [], linestyle="none", color=JOINT, marker=marker, markersize=size, label=text)
        for kind, (marker, size, text) in _JOINTS.items()
        if kind in set(kinds)
    ]


def math_name(name: str) -> str:
    """A leg's name inside a formula; words stand upright."""
    safe = "".join(c if c.isalnum() or c in " -." else "\\_" if c == "_" else "" for c in name)
    return safe if len(safe) == 1 else rf"\mathrm{{{safe}}}".replace(" ", r"\ ")
