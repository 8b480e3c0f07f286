"""Base class of answers: names and units of their arrays, datasets, and display."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polypod.answers.notebook import Rows, card, counted, numbers, outcomes, rows_of
from polypod.answers.status import Status
from polypod.answers.variables import (
    DIMENSIONS,
    HALVES,
    POSE,
    HasParts,
    Variable,
    attributes_of,
    coords_of,
    variable,
)
from polypod.errors import ShapeError

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]


class Quantity(NamedTuple):
    """An array with what it is."""

    name: str
    """The attribute of the answer, and the variable of its dataset."""
    key: str
    """Its name in `polypod.answers.variables` and in the dataset of a solution."""
    about: Variable
    values: NDArray[Any]

    @property
    def unit_differs(self) -> bool:
        """Whether the unit is that of the label, such as a limit."""
        return " or " in self.about.unit and self.about.dims in (("limit",), ("coordinate",))

    def at(self, index: int, unit: str) -> str:
        """Values at an index of the last dimension, whose label has that unit."""
        values, flags = self.values[..., index], self.about.flags
        if flags is not None:
            return outcomes(values, flags)
        return numbers(values, unit if self.unit_differs else "1")

    @property
    def shown(self) -> str:
        """The numbers with their unit, of many the range; or what codes stand for."""
        _, unit, _, _, flags = about = self.about
        if flags is not None:
            return outcomes(self.values, flags)
        if about.dims[-2:] == POSE:
            return f"o at {numbers(self.values[..., :3, 3], 'm')}"
        first, mixed, second = unit.partition(" and ")
        if mixed and about.dims[-1:] and about.dims[-1] in HALVES:
            return f"{numbers(self.values[..., :3], first)}; {numbers(self.values[..., 3:], second)}"
        return numbers(self.values, unit)

    @property
    def header(self) -> str:
        """Such as "lengths r / m"."""
        symbol, unit = self.about.symbol, self.about.unit
        unit = "" if self.unit_differs else unit
        return f"{self.name} {symbol}".rstrip() + (f" / {unit}" if unit not in ("", "1") else "")


@dataclass(eq=False, repr=False)
class Answer:
    """Named arrays over a batch of states: what a mechanism answers.

    Subclasses are dataclasses; they say in `_variables` which quantity each of their arrays is.
    """

    mech: HasParts
    """The mechanism that computed the answer."""

    _variables: ClassVar[dict[str, str]]
    """Array → its quantity, a name of `polypod.answers.variables`."""
    _same_for_all: ClassVar[frozenset[str]] = frozenset()
    """Arrays that do not have the leading axes of the batch."""

    @property
    def batch(self) -> tuple[int, ...]:
        """Leading axes: () for one state."""
        status = getattr(self, "status", None)
        return () if status is None else np.shape(status)

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """Its arrays by name."""
        return {name: getattr(self, name) for name in self._variables}

    def __iter__(self) -> Iterator[NDArray[Any]]:
        """Its arrays, in order: an answer can be unpacked."""
        return iter(self.arrays.values())

    def labels(self) -> dict[str, Sequence[Any]]:
        """Names along dimensions that only this answer knows."""
        return {}

    def quantities(self) -> list[Quantity]:
        """Its arrays with what they are."""
        return [
            Quantity(name, key, variable(key), np.asarray(array))
            for (name, array), key in zip(self.arrays.items(), self._variables.values(), strict=True)
        ]

    def to_xarray(self, *states: str) -> xr.Dataset:
        """The arrays as one dataset: legs, axes and so on by name, units and long names as attributes.

        Variables have the names of the attributes here.

        Args:
            states: names for the batch's axes; by default `state`, or `state_1`, `state_2`, ... for several.

        Raises:
            ShapeError: not one name for each axis, or a name that the dataset needs itself.

        >>> import polypod as pp
        >>> mech = pp.load("lu-3spu-2rpu-r")
        >>> poses = mech.pose({"alpha": 0.1, "p": -0.3, "h": [0.6, 0.7], "beta": 0.8, "gamma": 0.6})
        >>> legs = mech.inverse_kinematics(poses).to_xarray("height")
        >>> legs.lengths.dims, legs.lengths.attrs["units"]
        (('height', 'leg'), 'm')
        """
        import xarray as xr

        leading = self._state_dims(states)
        data, dims = {}, {*leading}
        for quantity in self.quantities():
            values, about = quantity.values, quantity.about
            if 0 in values.shape[values.ndim - len(about.dims) :]:
                continue  # a mechanism without rods or constraints has no such variables
            if values.dtype.kind == "b" or about.flags is not None:
                values = values.astype(np.int8)  # as files hold them
            of = about.dims if quantity.name in self._same_for_all else (*leading, *about.dims)
            # A variable may not have the name of a dimension.
            name = quantity.key if quantity.name in DIMENSIONS else quantity.name
            data[name] = (of, values, attributes_of(quantity.key, about, self.mech.drives))
            dims |= {*of}
        coords = coords_of(self.mech, dims, self.labels())
        title, _ = self._heading()
        return xr.Dataset(data, coords, {"title": title, "mechanism": self.mech.name})

    def _state_dims(self, states: Sequence[str]) -> tuple[str, ...]:
        count = len(self.batch)
        if not states:
            return ("state",) if count == 1 else tuple(f"state_{i + 1}" for i in range(count))
        if len(states) != count:
            raise ShapeError(f"states: {len(states)} names for the leading axes {self.batch}; needs {count}")
        own = {quantity.name for quantity in self.quantities()} | DIMENSIONS | self.labels().keys()
        for name in states:
            if name in own or states.count(name) > 1:
                raise ShapeError(f"states: {name!r} is another name of the dataset; choose a new one")
        return tuple(states)

    def _heading(self) -> tuple[str, str]:
        """Title, number of states and their outcomes."""
        title, said = f"{type(self).__name__} of {self.mech.name}", []
        if self.batch:
            product = " × ".join(map(str, self.batch))
            total = int(np.prod(self.batch))
            said.append(f"{product} = {total} states" if len(self.batch) > 1 else counted(total))
        if hasattr(self, "status"):
            said.append(outcomes(self.status, Status))
        return title, ": ".join(said)

    def __repr__(self) -> str:
        title, said = self._heading()
        quantities = [q for q in self.quantities() if q.name != "status"]
        width = max(len(q.name) for q in quantities)
        lines = [f"  {q.name:<{width}}  {q.shown}" for q in quantities]
        return "\n".join([f"{title}: {said}" if said else title, *lines])

    def _repr_html_(self) -> str:
        """For notebooks: states by status, a row for each leg, rod or limit, then everything else."""
        title, said = self._heading()
        return card(title, said, self._tables())

    def _tables(self) -> list[Rows]:
        quantities = [q for q in self.quantities() if q.name != "status"]
        named = coords_of(self.mech, {dim for q in quantities for dim in q.about.dims}, self.labels())
        tables, told = [], set()
        for dim, labels in named.items():
            columns = [q for q in quantities if q.about.dims == (dim,) and dim not in _SHOWN_WHOLE]
            if columns:
                _, units = named.get(f"{dim}_unit", (dim, ["1"] * len(labels)))
                tables.append(_by_label(dim, labels, units, columns))
                told |= {q.name for q in columns}
        return [*tables, whole_rows([q for q in quantities if q.name not in told])]


def whole_rows(quantities: Sequence[Quantity]) -> Rows:
    """A row for each quantity."""
    rows = [(q.name, q.about.long_name, " × ".join(q.about.dims), q.shown) for q in quantities]
    return Rows(("", "", "for each", ""), rows, texts=4)


_SHOWN_WHOLE = ("axis", "component")
"""Dimensions that are no rows of a table."""


def _by_label(dim: str, labels: Sequence[Any], units: Sequence[str], columns: Sequence[Quantity]) -> Rows:
    """A row for each label."""
    rows = [
        (str(label), *(q.at(i, unit) for q in columns))
        for i, (label, unit) in enumerate(zip(labels, units, strict=True))
    ]
    return rows_of((dim.replace("_", " "), *(q.header for q in columns)), rows)
