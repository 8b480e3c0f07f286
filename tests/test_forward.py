"""Forward kinematics and assembly modes against inverse kinematics and a search with equations of its own."""

from __future__ import annotations

import copy
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import polypod as pp
from polypod import Status
from polypod.errors import ShapeError, UnsupportedError

sys.path.insert(0, str(Path(__file__).parent))
import oracle

Array = NDArray[np.float64]

DATA = Path(__file__).parent / "data"
LU = pp.load("lu-3spu-2rpu-r")
HEXAPOD = pp.load(DATA / "stewart-gough.toml")
RPS = pp.load(DATA / "3-rps.toml")
MECHANISMS = {mech.name: mech for mech in (LU, HEXAPOD, RPS)}
NATURAL = {"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6}
FLAT = {"alpha": 0.1, "p": 0.3, "h": 0.7, "gamma": -0.06}  # det J changes its sign near beta = 0.075 rad

LENGTH = 1e-12  # m, of legs about 1 m long: rounding of lengths at a pose that Newton's method ended in
POSE = 1e-10  # 1 and m: the same for a pose that is not nearly singular
APART = 1e-6  # 1 and m: two modes of generic lengths are farther from each other
ANSWERS = [Status.OK, Status.OUT_OF_STROKE, Status.OUT_OF_CONE, Status.OUT_OF_ANGLE]


def code(status: Any) -> Status:
    return Status(int(status))


def lengths_at(mech: pp.Mechanism, pose: Array) -> Array:
    return mech.inverse_kinematics(pose).lengths


def sampled(mech: pp.Mechanism, rng: np.random.Generator, count: int, spread: float = 1.0) -> Array:
    """Poses (count, 4, 4) over the workspace that keep all constraints, `spread` the share of it."""
    q: dict[str, Array]
    if "natural" in mech.coordinate_sets:
        middle, width = [0.0, 0.0, 0.65, 0.0, 0.0], [0.5, 0.35, 0.12, 0.9, 0.9]
        values = np.array(middle) + spread * np.array(width) * rng.uniform(-1, 1, (count, 5))
        q = dict(zip(mech.coordinate_sets["natural"], values.T, strict=True))
    else:
        names = mech.coordinate_sets["pose"] if mech.dof == 6 else ("z", "rx", "ry")
        width = {"x": 0.15, "y": 0.15, "z": 0.08, "rx": 0.4, "ry": 0.4, "rz": 0.4}
        home = mech.coordinates(mech.home, "pose")
        q = {n: home[n] + spread * width[n] * rng.uniform(-1, 1, count) for n in names}
    return mech.pose(q)


def differs(a: Array, b: Array) -> Array:
    """(...): the largest difference of entries, 1 and m."""
    return np.abs(a - b).max(axis=(-1, -2))


def determinant(mech: pp.Mechanism, pose: Array) -> Array:
    return np.linalg.det(mech.jacobian(pose))


# --- a search of its own ------------------------------------------------------------------------------------


def equations(mech: pp.Mechanism, lengths: Array, pose: tuple[Array, Array]) -> tuple[Array, Array]:
    """Residuals of lengths and joints at poses (N, 3, 3) and (N, 3), real or complex; and rows by (v, ω).

    r·r = ℓ² for actuated legs; for a leg on a rod: r, the rod's line and the platform's axis in one plane;
    for an R joint: r at right angles to its axis.
    """
    R, o = pose
    values, rows = [], []

    def turned(a: Array) -> Array:
        """Of a vector of the platform, its rate by (v, ω): (N, 3, 6)."""
        x, y, z = np.moveaxis(a, -1, 0)
        n = np.zeros_like(x)
        cross = np.array([[n, z, -y], [-z, n, x], [y, -x, n]])
        return np.concatenate([np.zeros_like(R), np.moveaxis(cross, -1, 0)], axis=-1)

    geometry = mech.geometry
    for leg, length in zip(geometry["legs"], lengths, strict=True):
        base, platform = leg["base"], leg["platform"]
        e = R @ np.array(platform["point"])
        r = o + e - np.array(base["point"])
        rate = turned(e) + np.eye(3, 6)
        if leg["actuated"]:
            values.append(np.sum(r * r, axis=-1) - length**2)
            rows.append(2 * np.einsum("ni,nij->nj", r, rate))
        if base["rod"] is not None:
            line, a = np.array(geometry["rods"][base["rod"]]["axis"]), R @ np.array(platform["axis"])
            values.append(np.cross(a, r) @ line)
            by_axis = np.einsum("ni,nij->nj", np.cross(r, line), turned(a))
            rows.append(by_axis + np.einsum("ni,nij->nj", np.cross(line, a), rate))
        elif base["joint"] == "R":
            values.append(r @ np.array(base["axis"]))
            rows.append(np.einsum("i,nij->nj", np.array(base["axis"]), rate))
    return np.stack(values, axis=-1), np.stack(rows, axis=-2)


def cayley(w: Array) -> Array:
    """A rotation (N, 3, 3) for real w, a complex orthogonal matrix for complex w."""
    x, y, z = np.moveaxis(w, -1, 0) / 2
    n = np.zeros_like(x)
    half = np.moveaxis(np.array([[n, -z, y], [z, n, -x], [-y, x, n]]), -1, 0)
    return np.linalg.solve(np.eye(3) - half, np.eye(3) + half)


def search(
    mech: pp.Mechanism, lengths: Array, starts: int, rng: np.random.Generator, over: type = float
) -> Array:
    """Different poses (k, 4, 4) that least-squares Newton steps find from random ones all over the space."""

    def random(size: float) -> Array:
        values = rng.normal(size=(starts, 3)) * size
        return values + 1j * rng.normal(size=(starts, 3)) * size if over is complex else values

    scale = np.array([1, 1, 1, *[mech.characteristic_length] * 3])
    R, o = cayley(random(2.0)), random(0.6 * np.abs(lengths).max())
    if over is complex:  # complex solutions may be far away
        o = o * 10.0 ** rng.uniform(0, 3, (starts, 1))
    for _ in range(80):
        value, rows = equations(mech, lengths, (R, o))
        step = -np.einsum("nij,nj->ni", np.linalg.pinv(rows / scale, rcond=1e-10), value)
        longest = 0.4 + 0.4 * np.linalg.norm(o, axis=-1, keepdims=True) / mech.characteristic_length
        step *= np.minimum(1, longest / np.maximum(np.linalg.norm(step, axis=-1, keepdims=True), 1e-300))
        step /= scale
        R, o = cayley(step[:, 3:]) @ R, o + step[:, :3]
    value, rows = equations(mech, lengths, (R, o))
    size = 1 + np.maximum(np.abs(R).max(axis=(-1, -2)), np.abs(o).max(axis=-1))
    met = np.abs(value).max(axis=-1) < 1e-11 * size**2
    pose = np.concatenate([R, o[:, :, None]], axis=-1)[met]
    found: list[Array] = []
    for candidate in pose:
        if not found or differs(np.array(found), candidate).min() > APART:
            found.append(candidate)
    return np.array(found).reshape(-1, 3, 4)


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
    text = (Path(__file__).parents[1] / "docs/mechanism-file.md").read_text(encoding="utf-8")
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


def singular_pose(
    mech: pp.Mechanism = LU,
    others: dict[str, float] = FLAT,
    name: str = "beta",
    low: float = 0,
    high: float = 0.25,
) -> Array:
    """Where det J vanishes up to rounding on a line of coordinates, by bisection."""
    below = np.sign(determinant(mech, mech.pose({**others, name: low})))
    for _ in range(60):
        middle = (low + high) / 2
        same = np.sign(determinant(mech, mech.pose({**others, name: middle}))) == below
        low, high = (middle, high) if same else (low, middle)
    return mech.pose({**others, name: low})


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
