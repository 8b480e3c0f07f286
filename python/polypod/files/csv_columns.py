"""CSV files whose header names quantities and their units, such as `time [s], x [mm]`.

Lines that begin with # are comments. Faults are collected, each with its line and column.
"""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polypod.errors import Fault, alternatives, shown
from polypod.files.units import UNITS, to_si, valid_units

Array = NDArray[np.float64]
Row = tuple[str, list[str]]  # place, cells


class Column(NamedTuple):
    """A column's quantity; without kind, its numbers have no unit."""

    name: str
    kind: str | None
    unit: str


def read_rows(text: str) -> list[Row] | Fault:
    """The lines that are neither empty nor comments, the header first; or what keeps them from being read."""
    reader = csv.reader(text.splitlines(), skipinitialspace=True)
    try:
        rows = [(f"line {reader.line_num}", [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        return Fault(f"line {reader.line_num}", f"is no row of a CSV file: {error}")
    rows = [(place, row) for place, row in rows if any(row) and not row[0].startswith("#")]
    if rows and (separator := _other_separator(rows[0][1])):
        return Fault(rows[0][0], f"has {separator} between its columns; {_SEPARATED}")
    return rows


_SEPARATED = "needs commas there, and points in numbers, as in 0.5, 1.25"


def _other_separator(header: list[str]) -> str | None:
    """What stands between the columns of a header in place of commas."""
    text = ",".join(header)
    for char, name in {";": "semicolons", "\t": "tabs", "|": "bars"}.items():
        if text.count(char) > text.count(","):
            return name
    # Each name with its unit ends a column.
    return "spaces" if len(header) == 1 and text.count("]") > 1 else None


def read_header(
    header: list[str],
    place: str,
    kinds: Mapping[str, str | None],
    faults: list[Fault],
    told: Collection[str] = (),
) -> list[Column | None]:
    """The columns that a header names, None for an unknown one; `kinds`: valid name → kind of quantity.

    Unknown names that are `told` of otherwise are no faults here.
    """
    columns: list[Column | None] = []
    for cell in header:
        column, message = _column(cell, kinds)
        if name_of(cell) in told:
            message = None
        columns.append(column)
        if message:
            faults.append(Fault(place, f"column {shown(cell)} {message}"))
    count = Counter(column.name for column in columns if column)
    faults += [Fault(place, f"column {name} stands there {n} times") for name, n in count.items() if n > 1]
    return columns


def name_of(cell: str) -> str:
    """The name in a cell of the header, without its unit."""
    return cell.partition("[")[0].strip()


def _column(cell: str, kinds: Mapping[str, str | None]) -> tuple[Column | None, str | None]:
    """The column that a cell of the header names, as far as it does, and what is wrong."""
    parts = re.fullmatch(r"([^\[\]]+?)\s*(?:\[(.*)\])?", cell)
    if not parts:
        return None, "must be a name and a unit, such as x [mm]"
    name, unit = parts[1], (parts[2] or "").strip()
    if name not in kinds:
        return None, f"is unknown; {alternatives(name, kinds)}"
    kind = kinds[name]
    valid = UNITS[kind] if kind else ("", "1")
    if unit in valid:
        return Column(name, kind, unit), None
    problem = f"has the unit {shown(unit)}" if unit else "has no unit"
    return Column(name, None, ""), f"{problem}; {valid_units(unit, kind) if kind else 'it needs none'}"


def read_numbers(body: list[Row], columns: Sequence[Column | None], faults: list[Fault]) -> Array:
    """The numbers below the header as they stand there, (rows, columns); NaN where there is a fault."""
    numbers = np.full((len(body), len(columns)), np.nan)
    for numbers_of_row, (place, row) in zip(numbers, body, strict=True):
        if len(row) != len(columns):
            faults.append(Fault(place, f"has {len(row)} cells; the header has {len(columns)}"))
            continue
        for i, (cell, column) in enumerate(zip(row, columns, strict=True)):
            with suppress(ValueError):
                numbers_of_row[i] = float(cell)
            if not math.isfinite(numbers_of_row[i]):
                name = column.name if column else f"number {i + 1}"
                faults.append(Fault(place, f"column {name} is {shown(cell)}; needs a finite number"))
    return numbers


def columns_to_si(numbers: Array, columns: Sequence[Column | None]) -> Array:
    """The numbers in SI."""
    si = numbers.copy()
    for i, column in enumerate(columns):
        if column and column.kind:
            si[:, i] = to_si(numbers[:, i], column.kind, column.unit)
    return si
