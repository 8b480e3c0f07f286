"""Kinematics of every mechanism against the oracle: legs, links, J, H, and what a status says."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from support import oracle as o
from support.cases import (
    EXACT,
    ROUNDING,
    SEED,
    Case,
    agree,
    any_case,
    case,
    draw,
    each,
    legs_of,
    matrix,
    per_pose,
    spins,
)


@each
def test_characteristic_length(name):
    c = any_case(name)
    assert c.mech.characteristic_length == pytest.approx(o.characteristic_length(c.spec), rel=EXACT)


@each
def test_inverse_kinematics(name):
    c = any_case(name)
    ik = c.mech.inverse_kinematics(c.T)
    agree(ik.lengths, legs_of(c, lambda leg: leg.length.x[:, 0]), EXACT)
    agree(ik.vectors, legs_of(c, lambda leg: leg.r.x), EXACT)
    agree(ik.directions, legs_of(c, lambda leg: leg.delta.x), EXACT)


@each
def test_status_tells_the_stroke(name):
    """Beyond a limit by 1e-9 m the status says so, and the numbers stay; within it all is well."""
    c = any_case(name)
    margin = 1e-10
    ell = legs_of(c, lambda leg: leg.length.x[:, 0])
    limits = np.array([leg["stroke"] for leg in c.spec["legs"]])
    np.testing.assert_allclose(c.mech.stroke, limits, rtol=EXACT)
    over = np.maximum(ell - limits[:, 1], limits[:, 0] - ell).max(axis=1)
    assert np.sum(np.abs(ell[:, :, None] - limits).min(axis=(1, 2)) < 2e-6) >= 2, "no pose near a limit"
    outside, inside = over > margin, over < -margin
    status = c.mech.inverse_kinematics(c.T).status
    assert np.all(status[outside] == pp.Status.OUT_OF_STROKE)
    assert np.all(status[inside] == pp.Status.OK)


@each
def test_leg_rates(name):
    c = any_case(name)
    agree(c.kinematics.rates, legs_of(c, lambda leg: leg.length.d[:, 0]))
    agree(c.kinematics.accelerations, legs_of(c, lambda leg: leg.length.dd[:, 0]))
    agree(c.kinematics.directions, legs_of(c, lambda leg: leg.delta.x), EXACT)


@each
def test_leg_turning(name):
    c = any_case(name)
    omega, eps = spins(c)
    agree(c.kinematics.leg_omega, omega)
    agree(c.kinematics.leg_eps, eps)
    delta, rate = legs_of(c, lambda leg: leg.delta.x), legs_of(c, lambda leg: leg.delta.d)
    agree(c.kinematics.leg_spin, np.sum(omega * delta, axis=-1), floor=1)
    agree(c.kinematics.leg_spin_rate, np.sum(eps * delta + omega * rate, axis=-1), floor=1)


@each
def test_mass_centres(name):
    c = any_case(name)
    links = o.links_at(c.spec, c.jets)
    for kind in ("cylinder", "piston"):
        found = [k.center for k in links if k.name == kind]
        agree(getattr(c.kinematics, f"{kind}_velocity"), np.stack([k.d for k in found], axis=1))
        agree(getattr(c.kinematics, f"{kind}_acceleration"), np.stack([k.dd for k in found], axis=1))


@pytest.mark.parametrize("name", ["lu", "rod-of-one", "rod-lined"])
def test_rods(name):
    c = any_case(name)
    omega, eps = o.spin_of(o.rod_frame(c.spec, 0, c.legs))
    agree(c.kinematics.rod_omega, omega[:, None])
    agree(c.kinematics.rod_eps, eps[:, None])


@each
def test_rates_are_differences(name):
    """All angles and lengths that the product gives change as fast as the product says."""
    c = any_case(name)
    some = slice(0, 6)
    pose, V, A = (c.pose[0][some], c.pose[1][some]), c.twist[some], c.acceleration[some]
    now = c.mech.kinematics(matrix(pose), V, A)
    names = (
        ("lengths", "rates"),
        ("base_joint_angles", "base_joint_rates"),
        ("platform_joint_angles", "platform_joint_rates"),
    )
    here = {a: getattr(now, a) for a, _ in names} | {"rod_angle": now.rod_angle}

    def moved(t):
        k = c.mech.kinematics(matrix(o.close(c.spec, o.along(pose, V, A, t))), 0 * V, 0 * A)
        flat = []
        for key, value in here.items():
            change = np.nan_to_num(getattr(k, key) - value)
            if key != "lengths":
                change = (change + np.pi) % (2 * np.pi) - np.pi
            flat.append(change.reshape(len(V), -1))
        return np.concatenate(flat, axis=1)

    first, _ = o.differentiate(moved, 2e-4)  # short, for gimbal poses
    expected = [np.nan_to_num(getattr(now, r)).reshape(len(V), -1) for _, r in names]
    if c.spec["rods"]:
        expected.append(np.sum(now.rod_omega * [r["axis"] for r in c.spec["rods"]], axis=-1))
    agree(first, np.concatenate(expected, axis=1), 1e-6)
    for a, r in names[1:]:
        np.testing.assert_array_equal(np.isnan(getattr(now, a)), np.isnan(getattr(now, r)))


@each
def test_cone_angles(name):
    """Without an axis of its own a cone stands about the leg's direction at home."""
    c = any_case(name)
    home = [leg.delta.x for leg in o.legs_at(c.spec, o.home(c.spec))]
    for side in ("base", "platform"):
        got = getattr(c.kinematics, f"{side}_cone_angle")
        for i, leg in enumerate(c.legs):
            axis = home[i] if side == "base" else o.times(c.pose[0], o.home(c.spec)[0].T @ home[i])
            sine = np.linalg.norm(np.cross(axis, leg.delta.x), axis=-1)
            agree(got[:, i], np.arctan2(sine, np.sum(axis * leg.delta.x, axis=-1)), ROUNDING)


def theory_rows(c: Case):
    """Whether the oracle has the constraints of all legs by kind."""
    known = {"UU", "RS", "SR", "RU", "UR", "SS", "US", "SU"}
    below = ["U" if leg["base"]["rod"] is not None else leg["base"]["joint"] for leg in c.spec["legs"]]
    return all(b + leg["platform"]["joint"] in known for b, leg in zip(below, c.spec["legs"], strict=True))


@each
def test_jacobian(name):
    c = any_case(name)
    J = c.mech.jacobian(c.T)
    n = len(o.actuated(c.spec))
    agree(J[:, :n], o.leg_gradient(c.spec, c.pose))
    Z, scale = o.feasible_directions(c.spec, c.pose)
    # The constraints' rows are felt by no feasible motion, and there are enough of them.
    rows = J[:, n:] / scale
    assert np.all(np.abs(rows @ Z) < ROUNDING)
    if rows.shape[1]:
        assert np.all(np.linalg.matrix_rank(rows, tol=1e-9) == 6 - c.mech.dof)
    if theory_rows(c) and rows.shape[1]:
        g = o.gradient(lambda p: o.theory_constraints(c.spec, p), c.pose)
        agree(J[:, n:], g[:, list(c.mech.mobility().independent_rows)])


@each
def test_hessian(name):
    """Second rates along any motion, also one that the joints do not allow."""
    c = any_case(name)
    rng = np.random.default_rng(SEED)
    V, A = rng.normal(size=(2, *c.twist.shape))
    J, H = c.mech.jacobian(c.T), c.mech.hessian(c.T)
    agree(H, np.swapaxes(H, -1, -2), EXACT)
    second = o.times(J, A) + np.einsum("nkij,ni,nj->nk", H, V, V)
    jets = o.moving(c.pose, V, A)
    active = o.actuated(c.spec)
    agree(second[:, : len(active)], o.lengths(c.spec, jets).dd[:, active])
    if theory_rows(c) and c.mech.dof < 6:
        g = o.theory_constraints(c.spec, jets).dd
        agree(second[:, len(active) :], g[:, list(c.mech.mobility().independent_rows)])
    # And along a motion that they do allow, the constraints' second rates are none.
    held = o.times(J, c.acceleration) + np.einsum("nkij,ni,nj->nk", H, c.twist, c.twist)
    size = np.max(np.abs(c.acceleration), axis=1, keepdims=True)
    assert np.all(np.abs(held[:, len(active) :]) < ROUNDING * size)


@each
def test_platform_from_legs(name):
    c = any_case(name)
    twist, status = c.mech.platform_twist(c.T, c.kinematics.rates)
    assert np.all(np.isin(status, (pp.Status.OK, pp.Status.OUT_OF_STROKE)))
    agree(twist, c.twist, ROUNDING * per_pose(c.condition))
    acceleration, _ = c.mech.platform_acceleration(c.T, c.twist, c.kinematics.accelerations)
    agree(acceleration, c.acceleration, ROUNDING * per_pose(c.condition))


@each
def test_conditioning(name):
    c = any_case(name)
    s = o.conditioning(c.spec, c.pose)
    got = c.mech.conditioning(c.T)
    agree(got.sigma_max, s[:, 0], ROUNDING)
    agree(got.sigma_min, s[:, -1], ROUNDING * c.condition, floor=1e-6)
    agree(got.condition, c.condition, ROUNDING * c.condition, floor=1e-9)


def test_legs_on_one_rod_keep_the_angle_between_their_planes():
    """A rod ties legs in different planes through it: one degree of freedom less than two UPU legs leave.

    The rod carries both revolute joints, so that the angle between their axes stays. Where both platform axes
    lie on one line, as in the paper, the angle stays anyway; elsewhere one of four actuators is redundant.
    """
    rng = np.random.default_rng(SEED)
    tables = draw("rod-of-two", ["UPS", "rRPU", "SPU", "rRPU"], rng)
    spec = o.read(tables)
    home = o.home(spec)
    counted = o.mobility(spec, home)
    assert o.dof(spec, home) == counted.joint_freedoms - counted.closure_rank == 3
    mech = pp.Mechanism.from_dict(tables)
    assert (mech.dof, mech.n_rows, mech.redundantly_actuated) == (3, 7, True)


def test_poses_off_the_constraints_are_refused():
    """Just off, the answer still comes, and differs as little; clearly off, the status says so."""
    c = case("3-rps-skew")
    T = c.T[:1].repeat(3, axis=0)
    across_ = c.spec["legs"][0]["base"]["axis"]
    T[:, :3, 3] += per_pose([0, 1e-9, 1e-3]) * across_
    got = c.mech.inverse_kinematics(T)
    assert got.status[2] == pp.Status.OFF_CONSTRAINT
    assert np.all(np.isnan(got.lengths[2]))
    assert np.all(got.status[:2] != pp.Status.OFF_CONSTRAINT)
    assert np.all(np.abs(got.lengths[1] - got.lengths[0]) < 2e-9)
