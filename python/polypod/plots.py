"""Figures: the mechanism in space, the curves of the paper's Fig. 4, the topology graph of its Fig. 1b.

Each function draws on the axes or figure that it is given, or makes them with pyplot, and never shows or saves.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import ArrayLike, NDArray

from polypod.errors import PolypodError, ShapeError
from polypod.mechanism import Mechanism, Mobility
from polypod.results import Solution
from polypod.solids import Solids
from polypod.status import Status, count
from polypod.style import BLUE, GREY, INK, PALE, color_of, dash_of, house_style

Array = NDArray[np.float64]

STEEL, JOINT, BASE, PLATFORM, ROD = "#E8ECF0", "#4A4F57", "#C9CDD3", "#9CC3DF", "#8A6D3B"
_HALO = [withStroke(linewidth=2.2, foreground="white", alpha=0.85)]


def save_figure(figure: Figure, path: str | PathLike[str]) -> None:
    """Saves a figure as `.svg` or as `.png` with 200 dots per inch; the same figure gives the same bytes.

    Raises PolypodError for another suffix.
    """
    path = Path(path)
    metadata = {".svg": {"Date": None, "Creator": "Polypod"}, ".png": {"Software": "Polypod"}}.get(path.suffix)
    if metadata is None:
        raise PolypodError(f"{path} ends in {path.suffix!r}; a figure's file ends in .svg or .png")
    with house_style():
        figure.savefig(path, metadata=metadata, dpi=200)


# --- the mechanism in space ---------------------------------------------------------------------------------


def plot_mechanism(
    mech: Mechanism, pose: ArrayLike | None = None, ax: Axes3D | None = None, *, labels: bool = True
) -> Axes3D:
    """The mechanism at a pose, true to scale: plates, rods, cylinders, pistons, joints by kind, both frames.

    Joints are drawn as what they are: S a ball, U a cross of two pins, R a pin, F a cube. The drawing's sizes
    other than lengths between joints are free where the file gives no radius or stroke.

    Args:
        mech: the mechanism.
        pose: (4, 4); the centre pose by default.
        ax: axes with `projection="3d"`.
        labels: names of joints and frames, and the legend of joints.
    """
    place = _checked_pose(mech.home if pose is None else pose)
    with house_style():
        if ax is None:
            ax = _pyplot_figure((5.2, 5.6)).add_subplot(projection="3d")
        if not isinstance(ax, Axes3D):
            raise PolypodError('the mechanism is drawn in space: make the axes with projection="3d"')
        scene = _Scene(mech, place)
        _draw(ax, scene, scene.corners(), labels)
        if labels:
            _joint_legend(ax, scene.kinds)
    return ax


def plot_poses(
    mech: Mechanism,
    poses: Mapping[str, ArrayLike] | Iterable[ArrayLike],
    figure: Figure | None = None,
    *,
    columns: int = 4,
) -> Figure:
    """The mechanism at several poses, side by side at one scale, as in Fig. 1 of the paper.

    Args:
        mech: the mechanism.
        poses: (4, 4) each, with their captions as keys, or without captions.
        figure: to draw on.
        columns: in a row.
    """
    given = poses if isinstance(poses, Mapping) else dict.fromkeys(())
    named = dict(given) if given else {str(i): pose for i, pose in enumerate(poses)}  # type: ignore[arg-type]
    captions = list(named) if given else [""] * len(named)
    if not named:
        raise ShapeError("poses is empty; needs one pose (4, 4) or more")
    columns = min(columns, len(named))
    rows = -(-len(named) // columns)
    with house_style():
        figure = figure or _pyplot_figure((3.1 * columns, 3.9 * rows))
        scenes = [_Scene(mech, _checked_pose(pose)) for pose in named.values()]
        corners = np.concatenate([scene.corners() for scene in scenes])
        for i, (scene, caption) in enumerate(zip(scenes, captions, strict=True)):
            ax = figure.add_subplot(rows, columns, i + 1, projection="3d")
            _draw(ax, scene, corners, labels=i == 0)
            ax.set_title(f"({chr(97 + i)})  {caption}".rstrip(), y=-0.06, loc="center")
        figure.subplots_adjust(0.0, 0.06, 1.0, 1.0, wspace=0.0, hspace=0.1)
        _joint_legend(figure.axes[0], scenes[0].kinds)
    return figure


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
        if y * self.leg_side > 0.0 or abs(x) > abs(y):
            x, y = math.copysign(1.0, x), 0.0
        size = math.hypot(x, y) or 1.0
        return self.at + self.distance * (x * right + y * up) / size


class _Scene:
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
        up = _plate_normal(base, home_platform.mean(axis=0) - base.mean(axis=0))
        local = np.array([leg["platform"]["point"] for leg in spec["legs"]])
        base_at_home = (base.mean(axis=0) - mech.home[:3, 3]) @ mech.home[:3, :3]
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
            self._joint(leg["platform"], self._rotation, platform[i], legs.directions[i], radii[i], down, None)
            for letter, points, leg_side in (("B", base, 1), ("b", platform, -1)):
                text = f"${letter}_{{{_math(name)}}}$"
                away = points[i] - points.mean(axis=0)
                self.joint_labels.append(_JointLabel(points[i], away, leg_side, 4.6 * thick, text))
        self._triad(self.solids, np.eye(4), "O", "XYZ")
        self._triad(self.overlay, pose, "o", "xyz")

    def corners(self) -> Array:
        """(n, 3): all corners of all bodies, m."""
        return np.concatenate([s.faces().reshape(-1, 3) for s in (self.solids, self.overlay)])

    def _plate(self, points: Array, normal: Array, thick: float, color: str) -> None:
        """A plate behind the joints, with a post for each of them."""
        behind = points - 2.0 * thick * normal
        self.solids.plate(behind, normal, 0.9 * thick, 2.4 * thick, color)
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
        self.labels.append((side + np.array([0.0, 0.0, 2.2 * thick]), f"${_math(rod['name'])}$"))

    def _leg(self, leg: dict[str, Any], start: Array, end: Array, body: float, radius: float, color: str) -> None:
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


def _draw(ax: Axes3D, scene: _Scene, corners: Array, labels: bool) -> None:
    """A scene in a frame that shows all `corners`."""
    ax.computed_zorder = False
    for solids, zorder in ((scene.solids, 1.0), (scene.overlay, 2.0)):
        shades = solids.shades()
        # Edges of the same colour close the seams; as a picture inside the SVG the many faces stay small.
        faces = Poly3DCollection(
            solids.faces(), facecolors=shades, edgecolors=shades, linewidths=0.25, rasterized=True
        )
        faces.set(zorder=zorder, clip_on=False)
        ax.add_collection3d(faces, autolim=False)
    right, up = _frame(ax, corners)
    ax.set_axis_off()
    if labels:
        places = [*scene.labels, *((label.place(right, up), label.text) for label in scene.joint_labels)]
        for at, text in places:
            ax.text(*at, text, ha="center", va="center", fontsize=8.5, path_effects=_HALO, zorder=10)


def _frame(ax: Axes3D, corners: Array) -> tuple[Array, Array]:
    """The view, the same scale along all axes, and limits that fill the axes with the corners.

    Returns the directions that are to the right and up in the picture.
    """
    elevation, azimuth = math.radians(_ELEVATION), math.radians(_AZIMUTH)
    (se, ce), (sa, ca) = ((math.sin(a), math.cos(a)) for a in (elevation, azimuth))
    right, up = np.array([-sa, ca, 0.0]), np.array([-se * ca, -se * sa, ce])
    ax.set_proj_type("persp", focal_length=1.6)
    ax.view_init(elev=_ELEVATION, azim=_AZIMUTH)
    low, high = corners.min(axis=0), corners.max(axis=0)
    half, center, zoom = (high - low) / 2, (high + low) / 2, 1.0
    cell = ax.get_position(original=True).size * ax.get_figure(root=True).get_size_inches()
    for _ in range(4):  # perspective: each step is a little off
        for i, name in enumerate("xyz"):
            getattr(ax, f"set_{name}lim")(center[i] - half[i], center[i] + half[i])
        ax.set_box_aspect(tuple(half), zoom=zoom)
        seen = _seen(ax, np.vstack([corners, center, center + right]))
        middle, unit = seen[-2], float(seen[-1, 0] - seen[-2, 0])
        first, last = seen[:-2].min(axis=0), seen[:-2].max(axis=0)
        shift = (first + last) / 2 - middle
        center = center + (shift[0] * right + shift[1] * up) / unit
        # The axes are the largest square in their cell; their limits are those of the projection.
        window = np.diff(ax.transLimits.inverted().transform([(0, 0), (1, 1)]), axis=0)[0]
        zoom *= _FILL * float(np.min(window * cell / min(cell) / (last - first)))
    return right, up


_ELEVATION, _AZIMUTH = 17.0, -68.0
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


def _joint_legend(ax: Axes, kinds: Iterable[str]) -> None:
    handles = [
        Line2D([], [], linestyle="none", color=JOINT, marker=marker, markersize=size, label=text)
        for kind, (marker, size, text) in _JOINTS.items()
        if kind in set(kinds)
    ]
    ax.legend(handles=handles, loc="upper left", handlelength=1.0, title="Joints", alignment="left")


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
    return normal if normal @ towards >= 0 else -normal


def _checked_pose(pose: ArrayLike) -> Array:
    array = np.asarray(pose, dtype=np.float64)
    if array.shape != (4, 4):
        raise ShapeError(f"pose has the shape {array.shape}; a drawing needs one pose, (4, 4)")
    if not np.isfinite(array).all():
        raise ShapeError("pose holds NaN or infinity: there is nothing to draw")
    return array


def _math(name: str) -> str:
    """A leg's name inside a formula; words stand upright."""
    safe = "".join(c if c.isalnum() or c in " -." else "\\_" if c == "_" else "" for c in name)
    return safe if len(safe) == 1 else rf"\mathrm{{{safe}}}".replace(" ", r"\ ")


def _pyplot_figure(size: tuple[float, float], **more: Any) -> Figure:
    # Here, so that those who bring their own figure need no screen and no pyplot.
    from matplotlib import pyplot

    return pyplot.figure(figsize=size, **more)


# --- the curves of Fig. 4 -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Panel:
    """Curves over time in one unit, as they are drawn."""

    label: str
    unit: str
    values: Array
    """(time, curve)."""
    curves: tuple[str, ...]
    limits: tuple[float, ...] = ()
    """Levels to mark."""


_COMPONENTS = "xyz"
_GREEK = {"alpha": r"$\alpha$", "beta": r"$\beta$", "gamma": r"$\gamma$"}


def plot_fig4(solution: Solution, figure: Figure | None = None) -> Figure:
    """The twelve panels of the paper's Fig. 4: motion of the platform (a-f), legs (g-i), forces (j-l).

    Lengths are in mm and angles in degrees, everything else is SI. Spans of time with a status other than OK
    are grey. Where a mechanism has no couple-constrained forces, panels (k) and (l) show its constraint multipliers
    or actuator power, and the smallest singular value.
    """
    data = solution.dataset
    panels = [panel for panel in _panels(data) if panel is not None]
    columns = 3
    rows = -(-len(panels) // columns)
    with house_style():
        figure = figure or _pyplot_figure((10.0, 2.55 * rows + 0.3))
        figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.05, wspace=0.02, hspace=0.02)
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
        time = data["time"].to_numpy()
        lost = (data["status"] != Status.OK).to_numpy()
        for i, (ax, panel) in enumerate(zip(grid.flat, panels, strict=False)):
            _draw_panel(ax, panel, time, lost)
            ax.text(-0.02, 1.04, f"({chr(97 + i)})", transform=ax.transAxes, ha="right", va="bottom")
        if lost.any():
            reasons = (f"{Status(code).name.lower().replace('_', ' ')}" for code, _, _ in count(data["status"]))
            figure.supxlabel(f"grey: {', '.join(reasons)}", fontsize=8)
        for ax in grid.flat[len(panels) :]:
            ax.remove()
        for column in range(columns):
            below = [ax for ax in grid[:, column] if ax.figure is not None]
            below[-1].set_xlabel("time $t$ / s")
            below[-1].xaxis.set_tick_params(labelbottom=True)
    return figure


def _draw_panel(ax: Axes, panel: _Panel, time: Array, lost: NDArray[np.bool_]) -> None:
    for i, curve in enumerate(panel.curves):
        ax.plot(time, panel.values[:, i], color=color_of(i), linestyle=dash_of(i), label=curve)
    for level in panel.limits:
        ax.axhline(level, color=GREY, linewidth=0.7, linestyle=(0, (4, 3)))
    for first, last in _spans(lost):
        ax.axvspan(time[max(first - 1, 0)], time[min(last + 1, len(time) - 1)], color=PALE, zorder=0)
    ax.set_ylabel(f"{panel.label} / {panel.unit}" if panel.unit else panel.label)
    ax.margins(y=0.08)
    finite = panel.values[np.isfinite(panel.values)]
    if finite.size == 0 or np.ptp(finite) == 0.0:
        ax.margins(y=0.5)
    ax.ticklabel_format(axis="y", style="sci", scilimits=(-3, 5), useMathText=True)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=max(len(panel.curves), 1))


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def _panels(data: xr.Dataset) -> list[_Panel | None]:
    legs = [_math(str(name)) for name in data["leg"].to_numpy()]

    def six(name: str, part: int, label: str, symbol: str, unit: str, scale: float = 1.0) -> _Panel:
        values = scale * data[name].to_numpy()[:, 3 * part : 3 * part + 3]
        return _Panel(label, unit, values, tuple(f"${symbol}_{c}$" for c in _COMPONENTS))

    def of_legs(name: str, label: str, symbol: str, unit: str, scale: float = 1.0) -> _Panel:
        curves = tuple(f"${symbol.replace('#', leg)}$" for leg in legs)
        values = scale * data[name].to_numpy()
        return _Panel(label, unit, values, curves, _stroke(data) if name == "length" else ())

    position = 1e3 * data["pose"].to_numpy()[:, :3, 3]
    forces = of_legs("force", "active force $f_a$", "f_{a#}", "N")
    return [
        _Panel("position of $o$", "mm", position, ("$X_o$", "$Y_o$", "$Z_o$")),
        six("twist", 0, "velocity $v$", "v", "mm s$^{-1}$", 1e3),
        six("acceleration", 0, "acceleration $a$", "a", "mm s$^{-2}$", 1e3),
        six("twist", 1, r"angular velocity $\omega$", r"\omega", "rad s$^{-1}$"),
        six("acceleration", 1, r"angular acceleration $\varepsilon$", r"\varepsilon", "rad s$^{-2}$"),
        _orientation(data),
        of_legs("length", "leg length $r$", "r_{#}", "mm", 1e3),
        of_legs("rate", "leg rate $v_r$", "v_{r#}", "mm s$^{-1}$", 1e3),
        of_legs("leg_acceleration", "leg acceleration $a_r$", "a_{r#}", "mm s$^{-2}$", 1e3),
        _in_kilo(forces),
        _second_forces(data),
        _torque(data),
    ]


def _stroke(data: xr.Dataset) -> tuple[float, ...]:
    """Stroke limits in mm, where all legs have the same and the solution tells its mechanism."""
    text = data.attrs.get("mechanism_file")
    if not text:
        return ()
    limits = np.unique(Mechanism.from_toml(text).stroke, axis=0)
    return tuple(1e3 * limits[0]) if len(limits) == 1 and np.isfinite(limits).all() else ()


def _orientation(data: xr.Dataset) -> _Panel | None:
    """The angles among the motion's coordinates, or without any the direction that it has in their place."""
    names = [str(n) for n in data if str(n).startswith("coordinate_") and "rate_" not in str(n)]
    angles = [n for n in names if data[n].attrs["units"] == "rad"]
    pure = [n for n in names if data[n].attrs["units"] == "1"]
    chosen = pure or angles
    if not chosen:
        return None
    values = np.stack([data[n].to_numpy() for n in chosen], axis=-1)
    shorts = [n.removeprefix("coordinate_") for n in chosen]
    curves = tuple(_GREEK.get(s) or _subscripted(s) for s in shorts)
    if pure:
        return _Panel("tool axis", "", values, curves)
    return _Panel("angle", "deg", np.degrees(values), curves)


def _subscripted(name: str) -> str:
    """A coordinate such as rx or axis_x as a formula."""
    stem, index = name.rstrip("xyz").rstrip("_"), name[-1]
    return f"${stem}$" if name[-1] not in "xyz" else f"${_math(stem)}_{index}$"


def _second_forces(data: xr.Dataset) -> _Panel:
    """Couple-constrained forces, else constraint multipliers, else what the actuators give."""
    if "coupled_force" in data:
        curves = tuple(f"$f_{{c{_math(str(leg))}}}$" for leg in data["coupled_leg"].to_numpy())
        return _in_kilo(_Panel("coupled force $f_c$", "N", data["coupled_force"].to_numpy(), curves))
    if "constraint" in data:
        values = data["constraint"].to_numpy()
        curves = tuple(f"$f_{{c,{i + 1}}}$" for i in range(values.shape[1]))
        unit = data["constraint"].attrs["units"].replace("N or N m", "N or N m")
        return _Panel("constraint $f_c$", unit, values, curves)
    return _in_kilo(_Panel("actuator power", "W", data["actuator_power"].to_numpy()[:, None], ("$P$",)))


def _torque(data: xr.Dataset) -> _Panel:
    """The couple-constrained torque, else the distance from a singularity."""
    if "coupled_torque" in data:
        values = data["coupled_torque"].to_numpy()[:, None]
        return _in_kilo(_Panel("coupled torque $T_c$", "N m", values, ("$T_c$",)))
    values = data["sigma_min"].to_numpy()[:, None]
    return _Panel("smallest singular value", "", values, (r"$\sigma_\mathrm{min}$",))


def _in_kilo(panel: _Panel) -> _Panel:
    """Numbers of five digits and more in thousands."""
    finite = panel.values[np.isfinite(panel.values)]
    if not np.max(np.abs(finite), initial=0.0) >= 1e4:
        return panel
    return _Panel(panel.label, f"k{panel.unit}", panel.values / 1e3, panel.curves)


# --- the topology graph of Fig. 1b --------------------------------------------------------------------------

_BY_JOINTS = {
    1: "singular",
    2: "binary",
    3: "ternary",
    4: "quaternary",
    5: "pentagonal",
    6: "hexagonal",
    7: "heptagonal",
    8: "octagonal",
}
_HUBS = (0, 1)  # base and platform come first among the links


def link_kind(joints: int) -> str:
    """The name of a link by its number of joints: binary, ternary, ..."""
    return _BY_JOINTS.get(joints, f"{joints}-joint")


def links_by_joints(mobility: Mobility) -> dict[str, tuple[str, ...]]:
    """Names of the links, grouped by the kind of `link_kind`, those with most joints first."""
    groups: defaultdict[int, list[str]] = defaultdict(list)
    for link in mobility.graph_links:
        groups[len(link.joints)].append(link.name)
    return {link_kind(n): tuple(groups[n]) for n in sorted(groups, reverse=True)}


def plot_topology(mobility: Mobility, ax: Axes | None = None) -> Axes:
    """The topology graph: links by their number of joints, base at the bottom, joints on the lines between.

    As the paper's Fig. 1b, with the links as they are: 13 for its manipulator.
    """
    place, order = _topology_places(mobility)
    width = len(order)
    with house_style():
        if ax is None:
            ax = _pyplot_figure((1.15 * width + 1.2, 4.4), layout="constrained").add_subplot()
        for joint in mobility.graph_joints:
            x, (low, high) = _joint_column(joint.links, place), sorted(place[i][1] for i in joint.links)
            ax.plot([x, x], [low, high], color=GREY, linewidth=1.0, zorder=1)
            middle = (low + high) / 2
            ax.plot(x, middle, "o", color="white", markeredgecolor=GREY, markeredgewidth=0.8, markersize=12)
            ax.text(x, middle, joint.kind, ha="center", va="center_baseline", fontsize=8)
        for i, link in enumerate(mobility.graph_links):
            _draw_link(ax, link.name, len(link.joints), *place[i], hub=i in _HUBS)
        ax.set(xlim=(-0.62, width - 0.38), ylim=(-0.45, 4.75))
        ax.set_axis_off()
        counts = ", ".join(f"{len(names)} {kind}" for kind, names in links_by_joints(mobility).items())
        text = f"{mobility.links} links: {counts}  ·  {mobility.joints} joints"
        ax.set_title(text, loc="center", fontsize=8)
    return ax


def _topology_places(mobility: Mobility) -> tuple[dict[int, tuple[float, float, float]], list[int]]:
    """Middle (x, y) and half width of each link, and the order of the legs from left to right.

    Every leg has one prismatic joint and is a column; legs on one rod stand side by side.
    """
    sliders = [joint.links for joint in mobility.graph_joints if joint.kind == "P"]
    neighbours: defaultdict[int, set[int]] = defaultdict(set)
    for joint in mobility.graph_joints:
        for a, b in (joint.links, joint.links[::-1]):
            neighbours[a].add(b)
    ends = {end for slider in sliders for end in slider} | {*_HUBS}
    rods = [i for i in range(mobility.links) if i not in ends]

    def rod_of(leg: int) -> int | None:
        return next((rod for rod in rods if rod in neighbours[sliders[leg][0]]), None)

    def group(leg: int) -> int:
        """The first leg on the same rod."""
        rod = rod_of(leg)
        return leg if rod is None else min(other for other in range(len(sliders)) if rod_of(other) == rod)

    order = sorted(range(len(sliders)), key=lambda leg: (group(leg), leg))
    place: dict[int, tuple[float, float, float]] = {}
    for column, leg in enumerate(order):
        for link, height in zip(sliders[leg], (2.15, 3.2), strict=True):
            place[link] = (column, height, 0.36)
    for rod in rods:
        columns = [column for column, leg in enumerate(order) if rod_of(leg) == rod] or [0]
        half = (columns[-1] - columns[0]) / 2
        place[rod] = (columns[0] + half, 1.05, half + 0.36)
    half = (len(order) - 1) / 2
    for hub, height in zip(_HUBS, (0.0, 4.3), strict=True):
        place[hub] = (half, height, half + 0.42)
    return place, order


def _joint_column(links: tuple[int, int], place: dict[int, tuple[float, float, float]]) -> float:
    """The x of a joint: that of the narrower of its links."""
    return min((place[i] for i in links), key=lambda p: p[2])[0]


def _draw_link(ax: Axes, name: str, joints: int, x: float, y: float, half: float, *, hub: bool) -> None:
    wide = joints > 2 or hub
    face = {True: "#DCEAF4", False: "white"}[wide]
    box = FancyBboxPatch(
        (x - half, y - 0.2),
        2 * half,
        0.4,
        boxstyle="round,pad=0,rounding_size=0.12",
        facecolor=face,
        edgecolor=BLUE if wide else INK,
        linewidth=1.2 if wide else 0.8,
        zorder=3,
    )
    ax.add_patch(box)
    text = f"{name}  ({link_kind(joints)})" if wide else name
    ax.text(x, y, text, ha="center", va="center_baseline", fontsize=8 if wide else 7, zorder=4)
