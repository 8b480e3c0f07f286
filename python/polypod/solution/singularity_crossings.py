"""Singular poses that a motion crosses, touches or comes near, also between its samples [T34].

The findings are plain data that JSON holds; times in s, measures pure numbers, legs by name:

    threshold: measure below which a pose is near a singularity
    crossings: list of {time, kind, leg, crosses, found, between}; det J changes its sign there (`crosses`)
        or is zero and turns back. `found` is false where det J has another sign after a gap or jump of the
        states and no singular pose is known in between; `kind` is then UNKNOWN. `between`: the known instants
        around it.
    near: list of {kind, leg, start, end, time, minimum}; intervals of known instants at which the measure of
        that kind is below the threshold, its least value and when
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
from polypod.answers.singularity import NEAR_SINGULAR, Determinant, SingularityKind
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


@dataclass(frozen=True)
class _Known:
    """Instants, poses and det J with its rate, along a motion."""

    time: Array
    pose: Array
    determinant: Array
    rate: Array

    def and_also(self, other: _Known) -> _Known:
        time = np.concatenate([self.time, other.time])
        order = np.argsort(time, kind="stable")
        pairs = (
            (self.pose, other.pose),
            (self.determinant, other.determinant),
            (self.rate, other.rate),
        )
        return _Known(time[order], *(np.concatenate(pair)[order] for pair in pairs))


def find_passages(
    mech: Mechanism, motion: Motion, pose: Array, determinant: Determinant, threshold: float = NEAR_SINGULAR
) -> dict[str, Any]:
    """Singular poses that a motion, solved at its samples, meets: the findings described above."""
    known = _Known(*map(np.ascontiguousarray, (motion.time, pose, determinant.determinant, determinant.rate)))
    uncontrolled, crossings = mech.mobility().uncontrolled, []
    if not uncontrolled:
        known = _settled(mech, motion, known)
        crossings = [*_crossings(mech, known)]
    return {
        "threshold": threshold,
        "uncontrolled": uncontrolled,
        "crossings": crossings,
        "near": [*_near(mech, known, threshold)],
    }


def sampled_passages(
    mech: Mechanism, time: Array, pose: Array, determinant: Determinant, threshold: float = NEAR_SINGULAR
) -> dict[str, Any]:
    """Singular poses between states known at their instants only: zeros between them are those of cubics."""
    known = _Known(*map(np.ascontiguousarray, (time, pose, determinant.determinant, determinant.rate)))
    uncontrolled = mech.mobility().uncontrolled
    return {
        "threshold": threshold,
        "uncontrolled": uncontrolled,
        "crossings": [] if uncontrolled else [*_crossings(mech, known)],
        "near": [*_near(mech, known, threshold)],
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
    det = mech.determinant(state.pose, state.twist)
    return _Known(times, state.pose, det.determinant, det.rate)


def _crossings(mech: Mechanism, known: _Known) -> Iterator[dict[str, Any]]:
    solved = np.isfinite(known.determinant)
    time, poses = known.time[solved], known.pose[solved]
    if len(time) < 2:
        return
    resolution = RESOLUTION * (known.time[-1] - known.time[0])
    touched = -2
    for zero, crosses in _core.zeros(known.time, known.determinant, known.rate, resolution):
        nearest = int(np.argmin(np.abs(time - zero)))
        settled = bool(abs(time[nearest] - zero) <= resolution)
        singular = mech.singularity(poses[nearest])
        found = settled and singular.kind not in (SingularityKind.NONE, SingularityKind.UNKNOWN)
        if not crosses:
            # A near miss is none; of a motion that stays at singular poses the first is enough.
            again, touched = nearest == touched + 1, nearest if found else touched
            if again or not found:
                continue
        index = int(np.clip(np.searchsorted(time, zero, side="right"), 1, len(time) - 1))
        yield {
            "time": float(zero),
            "kind": SingularityKind(int(singular.kind) if found else SingularityKind.UNKNOWN).name,
            "leg": mech.leg_names[int(singular.leg)] if found and singular.leg >= 0 else None,
            "crosses": crosses,
            "found": found,
            "between": [float(time[index - 1]), float(time[index])],
        }


# --- near passages ------------------------------------------------------------------------------------------


def _near(mech: Mechanism, known: _Known, threshold: float) -> Iterator[dict[str, Any]]:
    """Intervals in which a measure of nearness is below the threshold, in the order of time."""
    poses = mech.singularity(known.pose)
    measures: list[tuple[SingularityKind, str | None, Array]] = [
        (SingularityKind.ACTUATION, None, poses.sigma_min),
        (SingularityKind.CONSTRAINT, None, poses.constraint_sigma),
    ]
    for i, leg in enumerate(mech.leg_names):
        measures.append((SingularityKind.LEG_LENGTH, leg, poses.leg_length[:, i]))
        measures.append((SingularityKind.LEG_FRAME, leg, poses.leg_sine[:, i]))
        measures.append((SingularityKind.STRUT_ACROSS_RAIL, leg, np.abs(poses.transmission[:, i])))
    found = []
    for measured, of_leg, measure in measures:
        for start, end in _runs(measure < threshold):
            least = start + int(np.argmin(measure[start:end]))
            of_constraint = measured == SingularityKind.CONSTRAINT
            what = _of_constraint(mech, known.pose[least], threshold) if of_constraint else (measured, of_leg)
            found.append(
                {
                    "kind": what[0].name,
                    "leg": what[1],
                    "start": float(known.time[start]),
                    "end": float(known.time[end - 1]),
                    "time": float(known.time[least]),
                    "minimum": float(measure[least]),
                }
            )
    yield from sorted(found, key=lambda passage: (passage["start"], passage["kind"], passage["leg"] or ""))


def _of_constraint(mech: Mechanism, pose: Array, threshold: float) -> tuple[SingularityKind, str | None]:
    """Whether a constraint nearly vanishes, and of which leg."""
    near = mech.singularity(pose, tolerance=threshold)
    vanishes = near.kind == SingularityKind.CONSTRAINT_VANISHES
    leg = mech.leg_names[int(near.leg)] if vanishes else None
    return (SingularityKind.CONSTRAINT_VANISHES if vanishes else SingularityKind.CONSTRAINT), leg


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


def _meaning(finding: dict[str, Any]) -> str:
    leg = f" (leg {finding['leg']})" if finding["leg"] is not None else ""
    return f"{leg}; {SingularityKind[finding['kind']].message}."
