"""Forward kinematics and assembly modes against inverse kinematics and a search with equations of its own."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from polypod.errors import ShapeError, UnsupportedError
from support import ROOT, oracle
from support.assembly import (
    APART,
    FLAT,
    HEXAPOD,
    LENGTH,
    LU,
    MECHANISMS,
    Array,
    code,
    determinant,
    differs,
    lengths_at,
    sampled,
    singular_pose,
)

NATURAL = {"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6}
POSE = 1e-10  # 1 and m: the same for a pose that is not nearly singular
ANSWERS = [Status.OK, Status.OUT_OF_STROKE, Status.OUT_OF_CONE, Status.OUT_OF_ANGLE]


# --- from lengths to a pose and back ------------------------------------------------------------------------


@pytest.mark.parametrize("mech", MECHANISMS.values(), ids=MECHANISMS)
def test_round_trip(mech: pp.Mechanism):
    """From a guess nearby: the same pose, or another one in the guess's own mode."""
    rng = np.random.default_rng(11)
    pose, ahead = sampled(mech, rng, 500), sampled(mech, rng, 500)
    guess = mech.pose(
        {
            name: value + 0.03 * (other - value)
            for (name, value), other in zip(
                independent(mech, pose).items(), independent(mech, ahead).values(), strict=True
            )
        }
    )
    lengths = lengths_at(mech, pose)
    found = mech.forward_kinematics(lengths, guess)
    answered = np.isin(found.status, ANSWERS)
    same = differs(found.pose, pose) < POSE
    assert np.abs(lengths_at(mech, found.pose[answered]) - lengths[answered]).max() < LENGTH
    assert found.residual[answered].max() < LENGTH
    assert (same & answered).sum() > 470
    other = answered & (differs(found.pose, pose) > APART)
    assert (np.sign(determinant(mech, found.pose[other])) == np.sign(determinant(mech, guess[other]))).all()


def independent(mech: pp.Mechanism, pose: Array) -> dict[str, Array]:
    if "natural" in mech.coordinate_sets:
        return mech.coordinates(pose, "natural")
    names = mech.coordinate_sets["pose"] if mech.dof == 6 else ("z", "rx", "ry")
    return {name: mech.coordinates(pose, "pose")[name] for name in names}


@pytest.mark.parametrize("mech", MECHANISMS.values(), ids=MECHANISMS)
def test_far_lengths_are_those_of_many_small_steps(mech: pp.Mechanism):
    """In one call, the pose at the end of the straight path of squared lengths that begins at the guess."""
    rng = np.random.default_rng(16)
    guess, lengths = sampled(mech, rng, 60), lengths_at(mech, sampled(mech, rng, 60))
    share = np.linspace(0, 1, 1001)[:, None, None]
    path = np.sqrt((1 - share) * lengths_at(mech, guess) ** 2 + share * lengths**2)
    found = mech.forward_kinematics(lengths, guess)
    pose, status = guess, np.full(60, Status.OK)
    for step in path[1:]:
        small = mech.forward_kinematics(step, pose)
        follows = np.isin(status, ANSWERS) & np.isin(small.status, ANSWERS)
        status = np.where(follows, small.status, Status.MODE_JUMP)
        pose = np.where(follows[:, None, None], small.pose, pose)
    arrived = np.isin(status, ANSWERS)
    assert arrived.sum() > 10
    # Where the path all but touches a singularity, only one of the two may pass.
    answered = np.isin(found.status, ANSWERS)
    assert (answered == arrived).sum() >= 58
    both = answered & arrived
    assert differs(found.pose[both], pose[both]).max() < 1e-8


@pytest.mark.parametrize("mech", MECHANISMS.values(), ids=MECHANISMS)
def test_nearby_is_quick(mech: pp.Mechanism):
    """Newton's method is quadratic: half a millimetre off, four steps or so."""
    pose = sampled(mech, np.random.default_rng(12), 50, 0.5)
    found = mech.forward_kinematics(lengths_at(mech, pose) + 5e-4, pose)
    answered = np.isin(found.status, ANSWERS)
    assert answered.sum() > 40
    assert np.median(found.iterations[answered]) <= 4


@pytest.mark.parametrize("mech", MECHANISMS.values(), ids=MECHANISMS)
def test_the_guess_chooses_the_mode(mech: pp.Mechanism):
    lengths = lengths_at(mech, sampled(mech, np.random.default_rng(13), 1)[0])
    modes = mech.assembly_modes(lengths)
    assert modes.number >= 4
    found = mech.forward_kinematics(lengths, modes.pose)
    assert differs(found.pose, modes.pose).max() < POSE
    assert (found.status == modes.mode_status).all()


def test_lengths_of_passive_legs_are_not_read():
    """A tripod around a middle leg without actuator; with it the platform has three degrees of freedom."""
    text = (ROOT / "docs/mechanism-file.md").read_text(encoding="utf-8")
    tripod = pp.Mechanism.from_toml(text.split('```toml title="tripod.toml"')[1].split("```")[0])
    pose = tripod.pose({"x": 0.05, "y": 0.02, "z": 0.62})
    lengths = lengths_at(tripod, pose)
    lengths[3] = math.nan
    found = tripod.forward_kinematics(lengths)
    assert code(found.status) == Status.OK
    assert differs(found.pose, pose) < POSE
    modes = tripod.assembly_modes(lengths)
    assert code(modes.status) == Status.OK
    assert differs(modes.pose[: modes.number], pose).min() < POSE
    assert not tripod.actuated[3]


# --- along motions ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("every", [1, 10, 50])
def test_the_built_in_motion_is_followed(every: int):
    solution = pp.solve(LU, pp.load_motion("lu-3spu-2rpu-r", LU)).dataset
    pose, lengths = solution["pose"].to_numpy()[::every], solution["length"].to_numpy()[::every]
    found = LU.forward_kinematics(lengths, pose[0], continued=True)
    assert (found.status == Status.OK).all()
    assert differs(found.pose, pose).max() < POSE


@pytest.mark.parametrize("samples", [11, 41, 42, 43, 401])
@pytest.mark.parametrize("start", [0.25, -0.25])
def test_a_motion_through_a_singularity_is_told_where_it_passes(start: float, samples: int):
    """Its lengths turn back at the singularity: two modes have them, and the lengths alone choose none."""
    pose = LU.pose({**FLAT, "beta": np.linspace(start, -0.3 * start, samples)})
    sign = np.sign(determinant(LU, pose))
    passed = int(np.flatnonzero(sign != sign[0])[0])
    lengths = lengths_at(LU, pose)
    found = LU.forward_kinematics(lengths, pose[0], continued=True)
    assert np.flatnonzero(found.status == Status.MODE_JUMP).tolist() == [passed]
    assert differs(found.pose[: passed + 1], pose[: passed + 1]).max() < 1e-8
    # From then on the poses are those of the mode that the motion began in.
    own = np.delete(found.pose, passed, axis=0)
    assert (np.sign(determinant(LU, own)) == sign[0]).all()
    assert np.abs(lengths_at(LU, found.pose) - lengths).max() < LENGTH


def test_lengths_beyond_the_end_of_a_mode_are_told():
    """Across the fold no pose nearby has the lengths; here there is none at all."""
    pose = singular_pose(HEXAPOD, {"x": 0.05, "y": 0.03, "z": 0.6, "rx": 0.1, "ry": -0.15}, "rz", 1.0, 2.0)
    scaled = HEXAPOD.jacobian(pose) * np.array([1, 1, 1, *[1 / HEXAPOD.characteristic_length] * 3])
    across = np.linalg.svd(scaled)[0][:, 5]  # what the legs cannot do here, to either side
    counts = [HEXAPOD.assembly_modes(lengths_at(HEXAPOD, pose) + s * across).number for s in (-0.01, 0.01)]
    assert sorted(counts) == [0, 4]
    across *= np.sign(counts[1] - counts[0])
    lengths = lengths_at(HEXAPOD, pose) + np.linspace(0.01, -0.01, 40)[:, None] * across
    modes = HEXAPOD.assembly_modes(lengths[0])
    for begin in modes.pose[np.argsort(differs(modes.pose, pose))[:2]]:
        found = HEXAPOD.forward_kinematics(lengths, begin, continued=True)
        assert np.isin(found.status[:20], ANSWERS).all()
        assert (np.sign(determinant(HEXAPOD, found.pose[:20])) == np.sign(determinant(HEXAPOD, begin))).all()
        assert (found.status[20:] == Status.NOT_CONVERGED).all()
        assert np.isnan(found.pose[20:]).all()


def test_beyond_the_end_of_a_mode_another_one_is_told():
    """From a mode to lengths that it does not have: a pose that has them is marked as one of another mode."""
    rng = np.random.default_rng(15)
    lengths = lengths_at(LU, sampled(LU, rng, 300))
    modes = LU.assembly_modes(lengths[:-1])
    begin = modes.pose[np.arange(299), rng.integers(0, modes.number)]
    found = LU.forward_kinematics(lengths[1:], begin)
    same = np.isin(found.status, ANSWERS)
    jumped = found.status == Status.MODE_JUMP
    assert same.sum() > 30
    assert jumped.sum() > 3
    sign = np.sign(determinant(LU, begin))
    assert (np.sign(determinant(LU, found.pose[same])) == sign[same]).all()
    assert np.abs(lengths_at(LU, found.pose[jumped]) - lengths[1:][jumped]).max() < LENGTH


def test_a_state_without_pose_does_not_break_the_motion():
    pose = LU.pose({**NATURAL, "h": np.linspace(0.62, 0.66, 9)})
    lengths = lengths_at(LU, pose)
    lengths[3], lengths[6] = math.nan, 0.1
    found = LU.forward_kinematics(lengths, pose[0], continued=True)
    expected = np.full(9, Status.OK)
    expected[3], expected[6] = Status.INVALID_INPUT, Status.NOT_CONVERGED
    assert (found.status == expected).all()
    kept = expected == Status.OK
    assert differs(found.pose[kept], pose[kept]).max() < POSE
    assert np.isnan(found.pose[~kept]).all()


# --- wrong input and hopeless cases -------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["forward_kinematics", "assembly_modes"])
@pytest.mark.parametrize("lengths", [[0.7] * 4, [0.7] * 6, 0.7, [[0.7] * 4] * 5])
def test_a_wrong_number_of_lengths(method: str, lengths: Any):
    with pytest.raises(ShapeError, match=r"lengths has the shape .*needs \(\.\.\., 5\)"):
        getattr(LU, method)(lengths)


def test_shapes_that_do_not_broadcast():
    with pytest.raises(ShapeError, match="do not broadcast"):
        LU.forward_kinematics(np.full((3, 5), 0.7), np.broadcast_to(LU.home, (4, 4, 4)))
    with pytest.raises(ShapeError, match=r"guess has the shape \(3, 3\)"):
        LU.forward_kinematics(np.full(5, 0.7), np.eye(3))


@pytest.mark.parametrize("length", [-0.7, math.nan, math.inf])
@pytest.mark.parametrize("leg", [0, 4])
def test_lengths_that_are_none(leg: int, length: float):
    lengths = lengths_at(LU, LU.pose(NATURAL))
    lengths[leg] = length
    found, modes = LU.forward_kinematics(lengths, LU.pose(NATURAL)), LU.assembly_modes(lengths)
    assert code(found.status) == code(modes.status) == Status.INVALID_INPUT
    assert np.isnan(found.pose).all()
    assert np.isnan(found.residual)
    assert modes.number == 0


@pytest.mark.parametrize("lengths", [[0.1] * 5, [0.65, 0.85, 0.65, 0.85, 0.1], [0.0] * 5])
def test_lengths_out_of_reach(lengths: list[float]):
    found, modes = LU.forward_kinematics(lengths, LU.pose(NATURAL)), LU.assembly_modes(lengths)
    assert code(found.status) == Status.NOT_CONVERGED
    assert np.isnan(found.pose).all()
    assert (code(modes.status), int(modes.number)) == (Status.OK, 0)


def test_a_guess_far_away_never_gives_a_wrong_pose():
    rng = np.random.default_rng(14)
    pose = sampled(LU, rng, 200)
    lengths = lengths_at(LU, pose)
    guess = np.zeros((200, 4, 4))
    guess[:, :3, :3] = oracle.turn(rng.normal(size=(200, 3)) * 2)
    guess[:, :3, 3] = rng.normal(size=(200, 3)) * 10.0 ** rng.uniform(-1, 2, (200, 1))
    guess[:, 3, 3] = 1.0
    found = LU.forward_kinematics(lengths, guess)
    stands = np.isin(found.status, [*ANSWERS, Status.MODE_JUMP])
    assert 20 < stands.sum() < 200
    assert np.abs(lengths_at(LU, found.pose[stands]) - lengths[stands]).max() < LENGTH
    assert np.isnan(found.pose[found.status == Status.NOT_CONVERGED]).all()


def test_a_singular_guess():
    pose = singular_pose()
    lengths = lengths_at(LU, pose)
    at_itself = LU.forward_kinematics(lengths, pose)
    assert code(at_itself.status) == Status.SINGULAR
    assert differs(at_itself.pose, pose) < 1e-7
    from_nearby = LU.forward_kinematics(lengths, LU.pose({**FLAT, "beta": 0.12}))
    assert code(from_nearby.status) == Status.SINGULAR
    assert differs(from_nearby.pose, pose) < 1e-6
    for change in 1e-3 * np.vstack([np.eye(5), -np.eye(5)]):
        found = LU.forward_kinematics(lengths + change, pose)
        if code(found.status) == Status.NOT_CONVERGED:
            assert np.isnan(found.pose).all()
        else:
            assert np.abs(lengths_at(LU, found.pose) - lengths - change).max() < LENGTH


@pytest.mark.parametrize("entry", [(0, 0), (2, 1), (3, 0), (3, 3)])
def test_a_guess_that_is_no_pose(entry: tuple[int, int]):
    guess = LU.pose(NATURAL)
    guess[entry] += 1e-3
    found = LU.forward_kinematics(lengths_at(LU, LU.pose(NATURAL)), guess)
    assert code(found.status) == Status.INVALID_INPUT
    assert np.isnan(found.pose).all()


def test_a_guess_may_break_the_constraints():
    guess = LU.pose(NATURAL)
    guess[:3, 3] += [0.01, -0.01, 0.01]
    found = LU.forward_kinematics(lengths_at(LU, LU.pose(NATURAL)), guess)
    assert code(found.status) == Status.OK
    assert differs(found.pose, LU.pose(NATURAL)) < POSE


def test_shapes_and_broadcasting():
    pose = LU.pose({**NATURAL, "h": np.linspace(0.62, 0.66, 6).reshape(2, 3)})
    lengths = lengths_at(LU, pose)
    one = LU.forward_kinematics(lengths, LU.pose(NATURAL))
    assert one.pose.shape == (2, 3, 4, 4)
    assert one.residual.shape == one.iterations.shape == one.status.shape == (2, 3)
    each = LU.forward_kinematics(lengths[:, :, None], np.stack([LU.pose(NATURAL)] * 4))
    assert each.pose.shape == (2, 3, 4, 4, 4)
    assert differs(each.pose, pose[:, :, None]).max() < POSE
    single = LU.forward_kinematics(lengths[1, 2], LU.pose(NATURAL))
    assert (single.pose == one.pose[1, 2]).all()
    assert LU.forward_kinematics(np.empty((0, 5))).pose.shape == (0, 4, 4)
    assert LU.assembly_modes(np.empty((0, 5))).pose.shape == (0, 0, 4, 4)


def similar_hexapod() -> pp.Mechanism:
    """Base and platform similar and parallel: every pose is singular."""
    data = HEXAPOD.to_dict()
    for leg in data["legs"]:
        leg["platform"]["point"]["angle"] = leg["base"]["point"]["angle"]
    return pp.Mechanism.from_dict(data)


def test_a_design_that_is_singular_everywhere_has_no_modes():
    mech = similar_hexapod()
    assert mech.mobility().uncontrolled == 1
    with pytest.raises(UnsupportedError, match=r"stewart-gough: assembly modes need .* not singular"):
        mech.assembly_modes([0.7] * 6)
    found = mech.forward_kinematics(lengths_at(mech, mech.home))
    assert code(found.status) == Status.SINGULAR


def test_units_do_not_change_the_modes():
    data = copy.deepcopy(LU.to_dict())
    data["units"]["length"] = "m"
    for place in lengths_in(data):
        table, key = place
        value = table[key]
        table[key] = [v / 1e3 for v in value] if isinstance(value, list) else value / 1e3
    other = pp.Mechanism.from_dict(data)
    lengths = lengths_at(LU, LU.pose(NATURAL))
    a, b = LU.assembly_modes(lengths), other.assembly_modes(lengths)
    assert a.number == b.number
    assert differs(a.pose, b.pose).max() < 1e-9


def lengths_in(data: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Every place of the published file that holds a length."""
    yield data["home"], "position"
    yield data["tool"], "point"
    yield data["platform"], "center"
    for rod in data["rods"]:
        yield rod, "point"
        yield rod, "center"
    for leg in data["legs"]:
        yield leg["stroke"], "min"
        yield leg["stroke"], "max"
        yield leg["base"]["point"], "radius"
        yield leg["platform"]["point"], "radius"
        yield leg["cylinder"], "center"
        yield leg["piston"], "center"
