"""Derivatives of inverse dynamics, regressor and base parameters, against differences and the oracle."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from support import oracle as o
from support.cases import SLOPE, any_case
from support.varied import STEP, coordinates_of, derivatives, each, forces, sample

DIFFERENCE = (
    1e-8  # eighth-order differences with the step below: 1e-16 / h of forces that change fast, and h⁸
)
SIX = ("stewart-gough", "6-sps", "6-ups")
PARTS = ("pose", "twist", "acceleration")
ORDERS = ("coordinates", "rates", "second_rates")


def close(actual, expected, tol=DIFFERENCE):
    """Arrays (N, ...) are equal within tol of each state's largest number."""
    assert actual.shape == expected.shape
    assert np.all(np.isfinite(actual))
    if actual.size:
        scale = np.abs(expected).max(axis=tuple(range(1, expected.ndim)), keepdims=True)
        error = np.abs(actual - expected) / np.maximum(scale, 1e-6 * max(scale.max(), 1.0))
        assert error.max() <= tol, f"off by {error.max():.2e} of {scale.max():.3g}"


def varied(at, part, direction):
    """The motion with one number of one part changed, as a function of the change."""

    def motion(t):
        step = np.zeros(6)
        step[direction] = t
        pose, twist, acceleration = at
        if part == "twist":
            return pose, twist + step, acceleration
        if part == "acceleration":
            return pose, twist, acceleration + step
        moved = pose.copy()
        moved[:, :3, :3] = o.turn(step[3:]) @ pose[:, :3, :3]
        moved[:, :3, 3] += step[:3]
        return moved, twist, acceleration

    return motion


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("name", SIX)
def test_by_motion_with_six_freedoms(name, part):
    mech, _, at = sample(name)
    found = getattr(derivatives(name), f"forces_by_{part}")
    for direction in range(6):
        motion = varied(at, part, direction)
        expected, _ = o.differentiate(lambda t, m=motion: forces(mech, *m(t)).forces, STEP)
        close(found[..., direction], expected)


@pytest.mark.parametrize("axes", ["base", "platform"])
def test_a_load_in_platform_axes_turns(axes):
    mech, _, at = sample("stewart-gough")
    wrench = np.array([300.0, -200.0, 500.0, 20.0, 30.0, -40.0])
    found = mech.inverse_dynamics_derivatives(*at, wrench, axes).forces_by_pose
    for direction in range(6):
        motion = varied(at, "pose", direction)
        expected, _ = o.differentiate(
            lambda t, m=motion: mech.inverse_dynamics(*m(t), wrench, axes).forces, STEP
        )
        close(found[..., direction], expected)


def moved(mech, series, guess, order, name, t):
    """The state with one coordinate, rate or second rate changed by t."""
    changed = [dict(s) for s in series]
    changed[order][name] = changed[order][name] + t
    state = mech.state(*changed, guess=guess)
    assert np.all(np.isfinite(state.acceleration))
    return state


@each
def test_by_coordinates(name):
    """Also where coordinates depend on others, and by the chain rule of all parts of the motion."""
    mech, names, set, series, guess = coordinates_of(name)
    state = moved(mech, series, guess, 0, names[0], 0.0)
    by = mech.inverse_dynamics_derivatives(state.pose, state.twist, state.acceleration, set=set)
    assert by.coordinates == names
    R = state.pose[:, :3, :3]
    for order, part in enumerate(ORDERS):
        for k, coordinate in enumerate(names):

            def numbers(t, order=order, coordinate=coordinate):
                s = moved(mech, series, guess, order, coordinate, t)
                d = forces(mech, s.pose, s.twist, s.acceleration)
                pose = np.concatenate([s.pose[:, :3, 3], (s.pose[:, :3, :3]).reshape(-1, 9)], axis=-1)
                return np.concatenate([pose, s.twist, s.acceleration, d.forces, d.constraint], axis=-1)

            step, _ = o.differentiate(numbers, STEP)
            turn = np.swapaxes(R, -1, -2)
            turning = o.vee(step[:, 3:12].reshape(-1, 3, 3) @ turn)
            motion = [np.concatenate([step[:, :3], turning], axis=-1), step[:, 12:18], step[:, 18:24]]
            for kind, at, n in (("forces", 24, mech.n_legs), ("constraint", 24 + mech.n_legs, 6 - mech.dof)):
                found = getattr(by, f"{kind}_by_{part}")[..., k]
                expected = step[:, at : at + n]
                size = np.abs(expected).max(initial=0.0)
                assert np.allclose(found, expected, rtol=0, atol=1e-7 * max(size, 1.0))
                chain = sum(
                    np.einsum("nij,nj->ni", getattr(by, f"{kind}_by_{p}"), x)
                    for p, x in zip(PARTS, motion, strict=True)
                )
                assert np.allclose(chain, found, rtol=0, atol=1e-7 * max(size, 1.0))


@pytest.mark.parametrize("set", ["paper", "natural", "tool", "pose"])
def test_by_every_coordinate_set(set):
    mech, pose = any_case("lu").mech, {"alpha": 0.2, "p": -0.2, "h": 0.65, "beta": 0.7, "gamma": 0.8}
    state = mech.state(pose, {"alpha": 0.3, "h": 0.1, "gamma": -0.4}, {"beta": 1.0, "p": 0.4})
    at = (state.pose[None], state.twist[None], state.acceleration[None])
    by = mech.inverse_dynamics_derivatives(*at, set=set)
    natural = mech.inverse_dynamics_derivatives(*at, set="natural")
    # Second rates enter through the acceleration alone.
    q = {k: mech.coordinates(at[0], set)[k] for k in by.coordinates}

    def acceleration(k):
        one = mech.state(q, {}, {k: 1.0}, guess=at[0], branch=+1)
        rest = mech.state(q, guess=at[0], branch=+1)
        return one.acceleration - rest.acceleration

    A = np.stack([acceleration(k) for k in by.coordinates], axis=-1)
    assert np.allclose(by.forces_by_acceleration @ A, by.forces_by_second_rates, atol=1e-8)
    # A step of one set is a step of the other: the same forces.
    rates = {k: np.zeros(1) for k in by.coordinates}
    second = dict(rates)
    h = 1e-6
    for k, name in enumerate(by.coordinates):
        plus, minus = (mech.state({**q, name: q[name] + s * h}, rates, second, guess=at[0]) for s in (1, -1))
        a, b = (mech.coordinates(s.pose, "natural") for s in (plus, minus))
        step = np.array([(a[n] - b[n])[0] / (2 * h) for n in natural.coordinates])
        rest = (at[0], np.zeros(6), np.zeros(6))
        here = mech.inverse_dynamics_derivatives(*rest, set=set).forces_by_coordinates[0, :, k]
        there = mech.inverse_dynamics_derivatives(*rest, set="natural").forces_by_coordinates[0] @ step
        assert np.allclose(here, there, atol=1e-5 * np.abs(here).max() + 1e-6)


@pytest.mark.parametrize("name", ["lu", "stewart-gough", "3-rps"])
def test_differences_come_closer_by_order_two(name):
    mech, names, set, series, guess = coordinates_of(name)
    state = moved(mech, series, guess, 0, names[0], 0.0)
    by = mech.inverse_dynamics_derivatives(state.pose, state.twist, state.acceleration, set=set)
    steps = 4e-3 / 2.0 ** np.arange(4)
    for order, part in enumerate(ORDERS[:2]):
        for k, coordinate in enumerate(names):

            def at(t, order=order, coordinate=coordinate):
                s = moved(mech, series, guess, order, coordinate, t)
                return forces(mech, s.pose, s.twist, s.acceleration).forces

            exact = getattr(by, f"forces_by_{part}")[..., k]
            errors = [np.linalg.norm((at(h) - at(-h)) / (2 * h) - exact) for h in steps]
            if (
                errors[-1] > 1e-9 * np.linalg.norm(exact) / steps[-1]
            ):  # else rounding: forces are quadratic in rates
                slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
                assert slope == pytest.approx(2, abs=SLOPE), (part, coordinate, errors)


# --- outcomes and calls -------------------------------------------------------------------------------------


def lu_at_rest():
    mech = any_case("lu").mech
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
    return mech, pose, np.zeros(6), np.zeros(6)


def test_no_answer_says_why():
    mech, pose, twist, acceleration = lu_at_rest()
    poses = np.stack([pose, np.full((4, 4), np.nan), pose, pose])
    twists = np.stack([twist, twist, np.array([0, 1.0, 0, 0, 0, 0]), twist])
    wrench = np.zeros((4, 6))
    wrench[3, 0] = np.inf
    for answer in (
        mech.inverse_dynamics_derivatives(poses, twists, acceleration, wrench),
        mech.regressor(poses, twists, acceleration, wrench),
    ):
        first, *others = (pp.Status(s) for s in answer.status)
        assert first.has_answer
        assert [s.name for s in others] == ["INVALID_INPUT", "OFF_CONSTRAINT", "INVALID_INPUT"]
        for field, array in answer.arrays.items():
            if array.ndim > 2:
                assert np.all(np.isfinite(array[0])), field
                assert np.all(np.isnan(array[1:])), field


def test_where_coordinates_fold_all_else_stands():
    """In the paper's coordinates at γ = 0, where mechanism and natural coordinates are regular."""
    mech = any_case("lu").mech
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.0})
    rest = (pose, np.zeros(6), np.zeros(6))
    folded = mech.inverse_dynamics_derivatives(*rest, set="paper")
    regular = mech.inverse_dynamics_derivatives(*rest, set="natural")
    assert pp.Status(folded.status) is pp.Status.FOLD
    assert pp.Status(regular.status) is pp.Status.OK
    for field, array in folded.arrays.items():
        if array.ndim == 2:
            if any(field.endswith(f"_by_{part}") for part in (*ORDERS, "geometry")):
                assert np.all(np.isnan(array))
                assert np.all(np.isfinite(getattr(regular, field)))
            else:
                assert np.array_equal(array, getattr(regular, field)), field


def test_leading_axes_broadcast():
    mech, pose, twist, _ = lu_at_rest()
    by = mech.inverse_dynamics_derivatives(pose, twist, np.zeros((2, 1, 6)), np.zeros((3, 6)))
    p = len(by.bodies)
    assert by.forces_by_pose.shape == (2, 3, 5, 6)
    assert by.constraint_by_bodies.shape == (2, 3, 1, p)
    y = mech.regressor(pose, twist, np.zeros((2, 1, 6)), np.zeros((3, 6)))
    assert y.forces.shape == (2, 3, 5, p)
    assert y.forces_offset.shape == (2, 3, 5)
    alone = mech.regressor(pose, twist, np.zeros(6), np.zeros(6))
    assert np.array_equal(y.forces[1, 2], alone.forces)


def test_wrong_calls_raise():
    mech, *rest = lu_at_rest()
    with pytest.raises(pp.UnknownNameError, match="naturel"):
        mech.inverse_dynamics_derivatives(*rest, set="naturel")
    with pytest.raises(pp.CoordinateError, match="x, y"):
        mech.inverse_dynamics_derivatives(*rest, set="pose", coordinates=["x", "y"])
    with pytest.raises(pp.UnknownNameError, match="wrench_axes"):
        mech.regressor(*rest, np.zeros(6), "tool")


def test_expressions_name_the_combinations():
    mech = any_case("lu").mech
    base = mech.base_parameters()
    assert base.expression(0) == "platform m" + "".join(f" + piston {i} m" for i in range(1, 6))
    at = base.names.index("cylinder 1 mc_x")
    assert base.expression(at) == "cylinder 1 mc_x + cylinder 3 mc_x + rod L mc_y"
    # The pistons' masses act at the platform's joints: their first moments are those of the points.
    row = base.names.index("platform mc_y")
    for i, leg in enumerate(mech.geometry["legs"]):
        weight = base.combination[row, base.parameters.index(f"piston {i + 1} m")]
        assert weight == pytest.approx(leg["platform"]["point"][1] * mech.geometry["efficiency"], abs=1e-12)
