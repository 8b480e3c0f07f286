"""Results for MATLAB and Octave, as a MAT file of version 5."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from polypod.export.names import Names
from polypod.solution.solution import Solution

LONGEST_NAME = 31
"""Of a field in a file of version 5."""
ABOUT = "polypod"
"""The structure that tells what the variables are."""


def write_mat(solution: Solution, path: Path) -> None:
    """Every variable of a solution under its name, SI, time first; and the structure `polypod`.

    That has, by the names of the variables, `units`, `descriptions` and `dimensions` (their names in order),
    by the names of the dimensions `labels`, such as those of the legs; and the solution's attributes. A
    variable of one dimension is a column.
    """
    dataset = solution.dataset
    names = Names(longest=LONGEST_NAME)
    about: dict[str, Any] = {names("variable", ABOUT): {}}
    units, descriptions, dimensions, labels, variables = {}, {}, {}, {}, {}
    for key in dataset.variables:
        of, name = dataset[key], names("variable", str(key))
        if of.dtype.kind in "US":
            labels[name] = _cells(of.values.tolist())
        else:
            variables[name] = of.values
        dimensions[name] = _cells([str(dim) for dim in of.dims])
        units[name] = str(of.attrs.get("units", ""))
        descriptions[name] = str(of.attrs.get("long_name", ""))
    attributes = Names(longest=LONGEST_NAME)
    about = {attributes("field", str(key)): _plain(value) for key, value in dataset.attrs.items()}
    about |= {
        attributes("field", "units"): units,
        attributes("field", "descriptions"): descriptions,
        attributes("field", "dimensions"): dimensions,
        attributes("field", "labels"): labels,
    }
    file = variables | {names("variable", ABOUT): about}
    savemat(path, file, appendmat=False, oned_as="column", do_compression=True)


def _cells(texts: list[str]) -> np.ndarray[Any, Any]:
    """A cell array, one row for each text."""
    cells = np.empty((len(texts), 1), dtype=object)
    cells[:, 0] = texts
    return cells


def _plain(value: Any) -> Any:
    return value if isinstance(value, str) else np.asarray(value)
