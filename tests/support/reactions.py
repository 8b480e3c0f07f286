"""Mechanisms for joint reactions, and what they answer."""

from __future__ import annotations

import functools

import numpy as np

import polypod as pp
from support import oracle as o
from support.cases import SEED, Case, any_case, draw, plain

CLOSED = 1e-9  # of the largest reaction of a state: what a balance may leave
SAME = 1e-8  # of the largest reaction: two systems of balances, times rounding and condition numbers

# Passive legs (marked by -) that repeat the constraints of another leg of their kind.
REDUNDANT = {
    "rps-again": ["RPS", "RPS-", "RPS", "RPS"],
    "upu-twice-again": ["UPS", "UPU", "UPU-", "UPU-", "UPS", "SPU", "UPS"],
    "rpu-again": ["RPU", "RPU-", "UPS", "SPU", "SPS"],
    "fpu-again": ["FPU", "FPU-", "UPS", "SPS"],
}


def twin_tables(name):
    """A drawn mechanism in which passive legs repeat the constraints of another leg of their kind.

    Their base joint is displaced to where that leg's constraints do not change: along the base axis for UPU
    (and the platform joint along its own), across the axis for R, along the leg for F.
    """
    kinds = REDUNDANT[name]
    tables = draw(name, kinds, np.random.default_rng([SEED, *name.encode()]))
    spec, legs = o.read(tables), tables["legs"]
    per = 1 / o.UNITS["length"][tables["units"]["length"]]
    for i, kind in enumerate(kinds):
        like = next(k for k, other in enumerate(kinds) if other.strip("-") == kind.strip("-"))
        if not kind.endswith("-") or like == i:
            continue
        at = o.leg_at(spec, spec["legs"][like], o.home(spec))
        step = {"U": at.base_axis, "R": np.cross(at.n.x, at.delta.x), "F": at.delta.x}[kind[0]]
        legs[i] |= {side: dict(legs[like][side]) for side in ("base", "platform")}
        legs[i]["base"]["point"] = np.array(legs[like]["base"]["point"]) - 0.1 * (i - like) * step * per
        if kind.startswith("UPU"):
            along = np.array(legs[like]["platform"]["axis"]) * 0.07 * (i - like) * per
            legs[i]["platform"]["point"] = np.array(legs[like]["platform"]["point"]) + along
    return plain(tables)


@functools.cache
def twin(name) -> Case:
    tables = twin_tables(name)
    spec = o.read(tables)
    rng = np.random.default_rng(SEED + 5)
    R, c = o.home(spec)
    d = rng.uniform(-1, 1, size=(6, 6)) * ([0.08] * 3 + [0.3] * 3)
    d[0] = 0.0
    pose = o.close(spec, (o.turn(d[:, 3:]) @ R, c + d[:, :3]))
    assert np.max(np.abs(o.residuals(spec, pose).x)) < 1e-13
    twist, acceleration = o.feasible_motion(spec, pose, *rng.normal(size=(2, 6, 6)))
    return Case(pp.Mechanism.from_dict(tables), spec, pose, twist, acceleration)


def named(name) -> Case:
    return twin(name) if name in REDUNDANT else any_case(name)


def reactions(c: Case, **options):
    return c.mech.joint_reactions(c.T, c.twist, c.acceleration, **options)


def scale_of(c: Case, found):
    """The largest reaction of each state, N: torques over the characteristic length."""
    size = c.mech.characteristic_length
    return np.maximum(np.max(np.abs(found / ([1.0] * 3 + [size] * 3)), axis=(1, 2)), 1e-3)


def light(name) -> Case:
    """The states with legs and rods that have no mass."""
    c = any_case(name)
    tables = c.mech.to_dict()
    for rod in tables["rods"]:
        for key in ("mass", "center", "inertia"):
            del rod[key]
    for leg in tables["legs"]:
        del leg["cylinder"], leg["piston"]
    return Case(pp.Mechanism.from_dict(tables), o.read(tables), c.pose, c.twist, c.acceleration)
