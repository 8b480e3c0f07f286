"""Derivatives of inverse dynamics by points and axes, against differences."""

from __future__ import annotations

import copy
import functools
import re

import numpy as np
import pytest

import polypod as pp
from support import oracle as o
from support.cases import ALL, TIED, any_case, plain
from support.varied import STEP, coordinates_of, derivatives, each, forces, numbers


def described(spec, tied):
    """The mechanism of a description, made anew; its home pose closes it with the rods of `tied`."""
    R, center = o.close({**spec, "tied": tied}, o.home(spec))
    w, sine = o.vee((R - R.T) / 2), np.linalg.norm(o.vee((R - R.T) / 2))
    turned = w * (np.arctan2(sine, (np.trace(R) - 1) / 2) / sine if sine else 1.0)

    def joint(j):
        rod = None if j["rod"] is None else spec["rods"][j["rod"]]["name"]
        return {k: {**j, "rod": rod}[k] for k in ("joint", "point", "axis", "normal", "rod")}

    def given(x):
        if isinstance(x, dict):
            return {k: given(v) for k, v in x.items() if v is not None}
        return [given(v) for v in x] if isinstance(x, list) else x

    tables = {k: spec[k] for k in ("name", "load", "tool", "platform")}
    tables["dynamics"] = {k: spec[k] for k in ("gravity", "efficiency", "linear_damping", "angular_damping")}
    tables["units"] = {kind: next(iter(names)) for kind, names in o.UNITS.items()}  # SI
    tables["home"] = {"position": center, "rotation_vector": turned}
    tables["rods"] = [{k: r[k] for k in ("name", "point", "axis")} | (r["body"] or {}) for r in spec["rods"]]
    tables["legs"] = [
        {k: leg[k] for k in ("name", "actuated", "cylinder", "piston")}
        | {side: joint(leg[side]) for side in ("base", "platform")}
        for leg in spec["legs"]
    ]
    return pp.Mechanism.from_dict(plain(given(tables)))


def settled(spec, lined):
    """The description with what its free numbers decide.

    Joints on a rod stay on it, and where the legs on it have their platform axes on one line they stay on
    that; both axes of an F joint rotation as one.
    """
    joints = [leg[side] for leg in spec["legs"] for side in ("base", "platform")]
    for j in (j for j in joints if j["joint"] == "F"):
        j["axis"], j["normal"] = (o.turn(j["turn"]) @ j[key] for key in ("axis", "normal"))
    on_rod = [leg for leg in spec["legs"] if leg["base"]["rod"] is not None]
    for leg in on_rod:
        rod = spec["rods"][leg["base"]["rod"]]
        leg["base"]["point"] = rod["point"] + leg["base"]["along"] * rod["axis"]
    for leg in on_rod[1:] if lined else ():
        first = on_rod[0]["platform"]
        leg["platform"]["axis"] = first["axis"]
        leg["platform"]["point"] = first["point"] + leg["platform"]["along"] * first["axis"]
    return spec


def freed(spec, lined):
    """The description and its free numbers: names, places of the dictionaries, keys and steps."""
    spec, free = copy.deepcopy(spec), []
    on_rod = [leg for leg in spec["legs"] if leg["base"]["rod"] is not None]
    for i, leg in enumerate(spec["legs"]):
        for side in ("base", "platform"):
            j, keys = leg[side], ["point"]
            if j["joint"] == "F":
                j["turn"] = np.zeros(3)
                keys += ["turn"]
            elif j["axis"] is not None:
                keys += ["axis"]
            if j["rod"] is not None:
                rod = spec["rods"][j["rod"]]
                j["along"], keys = (j["point"] - rod["point"]) @ rod["axis"], ["along"]
            if side == "platform" and lined and leg in on_rod[1:]:
                first = on_rod[0]["platform"]
                j["along"], keys = (j["point"] - first["point"]) @ first["axis"], ["along"]
            free += [(("legs", i, side), key) for key in keys]
    free += [(("rods", k), key) for k in range(len(spec["rods"])) for key in ("point", "axis")]
    steps = [(at, key, step) for at, key in free for step in ([1.0] if key == "along" else np.eye(3))]
    return spec, steps


def stepped(spec, free, lined, by):
    """The description with all its free numbers changed."""
    spec = copy.deepcopy(spec)
    for (at, key, step), t in zip(free, by, strict=True):
        place = functools.reduce(lambda x, k: x[k], at, spec)
        place[key] = place[key] + t * step
    for axes in ([leg[side] for leg in spec["legs"] for side in ("base", "platform")], spec["rods"]):
        for j in axes:
            if j["axis"] is not None:
                j["axis"] = j["axis"] / np.linalg.norm(j["axis"])
    return settled(spec, lined)


def scaled(spec, by):
    spec = copy.deepcopy(spec)
    for j in [*(leg[side] for leg in spec["legs"] for side in ("base", "platform")), *spec["rods"]]:
        j["point"] = j["point"] * (1 + by)
    return spec


@pytest.mark.parametrize("name", [*ALL, *TIED])
def test_by_geometry(name):
    """Against the mechanism made anew, at the same coordinates.

    All numbers that can change alone change at random rates, those that must follow them with them; and all
    points in proportion.
    """
    mech, _, set, series, guess = coordinates_of(name)
    state = mech.state(*series, guess=guess)
    by = mech.inverse_dynamics_derivatives(state.pose, state.twist, state.acceleration, set=set)
    original, mobility = any_case(name).spec, mech.mobility()
    assert by.geometry == tuple(numbers(original))
    rows, chosen = mobility.constraint_rows, mobility.independent_rows
    # The multiplier of kind E goes by a length at the home pose, another one in a mechanism made anew.
    comparable = [rows[k][1] != "E" for k in chosen]
    found = np.concatenate(
        [by.forces_by_geometry, by.constraint_by_geometry[:, comparable], by.lengths_by_geometry], axis=1
    )
    assert np.all(np.isfinite(found))
    redundant = len(chosen) < len(rows)
    spec, free = freed(original, redundant)
    ways = [lambda t: scaled(original, t)]
    if original["rods"] or not redundant:  # else axes are parallel, points in planes: none changes alone
        rates = np.random.default_rng(len(name)).normal(size=(3, len(free)))
        rates /= np.linalg.norm(rates, axis=-1, keepdims=True)
        ways += [lambda t, x=x: stepped(spec, free, redundant, t * x) for x in rates]
    for way in ways:

        def at(t, way=way):
            changed = way(t)
            m = described(changed, original)
            s = m.state(*series, guess=guess)
            d = forces(m, s.pose, s.twist, s.acceleration)
            lengths = m.inverse_kinematics(s.pose).lengths
            all = np.tile(list(numbers(changed).values()), (len(guess), 1))
            return np.concatenate([all, d.forces, d.constraint[:, comparable], lengths], axis=-1)

        step, _ = o.differentiate(at, STEP)
        rates, expected = np.split(step, [len(by.geometry)], axis=-1)
        chain = np.einsum("nij,nj->ni", found, rates)
        scale = np.abs(found).max(axis=-1)
        assert np.all(np.abs(chain - expected) <= 1e-7 * np.maximum(scale, 1e-3))


@each
def test_what_has_no_effect_is_zero(name):
    """A rod's point alone, axes longer or shorter, and passive legs."""
    mech, by = any_case(name).mech, derivatives(name)
    place = {n: i for i, n in enumerate(by.geometry)}
    sizes = {n: x for n, x in numbers(any_case(name).spec).items() if "point" not in n}
    for found in (by.forces_by_geometry, by.constraint_by_geometry, by.lengths_by_geometry):
        assert not np.any(found[..., [i for n, i in place.items() if re.match("rod .* point", n)]])
        for axis in {n[:-2] for n in sizes}:
            along = sum(found[..., place[f"{axis}_{c}"]] * sizes[f"{axis}_{c}"] for c in "xyz")
            assert np.allclose(along, 0, atol=1e-10 * np.abs(found).max(initial=1.0))
    assert not np.any(by.forces_by_geometry[:, ~mech.actuated])
