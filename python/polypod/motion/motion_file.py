"""Files of motions, and the built-in ones.

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

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import resources
from importlib.resources.abc import Traversable
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

import numpy as np
from annotated_types import Ge
from pydantic import Strict, create_model

from polypod.errors import Fault, MotionError, UnknownNameError, alternatives, shown
from polypod.files.csv_columns import (
    Column,
    CsvTable,
    columns_to_si,
    name_of,
    read_header,
    read_numbers,
    read_rows,
)
from polypod.files.tables import Number, Table, Vector, read_table
from polypod.files.text import read_text
from polypod.files.toml_lines import read_toml, with_lines
from polypod.files.units import KIND_OF_COORDINATE, MOTION_KINDS, read_units
from polypod.motion.motion import SPLINES, Array, Axes, Motion, linear, not_increasing

KIND_OF_WRENCH: dict[str, str | None] = {
    **dict.fromkeys(("force_x", "force_y", "force_z"), "force"),
    **dict.fromkeys(("torque_x", "torque_y", "torque_z"), "torque"),
}

CoordinateSets = Mapping[str, tuple[str, ...]]


class HasCoordinateSets(Protocol):
    """Interface that a motion needs of a mechanism."""

    @property
    def dof(self) -> int:
        """Degrees of freedom of the platform."""

    @property
    def coordinate_sets(self) -> CoordinateSets:
        """Names of the coordinates of each set."""


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
    motion = read(_text_of(file, source), str(source), mech)
    return replace(motion, branch=branch or motion.branch, wrench_axes=wrench_axes or motion.wrench_axes)


def motion_text(source: str | PathLike[str]) -> str:
    """The text of such a file or built-in motion."""
    return _text_of(_find(source), source)


def _text_of(file: Traversable, source: str | PathLike[str]) -> str:
    text = read_text(file)
    if isinstance(text, Fault):
        raise MotionError([text], str(source))
    return text


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

    Of the set `pose` those that `names` gives, if they are as many as the mechanism has degrees of freedom:
    the others are then dependent.
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
    table = read_rows(text)
    if isinstance(table, Fault):
        raise MotionError([table], source)
    if table is None:
        message = "is empty; needs a header such as time [s], x [mm], ... and two samples or more"
        raise MotionError([Fault("file", message)], source)
    faults: list[Fault] = []
    sets = _sets(mech, map(name_of, table.header))
    columns = _columns(table.header, table.place, sets, faults)
    samples = _samples(table, columns, faults)
    if faults:
        raise MotionError(faults, source)
    by_name = {column.name: samples[:, i] for i, column in enumerate(columns) if column}
    chosen = _nearest_set(by_name.keys() & KIND_OF_COORDINATE.keys(), sets)
    wrench = None
    if by_name.keys() & KIND_OF_WRENCH.keys():
        zero = np.zeros(len(samples))
        wrench = np.stack([by_name.get(component, zero) for component in KIND_OF_WRENCH], axis=-1)
    q = {name: by_name[name] for name in sets[chosen]}
    return Motion.through(
        by_name["time"], q, set=chosen, name=Path(source).stem, places=table.places, wrench=wrench
    )


def _columns(header: list[str], place: str, sets: CoordinateSets, faults: list[Fault]) -> list[Column | None]:
    """The columns that a header names, None for an unknown one."""
    coordinates = {name: KIND_OF_COORDINATE[name] for names in sets.values() for name in names}
    kinds = {"time": "time"} | coordinates | KIND_OF_WRENCH
    rotations = _other_rotations([name for name in map(name_of, header) if name not in kinds])
    faults += [Fault(place, message) for message in rotations.values()]
    told = {name for names in rotations for name in names}
    columns = read_header(header, place, kinds, faults, told)
    named = dict.fromkeys(column.name for column in columns if column)
    if "time" not in named:
        faults.append(Fault(place, "there is no column time [s]"))
    # What is to be given in place of another rotation has been said.
    given = (named.keys() | set(ROTATION if told else ())) & coordinates.keys()
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


ROTATION = ("rx", "ry", "rz")
"""Coordinates that a rotation is given in: R = Rx(rx) Ry(ry) Rz(rz) [T22]."""

_ROLL_PITCH_YAW = re.compile(r"(?i)(roll|pitch|yaw)(_?angle)?")
_QUATERNION = re.compile(r"(?i)(q|quat|quaternion|orientation)[._]?([wxyzijkrs]|[0-4])")


def _other_rotations(names: Sequence[str]) -> dict[tuple[str, ...], str]:
    """Names of columns that are other numbers of a rotation, and what to give in their place."""
    needed = "a rotation is given by rx, ry, rz, of R = Rx(rx) Ry(ry) Rz(rz)"
    angles = tuple(name for name in names if _ROLL_PITCH_YAW.fullmatch(name))
    parts = tuple(name for name in names if _QUATERNION.fullmatch(name))
    told = {}
    if angles:
        told[angles] = (
            f"{', '.join(angles)}: {needed}; roll, pitch and yaw are mostly the angles of "
            "R = Rz(yaw) Ry(pitch) Rx(roll): with SciPy, "
            'Rotation.from_euler("xyz", [roll, pitch, yaw]).as_euler("XYZ") makes rx, ry, rz of them'
        )
    if parts:
        told[parts] = (
            f"{', '.join(parts)}: a quaternion; {needed}: with SciPy, "
            'Rotation.from_quat([x, y, z, w]).as_euler("XYZ") makes them of it'
        )
    return told


def _samples(table: CsvTable, columns: list[Column | None], faults: list[Fault]) -> Array:
    """The numbers below the header, SI, (N, columns); NaN where there is a fault."""
    samples = read_numbers(table, columns, faults)
    if len(samples) < 2:
        faults.append(Fault("file", f"has too few samples, {len(samples)}; needs two or more"))
    for i, column in enumerate(columns):
        if column and column.name == "time":
            faults += not_increasing(table.places, samples[:, i])
    return columns_to_si(samples, columns)


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
    data = read_toml(text)
    if isinstance(data, Fault):
        raise MotionError([data], source)

    def refused(faults: Iterable[Fault]) -> MotionError:
        return MotionError(with_lines(faults, text), source)

    faults = [Fault(k, f"is no key here; {alternatives(k, _SECTIONS)}") for k in data if k not in _SECTIONS]
    settings = read_table(_Settings, data.get("motion", {}), "motion", faults)
    wrench = read_table(_Wrench, data.get("wrench", {}), "wrench", faults) or _Wrench()
    tables = data.get("keyframes", [])
    if not isinstance(tables, list) or len(tables) < 2:
        found = "is a table, [keyframes]; " if isinstance(tables, dict) else ""
        faults.append(Fault("keyframes", f"{found}needs two tables [[keyframes]] or more"))
        tables = []

    given = {key for table in tables if isinstance(table, dict) for key in table}
    sets = _sets(mech, given)
    chosen = settings.coordinates if settings else ""
    if chosen not in sets:
        if settings:
            message = f"is {shown(chosen)}, no coordinate set of the mechanism; {alternatives(chosen, sets)}"
            # Which names the keyframes should have is then open: no more can be said of them.
            raise refused([*faults, Fault("motion.coordinates", message)])
        chosen = _nearest_set(given, sets)
    model = _keyframe(sets[chosen])
    read = [read_table(model, table, f"keyframes.{i}", faults) for i, table in enumerate(tables, 1)]
    frames = [frame.model_dump() for frame in read if frame]
    if len(frames) == len(tables):
        places = [f"keyframes.{i}.time" for i in range(1, len(frames) + 1)]
        faults += not_increasing(places, [frame["time"] for frame in frames])

    loads = [wrench.model_dump(), *frames]
    loaded = {kind for kind in ("force", "torque") if any(load[kind] for load in loads)}
    used = {"time", *loaded, *filter(None, map(KIND_OF_COORDINATE.get, sets[chosen]))}
    units, unit_faults = read_units(data.get("units", {}), used, MOTION_KINDS)
    if faults or unit_faults or not settings:
        raise refused([*unit_faults, *faults])

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
        load = linear(time, at, np.hstack([column("force", "force"), column("torque", "torque")]))
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
