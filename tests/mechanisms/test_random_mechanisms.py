"""Random mechanisms of all leg kinds against screws, loops and virtual power in numpy, and their twins.

What becomes of one is told by `support.random_examined`.
"""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod import SingularityKind, Status
from support.random_chains import KINDS, ON_RAIL, ON_ROD, TELESCOPIC, draw
from support.random_examined import MISFIT, SAMPLE, check, counts, examine, freedoms
from support.random_screws import (
    Mobility,
    chains,
    of_geometry,
)

FEW = 150
MANY = 10_000
"""From number 0 on, telescopic, and as many from `TELESCOPIC` on."""
BATCHES = 40


def test_a_few_mechanisms() -> None:
    pytest.importorskip("pinocchio")
    outcomes = [examine(number) for number in range(FEW)]
    check(outcomes)
    # Every kind of leg was there, in mechanisms that were compared; both styles, refusals, twins.
    assert set(counts(outcomes)) == {*KINDS, *ON_ROD}, counts(outcomes)
    assert sum(out.refused is None for out in outcomes) > FEW / 3
    assert sum(out.refused is not None for out in outcomes) > FEW / 10
    assert sum(out.returned for out in outcomes) > FEW / 2
    assert sum(out.forces is not None for out in outcomes) > FEW / 4
    assert sum(out.twin is not None for out in outcomes) > FEW / SAMPLE / 3


def test_a_few_with_sliders_redundant_legs_and_idle_freedoms() -> None:
    pytest.importorskip("pinocchio")
    outcomes = [examine(number) for number in range(TELESCOPIC, TELESCOPIC + FEW)]
    check(outcomes)
    compared = [out for out in outcomes if out.refused is None]
    assert set(counts(outcomes)) >= set(ON_RAIL), counts(outcomes)
    assert len(compared) > FEW / 3
    assert sum(out.refused == MISFIT for out in outcomes) > FEW / 50
    assert sum(out.redundant for out in compared if out.forces is not None) > FEW / 10
    assert sum(out.idle > 0 for out in compared if out.forces is not None) > FEW / 50
    assert sum(out.returned for out in compared) > FEW / 2
    assert sum(out.twin is not None for out in compared) > FEW / SAMPLE / 3


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


def test_idle_freedoms_are_found_beside_sliders() -> None:
    """Five legs that end on a line: it needs no sixth."""
    drawn = draw(10007)
    assert Mobility.of(drawn).idle == 1
    assert len(pp.Mechanism.from_dict(drawn.data).mobility().idle) == 1


def test_struts_may_reach_their_rails_near_home_alone() -> None:
    drawn = draw(13860)
    own = Mobility.of(drawn)
    assert (own.dof, own.uncontrolled) == (4, 0)
    assert pp.Mechanism.from_dict(drawn.data).dof == own.dof


@pytest.mark.parametrize("number", [14273, 15988])
def test_mobility_is_that_of_the_mode_of_home(number: int) -> None:
    """Others have fewer degrees of freedom (14273), or a leg without length (15988)."""
    drawn = draw(number)
    assert freedoms(drawn) == Mobility.of(drawn).dof


def test_legs_on_a_rod_may_end_in_one_point() -> None:
    """Their planes are one whatever the pose: that they keep their angle is no constraint."""
    drawn = draw(10227)
    own = Mobility.of(drawn)
    assert (own.dof, own.idle) == (6, 3)
    assert pp.Mechanism.from_dict(drawn.data).dof == own.dof


def test_a_mechanism_with_idle_freedoms_alone_is_refused() -> None:
    """Three RPS legs to one point: it rotates about the point, and no leg moves it."""
    legs = [
        {"base": {"joint": "R", "point": point, "axis": axis}, "platform": {"joint": "S", "point": [0, 0, 0]}}
        for point, axis in (([6, 0, 0], [0, 1, 0]), ([-3, 5, 0], [5, 3, 0]), ([-3, -5, 0], [1, 1, -0.8]))
    ]
    data = {"name": "ball", "units": {"length": "m"}, "home": {"position": [0, 0, 10]}, "legs": legs}
    with pytest.raises(pp.MechanismError, match="all 3 degrees of freedom of the platform are idle"):
        pp.Mechanism.from_dict(data)


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, TELESCOPIC])
@pytest.mark.parametrize("batch", range(BATCHES))
def test_many_mechanisms(batch: int, first: int) -> None:
    pytest.importorskip("pinocchio")
    count = MANY // BATCHES
    check([examine(number) for number in range(first + batch * count, first + (batch + 1) * count)])


@pytest.mark.parametrize(
    ("name", "dof", "passive"),
    [
        ("3-rps", 3, 0),
        ("tsai-6-sps", 6, 6),
        ("exechon", 3, 0),
        ("3-upu", 3, 0),
        ("2upr-rpu", 3, 0),
        ("hexaglide", 6, 0),
        ("3-prs", 3, 0),
        ("3-puu", 3, 0),
        ("4pss-upu", 5, 4),
    ],
)
def test_screws_give_the_freedoms_of_the_catalogue(name: str, dof: int, passive: int) -> None:
    """The numpy side by itself, on mechanisms whose degrees of freedom are known."""
    found = Mobility.of(of_geometry(pp.load(name).geometry))
    assert (found.dof, found.passive, found.idle) == (dof, passive, 0)


@pytest.mark.parametrize(
    ("name", "dof", "idle"),
    [("pentapod-5-ups", 6, 1), ("pentapod-5-spu", 6, 1), ("linuxcnc-pentakins", 6, 1), ("4-rpr", 3, 0)],
)
def test_screws_give_the_idle_freedoms_of_the_catalogue(name: str, dof: int, idle: int) -> None:
    found = Mobility.of(of_geometry(pp.load(name).geometry))
    assert (found.dof, found.idle, found.uncontrolled) == (dof, idle, idle)
