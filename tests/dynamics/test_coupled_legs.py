"""Reactions of two legs on one rod: the paper's coupled forces, and the constraint wrench."""

from __future__ import annotations

import numpy as np
import pytest

from support import oracle as o
from support.cases import ALL, Case, any_case
from support.reactions import CLOSED, REDUNDANT, SAME, light, named, reactions, scale_of


def on_rod(c: Case):
    """Indices of the two coupled legs, of their platform joints among all, and c_1 (N, 3)."""
    legs = [c.mech.leg_names.index(leg) for leg in c.mech.coupled_legs]
    first = c.legs[legs[0]]
    c1 = o.unit(o.cross(first.r, first.base_axis)).x
    return legs, [len(c.spec["rods"]) + 3 * i + 2 for i in legs], c1


def carried(c: Case, legs):
    """Work (N, 6) on the six unit twists of the given forces of legs, and of the rod with its first leg."""
    now, shifted = o.links_at(c.spec, c.jets), o.links_at(c.spec, o.six_directions(c.pose))
    ours, at = [], 0
    for link in now:
        if link.name == "rod":
            ours.append(on_rod(c)[0][0] in legs)
        elif link.name == "platform":
            ours.append(False)
        else:
            ours.append(at // 2 in legs)
            at += 1
    total = np.zeros_like(c.twist)
    for link, moved, mine in zip(now, shifted, ours, strict=True):
        if mine:
            force, torque = o.link_wrench(link, c.spec["gravity"])
            work = np.sum(moved.center.d * force + o.spin_of(moved.frame)[0] * torque, axis=-1)
            total += np.moveaxis(work, 0, -1)
    return total


@pytest.mark.parametrize("name", ["lu", "rod-lined"])
def test_coupled_forces_fall_out_of_massless_legs(name):
    """f_c1, f_c3 are the forces along c_1 on the platform, T_c the torque on the rod [Eq. 44, put right]."""
    c = light(name)
    answer, dynamics = reactions(c), c.mech.inverse_dynamics(c.T, c.twist, c.acceleration)
    coupled = c.mech.coupled_forces(c.T, dynamics.constraint)
    _, above, c1 = on_rod(c)
    size = scale_of(c, answer.reactions)
    along = np.einsum("nja,na->nj", answer.reactions[:, above, :3], c1)
    assert np.all(np.abs(along - coupled.forces) <= SAME * size[:, None])
    assert np.all(np.abs(answer.reactions[:, above, 3:]) <= SAME * size[:, None, None])
    # Leg 1 turns the rod about its line with T_c, leg 3 against it; told is what the rod does to them.
    L, point = c.spec["rods"][0]["axis"], c.spec["rods"][0]["point"]
    below = [k - 2 for k in above]
    lever = answer.points[:, below] - point
    about = (answer.reactions[:, below, 3:] + np.cross(lever, answer.reactions[:, below, :3])) @ L
    torques = np.stack([-coupled.torque, coupled.torque], axis=-1)
    assert np.all(np.abs(about - torques) <= SAME * size[:, None])
    # Together with what couples there are they are the wrench f_c (c, τ).
    row = c.mech.jacobian(c.T)[:, -1]
    assert np.all(np.abs(answer.constraint_wrench - dynamics.constraint * row) <= SAME * size[:, None])


@pytest.mark.parametrize("name", ["lu", "rod-lined"])
def test_with_mass_they_are_what_legs_carry_and_the_coupled_forces(name):
    """The effect of the legs' own mass at b, carried there as in [T14], is the whole difference."""
    c = any_case(name)
    answer, dynamics = reactions(c), c.mech.inverse_dynamics(c.T, c.twist, c.acceleration)
    coupled = c.mech.coupled_forces(c.T, dynamics.constraint)
    legs, above, c1 = on_rod(c)
    size = scale_of(c, answer.reactions)
    for i, leg in enumerate(legs):
        own = carried(c, [leg])[:, :3]
        along = np.einsum("na,na->n", answer.reactions[:, above[i], :3] - own, c1)
        assert np.all(np.abs(along - coupled.forces[:, i]) <= SAME * size)
    row = c.mech.jacobian(c.T)[:, -1]
    whole = carried(c, legs) + dynamics.constraint * row
    assert np.all(np.abs(answer.constraint_wrench - whole) <= SAME * size[:, None])


@pytest.mark.parametrize("name", [*ALL, *REDUNDANT])
def test_the_constraint_wrench_is_determinate(name):
    """The sum over the legs that constrain the platform, active forces taken off; `least` has the same."""
    c = named(name)
    answer, mobility = reactions(c), c.mech.mobility()
    legs = {leg for leg, _ in mobility.constraint_rows}
    for rod in range(len(c.spec["rods"])):
        carried_by_rod = [leg["name"] for leg in c.spec["legs"] if leg["base"]["rod"] == rod]
        legs |= {*carried_by_rod} if len(carried_by_rod) > 1 else set()
    center = c.pose[1]
    for found in (answer.reactions, answer.least):
        total = np.zeros((len(c.twist), 6))
        for i, leg in enumerate(c.mech.leg_names):
            if leg in legs:
                k = len(c.spec["rods"]) + 3 * i + 2
                force = found[:, k, :3]
                total[:, :3] += force
                total[:, 3:] += found[:, k, 3:] + np.cross(answer.points[:, k] - center, force)
                at = c.legs[i]
                axial = answer.reactions_in_joint[:, k - 1, 1:2] if c.spec["legs"][i]["actuated"] else 0.0
                total -= axial * np.concatenate([at.delta.x, np.cross(at.e.x, at.delta.x)], axis=-1)
        assert np.all(np.abs(answer.constraint_wrench - total) <= CLOSED * scale_of(c, found)[:, None])
