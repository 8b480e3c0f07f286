"""Polypod against the oracle: the paper's mechanism, the two in tests/data, and one drawn for every leg of the catalogue.

Poses are sampled by one recipe: the centre pose · uniform · near it, down to 1e-12 · at the stroke limits and on both
sides · near singularities and on both sides · near the poses where a formula changes its form. Seeds are fixed.
"""

from __future__ import annotations

import functools
import math
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polypod as pp
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import oracle as o

DATA = Path(__file__).parent / "data"

# Tolerances: relative to the largest number compared, where nothing else is said.
ROUNDING = 2e-11  # of velocities and accelerations by two roads: a thousand operations, lost digits near gimbal poses
EXACT = 1e-14  # of numbers read from a file and converted once
FORCES = 1e-13  # of forces, times the condition number of the actuated legs' rows
STENCIL = 1e-8  # of eighth-order differences of positions with a step near 5e-3: 1e-16 / h² and h⁸
SLOPE = 0.05  # of log error against log step, about 2 for central differences
SEED = 20240229


def agree(actual, expected, tol=ROUNDING, floor=1e-2):
    """Both arrays (N, ...) are equal within tol, relative to each pose's largest expected number.

    A pose's scale is at least `floor` times that of the whole sample.
    """
    actual, expected = np.asarray(actual, float), np.asarray(expected, float)
    assert actual.shape == expected.shape
    assert np.all(np.isfinite(actual)), "not a number"
    if not actual.size:
        return
    scale = np.max(np.abs(expected), axis=tuple(range(1, expected.ndim)), keepdims=True)
    scale = np.maximum(scale, floor * max(np.max(scale), 1e-3))
    error = np.abs(actual - expected) / scale
    worst = np.unravel_index(np.argmax(error / tol), error.shape)
    assert np.all(error <= tol), f"off by {error[worst]:.2e} of {np.max(scale):.3g} at {tuple(map(int, worst))}"


def matrix(pose):
    """Poses (R, o) as the product takes them, (..., 4, 4)."""
    T = np.zeros((*pose[1].shape[:-1], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = pose[0], pose[1], 1.0
    return T


def pair(T):
    return T[..., :3, :3], T[..., :3, 3]


# ------------------------------------------------------------------------------------------------------------
# Mechanisms
# ------------------------------------------------------------------------------------------------------------


def draw_body(rng, symmetric):
    """A body made of points with mass, so that its inertia is one that a body can have."""
    points, masses = rng.normal(size=(6, 3)) * 0.1, rng.uniform(0.1, 1, 6)
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    center = rng.uniform(-0.05, 0.05, 3) + [0, 0.15, 0]
    if symmetric:
        side = 0.5 * (inertia[0, 0] + inertia[2, 2])
        inertia, center = np.diag([side, inertia[1, 1], side]), np.array([0, center[1], 0])
    return {"mass": masses.sum(), "center": center, "inertia": inertia}


def across(rng, *vectors):
    """A unit vector square to the given ones, drawn at random where there is a choice."""
    v = np.cross(*vectors) if len(vectors) == 2 else np.cross(vectors[0], rng.normal(size=3))
    return v / np.linalg.norm(v)


def draw(name, kinds, rng, variant=""):
    """A mechanism file's tables, with legs of these kinds ("-" passive, "r" on the rod) that close at home.

    Variants: "lined" has both platform axes of the rod's legs on one line, as in the paper; "planar" lies in a plane;
    "gimbal" has the base joints' axes 0.03 rad from the legs.
    """
    planar = variant == "planar"
    units = {kind: list(names)[rng.integers(len(names))] for kind, names in o._UNITS.items()}
    per = {kind: 1 / o._UNITS[kind][unit] for kind, unit in units.items()}
    home = rng.normal(size=3) * ([0, 0, 0.2] if planar else 0.2)
    position = np.array([0.03, -0.05, 0.0 if planar else 0.8]) + rng.uniform(-0.05, 0.05, 3) * (not planar)
    R = o.turn(home)
    L = np.array([1, 0.1, 0.2]) / np.linalg.norm([1, 0.1, 0.2])
    rod_point = np.array([0.02, 0.1, 0.03])
    legs, first = [], None
    for i, kind in enumerate(kinds):
        passive, on_rod = kind.endswith("-"), kind.startswith("r")
        below, above = kind.strip("r-")[0], kind.strip("r-")[2]
        angle = 2 * math.pi * i / len(kinds) + rng.uniform(-0.2, 0.2)
        around = np.array([math.cos(angle), math.sin(angle), 0.0])
        B = around * rng.uniform(0.35, 0.5) + [0, 0, 0 if planar else rng.uniform(-0.05, 0.05)]
        b = R @ (around * rng.uniform(0.15, 0.25) + [0, 0, 0 if planar else rng.uniform(-0.05, 0.05)]) + position
        if on_rod:
            B = rod_point + L * (0.25 if first is None else -0.3)
            if first is not None and variant == "lined":
                b = first["b"] - 0.2 * L - 0.06 * (first["b"] - B)
        delta = (b - B) / np.linalg.norm(b - B)
        base, platform = {"joint": below}, {"joint": above}

        u = None  # the base joint's axis; n, the leg's normal
        n = None
        if on_rod:
            base["rod"], n = "L", across(rng, L, delta)
        elif below == "U":
            u = across(rng, delta)
            if variant == "gimbal":
                u = delta + 0.03 * u
            n = across(rng, u, delta)
        elif below in "RF":
            n = np.array([0, 0, 1.0]) if planar else across(rng, delta)
            u = n if below == "R" else delta
        if u is not None:
            base["axis"] = u
        if above == "U":
            w = rng.normal(size=3) if n is None else across(rng, n)
            if variant == "lined" and on_rod:
                w = L if first is None else first["b"] - b
                w = w if first is not None else None
            platform["axis"] = w
        elif above == "R":
            platform["axis"] = across(rng, delta) if n is None else n
        elif above == "F":
            platform["axis"] = delta
            n = across(rng, delta) if n is None else n
            platform["normal"] = n
        if below == "F":
            base["normal"] = n
        if on_rod and first is None:
            first = {"b": b, "platform": platform}
        elif on_rod and variant == "lined":
            first["platform"]["axis"] = platform["axis"]

        symmetric = below + above == "SS"
        cylinder, piston = draw_body(rng, symmetric), draw_body(rng, symmetric)
        piston["center"] = -piston["center"]
        base["point"], platform["point"] = B, R.T @ (b - position)
        leg = {"base": base, "platform": platform, "cylinder": cylinder, "piston": piston}
        leg["actuated"] = not passive
        legs.append(leg)

    for leg in legs:
        for key in ("axis", "normal"):
            for side in ("base", "platform"):
                if key in leg[side]:
                    v = leg[side][key]
                    v = R.T @ v if side == "platform" else v
                    leg[side][key] = v / np.linalg.norm(v)
        for side in ("base", "platform"):
            leg[side]["point"] = leg[side]["point"] * per["length"]
    bodies = [leg[k] for leg in legs for k in ("cylinder", "piston")]
    tables = {
        "name": name,
        "units": units,
        "dynamics": {
            "gravity": np.array([1.0, -2.0, -9.0]) * per["acceleration"],
            "efficiency": rng.uniform(0.6, 0.95),
            "linear_damping": rng.uniform(1, 20),
            "angular_damping": rng.uniform(0.1, 3),
        },
        "load": {
            "force": rng.normal(size=3) * 50 * per["force"],
            "torque": rng.normal(size=3) * 10 * per["torque"],
            "axes": "platform" if rng.random() < 0.5 else "base",
        },
        "home": {"position": position * per["length"], "rotation_vector": home * per["angle"]},
        "platform": draw_body(rng, False),
        "legs": legs,
    }
    bodies.append(tables["platform"])
    if first is not None:
        rod = {"name": "L", "point": rod_point * per["length"], "axis": L}
        body = draw_body(rng, False)
        bodies.append(body)
        tables["rods"] = [rod]
    for body in bodies:
        body["mass"] *= per["mass"]
        body["center"] = body["center"] * per["length"]
        body["inertia"] = body["inertia"] * per["inertia"]
    if first is not None:
        tables["rods"][0].update(body)
    return plain(tables)


def plain(x):
    """Lists and numbers for arrays, as a file has them."""
    if isinstance(x, dict):
        return {k: plain(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [plain(v) for v in x]
    return x.tolist() if isinstance(x, np.ndarray | np.generic) else x


DRAWN = {
    "6-sps": (["SPS"] * 6, ""),
    "6-ups": (["UPS"] * 6, "gimbal"),
    "5-ups-upu": (["UPS", "UPS", "UPU-", "UPS", "UPS", "UPS"], ""),
    "upu-and-s": (["UPU", "UPS", "SPS", "SPU", "UPS"], ""),
    "3-upu": (["UPU"] * 3, ""),
    "3-rps-skew": (["RPS"] * 3, ""),
    "3-spr": (["SPR"] * 3, ""),
    "rps-spr-upu": (["RPS", "SPR", "UPU"], ""),
    "passive": (["RPS-", "UPS", "SPR-", "SPU", "SPS", "UPS"], ""),
    "rpu": (["RPU", "UPS", "SPU", "SPS"], ""),
    "upr": (["SPU", "UPR", "SPS", "UPS"], ""),
    "rpr": (["UPS", "RPR", "SPS"], ""),
    "fps": (["FPS", "UPS", "SPS", "SPU"], ""),
    "spf": (["SPF", "UPS", "SPS", "SPU"], ""),
    "fpu": (["FPU", "UPS", "SPS"], ""),
    "upf": (["UPF", "SPU", "SPS"], ""),
    "fpr": (["FPR", "SPU"], ""),
    "rpf": (["RPF", "UPS"], ""),
    "fpf": (["FPF"], ""),
    "3-rpr-planar": (["RPR"] * 3, "planar"),
    "rod-of-one": (["rRPU", "UPS", "SPU", "UPS", "SPS"], ""),
    "rod-of-two": (["UPS", "rRPU", "SPU", "rRPU"], ""),
    "rod-lined": (["UPS", "rRPU", "SPU", "rRPU", "SPS"], "lined"),
}
FILES = ("stewart-gough", "3-rps")


@dataclass
class Case:
    """A mechanism in both models, and states (N of them) that keep its joints closed."""

    mech: pp.Mechanism
    spec: dict
    pose: tuple
    twist: np.ndarray
    acceleration: np.ndarray

    @property
    def T(self):
        return matrix(self.pose)

    @functools.cached_property
    def jets(self):
        return o.moving(self.pose, self.twist, self.acceleration)

    @functools.cached_property
    def legs(self):
        return o.legs_at(self.spec, self.jets)

    @functools.cached_property
    def kinematics(self):
        return self.mech.kinematics(self.T, self.twist, self.acceleration)

    @functools.cached_property
    def condition(self):
        s = o.conditioning(self.spec, self.pose)
        return s[:, 0] / s[:, -1]


NEAR = (1e-3, 1e-6, 1e-9, 1e-12)


def sample(spec, rng, size=9):
    """Poses (N): the centre, uniform ones about it, and ones close to it; those of one direction are on a line."""
    R, c = o.home(spec)

    def closed(d):
        pose = o.close(spec, (o.turn(d[:, 3:]) @ R, c + d[:, :3]))
        return pose, np.max(np.abs(o.residuals(spec, pose).x), axis=-1) < 1e-14

    reach = 0.15 * np.linalg.norm(c - spec["legs"][0]["base"]["point"])
    d = rng.uniform(-1, 1, size=(2 * size, 6)) * ([reach] * 3 + [0.35] * 3)
    d = d[closed(d)[1]][:size]
    near = [d[:1] * s for s in NEAR] + [d[1:2] * s for s in NEAR]
    # Three at a stroke limit: at the second uniform pose, and closely below and above.
    limit = [d[1:2] * (1 + s) for s in (-1e-6, 1e-6)]
    pose, all_closed = closed(np.concatenate([np.zeros((1, 6)), d, *near, *limit]))
    assert np.all(all_closed)
    return pose


@functools.cache
def case(name) -> Case:
    rng = np.random.default_rng([SEED, *name.encode()])
    if name in FILES:
        tables = tomllib.loads((DATA / f"{name}.toml").read_text())
    else:
        tables = draw(name, *(DRAWN[name][:1]), rng, DRAWN[name][1])
    spec = o.read(tables)
    pose = sample(spec, rng)
    if name in FILES:
        mech = pp.load(DATA / f"{name}.toml")
        pose = tuple(np.concatenate([p, q]) for p, q in zip(pose, at_stroke(spec), strict=True))
    else:
        # The limit of every leg's stroke is its length at the second uniform pose, or that at home.
        at = o.lengths(spec, pose).x
        per = o._UNITS["length"][tables["units"]["length"]]
        for i, leg in enumerate(tables["legs"]):
            ends = sorted([at[0, i], at[2, i]])
            leg["stroke"] = {"min": ends[0] / per, "max": ends[1] / per}
        spec = o.read(tables)
        mech = pp.Mechanism.from_dict(tables)
    q = rng.normal(size=(2, len(pose[1]), 6)) * ([0.3] * 3 + [1.0] * 3)
    twist, acceleration = o.feasible_motion(spec, pose, q[0], q[1] * 3)
    return Case(mech, spec, pose, twist, acceleration)


def at_stroke(spec):
    """Poses of a mechanism that may rise and sink, at and on both sides of its first leg's stroke limits."""
    R, c = o.home(spec)
    heights = []
    for limit in spec["legs"][0]["stroke"]:
        low, high = 0.2, 1.5
        for _ in range(60):
            z = (low + high) / 2
            ell = o.lengths(spec, (R, np.array([c[0], c[1], z]))).x[0]
            low, high = (z, high) if ell < limit else (low, z)
        heights += [z - 1e-9, z, z + 1e-9]
    centers = np.array([[c[0], c[1], z] for z in heights])
    return np.broadcast_to(R, (len(heights), 3, 3)), centers


LU = ("alpha", "p", "h", "beta", "gamma")


@functools.cache
def lu_coordinates():
    """Natural coordinates (N, 5) of the paper's mechanism, by the recipe."""
    rng = np.random.default_rng(SEED)
    home = np.array([0, 0, 0.74, 0, 0])
    span = np.array([0.5, 0.15, 0.09, 0.6, 0.6])
    uniform = home + rng.uniform(-1, 1, (24, 5)) * span
    near = [home + rng.uniform(-1, 1, (3, 5)) * s for s in NEAR]
    # One coordinate at a time nearly or quite zero: l ∥ L at β = 0, the fold of the paper's coordinates at γ = 0.
    special = []
    for k in (0, 3, 4):
        for value in (0.0, 1e-9, -1e-9, 1e-5, -1e-5):
            q = home + rng.uniform(-1, 1, 5) * span
            q[k] = value
            special.append(q)
    q = np.concatenate([[home], uniform, *near, special])
    return np.concatenate([q, lu_limits(q[1:4]), lu_singular(rng, home, span)])


def lu_limits(starts):
    """The same with h so that leg 2 is at its limit or close by on either side."""
    spec = o.read(o.lu())
    q, limit = np.repeat(starts, 2, axis=0), np.tile([0.65, 0.85], len(starts))

    def too_long(h):
        pose = lu_pose(np.column_stack([q[:, :2], h, q[:, 3:]]))
        return o.leg_at(spec, spec["legs"][1], pose).length.x[:, 0] > limit

    h = bisect(too_long, np.full(len(q), 1.2), np.full(len(q), 0.3))
    return np.concatenate([np.column_stack([q[:, :2], h + s, q[:, 3:]]) for s in (-1e-9, 0, 1e-9)])


def lu_singular(rng, home, span):
    """Pairs close to a singular pose, one on either side, between random poses with |J| of opposite sign."""
    spec = o.read(o.lu())
    a, b = home + rng.uniform(-1, 1, (2, 30, 5)) * span

    def positive(q):
        pose = lu_pose(q)
        rows = [o.leg_gradient(spec, pose), o.gradient(lambda p: o.theory_constraints(spec, p), pose)[:, :1]]
        return np.linalg.det(np.concatenate(rows, axis=1)) > 0

    a, b = a[positive(a)], b[~positive(b)]
    a, b = a[: min(len(a), len(b), 6)], b[: min(len(a), len(b), 6)]
    t = bisect(lambda t: positive(a + t[:, None] * (b - a)), np.zeros(len(a)), np.ones(len(a)))
    return np.concatenate([a + (t + s)[:, None] * (b - a) for s in (-1e-4, 1e-4, 1e-6)])


def bisect(f, true, false):
    """Where f turns from true to false between arrays of arguments."""
    for _ in range(50):
        middle = (true + false) / 2
        here = f(middle)
        true, false = np.where(here, middle, true), np.where(here, false, middle)
    return true


def lu_pose(q):
    R, c = o.natural_pose(*np.moveaxis(np.asarray(q, float), -1, 0))
    return R.x, c.x


def lu_jets():
    """The sample as jets: coordinates with rates and second rates."""
    q = lu_coordinates()
    rng = np.random.default_rng(SEED + 1)
    return [o.Jet(x, rng.normal(size=len(q)) * s, rng.normal(size=len(q)) * 3 * s) for x, s in zip(q.T, (1, 0.3, 0.3, 1, 1))]


@functools.cache
def lu() -> Case:
    jets = o.natural_pose(*lu_jets())
    twist, acceleration = o.twist_of(jets)
    return Case(pp.load("lu-3spu-2rpu-r"), o.read(o.lu()), (jets[0].x, jets[1].x), twist, acceleration)


def any_case(name) -> Case:
    return lu() if name == "lu" else case(name)


ALL = ("lu", *FILES, *DRAWN)
each = pytest.mark.parametrize("name", ALL)


def per_pose(x, rank=1):
    """Numbers (N,) with `rank` more axes, to multiply or bound arrays of one row for each pose."""
    return np.asarray(x).reshape(-1, *([1] * rank))


def legs_of(c: Case, f):
    """f(leg) of every leg, side by side: (N, n, ...)."""
    return np.stack([f(leg) for leg in c.legs], axis=1)


def spins(c: Case):
    """Angular velocities and accelerations of the legs (N, n, 3)."""
    pairs = [o.spin_of(leg.frame) for leg in c.legs]
    return np.stack([w for w, _ in pairs], axis=1), np.stack([e for _, e in pairs], axis=1)


# ------------------------------------------------------------------------------------------------------------
# The oracle itself: jets against differences of positions
# ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["lu", "rod-of-two", "rps-spr-upu", "fps"])
def test_oracle_links_move_as_differences_of_positions_say(name):
    c = any_case(name)
    some = slice(1, 5)
    pose = (c.pose[0][some], c.pose[1][some])
    # A motion that starts as `along` and closes at every time; both differ by t³.
    V, A = o.feasible_motion(c.spec, pose, *np.random.default_rng(SEED).normal(size=(2, 4, 6)) * 0.3)

    def positions(t):
        closed = o.close(c.spec, o.along(pose, V, A, t))
        links = o.links_at(c.spec, closed)
        return np.stack([np.concatenate([k.center.x[:, None], k.frame.x], axis=1) for k in links])

    links = o.links_at(c.spec, o.moving(pose, V, A))
    first, second = o.differentiate(positions, 4e-3)
    for rates, jets in ((first, "d"), (second, "dd")):
        expected = [np.concatenate([getattr(k.center, jets)[:, None], getattr(k.frame, jets)], axis=1) for k in links]
        if jets == "d":
            agree(rates, np.stack(expected), STENCIL)
        elif not any(leg["base"]["joint"] + leg["platform"]["joint"] == "SS" for leg in c.spec["legs"]):
            # The motion's second rates are those of `along` only up to the closing, t³: nothing at t = 0.
            agree(rates, np.stack(expected), 1e-6)


@each
def test_oracle_power_balances(name):
    """The oracle's own forces do the work that its energies ask for, but for friction."""
    c = any_case(name)
    f = o.active_forces(c.spec, c.pose, c.twist, c.acceleration)
    _, platform = o.generalised_force(c.spec, c.pose, c.twist, c.acceleration)
    _, _, dK, dP = o.energy(c.spec, c.pose, c.twist, c.acceleration)
    rates = np.concatenate([leg.length.d for leg in c.legs], axis=1)[:, o.actuated(c.spec)]
    V, spec = c.twist, c.spec
    load = np.sum(o.load_at(spec, c.pose) * V, axis=1)
    load -= spec["linear_damping"] * np.sum(V[:, :3] ** 2, axis=1)
    load -= spec["angular_damping"] * np.sum(V[:, 3:] ** 2, axis=1)
    work = f * rates
    friction = (1 / spec["efficiency"] - 1) * np.sum(platform * V, axis=1)
    balance = np.sum(work, axis=1) + load + friction - dK - dP
    size = np.sum(np.abs(work), axis=1) + np.abs(load) + np.abs(dK) + np.abs(dP)
    assert np.max(np.abs(balance) / size / c.condition) < FORCES


# ------------------------------------------------------------------------------------------------------------
# Every mechanism
# ------------------------------------------------------------------------------------------------------------


@each
def test_file_is_read_into_the_same_numbers(name):
    c = any_case(name)
    got, want = c.mech.geometry, c.spec

    def same(a, b):
        if b is None or isinstance(b, str | bool | int):
            assert a == b
        else:
            np.testing.assert_allclose(a, b, rtol=EXACT, atol=EXACT)

    for key in ("name", "gravity", "efficiency", "linear_damping", "angular_damping"):
        same(got[key], want[key])
    for section, keys in (("load", ("force", "torque", "axes")), ("home", ("position", "rotation_vector"))):
        for key in keys:
            same(got[section][key], want[section][key])

    def same_body(a, b):
        assert (a is None) == (b is None)
        for key in b or ():
            same(a[key], b[key])

    same_body(got["platform"], want["platform"])
    for a, b in zip(got["legs"], want["legs"], strict=True):
        for key in ("name", "actuated", "stroke"):
            same(a[key], b[key])
        for end in ("base", "platform"):
            for key in ("joint", "point", "rod"):
                same(a[end][key], b[end][key])
            for key in ("axis", "normal"):
                assert (a[end][key] is None) == (b[end][key] is None)
                if b[end][key] is not None:
                    same(np.array(a[end][key]) / np.linalg.norm(a[end][key]), b[end][key])
        same_body(a["cylinder"], b["cylinder"])
        same_body(a["piston"], b["piston"])
    for a, b in zip(got["rods"], want["rods"], strict=True):
        same(a["point"], b["point"])
        same_body(a["body"], b["body"])


@each
def test_mobility(name):
    c = any_case(name)
    counted = o.mobility(c.spec, (c.pose[0][3], c.pose[1][3]))
    freedoms = o.dof(c.spec, (c.pose[0][3], c.pose[1][3]))
    m = c.mech.mobility()
    assert c.mech.dof == m.dof == freedoms
    for key in ("links", "joints", "joint_freedoms", "loops", "closure_rank"):
        assert getattr(m, key) == getattr(counted, key), key
    assert m.redundant == 6 * counted.loops - counted.closure_rank
    assert m.passive == counted.joint_freedoms - counted.closure_rank - freedoms


@each
def test_characteristic_length(name):
    c = any_case(name)
    assert c.mech.characteristic_length == pytest.approx(o.characteristic_length(c.spec), rel=EXACT)


@each
def test_inverse_kinematics(name):
    c = any_case(name)
    ik = c.mech.inverse_kinematics(c.T)
    agree(ik.lengths, legs_of(c, lambda leg: leg.length.x[:, 0]), EXACT)
    agree(ik.vectors, legs_of(c, lambda leg: leg.r.x), EXACT)
    agree(ik.directions, legs_of(c, lambda leg: leg.delta.x), EXACT)


@each
def test_status_tells_the_stroke(name):
    """Beyond a limit by 1e-9 m the status says so, and the numbers stay; within it all is well."""
    c = any_case(name)
    margin = 1e-10
    ell = legs_of(c, lambda leg: leg.length.x[:, 0])
    limits = np.array([leg["stroke"] for leg in c.spec["legs"]])
    np.testing.assert_allclose(c.mech.stroke, limits, rtol=EXACT)
    over = np.maximum(ell - limits[:, 1], limits[:, 0] - ell).max(axis=1)
    assert np.sum(np.abs(over) < 2e-6 * ell.max()) >= 2, "no pose near a limit"
    outside, inside = over > margin, over < -margin
    status = c.mech.inverse_kinematics(c.T).status
    assert np.all(status[outside] == pp.Status.OUT_OF_STROKE)
    assert np.all(status[inside] == pp.Status.OK)


@each
def test_leg_rates(name):
    c = any_case(name)
    agree(c.kinematics.rates, legs_of(c, lambda leg: leg.length.d[:, 0]))
    agree(c.kinematics.accelerations, legs_of(c, lambda leg: leg.length.dd[:, 0]))
    agree(c.kinematics.directions, legs_of(c, lambda leg: leg.delta.x), EXACT)


@each
def test_leg_turning(name):
    c = any_case(name)
    omega, eps = spins(c)
    agree(c.kinematics.leg_omega, omega)
    agree(c.kinematics.leg_eps, eps)
    delta, rate = legs_of(c, lambda leg: leg.delta.x), legs_of(c, lambda leg: leg.delta.d)
    agree(c.kinematics.leg_spin, np.sum(omega * delta, axis=-1))
    agree(c.kinematics.leg_spin_rate, np.sum(eps * delta + omega * rate, axis=-1))


@each
def test_mass_centres(name):
    c = any_case(name)
    links = o.links_at(c.spec, c.jets)
    for kind in ("cylinder", "piston"):
        found = [k.center for k in links if k.name == kind]
        agree(getattr(c.kinematics, f"{kind}_velocity"), np.stack([k.d for k in found], axis=1))
        agree(getattr(c.kinematics, f"{kind}_acceleration"), np.stack([k.dd for k in found], axis=1))


@pytest.mark.parametrize("name", ["lu", "rod-of-one", "rod-of-two", "rod-lined"])
def test_rods(name):
    c = any_case(name)
    omega, eps = o.spin_of(o.rod_frame(c.spec, 0, c.legs))
    agree(c.kinematics.rod_omega, omega[:, None])
    agree(c.kinematics.rod_eps, eps[:, None])


@each
def test_rates_are_differences(name):
    """All angles and lengths that the product gives change as fast as the product says."""
    c = any_case(name)
    some = slice(0, 6)
    pose, V, A = (c.pose[0][some], c.pose[1][some]), c.twist[some], c.acceleration[some]
    now = c.mech.kinematics(matrix(pose), V, A)
    names = (
        ("lengths", "rates"),
        ("base_joint_angles", "base_joint_rates"),
        ("platform_joint_angles", "platform_joint_rates"),
    )
    here = {a: getattr(now, a) for a, _ in names} | {"rod_angle": now.rod_angle}

    def moved(t):
        k = c.mech.kinematics(matrix(o.close(c.spec, o.along(pose, V, A, t))), V, A)
        flat = []
        for key, value in here.items():
            change = np.nan_to_num(getattr(k, key) - value)
            if key != "lengths":
                change = (change + np.pi) % (2 * np.pi) - np.pi
            flat.append(change.reshape(len(V), -1))
        return np.concatenate(flat, axis=1)

    first, _ = o.differentiate(moved, 4e-3)
    rod_rates = [np.sum(now.rod_omega * np.array([r["axis"] for r in c.spec["rods"]]), axis=-1)] if c.spec["rods"] else []
    expected = [np.nan_to_num(getattr(now, r)).reshape(len(V), -1) for _, r in names] + rod_rates
    agree(first, np.concatenate(expected, axis=1), 1e-6)
    for a, r in names[1:]:
        np.testing.assert_array_equal(np.isnan(getattr(now, a)), np.isnan(getattr(now, r)))


@each
def test_cone_angles(name):
    """Without an axis of its own a cone stands about the leg's direction at home."""
    c = any_case(name)
    home = [leg.delta.x for leg in o.legs_at(c.spec, o.home(c.spec))]
    for side in ("base", "platform"):
        got = getattr(c.kinematics, f"{side}_cone_angle")
        for i, leg in enumerate(c.legs):
            axis = home[i] if side == "base" else o.times(c.pose[0], o.home(c.spec)[0].T @ home[i])
            sine = np.linalg.norm(np.cross(axis, leg.delta.x), axis=-1)
            agree(got[:, i], np.arctan2(sine, np.sum(axis * leg.delta.x, axis=-1)), ROUNDING)


def theory_rows(c: Case):
    """Whether the oracle has the constraints of all legs by kind."""
    known = {"UU", "RS", "SR", "RU", "UR", "SS", "US", "SU"}
    return all(("U" if g["base"]["rod"] is not None else g["base"]["joint"]) + g["platform"]["joint"] in known for g in c.spec["legs"])


@each
def test_jacobian(name):
    c = any_case(name)
    J = c.mech.jacobian(c.T)
    n = len(o.actuated(c.spec))
    agree(J[:, :n], o.leg_gradient(c.spec, c.pose))
    Z, scale = o.feasible_directions(c.spec, c.pose)
    # The constraints' rows are felt by no feasible motion, and there are enough of them.
    rows = J[:, n:] / scale
    assert np.all(np.abs(rows @ Z) < ROUNDING)
    if rows.shape[1]:
        assert np.all(np.linalg.matrix_rank(rows, tol=1e-9) == 6 - c.mech.dof)
    if theory_rows(c) and rows.shape[1]:
        g = o.gradient(lambda p: o.theory_constraints(c.spec, p), c.pose)
        agree(J[:, n:], g[:, list(c.mech.mobility().independent_rows)])


@each
def test_hessian(name):
    """Second rates along any motion, also one that the joints do not allow."""
    c = any_case(name)
    rng = np.random.default_rng(SEED)
    V, A = rng.normal(size=(2, *c.twist.shape))
    J, H = c.mech.jacobian(c.T), c.mech.hessian(c.T)
    agree(H, np.swapaxes(H, -1, -2), EXACT)
    second = o.times(J, A) + np.einsum("nkij,ni,nj->nk", H, V, V)
    jets = o.moving(c.pose, V, A)
    active = o.actuated(c.spec)
    agree(second[:, : len(active)], o.lengths(c.spec, jets).dd[:, active])
    if theory_rows(c) and c.mech.dof < 6:
        g = o.theory_constraints(c.spec, jets).dd
        agree(second[:, len(active) :], g[:, list(c.mech.mobility().independent_rows)])
    # And along a motion that they do allow, the constraints' second rates are none.
    held = o.times(J, c.acceleration) + np.einsum("nkij,ni,nj->nk", H, c.twist, c.twist)
    size = np.max(np.abs(c.acceleration), axis=1, keepdims=True)
    assert np.all(np.abs(held[:, len(active) :]) < ROUNDING * size)


@each
def test_platform_from_legs(name):
    c = any_case(name)
    twist, status = c.mech.platform_twist(c.T, c.kinematics.rates)
    assert np.all(np.isin(status, (pp.Status.OK, pp.Status.OUT_OF_STROKE)))
    agree(twist, c.twist, ROUNDING * per_pose(c.condition))
    acceleration, _ = c.mech.platform_acceleration(c.T, c.twist, c.kinematics.accelerations)
    agree(acceleration, c.acceleration, ROUNDING * per_pose(c.condition))


@each
def test_conditioning(name):
    c = any_case(name)
    s = o.conditioning(c.spec, c.pose)
    got = c.mech.conditioning(c.T)
    agree(got.sigma_max, s[:, 0], ROUNDING)
    agree(got.sigma_min, s[:, -1], ROUNDING * c.condition, floor=1e-6)
    agree(got.condition, c.condition, ROUNDING * c.condition, floor=1e-9)


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
    damping = spec["linear_damping"] * np.sum(V[:, :3] ** 2, 1) + spec["angular_damping"] * np.sum(V[:, 3:] ** 2, 1)
    agree(got.damping, -damping)
    agree(got.friction, (1 / spec["efficiency"] - 1) * np.sum(platform * V, axis=1), ROUNDING)
    assert np.all(np.abs(got.residual) < tol)


@each
def test_energy_rates_are_differences(name):
    """K' and P' of the product against K and P of the product along a closed motion."""
    c = any_case(name)
    some = slice(0, 3)
    pose, V, A = (c.pose[0][some], c.pose[1][some]), c.twist[some], c.acceleration[some]

    def at(t):
        # Twist at t by differences of the closed motion itself, which is smooth.
        def twisted(s):
            R, p = o.close(c.spec, o.along(pose, V, A, t + s))
            return np.concatenate([R, p[:, None]], axis=1)

        mid = twisted(0.0)
        first, _ = o.differentiate(twisted, 2e-2)
        W = o.vee(first[:, :3] @ np.swapaxes(mid[:, :3], 1, 2))
        twist = np.concatenate([first[:, 3], W], axis=1)
        p = c.mech.power(matrix((mid[:, :3], mid[:, 3])), twist, A)
        return np.stack([p.kinetic, p.potential], axis=1)

    first, _ = o.differentiate(at, 2e-2)
    now = c.mech.power(matrix(pose), V, A)
    agree(first, np.stack([now.kinetic_rate, now.potential_rate], axis=1), 1e-6)


def test_poses_off_the_constraints_are_refused():
    """Just off, the answer still comes, and differs as little; clearly off, the status says so."""
    c = case("3-rps-skew")
    T = c.T[:1].repeat(3, axis=0)
    across_ = c.spec["legs"][0]["base"]["axis"]
    T[:, :3, 3] += per_pose([0, 1e-9, 1e-3]) * across_
    got = c.mech.inverse_kinematics(T)
    assert got.status[2] == pp.Status.OFF_CONSTRAINT
    assert np.all(np.isnan(got.lengths[2]))
    assert np.all(got.status[:2] != pp.Status.OFF_CONSTRAINT)
    assert np.all(np.abs(got.lengths[1] - got.lengths[0]) < 2e-9)
