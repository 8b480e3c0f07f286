"""How far a workspace reaches along its coordinates, by constrained optimisation from its boundary [T76].

A search goes on from several places of the boundary, for each coordinate and both of its ends. It ends where
no motion inside the limits leads farther: the multipliers of the limits there say what ends the workspace,
and what they leave of the coordinate's derivative how far the end may be off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain, pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, minimize, nnls

from polypod.workspaces.causes import EDGE_OF_GRID, NO_POSE

Array = NDArray[np.float64]
Names = tuple[str, ...]

STARTS = 4
"""Places of the boundary from which an end is looked for."""

_NEXT = 0.2
"""Starts are taken that are behind the farthest, and apart from one another, by so much of the size."""

_STEPS = 200
_CONVERGED = 1e-14
"""Of the search: the most steps, and the gain, as a part of the scale, below which it ends."""

_FAR = 1e3
"""By how much all bounds are missed where they are not determined, in their scales."""

_LEVELS = 24
"""Of a way through the inside: places between its ends."""

_ROOM = 0.05
"""Margin of all limits, relative to their scales, that is room enough on a way."""

BINDING = 1e-6
"""A limit ends the workspace where its margin, relative to its scale, is below this."""

_UNCERTAIN = 1e-8
"""Least error of an end, as a part of the size: limits are kept by a small margin, vertices to rounding."""


class Extremes(NamedTuple):
    """Ends of a workspace, least and greatest of each of d coordinates."""

    values: Array
    """(d, 2): the coordinates, m and rad; each is reached."""
    errors: Array
    """(d, 2): how much farther it may reach, by the multipliers of the limits; the step of the grid
    where the search found nothing beyond the boundary of the grid's nodes."""
    limits: tuple[tuple[Names, Names], ...]
    """(d, 2): what ends the workspace there, all that bind."""
    poses: Array
    """(d, 2, 4, 4): a pose at each end."""


class Bounded(NamedTuple):
    """A place of a search: what bounds it, as values and rows of derivatives by the variables."""

    zero: tuple[Array, Array]
    """(e,), (e, n): must be zero."""
    positive: tuple[Array, Array]
    """(p,), (p, n): must not be below zero."""
    objective: tuple[float, Array]
    """The coordinate in its scale, and (n,)."""


class Search(Protocol):
    """The space that is searched, from one place of the boundary, for one end of one coordinate."""

    names: Names
    """(p,): of what must not be below zero."""
    least: Array
    """(p,): by how much each is kept above what it need not be below."""
    scale: float
    """Unit of the objective, m or rad."""
    box: Array
    """(n, 2): of the variables; infinite where there is none."""

    def at(self, x: Array) -> Bounded | None:
        """What bounds variables (n,); none where that is not determined."""

    def value(self, x: Array) -> float:
        """The coordinate at variables (n,)."""

    def reached(self, way: Array) -> Array | None:
        """The pose (4, 4) at the end of straight ways from place to place (w, n); none if one is not open."""


class End(NamedTuple):
    """One end of one coordinate."""

    value: float
    error: float
    limits: Names
    pose: Array


class _Undetermined(Exception):
    """A place where what bounds the search is not determined."""


def extremes(
    values: Array,
    steps: Array,
    poses: Array,
    labels: Sequence[str],
    search: Callable[[int, int, int], Search],
) -> Extremes:
    """The ends of a workspace from its boundary.

    Args:
        values: (v, d) coordinates of places on the boundary.
        steps: (d,) of the grid.
        poses: (v, 4, 4) there.
        labels: (v,) what ends the workspace there.
        search: that of coordinate k towards a sense, -1 or +1, from a place; its objective is the coordinate
            times the sense.
    """
    size = np.ptp(values, axis=0)
    d = values.shape[1]
    ends: list[list[End]] = [[] for _ in range(d)]
    for k in range(d):
        for sense in (-1, 1):
            order = np.argsort(-sense * values[:, k], kind="stable")
            farthest = int(order[0])
            best = End(float(values[farthest, k]), float(steps[k]), (labels[farthest],), poses[farthest])
            for start in _starts(order, sense * values[:, k], values, size):
                found = _end(search(k, sense, start), size[k])
                if found is not None and sense * (found.value - best.value) >= -_UNCERTAIN * size[k]:
                    best = found
            ends[k].append(best)
    return Extremes(
        np.array([[end.value for end in pair] for pair in ends]),
        np.array([[end.error for end in pair] for pair in ends]),
        tuple((low.limits, high.limits) for low, high in ends),
        np.array([[end.pose for end in pair] for pair in ends]),
    )


def _starts(order: NDArray[np.int64], ahead: Array, values: Array, size: Array) -> list[int]:
    """The farthest places that are apart from one another."""
    scale = np.maximum(size, np.finfo(float).tiny)
    places = values / scale
    reach = ahead[order[0]] - _NEXT * np.ptp(ahead)
    chosen = [int(order[0])]
    apart = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < STARTS:
        rest = order[(apart[order] > _NEXT) & (ahead[order] >= reach)]
        if not len(rest):
            break
        chosen.append(int(rest[0]))
        apart = np.minimum(apart, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return chosen


def _end(search: Search, size: float) -> End | None:
    """The end that a search finds; none where it finds none that is reached."""
    x = optimum(search)
    if x is None or (bounded := search.at(x)) is None:
        return None
    pose = search.reached(np.stack([np.zeros_like(x), x]))
    if pose is None:
        ridge = _ridge(search, bounded.objective[0])
        pose = None if ridge is None else search.reached(np.concatenate([ridge, x[None]]))
    if pose is None:
        return None
    error = _missing(search, bounded, x) * search.scale + _UNCERTAIN * size
    return End(search.value(x), error, _binding(search, bounded, x), pose)


def optimum(search: Search) -> Array | None:
    """The variables (n,) with the greatest objective, from zero on; none where the search fails."""
    return _maximum(_remembered(search), np.zeros(len(search.box)), search.box)


def _ridge(search: Search, most: float) -> Array | None:
    """A way (w, n) from zero to near a value of the objective, as far from all limits as it can be."""
    n = len(search.box)
    way = [np.zeros(n)]
    for share in np.linspace(0.0, 1.0, _LEVELS + 1)[:-1]:
        x = roomiest(search, way[-1], share * most)
        if x is None:
            return None
        way.append(x)
    return np.array(way)


def roomiest(search: Search, begin: Array, level: float | None = None) -> Array | None:
    """The variables (n,) as far from all limits as they can be, from a place on; none where none are inside.

    With `level` the objective has that value.
    """
    at = _remembered(search)
    n = len(begin)

    def bounded(x: Array) -> Bounded:
        zero, positive, objective = at(x[:n])
        values, rows = zero[0], _wider(zero[1], 0.0)
        if level is not None:
            values = np.append(values, objective[0] - level)
            rows = np.vstack([rows, np.append(objective[1], 0.0)])
        margin = np.append(np.zeros(n), 1.0)
        return Bounded((values, rows), (positive[0] - x[n], _wider(positive[1], -1.0)), (float(x[n]), margin))

    try:
        least = float(at(begin).positive[0].min(initial=_ROOM))
    except _Undetermined:
        return None
    box = np.concatenate([search.box, [[-np.inf, _ROOM]]])
    x = _maximum(bounded, np.append(begin, least), box)
    return None if x is None or x[n] < -BINDING else x[:n]


def _wider(rows: Array, last: float) -> Array:
    """Rows (r, n) with one more column."""
    return np.concatenate([rows, np.full((len(rows), 1), last)], axis=1)


def _remembered(search: Search) -> Callable[[Array], Bounded]:
    """What bounds a place, worked out once for each in turn.

    Where it is not determined, all is missed by much, so that the search turns back; raises if it never was.
    """
    seen: list[tuple[bytes, Bounded]] = []

    def at(x: Array) -> Bounded:
        if not seen or seen[0][0] != x.tobytes():
            bounded = search.at(x)
            if bounded is None or not all(np.isfinite(part).all() for part in chain(*bounded[:2])):
                if not seen:
                    raise _Undetermined
                bounded = _far_outside(seen[0][1])
            seen[:] = [(x.tobytes(), bounded)]
        return seen[0][1]

    return at


def _far_outside(last: Bounded) -> Bounded:
    """What stands for a place that is not determined, after the last one."""
    (zero, zeros), (positive, rows), objective = last
    return Bounded((np.full_like(zero, _FAR), zeros), (np.full_like(positive, -_FAR), rows), objective)


def _maximum(at: Callable[[Array], Bounded], begin: Array, box: Array) -> Array | None:
    """The variables (n,) with the greatest objective within a box, from a place on; none where it fails."""
    begin = np.asarray(np.clip(begin, *box.T))

    def objective(x: Array) -> float:
        return -at(x).objective[0]

    def gradient(x: Array) -> Array:
        return -at(x).objective[1]

    try:
        zero, positive, _ = at(begin)
        constraints: list[Any] = []
        if len(zero[0]):
            constraints.append({"type": "eq", "fun": lambda x: at(x).zero[0], "jac": lambda x: at(x).zero[1]})
        if len(positive[0]):
            above = {"fun": lambda x: at(x).positive[0], "jac": lambda x: at(x).positive[1]}
            constraints.append({"type": "ineq", **above})
        found = minimize(
            objective,
            begin,
            jac=gradient,
            method="SLSQP",
            bounds=Bounds(*box.T),
            constraints=constraints,
            options={"maxiter": _STEPS, "ftol": _CONVERGED},
        )
    except _Undetermined:
        return None
    x = np.asarray(found.x)
    return x if np.isfinite(x).all() and at(x).positive[0].min(initial=0.0) > -_FAR else None


def between(way: Array, pieces: int) -> Array:
    """(m, n): places on the straight ways from place to place (w, n), all ends among them."""
    t = np.linspace(0.0, 1.0, pieces)[1:, None]
    steps = [first + t * (second - first) for first, second in pairwise(way)]
    return np.concatenate([way[:1], *steps])


def _active(search: Search, bounded: Bounded, x: Array) -> tuple[NDArray[np.intp], Array]:
    """Indices of the inequalities that bind, and the rows (a, n) that point inwards from the box's sides."""
    low, high = (np.abs(x - side) <= BINDING for side in search.box.T)
    return np.flatnonzero(bounded.positive[0] < BINDING), np.concatenate(
        [np.eye(len(x))[low], -np.eye(len(x))[high]]
    )


def _missing(search: Search, bounded: Bounded, x: Array) -> float:
    """What may be gained, to first order, by the multipliers of what binds.

    That is the derivative that they do not balance, by the way gone; and what bounds are kept by.
    """
    binding, sides = _active(search, bounded, x)
    zero = bounded.zero[1]
    rows = np.concatenate([bounded.positive[1][binding], sides, zero, -zero])
    gradient = bounded.objective[1]
    if not len(rows):
        return float(np.linalg.norm(gradient) * np.linalg.norm(x))
    multipliers, rest = nnls(rows.T, -gradient)
    kept = float(multipliers[: len(binding)] @ search.least[binding])
    return float(rest) * float(np.linalg.norm(x)) + kept


def _binding(search: Search, bounded: Bounded, x: Array) -> Names:
    """Names of what ends the workspace at the end of a search."""
    binding, sides = _active(search, bounded, x)
    names = [search.names[i] for i in binding] + [EDGE_OF_GRID] * (len(sides) > 0)
    return tuple(dict.fromkeys(names)) or (NO_POSE,)
