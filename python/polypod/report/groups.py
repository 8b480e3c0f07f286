"""The charts of a report: which quantities of a solution stand together, with their symbols and units."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from polypod.answers.singularity import NEAR_SINGULAR
from polypod.answers.status import Status
from polypod.files.units import coordinate_unit
from polypod.mechanism import Mechanism
from polypod.plots import fig4_panels
from polypod.plots.scene import math_name
from polypod.plots.series import Panel, in_kilo
from polypod.report.charts import Chart
from polypod.report.reactions import Reactions, families
from polypod.solution.actuator_sizing import leg_power
from polypod.solution.solution import Solution

Array = NDArray[np.float64]

INSTANTS = 201
"""Instants, at most, at which distances to singular poses are sought: each takes a search a coordinate."""

NEAREST_LIMITS = 5
"""Limits whose slack is drawn: those that come nearest."""

_ROUNDING = 1e-9
"""Reactions so much smaller than the largest force, or its torque at the characteristic length: rounding."""

_COMPONENTS = "xyz"


def motion_charts(solution: Solution) -> list[Chart]:
    """The panels of the paper's Fig. 4."""
    data = solution.dataset
    panels, time = fig4_panels(data), data["time"].to_numpy()
    return [Chart(panel, time, f"({chr(97 + i)})") for i, panel in enumerate(panels)]


# --- actuators ----------------------------------------------------------------------------------------------


def actuator_charts(mech: Mechanism, solution: Solution) -> list[Chart]:
    """Power of each actuator, all powers and energies, and the slack of the limits that come nearest."""
    data = solution.dataset
    actuated = np.flatnonzero(mech.actuated)
    powers = {
        "actuator_power": r"$P_\mathrm{actuators}$",
        "load_power": r"$P_\mathrm{load}$",
        "damping_power": r"$P_\mathrm{damping}$",
        "friction_power": r"$P_\mathrm{friction}$",
    }
    energies = {"kinetic_energy": "$K$", "actuator_work": r"$W_\mathrm{actuators}$"}
    panels = [
        Panel(
            "power of an actuator $P$",
            "W",
            leg_power(solution)[:, actuated],
            tuple(f"$P_{{{math_name(mech.leg_names[i])}}}$" for i in actuated),
        ),
        Panel("power", "W", _columns(data, [*powers]), (*powers.values(),)),
        Panel("kinetic energy, work", "J", _columns(data, [*energies]), (*energies.values(),)),
    ]
    if "limit_relative" in data:
        panels.append(_slack(data))
    time = data["time"].to_numpy()
    return [Chart(panel, time) for panel in panels]


def _columns(data: xr.Dataset, names: list[str]) -> Array:
    return np.stack([data[name].to_numpy() for name in names], axis=-1)


def _slack(data: xr.Dataset) -> Panel:
    relative = data["limit_relative"].to_numpy()
    least = np.min(np.where(np.isfinite(relative), relative, np.inf), axis=0)
    nearest = np.argsort(least, kind="stable")[:NEAREST_LIMITS]
    names = data["limit"].to_numpy()[nearest].tolist()
    return Panel("relative slack of limits", "", relative[:, nearest], (*map(_plain, names),), (0.0,))


def _plain(name: str) -> str:
    """A name as text outside formulas."""
    return name.replace("$", "")


# --- reactions ----------------------------------------------------------------------------------------------


def reaction_charts(mech: Mechanism, found: Reactions) -> list[Chart]:
    """Sizes of force and torque for each kind of joint, a curve for each leg or rod."""
    charts = []
    largest = float(np.max(found.force, initial=0.0, where=np.isfinite(found.force)))
    least = {"N": _ROUNDING * largest, "N m": _ROUNDING * largest * mech.characteristic_length}
    kinds = ((found.force, "force", "F", "N"), (found.torque, "torque", "T", "N m"))
    for values, name, symbol, unit in kinds:
        for family, indices in families(found):
            of = mech.rod_names if family == "rods" else mech.leg_names
            curves = tuple(f"${symbol}_{{{math_name(owner)}}}$" for owner in of)
            panel = Panel(f"{name} $|{symbol}|$, {family}", unit, values[:, indices], curves)
            shown = in_kilo(panel)
            floor = least[unit] if shown.unit == unit else 0.0  # what is shown in thousands is no rounding
            charts.append(Chart(shown, found.time, least=floor))
    return charts


# --- singularities ------------------------------------------------------------------------------------------


def singularity_charts(mech: Mechanism, solution: Solution) -> list[Chart]:
    """Measures of nearness to singular poses, and how far each coordinate is from them."""
    data = solution.dataset
    time = data["time"].to_numpy()

    def one(name: str, label: str, symbol: str, *levels: float, log: bool = False) -> Chart:
        return Chart(Panel(label, "", data[name].to_numpy()[:, None], (symbol,), levels), time, log=log)

    return [
        one("sigma_min", r"smallest singular value", r"$\sigma_\mathrm{min}$", NEAR_SINGULAR),
        one("condition", "condition number", r"$\sigma_\mathrm{max}/\sigma_\mathrm{min}$", log=True),
        one("determinant", "determinant", r"$\mathrm{det}\ J$", 0.0),
        *_distance_charts(mech, data),
    ]


def _distance_charts(mech: Mechanism, data: xr.Dataset) -> list[Chart]:
    """Distance to the nearest singular pose along each coordinate, the others kept; lengths and angles."""
    answered = np.flatnonzero(np.isfinite(data["pose"].to_numpy()).all(axis=(1, 2)))
    if not answered.size:
        return []
    at = answered[np.unique(np.linspace(0, answered.size - 1, INSTANTS).astype(int))]
    found = mech.singularity_distance(data["pose"].to_numpy()[at])
    nearest = np.min(found.distance, axis=-1)
    nearest = np.where(np.isfinite(nearest), nearest, np.nan)
    charts = []
    for si, unit, scale in (("m", "mm", 1e3), ("rad", "deg", 180.0 / np.pi)):
        of = [i for i, name in enumerate(found.coordinates) if coordinate_unit(name) == si]
        if of and np.isfinite(nearest[:, of]).any():
            curves = tuple(_coordinate(found.coordinates[i]) for i in of)
            panel = Panel("distance to singular", unit, scale * nearest[:, of], curves)
            charts.append(Chart(panel, data["time"].to_numpy()[at], dots=True))
    return charts


_GREEK = {"alpha": r"$\alpha$", "beta": r"$\beta$", "gamma": r"$\gamma$"}


def _coordinate(name: str) -> str:
    """The symbol of a coordinate such as p, rx or tip_x."""
    stem, _, index = name.partition("_")
    if len(name) == 2:
        stem, index = name[0], name[1]
    upright = rf"\mathrm{{{stem}}}" if len(stem) > 1 else stem
    return _GREEK.get(name) or (f"${upright}_{index}$" if index else f"${upright}$")


# --- leg by leg ---------------------------------------------------------------------------------------------


def leg_charts(data: xr.Dataset, leg: int, links: tuple[str, str]) -> list[Chart]:
    """How one leg rotates, how its two links move, and the angles of its joints."""
    time = data["time"].to_numpy()

    def three(name: str, label: str, symbol: str, unit: str, scale: float = 1.0) -> Panel:
        curves = tuple(f"${symbol}{c}}}$" for c in _COMPONENTS)
        return Panel(label, unit, scale * data[name].to_numpy()[:, leg], curves)

    first, second = links
    panels = [
        three("leg_omega", r"angular velocity $\omega_r$", r"\omega_{r", "rad s$^{-1}$"),
        three("leg_eps", r"angular acceleration $\varepsilon_r$", r"\varepsilon_{r", "rad s$^{-2}$"),
        _joint_angles(data, leg),
        three("piston_velocity", f"{second}'s velocity $v_p$", "v_{p", "mm s$^{-1}$", 1e3),
        three("piston_acceleration", f"{second}'s acceleration $a_p$", "a_{p", "mm s$^{-2}$", 1e3),
        three("cylinder_acceleration", f"{first}'s acceleration $a_q$", "a_{q", "mm s$^{-2}$", 1e3),
    ]
    return [Chart(panel, time) for panel in panels]


def _joint_angles(data: xr.Dataset, leg: int) -> Panel:
    """Angles of both joints, those that there are."""
    series, curves = [], []
    for name, symbol in (("base_joint_angle", r"\psi"), ("platform_joint_angle", r"\phi")):
        for k in range(2):
            values = data[name].to_numpy()[:, leg, k]
            if np.isfinite(values).any():
                series.append(np.degrees(values))
                curves.append(f"${symbol}_{k + 1}$")
    values = np.stack(series, axis=-1) if series else np.full((data.sizes["time"], 1), np.nan)
    return Panel("joint angles", "deg", values, tuple(curves) or ("none",))


# --- states without an answer -------------------------------------------------------------------------------


def marks(data: xr.Dataset) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which states have no answer, and which have one with a reservation, such as out of stroke."""
    status = data["status"].to_numpy()
    answered = np.isin(status, [int(s) for s in Status if s.has_answer])
    return ~answered, answered & (status != Status.OK)
