"""Derivatives of inverse dynamics, regressor and base parameters, against differences and the oracle."""

from __future__ import annotations

import copy
import functools
import re

import numpy as np
import pytest

import polypod as pp
from support import oracle as o
from support.cases import ALL, SLOPE, TIED, any_case, matrix, plain

DIFFERENCE = (
    1e-8  # eighth-order differences with the step below: 1e-16 / h of forces that change fast, and h⁸
)
STEP = 2e-4  # of m, rad, their rates and second rates
LINEAR = 1e-11  # forces by two linear roads, times the condition number of the actuated legs' rows
ROUND_TRIP = 1e-7  # base parameters from forces: rounding times the condition number of their regressor
SIX = ("stewart-gough", "6-sps", "6-ups")
PARTS = ("pose", "twist", "acceleration")
ORDERS = ("coordinates", "rates", "second_rates")

each = pytest.mark.parametrize("name", ALL)


def close(actual, expected, tol=DIFFERENCE):
    """Arrays (N, ...) are equal within tol of each state's largest number."""
    assert actual.shape == expected.shape
    assert np.all(np.isfinite(actual))
    if actual.size:
        scale = np.abs(expected).max(axis=tuple(range(1, expected.ndim)), keepdims=True)
        error = np.abs(actual - expected) / np.maximum(scale, 1e-6 * max(scale.max(), 1.0))
        assert error.max() <= tol, f"off by {error.max():.2e} of {scale.max():.3g}"


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


def varied(at, part, direction):
    """The motion with one number of one part changed, as a function of the change."""

    def motion(t):
        step = np.zeros(6)
        step[direction] = t
        pose, twist, acceleration = at
        if part == "twist":
            return pose, twist + step, acceleration
        if part == "acceleration":
            return pose, twist, acceleration + step
        moved = pose.copy()
        moved[:, :3, :3] = o.turn(step[3:]) @ pose[:, :3, :3]
        moved[:, :3, 3] += step[:3]
        return moved, twist, acceleration

    return motion


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("name", SIX)
def test_by_motion_with_six_freedoms(name, part):
    mech, _, at = sample(name)
    found = getattr(derivatives(name), f"forces_by_{part}")
    for direction in range(6):
        motion = varied(at, part, direction)
        expected, _ = o.differentiate(lambda t, m=motion: forces(mech, *m(t)).forces, STEP)
        close(found[..., direction], expected)


@pytest.mark.parametrize("axes", ["base", "platform"])
def test_a_load_in_platform_axes_turns(axes):
    mech, _, at = sample("stewart-gough")
    wrench = np.array([300.0, -200.0, 500.0, 20.0, 30.0, -40.0])
    found = mech.inverse_dynamics_derivatives(*at, wrench, axes).forces_by_pose
    for direction in range(6):
        motion = varied(at, "pose", direction)
        expected, _ = o.differentiate(
            lambda t, m=motion: mech.inverse_dynamics(*m(t), wrench, axes).forces, STEP
        )
        close(found[..., direction], expected)


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


def moved(mech, series, guess, order, name, t):
    """The state with one coordinate, rate or second rate changed by t."""
    changed = [dict(s) for s in series]
    changed[order][name] = changed[order][name] + t
    state = mech.state(*changed, guess=guess)
    assert np.all(np.isfinite(state.acceleration))
    return state


@each
def test_by_coordinates(name):
    """Also where coordinates depend on others, and by the chain rule of all parts of the motion."""
    mech, names, set, series, guess = coordinates_of(name)
    state = moved(mech, series, guess, 0, names[0], 0.0)
    by = mech.inverse_dynamics_derivatives(state.pose, state.twist, state.acceleration, set=set)
    assert by.coordinates == names
    R = state.pose[:, :3, :3]
    for order, part in enumerate(ORDERS):
        for k, coordinate in enumerate(names):

            def numbers(t, order=order, coordinate=coordinate):
                s = moved(mech, series, guess, order, coordinate, t)
                d = forces(mech, s.pose, s.twist, s.acceleration)
                pose = np.concatenate([s.pose[:, :3, 3], (s.pose[:, :3, :3]).reshape(-1, 9)], axis=-1)
                return np.concatenate([pose, s.twist, s.acceleration, d.forces, d.constraint], axis=-1)

            step, _ = o.differentiate(numbers, STEP)
            turn = np.swapaxes(R, -1, -2)
            turning = o.vee(step[:, 3:12].reshape(-1, 3, 3) @ turn)
            motion = [np.concatenate([step[:, :3], turning], axis=-1), step[:, 12:18], step[:, 18:24]]
            for kind, at, n in (("forces", 24, mech.n_legs), ("constraint", 24 + mech.n_legs, 6 - mech.dof)):
                found = getattr(by, f"{kind}_by_{part}")[..., k]
                expected = step[:, at : at + n]
                size = np.abs(expected).max(initial=0.0)
                assert np.allclose(found, expected, rtol=0, atol=1e-7 * max(size, 1.0))
                chain = sum(
                    np.einsum("nij,nj->ni", getattr(by, f"{kind}_by_{p}"), x)
                    for p, x in zip(PARTS, motion, strict=True)
                )
                assert np.allclose(chain, found, rtol=0, atol=1e-7 * max(size, 1.0))


@pytest.mark.parametrize("set", ["paper", "natural", "tool", "pose"])
def test_by_every_coordinate_set(set):
    mech, pose = any_case("lu").mech, {"alpha": 0.2, "p": -0.2, "h": 0.65, "beta": 0.7, "gamma": 0.8}
    state = mech.state(pose, {"alpha": 0.3, "h": 0.1, "gamma": -0.4}, {"beta": 1.0, "p": 0.4})
    at = (state.pose[None], state.twist[None], state.acceleration[None])
    by = mech.inverse_dynamics_derivatives(*at, set=set)
    natural = mech.inverse_dynamics_derivatives(*at, set="natural")
    # Second rates enter through the acceleration alone.
    q = {k: mech.coordinates(at[0], set)[k] for k in by.coordinates}

    def acceleration(k):
        one = mech.state(q, {}, {k: 1.0}, guess=at[0], branch=+1)
        rest = mech.state(q, guess=at[0], branch=+1)
        return one.acceleration - rest.acceleration

    A = np.stack([acceleration(k) for k in by.coordinates], axis=-1)
    assert np.allclose(by.forces_by_acceleration @ A, by.forces_by_second_rates, atol=1e-8)
    # A step of one set is a step of the other: the same forces.
    rates = {k: np.zeros(1) for k in by.coordinates}
    second = dict(rates)
    h = 1e-6
    for k, name in enumerate(by.coordinates):
        plus, minus = (mech.state({**q, name: q[name] + s * h}, rates, second, guess=at[0]) for s in (1, -1))
        a, b = (mech.coordinates(s.pose, "natural") for s in (plus, minus))
        step = np.array([(a[n] - b[n])[0] / (2 * h) for n in natural.coordinates])
        rest = (at[0], np.zeros(6), np.zeros(6))
        here = mech.inverse_dynamics_derivatives(*rest, set=set).forces_by_coordinates[0, :, k]
        there = mech.inverse_dynamics_derivatives(*rest, set="natural").forces_by_coordinates[0] @ step
        assert np.allclose(here, there, atol=1e-5 * np.abs(here).max() + 1e-6)


@pytest.mark.parametrize("name", ["lu", "stewart-gough", "3-rps"])
def test_differences_come_closer_by_order_two(name):
    mech, names, set, series, guess = coordinates_of(name)
    state = moved(mech, series, guess, 0, names[0], 0.0)
    by = mech.inverse_dynamics_derivatives(state.pose, state.twist, state.acceleration, set=set)
    steps = 4e-3 / 2.0 ** np.arange(4)
    for order, part in enumerate(ORDERS[:2]):
        for k, coordinate in enumerate(names):

            def at(t, order=order, coordinate=coordinate):
                s = moved(mech, series, guess, order, coordinate, t)
                return forces(mech, s.pose, s.twist, s.acceleration).forces

            exact = getattr(by, f"forces_by_{part}")[..., k]
            errors = [np.linalg.norm((at(h) - at(-h)) / (2 * h) - exact) for h in steps]
            if (
                errors[-1] > 1e-9 * np.linalg.norm(exact) / steps[-1]
            ):  # else rounding: forces are quadratic in rates
                slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
                assert slope == pytest.approx(2, abs=SLOPE), (part, coordinate, errors)


# --- bodies -------------------------------------------------------------------------------------------------

ENTRIES = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}


def body_of(spec, link):
    """The oracle's body of a link by its name."""
    kind, _, name = link.partition(" ")
    if kind == "platform":
        return spec["platform"]
    if kind == "rod":
        return next(r for r in spec["rods"] if r["name"] == name)["body"]
    return next(leg for leg in spec["legs"] if leg["name"] == name)[kind]


def parts(name):
    """Link and numbers of a parameter: "piston 1 I_xx = I_zz" has two."""
    link, numbers = re.fullmatch(r"(.*?) (\w+(?: = \w+)*)", name).groups()
    return link, numbers.split(" = ")


def change(spec, name, by):
    link, numbers = parts(name)
    body = body_of(spec, link)
    for number in numbers:
        key, _, entry = number.partition("_")
        if key == "mass":
            body["mass"] += by
        elif key == "center":
            body["center"] = body["center"] + by * np.eye(3)["xyz".index(entry)]
        else:
            i, j = ENTRIES[entry]
            inertia = body["inertia"].copy()
            inertia[i, j] += by
            inertia[j, i] = inertia[i, j]
            body["inertia"] = inertia


def value(spec, name):
    """A standard parameter from the oracle's bodies: inertia about the origin."""
    link, (number, *_) = parts(name)
    body = body_of(spec, link)
    if body is None:
        return 0.0
    m, c = body["mass"], body["center"]
    if number == "m":
        return m
    if number.startswith("mc_"):
        return m * c["xyz".index(number[-1])]
    return (body["inertia"] + m * (c @ c * np.eye(3) - np.outer(c, c)))[ENTRIES[number[-2:]]]


def with_bodies(name):
    """The sample with a body on every link, as the oracle sees it."""
    mech, spec, at = sample(name)
    spec = copy.deepcopy(spec)
    links = {parts(n)[0] for n in mech.regressor(*at).names}
    assert all(body_of(spec, link) is not None for link in links)
    return mech, spec, at


def oracle_forces(spec, at):
    T, twist, acceleration = at
    return o.active_forces(spec, (T[:, :3, :3], T[:, :3, 3]), twist, acceleration)


BODIED = ("6-sps", "6-ups", "3-spr", "rod-lined", "upf", "rpf", "fpr")


@pytest.mark.parametrize("name", BODIED)
def test_by_bodies(name):
    """Forces are quadratic in mass centres, linear in masses and inertias: central differences are exact."""
    mech, spec, at = with_bodies(name)
    by, actuated = derivatives(name), mech.actuated
    found = by.forces_by_bodies[:, actuated]
    expected = []
    for body in by.bodies:
        ends = []
        for sign in (1, -1):
            changed = copy.deepcopy(spec)
            change(changed, body, sign * 0.1)
            ends.append(oracle_forces(changed, at))
        expected.append((ends[0] - ends[1]) / 0.2)
    scale = np.maximum(np.abs(found).max(axis=(1, 2), keepdims=True), 1.0)
    assert np.all(np.abs(found - np.stack(expected, axis=-1)) <= 1e-10 * scale)
    assert not np.any(by.forces_by_bodies[:, ~actuated])


@pytest.mark.parametrize("name", BODIED)
def test_regressor_gives_the_forces_of_any_bodies(name):
    """Of the file's bodies and of others, drawn at random, in the oracle."""
    mech, spec, at = with_bodies(name)
    y, actuated = mech.regressor(*at), mech.actuated
    rng = np.random.default_rng(len(name))
    assert np.allclose(y.values, [value(spec, n) for n in y.names], rtol=1e-13, atol=1e-15)
    for body in (*mech.inverse_dynamics_derivatives(*at).bodies, ""):
        if body:
            change(spec, body, rng.uniform(0.01, 0.1))
    values = np.array([value(spec, n) for n in y.names])
    expected = oracle_forces(spec, at)
    found = (y.forces @ values + y.forces_offset)[:, actuated]
    scale = np.abs(expected).max(axis=-1, keepdims=True)
    assert np.all(np.abs(found - expected) <= LINEAR * scale)


@each
def test_regressor_with_the_files_parameters(name):
    """Forces and multipliers, with load, damping and efficiency."""
    mech, _, at = sample(name)
    wrench = np.array([30.0, -20.0, 50.0, 2.0, 3.0, -4.0])
    for load in ((), (wrench, "platform"), (wrench, "base")):
        y, d = mech.regressor(*at, *load), mech.inverse_dynamics(*at, *load)
        for kind in ("forces", "constraint"):
            found = getattr(y, kind) @ y.values + getattr(y, f"{kind}_offset")
            expected = getattr(d, kind)
            size = np.abs(expected).max(axis=-1, initial=1.0, keepdims=True)
            assert np.all(np.abs(found - expected) <= LINEAR * size)
        assert np.array_equal(y.status, d.status)


@each
def test_base_parameters_stand_for_all(name):
    """Forces of all parameters, whatever these are, are those of the base parameters."""
    mech, _, at = sample(name)
    y, base = mech.regressor(*at), mech.base_parameters()
    assert base.parameters == y.names
    assert base.names == tuple(y.names[i] for i in base.columns)
    assert np.array_equal(base.combination[:, base.columns], np.eye(len(base.names)))
    assert np.allclose(base.combination @ y.values, base.values, rtol=1e-12, atol=0)
    kept = y.forces[..., base.columns]
    scale = np.abs(y.forces).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(kept @ base.combination - y.forces) <= 1e-9 * scale)
    dependent = np.setdiff1d(np.arange(len(y.names)), base.columns)
    assert base.remainders[dependent].max(initial=0.0) < 1e-11
    assert base.remainders[base.columns].min() > 1e-5


@pytest.mark.parametrize("name", ["6-ups", "3-rps-skew", "rpr", "rod-of-one"])
def test_the_number_of_base_parameters_is_the_rank(name):
    """From the oracle's forces of unit changes, at states of its own."""
    mech, spec = any_case(name).mech, any_case(name).spec
    T, twist, acceleration = motions(name, 80, seed=2)

    none, columns = oracle_forces(spec, (T, twist, acceleration)), []
    for body in derivatives(name).bodies:
        changed = copy.deepcopy(spec)
        change(changed, body, 0.3)
        columns.append((oracle_forces(changed, (T, twist, acceleration)) - none).ravel())
    size = np.linalg.norm(columns, axis=1)
    columns = [c / max(n, 1e-6 * size.max()) for c, n in zip(columns, size, strict=True)]
    s = np.linalg.svd(np.stack(columns, axis=-1), compute_uv=False)
    b = len(mech.base_parameters().names)
    assert s[b - 1] > 1e-6
    assert s[b:].max(initial=0.0) < 1e-9 * s[0]


@pytest.mark.parametrize("name", ["lu", "stewart-gough", "rod-lined"])
def test_identification_round_trip(name):
    """Random motions' forces, least squares: the file's base parameters, and forces of other motions."""
    mech, base = any_case(name).mech, any_case(name).mech.base_parameters()
    at = motions(name, 150, seed=3)
    y, d = mech.regressor(*at), mech.inverse_dynamics(*at)
    train, other = slice(0, None, 2), slice(1, None, 2)
    Y = y.forces[..., base.columns]
    target = d.forces - y.forces_offset
    rows, right = Y[train].reshape(-1, Y.shape[-1]), target[train].ravel()
    size = np.linalg.norm(rows, axis=0)
    found = np.linalg.lstsq(rows / size, right, rcond=None)[0] / size
    assert np.linalg.matrix_rank(rows / size) == len(base.names)
    contribution = np.abs(found - base.values) * size
    assert contribution.max() <= ROUND_TRIP * np.linalg.norm(right)
    assert np.allclose(Y[other] @ found, target[other], atol=1e-8 * np.abs(target[other]).max())


# --- geometry -----------------------------------------------------------------------------------------------


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


def settled(spec, lined):
    """The description with what its free numbers decide.

    Joints on a rod stay on it, and where the legs on it have their platform axes on one line they stay on
    that; both axes of an F joint turn as one.
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


# --- outcomes and calls -------------------------------------------------------------------------------------


def lu_at_rest():
    mech = any_case("lu").mech
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.6})
    return mech, pose, np.zeros(6), np.zeros(6)


def test_no_answer_says_why():
    mech, pose, twist, acceleration = lu_at_rest()
    poses = np.stack([pose, np.full((4, 4), np.nan), pose, pose])
    twists = np.stack([twist, twist, np.array([0, 1.0, 0, 0, 0, 0]), twist])
    wrench = np.zeros((4, 6))
    wrench[3, 0] = np.inf
    for answer in (
        mech.inverse_dynamics_derivatives(poses, twists, acceleration, wrench),
        mech.regressor(poses, twists, acceleration, wrench),
    ):
        first, *others = (pp.Status(s) for s in answer.status)
        assert first.has_answer
        assert [s.name for s in others] == ["INVALID_INPUT", "OFF_CONSTRAINT", "INVALID_INPUT"]
        for field, array in answer.arrays.items():
            if array.ndim > 2:
                assert np.all(np.isfinite(array[0])), field
                assert np.all(np.isnan(array[1:])), field


def test_where_coordinates_fold_all_else_stands():
    """In the paper's coordinates at γ = 0, where mechanism and natural coordinates are regular."""
    mech = any_case("lu").mech
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.6, "beta": 0.8, "gamma": 0.0})
    rest = (pose, np.zeros(6), np.zeros(6))
    folded = mech.inverse_dynamics_derivatives(*rest, set="paper")
    regular = mech.inverse_dynamics_derivatives(*rest, set="natural")
    assert pp.Status(folded.status) is pp.Status.FOLD
    assert pp.Status(regular.status) is pp.Status.OK
    for field, array in folded.arrays.items():
        if array.ndim == 2:
            if any(field.endswith(f"_by_{part}") for part in (*ORDERS, "geometry")):
                assert np.all(np.isnan(array))
                assert np.all(np.isfinite(getattr(regular, field)))
            else:
                assert np.array_equal(array, getattr(regular, field)), field


def test_leading_axes_broadcast():
    mech, pose, twist, _ = lu_at_rest()
    by = mech.inverse_dynamics_derivatives(pose, twist, np.zeros((2, 1, 6)), np.zeros((3, 6)))
    p = len(by.bodies)
    assert by.forces_by_pose.shape == (2, 3, 5, 6)
    assert by.constraint_by_bodies.shape == (2, 3, 1, p)
    y = mech.regressor(pose, twist, np.zeros((2, 1, 6)), np.zeros((3, 6)))
    assert y.forces.shape == (2, 3, 5, p)
    assert y.forces_offset.shape == (2, 3, 5)
    alone = mech.regressor(pose, twist, np.zeros(6), np.zeros(6))
    assert np.array_equal(y.forces[1, 2], alone.forces)


def test_wrong_calls_raise():
    mech, *rest = lu_at_rest()
    with pytest.raises(pp.UnknownNameError, match="naturel"):
        mech.inverse_dynamics_derivatives(*rest, set="naturel")
    with pytest.raises(pp.CoordinateError, match="x, y"):
        mech.inverse_dynamics_derivatives(*rest, set="pose", coordinates=["x", "y"])
    with pytest.raises(pp.UnknownNameError, match="wrench_axes"):
        mech.regressor(*rest, np.zeros(6), "tool")


def test_expressions_name_the_combinations():
    mech = any_case("lu").mech
    base = mech.base_parameters()
    assert base.expression(0) == "platform m" + "".join(f" + piston {i} m" for i in range(1, 6))
    at = base.names.index("cylinder 1 mc_x")
    assert base.expression(at) == "cylinder 1 mc_x + cylinder 3 mc_x + rod L mc_y"
    # The pistons' masses act at the platform's joints: their first moments are those of the points.
    row = base.names.index("platform mc_y")
    for i, leg in enumerate(mech.geometry["legs"]):
        weight = base.combination[row, base.parameters.index(f"piston {i + 1} m")]
        assert weight == pytest.approx(leg["platform"]["point"][1] * mech.geometry["efficiency"], abs=1e-12)
