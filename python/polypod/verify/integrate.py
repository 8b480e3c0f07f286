"""Polypod's forces applied to a twin in Exudyn: whether the motion that they were computed for comes out.

A parallel mechanism that stands on its legs falls when nothing controls it, so that errors of a step grow
fast. The motion is therefore followed in pieces, each from the exact state, with steps that are halved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.errors import PolypodError
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.multibody.tree import describe
from polypod.solution.solve import states_along
from polypod.verify.comparison import load_at_o
from polypod.verify.engines import engine_class

Array = NDArray[np.float64]

ORDER = 2
"""Of Exudyn's generalised-alpha integrator."""
ORDER_RANGE = (1.8, 2.2)
"""The order measured from the two smallest steps must be within."""
LIMIT = 1e-6
"""Largest error that may be left at step zero, extrapolated: radians, parts of the characteristic length."""
PIECE = 0.5
"""s: longest piece of the motion."""
STEPS = (25, 50, 100)
"""Steps to a piece, doubled each time."""
RECORDS = 5
"""Compared in each piece, at its end the last; a divisor of all `STEPS`."""


@dataclass(frozen=True)
class Errors:
    """The largest over all pieces."""

    position: float
    """m, of o."""
    rotation: float
    """rad, of the platform."""
    lengths: float
    """m, of the legs."""


@dataclass(frozen=True)
class Step:
    """The errors with one step."""

    step: float
    """s."""
    errors: Errors
    order: float | None
    """Of the lengths' error, from this and the step before; none for the first."""


@dataclass(frozen=True)
class Integration:
    """The motion that comes out of Polypod's forces."""

    pieces: int
    completed: int
    """Pieces that Exudyn integrated with every step."""
    piece: float
    """s."""
    steps: tuple[Step, ...]
    rest: Errors | None
    """At step zero, extrapolated from the two smallest steps."""
    closure: float
    """Largest error of all joints, those released too; a cosine or a part of the characteristic length."""
    released: tuple[str, ...]
    """Constraints that the engine does without because others say the same."""
    agrees: bool
    """All pieces are there, errors fall at the integrator's order, and what is left is within `LIMIT`."""

    def facts(self) -> dict[str, Any]:
        """All of it as plain data, SI."""
        return asdict(self) | {"limit": LIMIT}


def integrate(
    mech: Mechanism,
    motion: Motion,
    *,
    piece: float = PIECE,
    steps: tuple[int, ...] = STEPS,
    progress: Callable[[int, int], None] | None = None,
) -> Integration:
    """The motion under the forces of `mech.inverse_dynamics`, in Exudyn, with steps that are halved.

    Args:
        mech: the mechanism.
        motion: the motion that should come out.
        piece: longest piece to follow from an exact start, s.
        steps: steps to each piece, each twice the one before, at least two; multiples of 5.
        progress: called with the number of runs done and of all.

    Raises:
        MissingEngineError: Exudyn is not installed.
        PolypodError: a piece without length, or steps that are not as above.
    """
    if not piece > 0.0:
        raise PolypodError(f"piece is {piece!r} s; must be a positive number")
    doubled = all(b == 2 * a for a, b in pairwise(steps))
    if len(steps) < 2 or not doubled or steps[0] < 1 or steps[0] % RECORDS:
        raise PolypodError(
            f"steps are {steps}; need two or more, each twice the one before, multiples of {RECORDS}"
        )
    twin: Any = engine_class("exudyn")(describe(mech))
    first, last = float(motion.time[0]), float(motion.time[-1])
    count = max(1, int(np.ceil((last - first) / piece - 1e-9)))
    ends = np.linspace(first, last, count + 1)
    found: list[list[Array]] = []
    closure: float = 0.0
    released: tuple[str, ...] = ()
    for i, (start, end) in enumerate(pairwise(ends)):
        errors = []
        for j, number in enumerate(steps):
            if progress is not None:
                progress(i * len(steps) + j, count * len(steps))
            run = _run(mech, motion, twin, start, end, number)
            if run is None:
                break
            errors.append(run[0])
            closure, released = max(closure, run[1]), run[2]
        if len(errors) == len(steps):
            found.append(errors)
    if progress is not None:
        progress(count * len(steps), count * len(steps))
    return _judge(mech, found, count, (last - first) / count, steps, closure, released)


def _run(
    mech: Mechanism, motion: Motion, twin: Any, start: float, end: float, steps: int
) -> tuple[Array, float, tuple[str, ...]] | None:
    """Errors (records, 6 + legs) of position, rotation and lengths, of the joints, and what was released."""
    # Also half steps, which an integrator may ask for.
    path = motion.sample(np.linspace(start, end, 2 * steps + 1))
    state = states_along(mech, path)
    load = load_at_o(mech.geometry, state.pose, path.wrench, path.wrench_axes)
    answer = mech.inverse_dynamics(state.pose, state.twist, state.acceleration, load, "base")
    answered = np.isin(answer.status, [int(s) for s in Status if s.has_answer])
    if not answered.all():
        return None
    half = (end - start) / (2 * steps)

    def drive(t: float) -> tuple[Array, Array]:
        i = round(t / half)
        return answer.forces[i], load[i]

    every = steps // RECORDS
    track = twin.follow(state.pose[0], state.twist[0], drive, end - start, steps, every)
    if track is None:
        return None
    at = slice(2 * every, None, 2 * every)
    right = state.pose[at]
    lengths = mech.inverse_kinematics(right).lengths
    errors = [
        track.pose[:, :3, 3] - right[:, :3, 3],
        _turns(track.pose[:, :3, :3] @ right[:, :3, :3].transpose(0, 2, 1)),
        track.lengths - lengths,
    ]
    placed = twin.links.start(state.pose[0], state.twist[0])
    return np.concatenate(errors, axis=1), track.closure, twin.links.words(placed.redundant)


def _turns(rotation: Array) -> Array:
    """(N, 3): rotation vectors of small rotations, to the third order."""
    skew = 0.5 * (rotation - rotation.transpose(0, 2, 1))
    return np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=-1)


def _judge(
    mech: Mechanism,
    found: list[list[Array]],
    count: int,
    piece: float,
    steps: tuple[int, ...],
    closure: float,
    released: tuple[str, ...],
) -> Integration:
    if not found:
        return Integration(count, 0, piece, (), None, closure, released, agrees=False)
    by_step = [np.concatenate([errors[j] for errors in found]) for j in range(len(steps))]
    sizes = [_errors(errors) for errors in by_step]
    orders = [None, *(_order(a.lengths, b.lengths) for a, b in pairwise(sizes))]
    measured = tuple(
        Step(piece / number, size, order) for number, size, order in zip(steps, sizes, orders, strict=True)
    )
    # With errors C h^p what is left of two runs with h and h/2 is (2^p e(h/2) - e(h)) / (2^p - 1).
    rest = _errors((2**ORDER * by_step[-1] - by_step[-2]) / (2**ORDER - 1))
    scale = mech.characteristic_length
    left = max(rest.position / scale, rest.rotation, rest.lengths / scale)
    order = measured[-1].order
    falls = order is not None and ORDER_RANGE[0] <= order <= ORDER_RANGE[1]
    agrees = len(found) == count and falls and left <= LIMIT
    return Integration(count, len(found), piece, measured, rest, closure, released, agrees)


def _errors(errors: Array) -> Errors:
    """The largest of (N, 6 + legs)."""
    position, rotation = (np.linalg.norm(errors[:, part], axis=-1) for part in (slice(0, 3), slice(3, 6)))
    return Errors(float(position.max()), float(rotation.max()), float(np.abs(errors[:, 6:]).max()))


def _order(coarse: float, fine: float) -> float | None:
    return float(np.log2(coarse / fine)) if coarse > 0.0 and fine > 0.0 else None
