"""Random mechanisms of all leg kinds against screws and loops in numpy, and against their twins in Pinocchio.

What becomes of one: `python tests/test_random_chains.py NUMBER`; of many, by leg kind: `... FIRST COUNT`.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import polypod as pp
from polypod import SingularityKind, Status

sys.path.insert(0, str(Path(__file__).parent))

from random_chains import KINDS, ON_ROD, Drawn, Mobility, chains, clear, draw, extent, of_geometry, slides

Array = NDArray[np.float64]

FEW = 150
MANY = 10_000
BATCHES = 40
SAMPLE = 20
"""Of so many, one is held against its twin."""
TWIN_POSES = 3
UNCLEAR = "no clear rank"
"""Of these the freedoms alone are compared; there are not many."""
LENGTHS = 1e-10
"""Relative to the longest leg: loops are closed to 1e-13, nearly singular ones magnify that."""
REGULAR = 1e-3
"""Least singular value, above which forward kinematics must come back."""
TWIN_REGULAR = 0.02
"""The same for forces: rounding grows with its inverse."""


@dataclass
class Outcome:
    """What became of one mechanism."""

    number: int
    kinds: tuple[str, ...]
    refused: str | None = None
    """Why, without numbers."""
    wrong: list[str] = field(default_factory=list)
    lengths: float | None = None
    """Worst relative difference of inverse kinematics from the joints' own values."""
    returned: int = 0
    """Poses that forward kinematics found again from their lengths."""
    twin: float | None = None
    """Worst relative difference from the twin."""


def examine(number: int) -> Outcome:
    """Draws a mechanism and compares all that can be compared."""
    drawn = draw(number)
    own, out = Mobility.of(drawn), Outcome(number, drawn.kinds)
    actuators = sum(leg.actuated for leg in drawn.legs)
    if not clear(drawn):
        out.refused, out.wrong = UNCLEAR, shaky(drawn)
        return out
    try:
        mech = pp.Mechanism.from_dict(drawn.data)
    except pp.MechanismError as error:
        out.refused, out.wrong = refusal(error, own, actuators)
        return out
    found = mech.mobility()
    if actuators < own.dof - len(found.idle):
        out.wrong.append(f"loaded with {actuators} actuators for {own.dof} freedoms, {found.idle}")
    # What actuators do not hold, by screws: idle freedoms too.
    left = found.uncontrolled + len(found.idle)
    theirs = Mobility(found.dof, found.passive, found.closure_rank, left)
    if theirs != own:
        out.wrong.append(f"mobility {theirs}, by screws {own}")
    if found.redundant != 6 * (len(drawn.legs) - 1) - own.closure_rank or found.joint_freedoms != sum(
        (len(leg.screws) for leg in drawn.legs), len(drawn.rods)
    ):
        out.wrong.append(f"{found.redundant} redundant closures, {found.joint_freedoms} freedoms of joints")
    kinematics(mech, drawn, out)
    if number % SAMPLE == 0:
        dynamics(mech, drawn, out)
    return out


def shaky(drawn: Drawn) -> list[str]:
    """What is wrong with the freedoms of a mechanism whose ranks are not clear."""
    dof = extent(drawn)
    try:
        found = pp.Mechanism.from_dict(drawn.data).dof
    except pp.MechanismError as error:
        said = re.search(r"for (\d+) freedoms", str(error))
        found = int(said[1]) if said else 0
    return [] if found == dof else [f"{found} freedoms, but poses in {dof} directions"]


def refusal(error: pp.MechanismError, own: Mobility, actuators: int) -> tuple[str, list[str]]:
    """The reason without its numbers, and what is wrong with it."""
    fault, *others = error.faults
    reason = re.sub(r"\d+", "n", fault.message.split(";")[0])
    said = re.match(r"(\d+) actuated legs for (\d+) freedoms.*; at least (\d+) legs", fault.message)
    if said:
        # Fewer are needed where freedoms are idle.
        right = (int(said[1]), int(said[2])) == (actuators, own.dof) and actuators < int(said[3]) <= own.dof
    else:
        right = "leave the platform no freedom" in fault.message and own.dof == 0
    return reason, [] if right and not others else [
        f"refused: {fault}; by screws {own}, {actuators} actuators"
    ]


def kinematics(mech: pp.Mechanism, drawn: Drawn, out: Outcome) -> None:
    """Lengths are those of the prismatic joints, and lead back to a pose that has them."""
    home = np.array([leg.length for leg in drawn.legs])
    poses = np.array([chains(drawn, q)[0][0] @ drawn.home for q in drawn.poses])
    lengths = home + np.array([q[slides(drawn)] for q in drawn.poses])
    found = mech.inverse_kinematics(poses)
    out.lengths = float((abs(found.lengths - lengths).max(axis=1) / lengths.max(axis=1)).max())
    if not out.lengths < LENGTHS:
        out.wrong.append(f"lengths differ by {out.lengths:.2g}: {found.status}")
    regular = mech.conditioning(poses).sigma_min > REGULAR
    # Where rows depend on one another while redundant ones hold the platform: no answer, a kind of its own.
    regular &= mech.singularity(poses).kind == SingularityKind.NONE
    if not (found.status[regular] == Status.OK).all():
        out.wrong.append(f"inverse kinematics has status {found.status} at regular poses")
    back = mech.forward_kinematics(found.lengths, poses[np.arange(len(poses)) - 1])
    again = mech.inverse_kinematics(back.pose).lengths
    solved = (back.status == Status.OK) & mech.actuated.any()
    out.returned = int(solved.sum())
    missed = abs(again - found.lengths)[:, mech.actuated].max(axis=1) / lengths.max(axis=1)
    if not (missed[solved] < LENGTHS).all():
        out.wrong.append(f"forward kinematics misses the lengths by {missed[solved].max():.2g}")
    # From the pose itself it must stay there.
    stay = mech.forward_kinematics(found.lengths, poses)
    gone = abs(stay.pose - poses).max(axis=(1, 2))[regular]
    if not ((stay.status[regular] == Status.OK) & (gone < 1e-9 / REGULAR)).all():
        out.wrong.append(f"forward kinematics leaves a regular pose: {stay.status}, {gone}")


def dynamics(mech: pp.Mechanism, drawn: Drawn, out: Outcome) -> None:
    """Inverse dynamics, and all on the way to it, against the twin at regular poses near home."""
    from polypod.verify import verify_states

    rng = np.random.default_rng([7, out.number])
    names = mech.equations_of_motion(mech.home, np.zeros(6), "pose").coordinates
    if not names:
        return
    middle = mech.coordinates(mech.home, "pose")
    spread = [{n: rng.uniform(-0.2, 0.2, 40) for n in names} for _ in range(3)]
    q = {n: middle.get(n, 0.0) + spread[0][n] for n in names}
    state = mech.state(q, spread[1], spread[2])
    usable = (state.status == Status.OK) & (mech.conditioning(state.pose).sigma_min > TWIN_REGULAR)
    chosen = np.flatnonzero(usable)[:TWIN_POSES]
    if not len(chosen):
        return
    motion = (state.pose[chosen], state.twist[chosen], state.acceleration[chosen])
    found = verify_states(mech, *motion, np.array([300.0, -200.0, -500.0, 20.0, 40.0, -30.0]))
    comparison = found.comparisons[0]
    out.twin = max(row.relative_max for row in comparison.rows)
    if not found.agrees or comparison.compared != len(chosen) or comparison.without_answer:
        rows = {row.quantity: row.relative_max for row in comparison.rows if not row.relative_max < 1e-9}
        out.wrong.append(f"the twin differs: {rows} {comparison.without_answer}")


def table(outcomes: list[Outcome]) -> str:
    """Numbers by leg kind, as rows of a page."""
    rows = [
        "| leg | drawn | refused | compared | worst length | twins | worst |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind in (*KINDS, *ON_ROD):
        of = [out for out in outcomes if kind in out.kinds]
        loaded, twins = (
            [out for out in of if out.refused is None],
            [out for out in of if out.twin is not None],
        )
        worst = (
            max((out.lengths or 0.0 for out in loaded), default=0.0),
            max((o.twin for o in twins), default=0.0),
        )
        numbers = f"{len(of)} | {len(of) - len(loaded)} | {len(loaded)} | {worst[0]:.1e} | {len(twins)}"
        rows.append(f"| {kind} | {numbers} | {worst[1]:.1e} |")
    reasons = Counter(out.refused for out in outcomes if out.refused)
    return "\n".join([*rows, "", *(f"{number} {reason}" for reason, number in reasons.items())])


def check(outcomes: list[Outcome]) -> None:
    assert sum(out.refused == UNCLEAR for out in outcomes) <= 1 + len(outcomes) / 100
    wrong = [f"{out.number} {'+'.join(out.kinds)}: {out.wrong}" for out in outcomes if out.wrong]
    assert not wrong, "\n".join(wrong[:20])


def test_a_few_mechanisms() -> None:
    pytest.importorskip("pinocchio")
    outcomes = [examine(number) for number in range(FEW)]
    check(outcomes)
    # Every kind of leg was there, in mechanisms that were compared; both styles, refusals, twins.
    compared = Counter(kind for out in outcomes if out.refused is None for kind in set(out.kinds))
    assert set(compared) == {*KINDS, *ON_ROD}, compared
    assert sum(out.refused is None for out in outcomes) > FEW / 3
    assert sum(out.refused is not None for out in outcomes) > FEW / 10
    assert sum(out.returned for out in outcomes) > FEW / 2
    assert sum(out.twin is not None for out in outcomes) > FEW / SAMPLE / 3


def test_a_leg_that_points_backwards_has_no_answer() -> None:
    """Its length would be negative; a U joint at the other end lets it come there without a jump."""
    data = pp.load("tricept").to_dict()
    post = next(leg for leg in data["legs"] if leg["platform"]["joint"] == "F")
    assert post["base"]["point"] == [0, 0, 0]
    mech, low = pp.Mechanism.from_dict(data), np.eye(4)
    low[2, 3] = -mech.home[2, 3]
    poses, rest = np.array([mech.home, low]), np.zeros((2, 6))
    wanted = [Status.OK, Status.BACKWARDS]
    for found, numbers in [
        ((answer := mech.inverse_kinematics(poses)), answer.lengths),
        ((answer := mech.kinematics(poses, rest, rest)), answer.rates),
        ((answer := mech.inverse_dynamics(poses, rest, rest)), answer.forces),
        ((answer := mech.forward_dynamics(poses, rest, np.zeros((2, 4)))), answer.acceleration),
        ((answer := mech.limits(poses)), answer.margins),
    ]:
        assert found.status.tolist() == wanted
        assert np.isfinite(numbers[0]).all()
        assert np.isnan(numbers[1]).all()
    assert not Status.BACKWARDS.has_answer
    # Around the pose where the post has no length.
    near = np.tile(np.eye(4), (4, 1, 1))
    near[:, 2, 3] = [1e-3, 1e-8, -1e-8, -1e-3]
    around = [Status.OUT_OF_STROKE, Status.SINGULAR, Status.SINGULAR, Status.BACKWARDS]
    assert mech.inverse_kinematics(near).status.tolist() == around
    # All actuated legs are as long there as at home: it has their lengths, but is none to be in.
    lengths = mech.inverse_kinematics(mech.home).lengths
    modes = mech.assembly_modes(lengths)
    at_home, at_low = ([abs(pose - other).max() < 1e-8 for pose in modes.pose] for other in poses)
    assert modes.mode_status[at_home].tolist() == [Status.OK]
    assert modes.mode_status[at_low].tolist() == [Status.BACKWARDS]
    down = mech.forward_kinematics(lengths, low)
    assert int(down.status) == Status.BACKWARDS
    assert abs(down.pose - low).max() < 1e-9
    tilts = {"rx": np.zeros(2), "ry": np.zeros(2), "z": poses[:, 2, 3]}
    for guess in (None, poses):
        state = mech.state(tilts, guess=guess)
        assert state.status.tolist() == wanted
        assert np.isnan(state.pose[1]).all()


def test_rows_that_are_independent_by_rounding_alone_are_not_taken() -> None:
    """At the first generic pose a leg lies along its rod, and rows that depend on one another seem not to."""
    drawn = draw(5999)
    mech = pp.Mechanism.from_dict(drawn.data)
    poses = np.array([chains(drawn, q)[0][0] @ drawn.home for q in drawn.poses] + [drawn.home])
    assert (mech.singularity(poses).kind == SingularityKind.NONE).all()
    rest = np.zeros((len(poses), 6))
    assert (mech.inverse_dynamics(poses, rest, rest).status == Status.OK).all()


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(BATCHES))
def test_many_mechanisms(batch: int) -> None:
    pytest.importorskip("pinocchio")
    count = MANY // BATCHES
    check([examine(number) for number in range(batch * count, (batch + 1) * count)])


@pytest.mark.parametrize(
    ("name", "dof", "passive"),
    [("3-rps", 3, 0), ("tsai-6-sps", 6, 6), ("exechon", 3, 0), ("3-upu", 3, 0), ("2upr-rpu", 3, 0)],
)
def test_screws_give_the_freedoms_of_the_catalogue(name: str, dof: int, passive: int) -> None:
    """The numpy side by itself, on mechanisms whose freedoms are known."""
    found = Mobility.of(of_geometry(pp.load(name).geometry))
    assert (found.dof, found.passive) == (dof, passive)


if __name__ == "__main__":
    if len(sys.argv) == 2:
        print(examine(int(sys.argv[1])))
    else:
        first, count = map(int, sys.argv[1:])
        results = []
        for number in range(first, first + count):
            results.append(examine(number))
            if results[-1].wrong:
                print(results[-1], flush=True)
        print(table(results))
