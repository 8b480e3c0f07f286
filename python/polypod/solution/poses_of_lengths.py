"""Files of leg lengths, and the poses that have them.

A CSV file has one row for each set of lengths; its header names legs and units:

    1 [mm], 2 [mm], 3 [mm], 4 [mm], 5 [mm]

The columns stand in any order. Those of legs without actuator may be left out: their lengths are not read.
"""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.answers.status import Status
from polypod.errors import CoordinateError, Fault, LengthsError
from polypod.files.csv_columns import columns_to_si, read_header, read_numbers, read_rows
from polypod.files.text import read_text, replacing
from polypod.files.units import KIND_OF_COORDINATE, si_unit
from polypod.mechanism import Mechanism

Array = NDArray[np.float64]


def load_lengths(source: str | PathLike[str], mech: Mechanism) -> Array:
    """The leg lengths ℓ in a CSV file, (N, n), m, in the order of the mechanism's legs; NaN where not given.

    Raises LengthsError with all faults of the file.
    """
    text = read_text(Path(source))
    table = text if isinstance(text, Fault) else read_rows(text)
    if isinstance(table, Fault):
        raise LengthsError([table], str(source))
    if table is None or not len(table.places):
        example = ", ".join(f"{name} [mm]" for name in mech.leg_names)
        raise LengthsError(
            [Fault("file", f"needs a header such as {example} and a row or more")], str(source)
        )
    faults: list[Fault] = []
    columns = read_header(table.header, table.place, dict.fromkeys(mech.leg_names, "length"), faults)
    order = {column.name: i for i, column in enumerate(columns) if column}
    for name, actuated in zip(mech.leg_names, mech.actuated.tolist(), strict=True):
        if actuated and name not in order:
            faults.append(Fault(table.place, f"there is no column for leg {name}, such as {name} [mm]"))
    numbers = columns_to_si(read_numbers(table, columns, faults), columns)
    if faults:
        raise LengthsError(faults, str(source))
    lengths = np.full((len(numbers), mech.n_legs), np.nan)
    for leg, name in enumerate(mech.leg_names):
        if name in order:
            lengths[:, leg] = numbers[:, order[name]]
    return lengths


# --- poses --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class PosesOfLengths:
    """The poses of N sets of leg lengths, M in all, in the order of the sets, SI [T25-T28].

    Of poses that were followed `above` and `multiplicity` are NaN: one pose alone does not determine them.
    """

    mech: Mechanism
    row_status: NDArray[np.uint8]  # (N,), of each set
    number: NDArray[np.int64]  # (N,), how many poses it has
    mode: NDArray[np.int64]  # (M,), number of the pose among those of its set, from 1
    pose: Array  # (M, 4, 4)
    coordinates: dict[str, Array]  # (M,) each, of the first coordinate set
    determinant_sign: Array  # (M,), of det J; NaN where it is not known
    above: Array  # (M,), 1 on that side of the base joints where the platform is at home, else 0
    multiplicity: Array  # (M,), poses that meet in this one
    residual: Array  # (M,), m
    status: NDArray[np.uint8]  # (M,), of each pose

    @property
    def row(self) -> NDArray[np.int64]:
        """(M,): the set that each pose belongs to, from 1."""
        return np.repeat(np.arange(1, len(self.number) + 1), self.number)

    @property
    def without_pose(self) -> int:
        """Sets that have no pose."""
        return int(np.sum(self.number == 0))

    @property
    def incomplete(self) -> int:
        """Sets that have poses, of which one may be missing."""
        return int(np.sum((self.number > 0) & (self.row_status == Status.NOT_CONVERGED)))

    @cached_property
    def rotation(self) -> dict[str, Array]:
        """Angles of the rotation, (M,) each: those of the first coordinate set, or rx, ry, rz of `tool`."""
        angles = {name: q for name, q in self.coordinates.items() if KIND_OF_COORDINATE[name] == "angle"}
        if "axis_x" not in self.coordinates:
            return angles
        pose = self.mech.coordinates(self.pose, "pose")
        return {name: pose[name] for name in ("rx", "ry", "rz")}

    def facts(self) -> dict[str, Any]:
        """All of it as plain data: `rows` has one entry for each set, and in it `modes` one for each pose."""
        numbers = {
            "mode": self.mode.tolist(),
            "pose": self.pose.tolist(),
            "coordinates": [
                {name: _known(x) for name, x in zip(self.coordinates, of, strict=True)}
                for of in zip(*(q.tolist() for q in self.coordinates.values()), strict=True)
            ],
            "determinant_sign": _whole(self.determinant_sign),
            "above": [None if x is None else bool(x) for x in _whole(self.above)],
            "multiplicity": _whole(self.multiplicity),
            "residual": self.residual.tolist(),
            "status": [Status(code).name for code in self.status.tolist()],
        }
        modes = iter([dict(zip(numbers, of, strict=True)) for of in zip(*numbers.values(), strict=True)])
        rows = [
            {
                "row": row,
                "status": Status(code).name,
                "message": Status(code).message,
                "modes": list(itertools.islice(modes, count)),
            }
            for row, (code, count) in enumerate(
                zip(self.row_status.tolist(), self.number.tolist(), strict=True), 1
            )
        ]
        return {
            "mechanism": self.mech.name,
            "coordinate_set": next(iter(self.mech.coordinate_sets)),
            "rows": rows,
            "without_pose": self.without_pose,
            "incomplete": self.incomplete,
        }

    def save(self, path: str | PathLike[str]) -> None:
        """Write a CSV file with one line for each pose.

        The position of o, the other numbers of the coordinate set and of the rotation, SI; cells without
        answer are empty.
        """
        others = {name: q for name, q in self.coordinates.items() if name not in ("x", "y", "z")}
        others |= {name: q for name, q in self.rotation.items() if name not in others}
        columns: dict[str, list[Any]] = {"row": self.row.tolist(), "mode": self.mode.tolist()}
        columns |= {f"{name} [m]": self.pose[:, i, 3].tolist() for i, name in enumerate("xyz")}
        for name, q in others.items():
            kind = KIND_OF_COORDINATE[name]
            columns[f"{name} [{si_unit(kind)}]" if kind else name] = [_known(x) for x in q.tolist()]
        columns["determinant_sign"] = _whole(self.determinant_sign)
        columns["above"], columns["multiplicity"] = _whole(self.above), _whole(self.multiplicity)
        columns["residual [m]"] = self.residual.tolist()
        columns["status"] = [Status(code).name for code in self.status.tolist()]
        with replacing(Path(path)) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(zip(*columns.values(), strict=True))


def all_modes(mech: Mechanism, lengths: ArrayLike) -> PosesOfLengths:
    """All poses with each set of leg lengths (N, n), m [T28]."""
    found = mech.assembly_modes(lengths)
    count: NDArray[np.int64] = np.asarray(found.number, dtype=np.int64)
    known = np.arange(found.pose.shape[1]) < count[:, None]
    pose = found.pose[known]
    return PosesOfLengths(
        mech,
        row_status=found.status,
        number=count,
        mode=1 + np.nonzero(known)[1],
        pose=pose,
        coordinates=mech.coordinates(pose),
        determinant_sign=found.determinant_sign[known].astype(float),
        above=found.above[known].astype(float),
        multiplicity=found.multiplicity[known].astype(float),
        residual=found.residual[known],
        status=found.mode_status[known],
    )


def followed(mech: Mechanism, lengths: ArrayLike, mode: int | None = None) -> PosesOfLengths:
    """The pose with each set of leg lengths (N, n), m, followed along the rows [T25-T27].

    From home, or from a mode of the first row, counted from 1 as `all_modes` does. From a home that is nearly
    singular, as the published one, few lengths are reached.

    Raises:
        CoordinateError: the first row has no mode of that number.
    """
    guess = None if mode is None else _mode_of_first_row(mech, np.asarray(lengths), mode)
    found = mech.forward_kinematics(lengths, guess, continued=True)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(found.pose).all(axis=(-2, -1)))
    pose, unknown = found.pose[known], np.full(int(np.sum(known)), np.nan)
    return PosesOfLengths(
        mech,
        row_status=found.status,
        number=known.astype(np.int64),
        mode=np.full(len(pose), mode or 1),
        pose=pose,
        coordinates=mech.coordinates(pose),
        determinant_sign=np.sign(mech.determinant(pose).determinant),
        above=unknown,
        multiplicity=unknown,
        residual=found.residual[known],
        status=found.status[known],
    )


def _mode_of_first_row(mech: Mechanism, lengths: Array, mode: int) -> Array:
    first = mech.assembly_modes(lengths[0])
    if not 1 <= mode <= first.number:
        has = f"modes 1 to {first.number}" if first.number else "no mode"
        raise CoordinateError(f"mode {mode} cannot be followed: the first row of lengths has {has}")
    pose: Array = first.pose[mode - 1]
    return pose


def _known(x: float) -> float | None:
    return x if math.isfinite(x) else None


def _whole(values: Array) -> list[int | None]:
    """Whole numbers, None for NaN."""
    return [None if math.isnan(x) else int(x) for x in values.tolist()]
