"""Motions that stay at a constraint singularity: one judgement along all of them, whatever rounding does."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod.solution.singularity_crossings import sampled_passages, warnings_of
from support.mechanism_files import SI_UNITS

NAME = "3-upu-snu"
"""Its centre line is singular: the couples of all three legs are upright there, so that two are lost."""


def turned(angle: float) -> pp.Mechanism:
    """The mechanism rotated about Z, degrees: the same machine, with other rounding."""
    data = pp.load(NAME).to_dict()
    for leg in data["legs"]:
        for side in ("base", "platform"):
            leg[side]["point"]["angle"] += angle
            leg[side]["axis"]["angle"] += angle
    return pp.Mechanism.from_dict(data)


def lifted(mech: pp.Mechanism, count: int, x: float = 0.0) -> pp.Solution:
    """A motion straight upwards at a distance from the centre line, m."""
    time = np.linspace(0.0, 2.0, count)
    height = mech.home[2, 3] + 0.05 * np.sin(time)
    path = {"x": np.full(count, x), "y": np.zeros(count), "z": height}
    return pp.solve(mech, pp.Motion.through(time, path, set="pose"))


@pytest.mark.parametrize("angle", [0.0, 17.3, 41.0, 77.7, 123.4])
@pytest.mark.parametrize("count", [11, 40])
def test_all_states_of_a_singular_lift_are_judged_alike(angle, count):
    solution = lifted(turned(angle), count)
    assert (solution.dataset["status"] == pp.Status.FOLD).all()
    assert solution.singularities["crossings"] == []
    (passage,) = solution.singularities["near"]
    assert (passage["kind"], passage["stays"], passage["freedoms"]) == ("CONSTRAINT", [[0.0, 2.0]], 2)
    assert (passage["start"], passage["end"]) == (0.0, 2.0)


def test_it_is_said_once_with_the_number_of_freedoms():
    (said,) = warnings_of(lifted(turned(17.3), 21).singularities)
    assert "stays at singular poses from 0 s to 2 s" in said
    assert "degrees of freedom that no actuator controls, 2 here" in said
    assert any("2 here" in warning for warning in turned(17.3).warnings)


@pytest.mark.parametrize("x", [0.03, 0.002])
def test_beside_the_singular_line_all_states_have_answers(x):
    """Near is told as near: no freedom is gained."""
    solution = lifted(turned(17.3), 21, x)
    assert (solution.dataset["status"] == pp.Status.OK).all()
    assert solution.singularities["crossings"] == []
    for passage in solution.singularities["near"]:
        assert (passage["stays"], passage["freedoms"]) == ([], 0)


def test_a_motion_across_the_singular_line_touches_it_at_one_instant():
    mech = turned(17.3)
    time = np.linspace(0.0, 2.0, 21)
    path = {"x": 0.03 * (time - 0.97), "y": np.zeros(21), "z": np.full(21, mech.home[2, 3])}
    solution = pp.solve(mech, pp.Motion.through(time, path, set="pose"))
    assert (solution.dataset["status"] == pp.Status.OK).all()
    assert not any(passage["stays"] for passage in solution.singularities["near"])
    times = [crossing["time"] for crossing in solution.singularities["crossings"]]
    nearest = [passage["time"] for passage in solution.singularities["near"]]
    assert times == pytest.approx([0.97], abs=1e-5)
    assert nearest == pytest.approx([0.97], abs=1e-5)
    assert solution.singularities["crossings"][0]["freedoms"] == 2


def six_upu(angle: float = 0.0) -> pp.Mechanism:
    """Six U-P-U legs in planes through Z, rotated about it, degrees: one couple of three is left on Z."""
    legs = []
    for k in range(6):
        way = np.radians(60.0 * k + angle)
        out = [float(np.cos(way)), float(np.sin(way)), 0.0]
        ends = {"base": out, "platform": [0.5 * x for x in out]}
        legs.append({side: {"joint": "U", "point": at, "axis": out} for side, at in ends.items()})
    body = {"mass": 10.0, "center": [0.0, 0.0, 0.0], "inertia": np.eye(3).tolist()}
    home = {"position": [0.0, 0.0, 1.0]}
    return pp.Mechanism.from_dict(
        {"name": "6-UPU", "units": SI_UNITS, "home": home, "platform": body, "legs": legs}
    )


@pytest.mark.parametrize("angle", [0.0, 17.3, 41.0])
@pytest.mark.parametrize("height", [0.3, 1.0, 4.0])
def test_a_lifted_six_upu_gains_two_freedoms_at_all_heights(angle, height):
    mech = six_upu(angle)
    time = np.linspace(0.0, 1.0, 21)
    path = {"x": np.zeros(21), "y": np.zeros(21), "z": height * (1.0 + 0.2 * time)}
    solution = pp.solve(mech, pp.Motion.through(time, path, set="pose"))
    assert mech.dof == 3
    assert (solution.dataset["status"] == pp.Status.FOLD).all()
    assert solution.singularities["crossings"] == []
    (passage,) = solution.singularities["near"]
    assert (passage["stays"], passage["freedoms"], passage["time"]) == ([[0.0, 1.0]], 2, 0.0)


def at_distances(mech: pp.Mechanism, x: np.ndarray) -> np.ndarray:
    """Poses at distances x (n,) from the singular line, m, which keep the constraints exactly."""
    pose = np.tile(np.eye(4), (len(x), 1, 1))
    pose[:, 0, 3], pose[:, 2, 3] = x, mech.home[2, 3]
    return pose


@pytest.mark.parametrize("mech", [six_upu(17.3), turned(17.3)], ids=["six", "three"])
def test_states_coordinates_and_kinds_are_judged_with_one_margin(mech):
    """Whatever is asked, singular begins at 1e-6, up to the ratios of the measures, which are below ten."""
    x = 10.0 ** -np.arange(1.0, 16.0)
    pose, n = at_distances(mech, x), len(x)
    twist, still = np.tile([0, 0, 1.0, 0, 0, 0], (n, 1)), np.zeros((n, 6))
    zero, push = np.zeros(n), np.ones((n, len(mech.leg_names)))
    rates = mech.kinematics(pose, twist, still).rates
    statuses = {
        "coordinates": mech.state({"x": x, "y": zero, "z": pose[:, 2, 3]}).status,
        "forces": mech.inverse_dynamics(pose, twist, still).status,
        "power": mech.power(pose, twist, still).status,
        "twist": mech.platform_twist(pose, rates).status,
        "acceleration": mech.forward_dynamics(pose, twist, push).status,
    }
    measure = mech.singularity(pose)
    assert np.array_equal(measure.kind != pp.SingularityKind.NONE, measure.constraint_sigma <= 1e-6)
    for what, status in statuses.items():
        assert (status[measure.constraint_sigma > 1e-5] == pp.Status.OK).all(), what
        assert (status[measure.constraint_sigma < 1e-7] != pp.Status.OK).all(), what


def test_rounding_of_poses_on_the_line_does_not_choose_their_status():
    mech = six_upu(17.3)
    noise = 1e-9 * np.random.default_rng(0).normal(size=200)
    pose = at_distances(mech, noise)
    rest = np.zeros((200, 6))
    assert (mech.inverse_dynamics(pose, rest, rest).status == pp.Status.SINGULAR).all()


def test_a_motion_that_stays_for_a_while_is_told_from_when_to_when():
    mech, time = turned(17.3), np.linspace(0.0, 3.0, 61)
    away = np.maximum(time - 2.0, 0.0) ** 3 + np.maximum(1.0 - time, 0.0) ** 3
    lift = mech.home[2, 3] + 0.01 * time
    state = mech.state({"x": 0.05 * away, "y": 0.0 * away, "z": lift})
    determinant = mech.determinant(state.pose, np.zeros((61, 6)))
    findings = sampled_passages(mech, time, state.pose, determinant)
    assert findings["crossings"] == []
    (passage,) = findings["near"]
    ((start, end),) = passage["stays"]
    assert (start, end) == pytest.approx((1.0, 2.0), abs=1e-12)
    assert (passage["time"], passage["freedoms"]) == (start, 2)
    assert passage["start"] < 0.9
    assert passage["end"] > 2.1
    (said,) = warnings_of(findings)
    assert "stays at singular poses from 1 s to 2 s, and is near them from " in said
