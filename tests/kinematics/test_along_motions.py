"""Twists, accelerations, rates and powers along smooth motions against differences of positions."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from support import oracle as o
from support.cases import FILES, SLOPE, STENCIL, agree, any_case, at_time, motion_coordinates

SMOOTH = ("lu", *FILES)


@pytest.mark.parametrize("name", SMOOTH)
def test_states_are_differences_of_poses(name):
    mech, q = any_case(name).mech, motion_coordinates(name)
    first, second = o.differentiate(lambda t: mech.pose(at_time(*q, t)[0]), 8e-3)
    state = mech.state(*q)
    assert np.all(state.status == pp.Status.OK) or name == "lu"
    R = state.pose[:, :3, :3]
    Rt = np.swapaxes(R, 1, 2)
    agree(state.twist, np.concatenate([first[:, :3, 3], o.vee(first[:, :3, :3] @ Rt)], axis=1), STENCIL)
    agree(
        state.acceleration, np.concatenate([second[:, :3, 3], o.vee(second[:, :3, :3] @ Rt)], axis=1), STENCIL
    )


@pytest.mark.parametrize("name", SMOOTH)
def test_dependent_coordinates_move_as_differences(name):
    mech, q = any_case(name).mech, motion_coordinates(name)
    state = mech.state(*q)
    for k, value in state.coordinates.items():
        first, second = o.differentiate(lambda t, k=k: mech.state(*at_time(*q, t)).coordinates[k], 8e-3)
        agree(np.asarray(state.coordinate_rates[k]), first, STENCIL)
        agree(np.asarray(state.coordinate_second_rates[k]), second, STENCIL)
        assert np.all(np.isfinite(value))


@pytest.mark.parametrize("name", SMOOTH)
def test_energy_rates_are_differences(name):
    """K' and P' against differences of K and P along a motion in coordinates."""
    mech, q = any_case(name).mech, motion_coordinates(name)

    def at(t):
        state = mech.state(*at_time(*q, t))
        p = mech.power(state.pose, state.twist, state.acceleration)
        return np.stack([p.kinetic, p.potential, p.kinetic_rate, p.potential_rate])

    first, _ = o.differentiate(at, 8e-3)
    agree(first[:2].T, at(0.0)[2:].T, STENCIL)


@pytest.mark.parametrize("name", SMOOTH)
def test_second_order_of_central_differences(name):
    """Differences with halved steps come closer to the product's rates by a factor of four."""
    mech, q = any_case(name).mech, motion_coordinates(name)
    state = mech.state(*q)
    k = mech.kinematics(state.pose, state.twist, state.acceleration)

    def at(t):
        s = mech.state(*at_time(*q, t))
        m = mech.kinematics(s.pose, s.twist, s.acceleration)
        delta, n = m.directions, len(s.pose)
        centers = [m.piston_velocity.reshape(n, -1), m.cylinder_velocity.reshape(n, -1)]
        return [m.lengths, delta, m.rates, m.leg_omega, m.rod_omega, *centers, s.twist]

    exact = [
        k.rates,
        np.cross(k.leg_omega, k.directions),
        k.accelerations,
        k.leg_eps,
        k.rod_eps,
        k.piston_acceleration.reshape(len(k.rates), -1),
        k.cylinder_acceleration.reshape(len(k.rates), -1),
        state.acceleration,
    ]
    steps = 0.02 / 2.0 ** np.arange(4)
    errors = []
    for h in steps:
        plus, minus = at(h), at(-h)
        triples = zip(plus, minus, exact, strict=True)
        errors.append([np.linalg.norm((p - m) / (2 * h) - e) for p, m, e in triples])
    for series in np.array(errors).T:
        if series[0] > 1e-9:  # else rounding, where a coordinate itself is meant
            slope = np.polyfit(np.log(steps), np.log(series), 1)[0]
            assert slope == pytest.approx(2, abs=SLOPE)
