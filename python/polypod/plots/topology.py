"""The topology graph of the paper's Fig. 1b."""

from __future__ import annotations

from collections import defaultdict

from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from polypod.answers.mobility import Mobility
from polypod.bodies.palette import BLUE, GREY, INK
from polypod.legs.drives import DRIVES
from polypod.plots.canvas import pyplot_figure
from polypod.plots.style import house_style
from polypod.summary.mechanism_facts import link_kind, links_by_joints

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

    Every leg has one drive and is a column; legs on one rod stand side by side.
    """
    neighbours: defaultdict[int, set[int]] = defaultdict(set)
    for joint in mobility.graph_joints:
        for a, b in (joint.links, joint.links[::-1]):
            neighbours[a].add(b)

    def links_of(slide: tuple[int, int]) -> tuple[int, int]:
        """The two links of a leg: between them is its drive, or it moves the first on the base."""
        first = slide[1]
        if mobility.graph_links[first].name.split()[0] not in carriers:
            return slide
        return first, next(link for link in neighbours[first] if link not in _HUBS)

    driven = {drive.joint for drive in DRIVES}
    carriers = {drive.links[0] for drive in DRIVES if drive.moves_foot}
    columns = [links_of(joint.links) for joint in mobility.graph_joints if joint.name.split()[0] in driven]
    ends = {end for links in columns for end in links} | {*_HUBS}
    rods = [i for i in range(mobility.links) if i not in ends]

    def rod_of(leg: int) -> int | None:
        return next((rod for rod in rods if rod in neighbours[columns[leg][0]]), None)

    def group(leg: int) -> int:
        """The first leg on the same rod."""
        rod = rod_of(leg)
        return leg if rod is None else min(other for other in range(len(columns)) if rod_of(other) == rod)

    order = sorted(range(len(columns)), key=lambda leg: (group(leg), leg))
    place: dict[int, tuple[float, float, float]] = {}
    for column, leg in enumerate(order):
        for link, height in zip(columns[leg], (2.15, 3.2), strict=True):
            place[link] = (column, height, 0.36)
    for rod in rods:
        on = [column for column, leg in enumerate(order) if rod_of(leg) == rod] or [0]
        half = (on[-1] - on[0]) / 2
        place[rod] = (on[0] + half, 1.05, half + 0.36)
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
