"""Motions for the page: as many rows as can be shown, and a clock that runs through them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion

Array = NDArray[np.float64]

MOST_ROWS = 30_000
"""Rows of a motion that the page keeps: thirty a second for a quarter of an hour."""

_CHUNK = 20_000
"""Rows whose poses are found at a time."""

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0)


@dataclass(frozen=True, eq=False)
class Track:
    """Rows of a motion with their poses, SI; k rows of `total`."""

    name: str
    set: str
    time: Array
    """(k,), s."""
    coordinates: dict[str, Array]
    """Each (k,)."""
    pose: Array
    """(k, 4, 4); NaN where there is none."""
    twist: Array
    acceleration: Array
    """(k, 6)."""
    status: NDArray[np.uint8]
    """(k,)."""
    wrench: Array | None
    """(k, 6); None for the mechanism's own."""
    wrench_axes: str
    total: int
    """Rows of the motion itself."""

    @property
    def duration(self) -> float:
        """From the first row to the last, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def positions(self) -> Array:
        """(j, 3): o at the rows that have a pose, m."""
        return self.pose[np.isfinite(self.pose).all(axis=(1, 2)), :3, 3]

    @property
    def words(self) -> str:
        """How much of the motion this is."""
        span = f"{self.name}: {self.time[0]:g} s to {self.time[-1]:g} s"
        if len(self.time) == self.total:
            return f"{span}, {self.total} rows."
        return f"{span}; of its {self.total} rows the page shows {len(self.time)}, evenly chosen."

    def row_at(self, time: float) -> int:
        """The row nearest to a time."""
        after = min(int(np.searchsorted(self.time, time)), len(self.time) - 1)
        before = max(after - 1, 0)
        return before if time - self.time[before] <= self.time[after] - time else after

    def state(self, row: int) -> tuple[Array, Array, Array]:
        """Pose, twist and acceleration of a row; at rest where the motion has no rates there."""
        twist, acceleration = self.twist[row], self.acceleration[row]
        if not (np.isfinite(twist).all() and np.isfinite(acceleration).all()):
            twist, acceleration = np.zeros(6), np.zeros(6)
        return self.pose[row], twist, acceleration

    def load(self, row: int) -> tuple[Any, ...]:
        """Wrench and axes of a row, or nothing for the mechanism's own."""
        return () if self.wrench is None else (self.wrench[row], self.wrench_axes)


def track_of(mech: Mechanism, motion: Motion, most: int = MOST_ROWS) -> Track:
    """The rows of a motion to show: all, or `most` of them, evenly chosen, the first and the last among them.

    Poses are followed through all rows, so that none is lost or changes its branch for those left out.
    """
    total = len(motion.time)
    kept = np.unique(np.linspace(0, total - 1, min(total, max(most, 2))).round().astype(int))
    parts: list[list[Array]] = []
    guess: Array | None = None
    for start in range(0, total, _CHUNK):
        rows = slice(start, min(start + _CHUNK, total))
        values = [
            {name: column[rows] for name, column in series.items()}
            for series in (motion.coordinates, motion.rates, motion.second_rates)
        ]
        state = mech.state(*values, branch=motion.branch, guess=guess, continued=True)
        here = kept[(kept >= rows.start) & (kept < rows.stop)] - rows.start
        arrays = (state.pose, state.twist, state.acceleration, state.status)
        parts.append([array[here] for array in arrays])
        good = np.flatnonzero(np.isfinite(state.pose).all(axis=(1, 2)))
        guess = state.pose[good[-1]] if len(good) else guess
    pose, twist, acceleration, status = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Track(
        name=motion.name,
        set=motion.set,
        time=motion.time[kept],
        coordinates={name: column[kept] for name, column in motion.coordinates.items()},
        pose=pose,
        twist=twist,
        acceleration=acceleration,
        status=status.astype(np.uint8),
        wrench=None if motion.wrench is None else motion.wrench[kept],
        wrench_axes=motion.wrench_axes,
        total=total,
    )


@dataclass
class Player:
    """A clock over the time of a motion."""

    start: float
    end: float
    time: float
    speed: float = 1.0
    playing: bool = False
    loop: bool = True

    @classmethod
    def of(cls, track: Track) -> Player:
        """At the first row, not running."""
        return cls(float(track.time[0]), float(track.time[-1]), float(track.time[0]))

    def play(self) -> None:
        """Runs on; from the start again once the end is reached."""
        if self.time >= self.end:
            self.time = self.start
        self.playing = True

    def seek(self, time: float) -> None:
        """Goes to a time inside the motion."""
        if np.isfinite(time):
            self.time = float(np.clip(time, self.start, self.end))

    def advance(self, elapsed: float) -> bool:
        """Lets some time of the clock on the wall pass, s; whether anything changed."""
        if not self.playing or elapsed <= 0.0:
            return False
        time = self.time + self.speed * elapsed
        length = self.end - self.start
        if time > self.end and self.loop and length > 0.0:
            time = self.start + (time - self.start) % length
        elif time >= self.end:
            time, self.playing = self.end, False
        self.time = time
        return True
