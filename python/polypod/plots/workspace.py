"""Pictures of workspaces: four views of a boundary as in the paper's Fig. 3, or an outline."""

from __future__ import annotations

import math
from typing import Any

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


def plot_workspace(workspace: Workspace, figure: Canvas | None = None) -> Canvas:
    """Top, side, front and isometric view of a workspace, as in Fig. 3; of two coordinates the outline.

    The colour tells what ends the workspace: a limit of a leg has the colour of the leg, paler for the least
    value. Lengths are in mm, angles in degrees.

    Args:
        workspace: what to draw.
        figure: a figure or a subfigure to draw on.
    """
    with house_style():
        figure = figure or pyplot_figure((8.0, 7.4) if len(workspace.names) == 3 else (5.6, 5.2))
        if len(workspace.names) == 3:
            _draw_views(workspace, figure)
        else:
            low = (0.75 + 0.17 * _legend(workspace, figure)) / size_of(figure)[1]
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
            _draw_view(ax, workspace, view)
        else:
            _draw_outline(ax, workspace)
        if legend:
            ax.legend(handles=_handles(workspace), loc="upper left", bbox_to_anchor=(1.02, 1.0))
    return ax


def _scaled(workspace: Workspace) -> tuple[Array, list[str]]:
    """Vertices as they are drawn, and the labels of their axes."""
    scales = [_SCALES[u] for u in workspace.units]
    texts = [
        f"{_SYMBOLS.get(name, name)} / {u}" if u else name
        for name, (_, u) in zip(workspace.names, scales, strict=True)
    ]
    return workspace.vertices * [factor for factor, _ in scales], texts


def _draw_views(workspace: Workspace, figure: Canvas) -> None:
    points, _ = _scaled(workspace)
    low = (0.75 + 0.17 * _legend(workspace, figure)) / size_of(figure)[1]
    spans = np.ptp(points, axis=0) if _in_one_unit(workspace) else np.ones(3)
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
        _draw_view(ax, workspace, view)
        ax.set_title(f"({letter})  {view} view")


def _in_one_unit(workspace: Workspace) -> bool:
    return len({*workspace.units}) == 1


def _draw_view(ax: Axes, workspace: Workspace, view: str) -> None:
    """One view of a boundary in space, along an axis with scales or isometric with a triad."""
    points, texts = _scaled(workspace)
    if view == "isometric":
        even = points if _in_one_unit(workspace) else points / np.ptp(points, axis=0)
        right, up = _isometric()
        _draw_faces(ax, workspace, even, right, up)
        _draw_triad(ax, even, right, up, [_SYMBOLS.get(name, name) for name in workspace.names])
        ax.set_aspect("equal", adjustable="datalim")
        ax.margins(0.06)
        ax.set_axis_off()
    else:
        across, along = VIEWS[view]
        axes = np.eye(3)
        _draw_faces(ax, workspace, points, axes[across], axes[along])
        ax.set(xlabel=texts[across], ylabel=texts[along])
        ax.margins(0.04)
        if _in_one_unit(workspace):
            ax.set_aspect("equal", adjustable="box")
    ax.autoscale_view()


def _isometric() -> tuple[Array, Array]:
    """Directions to the right and up in the picture."""
    se, ce, sa, ca = (f(a) for a in (_ELEVATION, _AZIMUTH) for f in (math.sin, math.cos))
    return np.array([-sa, ca, 0.0]), np.array([-se * ca, -se * sa, ce])


def _draw_faces(ax: Axes, workspace: Workspace, points: Array, right: Array, up: Array) -> None:
    """All faces, those behind first: where the mesh has small folds, those that look away close the gaps."""
    corners = points[workspace.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    viewer = np.cross(right, up)
    seen = np.linalg.norm(normals, axis=1) > 0.0
    smooth = _smoothed(workspace, normals)[seen]
    corners = corners[seen]
    order = np.argsort(corners.mean(axis=1) @ viewer, kind="stable")
    light = np.clip(smooth @ (_LIGHT / np.linalg.norm(_LIGHT)), 0.0, 1.0)
    palette = np.array([to_rgb(color) for color in workspace.colors])
    brightness = _DARKEST + (1.0 - _DARKEST) * light[:, None]
    colors = (palette[face_labels(workspace)[seen]] * brightness)[order]
    flat = (corners @ np.stack([right, up], axis=1))[order]
    # Edges of the same colour close the seams; as a picture inside the SVG the many faces stay small.
    ax.add_collection(
        PolyCollection(
            list(flat), facecolors=colors, edgecolors=colors, linewidths=0.3, rasterized=True, zorder=2
        )
    )


def _smoothed(workspace: Workspace, normals: Array) -> Array:
    """(f, 3): unit normals of the faces, averaged over the faces around their vertices."""
    at_vertices = np.zeros((len(workspace.vertices), 3))
    for k in range(3):
        np.add.at(at_vertices, workspace.faces[:, k], normals)
    mixed = at_vertices[workspace.faces].sum(axis=1)
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
    points, texts = _scaled(workspace)
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


def _legend(workspace: Workspace, figure: Canvas) -> int:
    """Draws the causes of the boundary below the picture in rows; returns the number of rows."""
    handles = _handles(workspace)
    columns = min(len(handles), max(int(size_of(figure)[0] / 1.55), 1))
    by_column = [handle for column in range(columns) for handle in handles[column::columns]]
    figure.legend(handles=by_column, loc="lower center", ncols=columns, bbox_to_anchor=(0.5, 0.008))
    return -(-len(handles) // columns)


def _handles(workspace: Workspace) -> list[Line2D]:
    """A swatch for everything that ends the workspace, limits of a kind together."""
    kinds = [limit.kind for limit in workspace.mechanism.limit_list]
    present = np.unique(workspace.labels).tolist()
    present.sort(key=lambda i: (kinds.index(kinds[i]) if i < len(kinds) else len(kinds), i))
    return [
        Line2D([], [], color=workspace.colors[i], label=workspace.label_names[i], **_SWATCH) for i in present
    ]
