"""Figures: the mechanism in space, workspaces, the paper's Fig. 4, the topology graph of its Fig. 1b.

Each function draws on the axes or figure that it is given, or makes them with pyplot; none shows or saves.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from numpy.typing import ArrayLike, NDArray

from polypod.answers.kinematics import Mobility
from polypod.answers.status import Status, count
from polypod.errors import PolypodError, ShapeError
from polypod.mechanism import Mechanism
from polypod.plots.canvas import Canvas, cells, pyplot_figure, size_of
from polypod.plots.scene import Scene, draw, frame, joint_handles, math_name
from polypod.plots.series import Panel, draw_panel, in_kilo, stroke_of
from polypod.plots.series import plot_series as plot_series
from polypod.plots.style import BLUE, GREY, INK, house_style
from polypod.plots.workspace import plot_workspace as plot_workspace
from polypod.plots.workspace import plot_workspace_view as plot_workspace_view
from polypod.solution.solution import Solution
from polypod.summary.facts import link_kind, links_by_joints
from polypod.summary.leg_words import word_of

Array = NDArray[np.float64]


def save_figure(figure: Canvas, path: str | PathLike[str]) -> None:
    """Saves a figure as `.svg` or as `.png` with 200 dots per inch; the same figure gives the same bytes.

    Of a subfigure it saves the whole figure.

    Raises PolypodError for another suffix.
    """
    path = Path(path)
    metadata = {".svg": {"Date": None, "Creator": "Polypod"}, ".png": {"Software": "Polypod"}}.get(
        path.suffix
    )
    if metadata is None:
        raise PolypodError(f"{path} ends in {path.suffix!r}; a figure's file ends in .svg or .png")
    with house_style():
        figure.get_figure(root=True).savefig(path, metadata=metadata, dpi=200)


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
            ax = pyplot_figure((5.2, 5.6)).add_subplot(projection="3d")
        if not isinstance(ax, Axes3D):
            raise PolypodError('the mechanism is drawn in space: make the axes with projection="3d"')
        scene = Scene(mech, place)
        half = np.ptp(scene.corners(), axis=0) / 2
        draw(ax, scene, half, frame(ax, scene.corners(), half), labels)
        if labels:
            handles = joint_handles(scene.kinds)
            ax.legend(handles=handles, loc="upper left", title="Joints", alignment="left")
    return ax


def plot_poses(
    mech: Mechanism,
    poses: Mapping[str, ArrayLike] | Iterable[ArrayLike],
    figure: Canvas | None = None,
    *,
    columns: int = 4,
) -> Canvas:
    """The mechanism at several poses, side by side at one scale, as in Fig. 1 of the paper.

    Args:
        mech: the mechanism.
        poses: (4, 4) each, with their captions as keys, or without captions.
        figure: a figure or a subfigure to draw on.
        columns: in a row.
    """
    if isinstance(poses, Mapping):
        captions, places = [*poses.keys()], [*poses.values()]
    else:
        places = [*poses]
        captions = [""] * len(places)
    if not places:
        raise ShapeError("poses is empty; needs one pose (4, 4) or more")
    columns = min(columns, len(places))
    rows = -(-len(places) // columns)
    with house_style():
        figure = figure or pyplot_figure((3.2 * columns, 3.5 * rows))
        scenes = [Scene(mech, _checked_pose(pose)) for pose in places]
        half = np.max([np.ptp(scene.corners(), axis=0) / 2 for scene in scenes], axis=0)
        grid = cells(
            figure, rows, columns, left=0.0, right=1.0, bottom=0.11, top=1.0, wspace=0.0, hspace=0.12
        )
        rects = [*itertools.chain(*grid)][: len(scenes)]
        spaces = [figure.add_axes(rect, projection="3d") for rect in rects]
        views = list(zip(spaces, scenes, captions, strict=True))
        zoom = min(frame(ax, scene.corners(), half) for ax, scene, _ in views)
        for i, (ax, scene, caption) in enumerate(views):
            draw(ax, scene, half, zoom, labels=i == 0)
            cell = ax.get_position(original=True)
            text = f"({chr(97 + i)})  {caption}".rstrip()
            figure.text(cell.x0 + cell.width / 2, cell.y0, text, ha="center", va="top")
        figure.legend(handles=joint_handles(scenes[0].kinds), loc="lower center", ncols=4)
    return figure


def _checked_pose(pose: ArrayLike) -> Array:
    array = np.asarray(pose, dtype=np.float64)
    if array.shape != (4, 4):
        raise ShapeError(f"pose has the shape {array.shape}; a drawing needs one pose, (4, 4)")
    if not np.isfinite(array).all():
        raise ShapeError("pose holds NaN or infinity: there is nothing to draw")
    return array


# --- the curves of Fig. 4 -----------------------------------------------------------------------------------


_COLUMNS = 3
_COMPONENTS = "xyz"
_GREEK = {"alpha": r"$\alpha$", "beta": r"$\beta$", "gamma": r"$\gamma$"}


def plot_fig4(solution: Solution, figure: Canvas | None = None) -> Canvas:
    """The twelve panels of the paper's Fig. 4: motion of the platform (a-f), legs (g-i), forces (j-l).

    Lengths are in mm and angles in degrees, everything else is SI. Spans of time with a status other than OK
    are grey. Where a mechanism has no couple-constrained forces, panels (k) and (l) show its constraint
    multipliers or actuator power, and the smallest singular value.

    The couples in the platform joints of legs on one rod are statically indeterminate; (k) and (l) take them
    as zero.

    Args:
        solution: of `solve`, of a simulation, or from a file.
        figure: a figure or a subfigure to draw on.
    """
    data = solution.dataset
    panels = fig4_panels(data)
    with house_style():
        figure = figure or pyplot_figure((10.0, 2.55 * -(-len(panels) // _COLUMNS) + 0.3))
        time = data["time"].to_numpy()
        lost = (data["status"] != Status.OK).to_numpy()
        axes = _fig4_axes(figure, len(panels))
        for i, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
            draw_panel(ax, panel, time, lost)
            ax.text(-0.02, 1.04, f"({chr(97 + i)})", transform=ax.transAxes, ha="right", va="bottom")
        if lost.any():
            reasons = (
                f"{Status(code).name.lower().replace('_', ' ')}" for code, _, _ in count(data["status"])
            )
            figure.supxlabel(f"grey: {', '.join(reasons)}", fontsize=8)
        for below in axes[-_COLUMNS:]:
            below.set_xlabel("time $t$ / s")
            below.xaxis.set_tick_params(labelbottom=True)
    return figure


def _fig4_axes(figure: Canvas, count: int) -> list[Axes]:
    """Axes in rows that share their time; ticks without numbers."""
    width, height = size_of(figure)
    # Margins in inches: the same at any size, and much faster than a layout engine.
    margins = {
        "left": 0.68 / width,
        "right": 1 - 0.12 / width,
        "bottom": 0.55 / height,
        "top": 1 - 0.3 / height,
    }
    grid = cells(figure, -(-count // _COLUMNS), _COLUMNS, wspace=0.3, hspace=0.2, **margins)
    axes: list[Axes] = []
    for rect in [*itertools.chain(*grid)][:count]:
        axes.append(figure.add_axes(rect, sharex=axes[0] if axes else None))
        axes[-1].xaxis.set_tick_params(labelbottom=False)
    return axes


def fig4_panels(data: xr.Dataset) -> list[Panel]:
    """The panels of the paper's Fig. 4 in its order: platform, legs, forces; see `plot_fig4`."""
    legs = [math_name(str(name)) for name in data["leg"].to_numpy()]

    def six(name: str, part: int, label: str, symbol: str, unit: str, scale: float = 1.0) -> Panel:
        values = scale * data[name].to_numpy()[:, 3 * part : 3 * part + 3]
        return Panel(label, unit, values, tuple(f"${symbol}_{c}$" for c in _COMPONENTS))

    def of_legs(name: str, label: str, symbol: str, unit: str, scale: float = 1.0) -> Panel:
        curves = tuple(f"${symbol.replace('#', leg)}$" for leg in legs)
        values = scale * data[name].to_numpy()
        return Panel(label, unit, values, curves, stroke_of(data) if name == "length" else ())

    position = 1e3 * data["pose"].to_numpy()[:, :3, 3]
    length, rate, gain = _symbols(data)
    forces = of_legs("force", "active force $f_a$", "f_{a#}", "N")
    panels = [
        Panel("position of $o$", "mm", position, ("$X_o$", "$Y_o$", "$Z_o$")),
        six("twist", 0, "velocity $v$", "v", "mm s$^{-1}$", 1e3),
        six("acceleration", 0, "acceleration $a$", "a", "mm s$^{-2}$", 1e3),
        six("twist", 1, r"angular velocity $\omega$", r"\omega", "rad s$^{-1}$"),
        six("acceleration", 1, r"angular acceleration $\varepsilon$", r"\varepsilon", "rad s$^{-2}$"),
        _orientation(data),
        of_legs("length", *length, "mm", 1e3),
        of_legs("rate", *rate, "mm s$^{-1}$", 1e3),
        of_legs("leg_acceleration", *gain, "mm s$^{-2}$", 1e3),
        in_kilo(forces),
        _second_forces(data),
        _torque(data),
    ]
    return [panel for panel in panels if panel is not None]


def _symbols(data: xr.Dataset) -> tuple[tuple[str, str], tuple[str, str], tuple[str, str]]:
    """Label and symbol of what the prismatic joints have, of its rate and of its second rate."""
    word = word_of(data)
    if word == "length":
        return (
            ("leg length $r$", "r_{#}"),
            ("leg rate $v_r$", "v_{r#}"),
            ("leg acceleration $a_r$", "a_{r#}"),
        )
    return (
        (f"{word} $q$", "q_{#}"),
        ("its rate $q'$", "q'_{#}"),
        ("its second rate $q''$", "q''_{#}"),
    )


def _orientation(data: xr.Dataset) -> Panel | None:
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
        return Panel("tool axis", "", values, curves)
    return Panel("angle", "deg", np.degrees(values), curves)


def _subscripted(name: str) -> str:
    """A coordinate such as rx or axis_x as a formula."""
    stem, index = name.rstrip("xyz").rstrip("_"), name[-1]
    return f"${stem}$" if name[-1] not in "xyz" else f"${math_name(stem)}_{index}$"


def _second_forces(data: xr.Dataset) -> Panel:
    """Couple-constrained forces, else constraint multipliers, else what the actuators give."""
    if "coupled_force" in data:
        curves = tuple(f"$f_{{c{math_name(str(leg))}}}$" for leg in data["coupled_leg"].to_numpy())
        return in_kilo(Panel("coupled force $f_c$", "N", data["coupled_force"].to_numpy(), curves))
    if "constraint" in data:
        values = data["constraint"].to_numpy()
        curves = tuple(f"$f_{{c,{i + 1}}}$" for i in range(values.shape[1]))
        # Kind A-E stands first; D keeps the angle between two directions, all others a length [T9].
        kinds = [str(row)[0] for row in data["constraint_row"].to_numpy()]
        units = {"N m" if kind == "D" else "N" for kind in kinds}
        return Panel("constraint $f_c$", " or ".join(sorted(units)), values, curves)
    return in_kilo(Panel("actuator power", "W", data["actuator_power"].to_numpy()[:, None], ("$P$",)))


def _torque(data: xr.Dataset) -> Panel:
    """The couple-constrained torque, else the distance from a singularity."""
    if "coupled_torque" in data:
        values = data["coupled_torque"].to_numpy()[:, None]
        return in_kilo(Panel("coupled torque $T_c$", "N m", values, ("$T_c$",)))
    values = data["sigma_min"].to_numpy()[:, None]
    return Panel("smallest singular value", "", values, (r"$\sigma_\mathrm{min}$",))


# --- the topology graph of Fig. 1b --------------------------------------------------------------------------

_HUBS = (0, 1)  # base and platform come first among the links


def plot_topology(mobility: Mobility, ax: Axes | None = None) -> Axes:
    """The topology graph: links by their number of joints, base at the bottom, joints on the lines between.

    As the paper's Fig. 1b, with the links as they are: 13 for its manipulator.
    """
    place, order = _topology_places(mobility)
    width = len(order)
    with house_style():
        if ax is None:
            ax = pyplot_figure((1.15 * width + 1.2, 4.4), layout="constrained").add_subplot()
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
    neighbours: defaultdict[int, set[int]] = defaultdict(set)
    for joint in mobility.graph_joints:
        for a, b in (joint.links, joint.links[::-1]):
            neighbours[a].add(b)

    def links_of(slide: tuple[int, int]) -> tuple[int, int]:
        """Cylinder and piston, or carriage and strut: the carriage slides on the base."""
        carriage = slide[1]
        if not mobility.graph_links[carriage].name.startswith("carriage "):
            return slide
        return carriage, next(link for link in neighbours[carriage] if link not in _HUBS)

    sliders = [links_of(joint.links) for joint in mobility.graph_joints if joint.kind == "P"]
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
    text = f"{name}  ({link_kind(joints)})" if wide else name.replace(" ", "\n", len(name) > 14)
    ax.text(x, y, text, ha="center", va="center_baseline", fontsize=8 if wide else 7, zorder=4)
