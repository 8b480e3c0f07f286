"""Pictures of workspaces: four views of a boundary as in the paper's Fig. 3, or an outline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from polypod.bodies.palette import INK, PALE
from polypod.errors import UnknownNameError, WorkspaceError
from polypod.plots.canvas import Canvas, cells, pyplot_figure, size_of
from polypod.plots.style import house_style
from polypod.workspaces.cut import above as part_above
from polypod.workspaces.workspace import Workspace

Array = NDArray[np.float64]

_SYMBOLS = {
    "x": "$X_o$",
    "y": "$Y_o$",
    "z": "$Z_o$",
    "alpha": r"$\alpha$",
    "beta": r"$\beta$",
    "gamma": r"$\gamma$",
    "azimuth": "azimuth",
    "tilt": "tilt",
    "torsion": "torsion",
}
_SCALES = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "deg"), "1": (1.0, "")}

_LIGHT = np.array([-0.35, -0.55, 0.76])
"""Direction to the light: from above and the front, on the left."""

_DARKEST = 0.55
"""Brightness of faces that the light does not reach."""

_SWATCH: Any = {"linestyle": "none", "marker": "s", "markersize": 6.5}

VIEWS = {"top": (0, 1), "side": (1, 2), "front": (0, 2)}
"""Axes across and up in views along the third."""

_ELEVATION, _AZIMUTH = math.radians(24.0), math.radians(-60.0)


class _Surface(NamedTuple):
    """Faces as they are drawn."""

    points: Array
    """(v, 3): vertices in mm, degrees or 1."""
    faces: NDArray[np.int64]
    """(f, 3): vertices of each triangle."""
    labels: NDArray[np.int64]
    """(f,): what ends the workspace at each."""


def plot_workspace(
    workspace: Workspace, figure: Canvas | None = None, *, above: float | None = None
) -> Canvas:
    """Top, side, front and isometric view of a workspace, as in Fig. 3; of two coordinates the outline.

    The colour tells what ends the workspace: a limit of a leg has the colour of the leg, paler for the least
    value. Lengths are in mm, angles in degrees.

    Args:
        workspace: what to draw.
        figure: a figure or a subfigure to draw on.
        above: draw only what has a third coordinate of at least this, m or rad.

    Raises WorkspaceError where `above` leaves nothing, and for `above` with two coordinates.
    """
    space = len(workspace.names) == 3
    if above is not None and not space:
        raise WorkspaceError(f"above is {above!r}; a workspace of two coordinates is drawn as a whole")
    with house_style():
        figure = figure or pyplot_figure((8.0, 7.4) if space else (5.6, 5.2))
        if space:
            _draw_views(workspace, figure, _surface(workspace, above))
        else:
            low = (0.75 + 0.17 * _legend(workspace, workspace.labels, figure)) / size_of(figure)[1]
            [[cell]] = cells(figure, 1, 1, left=0.13, right=0.97, bottom=low, top=0.97)
            _draw_outline(figure.add_axes(cell), workspace)
    return figure


def plot_workspace_view(
    workspace: Workspace, ax: Axes | None = None, *, view: str | None = None, legend: bool = True
) -> Axes:
    """One view of a workspace, or the outline of one of two coordinates; colours as in `plot_workspace`.

    Args:
        workspace: what to draw.
        ax: plain axes to draw on.
        view: top, side, front or isometric, for three coordinates; isometric by default.
        legend: what ends the workspace, to the right of it.

    Raises:
        UnknownNameError: no such view.
        WorkspaceError: a view of an outline.
    """
    space = len(workspace.names) == 3
    if view is not None and not space:
        raise WorkspaceError(f"view is {view!r}; a workspace of two coordinates has an outline and no views")
    view = view or "isometric"
    if view not in (*VIEWS, "isometric"):
        raise UnknownNameError("view", view, (*VIEWS, "isometric"))
    with house_style():
        if ax is None:
            ax = pyplot_figure((5.6, 4.0), layout="constrained").add_subplot()
        if space:
            _draw_view(ax, workspace, _surface(workspace), view)
        else:
            _draw_outline(ax, workspace)
        if legend:
            ax.legend(
                handles=_handles(workspace, workspace.labels), loc="upper left", bbox_to_anchor=(1.02, 1.0)
            )
    return ax


def _surface(workspace: Workspace, above: float | None = None) -> _Surface:
    """All faces of a workspace, or those from a value of the third coordinate on."""
    labels = face_labels(workspace)
    if above is None:
        return _Surface(workspace.vertices * _factors(workspace), workspace.faces, labels)
    part = part_above(workspace.vertices, workspace.faces, 2, above)
    if not len(part.faces):
        highest, name = float(workspace.extents[2, 1]), workspace.names[2]
        raise WorkspaceError(f"above is {above:g}; the greatest {name} of the workspace is {highest:g}")
    return _Surface(part.vertices * _factors(workspace), part.faces, labels[part.parent])


def _factors(workspace: Workspace) -> list[float]:
    """From coordinates to what axes show."""
    return [_SCALES[unit][0] for unit in workspace.units]


def _axis_labels(workspace: Workspace) -> list[str]:
    scales = [_SCALES[u] for u in workspace.units]
    return [
        f"{_SYMBOLS.get(name, name)} / {u}" if u else name
        for name, (_, u) in zip(workspace.names, scales, strict=True)
    ]


def _draw_views(workspace: Workspace, figure: Canvas, surface: _Surface) -> None:
    low = (0.75 + 0.17 * _legend(workspace, surface.labels, figure)) / size_of(figure)[1]
    spans = np.ptp(surface.points, axis=0) if _in_one_unit(workspace) else np.ones(3)
    (top, isometric), (front, side) = cells(
        figure,
        2,
        2,
        width_ratios=[spans[0], spans[1]],
        height_ratios=[spans[1], spans[2]],
        left=0.09,
        right=0.98,
        top=0.96,
        bottom=low,
        wspace=0.22,
        hspace=0.27,
    )
    # Each view has the one that shares its axis beside or below it.
    places = {"top": top, "side": side, "front": front, "isometric": isometric}
    for letter, (view, cell) in zip("abcd", places.items(), strict=True):
        ax = figure.add_axes(cell)
        _draw_view(ax, workspace, surface, view)
        ax.set_title(f"({letter})  {view} view")


def _in_one_unit(workspace: Workspace) -> bool:
    return len({*workspace.units}) == 1


def _draw_view(ax: Axes, workspace: Workspace, surface: _Surface, view: str) -> None:
    """One view of a boundary in space, along an axis with scales or isometric with a triad."""
    points, texts = surface.points, _axis_labels(workspace)
    if view == "isometric":
        even = points if _in_one_unit(workspace) else points / np.ptp(points, axis=0)
        right, up = _isometric()
        _draw_faces(ax, surface._replace(points=even), workspace.colors, right, up)
        _draw_triad(ax, even, right, up, [_SYMBOLS.get(name, name) for name in workspace.names])
        ax.set_aspect("equal", adjustable="datalim")
        ax.margins(0.06)
        ax.set_axis_off()
    else:
        across, along = VIEWS[view]
        axes = np.eye(3)
        _draw_faces(ax, surface, workspace.colors, axes[across], axes[along])
        ax.set(xlabel=texts[across], ylabel=texts[along])
        ax.margins(0.04)
        if _in_one_unit(workspace):
            ax.set_aspect("equal", adjustable="box")
    ax.autoscale_view()


def _isometric() -> tuple[Array, Array]:
    """Directions to the right and up in the picture."""
    se, ce, sa, ca = (f(a) for a in (_ELEVATION, _AZIMUTH) for f in (math.sin, math.cos))
    return np.array([-sa, ca, 0.0]), np.array([-se * ca, -se * sa, ce])


def _draw_faces(ax: Axes, surface: _Surface, palette: Sequence[str], right: Array, up: Array) -> None:
    """All faces, those behind first: where the mesh has small folds, those that look away close the gaps."""
    corners = surface.points[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    viewer = np.cross(right, up)
    seen = np.linalg.norm(normals, axis=1) > 0.0
    smooth = _smoothed(surface, normals)[seen]
    corners = corners[seen]
    order = np.argsort(corners.mean(axis=1) @ viewer, kind="stable")
    light = np.clip(smooth @ (_LIGHT / np.linalg.norm(_LIGHT)), 0.0, 1.0)
    brightness = _DARKEST + (1.0 - _DARKEST) * light[:, None]
    colors = (np.array([to_rgb(color) for color in palette])[surface.labels[seen]] * brightness)[order]
    flat = (corners @ np.stack([right, up], axis=1))[order]
    # Edges of the same colour close the seams; as a picture inside the SVG the many faces stay small.
    ax.add_collection(
        PolyCollection(
            list(flat), facecolors=colors, edgecolors=colors, linewidths=0.3, rasterized=True, zorder=2
        )
    )


def _smoothed(surface: _Surface, normals: Array) -> Array:
    """(f, 3): unit normals of the faces, averaged over the faces around their vertices."""
    at_vertices = np.zeros((len(surface.points), 3))
    for k in range(3):
        np.add.at(at_vertices, surface.faces[:, k], normals)
    mixed = at_vertices[surface.faces].sum(axis=1)
    return np.asarray(mixed / np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-300))


def face_labels(workspace: Workspace) -> NDArray[np.int64]:
    """(f,): the label that most corners have, else that of the first."""
    first, second, third = workspace.labels[workspace.faces].T
    return np.asarray(np.where(second == third, second, first))


def _draw_triad(ax: Axes, points: Array, right: Array, up: Array, names: list[str]) -> None:
    """The axes' directions in the lower left corner of the picture."""
    flat = points @ np.stack([right, up], axis=1)
    size = 0.16 * float(np.ptp(flat, axis=0).max())
    corner = flat.min(axis=0) + np.array([0.3 * size, -0.75 * size])
    for axis, name in zip(np.eye(3), names, strict=True):
        tip = corner + size * np.array([axis @ right, axis @ up])
        ax.annotate(
            "", tip, corner, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 0.8}, annotation_clip=False
        )
        x, y = corner + 1.22 * (tip - corner)
        ax.text(float(x), float(y), name, ha="center", va="center")
    ax.update_datalim([corner - 0.5 * size, corner + 1.3 * size])


def _draw_outline(ax: Axes, workspace: Workspace) -> None:
    points, texts = workspace.vertices * _factors(workspace), _axis_labels(workspace)
    # Rings follow one another; a segment that does not lead to the next point closes its ring.
    closing = workspace.faces[:, 1] != workspace.faces[:, 0] + 1
    codes = np.full(len(points), Outline.LINETO, dtype=np.uint8)
    codes[np.concatenate([[0], np.flatnonzero(closing)[:-1] + 1])] = Outline.MOVETO
    ax.add_patch(PathPatch(Outline(points, codes), facecolor=PALE, edgecolor="none", zorder=1))
    colors = [workspace.colors[i] for i in workspace.labels[workspace.faces[:, 0]]]
    ax.add_collection(
        LineCollection(
            list(points[workspace.faces]), colors=colors, linewidths=1.8, capstyle="round", zorder=2
        )
    )
    ax.set(xlabel=texts[0], ylabel=texts[1])
    ax.margins(0.04)
    ax.autoscale_view()
    if _in_one_unit(workspace) and 0.2 < np.divide(*np.ptp(points, axis=0)) < 5.0:
        ax.set_aspect("equal", adjustable="box")


def _legend(workspace: Workspace, labels: NDArray[np.int64], figure: Canvas) -> int:
    """Draws the causes of what is drawn below the picture in rows; returns the number of rows."""
    handles = _handles(workspace, labels)
    columns = min(len(handles), max(int(size_of(figure)[0] / 1.55), 1))
    by_column = [handle for column in range(columns) for handle in handles[column::columns]]
    figure.legend(handles=by_column, loc="lower center", ncols=columns, bbox_to_anchor=(0.5, 0.008))
    return -(-len(handles) // columns)


def _handles(workspace: Workspace, labels: NDArray[np.int64]) -> list[Line2D]:
    """A swatch for each of the labels that occur, limits of a kind together."""
    kinds = [limit.kind for limit in workspace.mechanism.limit_list]
    present = np.unique(labels).tolist()
    present.sort(key=lambda i: (kinds.index(kinds[i]) if i < len(kinds) else len(kinds), i))
    return [
        Line2D([], [], color=workspace.colors[i], label=workspace.label_names[i], **_SWATCH) for i in present
    ]
