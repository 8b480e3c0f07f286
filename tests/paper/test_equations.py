"""The paper's equations as printed, corrected where the print has a slip, against Polypod."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import polypod as pp
from support import oracle as o
from support.cases import (
    EXACT,
    FORCES,
    ROUNDING,
    STENCIL,
    agree,
    any_case,
    at_time,
    lu,
    lu_coordinates,
    lu_state,
    motion_coordinates,
    per_pose,
)

RPU, SPU = (0, 2), (1, 3, 4)


@functools.cache
def lu_moving():
    """For each pose the five legs as the paper's formulas take them."""
    c = lu()
    return [
        [o.lu_leg(i, (c.pose[0][k], c.pose[1][k]), c.twist[k], c.acceleration[k]) for i in range(1, 6)]
        for k in range(len(c.twist))
    ]


def printed(f, legs=range(5)):
    """f(leg) of these legs at all poses (N, legs, ...)."""
    return np.array([[f(at[i]) for i in legs] for at in lu_moving()])


def l_axes():
    """Unit vectors l of all poses, the direction from b3 to b1."""
    return lu().pose[0][:, :, 0]


@functools.cache
def lu_dynamics():
    c = lu()
    return c.mech.inverse_dynamics(c.T, c.twist, c.acceleration)


def test_eq1():
    m = lu().mech.mobility()
    assert m.dof == 5
    assert 6 * (m.links - m.joints - 1) + m.joint_freedoms + m.redundant - m.passive == 5
    assert (m.links, m.joints, m.joint_freedoms, m.closure_rank, m.redundant, m.passive) == (
        13,
        16,
        27,
        22,
        2,
        0,
    )
    assert (m.published.redundant, m.published.passive) == (3, 1)
    assert 6 * (13 - 16 - 1) + 27 + m.published.redundant - m.published.passive == m.published.dof


def test_eq2():
    q = lu_coordinates()
    agree(lu_state().pose[:, :3, :3], [o.eq2(a, b, g) for a, _, _, b, g in q], EXACT * 10)


def test_eq3():
    ik = lu().mech.inverse_kinematics(lu().T)
    agree(ik.vectors, printed(lambda m: m.r_), EXACT)
    agree(ik.directions, printed(lambda m: m.delta), EXACT)


def test_eq4():
    vectors = lu_state().pose[:, :3, 0], lu().mech.inverse_kinematics(lu_state().pose).vectors[:, 0]
    assert np.max(np.abs([o.eq4(l, r) for l, r in zip(*vectors, strict=True)])) < 1e-15


def test_eq6():
    agree(lu().kinematics.rates, printed(lambda m: o.eq6(m)[1]))
    agree(lu().mech.jacobian(lu().T)[:, :5], printed(lambda m: o.eq6(m)[2]))


def force_directions(at):
    """c1 and c3 = -c1."""
    c1 = np.cross(at[0].r_, o.LU_L)
    c1 /= np.linalg.norm(c1)
    return c1, -c1


def test_eq7():
    """The product's coupled forces, f_c3 along c3 = -c1, are in the ratio k."""
    forces = lu().mech.coupled_forces(lu().T, lu_dynamics().constraint).forces
    for at, (f1, f3) in zip(lu_moving(), forces, strict=True):
        k = o.eq7(at[0].r_, at[2].r_, *force_directions(at))
        assert -f3 == pytest.approx(k * f1, rel=1e-10)


def test_eq8():
    """They do no work."""
    c = lu()
    forces = c.mech.coupled_forces(c.T, lu_dynamics().constraint).forces
    for at, (f1, f3), V in zip(lu_moving(), forces, c.twist, strict=True):
        c1, _ = force_directions(at)
        total = np.concatenate([(f1 + f3) * c1, np.cross(at[0].e, f1 * c1) + np.cross(at[2].e, f3 * c1)])
        assert abs(total @ V) < 1e-12 * (abs(f1) + abs(f3)) * np.linalg.norm(V)


def test_eq10():
    """The row made of both forces is the length of l times the product's row."""
    rows = lu().mech.jacobian(lu().T)[:, 5]
    expected = []
    for at in lu_moving():
        ll = at[0].e - at[2].e
        c, tau = o.eq10(at[0].e, at[0].r_, at[2].r_, *force_directions(at), ll)
        expected.append(np.concatenate([c, tau]) / np.linalg.norm(ll))
    agree(rows, expected)


def test_eq11():
    rows = lu().mech.jacobian(lu().T)[:, 5]
    pairs = zip(lu_moving(), l_axes(), strict=True)
    agree(rows, [np.concatenate(o.eq11(at[0].e, at[0].r_, l)) for at, l in pairs])


def test_eq12():
    row, V = lu().mech.jacobian(lu().T)[:, 5], lu().twist
    assert np.all(np.abs(np.sum(row * V, axis=1)) < 1e-14 * np.linalg.norm(V, axis=1))


def test_eq13():
    J = [o.eq13(at, l) for at, l in zip(lu_moving(), l_axes(), strict=True)]
    agree(lu().mech.jacobian(lu().T), J)
    rates = np.column_stack([lu().kinematics.rates, np.zeros(len(J))])
    twist, _ = lu().mech.platform_twist(lu().T, lu().kinematics.rates)
    agree(twist, np.linalg.solve(J, rates[..., None])[..., 0], ROUNDING * per_pose(lu().condition))


def test_eq15():
    """The product's matrices are the symmetric parts of the printed ones."""
    h = printed(o.eq15)
    agree(lu().mech.hessian(lu().T)[:, :5], (h + np.swapaxes(h, -1, -2)) / 2)


def test_eq16():
    """The rates c' and τ' against the product's row along the motion."""
    q = motion_coordinates("lu")
    mech = lu().mech

    def row(t):
        return mech.jacobian(mech.pose(at_time(*q, t)[0]))[:, 5]

    first, _ = o.differentiate(row, 8e-3)
    state, expected = mech.state(*q), []
    for T, V in zip(state.pose, state.twist, strict=True):
        m = o.lu_leg(1, (T[:3, :3], T[:3, 3]), V, 0 * V)
        Q, Q1 = o.eq16(m.e, m.r_, T[:3, 0])
        expected.append(np.concatenate([-Q @ V[3:], -Q.T @ V[:3] + Q1 @ V[3:]]))
    agree(first, expected, STENCIL)


def test_eq17():
    h = np.array([o.eq17(at[0].e, at[0].r_, l) for at, l in zip(lu_moving(), l_axes(), strict=True)])
    agree(lu().mech.hessian(lu().T)[:, 5], (h + np.swapaxes(h, -1, -2)) / 2)


def test_eq18():
    c = lu()
    J, H = c.mech.jacobian(c.T)[:, 5], c.mech.hessian(c.T)[:, 5]
    left = np.sum(J * c.acceleration, axis=1) + np.einsum("nij,ni,nj->n", H, c.twist, c.twist)
    assert np.all(np.abs(left) < 1e-13 * np.linalg.norm(c.acceleration, axis=1))


def test_eq19():
    c = lu()
    a_r = np.column_stack([c.kinematics.accelerations, np.zeros(len(c.twist))])
    expected = [o.eq19(at, l, a, V) for at, l, a, V in zip(lu_moving(), l_axes(), a_r, c.twist, strict=True)]
    got, _ = c.mech.platform_acceleration(c.T, c.twist, c.kinematics.accelerations)
    agree(got, expected, ROUNDING * per_pose(c.condition))


def test_eq20():
    w, r = lu().kinematics.leg_omega, printed(lambda m: m.r_)
    agree(np.cross(w, r), printed(lambda m: o.eq6(m)[0] - o.eq6(m)[1] * m.delta))


def test_eq21():
    w, d, r = lu().kinematics.leg_omega, printed(lambda m: m.delta), printed(lambda m: m.r)[..., None]
    across_ = r * (w - d * np.sum(w * d, axis=-1, keepdims=True))
    agree(across_, printed(lambda m: np.cross(m.delta, o.eq6(m)[0])))


def test_eq22():
    w1, w2 = np.moveaxis(printed(o.eq25, RPU), -1, 0)[..., None]
    R1, R2 = np.moveaxis(printed(o.eq22, RPU), 2, 0)
    agree(lu().kinematics.leg_omega[:, RPU], w1 * R1 + w2 * R2)


def test_eq23():
    w, r = lu().kinematics.leg_omega[:, RPU], printed(lambda m: m.r_, RPU)

    def right(m):
        return -o.skew(m.delta) @ o.skew(m.delta) @ (m.v - o.skew(m.e) @ m.omega)

    agree(np.cross(w, r), printed(right, RPU))


def test_eq24():
    """The product's joint rates below, times D_i1."""
    rates = lu().kinematics.base_joint_rates[:, RPU]

    def right(m):
        R1, R2 = o.eq22(m)
        u = o.skew(m.delta) @ o.skew(m.delta) @ (m.v - o.skew(m.e) @ m.omega)
        return np.array([R2 @ u, -R1 @ u])

    D1 = printed(lambda m: np.cross(*o.eq22(m)) @ m.r_, RPU)[..., None]
    agree(np.abs(rates * D1), np.abs(printed(right, RPU)))


def test_eq25():
    """The base joint's rates, up to the sense in which each angle is counted."""
    agree(np.abs(lu().kinematics.base_joint_rates[:, RPU]), np.abs(printed(o.eq25, RPU)))


def test_eq26():
    agree(lu().kinematics.leg_omega[:, RPU], printed(lambda m: o.eq26(m) @ m.V, RPU))


def test_eq27():
    agree(lu().kinematics.leg_omega[:, RPU], printed(lambda m: np.divide(*o.eq27(m)), RPU))


def test_eq28():
    agree(lu().kinematics.leg_eps[:, RPU], printed(o.eq28, RPU))


def test_eq29():
    agree(lu().kinematics.leg_omega[:, SPU], printed(o.eq29, SPU))


def test_eq30():
    w, r = lu().kinematics.leg_omega[:, SPU], printed(lambda m: m.r_, SPU)

    def left(m):
        (R1, R2), (phi1, phi2) = o.eq33_axes(m), o.eq32(m)
        return np.cross(m.omega, m.r_) - np.cross(phi1 * R1, m.r_) - np.cross(phi2 * R2, m.r_)

    agree(np.cross(w, r), printed(left, SPU))


def test_eq31():
    """Eq. 30 along both axes of the joint, with the product's ω_ri on the right."""
    for j, other in ((0, 1), (1, 0)):

        def left(m, j=j, other=other):
            R, phi = o.eq33_axes(m), o.eq32(m)
            return (np.cross(m.omega, m.r_) - np.cross(phi[other] * R[other], m.r_)) @ R[j]

        w, r = lu().kinematics.leg_omega[:, SPU], printed(lambda m: m.r_, SPU)
        axis = printed(lambda m, j=j: o.eq33_axes(m)[j], SPU)
        agree(np.sum(np.cross(w, r) * axis, axis=-1), printed(left, SPU))


def test_eq32():
    """The platform joint's rates, up to the sense in which each angle is counted."""
    agree(np.abs(lu().kinematics.platform_joint_rates[:, SPU]), np.abs(printed(o.eq32, SPU)))


def test_eq33():
    agree(lu().kinematics.leg_omega[:, SPU], printed(lambda m: o.eq33(m) @ m.V, SPU))


def test_eq34a():
    agree(lu().kinematics.leg_omega[:, SPU], printed(o.eq34a, SPU))
    agree(lu().kinematics.accelerations, printed(lambda m: o.eq34a_rates(m)[4]))


def test_eq34b():
    """d'_i1 and d'_i2 are what rotates Eq. 34a into the product's angular acceleration."""

    def eps(m):
        R1, R2 = o.eq33_axes(m)
        d1, d2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
        d1_rate, d2_rate = o.eq34b(m)
        v_i, v_r, delta_rate, a_i, a_r = o.eq34a_rates(m)
        D = v_r * m.delta - v_i - np.cross(m.r_, m.omega)
        D_rate = a_r * m.delta + v_r * delta_rate - a_i - np.cross(v_i, m.omega) - np.cross(m.r_, m.eps)
        return m.eps + (d2_rate @ D + d2 @ D_rate) / d1 - d2 @ D * d1_rate / d1**2

    agree(lu().kinematics.leg_eps[:, SPU], printed(eps, SPU))


def test_eq35():
    agree(lu().kinematics.leg_eps[:, SPU], printed(o.eq35, SPU))


def test_eq36():
    agree(lu().kinematics.rod_omega, printed(lambda m: o.eq36(m)[0], (0,)))
    agree(lu().kinematics.rod_omega, printed(lambda m: o.eq36(m)[1] @ m.V, (0,)))


def test_eq37():
    agree(lu().kinematics.rod_eps, printed(o.eq37, (0,)))


def by_leg(rpu, spu):
    """A formula for RPU legs and another for SPU legs, at all poses (N, 5, ...)."""
    return np.array([[(rpu if i in RPU else spu)(at[i]) for i in range(5)] for at in lu_moving()])


def test_eq38():
    k = lu().kinematics
    for which, got in enumerate((k.piston_velocity, k.cylinder_velocity)):
        agree(got, by_leg(*(lambda m, f=f, w=which: o.eq38(m, f(m))[w] @ m.V for f in (o.eq26, o.eq33))))


def test_eq39():
    k = lu().kinematics
    turning = ((o.eq26, o.eq28), (o.eq33, o.eq35))
    for which, got in enumerate((k.piston_acceleration, k.cylinder_acceleration)):
        agree(got, by_leg(*(lambda m, f=f, g=g, w=which: o.eq39(m, f(m) @ m.V, g(m))[w] for f, g in turning)))


@pytest.mark.parametrize(("eta", "mu"), [(1.0, 0.0), (0.8, 7.0)])
def test_eq43(eta, mu):
    """Active forces and f_c, with the weights and inertias of Eq. 40, exact for isotropic ones."""
    c = lu()
    tables = o.lu()
    tables["dynamics"] = {"efficiency": eta, "linear_damping": mu, "angular_damping": mu}
    mech = pp.Mechanism.from_dict(tables)
    load = o.load_at(c.spec, c.pose)
    F = np.array([o.eq43(at, l, w, eta, mu) for at, l, w in zip(lu_moving(), l_axes(), load, strict=True)])
    got = mech.inverse_dynamics(c.T, c.twist, c.acceleration)
    agree(np.hstack([got.forces, got.constraint]), F, FORCES * per_pose(c.condition))
    # f_c on its own, since it is small beside the active forces.
    agree(got.constraint, F[:, 5:], 10 * FORCES * per_pose(c.condition))


def test_eq40_lacks_the_gyroscopic_torque():
    """With unequal moments of inertia the platform's -ω × I ω is there, other than in print."""
    tables = o.lu()
    tables["platform"]["inertia"] = [5, 3, 7]
    c, mech, inertia = lu(), pp.Mechanism.from_dict(tables), np.diag([5.0, 3.0, 7.0])
    change = mech.inverse_dynamics(c.T, c.twist, c.acceleration).forces - lu_dynamics().forces
    J = c.mech.jacobian(c.T)
    R, w, eps = c.pose[0], c.twist[:, 3:], c.acceleration[:, 3:]
    world = R @ inertia @ np.swapaxes(R, 1, 2)
    torque = -o.times(world, eps) - np.cross(w, o.times(world, w)) + 5 * eps
    wrench = np.concatenate([0 * torque, torque], axis=1)
    expected = np.linalg.solve(np.swapaxes(J, 1, 2), -wrench[..., None])[:, :5, 0]
    error = np.max(np.abs(change - expected), axis=1) / np.max(np.abs(lu_dynamics().forces), axis=1)
    assert np.all(error < 10 * FORCES * c.condition)


def test_eq42():
    """Virtual work along feasible motions, with the product's forces and the printed velocities."""
    c = lu()
    W, _ = o.generalised_force(c.spec, c.pose, c.twist, c.acceleration)
    Z, scale = o.feasible_directions(c.spec, c.pose)
    moves = np.swapaxes(Z, 1, 2) / scale
    rows = c.mech.jacobian(c.T)[:, :5]
    work = np.einsum("nki,nji,nj->nk", moves, rows, lu_dynamics().forces)
    size = np.max(np.abs(lu_dynamics().forces), axis=1)
    assert np.all(np.abs(work + o.times(moves, W)) < FORCES * 10 * per_pose(size * c.condition))


def test_eq44_as_printed():
    """The print's own split, where it has one: it fails where l is along L, or where d1 = -d3."""
    c = lu()
    f_c = lu_dynamics().constraint
    got = c.mech.coupled_forces(c.T, f_c, as_printed=True)
    for k, at in enumerate(lu_moving()):
        c1, _ = force_directions(at)
        f1, f3, torque = o.eq44(at[0].r_, at[2].r_, c1, f_c[k, 0])
        assert got.forces[k] == pytest.approx([f1, f3], rel=1e-11)
        # The rod feels the reaction of r1 × f_c1 c1: its part along L, with the other sign.
        assert got.torque[k] == pytest.approx(-torque @ o.LU_L, rel=1e-11)


@pytest.mark.parametrize("name", ["lu", "rod-lined"])
def test_coupled_forces_are_the_constraint_wrench(name):
    """Both forces are f_c (c, τ), found from six equations of statics; finite also where l is along L."""
    c = any_case(name)
    f_c = c.mech.inverse_dynamics(c.T, c.twist, c.acceleration).constraint
    got = c.mech.coupled_forces(c.T, f_c)
    on_rod = [i for i, leg in enumerate(c.spec["legs"]) if leg["base"]["rod"] is not None]
    assert got.legs == tuple(c.spec["legs"][i]["name"] for i in on_rod)
    L = c.spec["rods"][0]["axis"]
    expected, torques = [], []
    for k in range(len(c.twist)):
        first, second = (c.legs[i] for i in on_rod)
        e1, e3, r1, r3 = (x.x[k] for x in (first.e, second.e, first.r, second.r))
        l = first.platform_axis.x[k]
        forces, left_over = o.coupled_forces(e1, e3, r1, r3, l, f_c[k, 0], L)
        assert np.max(np.abs(left_over)) < 1e-11 * np.max(np.abs(forces))
        noted, torque = o.coupled_forces_of_the_notes(r1, r3, e1 - e3, f_c[k, 0], L)
        assert forces == pytest.approx(noted * np.sign((e1 - e3) @ l), rel=1e-9)
        expected.append(forces)
        torques.append(torque * np.sign((e1 - e3) @ l))
    agree(got.forces, expected, 1e-9)
    agree(got.torque, torques, 1e-9)
