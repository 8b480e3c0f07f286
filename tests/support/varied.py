"""Motions at which inverse dynamics is differentiated."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from support import oracle as o
from support.cases import ALL, any_case, matrix

STEP = 2e-4  # of m, rad, their rates and second rates

each = pytest.mark.parametrize("name", ALL)


@functools.cache
def motions(name, n, seed=1):
    """N random motions (T, twist, acceleration) about home that keep the joints closed, at regular poses."""
    c, rng = any_case(name), np.random.default_rng([seed, *name.encode()])
    if name == "lu":
        span = [0.4, 0.3, 0.1, 0.3, 0.3]
        natural = np.array([0.0, -0.1, 0.65, 0.7, 0.7]) + rng.uniform(-1, 1, (2 * n, 5)) * span
        pose = c.mech.pose(dict(zip(("alpha", "p", "h", "beta", "gamma"), natural.T, strict=True)))
        pose = pose[:, :3, :3], pose[:, :3, 3]
    else:
        R, center = o.home(c.spec)
        d = rng.uniform(-1, 1, size=(8 * n, 6)) * ([0.06] * 3 + [0.4] * 3)
        pose = o.close(c.spec, (o.turn(d[:, 3:]) @ R, center + d[:, :3]))
        closed = np.max(np.abs(o.residuals(c.spec, pose).x), axis=-1) < 1e-13
        pose = tuple(p[closed] for p in pose)
    # The most regular ones: near singular poses and legs along their axes differences lose digits.
    at = c.mech.singularity(matrix(pose))
    use = np.argsort(np.minimum(at.sigma_min, at.leg_sine.min(axis=-1) / 5))[-n:]
    pose = tuple(p[use] for p in pose)
    q = rng.normal(size=(2, n, 6)) * ([0.5] * 3 + [2.0] * 3)
    return matrix(pose), *o.feasible_motion(c.spec, pose, q[0], q[1] * 5)


def sample(name):
    """Mechanism in both models, and three motions."""
    c = any_case(name)
    return c.mech, c.spec, motions(name, 3)


@functools.cache
def derivatives(name):
    mech, _, at = sample(name)
    return mech.inverse_dynamics_derivatives(*at)


def forces(mech, *motion):
    d = mech.inverse_dynamics(*motion)
    assert np.all(np.isfinite(d.forces))
    return d


def coordinates_of(name):
    """States of the sample by the coordinates that are varied: values, rates, second rates; and poses."""
    mech, _, (T, *_) = sample(name)
    names = derivatives(name).coordinates
    set = next(s for s, all in mech.coordinate_sets.items() if {*names} <= {*all} and s != "paper")
    q = {k: mech.coordinates(T, set)[k] for k in names}
    rng = np.random.default_rng(len(name))
    rates, second = (dict(zip(names, x, strict=True)) for x in rng.normal(size=(2, len(names), len(T))))

    def moves(k):
        """How far a unit of one second rate goes: far near a fold, which differences would not see."""
        unit, rest = (mech.state(q, {}, {k: x}, guess=T).acceleration for x in (1.0, 0.0))
        return np.abs(unit - rest).max(axis=-1)

    use = np.argsort(np.max([moves(k) for k in names], axis=0))[:2]
    return mech, names, set, [{k: v[use] for k, v in s.items()} for s in (q, rates, second)], T[use]


def numbers(spec):
    """All numbers of the geometry by name."""
    found = {}
    for leg in spec["legs"]:
        for side in ("base", "platform"):
            for key in ("point", "axis", "normal"):
                if leg[side][key] is not None:
                    found[f"leg {leg['name']} {side} {key}"] = leg[side][key]
    for rod in spec["rods"]:
        found |= {f"rod {rod['name']} {key}": rod[key] for key in ("point", "axis")}
    return {f"{name}_{c}": x for name, v in found.items() for c, x in zip("xyz", v, strict=True)}
