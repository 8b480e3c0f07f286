"""Solutions: everything computed along a motion, as one labelled dataset that survives files bit for bit."""

from __future__ import annotations

import csv
import itertools
import json
import math
from contextlib import closing
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from polypod.answers.notebook import Rows, card, counted, numbers, outcomes, rows_of
from polypod.answers.status import Status
from polypod.errors import Fault, SolutionError
from polypod.files.text import read_text, replacing
from polypod.files.units import instant
from polypod.solution.netcdf_store import WrittenInPlace
from polypod.solution.singularity_crossings import warnings_of

_FORMAT = "polypod solution 1"

OF_LEGS = ("length", "rate", "force")
OF_STATES = ("actuator_power", "power_residual", "sigma_min", "condition")
"""Variables that its card shows."""


@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """Results over time, SI, in `dataset`: variables with `units` and `long_name`, dimension `time` first.

    The attributes of the dataset tell where it comes from: mechanism (TOML text), motion, version.
    """

    dataset: xr.Dataset

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Solution) and self.dataset.identical(other.dataset)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "<{}; {}>".format(*self._heading())

    def _repr_html_(self) -> str:
        """Outcomes, legs, power and conditioning; how a simulation ended; singularities that are passed."""
        data, notes = self.dataset, []
        if self.end:
            notes.append(f"ended at {instant(self.end['time'])}: {self.end['reason']}")
        if "singularities" in data.attrs:
            notes += [f"⚠ {text}" for text in (*self.warnings, *warnings_of(self.singularities))]
        tables: list[Rows] = []
        legs = [name for name in OF_LEGS if name in data and data[name].dims == ("time", "leg")]
        if legs:
            rows = [
                (str(leg), *(numbers(data[name].sel(leg=leg)) for name in legs)) for leg in data["leg"].values
            ]
            tables.append(rows_of(("leg", *(_header(data[name]) for name in legs)), rows))
        whole = [(_header(data[name]), numbers(data[name])) for name in OF_STATES if name in data]
        tables.append(rows_of(("along the motion", ""), whole))
        notes.append(f"{len(data.data_vars)} variables in .dataset")
        return card(*self._heading(), tables, notes=notes)

    def _heading(self) -> tuple[str, str]:
        """Its title, and how many states of which outcomes."""
        data = self.dataset
        said = []
        if "time" in data and data.sizes["time"]:
            first, last = data["time"].to_numpy()[[0, -1]].tolist()
            said.append(f"{counted(data.sizes['time'])} from {instant(first)} to {instant(last)}")
        if "status" in data:
            said.append(outcomes(data["status"], Status))
        return f"Solution: {data.attrs.get('title', '')}".removesuffix(": "), ": ".join(said)

    def to_xarray(self) -> xr.Dataset:
        """The dataset, for those who ask every result alike."""
        return self.dataset

    @property
    def singularities(self) -> dict[str, Any]:
        """Singular poses that the motion crosses, touches or comes near, see `singularity_crossings`."""
        findings: dict[str, Any] = json.loads(self.dataset.attrs["singularities"])
        return findings

    @property
    def warnings(self) -> list[str]:
        """Sentences for the user about the motion: its samples, its way from home, forces that are zero."""
        found: list[str] = json.loads(self.dataset.attrs.get("warnings", "[]"))
        return found

    @property
    def end(self) -> dict[str, Any] | None:
        """When and why a simulation ended: `time`, s, `kind` and `reason` of `polypod.solution.simulate.End`.

        None for the solution of a given motion.
        """
        ended: dict[str, Any] | None = json.loads(self.dataset.attrs.get("end", "null"))
        return ended

    def save(self, path: str | PathLike[str]) -> None:
        """Write a NetCDF 3 file (`.nc`) or a table (`.csv`: one row for each instant); both load back equal.

        The file appears whole or not at all. Raises SolutionError where it cannot be written.
        """
        path = Path(path)
        write = {".nc": _write_netcdf, ".csv": _write_csv}.get(path.suffix)
        if write is None:
            raise SolutionError(_unknown_suffix(path))
        try:
            with replacing(path) as temporary:
                write(self.dataset, temporary)
        except OSError as error:
            raise SolutionError(f"{path} cannot be written: {error.strerror or error}") from error


def _header(variable: Any) -> str:
    """Such as "leg length r / m"."""
    attrs = variable.attrs
    unit = attrs.get("units", "")
    name = f"{attrs.get('long_name', variable.name)} {attrs.get('symbol', '')}".rstrip()
    return name + (f" / {unit}" if unit not in ("", "1") else "")


def load_solution(path: str | PathLike[str]) -> Solution:
    """The solution that `Solution.save` wrote. Raises SolutionError for a file that is not one."""
    path = Path(path)
    read = {".nc": _read_netcdf, ".csv": _read_csv}.get(path.suffix)
    if read is None:
        raise SolutionError(_unknown_suffix(path))
    if not path.is_file():
        raise SolutionError(f"{path} does not exist")
    try:
        return Solution(read(path))
    except Exception as error:  # whatever a damaged file makes of the libraries that read it
        raise SolutionError(f"{path} is no whole Polypod solution: {error}") from error


def _unknown_suffix(path: Path) -> str:
    return f"{path} ends in {path.suffix!r}; a solution's file ends in .nc or .csv"


# --- NetCDF ------------------------------------------------------------------------------------------------


def _write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    # NetCDF 3 takes a dimension of length 0 for an unlimited one, so empty variables travel as an attribute.
    empty = [outline for outline in _outlines(dataset) if 0 in outline["shape"]]
    file = dataset.drop_vars([outline["name"] for outline in empty])
    file = file.assign_attrs(polypod_format=_FORMAT, polypod_empty=_json(empty))
    with closing(WrittenInPlace(str(path), mode="w")) as store:
        file.dump_to_store(store)


def _read_netcdf(path: Path) -> xr.Dataset:
    dataset = xr.load_dataset(path, engine="scipy", decode_times=False)
    _check(dataset.attrs.pop("polypod_format", None) == _FORMAT, f"it does not say {_FORMAT!r}")
    empty = json.loads(dataset.attrs.pop("polypod_empty"))
    return _with_variables(dataset, [outline | {"values": []} for outline in empty])


# --- CSV ---------------------------------------------------------------------------------------------------


def _write_csv(dataset: xr.Dataset, path: Path) -> None:
    """Comment lines with all but the numbers over time, which follow as a table.

    The comments: format; attributes; for each variable its outline, with its values if not in the table.
    """
    outlines = _outlines(dataset)
    columns: list[list[Any]] = []
    for outline in outlines:
        values = dataset[outline["name"]].values
        if _in_table(outline):
            numbers = values.astype(np.result_type(values, np.int8))  # truth as 0 or 1
            columns += numbers.reshape(len(numbers), _width(outline)).T.tolist()
        else:
            outline["values"] = values.ravel().tolist()
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {line}\n" for line in [_FORMAT, *map(_json, [dataset.attrs, *outlines])])
        writer = csv.writer(file, lineterminator="\n")  # floats by repr, which reads back as the same bits
        writer.writerow(_column_names(dataset))
        writer.writerows(zip(*columns, strict=True))


def _read_csv(path: Path) -> xr.Dataset:
    text = read_text(path)
    if isinstance(text, Fault):
        raise ValueError(text.message)
    *lines, end = text.split("\n")
    comments = [line.removeprefix("# ") for line in lines if line.startswith("# ")]
    _check(comments[:1] == [_FORMAT], f"it does not say {_FORMAT!r}")
    _check(end == "", "its last line is cut off")
    attributes, *outlines = map(json.loads, comments[1:])
    names, *rows = csv.reader(lines[len(comments) :])
    table = np.array(rows, dtype=float)
    start = 0
    for outline in filter(_in_table, outlines):
        outline["values"] = table[:, start : start + _width(outline)]
        start += _width(outline)
    dataset = _with_variables(xr.Dataset(attrs=attributes), outlines)
    _check(names == _column_names(dataset), "its columns are not those that its comment lines announce")
    return dataset


def _column_names(dataset: xr.Dataset) -> list[str]:
    """`name[leg] [unit]` for each column of the table; what has no labels is numbered from 1."""
    names = []
    for outline in filter(_in_table, _outlines(dataset)):
        labels = [
            dataset[d].values.tolist() if d in dataset.coords else range(1, dataset.sizes[d] + 1)
            for d in outline["dims"][1:]
        ]
        unit = f" [{outline['attributes']['units']}]" if outline["attributes"].get("units") else ""
        for label in itertools.product(*labels):
            place = f"[{','.join(map(str, label))}]" if label else ""
            names.append(f"{outline['name']}{place}{unit}")
    return names


def _in_table(outline: dict[str, Any]) -> bool:
    return bool(outline["dims"][:1] == ["time"])


def _width(outline: dict[str, Any]) -> int:
    return math.prod(outline["shape"][1:])


# --- both --------------------------------------------------------------------------------------------------


def _outlines(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Every variable without its values, coordinates first."""
    return [
        {
            "name": str(name),
            "coordinate": name in dataset.coords,
            "dims": list(dataset[name].dims),
            "shape": list(dataset[name].shape),
            "dtype": dataset[name].dtype.str,
            "attributes": dataset[name].attrs,
        }
        for name in [*dataset.coords, *dataset.data_vars]
    ]


def _with_variables(dataset: xr.Dataset, outlines: list[dict[str, Any]]) -> xr.Dataset:
    """The dataset with the variables that are outlined, values included."""
    for outline in outlines:
        values = np.asarray(outline["values"]).astype(outline["dtype"]).reshape(outline["shape"])
        variable = {outline["name"]: (outline["dims"], values, outline["attributes"])}
        dataset = dataset.assign_coords(variable) if outline["coordinate"] else dataset.assign(variable)
    return dataset


def _check(sound: bool, message: str) -> None:
    if not sound:
        raise ValueError(message)


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, default=lambda array: array.tolist())
