"""Coordinate sets: to the pose and back, exact twist and acceleration, and a status where there is no answer.

Poses are sampled by one recipe: the centre · uniform · normal about it · near it, down to 1e-12 · near the
fold γ = 0 and the family β = 0 of nearly singular poses, and on them. Seeds are fixed.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from support.coordinates import (
    CENTRE,
    E1_S,
    E_S,
    GOUGH,
    LU,
    NATURAL,
    POSES,
    RPS,
    SEED,
    Array,
    Q,
    Series,
    at_cosine,
    case_name,
    given,
)

ROUNDING = (
    1e-13  # m or 1, of poses and coordinates by two roads: some hundred operations with numbers about 1
)
SOLVED = 1e-13  # m, by which solved coordinates may miss a constraint
STENCIL = 2e-8  # relative, of differences freed of their h² part, h⁴ and 1e-16 / h²
QUARTER = (
    0.01  # relative, by which the error of central differences may miss a quarter when the step is halved
)


def away(values: Series, name: str, least: float) -> Series:
    """The samples in which a coordinate is well away from zero."""
    keep = np.abs(values[name]) > least
    return {key: column[keep] for key, column in values.items()}


def poses_of(mech: pp.Mechanism, size: int) -> Array:
    """Poses (N, 4, 4) about home that satisfy the constraints."""
    rng = np.random.default_rng(SEED)
    names = mech.coordinate_sets["pose"][6 - mech.dof :] if mech.dof == 6 else ("z", "rx", "ry")
    home = mech.coordinates(mech.home, "pose")
    spread = {"x": 0.05, "y": 0.05, "z": 0.05, "rx": 0.3, "ry": 0.3, "rz": 0.3}
    scale = np.concatenate([rng.uniform(-1, 1, size), [0, 1e-3, 1e-6, 1e-9, 1e-12]])
    return mech.pose({n: home[n] + spread[n] * scale * rng.uniform(-1, 1, len(scale)) for n in names})


# --- the sets -----------------------------------------------------------------------------------------------


def test_which_sets_there_are() -> None:
    pose = ("x", "y", "z", "rx", "ry", "rz")
    tool = ("tip_x", "tip_y", "tip_z", "axis_x", "axis_y", "axis_z")
    assert LU.coordinate_sets == {
        "paper": ("x", "y", "z", "alpha", "beta"),
        "natural": ("alpha", "p", "h", "beta", "gamma"),
        "tool": tool,
        "pose": pose,
    }
    assert GOUGH.coordinate_sets == {"tool": (*tool, "turn"), "pose": pose}
    assert RPS.coordinate_sets == {"pose": pose}


def test_pose_of_natural_coordinates() -> None:
    """T20 by hand: R = Rx(α)Ry(β)Rx(γ); the middle of b1b3 is at (p, E_1 sin θ_1, 0) + h Rx(α) e_z."""
    a, p, h, b, g = (Q[name] for name in NATURAL)
    R = turn(0, a) @ turn(1, b) @ turn(0, g)
    middle = np.stack([p, E1_S - h * np.sin(a), h * np.cos(a)], axis=-1)
    o = middle - R[..., :, 1] * E_S
    assert POSES[..., :3, :3] == pytest.approx(R, abs=ROUNDING)
    assert POSES[..., :3, 3] == pytest.approx(o, abs=ROUNDING)
    assert np.array_equal(POSES[..., 3, :], np.broadcast_to([0.0, 0, 0, 1], (*POSES.shape[:-2], 4)))


def turn(axis: int, angle: Array | float) -> Array:
    """(..., 3, 3): the rotation about a coordinate axis."""
    c, s, i, j = np.cos(angle), np.sin(angle), (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((*np.shape(angle), 3, 3))
    R[..., axis, axis], R[..., i, i], R[..., j, j], R[..., i, j], R[..., j, i] = 1, c, c, -s, s
    return R


def test_gamma_is_that_of_eq_5_as_printed() -> None:
    for branch in (+1, -1):
        q = given(LU, POSES[Q["gamma"] * branch > 1e-3], "paper")
        cosine = (E1_S * np.cos(q["alpha"]) - q["z"] * np.sin(q["alpha"]) - q["y"] * np.cos(q["alpha"])) / E_S
        state = LU.state(q, branch=branch)
        assert np.all(state.status == Status.OK)
        gamma = state.coordinates["gamma"]
        assert np.all(np.sign(gamma) == branch)
        assert np.cos(gamma) == pytest.approx(cosine, abs=ROUNDING)
        R = turn(0, q["alpha"]) @ turn(1, q["beta"]) @ turn(0, branch * np.arccos(cosine))
        wide = 1 / np.abs(np.sin(gamma)).min()  # the derivative of the arc cosine
        assert state.pose[:, :3, :3] == pytest.approx(R, abs=ROUNDING * wide)


# --- round trips --------------------------------------------------------------------------------------------


def test_natural_coordinates_come_back() -> None:
    back = LU.coordinates(POSES, "natural")
    for name in NATURAL:
        assert back[name] == pytest.approx(Q[name], abs=ROUNDING), name


@pytest.mark.parametrize("branch", [+1, -1])
def test_paper_coordinates_come_back_on_their_branch(branch: int) -> None:
    """Near the fold the arc cosine doubles the lost digits: the error grows as 1/γ."""
    keep = Q["gamma"] * branch > 0.9e-5
    q = given(LU, POSES[keep], "paper")
    state = LU.state(q, branch=branch)
    assert np.all(state.status == Status.OK)
    error = np.abs(state.pose - POSES[keep]).max(axis=(-2, -1))
    assert np.all(error <= ROUNDING / np.abs(np.sin(Q["gamma"][keep])))
    other = LU.state(q, branch=-branch)
    assert other.coordinates["gamma"] == pytest.approx(-state.coordinates["gamma"], rel=1e-15)
    assert np.all(LU.inverse_kinematics(other.pose).status != Status.OFF_CONSTRAINT)


def test_the_default_set_is_the_first() -> None:
    assert LU.coordinates(POSES[1]) == LU.coordinates(POSES[1], "paper")
    assert list(LU.coordinates(POSES[1])) == ["x", "y", "z", "alpha", "beta", "gamma"]


CASES = [
    (LU, "tool", ()),
    *[(LU, "pose", (name,)) for name in ("y", "z", "rx", "ry", "rz")],
    (RPS, "pose", ("x", "y", "rz")),
    (RPS, "pose", ("x", "y", "rx")),
    (GOUGH, "pose", ()),
    (GOUGH, "tool", ()),
]


def samples_of(mech: pp.Mechanism, dependent: tuple[str, ...]) -> Array:
    """Poses at which the dependent coordinates are determined."""
    if mech is not LU:
        poses = poses_of(mech, 40)
        return poses[np.abs(poses[:, 0, 2]) > 0.1] if "rx" in dependent else poses
    if not dependent:
        return POSES
    return LU.pose(away(away(away(Q, "beta", 0.3), "alpha", 0.2), "gamma", 0.3))


@pytest.mark.parametrize(("mech", "set", "dependent"), CASES, ids=case_name)
def test_dependent_coordinates_are_found_near_a_guess(
    mech: pp.Mechanism, set: str, dependent: tuple[str, ...]
) -> None:
    poses = samples_of(mech, dependent)
    assert len(poses) > 5
    all_of_them = mech.coordinates(poses, set)
    guess = poses.copy()
    guess[:, :3, 3] += 0.002
    guess[:, :3, :3] = turn(0, 0.01) @ turn(2, -0.01) @ poses[:, :3, :3]
    state = mech.state(given(mech, poses, set, *dependent), guess=guess)
    assert np.all(state.status == Status.OK)
    assert state.pose == pytest.approx(poses, abs=10 * ROUNDING)
    for name, values in all_of_them.items():
        assert state.coordinates[name] == pytest.approx(values, abs=10 * ROUNDING), name


def test_tool_has_its_tip_and_axis_where_it_is_told() -> None:
    tables = LU.to_dict() | {"tool": {"point": [10.0, -20.0, 60.0], "axis": [0.2, 0.1, 1.0]}}
    mech = pp.Mechanism.from_dict(tables)
    axis = np.array([0.2, 0.1, 1.0]) / math.sqrt(1.05)
    q = given(mech, POSES[:20], "tool")
    long = {name: 3 * values if name.startswith("axis") else values for name, values in q.items()}
    for coordinates in (q, long):  # a direction may have any length
        state = mech.state(coordinates, guess=POSES[:20])
        assert np.all(state.status == Status.OK)
        R, o = state.pose[:, :3, :3], state.pose[:, :3, 3]
        tip = np.stack([q["tip_x"], q["tip_y"], q["tip_z"]], axis=-1)
        direction = np.stack([q["axis_x"], q["axis_y"], q["axis_z"]], axis=-1)
        assert o + R @ [0.01, -0.02, 0.06] == pytest.approx(tip, abs=ROUNDING)
        assert R @ axis == pytest.approx(direction, abs=ROUNDING)


def test_dependent_coordinates_of_3_rps_satisfy_its_constraints() -> None:
    rng = np.random.default_rng(SEED)
    q = {"z": rng.uniform(0.45, 0.6, 50), "rx": rng.uniform(-0.5, 0.5, 50), "ry": rng.uniform(-0.5, 0.5, 50)}
    state = RPS.state(q)
    assert np.all(state.status == Status.OK)
    for name, values in q.items():
        assert np.array_equal(state.coordinates[name], values)
    for leg in RPS.geometry["legs"]:
        r = state.pose[:, :3, :3] @ leg["platform"]["point"] + state.pose[:, :3, 3] - leg["base"]["point"]
        assert np.abs(r @ leg["base"]["axis"]).max() < SOLVED
    x, y = state.coordinates["x"], state.coordinates["y"]
    assert np.hypot(x, y).max() > 1e-3  # the platform's parasitic motion


# --- twist and acceleration ---------------------------------------------------------------------------------


def differences(pose: Callable[[float], Array], h: float) -> tuple[Array, Array]:
    """Twist and acceleration (..., 6) of poses along t at t = 0, by central differences of step h."""
    before, now, after = pose(-h), pose(0), pose(h)
    first, second = (after - before) / (2 * h), (after - 2 * now + before) / h**2
    spun = [d[..., :3, :3] @ np.swapaxes(now[..., :3, :3], -1, -2) for d in (first, second)]
    turning = [
        0.5 * np.stack([W[..., k - 1, k - 2] - W[..., k - 2, k - 1] for k in range(3)], -1) for W in spun
    ]
    linear = [d[..., :3, 3] for d in (first, second)]
    return np.concatenate([linear[0], turning[0]], -1), np.concatenate([linear[1], turning[1]], -1)


def steps(dependent: tuple[str, ...]) -> tuple[float, float]:
    """Coarse and fine; γ swings over e sin θ_1 = 46 mm and asks for short ones."""
    return (2e-4, 1e-4) if "gamma" in dependent else (2e-3, 1e-3)


@pytest.mark.parametrize(
    ("mech", "set", "dependent", "branch"),
    [
        (LU, "natural", (), +1),
        (LU, "paper", ("gamma",), +1),
        (LU, "paper", ("gamma",), -1),
        *[(*case, +1) for case in CASES],
    ],
    ids=case_name,
)
def test_twist_and_acceleration_are_those_of_the_pose(
    mech: pp.Mechanism, set: str, dependent: tuple[str, ...], branch: int
) -> None:
    """Along q(t) with known derivatives; the error of differences falls with h², and nothing is left."""
    poses = samples_of(mech, dependent)
    if set == "paper":
        poses = LU.pose(away(Q, "gamma", 0.5))
        poses = poses[np.sin(LU.coordinates(poses)["gamma"]) * branch > 0.4]
    q = given(mech, poses, set, *dependent)
    rng = np.random.default_rng(SEED)
    size = {name: 0.2 if name in ("x", "y", "z", "p", "h") or "tip" in name else 0.5 for name in q}
    u, w = ({name: size[name] * rng.normal(size=len(poses)) for name in q} for _ in range(2))

    def state(t: float, *rates: Series) -> pp.mechanism.State:
        at = {name: q[name] + u[name] * math.sin(t) + w[name] * (1 - math.cos(t)) for name in q}
        return mech.state(at, *rates, branch=branch, guess=poses)

    exact = state(0, u, w)
    assert np.all(exact.status == Status.OK)
    coarse, fine = (differences(lambda t: state(t).pose, h) for h in steps(dependent))
    for found, a, b in zip((exact.twist, exact.acceleration), coarse, fine, strict=True):
        quarter = np.linalg.norm(b - found) / np.linalg.norm(a - found)
        assert quarter == pytest.approx(0.25, rel=QUARTER)
        assert np.linalg.norm((4 * b - a) / 3 - found) < STENCIL * np.linalg.norm(found)
    for given_ones, results in ((u, exact.coordinate_rates), (w, exact.coordinate_second_rates)):
        assert all(np.array_equal(results[name], values) for name, values in given_ones.items())


@pytest.mark.parametrize(("set", "name"), [("tool", "turn"), ("paper", "gamma"), ("pose", "rz")])
def test_rates_of_dependent_coordinates_are_differences(set: str, name: str) -> None:
    poses = LU.pose(away(away(Q, "gamma", 0.5), "beta", 0.3))
    poses = poses[np.sin(LU.coordinates(poses)["gamma"]) > 0.4]
    q = given(LU, poses, set, name)
    u = {key: np.full(len(poses), 0.1 * (k + 1)) for k, key in enumerate(q)}

    def state(t: float) -> pp.mechanism.State:
        return LU.state({key: values + u[key] * t for key, values in q.items()}, u, guess=poses)

    coarse, fine = (
        [
            (state(h).coordinates[name] - state(-h).coordinates[name]) / (2 * h),
            (state(h).coordinate_rates[name] - state(-h).coordinate_rates[name]) / (2 * h),
        ]
        for h in steps((name,))
    )
    exact = state(0).coordinate_rates[name], state(0).coordinate_second_rates[name]
    for found, a, b in zip(exact, coarse, fine, strict=True):
        assert np.linalg.norm((4 * b - a) / 3 - found) < STENCIL * np.linalg.norm(found)


# --- arrays -------------------------------------------------------------------------------------------------


def test_leading_axes_broadcast() -> None:
    x, beta = np.linspace(-0.1, 0.1, 3)[:, None], np.linspace(0.1, 0.5, 4)
    q = at_cosine(0.5) | {"x": x, "beta": beta}
    state = LU.state(q, {"x": np.ones((2, 1, 1))}, branch=-1)
    assert state.pose.shape == (2, 3, 4, 4, 4)
    assert state.twist.shape == state.acceleration.shape == (2, 3, 4, 6)
    assert state.status.shape == state.coordinates["gamma"].shape == (2, 3, 4)
    one = LU.state(at_cosine(0.5) | {"x": x[2, 0], "beta": beta[1]}, {"x": 1.0}, branch=-1)
    assert np.array_equal(state.pose[1, 2, 1], one.pose)
    assert np.array_equal(state.twist[1, 2, 1], one.twist)
    guessed = LU.state(given(LU, POSES[1], "tool"), guess=POSES[1:3])
    assert guessed.pose.shape == (2, 4, 4)


def test_nothing_in_nothing_out() -> None:
    q = dict.fromkeys(at_cosine(0), np.empty((0, 3)))
    state = LU.state(q, q, q)
    assert state.pose.shape == (0, 3, 4, 4)
    assert state.twist.shape == (0, 3, 6)
    assert state.status.shape == state.coordinates["gamma"].shape == (0, 3)
    assert LU.coordinates(state.pose)["gamma"].shape == (0, 3)
    kinematics = LU.kinematics(state.pose, state.twist, state.acceleration)
    assert kinematics.directions.shape == (0, 3, 5, 3)
    assert LU.inverse_dynamics(state.pose, state.twist, state.acceleration).forces.shape == (0, 3, 5)
    assert LU.jacobian(state.pose).shape == (0, 3, 6, 6)


def test_results_share_no_memory_with_arguments_or_each_other() -> None:
    q = {name: np.full(3, value) for name, value in at_cosine(0.5).items()}
    guess = np.repeat(LU.home[None], 3, axis=0)
    state = LU.state(q, q, q, guess=guess)
    dicts = (state.coordinates, state.coordinate_rates, state.coordinate_second_rates)
    results = [state.pose, state.twist, state.acceleration, *(a for d in dicts for a in d.values())]
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in (*q.values(), guess))
    before = [result.copy() for result in results]
    for argument in (*q.values(), guess):
        argument += 1
    LU.state(q, q, q)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(before, results, strict=True))


def loop(reach: float) -> Array:
    """Poses (200, 4, 4) along a straight line in natural coordinates, from the centre."""
    line = np.outer([0.4, -0.2, 0.05, 0.9, 2.6], np.linspace(0, reach, 200)) + CENTRE[:, None]
    return LU.pose(dict(zip(NATURAL, line, strict=True)))


@pytest.mark.parametrize(("set", "dependent"), [("tool", "turn"), ("pose", "rx")])
def test_continued_follows_a_motion(set: str, dependent: str) -> None:
    """Each state from the one before equals each from the pose itself."""
    poses = loop(0.6)[20:]  # at the centre rx is not determined
    coordinates = given(LU, poses, set, dependent)
    rates = dict.fromkeys(coordinates, 0.5)
    alone = LU.state(coordinates, rates, guess=poses)
    along = LU.state(coordinates, rates, guess=poses[0], continued=True)
    assert np.all(along.status == Status.OK)
    assert along.pose == pytest.approx(poses, abs=10 * ROUNDING)
    assert along.twist == pytest.approx(alone.twist, rel=1e3 * ROUNDING, abs=1e3 * ROUNDING)


def test_continued_says_when_a_motion_passes_a_fold() -> None:
    """The rotation about the tool has two solutions; on the way they meet, and the motion takes the other."""
    poses = loop(1.0)
    state = LU.state(given(LU, poses, "tool"), continued=True)
    jump = int(np.argmax(state.status != Status.OK))
    assert 100 < jump < 150
    assert np.all(state.status[jump : jump + 20] == Status.BRANCH_JUMP)
    assert state.pose[:jump] == pytest.approx(poses[:jump], abs=1e3 * ROUNDING)
    assert np.isnan(state.pose[jump : jump + 20]).all()
    assert np.isnan(state.twist[jump : jump + 20]).all()


def test_continued_goes_on_after_a_state_without_pose() -> None:
    poses = POSES[1:2].repeat(3, axis=0)
    coordinates = given(LU, poses, "tool")
    coordinates["tip_x"][1] = np.nan
    state = LU.state(coordinates, guess=poses[0], continued=True)
    assert state.status.tolist() == [Status.OK, Status.INVALID_INPUT, Status.OK]
    assert state.pose[2] == pytest.approx(poses[2], abs=10 * ROUNDING)
