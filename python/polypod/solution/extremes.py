"""Numbers that exist: None for NaN and infinity, extremes of those that are finite, limits that are set."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.mechanism import Mechanism

Array = NDArray[np.float64]


def number(value: ArrayLike) -> float | None:
    """The number, or None for one that is none."""
    given = float(np.asarray(value))
    return given if math.isfinite(given) else None


def least(values: Array) -> float | None:
    """The least finite value."""
    finite = values[np.isfinite(values)]
    return float(finite.min()) if finite.size else None


def greatest(values: Array) -> float | None:
    """The greatest finite value."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else None


def peak(values: Array) -> float | None:
    """The value of largest magnitude, with its sign."""
    finite = values[np.isfinite(values)]
    return float(finite[np.argmax(np.abs(finite))]) if finite.size else None


def stroke_limits(mech: Mechanism, leg: int) -> list[float | None]:
    """Least and greatest length or place of a leg, m; None for no limit, also for a least length of zero."""
    low, high = mech.stroke[leg]
    return [number(low) if low != mech.drives[leg].least else None, number(high)]
