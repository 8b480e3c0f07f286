"""The curves of the paper's Fig. 4."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from polypod.answers.leg_words import factor, force_unit, unit, word
from polypod.answers.status import Status, count
from polypod.legs.drive import Drive
from polypod.legs.drives import TELESCOPE
from polypod.mechanism import Mechanism
from polypod.plots.canvas import Canvas, cells, pyplot_figure, size_of
from polypod.plots.scene import math_name
from polypod.plots.series import Panel, draw_panel, in_kilo, stroke_of
from polypod.plots.style import house_style
from polypod.solution.solution import Solution

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

    def of_legs(
        name: str, label: str, symbol: str, unit: str, scale: float | NDArray[np.float64] = 1.0
    ) -> Panel:
        curves = tuple(f"${symbol.replace('#', leg)}$" for leg in legs)
        values = scale * data[name].to_numpy()
        return Panel(label, unit, values, curves, stroke_of(data) if name == "length" else ())

    position = 1e3 * data["pose"].to_numpy()[:, :3, 3]
    drives = _drives_of(data)
    length, rate, gain = _symbols(drives)
    scale, own = np.array([factor(drive) for drive in drives]), unit(drives)
    forces = of_legs("force", "active force $f_a$", "f_{a#}", force_unit(drives))
    panels = [
        Panel("position of $o$", "mm", position, ("$X_o$", "$Y_o$", "$Z_o$")),
        six("twist", 0, "velocity $v$", "v", "mm s$^{-1}$", 1e3),
        six("acceleration", 0, "acceleration $a$", "a", "mm s$^{-2}$", 1e3),
        six("twist", 1, r"angular velocity $\omega$", r"\omega", "rad s$^{-1}$"),
        six("acceleration", 1, r"angular acceleration $\varepsilon$", r"\varepsilon", "rad s$^{-2}$"),
        _orientation(data),
        of_legs("length", *length, own, scale),
        of_legs("rate", *rate, f"{own} s$^{{-1}}$", scale),
        of_legs("leg_acceleration", *gain, f"{own} s$^{{-2}}$", scale),
        in_kilo(forces),
        _second_forces(data),
        _torque(data),
    ]
    return [panel for panel in panels if panel is not None]


def _symbols(drives: tuple[Drive, ...]) -> tuple[tuple[str, str], tuple[str, str], tuple[str, str]]:
    """Label and symbol of the drives' coordinates, of their rates and of their second rates."""
    of = word(drives)
    if of == "length":
        return (
            ("leg length $r$", "r_{#}"),
            ("leg rate $v_r$", "v_{r#}"),
            ("leg acceleration $a_r$", "a_{r#}"),
        )
    return (
        (f"{of} $q$", "q_{#}"),
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


def _drives_of(data: xr.Dataset) -> tuple[Drive, ...]:
    """What drives the legs; telescopes where the dataset does not tell its mechanism."""
    text = data.attrs.get("mechanism_file")
    return Mechanism.from_toml(text).drives if text else (TELESCOPE,) * data.sizes["leg"]
