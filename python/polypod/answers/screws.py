"""Screws at a pose: what the platform is free to do, and what its constraints hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status

Array = NDArray[np.float64]
Row = tuple[list[float], list[float], float, list[float]]


@dataclass(frozen=True, eq=False)
class Screws:
    """Screws at a pose, base axes [T66]; none where the status is not OK."""

    vector: Array
    """(k, 6): twists (v, ω) of o, of a rotation of one radian, or of a translation of one metre; or wrenches
    (F, T) at o, of a force of 1 N, or of a couple of 1 N m."""
    axis: Array
    """(k, 3): unit directions; NaN for a constraint that vanishes."""
    pitch: Array
    """(k,): slide per rotation, m/rad, infinite for a translation; torque by force, m, infinite for a
    couple."""
    point: Array
    """(k, 3): the point of the axis that is nearest to o, m; o itself where the pitch is infinite."""
    status: int
    """Why there are none, a `Status`."""

    @classmethod
    def of(cls, rows: list[Row] | None, status: Status) -> Self:
        """Those of the core's rows (vector, axis, pitch, point); SINGULAR where it has none."""
        if rows is None:
            rows, status = [], Status.SINGULAR
        table = np.array([[*vector, *axis, pitch, *point] for vector, axis, pitch, point in rows])
        table = table.reshape(-1, 13)
        return cls(table[:, :6], table[:, 6:9], table[:, 9], table[:, 10:], int(status))
