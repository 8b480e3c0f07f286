"""Requirements of a motion on each actuator, as plain data: SI, None where there is no number."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.mechanism import Mechanism
from polypod.solution.extremes import greatest, least, stroke_limits
from polypod.solution.solution import Solution

Array = NDArray[np.float64]


def requirements(mech: Mechanism, solution: Solution) -> list[dict[str, Any]]:
    """For each actuated leg: `leg`, its name; `force`, `speed` and `power`; `stroke`.

    Force in N, speed in m/s and power in W have each `peak`, the value of largest size with its sign; `time`
    of the peak, s; and `rms`, over time (`rms_over_time`). The stroke has `least` and `greatest` length, or
    place of a carriage, m, `used`, their difference, `limits` of the mechanism file, and `share`, the part of
    that range in use. States without an answer are left out.
    """
    data = solution.dataset
    time = data["time"].to_numpy()
    series = {
        "force": data["force"].to_numpy(),
        "speed": data["rate"].to_numpy(),
        "power": leg_power(solution),
    }
    lengths = data["length"].to_numpy()
    found = []
    for i in np.flatnonzero(mech.actuated).tolist():
        peaks = {name: _peak_and_rms(time, values[:, i]) for name, values in series.items()}
        found.append(
            {"leg": mech.leg_names[i], **peaks, "stroke": _stroke_used(lengths[:, i], stroke_limits(mech, i))}
        )
    return found


def leg_power(solution: Solution) -> Array:
    """(time, n): power of each actuator, W, its force times its rate; their sum is `actuator_power`."""
    power: Array = solution.dataset["force"].to_numpy() * solution.dataset["rate"].to_numpy()
    return power


def rms_over_time(time: Array, values: Array) -> float | None:
    """Root of the mean square over time, by trapezoids; NaN and the steps that touch it are left out.

    None where no step is left, unless there is one value only: then its size.
    """
    known = np.isfinite(values)
    if len(values) == 1:
        return float(abs(values[0])) if known[0] else None
    step = np.where(known[:-1] & known[1:], np.diff(time), 0.0)
    squares = np.where(known, values, 0.0) ** 2
    duration = float(step.sum())
    if not duration:
        return None
    return float(np.sqrt(np.sum(step * (squares[:-1] + squares[1:]) / 2) / duration))


def _peak_and_rms(time: Array, values: Array) -> dict[str, float | None]:
    if not np.isfinite(values).any():
        return {"peak": None, "time": None, "rms": None}
    at = int(np.nanargmax(np.abs(values)))
    return {"peak": float(values[at]), "time": float(time[at]), "rms": rms_over_time(time, values)}


def _stroke_used(lengths: Array, limits: list[float | None]) -> dict[str, Any]:
    shortest, longest = least(lengths), greatest(lengths)
    used = None if shortest is None or longest is None else longest - shortest
    low, high = limits
    span = None if low is None or high is None else high - low
    return {
        "least": shortest,
        "greatest": longest,
        "used": used,
        "limits": [low, high],
        "share": None if used is None or not span else used / span,
    }
