"""The paper's mechanism: poses by coordinates, and its equations as printed.

One pose; 3-vectors; names as in the paper. Slips of the print are put right where the docstring says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from support.oracle.jets import Jet, apply, arccos, concat, cos, jet, matmul, sin
from support.oracle.rotations import axis_turn, skew
from support.oracle.tables import LU_ANGLES

S18 = math.sin(math.radians(18))
E1, E_SMALL = 0.270, 0.150


def natural_pose(alpha, p, h, beta, gamma):
    """Pose from natural coordinates: the middle of b1b3 is at (p, E1 sin 18°, 0) + h Rx(α) ez."""
    Ra = axis_turn(0, alpha)
    R = matmul(matmul(Ra, axis_turn(1, beta)), axis_turn(0, gamma))
    p, h = (Jet(*(a[..., None] for a in (j.x, j.d, j.dd))) for j in (jet(p), jet(h)))
    middle = p * np.array([1.0, 0, 0]) + np.array([0, E1 * S18, 0]) + h * apply(Ra, np.array([0, 0, 1.0]))
    return R, middle - apply(R, np.array([0, E_SMALL * S18, 0]))


def paper_pose(x, y, z, alpha, beta, branch=1):
    """Pose from the paper's coordinates: Eq. 2, with γ of Eq. 5 on the branch of its sign."""
    gamma = branch * arccos(eq5(y, z, alpha))
    R = matmul(matmul(axis_turn(0, alpha), axis_turn(1, beta)), axis_turn(0, gamma))
    o = concat([Jet(*(a[..., None] for a in (j.x, j.d, j.dd))) for j in map(jet, (x, y, z))])
    return R, o


@dataclass
class Moving:
    """Inputs of the paper's formulas of one leg."""

    v: np.ndarray
    omega: np.ndarray
    a: np.ndarray
    eps: np.ndarray
    e: np.ndarray
    r_: np.ndarray  # vector
    lp: float = 0.0
    lq: float = 0.0

    @property
    def r(self):
        return np.linalg.norm(self.r_)

    @property
    def delta(self):
        return self.r_ / self.r

    @property
    def V(self):
        return np.concatenate([self.v, self.omega])

    @property
    def A(self):
        return np.concatenate([self.a, self.eps])


LU_L = np.array([1.0, 0, 0])


def lu_leg(i, pose, twist, acceleration) -> Moving:
    """Leg i = 1..5 of the paper's mechanism at a pose."""
    theta = math.radians(LU_ANGLES[i - 1])
    direction = np.array([math.cos(theta), math.sin(theta), 0])
    e = pose[0] @ (E_SMALL * direction)
    B = (0.270 if i in (1, 3) else 0.265) * direction
    r = pose[1] + e - B
    lp = 0.100 if i in (1, 3) else 0.098
    return Moving(twist[:3], twist[3:], acceleration[:3], acceleration[3:], e, r, lp, 0.050)


def eq2(alpha, beta, gamma):
    """R of Eq. 2 in closed form."""
    sa, ca, sb, cb = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
    sg, cg = math.sin(gamma), math.cos(gamma)
    return np.array(
        [
            [cb, sb * sg, sb * cg],
            [sa * sb, ca * cg - sa * cb * sg, -ca * sg - sa * cb * cg],
            [-ca * sb, sa * cg + ca * cb * sg, -sa * sg + ca * cb * cg],
        ]
    )


def eq4(l, r1, L=LU_L):
    """(l r1 L), zero where l, r1, L lie in a plane. The print has lost the determinant's middle columns."""
    return np.linalg.det(np.array([l, r1, L]))


def eq5(Y, Z, alpha):
    """The cosine of γ."""
    return (E1 * S18 * cos(alpha) - Z * sin(alpha) - Y * cos(alpha)) / (E_SMALL * S18)


def eq6(m: Moving):
    """v_i and v_ri, and the row (δᵀ, (e×δ)ᵀ)."""
    v_i = m.v + np.cross(m.omega, m.e)
    return v_i, v_i @ m.delta, np.concatenate([m.delta, np.cross(m.e, m.delta)])


def eq7(r1, r3, c1, c3, L=LU_L):
    """The ratio k in f_c3 = k f_c1, from the balance of moments about L."""
    return -(np.cross(r1, c1) @ L) / (np.cross(r3, c3) @ L)


def eq10(e1, r1, r3, c1, c3, ll, L=LU_L):
    """c_l and τ_l: the couple-constrained wrench from both forces. ll is the vector b3b1."""
    m1, m3 = np.cross(r1, c1) @ L, np.cross(r3, c3) @ L
    c = m3 * c1 - m1 * c3
    return c, np.cross(e1, c) + np.cross(ll, m1 * c3)


def eq11(e1, r1, l, L=LU_L):
    """The wrench (c, τ)."""
    c = np.cross(L, l)
    return c, np.cross(e1, c) - np.cross(l, np.cross(L, r1))


def eq13(legs: list[Moving], l, L=LU_L):
    """J."""
    rows = [eq6(m)[2] for m in legs]
    return np.array([*rows, np.concatenate(eq11(legs[0].e, legs[0].r_, l, L))])


def eq15(m: Moving):
    """h_ri, unsymmetric as printed."""
    s, d2 = skew, skew(m.delta) @ skew(m.delta)
    h = np.block(
        [
            [-d2, d2 @ s(m.e)],
            [-s(m.e) @ d2, m.r * s(m.e) @ s(m.delta) + s(m.e) @ d2 @ s(m.e)],
        ]
    )
    return h / m.r


def eq16(e1, r1, l, L=LU_L):
    """Q and Q1 of c' = -Q ω and τ' = -Qᵀ v + Q1 ω: the last line; the one above has a slip of sign."""
    s = skew
    Q = s(L) @ s(l)
    Q1 = s(np.cross(L, l)) @ s(e1) - s(e1) @ s(L) @ s(l) - s(np.cross(L, r1)) @ s(l) + s(l) @ s(L) @ s(e1)
    return Q, Q1


def eq17(e1, r1, l, L=LU_L):
    """h_c, unsymmetric as printed."""
    Q, Q1 = eq16(e1, r1, l, L)
    return np.block([[np.zeros((3, 3)), -Q], [-Q.T, Q1.T]])


def eq19(legs: list[Moving], l, accelerations, V):
    """A_o from the legs' accelerations (6,) and V_o = J⁻¹ V_r."""
    J = eq13(legs, l)
    H = [eq15(m) for m in legs] + [eq17(legs[0].e, legs[0].r_, l)]
    return np.linalg.solve(J, accelerations - np.array([V @ h @ V for h in H]))


def eq22(m: Moving, L=LU_L):
    """R_i1, R_i2 of an RPU leg."""
    R2 = np.cross(L, m.delta)
    return L / np.linalg.norm(L), R2 / np.linalg.norm(R2)


def eq25(m: Moving):
    """ω_i1, ω_i2 of an RPU leg."""
    R1, R2 = eq22(m)
    D1 = np.cross(R1, R2) @ m.r_
    u = skew(m.delta) @ skew(m.delta) @ (m.v - skew(m.e) @ m.omega)
    return R2 @ u / D1, -R1 @ u / D1


def eq26(m: Moving):
    """J_ωi of an RPU leg: ω_ri = J_ωi V_o."""
    R1, R2 = eq22(m)
    D1, D2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    return D2 @ skew(m.delta) @ skew(m.delta) @ np.hstack([np.eye(3), -skew(m.e)]) / D1


def eq27(m: Moving):
    """D_i3 / D_i1 = ω_ri of an RPU leg."""
    R1, R2 = eq22(m)
    v_i, v_r, _ = eq6(m)
    D1, D2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    return -D2 @ (v_i - v_r * m.delta), D1


def eq34a_rates(m: Moving):
    """v_i, v_ri, δ', a_i, a_ri."""
    v_i, v_r, _ = eq6(m)
    delta_rate = (v_i - v_r * m.delta) / m.r
    a_i = m.a + np.cross(m.eps, m.e) + np.cross(m.omega, np.cross(m.omega, m.e))
    return v_i, v_r, delta_rate, a_i, a_i @ m.delta + v_i @ delta_rate


def eq28(m: Moving):
    """ε_ri of an RPU leg."""
    R1, R2 = eq22(m)
    v_i, v_r, delta_rate, a_i, a_r = eq34a_rates(m)
    D3, D1 = eq27(m)
    w = D3 / D1
    R2_rate = np.cross(w, R2)
    D3_rate = (np.outer(R2_rate, R1) - np.outer(R1, R2_rate)) @ (v_i - v_r * m.delta) + (
        np.outer(R2, R1) - np.outer(R1, R2)
    ) @ (a_i - a_r * m.delta - v_r * delta_rate)
    D1_rate = np.cross(R1, R2_rate) @ m.r_ + np.cross(R1, R2) @ v_i
    return (D3_rate * D1 - D1_rate * D3) / D1**2


def eq33_axes(m: Moving):
    """R_i1, R_i2 of an SPU leg."""
    R1 = -m.e / np.linalg.norm(m.e)
    R2 = np.cross(R1, m.r_)
    return R1, R2 / np.linalg.norm(R2)


def eq32(m: Moving):
    """φ'_i1, φ'_i2: rates in the universal joint of an SPU leg."""
    R1, R2 = eq33_axes(m)
    d1 = np.cross(R1, R2) @ m.r_
    u = skew(m.delta) @ skew(m.delta) @ (m.v - skew(m.e) @ m.omega)
    phi1 = (-(skew(m.r_) @ R2) @ m.omega - u @ R2) / d1
    phi2 = ((skew(m.r_) @ R1) @ m.omega + u @ R1) / d1
    return phi1, phi2


def eq29(m: Moving):
    """ω_ri = ω - φ'_i1 R_i1 - φ'_i2 R_i2 of an SPU leg."""
    R1, R2 = eq33_axes(m)
    phi1, phi2 = eq32(m)
    return m.omega - phi1 * R1 - phi2 * R2


def eq33(m: Moving):
    """J_ωri of an SPU leg: ω_ri = J_ωri V_o. The last line of the print has r_i for its hat."""
    R1, R2 = eq33_axes(m)
    d1, d2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    D = skew(m.delta) @ skew(m.delta)
    return np.hstack([d2 @ D, d1 * np.eye(3) - d2 @ skew(m.r_) - d2 @ D @ skew(m.e)]) / d1


def eq34a(m: Moving):
    """ω_ri = ω + d_i2 D_i / d_i1 of an SPU leg."""
    R1, R2 = eq33_axes(m)
    d1, d2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    D = skew(m.delta) @ skew(m.delta)
    return m.omega + d2 @ (D @ m.v - skew(m.r_) @ m.omega - D @ skew(m.e) @ m.omega) / d1


def eq34b(m: Moving):
    """d'_i1, d'_i2 of an SPU leg, with r_i for the printed r_1."""
    R1, R2 = eq33_axes(m)
    v_i = eq6(m)[0]
    R1_rate, R2_rate = np.cross(m.omega, R1), np.cross(eq34a(m), R2)
    d1_rate = (m.omega @ R2) * (R1 @ m.r_) + np.cross(R1, R2) @ v_i
    d2_rate = np.outer(R1_rate, R2) + np.outer(R1, R2_rate) - np.outer(R2_rate, R1) - np.outer(R2, R1_rate)
    return d1_rate, d2_rate


def eq35(m: Moving):
    """ε_ri of an SPU leg, with r_i for the printed r_1."""
    R1, R2 = eq33_axes(m)
    v_i, v_r, _, a_i, a_r = eq34a_rates(m)
    w = eq34a(m)
    R1_rate, R2_rate = np.cross(m.omega, R1), np.cross(w, R2)
    first = (m.omega - w) * ((m.omega @ R2) * (R1 @ m.r_) + np.cross(R1, R2) @ v_i)
    second = (
        np.outer(R1_rate, R2) + np.outer(R1, R2_rate) - np.outer(R2_rate, R1) - np.outer(R2, R1_rate)
    ) @ (v_r * m.delta - v_i - np.cross(m.r_, m.omega))
    third = (np.outer(R1, R2) - np.outer(R2, R1)) @ (
        a_r * m.delta
        - a_i
        - np.cross(m.r_, m.eps)
        - np.cross(v_i, m.omega)
        + v_r * (v_i - v_r * m.delta) / m.r
    )
    return m.eps + (first + second + third) / (np.cross(R1, R2) @ m.r_)


def eq36(m1: Moving):
    """ω_L from leg 1, and J_ωL."""
    R1, R2 = eq22(m1)
    D11 = np.cross(R1, R2) @ m1.r_
    D = skew(m1.delta) @ skew(m1.delta)
    J = np.outer(R1, R2) @ D @ np.hstack([np.eye(3), -skew(m1.e)]) / D11
    return np.outer(R1, R2) @ (D @ m1.v - D @ skew(m1.e) @ m1.omega) / D11, J


def eq37(m1: Moving):
    """ε_L."""
    R1, R2 = eq22(m1)
    v_1, v_r, delta_rate, a_1, a_r = eq34a_rates(m1)
    D3, D11 = eq27(m1)
    R2_rate = np.cross(D3 / D11, R2)
    D_L = np.outer(R1, R2) @ (v_r * m1.delta - v_1)
    D_L_rate = np.outer(R1, R2_rate) @ (v_r * m1.delta - v_1) + np.outer(R1, R2) @ (
        a_r * m1.delta + v_r * delta_rate - a_1
    )
    D11_rate = np.cross(R1, R2_rate) @ m1.r_ + np.cross(R1, R2) @ v_1
    return (D_L_rate * D11 - D11_rate * D_L) / D11**2


def eq38(m: Moving, J_omega):
    """J_vpi and J_vqi: v_pi = J_vpi V_o, v_qi = J_vqi V_o."""
    row = np.concatenate([m.delta, np.cross(m.e, m.delta)])
    J_vp = np.outer(m.delta, row) - (m.r - m.lp) * skew(m.delta) @ J_omega
    return J_vp, -m.lq * skew(m.delta) @ J_omega


def eq39(m: Moving, w, w_rate):
    """a_pi and a_qi from the leg's angular velocity and acceleration."""
    _, v_r, _, _, a_r = eq34a_rates(m)
    d, turning = skew(m.delta), np.cross(w, np.cross(w, m.delta))
    a_p = a_r * m.delta - (m.r - m.lp) * d @ w_rate - 2 * v_r * d @ w + (m.r - m.lp) * turning
    return a_p, -m.lq * d @ w_rate + m.lq * turning


def eq40(mass, a, inertia, eps, gravity):
    """G + f and t of a link as printed; t lacks -ω × I ω, which is nothing for an isotropic I."""
    return mass * (gravity - a), -inertia @ eps


def eq43(legs: list[Moving], l, load, eta=1.0, mu=0.0, gravity=(0.0, 0.0, -9.81)):
    """F_r = (f_a1 … f_a5, f_c) of the paper's mechanism with the masses of Table II."""
    gravity, eye = np.array(gravity), np.eye(3)
    m0 = legs[0]
    force, torque = eq40(3.0, m0.a, 5 * eye, m0.eps, gravity)
    total = (load + np.concatenate([force - mu * m0.v, torque - mu * m0.omega])) / eta
    force, torque = eq40(2.0, np.zeros(3), 2 * eye, eq37(m0), gravity)
    total = total + eq36(m0)[1].T @ torque
    for i, m in enumerate(legs):
        rpu = i in (0, 2)
        J_omega, w_rate = (eq26(m), eq28(m)) if rpu else (eq33(m), eq35(m))
        J_p, J_q = eq38(m, J_omega)
        a_p, a_q = eq39(m, J_omega @ m.V, w_rate)
        force, torque = eq40(3.0, a_p, 3 * eye, w_rate, gravity)
        total = total + J_p.T @ force + J_omega.T @ torque
        force, torque = eq40(2.0, a_q, 2 * eye, w_rate, gravity)
        total = total + J_q.T @ force + J_omega.T @ torque
    return np.linalg.solve(eq13(legs, l).T, -total)


def eq44(r1, r3, c1, f_c, L=LU_L):
    """f_c1, f_c3 and the torque vector T_c1 as printed."""
    k = (np.cross(r1, c1) @ L) / (np.cross(r3, c1) @ L)
    f_c1 = f_c / (1 + k)
    return f_c1, f_c - f_c1, np.cross(r1, f_c1 * c1)


def coupled_forces(e1, e3, r1, r3, l, f_c, L=LU_L):
    """f_c1, f_c3 along c1 = r1×L/|r1×L|, from statics alone: at b1 and b3 they are the wrench f_c (c, τ).

    Six equations for two unknowns; that they hold is what Eq. 7, 8, 9, 10, 11 say.
    Returns the forces and the rest.
    """
    c1 = np.cross(r1, L) / np.linalg.norm(np.cross(r1, L))
    A = np.array([np.concatenate([c1, np.cross(e, c1)]) for e in (e1, e3)]).T
    wrench = f_c * np.concatenate(eq11(e1, r1, l, L))
    forces = np.linalg.lstsq(A, wrench, rcond=None)[0]
    return forces, A @ forces - wrench


def coupled_forces_of_the_notes(r1, r3, ll, f_c, L=LU_L):
    """f_c1, f_c3 from the massless rod's balance about L, and the torque on it. ll is the vector b3b1."""
    c1 = np.cross(r1, L) / np.linalg.norm(np.cross(r1, L))
    d1, d3, length = np.cross(r1, L) @ c1, np.cross(r3, L) @ c1, np.linalg.norm(ll)
    return np.array([f_c * d3 / length, -f_c * d1 / length]), f_c * d3 / length * d1
