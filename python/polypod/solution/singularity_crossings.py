"""Singular poses that a motion crosses, touches or comes near, also between its samples [T34].

The findings are plain data that JSON holds; times in s, measures pure numbers, legs by name:

    threshold: measure below which a pose is near a singularity
    crossings: list of {time, kind, leg, freedoms, crosses, found, between}; det J changes its sign there
        (`crosses`) or is zero and turns back. `found` is false where det J has another sign after a gap or
        jump of the states and no singular pose is known in between; `kind` is then UNKNOWN. `between`: the
        known instants around it. Where the motion stays at singular poses there are none: `near` tells.
    near: list of {kind, leg, start, end, time, minimum, stays, freedoms}; intervals of known instants at
        which the measure of that kind is below the threshold, its least value and when; whether it is zero
        all the while, up to rounding
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


SINGULAR = 1e-6
"""Measure below which a pose is singular: where constraints depend on one another, poses that follow from
coordinates are off by the root of rounding."""

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
    stays = _stays(mech, known)
    if not uncontrolled:
        known = _settled(mech, motion, known)
        crossings = [*_crossings(mech, known, stays)]
    return {
        "threshold": threshold,
        "uncontrolled": uncontrolled,
        "crossings": crossings,
        "near": [*_near(mech, known, threshold, stays)],
    }


def sampled_passages(
    mech: Mechanism, time: Array, pose: Array, determinant: Determinant, threshold: float = NEAR_SINGULAR
) -> dict[str, Any]:
    """Singular poses between states known at their instants only: zeros between them are those of cubics."""
    known = _Known(*map(np.ascontiguousarray, (time, pose, determinant.determinant, determinant.rate)))
    uncontrolled, stays = mech.mobility().uncontrolled, _stays(mech, known)
    return {
        "threshold": threshold,
        "uncontrolled": uncontrolled,
        "crossings": [] if uncontrolled else [*_crossings(mech, known, stays)],
        "near": [*_near(mech, known, threshold, stays)],
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


Stays = list[tuple[float, float]]


def _stays(mech: Mechanism, samples: _Known) -> Stays:
    """Intervals of the samples at which the motion stays at singular poses."""
    singular = _measured(mech, samples.pose)["kind"] > SingularityKind.NONE
    runs = [(start, end) for start, end in _runs(singular) if end - start >= STAYS]
    return [(float(samples.time[start]), float(samples.time[end - 1])) for start, end in runs]


def _crossings(mech: Mechanism, known: _Known, stays: Stays) -> Iterator[dict[str, Any]]:
    solved = np.isfinite(known.determinant)
    time, poses = known.time[solved], known.pose[solved]
    if len(time) < 2:
        return
    resolution = RESOLUTION * (known.time[-1] - known.time[0])
    touched = -2
    for zero, crosses in _core.zeros(known.time, known.determinant, known.rate, resolution):
        nearest = int(np.argmin(np.abs(time - zero)))
        if any(start - resolution <= zero <= end + resolution for start, end in stays):
            continue
        settled = bool(abs(time[nearest] - zero) <= resolution)
        at = mech.singularity(poses[nearest], tolerance=SINGULAR)
        kind, leg = int(at.kind), int(at.leg)
        found = settled and kind > SingularityKind.NONE
        if not crosses:
            # A near miss is none; of two next to each other the first is enough.
            again, touched = nearest == touched + 1, nearest if found else touched
            if again or not found:
                continue
        index = int(np.clip(np.searchsorted(time, zero, side="right"), 1, len(time) - 1))
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


def _near(mech: Mechanism, known: _Known, threshold: float, stays: Stays) -> Iterator[dict[str, Any]]:
    """Intervals in which a measure of nearness is below the threshold, in the order of time."""
    at = _measured(mech, known.pose)
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
        runs = [
            (start, end, start + int(np.argmin(measure[start:end])))
            for start, end in _runs(measure < threshold)
        ]
        vanishing = _vanishing(mech, known.pose[[least for *_, least in runs]], threshold)
        for (start, end, least), vanishes in zip(runs, vanishing, strict=True):
            of_constraint = kind == SingularityKind.CONSTRAINT and vanishes is not None
            singular = measure[start:end] <= SINGULAR
            first, last = float(known.time[start]), float(known.time[end - 1])
            found.append(
                {
                    "kind": (SingularityKind.CONSTRAINT_VANISHES if of_constraint else kind).name,
                    "leg": vanishes if of_constraint else of_leg,
                    "start": first,
                    "end": last,
                    "time": float(known.time[least]),
                    "minimum": float(measure[least]),
                    "stays": bool(singular.all()) and any(first <= a and b <= last for a, b in stays),
                    "freedoms": int(at["uncontrolled"][least]) if singular.any() else 0,
                }
            )
    yield from sorted(found, key=lambda passage: (passage["start"], passage["kind"], passage["leg"] or ""))


def _measured(mech: Mechanism, poses: Array) -> dict[str, NDArray[Any]]:
    """What of singularity analysis is looked at here, of poses (n, 4, 4): the rest of it is not kept."""
    parts = []
    for first in range(0, max(len(poses), 1), CHUNK):
        part = mech.singularity(poses[first : first + CHUNK], tolerance=SINGULAR)
        parts.append([getattr(part, name) for name in _MEASURES])
    return {
        name: np.concatenate(columns)
        for name, columns in zip(_MEASURES, zip(*parts, strict=True), strict=True)
    }


def _vanishing(mech: Mechanism, poses: Array, threshold: float) -> list[str | None]:
    """The leg whose constraint nearly vanishes at each pose (n, 4, 4), if one does."""
    near = mech.singularity(poses, tolerance=threshold)
    vanish = near.kind == SingularityKind.CONSTRAINT_VANISHES
    return [mech.leg_names[leg] if of else None for leg, of in zip(near.leg, vanish, strict=True)]


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
            start, end = instant(passage["start"]), instant(passage["end"])
            notes.append(f"the motion stays at singular poses from {start} to {end}{_meaning(passage)}")
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


def _meaning(finding: dict[str, Any]) -> str:
    leg = f" (leg {finding['leg']})" if finding["leg"] is not None else ""
    return f"{leg}; {SingularityKind[finding['kind']].with_freedoms(finding['freedoms'])}."
