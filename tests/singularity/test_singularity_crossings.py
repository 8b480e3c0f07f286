"""Singular poses that a motion crosses, touches or comes near."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import polypod as pp
from polypod import Motion
from polypod.solution.singularity_crossings import find_passages, warnings_of
from support import DATA
from support.singular import GOUGH, LU, QUARTER, RPS, hexapod


def yaw(curve, n: int) -> Motion:
    """The hexapod rotated about z by a function of time in [0, 1]."""
    fine = np.linspace(0.0, 1.0, 201)
    q = {name: np.full(201, value) for name, value in QUARTER.items()} | {"rz": curve(fine)}
    return Motion.through(fine, q, set="pose").sample(np.linspace(0.0, 1.0, n))


@pytest.mark.parametrize("n", [2, 3, 8, 101])
def test_a_crossing_is_found_between_samples(n):
    solution = pp.solve(GOUGH, yaw(lambda t: 1.2 + 0.6 * t, n))
    (crossing,) = solution.singularities["crossings"]
    assert crossing["time"] == pytest.approx((np.pi / 2 - 1.2) / 0.6, abs=1e-9)
    assert (crossing["kind"], crossing["leg"]) == ("ACTUATION", None)
    assert crossing["crosses"]
    assert crossing["found"]
    det = solution.dataset.determinant.values
    assert det[0] * det[-1] < 0
    (near,) = solution.singularities["near"]
    assert near["start"] - 1e-9 <= crossing["time"] <= near["end"] + 1e-9
    assert near["minimum"] < 1e-9
    assert near["time"] == pytest.approx(crossing["time"], abs=1e-6)


@pytest.mark.parametrize("n", [3, 4, 8, 101])
def test_two_crossings_between_samples_of_one_sign_are_found(n):
    solution = pp.solve(GOUGH, yaw(lambda t: np.pi / 2 + 0.01 - (t - 0.45) ** 2, n))
    times = [c["time"] for c in solution.singularities["crossings"]]
    assert times == pytest.approx([0.35, 0.55], abs=1e-9)
    if n == 4:
        assert len({*np.sign(solution.dataset.determinant.values)}) == 1, "the samples do not show it"


@pytest.mark.parametrize("n", [3, 8, 101])
@pytest.mark.parametrize("half", [2e-3, 5e-5])
def test_two_crossings_shortly_after_one_another_are_two(n, half):
    """Far nearer to each other than samples are, but farther than rounding could part one that is touched."""
    solution = pp.solve(GOUGH, yaw(lambda t: np.pi / 2 + half**2 - (t - 0.45) ** 2, n))
    found = solution.singularities["crossings"]
    assert [c["time"] for c in found] == pytest.approx([0.45 - half, 0.45 + half], abs=1e-8)
    assert all(c["crosses"] and c["found"] for c in found)


@pytest.mark.parametrize("n", [3, 4, 8, 101])
@pytest.mark.parametrize(("margin", "touches"), [(0.0, True), (1e-4, False)])
def test_a_touched_singularity_is_found_and_a_near_miss_is_none(n, margin, touches):
    solution = pp.solve(GOUGH, yaw(lambda t: np.pi / 2 - margin - (t - 0.45) ** 2, n))
    found = solution.singularities["crossings"]
    assert [c["time"] for c in found] == pytest.approx([0.45] if touches else [], abs=1e-6)
    assert not any(c["crosses"] for c in found)
    (near,) = solution.singularities["near"]
    assert near["time"] == pytest.approx(0.45, abs=1e-6)
    assert near["minimum"] == pytest.approx(0.0, abs=1e-3)
    assert near["minimum"] > 1e-6 or touches


def test_a_rest_at_a_singular_pose_is_one_finding():
    time = np.linspace(0, 1, 21)
    q = {name: np.full(21, value) for name, value in QUARTER.items()}
    findings = pp.solve(GOUGH, Motion.through(time, q, set="pose")).singularities
    assert findings["crossings"] == []
    assert [(p["start"], p["end"], p["stays"]) for p in findings["near"]] == [(0.0, 1.0, [[0.0, 1.0]])]


def test_near_passages_have_their_own_kind_and_leg():
    """Down to the rod's line and up again: constraint and frames of legs 1 and 3."""
    time = np.linspace(0, 1, 41)
    still = np.ones(41)
    h = 0.0005 + 0.2 * (time - 0.5) ** 2
    q = {"alpha": 0.1 * still, "p": -0.5 * still, "h": h, "beta": 0 * still, "gamma": 0.3 * still}
    near = pp.solve(LU, Motion.through(time, q, set="natural")).singularities["near"]
    kinds = {(p["kind"], p["leg"]) for p in near}
    assert {("CONSTRAINT_VANISHES", "1"), ("LEG_FRAME", "1"), ("LEG_FRAME", "3")} <= kinds
    for passage in near:
        assert passage["time"] == pytest.approx(0.5) or passage["kind"] == "ACTUATION"
        assert passage["minimum"] < 0.01


class Blind:
    """A mechanism that has no state where it is asked for one."""

    def __init__(self, mech):
        self._mech = mech

    def __getattr__(self, name):
        return getattr(self._mech, name)

    def state(self, *args, **kwargs):
        state = self._mech.state(*args, **kwargs)
        return replace(state, pose=np.full_like(state.pose, np.nan), twist=np.full_like(state.twist, np.nan))


def test_a_change_of_sign_across_a_gap_is_told():
    motion = yaw(lambda t: 1.2 + 0.6 * t, 11)
    state = GOUGH.state(motion.coordinates, motion.rates)
    det = GOUGH.determinant(state.pose, state.twist)
    for array in (state.pose, det.determinant, det.rate):
        array[5:8] = np.nan
    findings = find_passages(Blind(GOUGH), motion, state.pose, det)
    (crossing,) = findings["crossings"]
    assert (crossing["kind"], crossing["found"], crossing["crosses"]) == ("UNKNOWN", False, True)
    assert crossing["between"] == pytest.approx([0.4, 0.8])
    assert "no singular pose is known" in warnings_of(findings)[0]


def test_dependent_coordinates_follow_between_samples():
    """The 3-RPS driven by z, rx, ry: findings do not depend on the samples."""
    fine = np.linspace(0, 1, 201)
    q = {"z": 0.25 - 0.24 * fine, "rx": 0.3 + 0.1 * fine, "ry": 0.9 * fine}
    motion = Motion.through(fine, q, set="pose")
    times = [
        [c["time"] for c in pp.solve(RPS, motion.sample(np.linspace(0, 1, n))).singularities["crossings"]]
        for n in (6, 41, 201)
    ]
    assert len(times[0]) >= 1
    for others in times[1:]:
        assert others == pytest.approx(times[0], abs=1e-7)


def test_a_design_that_is_singular_everywhere_is_named_once():
    angles = np.radians([10, 50, 130, 170, 250, 290])
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    mech = hexapod(0.5 * ring, 0.3 * ring, (0.0, 0.0, 0.6))
    n = 11
    q = {name: np.zeros(n) for name in ("x", "y", "rx", "ry")} | {
        "z": np.linspace(0.6, 0.7, n),
        "rz": np.linspace(0, 0.2, n),
    }
    findings = pp.solve(mech, Motion.through(np.linspace(0, 1, n), q, set="pose")).singularities
    assert (findings["uncontrolled"], findings["crossings"]) == (1, [])
    assert "singular by design" in warnings_of(findings)[0]


def test_findings_survive_files(tmp_path):
    solution = pp.solve(GOUGH, yaw(lambda t: 1.2 + 0.6 * t, 8))
    for name in ("a.nc", "a.csv"):
        solution.save(tmp_path / name)
        assert pp.load_solution(tmp_path / name).singularities == solution.singularities


def test_solve_warns_by_name_and_time(tmp_path, run):
    motion = tmp_path / "turn.csv"
    rows = [[t, 0, 0, 600, 0, 0, np.degrees(1.2 + 0.6 * t)] for t in np.linspace(0, 1, 8)]
    header = "time [s], x [mm], y [mm], z [mm], rx [deg], ry [deg], rz [deg]"
    np.savetxt(motion, rows, fmt="%.17g", delimiter=",", header=header, comments="")
    arguments = ["solve", DATA / "stewart-gough.toml", motion, "-o", tmp_path / "r.nc"]
    words = " ".join(run(*arguments)[1].split())
    assert "Warning: the motion crosses a singular pose at 0.617993878 s; direct singularity" in words
    assert "Warning: the motion is near a singular pose from" in words
    facts = json.loads(run(*arguments, "--json")[1])["singularities"]
    assert facts["crossings"][0]["time"] == pytest.approx((np.pi / 2 - 1.2) / 0.6, abs=1e-9)
    assert facts["near"][0]["kind"] == "ACTUATION"
    assert len(facts["warnings"]) == 2
