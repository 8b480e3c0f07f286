"""Curves over time: one panel, as Fig. 4 has twelve, for any quantity of a solution."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from polypod.answers.leg_words import factor
from polypod.answers.status import Status
from polypod.bodies.palette import GREY, PALE, color_of
from polypod.errors import PolypodError, UnknownNameError
from polypod.mechanism import Mechanism
from polypod.plots.canvas import pyplot_figure
from polypod.plots.style import dash_of, house_style
from polypod.solution.solution import Solution

Array = NDArray[np.float64]

_SHOWN_IN = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "m/s^2": (1e3, "mm/s^2"), "rad": (180 / math.pi, "deg")}
"""Lengths and angles as people read them; everything else is SI."""


@dataclass(frozen=True)
class Panel:
    """Curves over time in one unit, as they are drawn; texts as matplotlib takes them, with $formulas$."""

    label: str
    unit: str
    values: Array
    """(time, curve)."""
    curves: tuple[str, ...]
    limits: tuple[float, ...] = ()
    """Levels to mark."""


def plot_series(solution: Solution, name: str, ax: Axes | None = None, **where: Any) -> Axes:
    """One quantity of a solution over time: a curve for each leg, rod, limit or component.

    Lengths are in mm, angles in degrees and numbers of five digits in thousands; everything else is SI. Spans
    of time with a status other than OK are grey; strokes that all legs share are marked beside their lengths.

    Args:
        solution: of `solve`, of a simulation, or from a file.
        name: a variable of its dataset.
        ax: to draw on.
        where: labels that are meant, one or a list, by dimension: `leg="2"`, or
            `component=["linear x", "linear y", "linear z"]` where components differ in their unit.

    Raises:
        UnknownNameError: no such variable, dimension or label.
        PolypodError: more than one dimension beside time, or two units.

    >>> import polypod as pp
    >>> from matplotlib.figure import Figure
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> solution = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech))
    >>> ax = pp.plots.plot_series(solution, "force", Figure().subplots())
    >>> ax.get_ylabel()
    'active force of the leg $f_{a}$ / kN'
    """
    data = solution.dataset
    panel = _panel_of(data, name, where)
    time, lost = data["time"].to_numpy(), (data["status"] != Status.OK).to_numpy()
    with house_style():
        if ax is None:
            ax = pyplot_figure((5.2, 3.2), layout="constrained").add_subplot()
        draw_panel(ax, panel, time, lost)
        ax.set_xlabel("time $t$ / s")
    return ax


def _panel_of(data: xr.Dataset, name: str, where: dict[str, Any]) -> Panel:
    if name not in data.data_vars:
        raise UnknownNameError("variable of the solution", name, map(str, data.data_vars))
    column = data[name]
    for dim, labels in where.items():
        if dim not in column.dims[1:]:
            raise UnknownNameError(f"dimension of {name}", dim, map(str, column.dims[1:]))
        known = column[dim].to_numpy().tolist()
        for label in labels if isinstance(labels, list) else [labels]:
            if label not in known:
                raise UnknownNameError(dim, str(label), map(str, known))
    column = column.sel(where)
    if column.dims[:1] != ("time",) or column.ndim > 2:
        dims = list(map(str, column.dims[1:]))
        one = ", ".join(f"{dim}={column[dim].to_numpy()[0].item()!r}" for dim in dims[:-1])
        raise PolypodError(f"{name} has a curve for each {' and '.join(dims)}; choose, such as {one}")
    unit = _unit_of(name, column)
    factor, shown = _SHOWN_IN.get(unit, (1.0, unit))
    values = factor * column.to_numpy().reshape(len(column), -1)
    words = fill(column.attrs.get("long_name", name), 34)
    label = f"{words} {math_symbols(column.attrs.get('symbol', ''))}".rstrip()
    marks = stroke_of(data) if name == "length" else ()
    unit = "" if shown == "1" else math_unit(shown)
    return in_kilo(Panel(label, unit, values, _curves(column), marks))


def _curves(column: xr.DataArray) -> tuple[str, ...]:
    """Labels of the curves: legs and rods by name, others by their label."""
    if column.ndim == 1:
        return ("",)
    dim = str(column.dims[1])
    of = dim.removeprefix("coupled_")
    return tuple(f"{of} {label}" if of in ("leg", "rod") else str(label) for label in column[dim].values)


def _unit_of(name: str, column: xr.DataArray) -> str:
    """The unit of a column; one whose curves have several is refused."""
    unit: str = column.attrs.get("units", "1")
    several = []
    for dim in column.coords:
        labels = np.atleast_1d(column[dim]).tolist()
        if str(dim).endswith("_unit"):
            several += labels
        if " and " in unit and dim in ("component", "joint_component"):
            halves = unit.split(" and ")
            several += [halves[str(label).startswith(("angular", "torque"))] for label in labels]
    if len({*several}) > 1:
        dim = column.dims[-1]
        one = [str(label) for label, u in zip(column[dim].values, several, strict=True) if u == several[0]]
        raise PolypodError(
            f"{name} is in {', '.join(dict.fromkeys(several))}; choose one, such as {dim}={one!r}"
        )
    return several[0] if several else unit


def math_symbols(text: str) -> str:
    """Symbols such as σ_min as formulas, and words between them as they are."""

    def formula(found: re.Match[str]) -> str:
        stem, index, primes = found.groups()
        low = "" if index is None else f"_{{{index}}}" if len(index) == 1 else rf"_{{\mathrm{{{index}}}}}"
        return f"${stem}{low}{primes}$"

    return re.sub(r"\b([A-Za-zα-ωΑ-Ω])(?:_(\w+))?('*)(?!\w)", formula, text)


def math_unit(unit: str) -> str:
    """A unit such as mm/s^2 as mm s⁻²."""
    over, _, under = unit.partition("/")
    if not re.fullmatch(r"[a-z]+(\^\d)?", under):
        return unit
    base, _, power = under.partition("^")
    return f"{over} {base}$^{{-{power or 1}}}$"


def draw_panel(ax: Axes, panel: Panel, time: Array, lost: NDArray[np.bool_]) -> None:
    """The curves over time, with their names above them; spans of states that are lost are grey."""
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
    ax.ticklabel_format(axis="y", style="sci", scilimits=(-3, 5))
    if panel.curves == ("",):
        return
    if len(panel.curves) > 7 and max(map(len, panel.curves)) > 9:
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
        return
    many = len(panel.curves) > 5
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=-(-len(panel.curves) // 2) if len(panel.curves) > 7 else max(len(panel.curves), 1),
        handlelength=0.9 if many else None,
        columnspacing=0.6 if many else None,
    )


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def in_kilo(panel: Panel) -> Panel:
    """Numbers of five digits and more in thousands."""
    finite = panel.values[np.isfinite(panel.values)]
    if not np.max(np.abs(finite), initial=0.0) >= 1e4:
        return panel
    return Panel(panel.label, f"k{panel.unit}", panel.values / 1e3, panel.curves)


def stroke_of(data: xr.Dataset) -> tuple[float, ...]:
    """Stroke limits in mm or deg, where all legs have the same and the solution tells its mechanism."""
    text = data.attrs.get("mechanism_file")
    if not text:
        return ()
    mech = Mechanism.from_toml(text)
    limits = np.unique(mech.stroke, axis=0)
    return tuple(factor(mech.drives[0]) * limits[0]) if len(limits) == 1 and np.isfinite(limits).all() else ()
