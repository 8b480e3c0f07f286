"""Facts about a solution, as plain data: JSON holds them as they are.

SI units and radians. Numbers that do not exist (no stroke limit, no answer) are None.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status, count
from polypod.mechanism import Mechanism
from polypod.solution.extremes import greatest, least, number, peak, stroke_limits
from polypod.solution.singularity_crossings import warnings_of
from polypod.solution.solution import Solution

Array = NDArray[np.float64]


def summarise(mech: Mechanism, solution: Solution) -> dict[str, Any]:
    """Ranges, peaks and outcomes along a motion: all that `polypod solve` tells about it."""
    data = solution.dataset
    time = data["time"].to_numpy()

    def of(name: str) -> Array:
        return data[name].to_numpy()

    legs = [
        {
            "name": name,
            "joints": mech.leg_letters[i],
            "length": [least(of("length")[:, i]), greatest(of("length")[:, i])],
            "stroke": stroke_limits(mech, i),
            "outside_stroke": _outside(of("length")[:, i], mech.stroke[i]),
            "peak_rate": peak(of("rate")[:, i]),
            "peak_force": peak(of("force")[:, i]),
        }
        for i, name in enumerate(mech.leg_names)
    ]
    outcomes = [
        {"status": status.name, "count": n, "first_time": float(time[first]), "message": status.message}
        for status, n, first in count(of("status"))
    ]
    sigma = of("sigma_min")
    nearest = int(np.nanargmin(sigma)) if np.isfinite(sigma).any() else None
    return {
        "mechanism": mech.name,
        "motion": data.attrs["motion"],
        "coordinate_set": data.attrs["coordinate_set"],
        "units": "SI, rad",
        "states": len(time),
        "without_answer": int(np.sum(~np.isin(of("status"), [s for s in Status if s.has_answer]))),
        "start": float(time[0]),
        "end": float(time[-1]),
        "platform": {
            "peak_speed": greatest(np.linalg.norm(of("twist")[:, :3], axis=-1)),
            "peak_angular_speed": greatest(np.linalg.norm(of("twist")[:, 3:], axis=-1)),
        },
        "legs": legs,
        "outcomes": outcomes,
        "nearest_to_singular": None
        if nearest is None
        else {
            "time": float(time[nearest]),
            "sigma_min": number(sigma[nearest]),
            "condition": number(of("condition")[nearest]),
        },
        "warnings": solution.warnings,
        "singularities": {**solution.singularities, "warnings": warnings_of(solution.singularities)},
        "power": _power(solution),
        "coupled": _coupled(solution),
        "limits": _limits(solution),
    }


def _limits(solution: Solution) -> dict[str, Any] | None:
    """The least slack along the motion, with its limit and time, and every limit that is passed."""
    data = solution.dataset
    if "limit_margin" not in data:
        return None
    time, names = data["time"].to_numpy(), data["limit"].to_numpy().tolist()
    units = data["limit_unit"].to_numpy().tolist()
    margins, relative = data["limit_margin"].to_numpy(), data["limit_relative"].to_numpy()

    def slack(state: int, limit: int) -> dict[str, Any]:
        return {
            "limit": names[limit],
            "time": float(time[state]),
            "margin": float(margins[state, limit]),
            "relative": float(relative[state, limit]),
            "unit": units[limit],
        }

    passed = []
    for i in np.flatnonzero((margins < 0.0).any(axis=0)):
        beyond = np.flatnonzero(margins[:, i] < 0.0)
        worst = slack(int(np.nanargmin(margins[:, i])), int(i))
        passed.append({**worst, "states": len(beyond), "first_time": float(time[beyond[0]])})
    known = np.isfinite(relative).any()
    nearest = np.unravel_index(np.nanargmin(relative), relative.shape) if known else None
    return {
        "least": None if nearest is None else slack(int(nearest[0]), int(nearest[1])),
        "passed": passed,
        "not_determined": int(np.isnan(margins).any(axis=1).sum()),
    }


def _power(solution: Solution) -> dict[str, float | None]:
    """The greatest actuator power and residual, and the residual as a part of the power that flows."""
    data = solution.dataset
    names = ("actuator_power", "load_power", "damping_power", "friction_power")
    flows = np.sum([np.abs(data[name].to_numpy()) for name in names], axis=0)
    residual = data["power_residual"].to_numpy()
    most, flow = greatest(np.abs(residual)), greatest(flows)
    return {
        "peak_actuators": peak(data["actuator_power"].to_numpy()),
        "greatest_residual": most,
        "relative_residual": most / flow if most is not None and flow else None,
    }


def _coupled(solution: Solution) -> dict[str, Any] | None:
    """Peaks of the couple-constrained forces and torque, consistent and by Eq. 44 as printed."""
    data = solution.dataset
    if "coupled_force" not in data:
        return None
    forces, printed = data["coupled_force"].to_numpy(), data["coupled_force_as_printed"].to_numpy()
    ratio = np.abs(printed[:, 0] / np.where(forces[:, 0] == 0.0, np.nan, forces[:, 0]))
    active = greatest(np.abs(data["force"].to_numpy()))
    largest = greatest(np.abs(forces))
    return {
        "legs": data["coupled_leg"].to_numpy().tolist(),
        "peak_forces": [peak(f) for f in forces.T],
        "peak_forces_as_printed": [peak(f) for f in printed.T],
        "peak_torque": peak(data["coupled_torque"].to_numpy()),
        "peak_torque_as_printed": peak(data["coupled_torque_as_printed"].to_numpy()),
        "consistent_over_printed": [_reciprocal(greatest(ratio)), _reciprocal(least(ratio))],
        "note": "the couples in the joints of these legs are statically indeterminate and taken as zero",
        "share_of_active": largest / active if largest is not None and active else None,
    }


def _outside(lengths: Array, stroke: Array) -> bool:
    return bool(np.any((lengths < stroke[0]) | (lengths > stroke[1])))


def _reciprocal(value: float | None) -> float | None:
    return 1.0 / value if value else None
