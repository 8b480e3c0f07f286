"""Motions: the coordinates of a mechanism over time with exact rates and second rates, and the load."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BPoly, make_interp_spline

from polypod.answers.notebook import card, counted, numbers, rows_of
from polypod.answers.variables import COMPONENTS, TIME, variable
from polypod.errors import Fault, MotionError, ShapeError, shown
from polypod.files.csv_columns import NumberedPlaces
from polypod.files.units import coordinate_unit, instant
from polypod.motion.sample_noise import warnings_about

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Axes = Literal["base", "platform"]


class Curve(Protocol):
    """Coordinates as a function of time."""

    def __call__(self, x: Array, nu: int = 0) -> Array:
        """The derivative of order `nu` at times (N,), shape (N, number of coordinates)."""


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """Coordinates of the set `set` at N instants, SI, with their exact rates and second rates."""

    name: str
    set: str
    time: Array  # (N,), s, increasing
    coordinates: dict[str, Array]  # each (N,), m or rad
    rates: dict[str, Array]
    second_rates: dict[str, Array]
    branch: int = 1
    wrench: Array | None = None  # (N, 6), force and torque on the platform at o; None for the mechanism's own
    wrench_axes: Axes = "base"
    curve: Curve | None = field(default=None, repr=False)
    warnings: tuple[str, ...] = ()
    """What is in doubt about the samples that it was made of, in sentences."""

    def __post_init__(self) -> None:
        names = self.coordinates.keys()
        if not names == self.rates.keys() == self.second_rates.keys():
            raise ShapeError("coordinates, rates and second_rates must have the same names")
        for values in (self.coordinates, self.rates, self.second_rates):
            _check(self.name, self.time, values)
        if self.wrench is not None and self.wrench.shape != (*self.time.shape, 6):
            raise ShapeError(f"wrench has shape {self.wrench.shape}; needs {(*self.time.shape, 6)}")
        if self.branch not in (1, -1):
            raise MotionError([Fault("branch", f"is {self.branch}; needs 1 or -1")], self.name)
        if self.wrench_axes not in ("base", "platform"):
            needed = f'is {shown(self.wrench_axes)}; needs "base" or "platform"'
            raise MotionError([Fault("wrench_axes", needed)], self.name)

    def __repr__(self) -> str:
        return (
            f"<Motion {self.name}: {', '.join(self.coordinates)}; {len(self.time)} states "
            f"from {instant(self.time[0])} to {instant(self.time[-1])}>"
        )

    def _repr_html_(self) -> str:
        """Span, coordinates and load."""
        first, last = self.time[[0, -1]].tolist()
        rows = [
            (name, numbers(self.coordinates[name]), numbers(self.rates[name]), coordinate_unit(name))
            for name in self.coordinates
        ]
        load = "the mechanism's own" if self.wrench is None else f"given, in {self.wrench_axes} axes"
        said = f"{counted(len(self.time))} from {instant(first)} to {instant(last)}"
        table = rows_of(("coordinate", "value", "rate", "unit (per s)"), rows)
        return card(f"Motion {self.name}", said, [table], notes=[f"set {self.set}; load: {load}"])

    def to_xarray(self) -> xr.Dataset:
        """Coordinates, rates, second rates and load over `time`, named as in the dataset of a solution."""
        import xarray as xr

        prefixes = ("coordinate_", "coordinate_rate_", "coordinate_second_rate_")
        series = zip(prefixes, (self.coordinates, self.rates, self.second_rates), strict=True)
        columns = {prefix + name: column for prefix, of in series for name, column in of.items()}
        if self.wrench is not None:
            columns["wrench"] = self.wrench
        data = {
            name: (("time", *variable(name).dims), column, variable(name).attributes)
            for name, column in columns.items()
        }
        coords: dict[str, Any] = {"time": ("time", self.time, TIME)}
        if self.wrench is not None:
            coords["component"] = list(COMPONENTS)
        attrs = {"title": self.name, "coordinate_set": self.set, "branch": self.branch}
        return xr.Dataset(data, coords, {**attrs, "wrench_axes": self.wrench_axes})

    @classmethod
    def through(
        cls,
        time: ArrayLike,
        coordinates: Mapping[str, ArrayLike],
        *,
        set: str,
        name: str = "motion",
        places: Sequence[str] | None = None,
        **more: Any,
    ) -> Motion:
        """The motion through samples at `time`, by the quintic spline of `spline_through`; SI.

        `places` name the samples in `warnings`: by default "sample 1", "sample 2" and so on.
        """
        t = np.asarray(time, dtype=float)
        q = {coordinate: np.asarray(values, dtype=float) for coordinate, values in coordinates.items()}
        _check(name, t, q)
        if len(t) < 2:
            raise MotionError([Fault("time", f"has too few samples, {len(t)}; needs two or more")], name)
        made = cls.along(spline_through(t, _columns_of(q)), t, tuple(q), set=set, name=name, **more)
        named = NumberedPlaces("sample", 1, len(t)) if places is None else places
        return replace(made, warnings=tuple(warnings_about(t, q, made.second_rates, named)))

    @classmethod
    def along(cls, curve: Curve, time: Array, names: tuple[str, ...], **more: Any) -> Motion:
        """The motion on `curve`, whose last axis is `names`, sampled at `time`."""
        q, rates, second_rates = (
            dict(zip(names, np.ascontiguousarray(curve(time, nu).T), strict=True)) for nu in range(3)
        )
        return cls(time=time, coordinates=q, rates=rates, second_rates=second_rates, curve=curve, **more)

    def sample(self, time: ArrayLike) -> Motion:
        """The motion resampled at other instants, (N,) in s, increasing, from its first to its last.

        It follows `curve`, or without one, between two of its samples, the quintic that has their values,
        rates and second rates. The wrench is linear between samples.
        """
        t = np.asarray(time, dtype=float)
        start, end = self.time[0], self.time[-1]
        if outside := t[~((start <= t) & (t <= end))].tolist():
            message = f"is {outside[0]} s; the motion lasts from {start} s to {end} s"
            raise MotionError([Fault("time", message)], self.name)
        known = map(_columns_of, (self.coordinates, self.rates, self.second_rates))
        curve = self.curve or _quintics(self.time, *known)
        moved = Motion.along(curve, t, tuple(self.coordinates), name=self.name, set=self.set)
        wrench = None if self.wrench is None else linear(t, self.time, self.wrench)
        return replace(
            moved,
            branch=self.branch,
            wrench=wrench,
            wrench_axes=self.wrench_axes,
            warnings=self.warnings,
        )


def _check(name: str, time: Array, values: Mapping[str, Array]) -> None:
    """Raise unless `values` are finite numbers at increasing times."""
    arrays = {"time": time, **values}
    for key, array in arrays.items():
        if array.ndim != 1 or array.shape != time.shape:
            raise ShapeError(f"{key} has shape {array.shape}; needs (N,), the same for all")
    faults = [
        Fault(key, f"holds {array[~np.isfinite(array)][0]}; needs finite numbers")
        for key, array in arrays.items()
        if not np.isfinite(array).all()
    ]
    faults += not_increasing(itertools.repeat("time"), time)
    if faults:
        raise MotionError(faults, name)


def _columns_of(values: Mapping[str, Array]) -> Array:
    return np.stack(list(values.values()), axis=-1)


def not_increasing(places: Iterable[str], times: ArrayLike) -> list[Fault]:
    """Faults of times (N,) that do not increase, each at its place."""
    given = np.asarray(times, dtype=float)
    if np.all(np.diff(given) > 0.0):
        return []
    faults, before = [], -math.inf
    for place, time in zip(places, given.tolist(), strict=False):
        if time <= before:
            faults.append(Fault(place, f"time is {time} after {before}; it must increase"))
        if math.isfinite(time):
            before = time
    return faults


# --- curves -------------------------------------------------------------------------------------------------


def spline_through(time: Array, values: Array) -> Curve:
    """The quintic spline, with four continuous derivatives, through samples that may begin and end in motion.

    "Not-a-knot" at both ends: the first three intervals share one polynomial, and so do the last three, which
    makes the spline exact for polynomials up to degree 5 and of sixth order elsewhere. Fewer than six samples
    are joined by the one polynomial that passes through them.
    """
    spline: Curve = make_interp_spline(time, values, k=min(5, len(time) - 1))
    return spline


def quintic(time: Array, values: Array) -> Curve:
    """The quintic spline, with four continuous derivatives, through all keyframes, at rest at both ends.

    At rest: velocity and acceleration are zero.
    """
    zero = np.zeros(values.shape[1])
    at_rest: Any = [(1, zero), (2, zero)]  # order of the derivative, value
    spline: Curve = make_interp_spline(time, values, k=5, bc_type=(at_rest, at_rest))
    return spline


def minimum_jerk(time: Array, values: Array) -> Curve:
    """From rest to rest between consecutive keyframes, q0 + (q1 - q0) (10 s^3 - 15 s^4 + 6 s^5).

    Of all such movements this has the least integral of squared jerk. Flash and Hogan, The coordination of
    arm movements, J. Neuroscience 5 (1985) 1688-1703.
    """
    return _quintics(time, values, np.zeros_like(values), np.zeros_like(values))


SPLINES = {"quintic": quintic, "minimum-jerk": minimum_jerk}


def _quintics(time: Array, values: Array, rates: Array, second_rates: Array) -> Curve:
    """One quintic for each interval, fixed by value, rate and second rate at both of its ends."""
    curve: Curve = BPoly.from_derivatives(time, np.stack([values, rates, second_rates], axis=1))
    return curve


def linear(time: Array, at: Array, values: Array) -> Array:
    """Columns of values, known at some times, at other times: straight lines in between."""
    return np.stack([np.interp(time, at, column) for column in values.T], axis=-1)
