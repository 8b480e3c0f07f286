"""Forward dynamics and the terms of the equation of motion, for every mechanism of the catalogue.

The states are those of test_oracle.py: centre, uniform, near, at the strokes, near singularities.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest

import polypod as pp
from support import cases as t
from support import oracle as o

NAMES = ("lu", *t.FILES, *t.DRAWN)
each = pytest.mark.parametrize("name", NAMES)

INVERSE = 1e-9  # accelerations back from forces, relative
WELL = 1e5  # condition number up to which that holds; beyond it forces themselves lose more digits
DIFFERENCE = 1e-7  # eighth-order differences of a mass matrix, steps of 1e-2
ROUNDING = 1e-12


def size(x, rank=1):
    return np.max(np.abs(x), axis=tuple(range(-rank, 0)))


def relative(actual, expected, rank=1):
    assert np.isfinite(actual).all()
    return size(actual - expected, rank) / np.maximum(size(expected, rank), 1.0)


def sets_of(mech):
    """Coordinate sets of independent coordinates."""
    return [name for name in mech.coordinate_sets if name != "tool"]


def allowed(c):
    """Orthonormal twists (N, 6, d), rotations as arcs, that the oracle's constraints allow."""
    Z, scale = o.feasible_directions(c.spec, c.pose)
    return Z / np.broadcast_to(scale, Z.shape[-2])[:, None]


@functools.cache
def platform(name):
    c = t.any_case(name)
    return c.mech.equations_of_motion(c.T, c.twist)


# --- accelerations ------------------------------------------------------------------------------------------


@each
@pytest.mark.parametrize("load", ["file", "base", "platform"])
def test_forward_dynamics_inverts_inverse_dynamics(name, load):
    c = t.any_case(name)
    options = {}
    if load != "file":
        wrench = np.random.default_rng(5).normal(size=(len(c.twist), 6)) * 100
        options = {"wrench": wrench, "wrench_axes": load}
    inverse = c.mech.inverse_dynamics(c.T, c.twist, c.acceleration, **options)
    # Whatever stands in the places of passive legs is not read.
    forces = np.where(c.mech.actuated, inverse.forces, np.nan)
    found = c.mech.forward_dynamics(c.T, c.twist, forces, **options)
    assert (found.status == inverse.status).all()
    tol = np.maximum(INVERSE, 1e-14 * c.condition * (c.condition > WELL))
    assert (relative(found.acceleration, c.acceleration) < tol).all()
    if c.mech.dof < 6:
        assert (relative(found.constraint, inverse.constraint) < INVERSE).all()


@each
def test_accelerations_are_those_of_virtual_work(name):
    """Without Polypod's inverse dynamics: the oracle's accelerations, forces and work on allowed twists."""
    c = t.any_case(name)
    forces = np.random.default_rng(6).normal(size=(len(c.twist), c.mech.n_legs)) * 100 * c.mech.actuated
    found = c.mech.forward_dynamics(c.T, c.twist, forces)
    A, Z = found.acceleration, allowed(c)
    work, _ = o.generalised_force(c.spec, c.pose, c.twist, A)
    rows = o.leg_gradient(c.spec, c.pose)
    left = work + np.einsum("nki,nk->ni", rows, forces[:, o.actuated(c.spec)])
    balance = np.einsum("nij,ni->nj", Z, left)
    scale = size(np.einsum("nij,ni->nj", Z, np.abs(work))) + size(forces) + size(A)
    assert (size(balance) < 1e-10 * scale).all()
    # And they keep the constraints: a point that starts with this twist and acceleration stays on them.
    second = o.residuals(c.spec, o.moving(c.pose, c.twist, A)).dd
    assert (size(second) < 1e-10 * (1 + size(A) + size(c.twist) ** 2)).all()


def test_accelerations_stand_in_a_direct_singularity():
    """There actuators control less than the platform can do, but masses determine what it does."""
    mech = pp.load("lu-3spu-2rpu-r")
    free = {"alpha": 0.1, "p": -0.3, "h": 0.62, "gamma": 0.6}
    zero = mech.singularity_distance(mech.pose(free | {"beta": 0.7}))
    beta = zero.singular[zero.coordinates.index("beta"), 1]
    pose = mech.pose(free | {"beta": beta})
    assert mech.singularity(pose).kind == pp.SingularityKind.ACTUATION
    assert mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6)).status == pp.Status.SINGULAR
    found = mech.forward_dynamics(pose, np.zeros(6), np.zeros(5))
    assert np.isfinite(found.acceleration).all()
    near = mech.pose(free | {"beta": beta - 1e-8})
    beside = mech.forward_dynamics(near, np.zeros(6), np.zeros(5))
    assert np.allclose(found.acceleration, beside.acceleration, rtol=1e-6, atol=1e-6)


def test_a_platform_alone_falls_as_a_body():
    """Massless legs without force: Newton and Euler for the platform's body."""
    c = t.case("6-ups")
    content = c.mech.to_dict()
    for leg in content["legs"]:
        leg.pop("piston"), leg.pop("cylinder")
    for key in ("load", "dynamics"):
        content.pop(key, None)
    mech = pp.Mechanism.from_dict(content)
    V = c.twist
    found = mech.forward_dynamics(c.T, V, np.zeros(6), np.zeros(6)).acceleration
    body, R = mech.geometry["platform"], c.T[:, :3, :3]
    inertia = R @ np.array(body["inertia"]) @ R.swapaxes(1, 2)
    omega, center = V[:, 3:], R @ np.array(body["center"])
    spin = np.einsum("nij,nj->ni", inertia, omega)
    eps = np.linalg.solve(inertia, -np.cross(omega, spin)[..., None])[..., 0]
    a = np.array(mech.geometry["gravity"]) - np.cross(eps, center) - np.cross(omega, np.cross(omega, center))
    assert (relative(found, np.hstack([a, eps])) < ROUNDING).all()


def test_status():
    mech = pp.load("lu-3spu-2rpu-r")
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
    off = pose.copy()
    off[1, 3] += 0.01
    rest, force = np.zeros(6), np.zeros(5)
    assert mech.forward_dynamics(off, rest, force).status == pp.Status.OFF_CONSTRAINT
    assert mech.forward_dynamics(pose, [0, 0, 0, 1, 0, 0], force).status == pp.Status.OFF_CONSTRAINT
    assert mech.forward_dynamics(pose, rest, [0, 0, np.nan, 0, 0]).status == pp.Status.INVALID_INPUT
    assert mech.equations_of_motion(off, rest).status == pp.Status.OFF_CONSTRAINT
    batch = mech.forward_dynamics(np.stack([pose, off]), rest, force)
    assert batch.status.tolist() == [pp.Status.OUT_OF_STROKE, pp.Status.OFF_CONSTRAINT]
    assert np.isfinite(batch.acceleration[0]).all()
    assert np.isnan(batch.acceleration[1]).all()


def test_where_constraints_are_lost_there_is_no_answer():
    """The 3-RPS upside down: its three constraint forces balance, and how they share a load is open."""
    mech = pp.load(t.DATA / "3-rps.toml")
    pose = t.matrix((o.turn([0.0, np.pi, 0.0]), np.array([-0.15, 0.0, 0.4])))
    assert mech.singularity(pose).kind == pp.SingularityKind.CONSTRAINT
    found = mech.forward_dynamics(pose, np.zeros(6), np.ones(3))
    assert found.status == pp.Status.SINGULAR
    assert np.isnan(found.acceleration).all()
    assert np.isnan(found.constraint).all()


# --- terms --------------------------------------------------------------------------------------------------


@each
def test_mass_matrix_is_symmetric_and_positive_definite(name):
    c, e = t.any_case(name), platform(name)
    assert (size(e.mass - e.mass.swapaxes(1, 2), 2) <= ROUNDING * size(e.mass, 2)).all()
    Z = allowed(c)
    assert (np.linalg.eigvalsh(Z.swapaxes(1, 2) @ e.mass @ Z) > 0).all()
    for set in sets_of(c.mech):
        q = c.mech.equations_of_motion(c.T, c.twist, set)
        ok = q.status != pp.Status.FOLD
        assert ok.sum() > len(ok) / 3
        assert (size(q.mass - q.mass.swapaxes(1, 2), 2)[ok] <= 1e-9 * size(q.mass, 2)[ok]).all()
        assert (np.linalg.eigvalsh(q.mass[ok]) > 0).all()


@each
def test_kinetic_energy_and_weight(name):
    """½ V'MV is the energy of all links, and g the gradient of the potential one, both by the oracle."""
    c = t.any_case(name)
    content = c.mech.to_dict()
    content.get("dynamics", {}).pop("efficiency", None)
    mech, spec = pp.Mechanism.from_dict(content), c.spec | {"efficiency": 1.0}
    e = mech.equations_of_motion(c.T, c.twist)
    K, _, _, dP = o.energy(spec, c.pose, c.twist, c.acceleration)
    t.agree(0.5 * np.einsum("ni,nij,nj->n", c.twist, e.mass, c.twist), K)
    t.agree(np.sum(e.gravity * c.twist, axis=1), dP)
    for set in sets_of(mech):
        q = mech.equations_of_motion(c.T, c.twist, set)
        ok = q.status != pp.Status.FOLD
        ok[ok] = np.linalg.cond(q.twist_jacobian[ok]) < 1e4
        kinetic = 0.5 * np.einsum("ni,nij,nj->n", q.rates, q.mass, q.rates)
        assert (np.abs(kinetic - K)[ok] <= 1e-9 * (1 + K[ok])).all()
        t.agree(np.einsum("ni,ni->n", q.gravity, q.rates)[ok], dP[ok], 1e-9)


@each
def test_the_terms_make_up_the_forces(name):
    """M A + C V + D V + g = J'(f, f_c) + W/η in platform space; S' of it in coordinates."""
    c, e = t.any_case(name), platform(name)
    inverse = c.mech.inverse_dynamics(c.T, c.twist, c.acceleration)
    push = np.concatenate([inverse.forces[:, c.mech.actuated], inverse.constraint], axis=1)
    load = o.load_at(c.spec, c.pose) / c.spec["efficiency"]
    right = np.einsum("nji,nj->ni", c.mech.jacobian(c.T), push) + load
    left = np.einsum("nij,nj->ni", e.mass, c.acceleration) + e.gravity
    left += np.einsum("nij,nj->ni", e.coriolis + e.damping, c.twist)
    tol = 1e-10 * (1 + size(push)) * np.maximum(1, 1e-5 * c.condition)
    assert (size(left - right) < tol).all()
    legs = c.mech.jacobian(c.T)[:, : c.mech.dof]
    t.agree(e.leg_jacobian[:, c.mech.actuated], legs)
    t.agree(e.rates, c.twist)


STENCIL = ((1, 4 / 5), (2, -1 / 5), (3, 4 / 105), (4, -1 / 280))  # eighth order, first derivative


@pytest.mark.parametrize("name", ["lu", *t.FILES])
def test_coriolis_matrix_in_coordinates(name):
    """C is the one of Christoffel: M' - 2C is skew, M' by differences along the coordinates themselves."""
    mech = t.any_case(name).mech
    q, rates, _ = t.motion_coordinates(name)
    at = mech.state(q, rates)
    e = mech.equations_of_motion(at.pose, at.twist, [*q])
    assert e.coordinates == tuple(q)
    given = np.stack([*rates.values()], axis=-1)
    t.agree(e.rates, given, 1e-10)

    def mass(name, shift):
        shifted = {k: v + (shift if k == name else 0.0) for k, v in q.items()}
        return mech.equations_of_motion(mech.pose(shifted), np.zeros(6), [*q]).mass

    h = 1e-2
    dM = np.stack(
        [sum(w * (mass(k, i * h) - mass(k, -i * h)) for i, w in STENCIL) / h for k in q], axis=-1
    )  # (N, i, j, k): ∂M_ij/∂q_k
    gamma = 0.5 * (dM + dM.swapaxes(-1, -2) - np.moveaxis(dM, -1, 1))
    C = np.einsum("nijk,nk->nij", gamma, given)
    t.agree(e.coriolis, C, DIFFERENCE)
    turn = np.einsum("nijk,nk->nij", dM, given) - 2 * e.coriolis
    assert (size(turn + turn.swapaxes(1, 2), 2) < DIFFERENCE * size(e.coriolis, 2)).all()


@each
def test_mass_rate_less_twice_coriolis_is_skew_in_platform_space(name):
    """On the allowed twists, with M' by differences along a motion that keeps the constraints."""
    c, e = t.any_case(name), platform(name)
    keep = c.condition < WELL
    h = 1e-4

    def mass(step):
        pose = o.close(c.spec, o.along(c.pose, c.twist, c.acceleration, step))
        return c.mech.equations_of_motion(t.matrix(pose), np.zeros(6)).mass

    rate = sum(w * (mass(i * h) - mass(-i * h)) for i, w in STENCIL) / h
    Z = allowed(c)
    turn = Z.swapaxes(1, 2) @ (rate - 2 * e.coriolis) @ Z
    scale = size(Z.swapaxes(1, 2) @ e.coriolis @ Z, 2) + size(e.mass, 2) * 1e-2
    error = size(turn + turn.swapaxes(1, 2), 2) / scale
    assert (error[keep] < 1e-6).all(), error


def test_coriolis_matrix_at_rest_and_at_a_snails_pace():
    """It is linear in the twist, also where squares of the twist are far below rounding."""
    mech = pp.load("lu-3spu-2rpu-r")
    state = mech.state(
        {"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6}, {"alpha": 1.0, "p": 0.3}
    )
    for coordinates in (None, "natural"):
        full = mech.equations_of_motion(state.pose, state.twist, coordinates).coriolis
        slow = mech.equations_of_motion(state.pose, 1e-12 * state.twist, coordinates).coriolis
        rest = mech.equations_of_motion(state.pose, 0 * state.twist, coordinates).coriolis
        assert np.allclose(1e12 * slow, full, rtol=1e-3, atol=1e-3 * abs(full).max())
        assert abs(rest).max() < 1e-9


def test_coordinates_of_the_equations():
    mech = pp.load("lu-3spu-2rpu-r")
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
    rest = np.zeros(6)
    assert mech.equations_of_motion(pose, rest, "paper").coordinates == ("x", "y", "z", "alpha", "beta")
    assert len(mech.equations_of_motion(pose, rest, "pose").coordinates) == 5
    named = mech.equations_of_motion(pose, rest, ["x", "z", "rx", "ry", "rz"])
    assert named.coordinates == ("x", "z", "rx", "ry", "rz")
    with pytest.raises(pp.CoordinateError, match="not independent"):
        mech.equations_of_motion(pose, rest, "tool")
    with pytest.raises(pp.CoordinateError, match="no coordinate set"):
        mech.equations_of_motion(pose, rest, ["x", "h"])
    with pytest.raises(pp.UnknownNameError, match="natural"):
        mech.equations_of_motion(pose, rest, "naturel")
    fold = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.0})
    assert mech.equations_of_motion(fold, rest, "paper").status == pp.Status.FOLD
    assert pp.Status(int(mech.equations_of_motion(fold, rest, "natural").status)).has_answer
