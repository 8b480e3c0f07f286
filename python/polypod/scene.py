"""A mechanism at a pose as a picture in space: bodies, labels, and the view that fills the axes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray

from polypod.mechanism import Mechanism
from polypod.solids import Solids
from polypod.style import INK, PALE, color_of

Array = NDArray[np.float64]

STEEL, JOINT, BASE, PLATFORM, ROD = "#E8ECF0", "#4A4F57", "#C9CDD3", "#9CC3DF", "#8A6D3B"
_HALO = [withStroke(linewidth=2.2, foreground="white", alpha=0.85)]


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


class Scene:
    """A mechanism at a pose as solids, and where the labels go."""

    def __init__(self, mech: Mechanism, pose: Array) -> None:
        spec = mech.geometry
        self.solids = Solids()
        self.overlay = Solids()
        """What is drawn over the bodies even where they hide it."""
        self.labels: list[tuple[Array, str]] = []
        self.joint_labels: list[_JointLabel] = []
        self.kinds: dict[str, None] = {}  # joint kinds in use, in order
        self._pose, self._rotation = pose, pose[:3, :3]
        legs = mech.inverse_kinematics(pose)
        self._size = mech.characteristic_length
        base = np.array([leg["base"]["point"] for leg in spec["legs"]])
        platform = base + legs.vectors
        home_platform = base + mech.inverse_kinematics(mech.home).vectors
        stroke, home_lengths = mech.stroke, mech.inverse_kinematics(mech.home).lengths
        # Of a planar mechanism, whose joints lie in one plane, the base is below and the platform above.
        above = 1e-6 * self._size * np.array([0.0, 0.0, 1.0])
        up = _plate_normal(base, home_platform.mean(axis=0) - base.mean(axis=0) + above)
        local = np.array([leg["platform"]["point"] for leg in spec["legs"]])
        base_at_home = (base.mean(axis=0) - mech.home[:3, 3] - above) @ mech.home[:3, :3]
        down = self._rotation @ _plate_normal(local, base_at_home - local.mean(axis=0))
        radii = [leg["radius"] or 0.085 * self._size for leg in spec["legs"]]
        thick = max(radii)

        self._plate(base, up, thick, BASE)
        self._plate(platform, down, thick, PLATFORM)
        for i, rod in enumerate(spec["rods"]):
            on = [j for j, leg in enumerate(spec["legs"]) if leg["base"]["rod"] == i]
            self._rod(rod, base[on], thick)
        for i, leg in enumerate(spec["legs"]):
            shortest, name = float(stroke[i, 0]), mech.leg_names[i]
            body = 0.8 * shortest if shortest > 0 else 0.6 * float(home_lengths[i])
            self._leg(leg, base[i], platform[i], body, radii[i], color_of(i))
            rod = leg["base"]["rod"]
            lower = None if rod is None else np.cross(spec["rods"][rod]["axis"], legs.directions[i])
            self._joint(leg["base"], np.eye(3), base[i], legs.directions[i], radii[i], up, lower)
            self._joint(
                leg["platform"], self._rotation, platform[i], legs.directions[i], radii[i], down, None
            )
            for letter, points, leg_side in (("B", base, 1), ("b", platform, -1)):
                text = f"${letter}_{{{math_name(name)}}}$"
                away = points[i] - points.mean(axis=0)
                self.joint_labels.append(_JointLabel(points[i], away, leg_side, 5.2 * thick, text))
        self._triad(self.solids, np.eye(4), "O", "XYZ")
        self._triad(self.overlay, pose, "o", "xyz")

    def corners(self) -> Array:
        """(n, 3): corners of all faces, two of each, and the labels, m."""
        bodies = [s.faces()[:, ::2].reshape(-1, 3) for s in (self.solids, self.overlay)]
        return np.concatenate([*bodies, [at for at, _ in self.placed_labels()]])

    def placed_labels(self) -> list[tuple[Array, str]]:
        """All labels and where they go in the house view."""
        right, up = _right_and_up()
        return [*self.labels, *((label.place(right, up), label.text) for label in self.joint_labels)]

    def _plate(self, points: Array, normal: Array, thick: float, color: str) -> None:
        """A plate behind the joints, with a post for each of them."""
        behind = points - 2.0 * thick * normal
        self.solids.plate(behind, normal, 0.9 * thick, 2.4 * thick, color, np.cross(*_right_and_up()))
        height = float(np.min(behind @ normal))
        for point in points:
            foot = point - (float(point @ normal) - height) * normal
            self.solids.tube(foot, point, 1.1 * thick, color, end_radius=0.75 * thick)

    def _rod(self, rod: dict[str, Any], points: Array, thick: float) -> None:
        axis, start = np.array(rod["axis"]), np.array(rod["point"])
        axis = axis / np.linalg.norm(axis)
        along = (points - start) @ axis
        low, high = start + (along.min() - 3.2 * thick) * axis, start + (along.max() + 3.2 * thick) * axis
        self.solids.tube(low, high, 0.6 * thick, ROD)
        for end, inwards in ((low, 1.0), (high, -1.0)):
            self.solids.tube(end, end + 0.9 * inwards * thick * axis, 1.0 * thick, JOINT)
        side = start + (0.7 * along.min() + 0.3 * along.max()) * axis
        self.labels.append((side + np.array([0.0, 0.0, 2.2 * thick]), f"${math_name(rod['name'])}$"))

    def _leg(
        self, leg: dict[str, Any], start: Array, end: Array, body: float, radius: float, color: str
    ) -> None:
        """Cylinder and piston; a passive leg is pale."""
        length = float(np.linalg.norm(end - start))
        direction = (end - start) / length
        neck, body = min(2.4 * radius, 0.15 * length), min(body, 0.92 * length)
        at = [start + d * direction for d in (neck, body - 1.5 * radius, body)]
        self.solids.tube(start, at[0], 0.5 * radius, STEEL)
        self.solids.tube(at[0], at[1], radius, color if leg["actuated"] else PALE)
        self.solids.tube(at[1], at[2], 1.18 * radius, JOINT)
        self.solids.tube(at[2], end, 0.55 * radius, STEEL)

    def _joint(
        self,
        joint: dict[str, Any],
        rotation: Array,
        at: Array,
        direction: Array,
        radius: float,
        normal: Array,
        on_rod: Array | None,
    ) -> None:
        """`on_rod`: the direction of the axis of a revolute joint on a rod."""
        kind = joint["joint"]
        self.kinds[kind] = None
        axis = None if joint["axis"] is None else rotation @ np.array(joint["axis"])
        axis = on_rod if on_rod is not None else axis
        if kind == "S" or axis is None:
            self.solids.ball(at, 1.45 * radius, JOINT)
        elif kind == "F":
            self.solids.block(at, normal, 2.4 * radius, JOINT)
        else:
            self._pin(at, axis, 2.0 * radius, 0.75 * radius)
            if kind == "U":
                self._pin(at, np.cross(axis, direction), 2.0 * radius, 0.75 * radius)

    def _pin(self, at: Array, axis: Array, half: float, radius: float) -> None:
        step = axis * (half / np.linalg.norm(axis))
        self.solids.tube(at - step, at + step, radius, JOINT)

    def _triad(self, solids: Solids, pose: Array, origin: str, names: str) -> None:
        size = 0.66 * self._size
        start = pose[:3, 3]
        for column, name in enumerate(names):
            tip, neck = (start + part * size * pose[:3, column] for part in (1.0, 0.78))
            solids.tube(start, neck, 0.018 * self._size, INK, sides=10)
            solids.tube(neck, tip, 0.055 * self._size, INK, end_radius=0.0)
            self.labels.append((start + 1.17 * (tip - start), f"${name}$"))
        self.labels.append((start - 0.16 * size * pose[:3, :3].sum(axis=1), f"${origin}$"))


def draw(ax: Axes3D, scene: Scene, half: Array, zoom: float, labels: bool) -> None:
    """A scene, centred in its axes, at a scale that `half` and `zoom` set (see `frame`)."""
    ax.computed_zorder = False
    for solids, zorder in ((scene.solids, 1.0), (scene.overlay, 2.0)):
        shades = solids.shades()
        # Edges of the same colour close the seams; as a picture inside the SVG the many faces stay small.
        faces = Poly3DCollection(
            solids.faces(), facecolors=shades, edgecolors=shades, linewidths=0.25, rasterized=True
        )
        faces.set(zorder=zorder, clip_on=False)
        ax.add_collection3d(faces, autolim=False)
    frame(ax, scene.corners(), half, zoom)
    ax.set_axis_off()
    if labels:
        for at, text in scene.placed_labels():
            ax.text(*at, text, ha="center", va="center", fontsize=8, path_effects=_HALO, zorder=10)


def frame(ax: Axes3D, corners: Array, half: Array, zoom: float | None = None) -> float:
    """Turns the axes to the view and centres the corners in them, with the same scale along all axes.

    The limits span `half` to each side of the centre; with `zoom` that is the scale. Without it the corners
    fill the axes. Returns the zoom.
    """
    right, up = _right_and_up()
    ax.set_proj_type("persp", focal_length=1.6)
    ax.view_init(elev=_ELEVATION, azim=_AZIMUTH)
    center, scale = (corners.min(axis=0) + corners.max(axis=0)) / 2, zoom or 1.0
    cell = ax.get_position(original=True).size * ax.get_figure(root=True).get_size_inches()
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


def math_name(name: str) -> str:
    """A leg's name inside a formula; words stand upright."""
    safe = "".join(c if c.isalnum() or c in " -." else "\\_" if c == "_" else "" for c in name)
    return safe if len(safe) == 1 else rf"\mathrm{{{safe}}}".replace(" ", r"\ ")
