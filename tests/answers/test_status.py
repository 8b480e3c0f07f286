"""No silent wrong number: what a state without a sound answer says, on both sides of each threshold."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from support import DATA

LU = pp.load("lu-3spu-2rpu-r")
HEXAPOD = pp.load(DATA / "stewart-gough.toml")
NATURAL = {"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6}
REST = np.zeros(6)


def everything(mech: pp.Mechanism, pose: np.ndarray) -> dict[str, tuple[int, bool]]:
    """Status, and whether there are numbers, of each answer at rest."""
    answers = {
        "inverse_kinematics": mech.inverse_kinematics(pose),
        "kinematics": mech.kinematics(pose, REST, REST),
        "inverse_dynamics": mech.inverse_dynamics(pose, REST, REST),
        "power": mech.power(pose, REST, REST),
        "conditioning": mech.conditioning(pose),
    }
    return {name: (int(a.status), bool(np.isfinite(next(iter(a))).all())) for name, a in answers.items()}


def with_end_at(mech: pp.Mechanism, leg: int, point: np.ndarray) -> np.ndarray:
    """The home pose shifted so that the platform joint of a leg is at a point of the base axes."""
    pose = mech.home
    pose[:3, 3] = point - pose[:3, :3] @ np.array(mech.geometry["legs"][leg]["platform"]["point"])
    return pose


@pytest.mark.parametrize(("off", "status"), [(0.0, Status.SINGULAR), (1e-9, Status.SINGULAR), (1e-3, None)])
def test_a_leg_along_the_axis_of_its_universal_joint_has_no_answer(off, status):
    base = HEXAPOD.geometry["legs"][0]["base"]
    axis = np.array(base["axis"]) / np.linalg.norm(base["axis"])
    aside = np.cross(axis, [0.3, -0.5, 0.8])
    pose = with_end_at(HEXAPOD, 0, np.array(base["point"]) + axis + off * aside / np.linalg.norm(aside))
    for name, (found, numbers) in everything(HEXAPOD, pose).items():
        assert (found == Status.SINGULAR) == (status == Status.SINGULAR), name
        assert numbers == (status is None), name


@pytest.mark.parametrize(("length", "singular"), [(0.0, True), (1e-8, True), (1e-3, False)])
def test_a_leg_of_no_length_has_no_answer(length, singular):
    point = np.array(HEXAPOD.geometry["legs"][0]["base"]["point"]) + length * np.array([0.0, 0.0, 1.0])
    answers = everything(HEXAPOD, with_end_at(HEXAPOD, 0, point))
    for name, (found, numbers) in answers.items():
        assert ((found, numbers) == (Status.SINGULAR, False)) == singular, name


def test_a_spinning_leg_has_a_frame_in_every_direction():
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    for leg in data["legs"]:
        leg["base"] = {"joint": "S", "point": leg["base"]["point"]}
        for link in (leg["cylinder"], leg["piston"]):
            link["inertia"] = [0.02, 0.001, 0.02]
            link["center"] = 100.0
    mech = pp.Mechanism.from_dict(data)
    base = np.array(mech.geometry["legs"][0]["base"]["point"])
    rng = np.random.default_rng(3)
    for direction in (*np.eye(3), *rng.normal(size=(50, 3))):
        pose = with_end_at(mech, 0, base + 0.8 * direction / np.linalg.norm(direction))
        twist = rng.normal(size=6)
        legs = mech.kinematics(pose, twist, REST)
        assert legs.status in (Status.OK, Status.OUT_OF_STROKE)
        assert np.isfinite(legs.leg_eps).all()
        assert mech.power(pose, twist, REST).kinetic > 0.0


@pytest.mark.parametrize(("margin", "status"), [(-1e-6, Status.OUT_OF_CONE), (1e-6, Status.OK)])
@pytest.mark.parametrize("side", ["base", "platform"])
def test_a_cone_limit_is_kept_on_both_sides(side, margin, status):
    pose = LU.pose(NATURAL)
    angle = getattr(LU.kinematics(pose, REST, REST), f"{side}_cone_angle")[1]
    data = LU.to_dict()
    data["legs"][1][side]["cone"] = {"angle": float(np.degrees(angle + margin))}
    mech = pp.Mechanism.from_dict(data)
    for name, (found, numbers) in everything(mech, pose).items():
        assert numbers, name
        assert found == (Status.OK if name == "conditioning" else status), name


def test_a_design_that_is_singular_everywhere_says_so():
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    angles = (10, 50, 130, 170, 250, 290)
    for leg, angle in zip(data["legs"], angles, strict=True):
        leg["base"] = {"joint": "S", "point": {"radius": 500.0, "angle": angle}}
        leg["platform"] = {"joint": "U", "point": {"radius": 300.0, "angle": angle}, "axis": [1.0, 0.3, 0.0]}
    mech = pp.Mechanism.from_dict(data)
    assert mech.mobility().uncontrolled == 1
    assert any("singular by design" in note for note in mech.warnings)
    turned = mech.pose({"x": 0.05, "y": 0.02, "z": 0.7, "rx": 0.1, "ry": -0.2, "rz": 0.3})
    answer = mech.inverse_dynamics(turned, REST, REST)
    assert answer.status == Status.SINGULAR
    assert np.isnan(answer.forces).all()


@pytest.mark.parametrize(("stretch", "valid"), [(1e-8, True), (1e-5, False)])
def test_a_matrix_that_is_no_rotation_is_no_pose(stretch, valid):
    pose = HEXAPOD.home
    pose[0, 0] *= 1 + stretch
    assert (HEXAPOD.inverse_kinematics(pose).status != Status.INVALID_INPUT) == valid
    assert np.isfinite(HEXAPOD.jacobian(pose)).all() == valid
    assert np.isfinite(HEXAPOD.hessian(pose)).all() == valid


@pytest.mark.parametrize("guess", [np.zeros((4, 4)), np.full((4, 4), np.nan), 2 * np.eye(4)])
def test_a_guess_that_is_no_pose_is_invalid(guess):
    five = {"x": -0.1, "y": 0.1, "z": 0.65, "rx": 0.0, "ry": 0.4}
    assert LU.state(five, guess=guess).status == Status.INVALID_INPUT


@pytest.mark.parametrize(("off", "status"), [(1e-8, Status.OK), (1e-5, Status.OFF_CONSTRAINT)])
def test_poses_and_twists_may_miss_a_constraint_by_rounding_only(off, status):
    pose = LU.pose(NATURAL)
    row = LU.jacobian(pose)[5] * [1, 1, 1, *[1 / LU.characteristic_length**2] * 3]
    moved = pose.copy()
    moved[:3, 3] += off * row[:3] / np.linalg.norm(row[:3]) * LU.characteristic_length
    assert LU.inverse_kinematics(moved).status == status
    state = LU.state(NATURAL, {"alpha": 1.0, "h": 0.1})
    twist = state.twist + off * row / np.linalg.norm(row)
    assert LU.kinematics(pose, twist, state.acceleration).status == status


def test_lengths_are_known_at_the_fold():
    """Where rates are not determined, positions are."""
    time = np.linspace(0.0, 1.0, 5)
    line = 0.120 * np.sin(np.radians(18.0))
    q = {
        "x": 0.1 * time,
        "y": line + 0 * time,
        "z": 0.7 + 0 * time,
        "alpha": 0 * time,
        "beta": 0.3 + 0 * time,
    }
    found = pp.solve(LU, pp.Motion.through(time, q, set="paper")).dataset
    assert set(found.status.values.tolist()) == {Status.FOLD}
    assert np.isfinite(found.length.values).all()
    assert np.isnan(found.force.values).all()
