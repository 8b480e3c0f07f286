"""How well samples determine the second derivatives of the curve through them.

Inverse dynamics needs accelerations, and the quintic spline through samples takes these as they are. Samples
that are held, repeated at almost the same time, or rounded then give large accelerations that no machine had.
Measured is by how much each sample is off the polynomial of degree five through the six around it, and what
second derivative the spline makes of errors of that size.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from polypod.files.units import coordinate_unit, instant

Array = NDArray[np.float64]

AROUND = np.array([-3, -2, -1, 1, 2, 3])
FEWEST = 30
"""Samples that it takes to tell what is usual; fewer are waypoints that somebody chose."""
DRAWS = 16
"""Random signs and sizes of the errors, the same ones every time."""
SHARE = 0.2
"""Of the peak second derivative: an error above it is worth a warning."""
SHORT, LONG = 0.2, 5.0
"""Steps below and above these multiples of the median step are irregular."""
WINDOW = 24
"""Samples on both sides that a second derivative of the spline depends on, by far."""
BESIDE = 8
"""Samples on both sides whose second derivatives are looked at."""
PART = 20_000
"""Samples whose weights are worked out at a time."""
MEDIAN = 0.6745
"""Median of the sizes of normally distributed errors with a standard deviation of one."""
CHANGES = 5
"""Fewer are no pattern."""
LEVELS = 200
"""Values, without repetitions, that a resolution is sought in."""


class Doubt(NamedTuple):
    """The coordinate whose second derivative is least certain, and where."""

    name: str
    sample: int
    error: float
    """Standard error of the second derivative there, SI."""
    peak: float
    """The largest second derivative of the spline, SI."""
    cause: str


def warnings_about(
    time: Array, coordinates: dict[str, Array], second_rates: dict[str, Array], places: Sequence[str]
) -> list[str]:
    """Sentences for the user about samples (N,) at `time`, SI, whose second derivatives are in doubt.

    `places` name the samples, such as "line 12". `second_rates` are those of the spline through the samples.
    """
    if len(time) < FEWEST:
        return []
    held, first = _held(coordinates)
    if held:
        return [
            f"{held} of {len(time)} samples repeat the one before, the first of them {places[first]}: "
            "values are held between changes. Accelerations of the curve through them, and forces that "
            "follow, are those of the holding, not of the motion: take only the samples that change."
        ]
    weights = _weights(time)
    doubts = [_doubt(name, time, q, second_rates[name], weights, places) for name, q in coordinates.items()]
    found = [doubt for doubt in doubts if doubt is not None]
    if not found:
        return []
    worst = max(found, key=lambda doubt: doubt.error / doubt.peak)
    unit = {"m": "m/s^2", "rad": "rad/s^2"}.get(coordinate_unit(worst.name), "1/s^2")
    others = [doubt.name for doubt in found if doubt is not worst]
    also = f"; so are {', '.join(others)}" if others else ""
    return [
        f"accelerations of {worst.name} are not determined by its samples: near {places[worst.sample]}, at "
        f"{instant(time[worst.sample])}, they are uncertain by {worst.error:.2g} {unit}, with "
        f"{worst.peak:.2g} {unit} the largest of the motion, because {worst.cause}{also}. Forces that follow "
        "from them are as uncertain: smooth the samples, or take fewer of them."
    ]


def _held(coordinates: dict[str, Array]) -> tuple[int, int]:
    """How many samples repeat the one before, and the first, if most changes stand alone; else zeros."""
    changes = np.any(np.diff(np.stack(list(coordinates.values()), axis=-1), axis=0) != 0.0, axis=1)
    alone = changes[1:-1] & ~changes[:-2] & ~changes[2:]
    moves = int(np.sum(changes[1:-1]))
    if moves < CHANGES or np.sum(alone) <= 0.5 * moves:
        return 0, 0
    return int(np.sum(~changes)), 1 + int(np.argmin(changes))


def _doubt(
    name: str,
    time: Array,
    values: Array,
    second_rate: Array,
    weights: Array,
    places: Sequence[str],
) -> Doubt | None:
    errors = _departures(values, weights)
    if not errors.any():
        return None
    # Where an error of this size over the shorter step beside it weighs most. At its ends a spline is the
    # least certain, whatever the samples.
    steps = np.diff(time)
    weight = errors[1:-1] / np.minimum(steps[:-1], steps[1:]) ** 2
    worst = 3 + int(np.argmax(weight[2:-2]))
    near = slice(max(worst - WINDOW, 0), worst + WINDOW + 1)
    draws = np.random.default_rng(0).normal(size=(len(time[near]), DRAWS))
    spline = make_interp_spline(time[near], errors[near, None] * draws, k=5)
    beside = np.arange(max(worst - BESIDE, 3), min(worst + BESIDE + 1, len(time) - 3))
    uncertain = np.sqrt(np.mean(spline(time[beside], 2) ** 2, axis=1))
    sample, error = int(beside[np.argmax(uncertain)]), float(np.max(uncertain))
    peak = float(np.max(np.abs(second_rate[3:-3])))
    if not error > SHARE * peak:
        return None
    return Doubt(name, sample, error, peak, _cause(name, time, values, sample, errors, places))


def _weights(time: Array) -> Array:
    """Lagrange's weights (N, 6) of the samples around each, or around the fourth and the last but three."""
    parts = [_weights_of(time, *part) for part in _parts(len(time))]
    return np.concatenate(parts)


def _parts(count: int) -> list[tuple[int, int]]:
    return [(first, min(first + PART, count)) for first in range(0, count, PART)]


def _weights_of(time: Array, first: int, last: int) -> Array:
    middle = np.clip(np.arange(first, last), 3, len(time) - 4)
    t = time[middle[:, None] + AROUND] - time[middle][:, None]
    # The product of t_j / (t_j - t_i) over the others.
    between = t[:, None, :] - t[:, :, None]
    factors = np.where(np.eye(len(AROUND), dtype=bool), 1.0, t[:, None, :] / np.where(between, between, 1.0))
    weights: Array = np.prod(factors, axis=2)
    return weights


def _departures(values: Array, weights: Array) -> Array:
    """By how much each sample is off the polynomial through the six around it, as a standard error; (N,)."""
    middle = np.clip(np.arange(len(values)), 3, len(values) - 4)
    missed = values[middle] - sum(weights[:, k] * values[middle + place] for k, place in enumerate(AROUND))
    errors: Array = np.abs(missed) / np.sqrt(1.0 + np.sum(weights**2, axis=1))
    return errors


def _cause(name: str, time: Array, values: Array, sample: int, errors: Array, places: Sequence[str]) -> str:
    """Why the samples around one do not determine a second derivative, in words."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    around = slice(max(sample - BESIDE, 0), sample + BESIDE)
    short, long = float(np.min(steps[around])), float(np.max(steps[around]))
    if short < SHORT * usual:
        pair = around.start + int(np.argmin(steps[around]))
        return (
            f"{places[pair]} and {places[pair + 1]} are {_seconds(short)} apart, with steps of "
            f"{_seconds(usual)} elsewhere"
        )
    if long > LONG * usual:
        return f"samples are missing there: a step takes {_seconds(long)}, the others {_seconds(usual)}"
    resolution, unit = _resolution(values), coordinate_unit(name)
    if resolution is not None and resolution > 1e-2 * float(np.median(np.abs(np.diff(values)))):
        return f"values have a resolution of {_fine(resolution, unit)} at steps of {_seconds(usual)}"
    scatter = float(np.median(errors)) / MEDIAN
    return f"values scatter by {_fine(scatter, unit)} at steps of {_seconds(usual)}"


def _resolution(values: Array) -> float | None:
    """The step that all values are multiples of, by Euclid's algorithm; None if it is not seen."""
    levels = np.unique(values)
    rounding = 1e-12 * float(np.max(np.abs(values), initial=0.0))
    step = 0.0
    for change in np.diff(levels)[:LEVELS].tolist():
        larger = change
        while step > rounding:
            larger, step = step, abs(math.remainder(larger, step))
        step = larger
    return step if step > 10.0 * rounding else None


def _seconds(time: float) -> str:
    return f"{1e3 * time:.3g} ms"


def _fine(value: float, unit: str) -> str:
    """A small number in the units that people read, with two digits."""
    scale, name = {"m": (1e3, "mm"), "rad": (180 / np.pi, "deg")}.get(unit, (1.0, ""))
    return f"{scale * value:.2g} {name}".rstrip()
