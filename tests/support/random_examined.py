"""Random mechanisms against screws, loops and virtual power in numpy, and their twins.

From the folder of the tests, what becomes of one: `python -m support.random_examined NUMBER`; of many, by leg
kind: `... FIRST COUNT`.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import polypod as pp
from polypod import SingularityKind, Status
from support.random_chains import KINDS, ON_RAIL, ON_ROD, draw
from support.random_dynamics import state
from support.random_screws import (
    Drawn,
    Mobility,
    by,
    chains,
    clear,
    extent,
    slides,
    turning,
    unfelt,
    unit,
)

Array = NDArray[np.float64]

SAMPLE = 20
"""Of so many, one is held against its twin."""
TWIN_POSES = 3
FORCES = 1e-9
"""Relative to the largest force: rounding, magnified by singular values and redundant closures."""
LOAD = np.array([300.0, -200.0, -500.0, 20.0, 40.0, -30.0])
UNCLEAR = "no clear rank"
"""Of these the degrees of freedom alone are compared; there are not many."""
MISFIT = "joints or struts do not fit the rail"
LINE = 1e-8
"""Share of a rotation about an idle line that a leg may feel: rounding of ranks."""
LENGTHS = 1e-10
"""Relative to the longest leg: loops are closed to 1e-13, nearly singular ones magnify that."""
REGULAR = 1e-3
"""Least singular value, above which forward kinematics must come back."""
TWIN_REGULAR = 0.02
"""Least singular value, above which forces must agree: rounding grows with its inverse."""


@dataclass
class Outcome:
    """Outcome of one mechanism."""

    number: int
    kinds: tuple[str, ...]
    refused: str | None = None
    """Why, without numbers."""
    wrong: list[str] = field(default_factory=list)
    lengths: float | None = None
    """Worst relative difference of inverse kinematics from the joints' own values."""
    returned: int = 0
    """Poses that forward kinematics found again from their lengths."""
    forces: float | None = None
    """Worst relative difference of active forces from those by virtual power."""
    idle: int = 0
    redundant: bool = False
    """Whether more legs are actuated than it takes."""
    twin: float | None = None
    """Worst relative difference from the twin."""


def examine(number: int) -> Outcome:
    """Draws a mechanism and compares all that can be compared."""
    drawn = draw(number)
    out = Outcome(number, drawn.kinds)
    if drawn.faults:
        out.refused, out.wrong = faulty(drawn)
        return out
    own = Mobility.of(drawn)
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
    out.idle, out.redundant = len(found.idle), mech.redundantly_actuated
    # What actuators do not hold, by screws: local degrees of freedom too.
    left = found.uncontrolled + out.idle
    theirs = Mobility(found.dof, found.passive, found.closure_rank, left, out.idle)
    if theirs != own:
        out.wrong.append(f"mobility {theirs}, by screws {own}")
    if actuators < own.dof - own.idle:
        out.wrong.append(f"loaded with {actuators} actuators for {own}")
    if found.redundant != 6 * (len(drawn.legs) - 1) - own.closure_rank or found.joint_freedoms != sum(
        (len(leg.screws) for leg in drawn.legs), len(drawn.rods)
    ):
        out.wrong.append(
            f"{found.redundant} redundant closures, {found.joint_freedoms} degrees of freedom of joints"
        )
    lines(mech, drawn, out)
    kinematics(mech, drawn, out)
    power(mech, drawn, out)
    if number % SAMPLE == 0:
        dynamics(mech, drawn, out)
    return out


def freedoms(drawn: Drawn) -> int:
    """Those of the loaded mechanism, or what its refusal tells."""
    try:
        return pp.Mechanism.from_dict(drawn.data).dof
    except pp.MechanismError as error:
        said = re.search(r"(?:for|leave|all) (\d+) degrees of freedom|(one) degree of freedom", str(error))
        return int(said[1] or 1) if said else 0


def faulty(drawn: Drawn) -> tuple[str, list[str]]:
    """Reason for which a mechanism with impossible legs is refused."""
    try:
        pp.Mechanism.from_dict(drawn.data)
    except pp.MechanismError as error:
        places = [fault.place for fault in error.faults]
        return MISFIT, [] if places == drawn.faults else [f"refused: {error}"]
    return "", [f"loaded in spite of {drawn.faults}"]


def lines(mech: pp.Mechanism, drawn: Drawn, out: Outcome) -> None:
    """Rotations about lines of local degrees of freedom are twists that no leg feels, at poses near home."""
    for line in mech.mobility().idle:
        axis, point = np.array(line.axis), np.array(line.point)
        if line.body == "platform":
            axis, point = drawn.home[:3, :3] @ axis, drawn.home[:3, :3] @ point + drawn.home[:3, 3]
        turn = turning(axis, point)[:, None]
        for end, twists in unfelt(drawn):
            now = by(end, turn) if line.body == "platform" else turn
            if not abs(now - twists @ (twists.T @ now)).max() < LINE:
                out.wrong.append(f"legs feel the rotation about the idle line {line}")


def shaky(drawn: Drawn) -> list[str]:
    """Faults in the degrees of freedom of a mechanism whose ranks are not clear."""
    dof, found = extent(drawn), freedoms(drawn)
    return [] if found == dof else [f"{found} degrees of freedom, but poses in {dof} directions"]


def refusal(error: pp.MechanismError, own: Mobility, actuators: int) -> tuple[str, list[str]]:
    """The reason without its numbers, and what is wrong with it."""
    fault, *others = error.faults
    reason = re.sub(r"\d+", "n", fault.message.split(";")[0])
    said = re.match(r"(\d+) actuated legs for (\d+) degrees of freedom.*; at least (\d+) legs", fault.message)
    if said:
        # Fewer are needed where degrees of freedom are idle.
        needed = own.dof - own.idle
        right = [int(n) for n in said.groups()] == [actuators, own.dof, needed] and actuators < needed
    elif "idle, so that no leg moves it" in fault.message:
        right = own.dof == own.idle > 0
    else:
        right = "leave the platform no degree of freedom" in fault.message and own.dof == 0
    return reason, [] if right and not others else [
        f"refused: {fault}; by screws {own}, {actuators} actuators"
    ]


def leans(drawn: Drawn, q: Array, pose: Array) -> Array:
    """(legs,): the part of each slider's strut along its rail, times its branch, m; none is 1."""
    found = np.ones(len(drawn.legs))
    for i, (leg, place) in enumerate(zip(drawn.legs, places(drawn, q), strict=True)):
        if leg.slider:
            rail, base = unit(np.array(leg.table["slider"]["axis"])), np.array(leg.table["base"]["point"])
            above = pose[:3, :3] @ leg.table["platform"]["point"] + pose[:3, 3]
            found[i] = leg.table["slider"]["branch"] * (rail @ (above - base) - place)
    return found


def places(drawn: Drawn, q: Array) -> Array:
    """(legs,): leg lengths and places of carriages at joint values q."""
    return np.array([leg.coordinate for leg in drawn.legs]) + q[slides(drawn)]


def regular_at(mech: pp.Mechanism, poses: Array, least: float) -> NDArray[np.bool_]:
    """Where rounding is magnified by less than 1/least: J is regular, and struts lean along their rails."""
    found = mech.singularity(poses)
    # Rows may depend on one another while redundant ones hold the platform: no answer, a kind of its own.
    regular = (found.sigma_min > least) & (found.kind == SingularityKind.NONE)
    return np.asarray(regular & (abs(found.transmission).min(axis=-1) > least))


def kinematics(mech: pp.Mechanism, drawn: Drawn, out: Outcome) -> None:
    """Lengths are those of the prismatic joints, and lead back to a pose that has them."""
    poses = np.array([chains(drawn, q)[0][0] @ drawn.home for q in drawn.poses])
    own = np.array([places(drawn, q) for q in drawn.poses])
    lean = np.array([leans(drawn, q, pose) for q, pose in zip(drawn.poses, poses, strict=True)])
    sign = np.array([leg.table["slider"]["branch"] if leg.slider else 0.0 for leg in drawn.legs])
    # A strut that has gone over to the other branch: its carriage has another place on that of the file.
    lengths = own + 2.0 * sign * np.minimum(lean, 0.0)
    size = abs(lengths).max(axis=1)
    found = mech.inverse_kinematics(poses)
    # Where a strut is perpendicular to its rail, a place is known to the square root of rounding.
    off = abs(found.lengths - lengths) * np.minimum(abs(lean), 1.0)
    out.lengths = float((off.max(axis=1) / size).max())
    if not out.lengths < LENGTHS:
        out.wrong.append(f"lengths differ by {out.lengths:.2g}: {found.status}")
    regular = regular_at(mech, poses, REGULAR)
    if not (found.status[regular] == Status.OK).all():
        out.wrong.append(f"inverse kinematics has status {found.status} at regular poses")
    back = mech.forward_kinematics(found.lengths, poses[np.arange(len(poses)) - 1])
    again = mech.inverse_kinematics(back.pose).lengths
    solved = (back.status == Status.OK) & mech.actuated.any()
    out.returned = int(solved.sum())
    missed = abs(again - found.lengths)[:, mech.actuated].max(axis=1) / size
    if not (missed[solved] < LENGTHS).all():
        out.wrong.append(f"forward kinematics misses the lengths by {missed[solved].max():.2g}")
    # From the pose itself it must stay there.
    stay = mech.forward_kinematics(found.lengths, poses)
    gone = abs(stay.pose - poses).max(axis=(1, 2))[regular]
    if not ((stay.status[regular] == Status.OK) & (gone < 1e-9 / REGULAR)).all():
        out.wrong.append(f"forward kinematics leaves a regular pose: {stay.status}, {gone}")
    over = regular & (lean[:, mech.actuated] < 0.0).any(axis=1)
    other = mech.forward_kinematics(own, poses).status[over]
    if not (other == Status.OTHER_BRANCH).all():
        out.wrong.append(f"forward kinematics has status {other} where struts have gone over")


def power(mech: pp.Mechanism, drawn: Drawn, out: Outcome) -> None:
    """Active forces do the work on all motions that the loops allow; redundant ones are the least."""
    rng = np.random.default_rng([11, out.number])
    idle = [(line.body, np.array(line.axis)) for line in mech.mobility().idle]
    for q in drawn.poses:
        pose = chains(drawn, q)[0][0] @ drawn.home
        if not (regular_at(mech, pose, TWIN_REGULAR) and (leans(drawn, q, pose) > 0.0).all()):
            continue
        own = state(drawn, q, idle, rng, LOAD)
        found = mech.inverse_dynamics(own.pose, own.twist, own.acceleration, LOAD)
        mine, theirs = [*own.forces, *own.torques], [*found.forces, *found.idle_torques]
        off = float(abs(np.subtract(mine, theirs)).max() / abs(np.array(mine)).max())
        out.forces = max(out.forces or 0.0, off)
        if not (off < FORCES and found.status == Status.OK):
            out.wrong.append(f"forces differ by {off:.2g} ({own.unbalanced:.1g}), status {found.status}")


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
    usable = (state.status == Status.OK) & regular_at(mech, state.pose, TWIN_REGULAR)
    chosen = np.flatnonzero(usable)[:TWIN_POSES]
    if not len(chosen):
        return
    motion = (state.pose[chosen], state.twist[chosen], state.acceleration[chosen])
    found = verify_states(mech, *motion, LOAD)
    comparison = found.comparisons[0]
    out.twin = max(row.relative_max for row in comparison.rows)
    if not found.agrees or comparison.compared != len(chosen) or comparison.without_answer:
        rows = {row.quantity: row.relative_max for row in comparison.rows if not row.relative_max < 1e-9}
        out.wrong.append(f"the twin differs: {rows} {comparison.without_answer}")


def table(outcomes: list[Outcome]) -> str:
    """Numbers by leg kind, as rows of a page."""
    rows = [
        "| leg | drawn | refused | compared | worst length | worst force | twins | worst |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind in (*KINDS, *ON_ROD, *ON_RAIL):
        of = [out for out in outcomes if kind in out.kinds]
        loaded, twins = (
            [out for out in of if out.refused is None],
            [out for out in of if out.twin is not None],
        )
        worst = [
            max((getattr(out, name) or 0.0 for out in loaded), default=0.0)
            for name in ("lengths", "forces", "twin")
        ]
        numbers = f"{len(of)} | {len(of) - len(loaded)} | {len(loaded)} | {worst[0]:.1e} | {worst[1]:.1e}"
        rows.append(f"| {kind} | {numbers} | {len(twins)} | {worst[2]:.1e} |")
    reasons = Counter(out.refused for out in outcomes if out.refused)
    special = Counter((out.idle, out.redundant) for out in outcomes if out.refused is None)
    return "\n".join(
        [
            *rows,
            "",
            *(f"{number} {reason}" for reason, number in reasons.items()),
            *(
                f"{number} with (local degrees of freedom, redundant legs) {kind}"
                for kind, number in special.items()
            ),
        ]
    )


def check(outcomes: list[Outcome]) -> None:
    assert sum(out.refused == UNCLEAR for out in outcomes) <= 1 + len(outcomes) / 100
    wrong = [f"{out.number} {'+'.join(out.kinds)}: {out.wrong}" for out in outcomes if out.wrong]
    assert not wrong, "\n".join(wrong[:20])


def counts(outcomes: list[Outcome]) -> Counter[str]:
    """Compared mechanisms with each kind of leg."""
    return Counter(kind for out in outcomes if out.refused is None for kind in set(out.kinds))


def main(numbers: list[int]) -> None:
    if len(numbers) == 1:
        print(examine(numbers[0]))
    else:
        first, count = numbers
        results = []
        for number in range(first, first + count):
            results.append(examine(number))
            if results[-1].wrong:
                print(results[-1], flush=True)
        print(table(results))


if __name__ == "__main__":
    main([int(number) for number in sys.argv[1:]])
