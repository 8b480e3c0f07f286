"""The paper's Fig. 1: a mechanism with its axes, its topology graph, and other poses."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike

from polypod.errors import ShapeError
from polypod.mechanism import Mechanism
from polypod.plots.canvas import Canvas, cells, pyplot_figure, size_of
from polypod.plots.mechanism import checked_pose, side_by_side
from polypod.plots.scene import joint_handles
from polypod.plots.style import house_style
from polypod.plots.topology import plot_topology

_LETTERS = "abcdefghijklmnopqrstuvwxyz"


def plot_fig1(mech: Mechanism, poses: Mapping[str, ArrayLike], figure: Canvas | None = None) -> Canvas:
    """The mechanism at its centre pose (a), its topology graph (b), and other poses from (c) on.

    As in Fig. 1 of the paper, which shows two positions far from Z and a large orientation. All drawings of
    the mechanism have one scale, and all their joints and axes have names.

    Args:
        mech: the mechanism.
        poses: (4, 4) each, with their captions as keys; 1 to 24 of them, three in a row.
        figure: a figure or a subfigure to draw on.

    Raises ShapeError for no pose, too many, and for one that is no (4, 4) of finite numbers.
    """
    if not 1 <= len(poses) <= len(_LETTERS) - 2:
        raise ShapeError(f"poses has {len(poses)} poses; needs 1 to {len(_LETTERS) - 2}")
    places = {caption: checked_pose(pose) for caption, pose in poses.items()}
    columns = min(len(poses), 3)
    rows = -(-len(poses) // columns)
    with house_style():
        figure = figure or pyplot_figure((10.0, 4.3 + 3.9 * rows))
        height = size_of(figure)[1]
        below = {"bottom": 0.55 / height, "top": 1.0 - 4.35 / height, "hspace": 0.1, "wspace": 0.0}
        lower = cells(figure, rows, columns, left=0.0, right=1.0, **below)
        upper = {"bottom": 1.0 - 4.1 / height, "top": 1.0}
        [[model, _]] = cells(figure, 1, 2, left=0.0, right=1.0, width_ratios=[0.42, 0.58], **upper)
        rects = [model, *(cell for row in lower for cell in row)][: 1 + len(places)]
        captions = ["model and axes", *places]
        letters = "a" + _LETTERS[2 : 2 + len(places)]
        side_by_side(mech, [mech.home, *places.values()], rects, captions, figure, letters=letters)
        graph = figure.add_axes((0.44, 1.0 - 3.95 / height, 0.55, 3.7 / height))
        plot_topology(mech.mobility(), graph)
        figure.text(0.715, model[1], "(b)  topology graph", ha="center", va="top")
        figure.legend(handles=joint_handles(mech), loc="lower center", ncols=4)
    return figure
