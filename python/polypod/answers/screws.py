"""Screws at a pose: what the platform is free to do, and what its constraints hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.answers.status import Status
from polypod.arrays import doubles

if TYPE_CHECKING:
    from polypod.mechanism import Mechanism

Array = NDArray[np.float64]
Row = tuple[list[float], list[float], float, list[float]]


@dataclass(frozen=True, eq=False)
class Screws:
    """Screws at a pose, base axes [T66]; none where the status is not OK."""

    vector: Array
    """(k, 6): twists (v, ω) of o, of a turn of one radian, or of a translation of one metre; or wrenches
    (F, T) at o, of a force of 1 N, or of a couple of 1 N m."""
    axis: Array
    """(k, 3): unit directions; NaN for a constraint that vanishes."""
    pitch: Array
    """(k,): slide by turn, m/rad, infinite for a translation; torque by force, m, infinite for a couple."""
    point: Array
    """(k, 3): the point of the axis that is nearest to o, m; o itself where the pitch is infinite."""
    status: int
    """Why there are none, a `Status`."""


def freedom_screws(mech: Mechanism, pose: ArrayLike) -> Screws:
    """See `Mechanism.freedom_screws`."""
    matrix, status = _known(mech, pose)
    return _screws(mech._core.freedom_screws(matrix) if status is Status.OK else [], status)


def constraint_screws(mech: Mechanism, pose: ArrayLike) -> Screws:
    """See `Mechanism.constraint_screws`."""
    matrix, status = _known(mech, pose)
    return _screws(mech._core.constraint_screws(matrix) if status is Status.OK else [], status)


def _known(mech: Mechanism, pose: ArrayLike) -> tuple[Array, Status]:
    """A pose, and whether it is one where every leg has a direction."""
    matrix = doubles("pose", pose, (4, 4), batch=False)
    return matrix, Status(int(mech.singularity(matrix).status))


def _screws(rows: list[Row] | None, status: Status) -> Screws:
    if rows is None:
        rows, status = [], Status.SINGULAR
    table = np.array([[*vector, *axis, pitch, *point] for vector, axis, pitch, point in rows]).reshape(-1, 13)
    return Screws(table[:, :6], table[:, 6:9], table[:, 9], table[:, 10:], int(status))
