"""NetCDF 3 files written from arrays where they are.

SciPy keeps all that it writes in arrays of its own, in the byte order of the file, until the file is closed:
long motions would need their memory twice.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_variable
from xarray import Variable
from xarray.backends import ScipyDataStore


class WrittenInPlace(ScipyDataStore):
    """xarray's store for SciPy's NetCDF files, with one variable at a time in the byte order of the file."""

    def prepare_variable(self, name: str, variable: Variable, *args: Any, **kwargs: Any) -> tuple[Any, Any]:
        """Puts the variable's array into the file as it is; nothing is left to assign."""
        _, data = super().prepare_variable(name, variable, *args, **kwargs)
        empty = self.ds.variables[name]
        self.ds.variables[name] = netcdf_variable(
            np.asarray(data).view(_BigEndian),
            empty.typecode(),
            empty.itemsize(),
            empty.shape,
            empty.dimensions,
            dict(variable.attrs),
        )
        return _Assigned(), data


class _Assigned:
    """Stands for a variable of the file while xarray assigns to it."""

    def __setitem__(self, key: Any, value: Any) -> None:
        """It has its values."""


class _BigEndian(np.ndarray[Any, Any]):
    """An array whose bytes are those of NetCDF, most significant first."""

    def tobytes(self, *args: Any) -> bytes:
        array: NDArray[Any] = self.view(np.ndarray)
        return array.astype(array.dtype.newbyteorder(">")).tobytes(*args)
