"""Canvas of pictures with several panels: a figure, or a part of one, and cells for axes in it."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure, SubFigure
from matplotlib.gridspec import GridSpec

from polypod.errors import PolypodError
from polypod.plots.style import house_style

Rect = tuple[float, float, float, float]
"""Left, bottom, width and height, as parts of the canvas."""

Canvas = Figure | SubFigure
"""A figure, or what `Figure.subfigures` makes of it."""


def pyplot_figure(size: tuple[float, float], **more: Any) -> Figure:
    """A figure of that size in inches, which pyplot knows."""
    # Here, so that those who bring their own figure need no screen and no pyplot.
    from matplotlib import pyplot

    return pyplot.figure(figsize=size, **more)


def size_of(canvas: Canvas) -> tuple[float, float]:
    """Width and height in inches."""
    return canvas.bbox.width / canvas.dpi, canvas.bbox.height / canvas.dpi


def cells(canvas: Canvas, rows: int, columns: int, **places: Any) -> list[list[Rect]]:
    """Places for axes, row by row, by the margins and ratios that `GridSpec` takes.

    Axes made with them stay there, whatever layout engine the figure has for its other parts.
    """
    if isinstance(canvas, Figure):
        canvas.set_layout_engine("none")
    grid: Any = GridSpec(rows, columns, **places)  # no type: for matplotlib's, a subfigure is no figure
    return [[grid[i, k].get_position(canvas).bounds for k in range(columns)] for i in range(rows)]


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
