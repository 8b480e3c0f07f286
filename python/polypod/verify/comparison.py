"""Polypod's answers and those of other engines, quantity by quantity: the errors and a verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.answers.status import Status
from polypod.arrays import check_wrench_axes
from polypod.errors import PolypodError, ShapeError
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.multibody.placement import PLATFORM
from polypod.multibody.tree import Multibody, describe
from polypod.solution.solve import states_along
from polypod.verify.engines import ENGINES, Driven, Twin, engine_class
from polypod.verify.quantity_errors import QUANTITIES, RELATIVE_TO, Row, States, row_of, scales_of
from polypod.verify.twin import pull

Array = NDArray[np.float64]
Values = dict[str, Array]

TOLERANCE = 1e-9
"""Largest relative error that counts as agreement, a pure number; rounding at sound poses is below 1e-12."""


@dataclass(frozen=True)
class Comparison:
    """One engine's table."""

    engine: str
    version: str
    rows: tuple[Row, ...]
    states: int
    compared: int
    """States with an answer from both."""
    without_answer: Mapping[str, int]
    """How many states had no answer: from Polypod, and from the engine, by status."""
    closure: float
    """Largest error of a joint in the engine's solutions, a cosine or a part of the characteristic length."""
    agrees: bool
    """All states are compared, and no relative error exceeds the tolerance."""
    notes: tuple[str, ...] = ()
    """Notes on the engine's answers."""


@dataclass(frozen=True)
class Verification:
    """Polypod against other engines."""

    mechanism: str
    motion: str
    tolerance: float
    comparisons: tuple[Comparison, ...]

    @property
    def agrees(self) -> bool:
        """Whether every engine agrees at every state."""
        return all(comparison.agrees for comparison in self.comparisons)

    def facts(self) -> dict[str, Any]:
        """All of it as plain data, SI; None for what is no number."""
        return {
            "mechanism": self.mechanism,
            "motion": self.motion,
            "tolerance": self.tolerance,
            "agrees": self.agrees,
            "relative_to": RELATIVE_TO,
            "engines": [
                {
                    "engine": c.engine,
                    "version": c.version,
                    "states": c.states,
                    "compared": c.compared,
                    "without_answer": dict(c.without_answer),
                    "closure": c.closure,
                    "agrees": c.agrees,
                    "notes": list(c.notes),
                    "quantities": [
                        {
                            "quantity": row.quantity,
                            "title": row.title,
                            "unit": row.unit,
                            "max": _finite(row.max),
                            "rms": _finite(row.rms),
                            "greatest": _finite(row.greatest),
                            "relative_max": _finite(row.relative_max),
                            "relative_rms": _finite(row.relative_rms),
                            "tolerance": row.tolerance,
                            "approximate": row.approximate,
                            "agrees": row.relative_max <= row.tolerance,
                            "worst": {
                                "part": row.part,
                                "state": row.index,
                                "time": row.time,
                                "pose": row.pose.tolist(),
                            },
                        }
                        for row in c.rows
                    ],
                }
                for c in self.comparisons
            ],
        }


def verify(
    mech: Mechanism,
    motion: Motion,
    engines: Sequence[str] = ("pinocchio",),
    tolerance: float = TOLERANCE,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Verification:
    """All quantities along a motion against other engines.

    The engines get the mechanism file's numbers, the platform's motion and the load, and find all else.

    Args:
        mech: the mechanism.
        motion: its motion; its own load, where it has one, stands for the mechanism's.
        engines: names of `ENGINES`.
        tolerance: largest relative error that counts as agreement, a pure number; approximate engines have
            their own, `Engine.approximate`.
        progress: called with the number of states done and of all.

    Raises:
        UnknownNameError: no such engine.
        MissingEngineError: an engine that is not installed.

    >>> import polypod as pp
    >>> from polypod.verify import verify
    >>> mech = pp.load("lu-3spu-2rpu-r")
    >>> motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample([0.0, 1.0, 2.0])
    >>> verify(mech, motion).agrees
    True
    """
    state = states_along(mech, motion)
    load = (motion.wrench, motion.wrench_axes)
    states = States(state.pose, state.twist, state.acceleration, load, motion.time, state.status)
    return _verify(mech, states, motion.name, engines, tolerance, progress)


def verify_states(
    mech: Mechanism,
    pose: ArrayLike,
    twist: ArrayLike,
    acceleration: ArrayLike,
    wrench: ArrayLike | None = None,
    wrench_axes: str = "base",
    *,
    engines: Sequence[str] = ("pinocchio",),
    tolerance: float = TOLERANCE,
    progress: Callable[[int, int], None] | None = None,
) -> Verification:
    """All quantities at states of the platform against other engines.

    Args:
        mech: the mechanism.
        pose: (N, 4, 4).
        twist: (N, 6).
        acceleration: (N, 6).
        wrench: load on the platform at o, (N, 6) or (6,), N and N m; the mechanism's own by default.
        wrench_axes: the axes of `wrench`, "base" or "platform".
        engines: names of `ENGINES`.
        tolerance: largest relative error that counts as agreement, a pure number; approximate engines have
            their own, `Engine.approximate`.
        progress: called with the number of states done and of all.

    Raises:
        UnknownNameError: no such engine.
        MissingEngineError: an engine that is not installed.
        ShapeError: arrays of other shapes.
    """
    states = _states(pose, twist, acceleration, wrench, wrench_axes)
    return _verify(mech, states, "states", engines, tolerance, progress)


def _states(
    pose: ArrayLike, twist: ArrayLike, acceleration: ArrayLike, wrench: ArrayLike | None, wrench_axes: str
) -> States:
    """The arguments as arrays of the right shapes."""
    check_wrench_axes(wrench_axes)
    poses = np.asarray(pose, dtype=np.float64)
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise ShapeError(f"pose has the shape {poses.shape}; needs (N, 4, 4)")
    sixes = {"twist": twist, "acceleration": acceleration}
    if wrench is not None:
        sixes["wrench"] = np.broadcast_to(wrench, (len(poses), 6)) if np.shape(wrench) == (6,) else wrench
    arrays = {name: np.asarray(value, dtype=np.float64) for name, value in sixes.items()}
    for name, array in arrays.items():
        if array.shape != (len(poses), 6):
            raise ShapeError(f"{name} has the shape {array.shape}; needs ({len(poses)}, 6)")
    return States(poses, arrays["twist"], arrays["acceleration"], (arrays.get("wrench"), wrench_axes))


def load_at_o(geometry: Mapping[str, Any], pose: Array, wrench: Array | None, axes: str) -> Array:
    """(N, 6): the load at o in base axes at poses (N, 4, 4); the file's own where there is no wrench."""
    if wrench is None:
        own = geometry["load"]
        wrench, axes = np.array([*own["force"], *own["torque"]]), own["axes"]
    load = np.broadcast_to(wrench, (len(pose), 6)).reshape(-1, 2, 3)
    if axes == "platform":
        load = np.einsum("nij,nkj->nki", pose[:, :3, :3], load)
    return load.reshape(-1, 6)


def _verify(
    mech: Mechanism,
    states: States,
    motion: str,
    engines: Sequence[str],
    tolerance: float,
    progress: Callable[[int, int], None] | None,
) -> Verification:
    if not 0.0 < tolerance < np.inf:
        raise PolypodError(f"tolerance is {tolerance!r}; must be a positive number")
    twins = {name: engine_class(name) for name in engines}
    if not twins:
        raise PolypodError(f"engines: there is none; valid: {', '.join(ENGINES)}")
    tree = describe(mech)
    mine, answered = _own_answers(mech, states)
    total = len(twins) * len(states.pose)
    comparisons = []
    for done, (name, twin) in enumerate(twins.items()):

        def report(state: int, before: int = done * len(states.pose)) -> None:
            if progress is not None:
                progress(before + state, total)

        comparisons.append(_compare(name, twin, tree, mech, states, mine, answered, tolerance, report))
    return Verification(mech.name, motion, tolerance, tuple(comparisons))


# --- the answers --------------------------------------------------------------------------------------------


def _own_answers(mech: Mechanism, states: States) -> tuple[Values, NDArray[np.integer[Any]]]:
    """Polypod's own answers, each (N, ...), and the status of each state."""
    motion = states[:3]
    kinematics = mech.kinematics(*motion)
    dynamics = mech.inverse_dynamics(*motion, *states.load)
    mobility = mech.mobility()
    values: Values = {
        name: array for name, array in kinematics.arrays.items() if name in QUANTITIES and array.shape[1]
    }
    values["platform_acceleration"] = states.acceleration[:, :3]
    values["platform_eps"] = states.acceleration[:, 3:]
    values["freedoms"] = np.full(len(states.pose), float(mobility.dof + mobility.passive))
    values["forces"] = dynamics.forces
    if mobility.idle:
        values["idle_torques"] = dynamics.idle_torques
    rows = mech.jacobian(states.pose)[:, mech.n_rows - (6 - mech.dof) :]
    if rows.shape[1]:
        # The multipliers as one wrench at o, whatever the units and signs of the single constraints.
        wrench = np.einsum("nk,nki->ni", dynamics.constraint, rows)
        values["constraint_force"], values["constraint_torque"] = wrench[:, :3], wrench[:, 3:]
    # The first thing that went wrong explains the rest.
    status = kinematics.status
    if states.status is not None:
        status = np.where(_answers(states.status), status, states.status)
    return values, np.where(_answers(status), dynamics.status, status)


def _answers(status: NDArray[np.integer[Any]]) -> NDArray[np.bool_]:
    return np.isin(status, [int(s) for s in Status if s.has_answer])


def _compare(
    name: str,
    kind: type[Twin] | type[Driven],
    tree: Multibody,
    mech: Mechanism,
    states: States,
    mine: Values,
    own_status: NDArray[np.integer[Any]],
    tolerance: float,
    report: Callable[[int], None],
) -> Comparison:
    theirs: list[dict[str, Any]] = []
    without: dict[str, int] = {}
    both: list[int] = []
    closure = 0.0
    twin: Any = kind(tree)
    driven = ENGINES[name].approximate is not None
    loads = load_at_o(tree.geometry, states.pose, *states.load)
    if driven and "idle_torques" in mine:
        loads = loads + _idle_loads(tree, states.pose, mine["idle_torques"])
    for i, (pose, twist, acceleration) in enumerate(zip(*states[:3], strict=True)):
        if driven:
            found, status = twin.answer(pose, twist, loads[i], mine["forces"][i])
        else:
            found, status = twin.answer(pose, twist, acceleration, loads[i])
        closure = max(closure, found.get("closure", 0.0)) if status.has_answer else closure
        own = Status(int(own_status[i]))
        for who, outcome in (("Polypod", own), (ENGINES[name].title, status)):
            if not outcome.has_answer:
                key = f"{who}: {outcome.name}"
                without[key] = without.get(key, 0) + 1
        if own.has_answer and status.has_answer:
            both.append(i)
            theirs.append(found)
        report(i + 1)
    chosen = np.array(both, dtype=np.int64)
    rows: tuple[Row, ...] = ()
    if both:
        values = {q: np.array([found[q] for found in theirs]) for q in mine if q in theirs[0]}
        weight = pull(tree, loads[chosen]) if driven else np.zeros(len(both))
        scales = scales_of(mech, states, mine["forces"][chosen], weight, chosen)
        limit = ENGINES[name].approximate
        # Counts are exact in any engine.
        limits = {
            q: (tolerance, False) if limit is None or q == "freedoms" else (limit, True) for q in values
        }
        rows = tuple(
            row_of(
                mech,
                states,
                quantity,
                mine[quantity][chosen],
                values[quantity],
                scales,
                limits[quantity],
                chosen,
            )
            for quantity in QUANTITIES
            if quantity in values
        )
    good = all(row.relative_max <= row.tolerance for row in rows)
    return Comparison(
        ENGINES[name].title,
        twin.version,
        rows,
        len(states.pose),
        len(both),
        without,
        closure,
        good and bool(rows) and len(both) == len(states.pose),
        tuple(twin.notes()) if driven else (),
    )


def _idle_loads(tree: Multibody, pose: Array, torques: Array) -> Array:
    """(N, 6): torques about the lines of local degrees of freedom as loads, which the efficiency divides."""
    found = np.zeros((len(pose), 6))
    for (body, axis), torque in zip(tree.idle, np.nan_to_num(torques).T, strict=True):
        along = pose[:, :3, :3] @ axis if body == PLATFORM else np.broadcast_to(axis, (len(pose), 3))
        found[:, 3:] += tree.geometry["efficiency"] * torque[:, None] * along
    return found


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
