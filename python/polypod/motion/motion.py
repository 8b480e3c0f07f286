"""Motions: the coordinates of a mechanism over time with exact rates and second rates, and the load.

Two files make a motion. A CSV file gives samples; its header names coordinates and units:

    time [s], x [mm], y [mm], z [mm], alpha [deg], beta [deg], force_z [N]

A TOML file gives keyframes and the curve through them:

    [motion]
    coordinates = "paper"       # the coordinate set
    branch = 1                  # of the set, where it has two: 1 or -1
    spline = "quintic"          # or "minimum-jerk"
    samples = 501
    [units]
    time = "s"
    length = "mm"
    angle = "deg"
    force = "N"
    [wrench]                    # optional: force, torque, axes ("base" or "platform")
    force = [0, 0, 500]
    [[keyframes]]               # two or more, each with all coordinates; may have its own force and torque
    time = 0
    x = 0
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from importlib.resources.abc import Traversable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol

import numpy as np
from annotated_types import Ge
from numpy.typing import ArrayLike, NDArray
from pydantic import Strict, create_model
from scipy.interpolate import BPoly, make_interp_spline

from polypod.answers.variables import COMPONENTS, TIME, variable
from polypod.errors import Fault, MotionError, ShapeError, UnknownNameError, alternatives, shown
from polypod.files.csv_columns import Column, columns_to_si, read_header, read_numbers, read_rows
from polypod.files.mechanism_schema import Number, Table, Vector, read_table
from polypod.files.units import KIND_OF_COORDINATE, MOTION_KINDS, read_units

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Axes = Literal["base", "platform"]

KIND_OF_WRENCH: dict[str, str | None] = {
    **dict.fromkeys(("force_x", "force_y", "force_z"), "force"),
    **dict.fromkeys(("torque_x", "torque_y", "torque_z"), "torque"),
}

CoordinateSets = Mapping[str, tuple[str, ...]]


class HasCoordinateSets(Protocol):
    """What a motion needs of a mechanism."""

    @property
    def dof(self) -> int:
        """Freedoms of the platform."""

    @property
    def coordinate_sets(self) -> CoordinateSets:
        """Names of the coordinates of each set."""


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
            f"from {self.time[0]:g} s to {self.time[-1]:g} s>"
        )

    def _repr_html_(self) -> str:
        from polypod.cards import of_motion

        return of_motion(self)

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
        **more: Any,
    ) -> Motion:
        """The motion through samples at `time`, by the quintic spline of `spline_through`; SI."""
        t = np.asarray(time, dtype=float)
        q = {coordinate: np.asarray(values, dtype=float) for coordinate, values in coordinates.items()}
        _check(name, t, q)
        if len(t) < 2:
            raise MotionError([Fault("time", f"has too few samples, {len(t)}; needs two or more")], name)
        return cls.along(spline_through(t, _columns_of(q)), t, tuple(q), set=set, name=name, **more)

    @classmethod
    def along(cls, curve: Curve, time: Array, names: tuple[str, ...], **more: Any) -> Motion:
        """The motion on `curve`, whose last axis is `names`, sampled at `time`."""
        q, rates, second_rates = (
            dict(zip(names, np.ascontiguousarray(curve(time, nu).T), strict=True)) for nu in range(3)
        )
        return cls(time=time, coordinates=q, rates=rates, second_rates=second_rates, curve=curve, **more)

    def sample(self, time: ArrayLike) -> Motion:
        """The same motion at other instants, (N,) in s, increasing, from its first to its last.

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
        wrench = None if self.wrench is None else _linear(t, self.time, self.wrench)
        return replace(moved, branch=self.branch, wrench=wrench, wrench_axes=self.wrench_axes)


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
    faults += _not_increasing(itertools.repeat("time"), time.tolist())
    if faults:
        raise MotionError(faults, name)


def _columns_of(values: Mapping[str, Array]) -> Array:
    return np.stack(list(values.values()), axis=-1)


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


def _linear(time: Array, at: Array, values: Array) -> Array:
    return np.stack([np.interp(time, at, column) for column in values.T], axis=-1)


# --- files --------------------------------------------------------------------------------------------------


def load_motion(
    source: str | PathLike[str],
    mech: HasCoordinateSets | CoordinateSets,
    *,
    branch: Literal[1, -1] | None = None,
    wrench_axes: Axes | None = None,
) -> Motion:
    """The motion in a `.csv` or `.toml` file, or the built-in one of that name, for a mechanism.

    Its coordinate sets, which are all that is needed of the mechanism, will do in its place. `branch` and
    `wrench_axes` replace what a TOML file says; without them a CSV file means 1 and "base".
    Raises MotionError with all faults of the file, UnknownNameError for a built-in that does not exist.
    """
    file = _find(source)
    read = _read_csv if file.name.endswith(".csv") else _read_toml
    try:
        motion = read(file.read_text(encoding="utf-8-sig"), str(source), mech)
    except FileNotFoundError:
        raise MotionError([Fault("file", "does not exist")], str(source)) from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise MotionError([Fault("file", f"cannot be read: {error}")], str(source)) from error
    return replace(motion, branch=branch or motion.branch, wrench_axes=wrench_axes or motion.wrench_axes)


def motion_text(source: str | PathLike[str]) -> str:
    """The text of such a file or built-in motion."""
    return _find(source).read_text(encoding="utf-8-sig")


def motion_names() -> list[str]:
    """Names of the built-in motions."""
    return sorted(_built_in())


def _built_in() -> dict[str, Traversable]:
    folder = resources.files("polypod") / "motions"
    return {Path(file.name).stem: file for file in folder.iterdir() if file.name.endswith((".csv", ".toml"))}


def _find(source: str | PathLike[str]) -> Traversable:
    path = Path(source)
    if path.suffix in (".csv", ".toml"):
        return path
    if str(source) in (built_in := _built_in()):
        return built_in[str(source)]
    raise UnknownNameError("built-in motion (nor a .csv or .toml file)", str(source), built_in)


def _sets(mech: HasCoordinateSets | CoordinateSets, names: Iterable[str]) -> CoordinateSets:
    """The coordinate sets to choose from.

    Of the set `pose` those that `names` gives, if they are as many as the mechanism has freedoms: the others
    are then dependent.
    """
    if isinstance(mech, Mapping):
        return mech
    sets, given = dict(mech.coordinate_sets), set(names)
    independent = tuple(name for name in sets.get("pose", ()) if name in given)
    return sets | {"pose": independent} if len(independent) == mech.dof else sets


def _nearest_set(names: Iterable[str], sets: CoordinateSets) -> str:
    """The coordinate set that differs least from the names given."""
    given = set(names)
    return min(sets, key=lambda s: len(given.symmetric_difference(sets[s])))


# --- CSV ----------------------------------------------------------------------------------------------------


def _read_csv(text: str, source: str, mech: HasCoordinateSets | CoordinateSets) -> Motion:
    rows = read_rows(text)
    if not rows:
        message = "is empty; needs a header such as time [s], x [mm], ... and two samples or more"
        raise MotionError([Fault("file", message)], source)
    (place, header), *body = rows
    faults: list[Fault] = []
    sets = _sets(mech, [cell.partition("[")[0].strip() for cell in header])
    columns = _columns(header, place, sets, faults)
    samples = _samples(body, columns, faults)
    if faults:
        raise MotionError(faults, source)
    by_name = {column.name: samples[:, i] for i, column in enumerate(columns) if column}
    chosen = _nearest_set(by_name.keys() & KIND_OF_COORDINATE.keys(), sets)
    wrench = None
    if by_name.keys() & KIND_OF_WRENCH.keys():
        zero = np.zeros(len(samples))
        wrench = np.stack([by_name.get(component, zero) for component in KIND_OF_WRENCH], axis=-1)
    q = {name: by_name[name] for name in sets[chosen]}
    return Motion.through(by_name["time"], q, set=chosen, name=Path(source).stem, wrench=wrench)


def _columns(header: list[str], place: str, sets: CoordinateSets, faults: list[Fault]) -> list[Column | None]:
    """The columns that a header names, None for an unknown one."""
    coordinates = {name: KIND_OF_COORDINATE[name] for names in sets.values() for name in names}
    kinds = {"time": "time"} | coordinates | KIND_OF_WRENCH
    columns = read_header(header, place, kinds, faults)
    named = dict.fromkeys(column.name for column in columns if column)
    if "time" not in named:
        faults.append(Fault(place, "there is no column time [s]"))
    given = named.keys() & coordinates.keys()
    chosen = _nearest_set(given, sets)
    lacking = [name for name in sets[chosen] if name not in given]
    beside = [name for name in named if name in given and name not in sets[chosen]]
    if lacking or beside:
        found = [*(f"no {name}" for name in lacking), *(f"also {name}" for name in beside)]
        message = (
            f"the coordinates are no set; nearest is {chosen} ({', '.join(sets[chosen])}), but there is "
        )
        faults.append(Fault(place, message + ", ".join(found)))
    return columns


def _samples(body: list[tuple[str, list[str]]], columns: list[Column | None], faults: list[Fault]) -> Array:
    """The numbers below the header, SI, (N, columns); NaN where there is a fault."""
    samples = read_numbers(body, columns, faults)
    if len(body) < 2:
        faults.append(Fault("file", f"has too few samples, {len(body)}; needs two or more"))
    for i, column in enumerate(columns):
        if column and column.name == "time":
            faults += _not_increasing([place for place, _ in body], samples[:, i].tolist())
    return columns_to_si(samples, columns)


def _not_increasing(places: Iterable[str], times: Iterable[float]) -> list[Fault]:
    faults, before = [], -math.inf
    for place, time in zip(places, times, strict=False):
        if time <= before:
            faults.append(Fault(place, f"time is {time} after {before}; it must increase"))
        if math.isfinite(time):
            before = time
    return faults


# --- TOML ---------------------------------------------------------------------------------------------------


class _Settings(Table):
    description: str = ""
    coordinates: str
    branch: Literal[1, -1] = 1
    spline: Literal["quintic", "minimum-jerk"] = "quintic"
    samples: Annotated[int, Strict(), Ge(2)] = 501


class _Wrench(Table):
    force: Vector | None = None
    torque: Vector | None = None
    axes: Axes = "base"


_SECTIONS = ("motion", "units", "wrench", "keyframes")


def _read_toml(text: str, source: str, mech: HasCoordinateSets | CoordinateSets) -> Motion:
    data = tomllib.loads(text)
    faults = [Fault(k, f"is no key here; {alternatives(k, _SECTIONS)}") for k in data if k not in _SECTIONS]
    settings = read_table(_Settings, data.get("motion", {}), "motion", faults)
    wrench = read_table(_Wrench, data.get("wrench", {}), "wrench", faults) or _Wrench()
    tables = data.get("keyframes", [])
    if not isinstance(tables, list) or len(tables) < 2:
        faults.append(Fault("keyframes", "needs two tables [[keyframes]] or more"))
        tables = []

    given = {key for table in tables if isinstance(table, dict) for key in table}
    sets = _sets(mech, given)
    chosen = settings.coordinates if settings else ""
    if chosen not in sets:
        if settings:
            message = f"is {shown(chosen)}, no coordinate set of the mechanism; {alternatives(chosen, sets)}"
            # Which names the keyframes should have is then open: no more can be said of them.
            raise MotionError([*faults, Fault("motion.coordinates", message)], source)
        chosen = _nearest_set(given, sets)
    model = _keyframe(sets[chosen])
    read = [read_table(model, table, f"keyframes.{i}", faults) for i, table in enumerate(tables, 1)]
    frames = [frame.model_dump() for frame in read if frame]
    if len(frames) == len(tables):
        places = [f"keyframes.{i}.time" for i in range(1, len(frames) + 1)]
        faults += _not_increasing(places, [frame["time"] for frame in frames])

    loads = [wrench.model_dump(), *frames]
    loaded = {kind for kind in ("force", "torque") if any(load[kind] for load in loads)}
    used = {"time", *loaded, *filter(None, map(KIND_OF_COORDINATE.get, sets[chosen]))}
    units, unit_faults = read_units(data.get("units", {}), used, MOTION_KINDS)
    if faults or unit_faults or not settings:
        raise MotionError([*unit_faults, *faults], source)

    def column(key: str, kind: str | None) -> Array:
        """(keyframes,) or (keyframes, 3); the load is [wrench]'s where a keyframe has none."""
        default = loads[0].get(key) or [0.0, 0.0, 0.0]
        values = np.array([default if frame[key] is None else frame[key] for frame in frames])
        return units.si(values, kind) if kind else values

    at = column("time", "time")
    q = np.stack([column(name, KIND_OF_COORDINATE[name]) for name in sets[chosen]], axis=-1)
    time = np.linspace(at[0], at[-1], settings.samples)
    load = None
    if loaded:
        load = _linear(time, at, np.hstack([column("force", "force"), column("torque", "torque")]))
    return Motion.along(
        SPLINES[settings.spline](at, q),
        time,
        sets[chosen],
        set=chosen,
        name=Path(source).stem,
        branch=settings.branch,
        wrench=load,
        wrench_axes=wrench.axes,
    )


def _keyframe(names: Iterable[str]) -> type[Table]:
    """The table of one keyframe with the coordinates `names`."""
    fields: dict[str, Any] = dict.fromkeys(("time", *names), (Number, ...))
    fields |= dict.fromkeys(("force", "torque"), (Vector | None, None))
    return create_model("Keyframe", __base__=Table, **fields)
