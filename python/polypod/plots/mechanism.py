"""The mechanism in space: at one pose, or at several side by side."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from numpy.typing import ArrayLike, NDArray

from polypod.errors import PolypodError, ShapeError
from polypod.mechanism import Mechanism
from polypod.plots.canvas import Canvas, Rect, cells, pyplot_figure
from polypod.plots.scene import Scene, joint_handles
from polypod.plots.style import house_style
from polypod.plots.view import draw, frame

Array = NDArray[np.float64]


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
    place = checked_pose(mech.home if pose is None else pose)
    with house_style():
        if ax is None:
            ax = pyplot_figure((5.2, 5.6)).add_subplot(projection="3d")
        if not isinstance(ax, Axes3D):
            raise PolypodError('the mechanism is drawn in space: make the axes with projection="3d"')
        scene = Scene(mech, place)
        half = np.ptp(scene.corners(), axis=0) / 2
        draw(ax, scene, half, frame(ax, scene.corners(), half), labels)
        if labels:
            handles = joint_handles(mech)
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
        grid = cells(
            figure, rows, columns, left=0.0, right=1.0, bottom=0.11, top=1.0, wspace=0.0, hspace=0.12
        )
        rects = [*itertools.chain(*grid)][: len(places)]
        side_by_side(mech, [checked_pose(pose) for pose in places], rects, captions, figure)
        figure.legend(handles=joint_handles(mech), loc="lower center", ncols=4)
    return figure


def side_by_side(
    mech: Mechanism,
    poses: Sequence[Array],
    rects: Sequence[Rect],
    captions: Sequence[str],
    figure: Canvas,
    *,
    letters: str = "",
) -> None:
    """Draws the mechanism at poses (4, 4) into cells of a figure, at one scale, with a caption below each.

    With `letters`, one for each, all have names of joints and axes; without, they are a, b, c … and the first
    alone has names.
    """
    scenes = [Scene(mech, pose) for pose in poses]
    half = np.max([np.ptp(scene.corners(), axis=0) / 2 for scene in scenes], axis=0)
    spaces = [figure.add_axes(rect, projection="3d") for rect in rects]
    zoom = min(frame(ax, scene.corners(), half) for ax, scene in zip(spaces, scenes, strict=True))
    for i, (ax, scene, caption) in enumerate(zip(spaces, scenes, captions, strict=True)):
        draw(ax, scene, half, zoom, labels=bool(letters) or i == 0)
        cell = ax.get_position(original=True)
        text = f"({letters[i] if letters else chr(97 + i)})  {caption}".rstrip()
        figure.text(cell.x0 + cell.width / 2, cell.y0, text, ha="center", va="top")


def small_picture(mech: Mechanism) -> bytes:
    """The mechanism at its centre pose as a small PNG file, for its card in a notebook."""
    figure, file = Figure(figsize=(3.2, 3.4)), io.BytesIO()
    plot_mechanism(mech, ax=figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d"), labels=False)
    with house_style():
        figure.savefig(file, format="png", dpi=120)
    return file.getvalue()


def checked_pose(pose: ArrayLike) -> Array:
    """One pose (4, 4) of finite numbers; raises ShapeError for anything else."""
    array = np.asarray(pose, dtype=np.float64)
    if array.shape != (4, 4):
        raise ShapeError(f"pose has the shape {array.shape}; a drawing needs one pose, (4, 4)")
    if not np.isfinite(array).all():
        raise ShapeError("pose holds NaN or infinity: there is nothing to draw")
    return array
