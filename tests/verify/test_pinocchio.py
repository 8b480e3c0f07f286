"""Polypod against Pinocchio; and that a wrong sign or frame in Polypod, made on purpose, does not pass."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import polypod as pp
from polypod.multibody.placement import BASE, PLATFORM
from polypod.multibody.tree import depth_first, describe, joint_values, release
from polypod.vectors import inverse
from polypod.verify import comparison, engines, quantity_errors, verify, verify_states
from polypod.verify.verdict import as_markdown

pin = pytest.importorskip("pinocchio")

from polypod.verify.pinocchio import Tree, Twin  # noqa: E402
from support import cases as cases  # noqa: E402
from support.verified import (  # noqa: E402
    exceeding,
    forget_damping,
    forget_efficiency,
    mirror_center,
    rod_center,
    turn_gravity,
)

COLUMNS = 120
LU = "lu-3spu-2rpu-r"
PUBLISHED = (LU, "ups-hexapod")
CATALOGUE = (*cases.DRAWN, *cases.FILES)
SEED = 20240611
NEAR_SINGULAR = (
    0.02  # least singular value of the random poses: forces there are at most some ten times the usual
)
ROUNDING = 1e-11  # of the greatest value, where forces are no more than some hundred times the load


def draw_states(name, size):
    """Random states inside all limits, with the loads on them."""
    mech = pp.load(name)
    rng = np.random.default_rng([SEED, *name.encode()])
    if name == LU:
        ranges = {"alpha": 0.7, "p": 0.25, "h": 0.1, "beta": 0.8, "gamma": 1.2}
        middle = {"alpha": 0.0, "p": 0.0, "h": 0.72, "beta": 0.0, "gamma": 0.0}
    else:
        ranges = dict.fromkeys("xyz", 0.6) | dict.fromkeys(("rx", "ry", "rz"), 0.5)
        middle = mech.coordinates(mech.home, "pose")
    found = []
    while sum(len(pose) for pose, *_ in found) < size:
        q = {n: middle[n] + r * rng.uniform(-1, 1, 4 * size) for n, r in ranges.items()}
        rates, second = ({n: r * rng.normal(size=4 * size) for n, r in ranges.items()} for _ in range(2))
        state = mech.state(q, rates, second)
        usable = (state.status == pp.Status.OK) & mech.limits(state.pose).within
        usable &= mech.conditioning(state.pose).sigma_min > NEAR_SINGULAR
        found.append((state.pose[usable], state.twist[usable], state.acceleration[usable]))
    states = [np.concatenate(parts)[:size] for parts in zip(*found, strict=True)]
    wrench = rng.normal(size=(size, 6)) * ([300.0] * 3 + [60.0] * 3)
    return mech, (*states, wrench)


def rows(found):
    return {row.quantity: row for row in found.comparisons[0].rows}


# --- agreement ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", ["base", "platform"])
@pytest.mark.parametrize("name", PUBLISHED)
def test_random_states(name, axes):
    mech, (*motion, wrench) = draw_states(name, 25)
    found = verify_states(mech, *motion, wrench, axes)
    assert found.agrees
    assert {row.quantity for row in found.comparisons[0].rows if row.relative_max > ROUNDING} == set()


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_a_thousand_random_states(name):
    mech, states = draw_states(name, 1000)
    found = verify_states(mech, *states)
    assert found.comparisons[0].compared == 1000
    assert found.agrees


@pytest.mark.parametrize("name", ["rod-lined", "rod-of-one", "passive", "rpr", "upf", "fpf", "3-rps"])
def test_legs_of_the_catalogue(name):
    agrees_on(name, every=4)


@pytest.mark.slow
@pytest.mark.parametrize("name", CATALOGUE)
def test_all_legs_of_the_catalogue(name):
    agrees_on(name, every=1)


def agrees_on(name, every):
    """Asymmetric bodies, efficiency, damping, poses at home, near it, anywhere."""
    case = cases.any_case(name)
    states = (a[::every] for a in (case.T, case.twist, case.acceleration))
    found = verify_states(case.mech, *states)
    assert found.comparisons[0].without_answer == {}
    assert found.agrees, exceeding(found)
    expected = {"forces", "lengths", "leg_eps", "piston_acceleration", "cylinder_acceleration", "freedoms"}
    expected |= {"constraint_force", "constraint_torque"} if case.mech.dof < 6 else set()
    expected |= {"rod_eps"} if case.mech.rod_names else set()
    assert expected <= rows(found).keys()


RODS = (
    ["rRPU", "UPS", "rRPS", "SPS", "UPS-"],
    ["rRPS", "rRPS", "UPS", "SPS", "UPS", "SPU-"],
    ["rRPU", "rRPU", "UPS", "SPS-"],
    ["rRPR", "UPS", "SPS", "UPS"],
)


@pytest.mark.parametrize("kinds", RODS, ids="+".join)
def test_legs_on_one_rod_in_planes_at_an_angle(kinds):
    rng = np.random.default_rng(0)
    tables = cases.draw("rod", kinds, rng)
    spec = cases.o.read(tables)
    pose = cases.sample(spec, rng)
    q = rng.normal(size=(2, len(pose[1]), 6))
    motion = cases.o.feasible_motion(spec, pose, q[0], q[1])
    found = verify_states(pp.Mechanism.from_dict(tables), cases.matrix(pose), *motion)
    assert found.agrees, exceeding(found)


def test_the_example_motion():
    mech = pp.load(LU)
    motion = pp.load_motion(LU, mech).sample(np.linspace(0.0, 8.0, 9))
    found = verify(mech, motion)
    assert found.agrees
    assert (found.mechanism, found.motion) == (LU, LU)
    others = {"platform_acceleration", "platform_eps", "idle_torques"}
    assert rows(found).keys() == quantity_errors.QUANTITIES.keys() - others
    assert found.comparisons[0].version == pin.__version__
    assert 0.0 < found.comparisons[0].closure < 1e-13
    worst = rows(found)["forces"]
    assert worst.time == motion.time[worst.index]
    assert worst.part in mech.leg_names
    assert 0.0 < worst.rms < worst.max < 1e-7
    assert worst.max / worst.greatest <= worst.relative_max < 1e-12


def test_rest_and_no_load_are_no_division_by_zero():
    tables = pp.load(cases.DATA / "stewart-gough.toml").to_dict()
    tables |= {"load": {"force": [0, 0, 0]}, "dynamics": {"gravity": [0, 0, 0]}}
    tables["units"]["acceleration"] = "m/s^2"
    mech = pp.Mechanism.from_dict(tables)
    found = verify_states(mech, mech.home[None], np.zeros((1, 6)), np.zeros((1, 6)))
    assert found.agrees
    assert rows(found)["forces"].relative_max == 0.0


# --- the tree -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [LU, "rod-lined", "passive", "fpf", "rpf"])
def test_start_closes_all_loops(name):
    case = cases.any_case("lu") if name == LU else cases.case(name)
    tree = describe(case.mech)
    for description in (tree, release(tree)):
        model = Tree(description)
        for pose in case.T[::5]:
            placements = tree.start(pose)
            q = model.start(placements)
            _, _, worst, steps = model.close(q)
            assert worst < 1e-13
            assert steps <= 2
            for body, frame in model.placements().items():
                assert body == BASE or np.allclose(frame, placements[body], atol=1e-12)


def test_joints_are_solved_from_a_rough_start():
    mech, (pose, *_) = draw_states(LU, 5)
    tree = describe(mech)
    model = Tree(tree)
    rng = np.random.default_rng(SEED)
    for at in pose:
        exact = model.start(tree.start(at))
        push = 0.05 * rng.normal(size=model.model.nv)
        push[model.platform] = 0.0
        q, _, worst, steps = model.close(pin.integrate(model.model, exact, push))
        assert worst <= 1e-12
        assert 2 < steps < 10
        assert np.allclose(q, exact, atol=1e-12)


def test_bodies_are_in_depth_first_order():
    bodies = describe(pp.load(LU)).bodies
    names = [body.name for body in bodies]
    assert names[:5] == ["rod L", *(f"leg {leg} {part}" for leg in "13" for part in ("cylinder", "piston"))]
    assert names[-1] == PLATFORM
    assert depth_first(reversed(bodies))[0].name == PLATFORM


def test_a_model_in_another_order_is_refused():
    tree = describe(pp.load(LU))
    bodies = sorted(tree.bodies, key=lambda body: body.name.endswith("piston"))
    with pytest.raises(RuntimeError, match="depth-first"):
        Tree(comparison.Multibody(**{**vars(tree), "bodies": tuple(bodies)}))


@pytest.mark.parametrize("name", [LU, "rod-lined"])
def test_closure_jacobian_is_the_derivative_of_the_residual(name):
    case = cases.any_case("lu") if name == LU else cases.case(name)
    tree = describe(case.mech)
    model = Tree(tree)
    q, jacobian, _, _ = model.close(model.start(tree.start(case.T[3])))
    h = 1e-6
    for i in range(model.model.nv):
        move = np.zeros(model.model.nv)
        move[i] = h * model.units[i]
        ends = []
        for side in (1, -1):
            pin.forwardKinematics(model.model, model.data, pin.integrate(model.model, q, side * move))
            pin.updateFramePlacements(model.model, model.data)
            ends.append(model.residual())
        assert np.allclose((ends[0] - ends[1]) / (2 * h), jacobian[:, i], atol=1e-8)


def test_joint_values_come_back():
    tree = describe(cases.any_case("6-ups").mech)
    body = tree.bodies[0]
    rng = np.random.default_rng(SEED)
    first, second = rng.uniform(-1, 1, 2)
    turned = np.eye(4)
    turned[:3, :3] = pin.AngleAxis(first, body.freedoms[0].axis).matrix() @ (
        pin.AngleAxis(second, body.freedoms[1].axis).matrix()
    )
    assert np.allclose(joint_values(body, body.zero, body.zero @ turned), [first, second])
    assert np.allclose(inverse(body.zero) @ body.zero, np.eye(4))


# --- outcomes -----------------------------------------------------------------------------------------------


def test_states_without_answer_are_no_agreement():
    mech, (pose, twist, acceleration, _) = draw_states(LU, 5)
    pose[0, 1, 3] += 0.01  # off the constraints
    twist[1] += 1.0  # a motion that breaks them
    acceleration[2, 0] = np.nan
    found = verify_states(mech, pose, twist, acceleration).comparisons[0]
    assert (found.states, found.compared, found.agrees) == (5, 2, False)
    assert found.without_answer == {
        "Polypod: OFF_CONSTRAINT": 2,
        "Polypod: INVALID_INPUT": 1,
        "Pinocchio: NOT_CONVERGED": 1,
        "Pinocchio: OFF_CONSTRAINT": 1,
        "Pinocchio: INVALID_INPUT": 1,
    }
    assert {row.index for row in found.rows} <= {3, 4}


def test_nothing_compared_is_no_agreement():
    mech = pp.load(LU)
    found = verify_states(mech, np.full((2, 4, 4), np.nan), np.zeros((2, 6)), np.zeros((2, 6)))
    assert not found.agrees
    assert found.comparisons[0].rows == ()
    json.dumps(found.facts(), allow_nan=False)
    assert "0 of 2 states compared" in as_markdown(found.facts())


def test_legs_without_length_or_along_their_axis_have_no_answer():
    tables = pp.load(cases.DATA / "stewart-gough.toml").to_dict()
    for end in ("base", "platform"):
        tables["legs"][0][end]["point"] = [250, 0, 0]
    tables["legs"][0]["base"]["axis"] = [1, 0, 0]
    mech = pp.Mechanism.from_dict(tables)
    pose = np.tile(np.eye(4), (2, 1, 1))
    pose[1, 0, 3] = 0.5
    found = verify_states(mech, pose, np.zeros((2, 6)), np.zeros((2, 6))).comparisons[0]
    assert found.without_answer == {"Polypod: SINGULAR": 2, "Pinocchio: SINGULAR": 2}


def test_singular_poses_have_no_forces():
    mech, (pose, *_) = draw_states("ups-hexapod", 1)
    pose[0] = np.eye(4)
    pose[0, 2, 3] = 2.0
    pose[0, :2, :2] = [[0.0, -1.0], [1.0, 0.0]]  # a quarter turn: all legs in one linear complex
    answer, status = Twin(describe(mech)).answer(pose[0], np.zeros(6), np.zeros(6), np.zeros(6))
    assert status is pp.Status.SINGULAR
    assert "constraint_force" not in answer
    assert pp.Status(mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6)).status[0]) is pp.Status.SINGULAR


def test_wrong_arguments():
    mech = pp.load(LU)
    state = (mech.home[None], np.zeros((1, 6)), np.zeros((1, 6)))
    with pytest.raises(pp.UnknownNameError, match='engine "pinochio"; did you mean "pinocchio"'):
        verify_states(mech, *state, engines=["pinochio"])
    with pytest.raises(pp.UnknownNameError, match="wrench_axes"):
        verify_states(mech, *state, np.zeros(6), "tool")
    with pytest.raises(pp.ShapeError, match=r"pose has the shape \(4, 4\); needs \(N, 4, 4\)"):
        verify_states(mech, mech.home, np.zeros(6), np.zeros(6))
    with pytest.raises(pp.ShapeError, match="twist"):
        verify_states(mech, mech.home[None], np.zeros((2, 6)), np.zeros((1, 6)))
    with pytest.raises(pp.ShapeError, match="wrench"):
        verify_states(mech, *state, np.zeros((2, 6)))
    for tolerance in (0.0, np.nan):
        with pytest.raises(pp.PolypodError, match="tolerance"):
            verify_states(mech, *state, tolerance=tolerance)
    with pytest.raises(pp.PolypodError, match="engines"):
        verify_states(mech, *state, engines=[])


def test_progress():
    mech, (*motion, wrench) = draw_states(LU, 3)
    seen = []
    verify_states(mech, *motion, wrench, progress=lambda done, of: seen.append((done, of)))
    assert seen == [(1, 3), (2, 3), (3, 3)]


# --- faults put in on purpose -------------------------------------------------------------------------------

OFF = {
    # name → fault in a method's answer, and what must exceed the tolerance for it
    "sign of the rates": ("kinematics", lambda a, R: replace(a, rates=-a.rates), {"rates"}),
    "sign of the legs' spin": (
        "kinematics",
        lambda a, R: replace(a, leg_omega=a.leg_omega - 2 * a.leg_spin[..., None] * a.directions),
        {"leg_omega"},
    ),
    "spin rate left out": (
        "kinematics",
        lambda a, R: replace(a, leg_eps=a.leg_eps - a.leg_spin_rate[..., None] * a.directions),
        {"leg_eps"},
    ),
    "centripetal term with the wrong sign": (
        "kinematics",
        lambda a, R: replace(
            a,
            accelerations=a.accelerations
            - 2 * a.lengths * np.sum(np.cross(a.leg_omega, a.directions) ** 2, axis=-1),
        ),
        {"accelerations"},
    ),
    "pistons in platform axes": (
        "kinematics",
        lambda a, R: replace(a, piston_acceleration=np.einsum("nji,nlj->nli", R, a.piston_acceleration)),
        {"piston_acceleration"},
    ),
    "rod rotating the other way": (
        "kinematics",
        lambda a, R: replace(a, rod_omega=-a.rod_omega, rod_eps=-a.rod_eps),
        {"rod_omega", "rod_eps"},
    ),
    "two legs swapped": (
        "inverse_dynamics",
        lambda a, R: replace(a, forces=a.forces[:, [1, 0, 2, 3, 4]]),
        {"forces"},
    ),
    "sign of the constraint force": (
        "inverse_dynamics",
        lambda a, R: replace(a, constraint=-a.constraint),
        {"constraint_force", "constraint_torque"},
    ),
    "a billionth of the forces": (
        "inverse_dynamics",
        lambda a, R: replace(a, forces=a.forces * (1 + 3e-9)),
        {"forces"},
    ),
}


@pytest.mark.parametrize("fault", OFF)
def test_a_fault_in_an_answer_is_found(monkeypatch, fault):
    method, spoil, expected = OFF[fault]
    mech, (pose, *motion, wrench) = draw_states(LU, 6)
    right = getattr(pp.Mechanism, method)
    wrong = lambda *args: spoil(right(*args), pose[:, :3, :3])  # noqa: E731
    monkeypatch.setattr(pp.Mechanism, method, wrong)
    found = verify_states(mech, pose, *motion, wrench)
    assert not found.agrees
    assert exceeding(found) == expected


def swap_load_axes(tables):
    tables["load"]["axes"] = {"base": "platform", "platform": "base"}[tables["load"]["axes"]]


def flip_axis(tables):
    """Fault: equal constraint and lengths, but the leg's frame is rotated by half a turn."""
    leg = next(leg for leg in tables["legs"] if leg["base"]["joint"] == "S")
    leg["platform"]["axis"] = [-a for a in leg["platform"]["axis"]]


def turn_platform_inertia(tables):
    """As if the inertia were given in other axes."""
    inertia = np.array(tables["platform"]["inertia"])
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    tables["platform"]["inertia"] = (turn @ inertia @ turn.T).tolist()


def transpose_leg_axes(tables):
    """Leg axes in another order: (n×δ, δ, n) instead of (n, δ, n×δ)."""
    swap = np.eye(3)[[2, 1, 0]]
    link = tables["legs"][0]["cylinder"]
    link["inertia"] = (swap @ np.array(link["inertia"]) @ swap.T).tolist()


def move_joint(tables):
    """By a ten-millionth of its distance."""
    leg = next(leg for leg in tables["legs"] if leg["platform"]["joint"] == "S")
    leg["platform"]["point"] = [(1 + 1e-7) * p for p in leg["platform"]["point"]]


FAULTS = {
    turn_gravity: {"forces"},
    forget_efficiency: {"forces"},
    forget_damping: {"forces"},
    swap_load_axes: {"forces"},
    turn_platform_inertia: {"forces"},
    transpose_leg_axes: {"forces"},
    mirror_center: {"forces", "piston_acceleration", "piston_velocity"},
    rod_center: {"forces"},
    flip_axis: {"forces", "piston_acceleration", "cylinder_velocity"},
    move_joint: {"lengths", "rates", "forces"},
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_a_fault_in_the_product_is_found(monkeypatch, fault):
    """Polypod computes with other numbers than the twin, as if it took them with a wrong sign or axes."""
    case = cases.case("rod-lined")
    tables = case.mech.to_dict()
    fault(tables)
    wrong = pp.Mechanism.from_dict(tables)
    states = (case.T[:6], case.twist[:6], case.acceleration[:6])
    assert verify_states(case.mech, *states).agrees
    monkeypatch.setattr(comparison, "describe", lambda mech: describe(case.mech))
    found = verify_states(wrong, *states)
    assert not found.agrees
    assert FAULTS[fault] <= exceeding(found)


# --- the command --------------------------------------------------------------------------------------------


def test_command(run):
    status, out, err = run("verify", LU, LU, "--samples", "5")
    assert (status, err) == (0, "")
    assert f"Errors against Pinocchio {pin.__version__}" in out
    assert "5 of 5 states compared; all errors within 1e-09" in out
    for quantity, (title, *_) in quantity_errors.QUANTITIES.items():
        assert (title in out) != quantity.startswith(("platform", "idle"))


def test_command_with_a_tolerance_that_rounding_exceeds(run):
    status, out, _ = run("verify", LU, LU, "--samples", "5", "--tolerance", "1e-18", "--engine", "pinocchio")
    assert status == 1
    assert "beyond 1e-18: " in out
    assert "exceeds" in out


def test_command_json(run):
    status, out, _ = run("verify", LU, LU, "--samples", "3", "--json")
    facts = json.loads(out)
    assert status == 0
    assert facts["agrees"]
    forces = next(row for row in facts["engines"][0]["quantities"] if row["quantity"] == "forces")
    assert forces["unit"] == "N"
    assert np.shape(forces["worst"]["pose"]) == (4, 4)


def test_command_without_the_engine(run, monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda module: None)
    status, out, err = run("verify", LU, LU)
    assert (status, out) == (2, "")
    assert err == (
        "polypod: Pinocchio is not installed; install it with: pip install pin, "
        "or all engines with: pip install polypod[verify]\n"
    )


def test_command_with_an_unknown_engine(run):
    status, _, err = run("verify", LU, LU, "--engine", "bullet")
    assert status == 2
    assert 'there is no engine "bullet"; valid: pinocchio' in err
