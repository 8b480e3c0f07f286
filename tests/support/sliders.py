"""Mechanisms with slider legs of all kinds, with masses that lie off every axis."""

from __future__ import annotations

import functools
import math

import numpy as np

import polypod as pp
from polypod import Status

UNITS = {"length": "mm", "angle": "deg", "mass": "kg", "inertia": "kg m^2", "force": "N"}
PLATFORM = {"mass": 8, "center": [10, -5, 20], "inertia": [0.06, 0.07, 0.11]}
CARRIAGE = {"mass": 1.5, "center": [4, -6, 9]}
STRUT = {"mass": 0.8, "center": [5, -250, 3], "inertia": [0.03, 0.002, 0.029]}
ROUND = {"mass": 0.7, "center": 240, "inertia": [0.03, 0.002, 0.03]}
"""A strut with S at both ends."""


SEED = 70707
COUNT = 8


def slider(axis, strut, branch, base, platform, *, stroke=None, body=STRUT, **more):
    """A leg's table."""
    leg = {"slider": {"axis": axis, "strut": strut, "branch": branch}, "base": base, "platform": platform}
    leg |= {"carriage": CARRIAGE, "strut": body, "radius": 12}
    if stroke is not None:
        leg["stroke"] = {"min": stroke[0], "max": stroke[1]}
    return leg | more


def joint(kind, point, **more):
    """A joint's table."""
    return {"joint": kind, "point": point} | more


def polar(radius, angle, z=0):
    return {"radius": radius, "angle": angle, "z": z}


def pus():
    """Six PUS legs on parallel rails, which lean both ways; axes of the U joints along, across and skew."""
    platform = [(-60, -120), (150, -60), (-140, -50), (-140, 50), (150, 60), (-60, 120)]
    rails = zip((-400, -250, -90, 90, 250, 400), platform, (1, -1, 1, 1, -1, 1), strict=True)
    return [
        slider(
            [1, 0, 0],
            700,
            branch,
            joint("U", [0, y, 0], axis=[0.3 * (i % 2), 1, 0.2]),
            joint("S", [*b, 10 * (i % 3)]),
            stroke=(-900, 900),
            force={"min": -400, "max": 500},
        )
        for i, (y, b, branch) in enumerate(rails)
    ]


def prs():
    """Three PRS legs on rails that lean inwards."""
    legs = []
    for angle in (90, 210, 330):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        base = joint("R", polar(300, angle), axis={"angle": angle + 90}, range={"min": -60, "max": 60})
        legs.append(
            slider([-0.2 * c, -0.2 * s, 1], 500, 1, base, joint("S", polar(120, angle)), stroke=(-50, 500))
        )
    return legs


def puu():
    """Three PUU legs, with the axes of the U joints along rails that lean inwards: three translations."""
    legs = []
    for angle in (90, 210, 330):
        axis = [-math.cos(math.radians(angle)), -math.sin(math.radians(angle)), 1]
        base, platform = (joint("U", polar(r, angle), axis=axis) for r in (500, 120))
        legs.append(slider(axis, 600, 1, base, platform))
    return legs


def mixed():
    """Telescopic legs beside PSS, PUS and PSU, on rails every way, and a passive slider."""
    legs = []
    for angle in (90, 210, 330):
        legs.append(
            {
                "base": joint("U", polar(350, angle), axis={"angle": angle + 70, "z": 0.1}),
                "platform": joint("S", polar(140, angle + 15)),
                "cylinder": {"mass": 2, "center": [3, 200, 5], "inertia": [0.03, 0.01, 0.029]},
                "piston": {"mass": 1, "center": 150, "inertia": [0.01, 0.002, 0.01]},
                "radius": 12,
            }
        )
    base, end = polar(380, 30), polar(140, 60, 15)
    legs.append(slider([0.3, 0.1, 1], 500, 1, joint("S", base), joint("S", end), body=ROUND))
    base, end = joint("U", polar(380, 150), axis=[0.2, 1, 0.3]), joint("S", polar(140, 165))
    legs.append(slider([0, 0.2, 1], 450, 1, base, end, stroke=(-50, 500)))
    base, end = joint("S", polar(420, 270, 900)), joint("U", polar(140, 290), axis=[1, 0.2, 0.1])
    legs.append(slider([0, 0, -1], 520, 1, base, end))
    base, end = joint("U", [-100, 0, 0], axis=[0, 1, 0]), joint("S", [20, 30, 5])
    legs.append(slider([1, 0, 0.1], 800, -1, base, end, actuated=False))
    return legs


LEGS = {"pus": pus, "prs": prs, "puu": puu, "mixed": mixed}
HOME = {"pus": [0, 0, 400], "prs": [0, 0, 650], "puu": [0, 0, 700], "mixed": [0, 0, 600]}


def tables(name):
    """The content of a mechanism's file."""
    dynamics = {"efficiency": 0.9, "linear_damping": 20, "angular_damping": 3}
    content = {"name": name, "units": UNITS, "home": {"position": HOME[name]}, "platform": PLATFORM}
    return content | {"dynamics": dynamics, "legs": LEGS[name]()}


@functools.cache
def mechanism(name):
    """By name; never changed."""
    return pp.Mechanism.from_dict(tables(name))


@functools.cache
def states(name):
    """Random poses inside all limits that keep the constraints, with twists and accelerations."""
    mech, rng = mechanism(name), np.random.default_rng([SEED, *name.encode()])
    names = mech.equations_of_motion(mech.home, np.zeros(6), "pose").coordinates
    home = mech.coordinates(mech.home, "pose")
    width = {n: 0.15 * (mech.characteristic_length if n in "xyz" else 1.0) for n in names}

    def draw(middle):
        return {n: middle.get(n, 0.0) + width[n] * rng.uniform(-1, 1, 20 * COUNT) for n in names}

    state = mech.state(draw(home), draw({}), draw({}), guess=mech.home)
    usable = (state.status == Status.OK) & mech.limits(state.pose).within
    usable &= mech.conditioning(state.pose).sigma_min > 0.02
    chosen = np.flatnonzero(usable)[:COUNT]
    assert len(chosen) == COUNT
    return state.pose[chosen], state.twist[chosen], state.acceleration[chosen]
