"""Coordinates that have no pose: what the status says on both sides, and calls that are wrong."""

import math
from typing import Any

import numpy as np
import pytest

import polypod as pp
from polypod import CoordinateError, ShapeError, Status, UnknownNameError
from support.coordinates import CENTRE, E1_S, E_S, GOUGH, LU, NATURAL, POSES, RPS, at_cosine, case_name, given


@pytest.mark.parametrize("sign", [+1, -1])
@pytest.mark.parametrize("branch", [+1, -1])
def test_both_sides_of_the_fold(sign: int, branch: int) -> None:
    """At |cos γ| = 1: outside no pose, on it a pose without rates, inside all."""
    ones = dict.fromkeys(at_cosine(0), 1.0)
    for outside in (1e-11, 1e-6, 1.0):
        state = LU.state(at_cosine(sign * (1 + outside)), ones, ones, branch=branch)
        assert state.status == Status.NO_BRANCH
        assert all(np.isnan(a).all() for a in (state.pose, state.twist, state.acceleration))
        assert np.isnan(state.coordinates["gamma"])
        assert state.coordinates["beta"] == 0.4
    for inside in (1e-11, 1e-6, 1.0):
        state = LU.state(at_cosine(sign * (1 - inside)), ones, ones, branch=branch)
        assert state.status == Status.OK
        assert all(np.isfinite(a).all() for a in (state.pose, state.twist, state.acceleration))
    state = LU.state(at_cosine(sign * 1.0), ones, ones, branch=branch)
    assert state.status == Status.FOLD
    assert np.isfinite(state.pose).all()
    assert np.isfinite(LU.inverse_kinematics(state.pose).lengths).all()
    assert abs(math.sin(state.coordinates["gamma"])) < 1e-7
    assert np.isnan(state.twist).all()
    assert np.isnan(state.acceleration).all()
    assert np.isnan(state.coordinate_rates["gamma"])
    assert state.coordinate_rates["beta"] == 1.0


def test_natural_coordinates_pass_the_fold() -> None:
    q = dict(zip(NATURAL, (0.1, 0.05, 0.7, 0.4, 0.0), strict=True))
    ones = dict.fromkeys(NATURAL, 1.0)
    state = LU.state(q, ones, ones)
    assert state.status == Status.OK
    assert np.isfinite(state.acceleration).all()
    assert LU.kinematics(state.pose, state.twist, state.acceleration).status in (
        Status.OK,
        Status.OUT_OF_STROKE,
    )


def test_a_tool_pose_that_cannot_be() -> None:
    """With the tool along L, l rotates in the plane across L, and o must be e sin θ_1 or more from L."""
    for distance, expected in ((0.5 * E_S, Status.NOT_CONVERGED), (0.999 * E_S, Status.NOT_CONVERGED),
                               (1.001 * E_S, Status.OK), (0.5, Status.OK)):  # fmt: skip
        q = dict(zip(LU.coordinate_sets["tool"], (0.3, E1_S, distance, 1, 0, 0), strict=True))
        state = LU.state(q)
        assert state.status == expected, distance
        assert np.isfinite(state.pose).all() == (expected == Status.OK)
        assert np.isfinite(state.twist).all() == (expected == Status.OK)


@pytest.mark.parametrize("mech", [LU, GOUGH], ids=case_name)
def test_a_tool_axis_without_direction_is_no_input(mech: pp.Mechanism) -> None:
    q = dict.fromkeys(mech.coordinate_sets["tool"], 0.0) | {"tip_z": 0.7}
    state = mech.state(q)
    assert np.isnan(state.pose[:3]).all()
    assert state.status == Status.INVALID_INPUT


def test_coordinates_that_leave_another_undetermined_are_a_fold() -> None:
    """The constraint does not see x, so that the other five never give it; not for want of a better guess."""
    state = LU.state(given(LU, POSES[1], "pose", "x"), guess=POSES[1])
    assert state.status == Status.FOLD
    assert np.isnan(state.twist).all()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_what_is_no_number_is_no_input(value: float, which: int) -> None:
    for q in (at_cosine(0.5), dict(zip(NATURAL, CENTRE, strict=True))):
        series = [q, dict.fromkeys(q, 1.0), dict.fromkeys(q, 1.0)]
        series[which] = series[which] | {"beta": value}
        state = LU.state(*series)
        assert state.status == Status.INVALID_INPUT
        assert all(np.isnan(a).all() for a in (state.pose, state.twist, state.acceleration))


def test_what_is_no_pose_is_no_input() -> None:
    good = POSES[1]
    bad = np.repeat(good[None], 5, axis=0)
    bad[0, 0, 3] = np.nan
    bad[1, 3, 3] = np.inf
    bad[2, :3, :3] *= 1.001
    bad[3, 3, 0] = 0.1
    bad[4, :3, 0] *= -1  # a mirror
    ik = LU.inverse_kinematics(bad)
    assert ik.status.tolist() == [Status.INVALID_INPUT] * 5
    assert np.isnan(ik.lengths).all()
    assert np.isnan(LU.coordinates(bad, "natural")["beta"]).all()


def test_what_breaks_a_constraint_is_refused() -> None:
    q = dict(zip(NATURAL, (0.1, 0.05, 0.7, 0.4, 0.5), strict=True))
    state = LU.state(q, dict.fromkeys(q, 0.5), dict.fromkeys(q, 0.5))
    constraint = LU.jacobian(state.pose)[5]
    off_pose = state.pose.copy()
    off_pose[:3, 3] += 1e-3 * constraint[:3] / np.linalg.norm(constraint[:3])
    motions = {
        "pose": (off_pose, state.twist, state.acceleration),
        "twist": (state.pose, state.twist + 1e-3 * constraint, state.acceleration),
        "acceleration": (state.pose, state.twist, state.acceleration + 1e-3 * constraint),
    }
    sound = (state.pose, state.twist, state.acceleration)
    for method in (LU.kinematics, LU.inverse_dynamics, LU.power):
        assert method(*sound).status in (Status.OK, Status.OUT_OF_STROKE)
        for what, motion in motions.items():
            *numbers, status = method(*motion)
            assert status == Status.OFF_CONSTRAINT, what
            assert all(np.isnan(a).all() for a in numbers), what
    for method in (LU.inverse_kinematics, LU.conditioning):
        *numbers, status = method(off_pose)
        assert status == Status.OFF_CONSTRAINT
        assert all(np.isnan(a).all() for a in numbers)
    assert np.isnan(LU.coordinates(off_pose)["x"])


def test_each_state_of_a_batch_has_its_own_status() -> None:
    cosines = np.array([0.5, 1.5, 1.0, 0.5, 0.5, -0.3])
    q = {name: np.full(6, value) for name, value in at_cosine(0.0).items()} | {"y": E1_S - cosines * E_S}
    q["x"][3] = np.nan
    rates = {name: np.full(6, 0.3) for name in q}
    rates["z"][4] = np.inf
    state = LU.state(q, rates)
    S = Status
    assert state.status.tolist() == [S.OK, S.NO_BRANCH, S.FOLD, S.INVALID_INPUT, S.INVALID_INPUT, S.OK]
    for i in range(6):
        alone = LU.state({n: v[i] for n, v in q.items()}, {n: v[i] for n, v in rates.items()})
        for batch, one in zip(state, alone, strict=True):
            pairs = (
                zip(batch.values(), one.values(), strict=True) if isinstance(batch, dict) else [(batch, one)]
            )
            assert all(np.array_equal(a[i], b, equal_nan=True) for a, b in pairs)
    lengths = LU.inverse_kinematics(state.pose)
    assert np.isfinite(lengths.lengths).all(axis=-1).tolist() == [True, False, True, False, False, True]
    assert lengths.status[[1, 3, 4]].tolist() == [S.INVALID_INPUT] * 3


# --- wrong calls --------------------------------------------------------------------------------------------


def test_names_that_are_no_set_are_answered_with_the_valid_ones() -> None:
    with pytest.raises(
        CoordinateError, match="no coordinate set with x, y; valid: paper: x, y, z, alpha, beta;"
    ):
        LU.state({"x": 0.0, "y": 0.0})
    with pytest.raises(
        CoordinateError,
        match=r"no coordinate set with no names; valid: .*pose: 5 independent ones of x, y, z",
    ):
        LU.state({})
    with pytest.raises(CoordinateError, match="gamma"):
        LU.state(at_cosine(0.5) | {"gamma": 1.0})
    with pytest.raises(
        CoordinateError, match=r"3-rps has no coordinate set with .*3 independent ones of x, y, z, rx, ry, rz"
    ):
        RPS.state({"z": 0.5, "rx": 0.0})
    with pytest.raises(CoordinateError, match="rates: 'betta' is no coordinate given; did you mean \"beta\""):
        LU.state(at_cosine(0.5), {"betta": 1.0})
    with pytest.raises(CoordinateError, match="second_rates: 'gamma'"):
        LU.state(at_cosine(0.5), {}, {"gamma": 1.0})
    with pytest.raises(UnknownNameError, match='no coordinate set "papers"; did you mean "paper"'):
        LU.coordinates(LU.home, "papers")


@pytest.mark.parametrize("branch", [0, 2, 0.5, "up", math.nan])
def test_a_branch_is_a_sign(branch: Any) -> None:
    with pytest.raises(CoordinateError, match=r"branch is .*; must be \+1 or -1"):
        LU.state(at_cosine(0.5), branch=branch)


def test_arrays_that_do_not_fit_are_named_with_their_shapes() -> None:
    q = at_cosine(0.5)
    with pytest.raises(ShapeError, match=r"\(2,\).*\(3,\).* do not broadcast"):
        LU.state(q | {"x": [0.0, 0.0], "y": [0.0, 0.0, 0.0]})
    with pytest.raises(ShapeError, match="do not broadcast"):
        LU.state(q | {"x": [0.0, 0.0]}, {"x": [0.0, 0.0, 0.0]})
    with pytest.raises(ShapeError, match=r"guess has the shape \(3, 3\); needs \(..., 4, 4\)"):
        LU.state(q, guess=np.eye(3))
    with pytest.raises(ShapeError, match="x is not an array of numbers"):
        LU.state(q | {"x": "far"})
    with pytest.raises(ShapeError, match=r"pose has the shape \(4,\); needs \(..., 4, 4\)"):
        LU.coordinates(np.zeros(4))
    with pytest.raises(ShapeError, match="do not broadcast"):
        LU.kinematics(POSES[:2], np.zeros((3, 6)), np.zeros(6))
