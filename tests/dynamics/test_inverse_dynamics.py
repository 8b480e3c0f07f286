"""Forces, energies and power of every mechanism against the oracle's virtual work."""

from __future__ import annotations

import numpy as np
import pytest

from support import oracle as o
from support.cases import FORCES, ROUNDING, SEED, agree, any_case, each, per_pose


@each
@pytest.mark.parametrize("load", ["file", "base", "platform"])
def test_inverse_dynamics(name, load):
    c = any_case(name)
    given = {"wrench": None, "axes": "base"}
    options = {}
    if load != "file":
        wrench = np.random.default_rng(SEED + 2).normal(size=(len(c.twist), 6)) * 100
        given = {"wrench": wrench, "axes": load}
        options = {"wrench": wrench, "wrench_axes": load}
    got = c.mech.inverse_dynamics(c.T, c.twist, c.acceleration, **options)
    active = o.actuated(c.spec)
    f = o.active_forces(c.spec, c.pose, c.twist, c.acceleration, **given)
    agree(got.forces[:, active], f, FORCES * per_pose(c.condition))
    reaction = o.reaction_wrench(c.spec, c.pose, c.twist, c.acceleration, **given)
    rows = c.mech.jacobian(c.T)[:, len(active) :]
    size = np.max(np.abs(f), axis=1, keepdims=True) + np.max(np.abs(reaction), axis=1, keepdims=True)
    error = np.einsum("nki,nk->ni", rows, got.constraint) - reaction
    assert np.all(np.abs(error) < FORCES * 10 * size * per_pose(c.condition))


@each
def test_passive_legs_do_not_push(name):
    c = any_case(name)
    passive = [i for i, leg in enumerate(c.spec["legs"]) if not leg["actuated"]]
    got = c.mech.inverse_dynamics(c.T, c.twist, c.acceleration)
    assert np.all(got.forces[:, passive] == 0)


@each
def test_energy(name):
    c = any_case(name)
    K, P, dK, dP = o.energy(c.spec, c.pose, c.twist, c.acceleration)
    got = c.mech.power(c.T, c.twist, c.acceleration)
    agree(got.kinetic, K)
    agree(got.potential, P)
    agree(got.kinetic_rate, dK)
    agree(got.potential_rate, dP)


@each
def test_power(name):
    c = any_case(name)
    got, spec, V = c.mech.power(c.T, c.twist, c.acceleration), c.spec, c.twist
    f = o.active_forces(spec, c.pose, c.twist, c.acceleration)
    rates = np.concatenate([leg.length.d for leg in c.legs], axis=1)[:, o.actuated(spec)]
    _, platform = o.generalised_force(spec, c.pose, c.twist, c.acceleration)
    size = np.sum(np.abs(f * rates), axis=1) + np.abs(got.kinetic_rate) + np.abs(got.potential_rate)
    tol = FORCES * 10 * c.condition * size
    assert np.all(np.abs(got.actuators - np.sum(f * rates, axis=1)) < tol)
    agree(got.load, np.sum(o.load_at(spec, c.pose) * V, axis=1))
    damping = spec["linear_damping"] * np.sum(V[:, :3] ** 2, axis=1)
    damping += spec["angular_damping"] * np.sum(V[:, 3:] ** 2, axis=1)
    agree(got.damping, -damping)
    agree(got.friction, (1 / spec["efficiency"] - 1) * np.sum(platform * V, axis=1), ROUNDING)
    assert np.all(np.abs(got.residual) < tol)
