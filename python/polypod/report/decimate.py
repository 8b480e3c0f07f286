"""Fewer points of long curves, with their peaks, for display only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

POINTS = 2000
"""Instants of a panel that are drawn, about: more than it is wide, and few enough for a page with many."""


def kept(values: Array, points: int = POINTS) -> Indices:
    """Indices of about `points` rows of (N, curves), or all of them, that look the same when drawn.

    The rows fall into bins. Of each are kept, for every curve, those of its least and greatest value; the
    first and last NaN, so that gaps stay gaps; and the first and last row of all.
    """
    n, curves = values.shape
    if n <= points:
        return np.arange(n)
    width = -(-n // max(points // (2 * curves), 1))
    starts = np.arange(0, n, width)
    # The last row again and again fills the last bin.
    rows = np.minimum(starts[:, None] + np.arange(width), n - 1)
    chosen = [np.array([0, n - 1])]
    for column in values.T:
        binned = column[rows]
        gap = np.isnan(binned)
        least = np.argmin(np.where(gap, np.inf, binned), axis=1)
        greatest = np.argmax(np.where(gap, -np.inf, binned), axis=1)
        chosen += [starts + least, starts + greatest]
        with_gap = gap.any(axis=1)
        chosen += [
            (starts + np.argmax(gap, axis=1))[with_gap],
            (starts + width - 1 - np.argmax(gap[:, ::-1], axis=1))[with_gap],
        ]
    return np.unique(np.minimum(np.concatenate(chosen), n - 1))


def spans(flags: NDArray[np.bool_], points: int = POINTS) -> list[tuple[int, int]]:
    """First and last index of each run of true values; runs as near as N / `points` are one."""
    at = np.flatnonzero(flags)
    if not at.size:
        return []
    apart = np.flatnonzero(np.diff(at) > max(1, len(flags) // points))
    first, last = at[np.r_[0, apart + 1]], at[np.r_[apart, len(at) - 1]]
    return [(int(a), int(b)) for a, b in zip(first, last, strict=True)]
