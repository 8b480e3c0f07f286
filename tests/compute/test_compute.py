"""Batches: the same bits alone and together, on any number of threads; instructions change rounding only."""

import os
import signal
import subprocess
import sys
from time import sleep

import numpy as np
import pytest

import polypod as pp
from polypod import compute
from polypod.answers.answer import Answer
from support import DATA

NAMES = ["lu-3spu-2rpu-r", DATA / "stewart-gough.toml", DATA / "3-rps.toml"]


@pytest.fixture(autouse=True)
def _as_it_was():
    yield
    compute.set_threads(0)
    compute.set_instructions(compute.instruction_sets()[-1])


def load(name):
    """The mechanism with limits of every kind that it may have."""
    content = pp.load(name).to_dict() | {"limits": {"clearance": 4.0, "sigma_min": 0.02}}
    content["units"]["force"] = "N"
    for leg in content["legs"]:
        leg |= {"radius": 10.0, "force": {"min": -2e3, "max": 2e3}}
    return pp.Mechanism.from_dict(content)


def coordinates(mech):
    """A set and the numbers of it that are given."""
    set = "natural" if "natural" in mech.coordinate_sets else "pose"
    return set, mech.coordinate_sets[set] if mech.dof > 3 else ("z", "rx", "ry")


def inputs(mech, count):
    """Random states about home, some spoilt in one of several ways, a number for each leg, a wrench."""
    rng = np.random.default_rng(count)
    set, names = coordinates(mech)
    home = mech.coordinates(mech.home, set)
    q = {n: home[n] + rng.uniform(-0.05, 0.05, count) for n in names}
    rates, second = ({n: rng.normal(size=count) for n in names} for _ in range(2))
    state = mech.state(q, rates, second)
    assert np.mean(state.status == pp.Status.OK) > 0.9
    pose, twist, acceleration = (np.array(a) for a in (state.pose, state.twist, state.acceleration))
    pose[3::11, 0, 0] = np.nan
    pose[4::11, 0, 1] += 0.1
    twist[5::11, 2] = np.inf
    acceleration[6::11] += 1.0
    return pose, twist, acceleration, rng.normal(size=(count, mech.n_legs)), rng.normal(size=(count, 6))


def named(found):
    """Its arrays with their names, or with numbers where they have none."""
    return found.arrays.items() if isinstance(found, Answer) else enumerate(found)


def answers(mech, pose, twist, acceleration, of_legs, wrench):
    """Arrays of every operation that works in blocks, by name."""
    set, names = coordinates(mech)
    found = mech.coordinates(pose, set)
    q, rates, second = (
        {name: a[name] if a is found else a[:, k] for k, name in enumerate(names)}
        for a in (found, twist, acceleration)
    )
    state = mech.state(q, rates, second)
    parts = {
        "coordinates": tuple(found.values()),
        "state": state,
        "all coordinates": tuple(state.coordinates.values()),
        "inverse kinematics": mech.inverse_kinematics(pose),
        "Jacobian": (mech.jacobian(pose),),
        "Hessian": (mech.hessian(pose),),
        "kinematics": mech.kinematics(pose, twist, acceleration),
        "twist": mech.platform_twist(pose, of_legs),
        "acceleration": mech.platform_acceleration(pose, twist, of_legs),
        "inverse dynamics": mech.inverse_dynamics(pose, twist, acceleration),
        "under load": mech.inverse_dynamics(pose, twist, acceleration, wrench, "platform"),
        "forward dynamics": mech.forward_dynamics(pose, twist, of_legs, wrench),
        "limits": mech.limits(pose, wrench, twist=twist, acceleration=acceleration),
        "reactions": mech.joint_reactions(pose, twist, acceleration, wrench, "platform"),
        "derivatives": mech.inverse_dynamics_derivatives(pose, twist, acceleration, wrench, "platform"),
        "regressor": mech.regressor(pose, twist, acceleration, wrench, "platform"),
        "power": mech.power(pose, twist, acceleration, wrench, "platform"),
        "determinant": mech.determinant(pose, twist),
    }
    if set == "natural":
        parts["coupled"] = mech.coupled_forces(pose, of_legs[:, :1])
    return {
        f"{name} {k}": array
        for name, arrays in parts.items()
        for k, array in named(arrays)
        if isinstance(array, np.ndarray) and array.shape[:1] == pose.shape[:1]
    }


def assert_same(found, expected):
    for name, array in expected.items():
        assert found[name].tobytes() == array.tobytes(), name


@pytest.mark.parametrize("name", NAMES)
def test_states_together_are_those_alone(name):
    mech = load(name)
    states = inputs(mech, 29)
    whole = answers(mech, *states)
    assert len(whole) > 30
    expected = {pp.Status.OK, pp.Status.INVALID_INPUT} | (
        {pp.Status.OFF_CONSTRAINT} if mech.dof < 6 else set()
    )
    assert expected <= {*whole["kinematics status"]}
    for size in (1, 2, 7, 8, 9, 17):
        parts = [answers(mech, *(a[i : i + size] for a in states)) for i in range(0, 29, size)]
        assert_same({name: np.concatenate([part[name] for part in parts]) for name in whole}, whole)


@pytest.mark.parametrize("name", NAMES)
def test_threads_change_no_bit(name):
    mech = load(name)
    states = inputs(mech, 9_003)
    compute.set_threads(1)
    alone = answers(mech, *states)
    for threads in (2, 3):
        compute.set_threads(threads)
        assert_same(answers(mech, *states), alone)


@pytest.mark.parametrize("name", NAMES)
def test_arrays_that_leave_the_caches_have_the_same_bits(name):
    mech, count = load(name), 90_003
    pose, twist, acceleration, *_ = inputs(mech, 1000)
    few = named(mech.kinematics(pose, twist, acceleration)), named(mech.inverse_kinematics(pose))
    pose, twist, acceleration = (np.resize(a, (count, *a.shape[1:])) for a in (pose, twist, acceleration))
    for threads in (1, 2):
        compute.set_threads(threads)
        many = named(mech.kinematics(pose, twist, acceleration)), named(mech.inverse_kinematics(pose))
        for expected, found in zip(few, many, strict=True):
            assert_same(dict(found), {k: np.resize(a, (count, *a.shape[1:])) for k, a in expected})


@pytest.mark.parametrize("name", NAMES)
def test_threads_change_no_bit_of_what_goes_state_by_state(name):
    mech = load(name)
    pose, twist, *_ = inputs(mech, 100)
    set, names = coordinates(mech)
    q = {name: column for name, column in mech.coordinates(pose, set).items() if name in names}
    lengths = mech.inverse_kinematics(pose).lengths

    def arrays():
        parts = {
            "equations of motion": mech.equations_of_motion(pose, twist),
            "singularity": mech.singularity(pose),
            "conditioning": mech.conditioning(pose),
            "nearest": mech.singularity_distance(pose[:9]),
            "continued": mech.state(q, continued=True),
            "forward": mech.forward_kinematics(lengths),
            "modes": mech.assembly_modes(lengths[:2]) if mech.dof == 3 else (),
        }
        return {
            f"{name} {k}": array
            for name, arrays in parts.items()
            for k, array in named(arrays)
            if isinstance(array, np.ndarray)
        }

    compute.set_threads(1)
    alone = arrays()
    assert len(alone) > 25
    for threads in (2, 3):
        compute.set_threads(threads)
        assert_same(arrays(), alone)


# Instruction sets without fused multiplication and addition.
UNFUSED = {"sse2", "scalar"}


def condition(mech, pose, twist):
    """Condition numbers of the Jacobian and of the mass matrix, and the determinant's terms over their sum.

    All in pure numbers: torques over the characteristic length.
    """
    jacobian = mech.conditioning(pose).condition
    mass = mech.equations_of_motion(pose, twist).mass
    scale = np.repeat([1.0, 1.0 / mech.characteristic_length], 3)
    known = np.isfinite(mass).all(axis=(1, 2))
    of_mass = np.full(len(pose), np.nan)
    of_mass[known] = np.linalg.cond(scale[:, None] * mass[known] * scale)
    rows = np.nan_to_num(mech.jacobian(pose)) * np.repeat([mech.characteristic_length, 1.0], 3)
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = np.prod(np.linalg.norm(rows, axis=-1), axis=-1) / np.abs(np.linalg.det(rows))
    return jacobian, of_mass, terms


@pytest.mark.parametrize("name", NAMES)
def test_instructions_change_rounding_only(name):
    """The largest difference of a state's numbers in one operation, against the largest of them."""
    mech = load(name)
    states = inputs(mech, 500)
    jacobian, mass, terms = condition(mech, states[0], states[1])
    found = {}
    for instructions in compute.instruction_sets():
        compute.set_instructions(instructions)
        found[instructions] = answers(mech, *states)
    fused = [result for instructions, result in found.items() if instructions not in UNFUSED]
    for result in fused[1:]:
        assert_same(result, fused[0])
    plain = [result for instructions, result in found.items() if instructions in UNFUSED]
    compared = 0
    for one, other in zip(plain, fused, strict=False):
        for name in {key.rsplit(" ", 1)[0] for key in one}:
            keys = [key for key in one if key.rsplit(" ", 1)[0] == name]
            numbers = [key for key in keys if one[key].dtype == np.float64 and one[key].size]
            a, b = (
                np.concatenate([r[k].reshape(len(jacobian), -1) for k in numbers], 1) for r in (one, other)
            )
            assert np.array_equal(np.isnan(a), np.isnan(b))
            for key in set(keys) - set(numbers) - {"limits binding"}:
                assert np.array_equal(one[key], other[key]), key
            known = ~np.isnan(a).all(axis=1)
            amplified = {"forward dynamics": jacobian * mass + 30, "determinant": 4 * terms}
            bound = 1e-15 * amplified.get(name, jacobian + 3)
            off = np.nanmax(np.abs(a - b)[known], axis=1) / np.nanmax(np.abs(a)[known], axis=1)
            where = known & np.isfinite(bound)
            assert where.any()
            assert np.all(off[where[known]] <= bound[where]), name
            compared += off.max() > 0.0
        # Of limits that are equally near rounding picks the one that binds.
        relative, binding = one["limits relative"], other["limits binding"]
        assert np.array_equal(binding < 0, one["limits binding"] < 0)
        nearest = np.take_along_axis(relative, np.maximum(binding, 0)[:, None], axis=1)
        off = nearest[:, 0] - relative.min(axis=1)
        assert np.all(np.abs(off[binding >= 0]) < 1e-12)
    assert not plain or compared > 5, "nothing was rounded otherwise: is anything fused?"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_threads_are_made_anew_in_a_forked_process():
    """Threads do not live on in a fork: who waited for them would wait for ever."""
    mech = pp.load("lu-3spu-2rpu-r")
    pose = np.broadcast_to(mech.home, (9000, 4, 4)).copy()
    compute.set_threads(2)
    lengths = mech.inverse_kinematics(pose).lengths
    child = os.fork()
    if child == 0:
        same = np.array_equal(mech.inverse_kinematics(pose).lengths, lengths)
        os._exit(0 if same else 1)
    for _ in range(300):
        done, outcome = os.waitpid(child, os.WNOHANG)
        if done:
            assert outcome == 0
            return
        sleep(0.1)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    pytest.fail("the forked process hangs")


def test_what_means_nothing_is_refused():
    for count in (-1, 1.5, True, "2"):
        with pytest.raises(pp.PolypodError, match="whole number"):
            compute.set_threads(count)
    with pytest.raises(pp.PolypodError, match="this processor has"):
        compute.set_instructions("abacus")
    for variable, value in (("POLYPOD_THREADS", "many"), ("POLYPOD_INSTRUCTIONS", "abacus")):
        with pytest.raises(pp.PolypodError, match=variable):
            compute.configure({variable: value})
    compute.configure({"POLYPOD_THREADS": "2", "POLYPOD_INSTRUCTIONS": compute.instruction_sets()[0]})


def test_the_environment_is_read_when_the_package_is_loaded():
    environment = {**os.environ, "POLYPOD_INSTRUCTIONS": "abacus"}
    done = subprocess.run(
        [sys.executable, "-c", "import polypod"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "POLYPOD_INSTRUCTIONS" in done.stderr
