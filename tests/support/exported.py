"""Common parts of the tests of exported files: mechanisms, and expected properties of their links."""

from __future__ import annotations

import functools

import numpy as np

import polypod as pp
from polypod.bodies.links import link_frames, links_of
from polypod.export.shapes import body_name
from polypod.multibody.tree import describe
from support import DATA, sliders
from support import cases as cases

LU = "lu-3spu-2rpu-r"
MECHANISMS = (LU, "ups-hexapod", "3-rps", "rod-lined", "rpr", "upf", "fpu", "fpf", "passive", "massless")
"""The paper's; six UPS; three RPS; legs coupled by a rod; R, F and U at either end; passive; no masses."""
MECHANISMS += tuple(f"slider {name}" for name in sliders.LEGS)

NASTY = {"1": "a/b", "2": "a b", "3": "a_b", "4": "αβ-->", "5": '<5 & "6">'}
"""Names of legs that no format takes, and that become the same."""


@functools.cache
def mechanism(name):
    """By name; never changed."""
    if name in (LU, "ups-hexapod"):
        return pp.load(name)
    if name.startswith("slider "):
        return sliders.mechanism(name.removeprefix("slider "))
    if name == "massless":
        return without_masses()
    return pp.load(DATA / f"{name}.toml") if name == "3-rps" else cases.case(name).mech


def without_masses():
    """Six UPS legs whose links have no masses, but for the platform."""
    tables = pp.load("ups-hexapod").to_dict()
    for leg in tables["legs"]:
        leg.pop("cylinder", None)
        leg.pop("piston", None)
    return pp.Mechanism.from_dict(tables)


def nasty():
    """The paper's mechanism with names that no format takes."""
    tables = pp.load(LU).to_dict()
    tables["name"] = "--> </robot> Müller's \N{ROBOT FACE}"
    tables["rods"][0]["name"] = "L/1"
    for leg in tables["legs"]:
        leg["name"] = NASTY[leg["name"]]
        if "rod" in leg["base"]:
            leg["base"]["rod"] = "L/1"
    return pp.Mechanism.from_dict(tables)


def regular_pose(mech):
    """A pose that is not nearly singular: home, but for the paper's mechanism."""
    if mech.name != LU:
        return mech.home
    return mech.pose({"alpha": 0.1, "p": -0.30, "h": 0.62, "beta": 0.7, "gamma": 0.6})


def nearby_poses(mech, count=2):
    """Poses about the regular one, with all constraints kept."""
    rng = np.random.default_rng(7)
    start = mech.inverse_kinematics(regular_pose(mech)).lengths
    found = []
    while len(found) < count:
        lengths = start + 0.02 * mech.characteristic_length * rng.normal(size=mech.n_legs)
        at = mech.forward_kinematics(lengths, regular_pose(mech))
        if at.status == pp.Status.OK:
            found.append(at.pose)
    return np.stack(found)


def places(mech, pose):
    """Frame (4, 4) of each body as the core has it, by the names of the multibody description."""
    frames = link_frames(mech, pose)
    links = links_of(mech)
    names = [body_name(mech, link) for link in links]
    # A leg with S at both ends spins as it likes.
    turns = ("cylinder", "piston", "strut")
    spins = [link.kind in turns and mech.leg_letters[link.index] in ("SPS", "PSS") for link in links]
    known = frames.turn_known & ~np.array(spins)
    return dict(zip(names, frames.frames, strict=True)), dict(zip(names, known, strict=True))


def bodies(mech):
    """Mass, centre and inertia of each link, straight from the mechanism file, by the same names."""
    spec = mech.geometry
    given = {"platform": spec["platform"]} | {f"rod {rod['name']}": rod["body"] for rod in spec["rods"]}
    for leg in spec["legs"]:
        if leg["slider"] is None:
            given |= {f"leg {leg['name']} {part}": leg[part] for part in ("cylinder", "piston")}
            continue
        slider, strut = leg["slider"], leg["piston"]
        # A radius of gyration of a tenth of the strut, of no effect; the strut's frame is at its foot.
        inertia = slider["carriage"]["mass"] * (0.1 * slider["strut"]) ** 2 * np.eye(3)
        given[f"leg {leg['name']} carriage"] = slider["carriage"] | {"inertia": inertia}
        center = np.add(strut["center"], [0.0, slider["strut"], 0.0])
        given[f"leg {leg['name']} strut"] = strut | {"center": center}
    assert given.keys() == {body.name for body in describe(mech).bodies}
    return given
