"""Polypod against Exudyn and MuJoCo, which get its forces and answer with accelerations and motions."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import polypod as pp
from polypod.multibody.placement import PLATFORM
from polypod.multibody.tree import describe
from polypod.vectors import turned
from polypod.verify import comparison, engines, integrate, verify_states
from polypod.verify.constraints import Links, Square, jacobian, redundant, residual, rows_of

pytest.importorskip("exudyn")
pytest.importorskip("mujoco")

from polypod.verify import exudyn as hard
from polypod.verify import mujoco as soft
from support import cases as cases
from support.verified import (
    exceeding,
    forget_damping,
    forget_efficiency,
    mirror_center,
    rod_center,
    turn_gravity,
)

COLUMNS = 120
LU = "lu-3spu-2rpu-r"
ENGINES = ("exudyn", "mujoco")
CATALOGUE = (*cases.DRAWN, *cases.FILES)


def lu_states(times=(0.0, 1.3, 3.63)):
    """The paper's mechanism and states of the built-in motion."""
    mech = pp.load(LU)
    motion = pp.load_motion(LU, mech).sample(times)
    state = mech.state(motion.coordinates, motion.rates, motion.second_rates, branch=motion.branch)
    return mech, (state.pose, state.twist, state.acceleration)


# --- constraints as rows ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rod-lined", "passive", "fpf", "upr", "3-rpr-planar"])
def test_rows_hold_and_their_jacobian_is_their_derivative(name):
    case = cases.case(name)
    tree = describe(case.mech)
    rows, bodies = rows_of(tree), [body.name for body in tree.bodies]
    for pose in case.T[::9]:
        placed = tree.start(pose)
        assert np.abs(residual(rows, placed, tree.scale)).max() < 1e-13
        exact = jacobian(rows, bodies, placed, tree.scale)
        h = 1e-6
        for column in range(exact.shape[1]):
            body, i = bodies[column // 6], column % 6
            ends = []
            for side in (h, -h):
                moved = placed | {body: placed[body].copy()}
                if i < 3:
                    moved[body][i, 3] += side * tree.scale
                else:
                    moved[body][:3, :3] = turned(np.eye(3)[i - 3], side) @ moved[body][:3, :3]
                ends.append(residual(rows, moved, tree.scale))
            assert np.allclose((ends[0] - ends[1]) / (2 * h), exact[:, column], atol=1e-8)


@pytest.mark.parametrize("name", CATALOGUE)
def test_as_many_rows_are_released_as_mobility_says(name):
    case = cases.any_case(name)
    links = Links(describe(case.mech))
    mobility = case.mech.mobility()
    start = links.start(case.T[0], case.twist[0])
    assert start.status is pp.Status.OK
    assert start.freedoms == mobility.dof + mobility.passive
    assert len(links.rows) - len(start.redundant) == 6 * len(links.bodies) - start.freedoms
    kept = np.delete(
        jacobian(links.rows, links.bodies, start.placements, links.tree.scale), start.redundant, axis=0
    )
    assert np.linalg.matrix_rank(kept, tol=1e-6) == len(kept)


def test_what_is_released_on_the_paper_s_mechanism():
    """The two redundant constraints of the legs on one rod are rotations of those legs."""
    mech, (pose, twist, _) = lu_states()
    links = Links(describe(mech))
    for at, moving in zip(pose, twist, strict=True):
        released = [links.rows[i] for i in links.start(at, moving).redundant]
        assert len(released) == 2
        assert all(isinstance(row, Square) for row in released)
        assert all("leg 1" in row.name or "leg 3" in row.name for row in released)


def test_redundant_rows():
    rows = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    assert redundant(rows).tolist() in ([1], [2])
    assert redundant(rows[[0, 1, 3]]).tolist() == []


# --- accelerations ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
def test_paper_s_mechanism(engine):
    mech, states = lu_states()
    found = verify_states(mech, *states, engines=[engine])
    assert found.agrees, exceeding(found)
    assert found.comparisons[0].compared == 3
    for row in found.comparisons[0].rows:
        assert row.approximate == (row.quantity != "freedoms")
        assert row.tolerance == (engines.ENGINES[engine].approximate if row.approximate else found.tolerance)
    (note,) = found.comparisons[0].notes
    assert note.startswith({"exudyn": "Released", "mujoco": "Soft loops"}[engine])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["rod-lined", "passive", "fpf", "rpr", "3-rps"])
def test_legs_of_the_catalogue(name, engine):
    agrees_on(name, engine, every=9)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", CATALOGUE)
def test_all_legs_of_the_catalogue(name, engine):
    agrees_on(name, engine, every=3)


def agrees_on(name, engine, every):
    case = cases.any_case(name)
    states = (a[::every] for a in (case.T, case.twist, case.acceleration))
    found = verify_states(case.mech, *states, engines=[engine])
    assert found.comparisons[0].without_answer == {}
    assert found.agrees, exceeding(found)


def every_link(mech):
    return [(i, link) for i in range(len(mech.leg_names)) for link in ("cylinder", "piston")]


def without_masses(mech, links):
    """The mechanism with some of its legs' links without mass."""
    tables = mech.to_dict()
    for leg, link in links:
        del tables["legs"][leg][link]
    return pp.Mechanism.from_dict(tables)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("some", ["all", "one piston"])
@pytest.mark.parametrize("name", ["6-sps", "6-ups", "rod-lined"])
def test_legs_without_mass(name, some, engine):
    """Also those that spin freely, which nothing but rounding rotations about their axes."""
    case = cases.case(name)
    mech = without_masses(case.mech, every_link(case.mech) if some == "all" else [(0, "piston")])
    found = verify_states(mech, *(a[::9] for a in (case.T, case.twist, case.acceleration)), engines=[engine])
    assert found.agrees, (found.comparisons[0].without_answer, exceeding(found))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("size", [1e-2, 1e2])
def test_of_any_size(size, engine):
    """Engines have smallest numbers of their own; a platform of 12 mg and 6 mm is as good as one of 12 kg."""
    tables = without_masses(cases.case("stewart-gough").mech, [(0, "cylinder"), (0, "piston")]).to_dict()
    del tables["published"]
    tables["home"]["position"][2] *= size
    for leg in tables["legs"]:
        del leg["stroke"], leg["radius"]
        for joint in (leg["base"], leg["platform"]):
            joint["point"]["radius"] *= size
    for body in (
        tables["platform"],
        *(leg[k] for leg in tables["legs"] for k in ("cylinder", "piston") if k in leg),
    ):
        body["mass"] *= size**3
        body["center"] = (size * np.array(body["center"])).tolist()
        body["inertia"] = (size**5 * np.array(body["inertia"])).tolist()
    mech = pp.Mechanism.from_dict(tables)
    motion = np.array([[size, size, size, 1.0, 1.0, 1.0]])
    found = verify_states(mech, mech.home[None], 0.1 * motion, motion, engines=[engine])
    assert found.agrees, (found.comparisons[0].without_answer, exceeding(found))


@pytest.mark.parametrize("engine", ENGINES)
def test_at_rest_without_gravity(engine):
    """The load alone tells what is small."""
    tables = cases.case("stewart-gough").mech.to_dict()
    tables["dynamics"] = {"gravity": [0.0, 0.0, 0.0]}
    tables["units"]["acceleration"] = "m/s^2"
    mech, rest = pp.Mechanism.from_dict(tables), np.zeros((1, 6))
    assert verify_states(mech, mech.home[None], rest, rest, engines=[engine]).agrees


def test_a_system_that_exudyn_finds_singular_has_no_answer(monkeypatch, capfd):
    """It goes on with accelerations of zero and a warning."""
    case = cases.case("6-sps")
    mech = without_masses(case.mech, every_link(case.mech))
    monkeypatch.setattr(hard, "inertial", lambda tree, body: (body.mass, body.inertia))
    states = (a[:1] for a in (case.T, case.twist, case.acceleration))
    found = verify_states(mech, *states, engines=["exudyn"]).comparisons[0]
    assert found.without_answer == {"Exudyn: SINGULAR": 1}
    assert capfd.readouterr() == ("", "")


def quoted_gaps(found):
    """Numbers of the notes on MuJoCo's soft loops: with its defaults, and with the stiffest."""
    (note,) = found.comparisons[0].notes
    match = re.search(r"off by up to (\S+) of .* default .* by (\S+) with the stiffest", note)
    return tuple(map(float, match.groups()))


@pytest.mark.parametrize("name", [LU, "ups-hexapod"])
def test_mujoco_s_own_loops_are_far_off(name):
    """The default is worse than the stiff, the stiff worse than what is compared, and the report says so."""
    if name == LU:
        mech, states = lu_states([1.3])
    else:
        mech = pp.load(name)
        states = mech.home[None], np.full((1, 6), 0.3), np.full((1, 6), 0.5)
    found = verify_states(mech, *states, engines=["mujoco"])
    default, stiff = quoted_gaps(found)
    assert default > 10 * stiff > 1e-4
    assert default > 0.02
    assert found.agrees
    pose, twist, acceleration = (a[0] for a in states)
    twin = soft.Twin(describe(mech))
    own, gravity = mech.geometry["load"], np.linalg.norm(mech.geometry["gravity"])
    forces = mech.inverse_dynamics(*states).forces[0]
    state = (twin.links.start(pose, twist), twist, np.array([*own["force"], *own["torque"]]), forces)
    size = np.linalg.norm(acceleration[:3]) + gravity
    for model, gap in ((twin.soft["default"], default), (twin.soft["stiff"], stiff)):
        platform = next(model.passes(*state))[twin.numbers[PLATFORM], :3]
        assert np.linalg.norm(platform - acceleration[:3]) / size == pytest.approx(gap, rel=0.06)


def nearly_dependent(tilt):
    """Two UPU legs with parallel axes, at an angle: each forbids rotations about its direction."""
    tables = pp.load(cases.DATA / "stewart-gough.toml").to_dict()
    tables["legs"] = tables["legs"][:4]
    joint = {"joint": "U", "axis": [1.0, 0.0, 0.0]}
    for leg, x, y in zip(tables["legs"], (-400.0, 400.0), (0.0, 600.0 * tilt), strict=False):
        leg["base"] = joint | {"point": [x, y, 0.0]}
        leg["platform"] = joint | {"point": [x, 0.0, 0.0]}
    del tables["published"]
    return pp.Mechanism.from_dict(tables)


@pytest.mark.parametrize(("tilt", "converges"), [(0.1, True), (1e-3, False)])
def test_passes_converge_or_say_that_they_do_not(tilt, converges):
    """Constraints that depend on one another, but for a little, converge slowly."""
    mech = nearly_dependent(tilt)
    rest = np.zeros((1, 6))
    found = verify_states(mech, mech.home[None], rest, rest, engines=["mujoco"])
    assert found.agrees == converges
    assert found.comparisons[0].without_answer == ({} if converges else {"MuJoCo: NOT_CONVERGED": 1})
    assert len(found.comparisons[0].notes) == converges


def test_as_many_passes_as_it_takes(monkeypatch):
    mech, states = lu_states([1.3])
    monkeypatch.setattr(soft, "PASSES", 3)
    found = verify_states(mech, *states, engines=["mujoco"]).comparisons[0]
    assert found.without_answer == {"MuJoCo: NOT_CONVERGED": 1}


@pytest.mark.parametrize("engine", ENGINES)
def test_states_without_answer(engine):
    mech, (pose, twist, acceleration) = lu_states()
    pose[0, 1, 3] += 0.01  # off the constraints
    twist[1] += 1.0  # a motion that breaks them
    acceleration[2, 0] = np.nan
    found = verify_states(mech, pose, twist, acceleration, engines=[engine]).comparisons[0]
    title = engines.ENGINES[engine].title
    assert (found.compared, found.agrees) == (0, False)
    assert {f"Polypod: {s}" for s in ("OFF_CONSTRAINT", "INVALID_INPUT")} <= found.without_answer.keys()
    assert any(key.startswith(title) for key in found.without_answer)


# --- faults put in on purpose -------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
def test_wrong_forces_are_found(monkeypatch, engine):
    mech, states = lu_states([1.3])
    right = pp.Mechanism.inverse_dynamics
    wrong = lambda *args: replace((a := right(*args)), forces=a.forces * (1 + 1e-6))  # noqa: E731
    monkeypatch.setattr(pp.Mechanism, "inverse_dynamics", wrong)
    assert "platform_acceleration" in exceeding(verify_states(mech, *states, engines=[engine]))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    "fault",
    [turn_gravity, forget_efficiency, forget_damping, mirror_center, rod_center],
    ids=lambda f: f.__name__,
)
def test_a_fault_in_the_product_is_found(monkeypatch, fault, engine):
    """Polypod computes with other numbers than the twin."""
    case = cases.case("rod-lined")
    tables = case.mech.to_dict()
    fault(tables)
    wrong = pp.Mechanism.from_dict(tables)
    monkeypatch.setattr(comparison, "describe", lambda mech: describe(case.mech))
    states = (case.T[:2], case.twist[:2], case.acceleration[:2])
    assert "platform_acceleration" in exceeding(verify_states(wrong, *states, engines=[engine]))


# --- motion -------------------------------------------------------------------------------------------------


def short_motion(mech, end=0.5):
    return pp.load_motion(LU, mech).sample(np.linspace(0.0, end, 51))


def test_the_motion_comes_out_at_the_integrator_s_order():
    mech = pp.load(LU)
    found = integrate(mech, short_motion(mech), piece=0.25, steps=(10, 20, 40))
    assert found.agrees
    assert (found.pieces, found.completed) == (2, 2)
    assert [step.order is None for step in found.steps] == [True, False, False]
    assert 1.9 < found.steps[2].order < 2.1
    assert found.rest.lengths < 0.01 * found.steps[2].errors.lengths
    assert found.closure < 1e-8
    assert len(found.released) == 2
    json.dumps(found.facts(), allow_nan=False)


@pytest.mark.slow
def test_all_of_the_example_motion_comes_out():
    mech = pp.load(LU)
    found = integrate(mech, pp.load_motion(LU, mech))
    assert found.agrees
    assert found.pieces == 16


@pytest.mark.parametrize("fault", ["forces", "time"])
def test_a_motion_under_wrong_forces_does_not_come_out(monkeypatch, fault):
    mech = pp.load(LU)
    right = pp.Mechanism.inverse_dynamics

    def wrong(*args):
        answer = right(*args)
        late = np.roll(answer.forces, 1, axis=0)
        late[0] = late[1]
        return replace(answer, forces=answer.forces * (1 + 1e-5) if fault == "forces" else late)

    monkeypatch.setattr(pp.Mechanism, "inverse_dynamics", wrong)
    found = integrate(mech, short_motion(mech, 0.25), steps=(10, 20, 40))
    assert (found.completed, found.agrees) == (1, False)


def test_integrate_wrong_arguments(monkeypatch):
    mech = pp.load(LU)
    with pytest.raises(pp.PolypodError, match="piece"):
        integrate(mech, short_motion(mech), piece=0.0)
    for steps in ((10,), (10, 30), (4, 8)):
        with pytest.raises(pp.PolypodError, match="steps"):
            integrate(mech, short_motion(mech), steps=steps)
    monkeypatch.setattr(engines, "find_spec", lambda module: None)
    with pytest.raises(pp.PolypodError, match=r"Exudyn is not installed.*polypod\[verify\]"):
        integrate(mech, short_motion(mech))


# --- the command --------------------------------------------------------------------------------------------


def test_command(run):
    args = ("--engine", "exudyn", "--engine", "mujoco", "--samples", "3")
    status, out, err = run("verify", LU, LU, *args)
    assert (status, err) == (0, "")
    for words in (
        "Errors against Exudyn",
        "Errors against MuJoCo",
        "≈ platform, accel.",
        "Soft loops",
        "Released",
    ):
        assert words in out


def test_command_with_integration(run, tmp_path):
    motion = tmp_path / "short.csv"
    path = short_motion(pp.load(LU), 0.1)
    columns = {"time [s]": path.time}
    columns |= {f"{n} [{'m' if n in 'xyz' else 'rad'}]": a for n, a in path.coordinates.items()}
    lines = [
        ",".join(columns),
        *(",".join(map(repr, row)) for row in np.column_stack([*columns.values()]).tolist()),
    ]
    motion.write_text("\n".join(lines))
    args = ("--engine", "exudyn", "--integrate", "--samples", "11")
    status, out, _ = run("verify", LU, motion, *args)
    assert status == 0
    assert "The motion under the forces, by step" in out
    assert "left at step zero" in out
    status, out, _ = run("verify", LU, motion, *args, "--json")
    assert json.loads(out)["integration"]["agrees"]


def test_samples_are_for_the_comparison(run, monkeypatch):
    """All of the motion is integrated."""
    seen = []
    right = pp.verify.integrate

    def spy(mech, motion, **options):
        seen.append(len(motion.time))
        return right(mech, motion.sample([0.0, 0.05, 0.1]), **options)

    monkeypatch.setattr(pp.verify, "integrate", spy)
    run("verify", LU, LU, "--engine", "exudyn", "--integrate", "--samples", "2")
    assert seen == [len(pp.load_motion(LU, pp.load(LU)).time)]


@pytest.mark.parametrize(("engine", "title"), [("exudyn", "Exudyn"), ("mujoco", "MuJoCo")])
def test_command_without_the_engine(run, monkeypatch, engine, title):
    monkeypatch.setattr(engines, "find_spec", lambda module: None)
    status, out, err = run("verify", LU, LU, "--engine", engine)
    assert (status, out) == (2, "")
    install = f"pip install {engine}, or all engines with: pip install polypod[verify]"
    assert err == f"polypod: {title} is not installed; install it with: {install}\n"
