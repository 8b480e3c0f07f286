"""Files of leg lengths, and the poses that have them.

A CSV file has one row for each set of lengths; its header names legs and units:

    1 [mm], 2 [mm], 3 [mm], 4 [mm], 5 [mm]

The columns stand in any order. Those of legs without actuator may be left out: their lengths are not read.
"""

from __future__ import annotations

import csv
import math
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.answers.status import Status
from polypod.errors import CoordinateError, Fault, LengthsError
from polypod.files.csv_columns import columns_to_si, read_header, read_numbers, read_rows
from polypod.files.text import read_text
from polypod.files.units import KIND_OF_COORDINATE, si_unit
from polypod.mechanism import Mechanism

Array = NDArray[np.float64]


def load_lengths(source: str | PathLike[str], mech: Mechanism) -> Array:
    """The leg lengths ℓ in a CSV file, (N, n), m, in the order of the mechanism's legs; NaN where not given.

    Raises LengthsError with all faults of the file.
    """
    text = read_text(Path(source))
    rows = text if isinstance(text, Fault) else read_rows(text)
    if isinstance(rows, Fault):
        raise LengthsError([rows], str(source))
    if len(rows) < 2:
        example = ", ".join(f"{name} [mm]" for name in mech.leg_names)
        raise LengthsError(
            [Fault("file", f"needs a header such as {example} and a row or more")], str(source)
        )
    (place, header), *body = rows
    faults: list[Fault] = []
    columns = read_header(header, place, dict.fromkeys(mech.leg_names, "length"), faults)
    order = {column.name: i for i, column in enumerate(columns) if column}
    for name, actuated in zip(mech.leg_names, mech.actuated.tolist(), strict=True):
        if actuated and name not in order:
            faults.append(Fault(place, f"there is no column for leg {name}, such as {name} [mm]"))
    numbers = columns_to_si(read_numbers(body, columns, faults), columns)
    if faults:
        raise LengthsError(faults, str(source))
    lengths = np.full((len(body), mech.n_legs), np.nan)
    for leg, name in enumerate(mech.leg_names):
        if name in order:
            lengths[:, leg] = numbers[:, order[name]]
    return lengths


# --- poses --------------------------------------------------------------------------------------------------


def tabulate_modes(mech: Mechanism, lengths: ArrayLike) -> dict[str, Any]:
    """All poses with each set of leg lengths (N, n), m, as plain data, SI [T28].

    `rows` has one entry for each set, and in it `modes` one for each pose, both counted from 1.
    `without_pose` counts the sets that have no pose, `incomplete` those where one may be missing.
    """
    found = mech.assembly_modes(lengths)
    coordinates = mech.coordinates(found.pose)
    rows = []
    for i, (number, code) in enumerate(zip(found.number.tolist(), found.status.tolist(), strict=True)):
        modes = []
        for j in range(number):
            mode = _pose(found.pose[i, j], {name: q[i, j] for name, q in coordinates.items()}, j + 1)
            mode["determinant_sign"] = int(found.determinant_sign[i, j])
            mode["above"] = bool(found.above[i, j])
            mode["multiplicity"] = int(found.multiplicity[i, j])
            mode["residual"] = float(found.residual[i, j])
            mode["status"] = Status(int(found.mode_status[i, j])).name
            modes.append(mode)
        rows.append(_row(i + 1, Status(code), modes))
    return _table(mech, rows)


def tabulate_continued(mech: Mechanism, lengths: ArrayLike, mode: int | None = None) -> dict[str, Any]:
    """The pose with each set of leg lengths (N, n), m, followed along the rows [T25-T27].

    From home, or from a mode of the first row, counted from 1 as `tabulate_modes` does. From a home that is
    nearly singular, as the published one, few lengths are reached.
    The form is that of `tabulate_modes`, with at most one mode in a row; the side of the base and how many
    modes meet are None, as one pose alone does not determine them.

    Raises:
        CoordinateError: the first row has no mode of that number.
    """
    guess = None if mode is None else _mode_of_first_row(mech, np.asarray(lengths), mode)
    found = mech.forward_kinematics(lengths, guess, continued=True)
    coordinates = mech.coordinates(found.pose)
    sign = np.sign(mech.determinant(found.pose).determinant)
    rows = []
    for i, code in enumerate(found.status.tolist()):
        modes = []
        if np.isfinite(found.pose[i]).all():
            pose = _pose(found.pose[i], {name: q[i] for name, q in coordinates.items()}, mode or 1)
            pose["determinant_sign"] = int(sign[i]) if math.isfinite(sign[i]) else None
            pose["above"] = pose["multiplicity"] = None
            pose["residual"] = float(found.residual[i])
            pose["status"] = Status(code).name
            modes.append(pose)
        rows.append(_row(i + 1, Status(code), modes))
    return _table(mech, rows)


def _mode_of_first_row(mech: Mechanism, lengths: Array, mode: int) -> Array:
    first = mech.assembly_modes(lengths[0])
    if not 1 <= mode <= first.number:
        has = f"modes 1 to {first.number}" if first.number else "no mode"
        raise CoordinateError(f"mode {mode} cannot be followed: the first row of lengths has {has}")
    pose: Array = first.pose[mode - 1]
    return pose


def _pose(pose: Array, coordinates: dict[str, Any], number: int) -> dict[str, Any]:
    return {
        "mode": number,
        "pose": pose.tolist(),
        "coordinates": {name: float(q) if math.isfinite(q) else None for name, q in coordinates.items()},
    }


def _row(number: int, status: Status, modes: list[dict[str, Any]]) -> dict[str, Any]:
    return {"row": number, "status": status.name, "message": status.message, "modes": modes}


def _table(mech: Mechanism, rows: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "mechanism": mech.name,
        "coordinate_set": next(iter(mech.coordinate_sets)),
        "rows": rows,
        "without_pose": sum(not row["modes"] for row in rows),
        "incomplete": sum(bool(row["modes"]) and row["status"] == Status.NOT_CONVERGED.name for row in rows),
    }


def save_table(table: dict[str, Any], mech: Mechanism, path: str | PathLike[str]) -> None:
    """Write what `tabulate_modes` or `tabulate_continued` gives to a CSV file, one line for each mode.

    The position of o, then the other numbers of the coordinate set, SI; cells without answer are empty.
    """
    names = [name for name in mech.coordinates(mech.home) if name not in ("x", "y", "z")]
    plain = ("determinant_sign", "above", "multiplicity", "residual", "status")
    headers = [f"{name} [{si_unit(kind)}]" if (kind := KIND_OF_COORDINATE[name]) else name for name in names]
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        write = csv.writer(file, lineterminator="\n").writerow
        named = ["residual [m]" if name == "residual" else name for name in plain]
        write(["row", "mode", "x [m]", "y [m]", "z [m]", *headers, *named])
        for row in table["rows"]:
            for mode in row["modes"]:
                position = [line[3] for line in mode["pose"][:3]]
                rest = [mode["coordinates"][name] for name in names]
                facts = [int(fact) if isinstance(fact := mode[name], bool) else fact for name in plain]
                write([row["row"], mode["mode"], *position, *rest, *facts])
