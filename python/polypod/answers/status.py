"""The outcome of each state of a batch."""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from polypod import _core


class Status(IntEnum):
    """Outcome of a state. A batch never raises for it; results hold NaN where there is no answer."""

    OK = 0
    NO_BRANCH = 1
    FOLD = 2
    NOT_CONVERGED = 3
    SINGULAR = 4
    OUT_OF_STROKE = 5
    OFF_CONSTRAINT = 6
    INVALID_INPUT = 7
    BRANCH_JUMP = 8
    OUT_OF_CONE = 9
    MODE_JUMP = 10
    OUT_OF_ANGLE = 11
    OUT_OF_REACH = 12
    OTHER_BRANCH = 13
    INCONSISTENT = 14
    BACKWARDS = 15

    @property
    def has_answer(self) -> bool:
        """Whether the numbers of such a state stand."""
        return self in (
            Status.OK,
            Status.OUT_OF_STROKE,
            Status.OUT_OF_CONE,
            Status.OUT_OF_ANGLE,
            Status.MODE_JUMP,
            Status.OTHER_BRANCH,
        )

    @property
    def message(self) -> str:
        """Meaning of the status, and a remedy."""
        return _MESSAGES[self]


_MESSAGES = {code: message for code, _, message in _core.statuses()}


def count(status: ArrayLike) -> Iterator[tuple[Status, int, int]]:
    """For each outcome other than OK: the status, how many states have it, and the index of the first."""
    codes = np.asarray(status).ravel()
    for code in np.unique(codes[codes != Status.OK]):
        where = np.flatnonzero(codes == code)
        yield Status(int(code)), len(where), int(where[0])
