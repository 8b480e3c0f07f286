"""Simulation: how a mechanism moves under forces, integrated on the poses that it can have [T53, T54].

The unknowns are local coordinates of those poses, as many as the mechanism has degrees of freedom, in which
the constraints hold by construction; the integrator is scipy's DOP853, Dormand and Prince's method of order
8.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from polypod import _core
from polypod.answers.dynamics import ForwardDynamics
from polypod.answers.kinematics import State
from polypod.answers.singularity import Determinant
from polypod.answers.status import Status
from polypod.arrays import check_wrench_axes, doubles
from polypod.errors import PolypodError, UnknownNameError
from polypod.mechanism import Mechanism
from polypod.solution.singularity_crossings import sampled_passages
from polypod.solution.solution import Solution
from polypod.solution.solve import dataset_of, variables_of, work_of

Array = NDArray[np.float64]
Law = Callable[[float, Array, Array], ArrayLike]
"""From time (s), pose (4, 4) and twist (6,) to numbers, without memory: trial states are asked for, too."""
Input = ArrayLike | tuple[ArrayLike, ArrayLike] | Law
"""Constant numbers, or times (k,) with rows (k, ...) between which they are linear, or a law."""

STOPS = ("limits", "singularity")

CHART_REACH = 0.3
"""How far one chart of poses is used: rad, or share of the characteristic length."""

LOOKS = 4
"""Equal parts of a step of integration at whose ends events are looked for."""

SHORTEST = 1e-8
"""Share of the longest step of integration below which a step no longer follows the motion."""

BEYOND = -1e-9
"""Relative slack of a limit below which it is passed: a motion may start at a limit."""


class End(NamedTuple):
    """Why a simulation ended."""

    time: float
    """s."""
    kind: str
    """until, limit, conditioning, singularity or no answer."""
    reason: str
    """Such as "stroke max of leg 3"."""


def simulate(
    mech: Mechanism,
    pose: ArrayLike,
    twist: ArrayLike = (0.0,) * 6,
    *,
    forces: Input | None = None,
    wrench: Input | None = None,
    wrench_axes: str = "base",
    until: float,
    step: float,
    tolerance: float = 1e-10,
    stop: Sequence[str] = ("limits", "singularity"),
    sigma_min: float | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Solution:
    """The motion from a state under forces: integration over time on the constraints [T53, T54].

    Args:
        mech: the mechanism.
        pose: (4, 4), at time 0.
        twist: (6,), at time 0; at rest by default.
        forces: active forces (n,), N, positive when they push the platform away: constant; or a pair of
            times (k,) and rows (k, n), linear in between; or a function of time, pose (4, 4) and twist
            (6,), without memory, because trial states are asked for, too. None for no forces.
        wrench: load on the platform at o, (6,), N and N m, in the same three forms; the mechanism's own
            by default.
        wrench_axes: the axes of `wrench`, "base" or "platform".
        until: the last time, s.
        step: between the states of the result, and the longest step of the integration, s.
        tolerance: of the integration, relative, for each of its steps.
        stop: what ends the motion before: "limits", any limit of `limit_list`; "singularity", a change of
            the sign of det J.
        sigma_min: the smallest singular value below which the motion ends, too.
        progress: called with the time that is reached and the last one.

    Returns:
        A `Solution` like that of `solve`, with `end`: the time, kind and reason of the end. The last
        state is the one at which it ends, with its time to the accuracy of the integration.

    Raises:
        PolypodError: a state to start from that the mechanism cannot have, or numbers that are wrong.
        ShapeError: forces, load, pose or twist of another shape.

    >>> import polypod as pp
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.7, "beta": 0.7, "gamma": 0.5})
    >>> fall = pp.simulate(mech, pose, until=1.0, step=0.01)
    >>> fall.end["kind"], round(fall.end["time"], 3), fall.end["reason"]
    ('limit', 0.083, 'stroke max of leg 3')
    """
    for name, value in (("until", until), ("step", step), ("tolerance", tolerance)):
        if not 0.0 < value < np.inf:
            raise PolypodError(f"{name} is {value!r}; must be a positive number")
    for name in stop:
        if name not in STOPS:
            raise UnknownNameError("event to stop at", name, STOPS)
    drive = _Drive(mech, forces, wrench, wrench_axes)
    start = _Instant(
        0.0, doubles("pose", pose, (4, 4), batch=False), doubles("twist", twist, (6,), batch=False)
    )
    status = Status(int(drive.dynamics([start]).status[0]))
    if not status.has_answer:
        raise PolypodError(f"the state at the start, pose and twist: {status.message}")
    events = _Events(mech, drive, stop, sigma_min, start)
    path = _Path(mech, drive, until, step, tolerance)
    times = [*(step * np.arange(np.ceil(until / step - 1e-9))).tolist(), until]
    instants, end = _integrate(path, events, start, times, progress)
    return _solution(mech, drive, instants, end)


class _Instant(NamedTuple):
    """A state of the motion."""

    time: float
    pose: Array
    twist: Array


# --- what drives it -----------------------------------------------------------------------------------------


class _Drive:
    """Forces and load at a state."""

    def __init__(self, mech: Mechanism, forces: Input | None, wrench: Input | None, wrench_axes: str) -> None:
        check_wrench_axes(wrench_axes)
        self.mech, self.wrench_axes = mech, wrench_axes
        self._forces = _law("forces", np.zeros(mech.n_legs) if forces is None else forces, mech.n_legs)
        self._wrench = None if wrench is None else _law("wrench", wrench, 6)

    def forces(self, at: _Instant) -> Array:
        return self._forces(*at)

    def wrench(self, at: _Instant) -> Array | None:
        return None if self._wrench is None else self._wrench(*at)

    def forces_at(self, instants: Sequence[_Instant]) -> Array:
        """(N, n); those of passive legs are zero."""
        return np.where(self.mech.actuated, [self.forces(at) for at in instants], 0.0)

    def wrenches_at(self, instants: Sequence[_Instant]) -> Array | None:
        """(N, 6)."""
        law = self._wrench
        return None if law is None else np.stack([law(*at) for at in instants])

    def dynamics(self, instants: Sequence[_Instant]) -> ForwardDynamics:
        """Accelerations and multipliers (N, ...)."""
        _, poses, twists = zip(*instants, strict=True)
        load = (self.wrenches_at(instants), self.wrench_axes)
        return self.mech.forward_dynamics(poses, twists, self.forces_at(instants), *load)


def _law(name: str, given: Input, width: int) -> Callable[[float, Array, Array], Array]:
    """An input as a function of the state that gives `width` doubles."""
    if callable(given):
        law = given

        def called(time: float, pose: Array, twist: Array) -> Array:
            return doubles(f"{name} at {time:g} s", law(time, pose, twist), (width,), batch=False)

        return called
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1:
        at = np.asarray(given[0], dtype=np.float64)
        rows = doubles(name, given[1], (len(at), width), batch=False)
        if not (np.diff(at) > 0.0).all():
            raise PolypodError(f"{name}: its times must increase")
        return lambda time, pose, twist: np.array([np.interp(time, at, column) for column in rows.T])
    constant = doubles(name, given, (width,), batch=False)  # type: ignore[arg-type]
    return lambda time, pose, twist: constant


# --- integration --------------------------------------------------------------------------------------------


class _Piece(NamedTuple):
    """One step of integration: its ends, and the motion in between."""

    start: float
    end: float
    at: Callable[[float], _Instant]


class _Path:
    """The motion from a state on, step by step [T53]."""

    def __init__(self, mech: Mechanism, drive: _Drive, until: float, step: float, tolerance: float) -> None:
        self.mech, self.drive, self.until, self.step = mech, drive, until, step
        self.tolerance = tolerance

    def pieces(self, instant: _Instant) -> Iterator[_Piece]:
        """Steps up to the end of the time, or as far as there is a motion."""
        first = None
        scale = self.mech.characteristic_length
        while instant.time < self.until:
            chart = _core.Chart.at(self.mech._core, instant.pose.reshape(-1))
            if chart is None:
                return
            rates = self._rates(chart)
            y = chart.start(instant.twist)
            if not np.isfinite(rates(instant.time, y)).all():
                return
            solver = DOP853(
                rates,
                instant.time,
                y,
                self.until,
                first_step=None if first is None else min(first, self.until - instant.time),
                max_step=self.step,
                rtol=self.tolerance,
                atol=self.tolerance * scale,
            )
            used = False
            while solver.status == "running":
                before = solver.t
                solver.step()
                if solver.t < self.until and not solver.t - before > SHORTEST * self.step:
                    return
                used, first = True, solver.step_size
                yield _Piece(float(solver.t_old), float(solver.t), _between(chart, solver.dense_output()))
                if np.linalg.norm(solver.y[: len(y) // 2]) > CHART_REACH * scale:
                    break
            if not used:
                return
            instant = _Instant(float(solver.t), *chart.state(solver.y))

    def _rates(self, chart: _core.Chart) -> Callable[[float, Array], Array]:
        drive, in_platform = self.drive, self.drive.wrench_axes == "platform"

        def rates(time: float, y: Array) -> Array:
            instant = _Instant(time, *chart.state(y))
            return chart.rates(y, drive.forces(instant), drive.wrench(instant), in_platform)

        return rates


def _between(chart: _core.Chart, dense: Callable[[float], Array]) -> Callable[[float], _Instant]:
    """The motion within a step: interpolated in the chart, and so on the constraints everywhere."""
    return lambda time: _Instant(time, *chart.state(np.ascontiguousarray(dense(time))))


def _integrate(
    path: _Path,
    events: _Events,
    start: _Instant,
    times: list[float],
    progress: Callable[[float, float], None] | None,
) -> tuple[list[_Instant], End]:
    """The states at the times, up to where the motion ends, which is the last of them."""
    instants, last = [start], start
    if (end := events.at_start(start)) is not None:
        return instants, end
    for piece in path.pieces(start):
        end = events.within(piece)
        last = piece.at(piece.end if end is None else end.time)
        while len(instants) < len(times) and times[len(instants)] <= last.time:
            instants.append(piece.at(times[len(instants)]))
        if progress is not None:
            progress(last.time, path.until)
        if end is not None:
            break
    if end is None and len(instants) == len(times):
        return instants, End(path.until, "until", "the time is over")
    if last.time > instants[-1].time:
        instants.append(last)
    if end is None:
        status = Status(int(path.drive.dynamics([last]).status[0]))
        why = "the motion changes too fast to be followed" if status.has_answer else status.message
        end = End(last.time, "no answer", why)
    return instants, end


# --- events -------------------------------------------------------------------------------------------------


class _Events:
    """Events that stop a motion: functions of the state that must not become negative [T54]."""

    def __init__(
        self, mech: Mechanism, drive: _Drive, stop: Sequence[str], sigma_min: float | None, start: _Instant
    ) -> None:
        self.mech, self.drive, self.sigma_min = mech, drive, sigma_min
        self.limits = mech.limit_list if "limits" in stop else ()
        self.of_forces = any(limit.unit == "N" for limit in self.limits)
        self.names = [("limit", limit.name) for limit in self.limits]
        self.floors = [BEYOND] * len(self.limits)
        self.sign: float | None = None
        if "singularity" in stop and not mech.mobility().uncontrolled:
            self.sign = float(np.sign(mech.determinant(start.pose).determinant))
            self.names.append(("singularity", "singular pose: det J changes its sign"))
            self.floors.append(0.0)
        if sigma_min is not None:
            self.names.append(("conditioning", f"sigma_min below {sigma_min:g}"))
            self.floors.append(0.0)
        self.before = self._values([start])[0]

    def _values(self, instants: Sequence[_Instant]) -> Array:
        """(N, events)."""
        _, poses, twists = (np.array(part) for part in zip(*instants, strict=True))
        values = [np.empty((len(poses), 0))]
        if self.of_forces:
            load = (self.drive.wrenches_at(instants), self.drive.wrench_axes)
            accelerations = self.drive.dynamics(instants).acceleration
            found = self.mech.limits(poses, *load, twist=twists, acceleration=accelerations)
            values.append(found.relative)
        elif self.limits:
            values.append(self.mech.limits(poses).relative)
        if self.sign is not None:
            values.append(self.sign * self.mech.determinant(poses).determinant[:, None])
        if self.sigma_min is not None:
            values.append(self.mech.conditioning(poses).sigma_min[:, None] - self.sigma_min)
        return np.concatenate(values, axis=1)

    def at_start(self, start: _Instant) -> End | None:
        """The end of a motion that may not begin."""
        for value, floor, (kind, reason) in zip(self.before, self.floors, self.names, strict=True):
            if value < floor or (kind == "singularity" and value == 0.0):
                return End(start.time, kind, f"{reason}, at the start")
        return None

    def within(self, piece: _Piece) -> End | None:
        """The first event in a step, at its time to rounding."""
        if not self.names:
            return None
        times = np.linspace(piece.start, piece.end, LOOKS + 1).tolist()
        looks = np.vstack([self.before, self._values([piece.at(time) for time in times[1:]])])
        self.before = looks[-1]
        for k in range(LOOKS):
            found = [
                End(self._root(piece, i, times[k : k + 2], looks[k : k + 2, i]), *self.names[i])
                for i in np.flatnonzero(looks[k + 1] < self.floors).tolist()
            ]
            if found:
                return min(found)
        return None

    def _root(self, piece: _Piece, event: int, times: list[float], values: Array) -> float:
        """When an event's function is zero, between two times of which the second is beyond."""
        if not values[0] > 0.0:
            return times[0]

        def value(time: float) -> float:
            return float(self._values([piece.at(time)])[0, event])

        return float(brentq(value, times[0], times[1], xtol=1e-15, rtol=1e-15))


# --- result -------------------------------------------------------------------------------------------------


def _solution(mech: Mechanism, drive: _Drive, instants: list[_Instant], end: End) -> Solution:
    """Dataset with the quantities of a given motion; the forces are those that drive it."""
    time, pose, twist = (np.array(part) for part in zip(*instants, strict=True))
    dynamics = drive.dynamics(instants)
    set = "natural" if "natural" in mech.coordinate_sets else "pose"
    coordinates = mech.coordinates(pose, set)
    state = State(
        mech,
        pose=pose,
        twist=twist,
        acceleration=dynamics.acceleration,
        coordinates=coordinates,
        coordinate_rates={},
        coordinate_second_rates={},
        status=dynamics.status,
    )
    wrench = drive.wrenches_at(instants)
    values = variables_of(mech, state, wrench, drive.wrench_axes)
    values |= {"force": drive.forces_at(instants), "constraint": dynamics.constraint}
    values["actuator_work"] = work_of(time, values["actuator_power"])
    determinant = Determinant(
        mech,
        determinant=values["determinant"],
        rate=values["determinant_rate"],
        status=values["status"],
    )
    attrs: dict[str, str | int] = {
        "title": f"{mech.name} under forces",
        "motion": "simulation",
        "coordinate_set": set,
        "wrench_axes": mech.geometry["load"]["axes"] if wrench is None else drive.wrench_axes,
        "singularities": json.dumps(sampled_passages(mech, time, pose, determinant), ensure_ascii=False),
        "end": json.dumps(end._asdict(), ensure_ascii=False),
    }
    return Solution(dataset_of(mech, time, values, attrs))
