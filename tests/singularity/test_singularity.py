"""Singularities: measures against an independent model, every kind constructed, crossings and distances."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import polypod as pp
from polypod import Status, _core
from support import oracle as o
from support.singular import (
    ALL,
    GOUGH,
    LU,
    NATURAL,
    QUARTER,
    RPS,
    SPECS,
    Kind,
    hexapod,
    independent_jacobian,
    matrix,
)

REST = np.zeros(6)


def random_poses(name: str, n: int = 20):
    """Generic poses that keep the constraints, as (R, o)."""
    rng = np.random.default_rng(5)
    R, p = o.home(SPECS[name])
    size = o.characteristic_length(SPECS[name])
    start = o.turn(0.3 * rng.uniform(-1, 1, (n, 3))) @ R, p + 0.3 * size * rng.uniform(-1, 1, (n, 3))
    return o.close(SPECS[name], start)


# --- measures -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [None, 0.1, 1.0])
@pytest.mark.parametrize("name", ALL)
def test_determinant_and_singular_values_are_those_of_the_independent_model(name, length):
    mech, pose = ALL[name], random_poses(name)
    scale = mech.characteristic_length if length is None else length
    expected = np.linalg.det(independent_jacobian(name, pose, scale))
    found = mech.singularity(matrix(pose), length=length)
    assert found.status.tolist() == [Status.OK] * 20
    assert found.determinant == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert len({*np.sign(expected)}) == 2 or name != "lu", "both aspects are sampled"
    Z, _ = o.feasible_directions(SPECS[name], pose)  # orthonormal for the characteristic length only
    Q, _ = np.linalg.qr(Z / np.array([1.0] * 3 + [o.characteristic_length(SPECS[name]) / scale] * 3)[:, None])
    sigma = np.linalg.svd(
        o.leg_gradient(SPECS[name], pose) / np.array([1, 1, 1, scale, scale, scale]) @ Q, compute_uv=False
    )
    assert found.sigma_max == pytest.approx(sigma[:, 0], rel=1e-9)
    assert found.sigma_min == pytest.approx(sigma[:, -1], rel=1e-7, abs=1e-11)
    assert np.array_equal(found.condition, found.sigma_max / found.sigma_min)
    for field, value in mech.conditioning(matrix(pose), length=length).arrays.items():
        assert np.array_equal(value, getattr(found, field)), field
    assert np.array_equal(mech.determinant(matrix(pose), length=length).determinant, found.determinant)


@pytest.mark.parametrize("name", ALL)
def test_the_rate_of_the_determinant_is_its_derivative(name):
    mech, pose = ALL[name], random_poses(name, 6)
    twist = np.random.default_rng(2).uniform(-1, 1, (6, 6))
    scale = mech.characteristic_length
    rate = mech.determinant(matrix(pose), twist).rate

    def along(t):
        return np.linalg.det(independent_jacobian(name, o.along(pose, twist, 0 * twist, t), scale))

    expected, _ = o.differentiate(along, 2e-3)
    assert rate == pytest.approx(expected, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("name", ALL)
def test_measures_do_not_depend_on_the_size_of_the_machine(name):
    data = ALL[name].to_dict()
    data["units"] = {**data["units"], "length": "cm"}
    big, pose = pp.Mechanism.from_dict(data), matrix(random_poses(name))
    bigger = pose.copy()
    bigger[..., :3, 3] *= 10
    small, large = ALL[name].singularity(pose), big.singularity(bigger)
    for field in (
        "determinant",
        "sigma_min",
        "sigma_max",
        "constraint_sigma",
        "leg_length",
        "leg_sine",
        "axis",
    ):
        assert getattr(large, field) == pytest.approx(getattr(small, field), rel=1e-6, abs=1e-9), field
    assert large.pitch == pytest.approx(10 * small.pitch, rel=1e-6, abs=1e-9)
    assert large.point == pytest.approx(10 * small.point, rel=1e-6, abs=1e-8)


# --- kinds --------------------------------------------------------------------------------------------------


def assert_uncontrolled(mech: pp.Mechanism, name: str | None, pose: np.ndarray, found) -> None:
    """The twist changes no leg's length and breaks no constraint, and rotations about the given axis."""
    twist = found.twist
    J = mech.jacobian(pose)
    assert J @ twist == pytest.approx(np.zeros(6), abs=1e-9)
    length = mech.characteristic_length
    assert np.linalg.norm(twist[:3]) ** 2 + (length * np.linalg.norm(twist[3:])) ** 2 == pytest.approx(1.0)
    if np.isfinite(found.pitch):
        arm = found.point - pose[:3, 3]
        at_point = twist[:3] + np.cross(twist[3:], arm)
        assert twist[3:] == pytest.approx(np.linalg.norm(twist[3:]) * found.axis)
        assert at_point == pytest.approx(found.pitch * twist[3:], abs=1e-9)
        assert arm @ found.axis == pytest.approx(0.0, abs=1e-9)
    else:
        assert twist[3:] == pytest.approx(np.zeros(3), abs=1e-5)
        assert twist[:3] == pytest.approx(found.axis)
    if name is not None:
        (R, p) = pose[:3, :3], pose[:3, 3]
        legs, joints = o.leg_gradient(SPECS[name], (R, p)), o.closure_gradient(SPECS[name], (R, p))[0]
        assert legs @ twist == pytest.approx(np.zeros(len(legs)), abs=1e-8)
        scaled = twist * np.array([1, 1, 1, length, length, length])
        assert joints @ scaled == pytest.approx(np.zeros(len(joints)), abs=1e-6)


@pytest.mark.parametrize(("alpha", "gamma"), [(0.0, 0.0), (0.4, -0.7)])
def test_first_singularity_of_the_paper(alpha, gamma):
    """b_1 and b_3 on the rod's line: L ∥ l and r ∥ L, so that c = τ = 0."""

    def pose(h):
        return matrix(o.natural_pose(alpha, -0.5, h, 0.0, gamma))

    at = LU.singularity(pose(0.0))
    assert (at.kind, at.leg, at.status) == (Kind.CONSTRAINT_VANISHES, 0, Status.OK)
    assert LU.jacobian(pose(0.0))[5] == pytest.approx(REST, abs=1e-12)
    assert (at.determinant, at.sigma_min) == (0.0, pytest.approx(0.0, abs=1e-12))
    assert at.uncontrolled >= 1
    assert_uncontrolled(LU, None, pose(0.0), at)
    # Other answers refuse the pose, on this side of the threshold and not on the other.
    assert LU.inverse_dynamics(pose(0.0), REST, REST).status == Status.SINGULAR
    for h, kind in ((1e-9, Kind.CONSTRAINT_VANISHES), (1e-3, Kind.NONE)):
        assert LU.singularity(pose(h)).kind == kind
    assert LU.singularity(pose(1e-4), tolerance=0.01).kind == Kind.CONSTRAINT_VANISHES
    sigma = [float(LU.singularity(pose(h)).constraint_sigma) for h in (1e-3, 1e-4)]
    assert sigma[0] == pytest.approx(10 * sigma[1], rel=1e-9)
    assert 2e-3 / 0.15 > sigma[0] > np.sqrt(2) * 1e-3 / 0.15, (
        "two rows of size |L × r|/Λ, and that of the rod"
    )


@pytest.mark.parametrize("coincide", ["l", "L"])
def test_second_and_third_singularity_of_the_paper(coincide):
    """Coincident joints on the rod's legs: l and L keep the direction of the joints' axes, so |J| stays."""
    data = LU.to_dict()
    first, third = data["legs"][0], data["legs"][2]
    if coincide == "l":
        first["platform"]["point"] = third["platform"]["point"] = [0.0, 46.35, 0.0]
        data["home"]["position"][1] = 83.43458848123579 - 46.35
    else:
        first["base"]["point"] = third["base"]["point"] = [0.0, 83.43458848123579, 0.0]
    mech = pp.Mechanism.from_dict(data)
    assert (mech.dof, mech.mobility().uncontrolled) == (5, 0)
    pose = mech.pose(NATURAL)
    found = mech.singularity(pose)
    assert found.kind == Kind.NONE
    assert abs(found.determinant) > 0.1
    assert np.linalg.norm(mech.jacobian(pose)[5]) > 0.5
    multiplier = mech.inverse_dynamics(pose, REST, REST).constraint
    coupled = mech.coupled_forces(pose, multiplier)
    assert (coupled.status == Status.SINGULAR) == (coincide == "l")
    assert np.isnan(coupled.forces).all() == (coincide == "l")


def test_designs_without_direction_or_with_one_leg_twice_are_refused():
    def edited(edit):
        data = copy.deepcopy(LU.to_dict())
        edit(data)
        with pytest.raises(pp.MechanismError) as refused:
            pp.Mechanism.from_dict(data)
        return [fault.place for fault in refused.value.faults]

    def same(data):
        for side in ("base", "platform"):
            data["legs"][2][side]["point"] = data["legs"][0][side]["point"]

    assert edited(lambda d: d["rods"][0].update(axis=[0, 0, 0])) == ["rods.1.axis"]
    assert edited(lambda d: d["legs"][0]["platform"].update(axis=[0, 0, 0])) == ["legs.1.platform.axis"]
    assert "legs.3" in edited(same)


def with_end_at(mech: pp.Mechanism, leg: int, point: np.ndarray) -> np.ndarray:
    """A tilted platform with its joint of a leg at a point of the base axes."""
    pose = matrix((o.turn([0.3, -0.2, 0.4]), np.zeros(3)))
    pose[:3, 3] = point - pose[:3, :3] @ np.array(mech.geometry["legs"][leg]["platform"]["point"])
    return pose


@pytest.mark.parametrize(
    ("length", "kind"), [(0.0, Kind.LEG_LENGTH), (1e-8, Kind.LEG_LENGTH), (1e-5, Kind.NONE)]
)
def test_a_leg_of_no_length(length, kind):
    base = np.array(GOUGH.geometry["legs"][3]["base"]["point"])
    found = GOUGH.singularity(with_end_at(GOUGH, 3, base + length * np.array([0.0, 0.0, 1.0])))
    assert found.kind == kind
    assert found.leg == (3 if kind else -1)
    assert found.status == (Status.SINGULAR if kind else Status.OK)
    assert np.isnan(found.determinant) == np.isnan(found.sigma_min) == (kind != Kind.NONE)
    assert found.uncontrolled == (-1 if kind else 0)
    assert found.leg_length[3] * GOUGH.characteristic_length == pytest.approx(length, abs=1e-15)


@pytest.mark.parametrize(("off", "kind"), [(0.0, Kind.LEG_FRAME), (1e-9, Kind.LEG_FRAME), (1e-4, Kind.NONE)])
def test_a_leg_along_the_axis_of_its_universal_joint(off, kind):
    base = GOUGH.geometry["legs"][2]["base"]
    axis = np.array(base["axis"]) / np.linalg.norm(base["axis"])
    aside = np.cross(axis, [0.0, 0.0, 1.0])
    found = GOUGH.singularity(with_end_at(GOUGH, 2, np.array(base["point"]) + axis + off * aside))
    assert (found.kind, found.leg) == (kind, 2 if kind else -1)
    assert found.status == Status.OK
    assert np.isfinite(found.determinant)
    assert found.leg_sine[2] == pytest.approx(off, abs=1e-12)


@pytest.mark.parametrize("turned", [0.0, 1e-9, 1e-4])
def test_constraint_singularity_of_the_3_rps(turned):
    """Upside down about y, the three forces across the legs' planes balance: they hold it no more."""
    angle = np.pi - turned
    pose = matrix((o.turn([0.0, angle, 0.0]), np.array([-0.075 * (1 - np.cos(angle)), 0.0, 0.4])))
    found = RPS.singularity(pose)
    assert found.status == Status.OK
    J = independent_jacobian("3-rps", (pose[:3, :3], pose[:3, 3]), RPS.characteristic_length)
    assert found.constraint_sigma == pytest.approx(np.linalg.svd(J[3:], compute_uv=False)[2], abs=1e-12)
    if turned < 1e-6:
        assert (found.kind, found.leg, found.uncontrolled) == (Kind.CONSTRAINT, -1, 1)
        assert found.sigma_min == pytest.approx(0.0, abs=1e-12)
        assert RPS.conditioning(pose).sigma_min == found.sigma_min
        assert_uncontrolled(RPS, "3-rps", pose, found)
    else:
        assert found.kind == Kind.NONE
        assert RPS.singularity(pose, tolerance=0.01).kind == Kind.CONSTRAINT


def test_legs_that_all_meet_a_line_leave_the_turn_about_it():
    """A special linear complex: platform and two base joints in one plane, legs in pairs on three points."""
    corners = np.array([[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3], [0.0, 0.0, -0.1]])
    base = [[-0.6, 0.4, 0], [-0.5, -0.5, 0], [0.5, -0.6, 0], [0.6, 0.3, 0], [-0.3, 0, 0], [0.3, 0, 0]]
    mech = hexapod(base, np.repeat(corners, 2, axis=0), (0.05, 0.0, 0.6))
    found = mech.singularity(mech.home)
    assert (found.kind, found.uncontrolled, found.leg) == (Kind.ACTUATION, 1, -1)
    assert_uncontrolled(mech, None, mech.home, found)
    assert abs(found.axis) == pytest.approx([1, 0, 0], abs=1e-9)
    assert found.pitch == pytest.approx(0.0, abs=1e-9)
    assert found.point == pytest.approx([0.05, 0.0, 0.9], abs=1e-9)


def test_legs_square_to_a_direction_leave_the_translation_along_it():
    x = np.array([-0.3, -0.2, -0.1, 0.1, 0.2, 0.35])
    platform = np.stack([x, [0.1, -0.2, 0.3, -0.1, 0.25, -0.3], [0.0, 0.1, 0.0, -0.1, 0.05, 0.1]], axis=1)
    base = np.stack([x, [0.5, -0.4, 0.1, 0.4, -0.6, 0.2], [0.0, 0.05, 0.0, 0.1, 0.0, 0.0]], axis=1)
    mech = hexapod(base, platform, (0.0, 0.0, 0.7))
    found = mech.singularity(mech.home)
    assert (found.kind, found.uncontrolled, found.pitch) == (Kind.ACTUATION, 1, np.inf)
    assert abs(found.axis) == pytest.approx([1, 0, 0], abs=1e-9)
    assert found.point.tolist() == mech.home[:3, 3].tolist()
    assert_uncontrolled(mech, None, mech.home, found)


def test_a_quarter_turn_of_a_hexapod_is_a_screw():
    """Fichter's: by symmetry the uncontrolled screw is about the middle line, with a pitch."""
    pose = GOUGH.pose(QUARTER)
    found = GOUGH.singularity(pose)
    assert (found.kind, found.uncontrolled) == (Kind.ACTUATION, 1)
    assert_uncontrolled(GOUGH, "stewart-gough", pose, found)
    assert abs(found.axis) == pytest.approx([0, 0, 1], abs=1e-9)
    assert found.point == pytest.approx([0, 0, 0.6], abs=1e-9)
    assert 0.01 < abs(found.pitch) < 10
    assert GOUGH.inverse_dynamics(pose, REST, REST).status == Status.SINGULAR
    for off, kind in ((1e-9, Kind.ACTUATION), (1e-4, Kind.NONE)):
        assert GOUGH.singularity(GOUGH.pose(QUARTER | {"rz": np.pi / 2 - off})).kind == kind


def test_no_answer_says_why():
    off = LU.pose(NATURAL)
    off[1, 3] += 0.01
    poses = np.stack([off, np.full((4, 4), np.nan), LU.home])
    found = LU.singularity(poses)
    assert found.status.tolist() == [Status.OFF_CONSTRAINT, Status.INVALID_INPUT, Status.OK]
    assert found.kind.tolist() == [Kind.UNKNOWN, Kind.UNKNOWN, Kind.NONE]
    assert np.isnan(found.determinant[:2]).all()
    assert "status" in Kind.UNKNOWN.message
    assert LU.singularity(np.broadcast_to(LU.home, (2, 3, 4, 4))).twist.shape == (2, 3, 6)


@pytest.mark.parametrize(
    "call",
    [
        lambda: LU.singularity(LU.home, length=0.0),
        lambda: LU.singularity(LU.home, tolerance=-1.0),
        lambda: LU.conditioning(LU.home, length=np.nan),
        lambda: LU.determinant(LU.home, length=np.inf),
        lambda: LU.singularity_distance(LU.home, reach=-1.0),
        lambda: LU.singularity_distance(LU.home, "polar"),
        lambda: LU.singularity_distance(LU.home, "pose", coordinates=["x", "y"]),
        lambda: LU.singularity_distance(LU.home, "pose", coordinates=["alpha", "p", "h", "beta", "gamma"]),
    ],
)
def test_wrong_calls_raise(call):
    with pytest.raises(pp.PolypodError, match=r"must be|valid:|are not those"):
        call()


def test_kinds_are_those_of_the_core():
    core = {(code, name.upper()) for code, name, _ in _core.singularity_kinds()}
    assert core == {(k.value, k.name.replace("_", "")) for k in Kind if k != Kind.UNKNOWN}
    assert all(k.message for k in Kind)
