"""Assembly modes against a search with equations of its own, and known numbers of them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from support import oracle
from support.assembly import (
    APART,
    HEXAPOD,
    LENGTH,
    LU,
    MECHANISMS,
    RPS,
    Array,
    code,
    determinant,
    differs,
    lengths_at,
    sampled,
    singular_pose,
)
from support.pose_search import search


def check_modes(mech: pp.Mechanism, pose: Array, rng: np.random.Generator, starts: int) -> int:
    """That the modes of a pose's lengths are those of a search; how many there are."""
    lengths = lengths_at(mech, pose)
    modes = mech.assembly_modes(lengths)
    known = modes.pose[: modes.number]
    assert code(modes.status) == Status.OK
    assert differs(known, pose).min() < APART
    assert np.abs(lengths_at(mech, known) - lengths).max() < LENGTH
    assert (modes.multiplicity[: modes.number] == 1).all()
    assert (modes.determinant_sign == np.sign(determinant(mech, known))).all()
    for found in search(mech, lengths, starts, rng):
        assert differs(known[:, :3], found).min() < APART, (mech.name, lengths.tolist())
    return int(modes.number)


@pytest.mark.parametrize("mech", [LU, HEXAPOD], ids=lambda m: m.name)
def test_all_modes_are_those_of_a_search(mech: pp.Mechanism):
    rng = np.random.default_rng(5)
    counts = [check_modes(mech, pose, rng, 300) for pose in sampled(mech, rng, 12)]
    assert min(counts) >= 2
    assert all(count % 2 == 0 for count in counts)


def test_all_modes_of_a_3_rps_are_those_of_a_search():
    rng = np.random.default_rng(6)
    counts = {check_modes(RPS, pose, rng, 200) for pose in sampled(RPS, rng, 4)}
    assert max(counts) == 16


@pytest.mark.slow
@pytest.mark.parametrize("mech", MECHANISMS.values(), ids=MECHANISMS)
def test_all_modes_of_many_lengths_are_those_of_a_search(mech: pp.Mechanism):
    rng = np.random.default_rng(7)
    for pose in sampled(mech, rng, 100):
        check_modes(mech, pose, rng, 400)


def test_the_search_meets_the_equations_of_the_oracle():
    """So that both do not share a mistake in the equations."""
    rng = np.random.default_rng(8)
    for mech in MECHANISMS.values():
        spec = oracle.read(mech.to_dict())
        lengths = lengths_at(mech, sampled(mech, rng, 1)[0])
        found = search(mech, lengths, 50, rng)
        pose = (found[:, :, :3], found[:, :, 3])
        assert len(found) > 3
        assert np.abs(oracle.lengths(spec, pose).x - lengths).max() < 1e-10
        assert np.abs(oracle.residuals(spec, pose).x).max() < 1e-9


# --- how many -----------------------------------------------------------------------------------------------


def general_hexapod(seed: int) -> pp.Mechanism:
    """A 6-UPS whose joints lie in no plane."""
    rng = np.random.default_rng(seed)
    data = HEXAPOD.to_dict()
    for leg in data["legs"]:
        leg["base"] |= {"point": rng.uniform(-500, 500, 3).tolist(), "axis": [1.0, 0.2, 0.1]}
        leg["platform"]["point"] = rng.uniform(-300, 300, 3).tolist()
        del leg["stroke"]
    return pp.Mechanism.from_dict(data)


def planar_hexapod(seed: int) -> pp.Mechanism:
    """A 6-UPS with all base joints in one plane and all platform joints in another."""
    data = general_hexapod(seed).to_dict()
    for leg in data["legs"]:
        leg["base"]["point"][2] = leg["platform"]["point"][2] = 0.0
    return pp.Mechanism.from_dict(data)


@pytest.mark.parametrize("seed", [2, 4])
@pytest.mark.parametrize("make", [general_hexapod, planar_hexapod])
def test_a_general_hexapod_has_forty_complex_modes(make: Callable[[int], pp.Mechanism], seed: int):
    """Ronga and Vust, Mourrain; Raghavan by continuation. Some of these have coordinates in the thousands."""
    assert make(seed)._core.complex_modes() == 40


@pytest.mark.slow
def test_of_many_general_hexapods_hardly_one_lacks_a_complex_mode():
    """Of solutions farther away than double precision can follow there may be some; none are found twice."""
    counts = [
        make(seed)._core.complex_modes() for make in (general_hexapod, planar_hexapod) for seed in range(40)
    ]
    assert max(counts) == 40
    assert counts.count(40) >= 78


def test_complex_modes_of_the_files():
    """16 for a 3-RPS, as for the 6-3 platform (Nanua, Waldron, Murthy, 1990) that it is with locked legs."""
    counts = {name: mech._core.complex_modes() for name, mech in MECHANISMS.items()}
    assert counts == {"lu-3spu-2rpu-r": 52, "stewart-gough": 28, "3-rps": 16}


@pytest.mark.slow
@pytest.mark.parametrize("name", MECHANISMS)
def test_complex_modes_are_those_of_a_search(name: str):
    mech, rng = MECHANISMS[name], np.random.default_rng(9)
    lengths = lengths_at(mech, sampled(mech, rng, 1)[0])
    lengths = lengths + 0.1 * rng.uniform(-1, 1, lengths.shape) * (1 + 1j)
    assert len(search(mech, lengths, 6000, rng, complex)) == mech._core.complex_modes()


def test_modes_come_in_mirror_pairs_where_the_joints_lie_in_planes():
    rng = np.random.default_rng(10)
    flip = np.diag([1.0, 1.0, -1.0])
    for mech in (LU, HEXAPOD, RPS):
        modes = mech.assembly_modes(lengths_at(mech, sampled(mech, rng, 5)))
        for poses, count, above in zip(modes.pose, modes.number, modes.above, strict=True):
            assert count % 2 == 0
            assert above[: count // 2].all()
            assert not above[count // 2 : count].any()
            for pose in poses[:count]:
                image = np.eye(4)
                image[:3, :3], image[:3, 3] = flip @ pose[:3, :3] @ flip, flip @ pose[:3, 3]
                assert differs(poses[:count], image).min() < APART


def test_without_planes_there_are_no_pairs():
    mech = general_hexapod(2)
    modes = mech.assembly_modes(lengths_at(mech, mech.home))
    poses = modes.pose[: modes.number]
    image = mech.home
    image[2, 3] *= -1
    assert code(modes.status) == Status.OK
    assert differs(poses, mech.home).min() < APART
    assert differs(poses, image).min() > 0.01


def test_modes_are_ordered_from_above_and_padded():
    rows = np.array([[0.769, 0.85, 0.769, 0.65, 0.65], [0.1] * 5, [math.nan] * 5])
    modes = LU.assembly_modes(rows)
    assert modes.number.tolist() == [8, 0, 0]
    assert [code(s) for s in modes.status] == [Status.OK, Status.OK, Status.INVALID_INPUT]
    # Some are as high as others, up to rounding.
    assert (np.diff(modes.pose[0, :, 2, 3]) <= 1e-9).all()
    assert np.isnan(modes.pose[1:]).all()
    assert (modes.mode_status[1:] == Status.INVALID_INPUT).all()
    shaped = LU.assembly_modes(rows[None, :, None])
    assert shaped.number.shape == shaped.status.shape == (1, 3, 1)
    assert shaped.pose.shape == (1, 3, 1, 8, 4, 4)
    assert shaped.multiplicity.shape == shaped.mode_status.shape == (1, 3, 1, 8)


def test_modes_that_meet_are_one_of_multiplicity_two():
    pose = singular_pose()
    modes = LU.assembly_modes(lengths_at(LU, pose))
    assert code(modes.status) == Status.SINGULAR
    meeting = int(differs(modes.pose[: modes.number], pose).argmin())
    assert differs(modes.pose[meeting], pose) < 1e-5
    assert modes.multiplicity[meeting] == 2
    assert modes.determinant_sign[meeting] == 0
    assert code(modes.mode_status[meeting]) == Status.SINGULAR


def test_modes_know_their_limits():
    """Lengths at the very ends of strokes are within them; a joint beyond its cone is told."""
    ends = np.array([[0.75, 0.85, 0.75, 0.65, 0.65], [0.65, 0.72, 0.85, 0.85, 0.72], [0.65] * 5, [0.85] * 5])
    modes = LU.assembly_modes(ends)
    assert modes.number.min() > 0
    assert set(modes.mode_status[np.isfinite(modes.residual)]) == {Status.OK}
    beyond = LU.assembly_modes(ends + np.array([0, 1e-9, 0, 0, 0]))
    assert set(beyond.mode_status[0, : beyond.number[0]]) == {Status.OUT_OF_STROKE}
    found = LU.forward_kinematics(ends[2], modes.pose[2, 0])
    assert code(found.status) == Status.OK
    assert (
        code(LU.forward_kinematics(ends[2] - [1e-9, 0, 0, 0, 0], found.pose).status) == Status.OUT_OF_STROKE
    )
    head = RPS.assembly_modes(lengths_at(RPS, RPS.home))
    assert [code(s) for s in head.mode_status[:2]] == [Status.OK, Status.OUT_OF_CONE]
