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
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polypod.errors import Fault, alternatives, shown
from polypod.files.units import UNITS, to_si, valid_units

Array = NDArray[np.float64]


class Column(NamedTuple):
    """A column's quantity; without kind, its numbers have no unit."""

    name: str
    kind: str | None
    unit: str


@dataclass(frozen=True)
class CsvTable:
    """A header and the lines below it, those that are neither empty nor comments."""

    place: str
    """Of the header."""
    header: list[str]
    places: Sequence[str]
    """Of the lines below."""
    cells: list[list[str]] | None
    """Of the lines below; None where these are numbers alone."""
    numbers: Array | None
    """(rows, columns), the numbers as they stand there, if all cells are finite ones."""


class NumberedPlaces(Sequence[str]):
    """Places such as "line 3", "line 4" and so on, made when they are asked for."""

    def __init__(self, word: str, first: int, count: int) -> None:
        self._word, self._numbers = word, range(first, first + count)

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, index: Any) -> Any:
        found = self._numbers[index]
        return [f"{self._word} {k}" for k in found] if isinstance(found, range) else f"{self._word} {found}"


def read_rows(text: str) -> CsvTable | Fault | None:
    """The table of a CSV file, or what keeps it from being read; None if there is no header."""
    lines = text.splitlines()
    reader = csv.reader(lines, skipinitialspace=True)
    try:
        header = next(filter(_counts, map(_stripped, reader)), None)
        if header is None:
            return None
        place, first = f"line {reader.line_num}", reader.line_num
        if separator := _other_separator(header):
            return Fault(place, f"has {separator} between its columns; {_SEPARATED}")
        if (numbers := _numbers_alone(lines[first:], len(header))) is not None:
            return CsvTable(place, header, NumberedPlaces("line", first + 1, len(numbers)), None, numbers)
        rows = [(f"line {reader.line_num}", row) for row in map(_stripped, reader) if _counts(row)]
    except csv.Error as error:
        return Fault(f"line {reader.line_num}", f"is no row of a CSV file: {error}")
    return CsvTable(place, header, [place for place, _ in rows], [row for _, row in rows], None)


def _stripped(row: list[str]) -> list[str]:
    return [cell.strip() for cell in row]


def _counts(row: list[str]) -> bool:
    return any(row) and not row[0].startswith("#")


def _numbers_alone(lines: list[str], width: int) -> Array | None:
    """The numbers of lines that hold nothing else, by the parser of numpy; None for any other lines."""
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        return None
    try:
        numbers: Array = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    whole = numbers.shape == (len(lines), width) and np.isfinite(numbers).all()
    return numbers if whole else None


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


def read_numbers(table: CsvTable, columns: Sequence[Column | None], faults: list[Fault]) -> Array:
    """The numbers below the header as they stand there, (rows, columns); NaN where there is a fault."""
    if table.numbers is not None:
        return table.numbers
    rows = table.cells or []
    numbers = np.full((len(rows), len(columns)), np.nan)
    for numbers_of_row, place, row in zip(numbers, table.places, rows, strict=True):
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
