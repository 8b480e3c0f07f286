"""Singular poses that a motion crosses, touches or comes near, also between its samples [T34].

The findings are plain data that JSON holds; times in s, measures pure numbers, legs by name:

    threshold: measure below which a pose is near a singularity
    crossings: list of {time, kind, leg, freedoms, crosses, found, between}; det J changes its sign there
        (`crosses`) or is zero and turns back. `found` is false where det J has another sign after a gap or
        jump of the states and no singular pose is known in between; `kind` is then UNKNOWN. `between`: the
        known instants around it. Where the motion stays at singular poses there are none: `near` tells.
    near: list of {kind, leg, start, end, time, minimum, stays, freedoms}; intervals of known instants at
        which the measure of that kind is below the threshold, its least value and when: at the first
        singular pose, where there is one. `stays`: list of [start, end], the parts of it in which the motion
        stays at poses that are singular in that way
    freedoms: that locked actuators leave at the pose found or nearest, where it is singular; else 0
    uncontrolled: degrees of freedom that the locked actuators leave at every pose, by design; crossings are
        then not sought
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod import _core
from polypod.answers.singularity import NEAR_SINGULAR, TOLERANCE, Determinant, SingularityKind
from polypod.files.units import instant
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion

Array = NDArray[np.float64]

ROUNDS = 12
"""Times that the motion is looked at more closely where det J may be zero; about five settle it."""

SETTLED = 1e-12
"""Share of the motion's duration within which a change of sign of det J is known."""

NEAREST = 1e-7
"""Share of the motion's duration within which the time is known at which det J is nearest to zero."""

RESOLUTION = 1e-6
"""Share of the motion's duration below which two zeros are one that is touched: rounding makes two of one."""

CHUNK = 20_000
"""Poses analysed at once: memory does not grow with what is not kept."""

_MEASURES = (
    "kind",
    "uncontrolled",
    "sigma_min",
    "constraint_sigma",
    "leg_length",
    "leg_sine",
    "transmission",
)

STAYS = 3
"""Samples in a row at singular poses with which a motion stays at such."""


@dataclass(frozen=True)
class _Known:
    """Instants along a motion: poses, det J with its rate, and the measures of singularity."""

    time: Array
    pose: Array
    determinant: Array
    rate: Array
    measures: dict[str, NDArray[Any]]

    @classmethod
    def at(cls, mech: Mechanism, time: Array, pose: Array, determinant: Determinant) -> _Known:
        time, pose, det, rate = map(
            np.ascontiguousarray, (time, pose, determinant.determinant, determinant.rate)
        )
        return cls(time, pose, det, rate, _measured(mech, pose))

    def and_also(self, other: _Known) -> _Known:
        order = np.argsort(np.concatenate([self.time, other.time]), kind="stable")

        def merged(ours: NDArray[Any], others: NDArray[Any]) -> NDArray[Any]:
            return np.concatenate([ours, others])[order]

        return _Known(
            merged(self.time, other.time),
            merged(self.pose, other.pose),
            merged(self.determinant, other.determinant),
            merged(self.rate, other.rate),
            {name: merged(values, other.measures[name]) for name, values in self.measures.items()},
        )


def _measured(mech: Mechanism, poses: Array) -> dict[str, NDArray[Any]]:
    """What of singularity analysis is looked at here, of poses (n, 4, 4): the rest of it is not kept."""
    parts = []
    for first in range(0, max(len(poses), 1), CHUNK):
        part = mech.singularity(poses[first : first + CHUNK])
        parts.append([getattr(part, name) for name in _MEASURES])
    columns = map(np.concatenate, zip(*parts, strict=True))
    return dict(zip(_MEASURES, columns, strict=True))


def find_passages(
    mech: Mechanism, motion: Motion, pose: Array, determinant: Determinant, threshold: float = NEAR_SINGULAR
) -> dict[str, Any]:
    """Singular poses that a motion, solved at its samples, meets: the findings described above."""
    known = _Known.at(mech, motion.time, pose, determinant)
    if not mech.mobility().uncontrolled:
        known = _settled(mech, motion, known)
    return _findings(mech, known, motion.time, threshold)


def sampled_passages(
    mech: Mechanism, time: Array, pose: Array, determinant: Determinant, threshold: float = NEAR_SINGULAR
) -> dict[str, Any]:
    """Singular poses between states known at their instants only: zeros between them are those of cubics."""
    return _findings(mech, _Known.at(mech, time, pose, determinant), time, threshold)


def _findings(mech: Mechanism, known: _Known, samples: Array, threshold: float) -> dict[str, Any]:
    uncontrolled = mech.mobility().uncontrolled
    near = [*_near(mech, known, samples, threshold)]
    stays = [interval for passage in near for interval in passage["stays"]]
    return {
        "threshold": threshold,
        "uncontrolled": uncontrolled,
        "crossings": [] if uncontrolled else [*_crossings(mech, known, stays)],
        "near": near,
    }


# --- zeros of det J -----------------------------------------------------------------------------------------


def _settled(mech: Mechanism, motion: Motion, known: _Known) -> _Known:
    """With the motion evaluated where det J is zero or nearest to it, as far as cubics tell."""
    duration = float(motion.time[-1] - motion.time[0])
    precision = (SETTLED * duration, NEAREST * duration, RESOLUTION * duration)
    for _ in range(ROUNDS):
        unsettled = _core.unsettled_zeros(known.time, known.determinant, known.rate, precision)
        times = np.setdiff1d(np.array(unsettled), known.time)
        if not times.size:
            break
        known = known.and_also(_evaluated(mech, motion, known, times))
    return known


def _evaluated(mech: Mechanism, motion: Motion, known: _Known, times: Array) -> _Known:
    """The motion at other instants; dependent coordinates follow from the known poses before."""
    solved = np.isfinite(known.determinant)
    before = np.searchsorted(known.time[solved], times, side="right") - 1
    sample = motion.sample(times)
    state = mech.state(
        sample.coordinates,
        sample.rates,
        branch=motion.branch,
        guess=known.pose[solved][np.maximum(before, 0)],
    )
    return _Known.at(mech, times, state.pose, mech.determinant(state.pose, state.twist))


def _crossings(mech: Mechanism, known: _Known, stays: list[list[float]]) -> Iterator[dict[str, Any]]:
    """Zeros of det J, but for those while the motion stays at singular poses, which rounding chooses."""
    solved = np.isfinite(known.determinant)
    time, poses = known.time[solved], known.pose[solved]
    if len(time) < 2:
        return
    resolution = RESOLUTION * (known.time[-1] - known.time[0])
    touched = -2
    for zero, crosses in _core.zeros(known.time, known.determinant, known.rate, resolution):
        if any(start - resolution <= zero <= end + resolution for start, end in stays):
            continue
        index = int(np.clip(np.searchsorted(time, zero, side="right"), 1, len(time) - 1))
        nearest = index - int(zero - time[index - 1] < time[index] - zero)
        settled = bool(abs(time[nearest] - zero) <= resolution)
        at = mech.singularity(poses[nearest])
        kind, leg = int(at.kind), int(at.leg)
        found = settled and kind > SingularityKind.NONE
        if not crosses:
            # A near miss is none; of two next to each other the first is enough.
            again, touched = nearest == touched + 1, nearest if found else touched
            if again or not found:
                continue
        yield {
            "time": float(zero),
            "kind": SingularityKind(kind if found else SingularityKind.UNKNOWN).name,
            "leg": mech.leg_names[leg] if found and leg >= 0 else None,
            "freedoms": int(at.uncontrolled) if found else 0,
            "crosses": crosses,
            "found": found,
            "between": [float(time[index - 1]), float(time[index])],
        }


# --- near passages ------------------------------------------------------------------------------------------


def _near(mech: Mechanism, known: _Known, samples: Array, threshold: float) -> Iterator[dict[str, Any]]:
    """Intervals in which a measure of nearness is below the threshold, in the order of time."""
    at = known.measures
    of_constraints = np.isin(at["kind"], (SingularityKind.CONSTRAINT, SingularityKind.CONSTRAINT_VANISHES))
    measures: list[tuple[SingularityKind, str | None, Array]] = [
        # Where constraints are lost, so is what the actuators hold: that is one singularity.
        (SingularityKind.ACTUATION, None, np.where(of_constraints, np.inf, at["sigma_min"])),
        (SingularityKind.CONSTRAINT, None, at["constraint_sigma"]),
    ]
    for i, leg in enumerate(mech.leg_names):
        measures.append((SingularityKind.LEG_LENGTH, leg, at["leg_length"][:, i]))
        measures.append((SingularityKind.LEG_FRAME, leg, at["leg_sine"][:, i]))
        measures.append((SingularityKind.STRUT_ACROSS_RAIL, leg, np.abs(at["transmission"][:, i])))
    found = []
    for kind, of_leg, measure in measures:
        singular = _runs(measure <= TOLERANCE)
        held = [run for run in singular if _samples_in(samples, known.time, run) >= STAYS]
        for start, end in _runs(measure < threshold):
            stays = [run for run in held if start <= run[0] and run[1] <= end]
            # Of poses that are all singular rounding would choose the nearest.
            least = stays[0][0] if stays else start + int(np.argmin(measure[start:end]))
            vanishing = kind == SingularityKind.CONSTRAINT and _vanishing(mech, known.pose[least], threshold)
            found.append(
                {
                    "kind": (SingularityKind.CONSTRAINT_VANISHES if vanishing else kind).name,
                    "leg": vanishing or of_leg,
                    "start": float(known.time[start]),
                    "end": float(known.time[end - 1]),
                    "time": float(known.time[least]),
                    "minimum": float(measure[least]),
                    "stays": [[float(known.time[a]), float(known.time[b - 1])] for a, b in stays],
                    "freedoms": int(at["uncontrolled"][least]) if measure[least] <= TOLERANCE else 0,
                }
            )
    yield from sorted(found, key=lambda passage: (passage["start"], passage["kind"], passage["leg"] or ""))


def _samples_in(samples: Array, time: Array, run: tuple[int, int]) -> int:
    """How many samples there are in a run of known instants."""
    first = np.searchsorted(samples, time[run[0]])
    return int(np.searchsorted(samples, time[run[1] - 1], side="right") - first)


def _vanishing(mech: Mechanism, pose: Array, threshold: float) -> str | None:
    """The leg whose constraint nearly vanishes at a pose (4, 4), if one does."""
    near = mech.singularity(pose, tolerance=threshold)
    return mech.leg_names[int(near.leg)] if near.kind == SingularityKind.CONSTRAINT_VANISHES else None


def _runs(below: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last-but-one index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], below, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


# --- in words -----------------------------------------------------------------------------------------------


def warnings_of(findings: dict[str, Any]) -> list[str]:
    """One plain sentence for each finding, with its kind and its time."""
    notes = []
    if findings["uncontrolled"]:
        notes.append(f"singular by design: {SingularityKind.ACTUATION.message}, at every pose of the motion.")
    for crossing in findings["crossings"]:
        if not crossing["found"]:
            start, end = crossing["between"]
            notes.append(
                f"det J has another sign at {instant(end)} than at {instant(start)}, and no singular pose "
                "is known in between: the states have a gap or a jump there."
            )
            continue
        verb = "crosses" if crossing["crosses"] else "touches"
        notes.append(
            f"the motion {verb} a singular pose at {instant(crossing['time'], 9)}{_meaning(crossing)}"
        )
    for passage in findings["near"]:
        if passage["stays"]:
            notes.append(f"the motion {_stay(passage, findings['threshold'])}{_meaning(passage)}")
            continue
        when = (
            f"from {instant(passage['start'])} to {instant(passage['end'])}"
            if passage["end"] > passage["start"]
            else f"at {instant(passage['start'])}"
        )
        notes.append(
            f"the motion is near a singular pose {when}, nearest at {instant(passage['time'])} with "
            f"{passage['minimum']:.2g} (near is below {findings['threshold']:g}){_meaning(passage)}"
        )
    return notes


def _stay(passage: dict[str, Any], threshold: float) -> str:
    """From when to when a motion stays at singular poses, and is near them."""
    spans = [f"from {instant(start)} to {instant(end)}" for start, end in passage["stays"]]
    text = "stays at singular poses " + " and ".join(spans)
    whole = [passage["start"], passage["end"]]
    if passage["stays"] == [whole]:
        return text
    start, end = map(instant, whole)
    return f"{text}, and is near them from {start} to {end} (near is below {threshold:g})"


def _meaning(finding: dict[str, Any]) -> str:
    leg = f" (leg {finding['leg']})" if finding["leg"] is not None else ""
    return f"{leg}; {SingularityKind[finding['kind']].with_freedoms(finding['freedoms'])}."
