"""Drawing a picture in space: the view that all pictures have, arrows, and names that make room."""

from __future__ import annotations

import math
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray

from polypod.bodies.palette import GREY, INK
from polypod.plots.canvas import size_of
from polypod.plots.labels import Name, spread
from polypod.plots.picture import Label, Picture, Vector

Array = NDArray[np.float64]

_HALO = [withStroke(linewidth=2.2, foreground="white", alpha=0.85)]

_QUARTERS = Path.make_compound_path(Path.wedge(0.0, 90.0), Path.wedge(180.0, 270.0))
"""The dark quarters of the sign for a mass centre."""

_SECOND_HEAD = 0.84
"""Where the second head of a rotation or torque ends, as a part of its arrow."""


def draw(ax: Axes3D, scene: Picture, half: Array, zoom: float, labels: bool) -> None:
    """A scene, centred in its axes, at a scale that `half` and `zoom` set (see `frame`)."""
    ax.computed_zorder = False
    for part, zorder in ((scene.faces, 1.0), (scene.overlay, 2.0)):
        if not len(part.corners()):
            continue
        corners, shades = part.seen(np.cross(*right_and_up()))
        # Edges of the same colour close the seams; as a picture inside the SVG the many faces stay small.
        faces = Poly3DCollection(
            corners, facecolors=shades, edgecolors=shades, linewidths=0.25, rasterized=True
        )
        faces.set(zorder=zorder, clip_on=False)
        ax.add_collection3d(faces, autolim=False)
    for ends in scene.axes:
        ax.plot(*np.transpose(ends), color=GREY, linewidth=0.7, linestyle=(0, (9, 2, 1.5, 2)), zorder=3)
    for point in scene.mass_centres:
        for marker, color in (("o", "white"), (_QUARTERS, INK)):
            style: Any = {"linestyle": "none", "markersize": 7.0, "markeredgewidth": 0.7, "zorder": 6}
            ax.plot(*point[:, None], marker=marker, color=color, markeredgecolor=INK, **style)
    for vector in scene.vectors:
        ax.add_artist(Arrow(vector))
        if vector.double:
            ax.add_artist(Arrow(vector, _SECOND_HEAD))
    frame(ax, scene.corners(), half, zoom)
    ax.set_axis_off()
    if labels:
        write(ax, scene.labels, np.array([*scene.lines, *(vector.ends for vector in scene.vectors)]))


def write(ax: Axes3D, labels: list[Label], lines: Array) -> None:
    """Names in framed axes, each near its wanted place, where they cover neither one another nor lines.

    Lines are (k, 2, 3), their ends.
    """
    names = [Name(label.text, *_on_paper(ax, np.array([label.point, label.wanted]))) for label in labels]
    seen = _on_paper(ax, lines.reshape(-1, 3)).reshape(-1, 2, 2)
    size, (right, up) = float(mpl.rcParams["font.size"]), right_and_up()
    for label, name, place in zip(labels, names, spread(names, seen, size), strict=True):
        # From the paper back into space, in the plane through the wanted place that faces the viewer.
        step = 1e-3 * float(np.ptp(ax.get_zlim()))
        moved_by = _on_paper(ax, label.wanted + step * np.array([right, up])) - name.wanted
        across, along = np.linalg.solve(moved_by.T, place - name.wanted) * step
        at = label.wanted + across * right + along * up
        style: Any = {"color": label.color, "path_effects": _HALO, "zorder": 10}
        ax.text(*at, label.text, ha="center", va="center", **style)


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


class Arrow(FancyArrowPatch):
    """A vector as an arrow of even width whose head keeps its size on paper."""

    def __init__(self, vector: Vector, part: float = 1.0) -> None:
        super().__init__(
            (0.0, 0.0),
            (1.0, 0.0),
            arrowstyle="-|>,head_length=0.42,head_width=0.17",
            mutation_scale=11.0,
            shrinkA=0.0,
            shrinkB=0.0,
            linewidth=1.15,
            color=vector.color,
            joinstyle="miter",
            capstyle="butt",
            path_effects=[withStroke(linewidth=2.4, foreground="white", alpha=0.9)],
            zorder=5,
            clip_on=False,
        )
        self.vector = vector
        self._reach = np.stack([vector.ends[0], vector.ends[0] + part * np.subtract(*vector.ends[::-1])])

    def do_3d_projection(self, renderer: Any = None) -> float:
        """Places the arrow for the axes' present view; returns its depth."""
        first, last = _seen(self.axes, self._reach)
        self.set_positions(first, last)
        return 0.0
