"""Polypod against the oracle: the paper's mechanism, those in tests/data, and drawn ones with every leg type.

Poses are sampled by one recipe: the centre pose · uniform · near it, down to 1e-12 · at the stroke limits
and on both sides · near singularities and on both sides · at and near the poses where a formula degenerates.
Seeds are fixed.
"""

from __future__ import annotations

import functools
import math
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import polypod as pp

sys.path.insert(0, str(Path(__file__).parent))
import oracle as o

DATA = Path(__file__).parent / "data"

# Tolerances: relative to the largest number compared, where nothing else is said.
ROUNDING = (
    1e-12  # velocities and accelerations by two roads: some thousand roundings, digits lost near gimbal poses
)
EXACT = 1e-14  # numbers read from a file and converted once
FORCES = 5e-14  # forces, times the condition number of the actuated legs' rows
STENCIL = 1e-8  # eighth-order differences of positions with a step near 5e-3: 1e-16 / h² and h⁸
SLOPE = 0.05  # log error against log step, about 2 for central differences
SEED = 20240229


def agree(actual, expected, tol=ROUNDING, floor=1e-2):
    """Both arrays (N, ...) are equal within tol, relative to each pose's largest expected number.

    A pose's scale is at least `floor` times that of the whole sample, or of 1 in SI units.
    """
    actual, expected = np.asarray(actual, float), np.asarray(expected, float)
    assert actual.shape == expected.shape
    assert np.all(np.isfinite(actual)), "not a number"
    if not actual.size:
        return
    scale = np.max(np.abs(expected), axis=tuple(range(1, expected.ndim)), keepdims=True)
    scale = np.maximum(scale, floor * max(np.max(scale), 1.0))
    error = np.abs(actual - expected) / scale
    worst = np.unravel_index(np.argmax(error / tol), error.shape)
    where = tuple(int(i) for i in worst)
    assert np.all(error <= tol), f"off by {error[worst]:.2e} of {np.max(scale):.3g} at {where}"


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
    center = rng.uniform(-0.05, 0.05, 3) + np.array([0, 0.15, 0])
    if symmetric:
        side = 0.5 * (inertia[0, 0] + inertia[2, 2])
        inertia, center = np.diag([side, inertia[1, 1], side]), np.array([0, center[1], 0])
    return {"mass": masses.sum(), "center": center, "inertia": inertia}


def across(rng, *vectors):
    """A unit vector perpendicular to the given ones, drawn at random where there is a choice."""
    v = np.cross(*vectors) if len(vectors) == 2 else np.cross(vectors[0], rng.normal(size=3))
    return v / np.linalg.norm(v)


def draw(name, kinds, rng, variant=""):
    """A mechanism file's tables, with legs of these kinds ("-" passive, "r" on the rod) that close at home.

    Variants: "lined" has both platform axes of the rod's legs on one line, as in the paper; "planar" lies in
    a plane; "gimbal" has the base joints' axes 0.03 rad from the legs.
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
        m = around * rng.uniform(0.15, 0.25) + [0, 0, 0 if planar else rng.uniform(-0.05, 0.05)]
        b = R @ m + position
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
    "rod-lined": (["UPS", "rRPU", "SPU", "rRPU", "SPS"], "lined"),
}
# Its legs on one rod tie the platform by a constraint of their own, kind E.
TIED = {"rod-of-two": (["UPS", "rRPU", "SPU-", "rRPU"], "")}
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


def sample(spec, rng, size=8):
    """Poses (N): the centre, uniform ones about it, ones close to it, and ones about a stroke limit."""
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
        kinds, variant = {**DRAWN, **TIED}[name]
        tables = draw(name, kinds, rng, variant)
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
    uniform = home + rng.uniform(-1, 1, (16, 5)) * span
    near = [home + rng.uniform(-1, 1, (3, 5)) * s for s in NEAR]
    # One coordinate at a time nearly or quite zero: l ∥ L at β = 0, the paper's fold at γ = 0.
    special = []
    for k in (0, 3, 4):
        for value in (0.0, 1e-9, -1e-9, 1e-5, -1e-5):
            q = home + rng.uniform(-1, 1, 5) * span
            q[k] = value
            special.append(q)
    q = np.concatenate([[home], uniform, *near, special])
    return np.concatenate([q, lu_limits(np.concatenate([q[:3], near[0][:1]])), lu_singular(rng, home, span)])


def lu_limits(starts):
    """Coordinates with h such that the shortest leg is at about 650 mm or the longest at about 850 mm."""
    spec = o.read(o.lu())
    q, upper = np.repeat(starts, 2, axis=0), np.tile([False, True], len(starts))

    def too_long(h):
        ell = o.lengths(spec, lu_pose(np.column_stack([q[:, :2], h, q[:, 3:]]))).x
        return np.where(upper, ell.max(axis=1) > 0.85, ell.min(axis=1) > 0.65)

    h = bisect(too_long, np.full(len(q), 1.2), np.full(len(q), 0.3))
    return np.concatenate([np.column_stack([q[:, :2], h + s, q[:, 3:]]) for s in (-1e-9, 0, 1e-9)])


def lu_singular(rng, home, span):
    """Poses close to a singular one, on either side: |J| is negative near home and positive at most poses."""
    spec = o.read(o.lu())
    a = home + rng.uniform(-1, 1, (20, 5)) * span
    b = home + rng.uniform(-1, 1, (20, 5)) * span * 1e-2

    def positive(q):
        pose = lu_pose(q)
        rows = [o.leg_gradient(spec, pose), o.gradient(lambda p: o.theory_constraints(spec, p), pose)[:, :1]]
        return np.linalg.det(np.concatenate(rows, axis=1)) > 0

    a, b = a[positive(a)][:6], b[~positive(b)][:6]
    assert len(a) == len(b) == 6
    t = bisect(lambda t: positive(a + t[:, None] * (b - a)), np.zeros(6), np.ones(6))
    return np.concatenate([a + (t + s)[:, None] * (b - a) for s in (-1e-3, 1e-3, -1e-6, 1e-6)])


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
    size = np.array([1, 0.3, 0.3, 1, 1])
    rates, second_rates = rng.normal(size=(2, *q.shape)) * size
    return [o.Jet(*column) for column in zip(q.T, rates.T, 3 * second_rates.T, strict=True)]


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


@pytest.mark.parametrize("name", ["lu", "rod-lined", "rps-spr-upu", "5-ups-upu"])
def test_oracle_links_move_as_differences_of_positions_say(name):
    c = any_case(name)
    some = slice(1, 5)
    pose = (c.pose[0][some], c.pose[1][some])
    # A motion that starts as `along` and closes at every time; both differ by t³.
    V, A = o.feasible_motion(c.spec, pose, *np.random.default_rng(SEED).normal(size=(2, 4, 6)) * 0.3)

    def tables(pose, read):
        links = o.links_at(c.spec, pose)
        return np.stack(
            [np.concatenate([read(k.center)[:, None], read(k.frame)], axis=1) for k in links], axis=1
        )

    free = [
        k for k, leg in enumerate(c.spec["legs"]) if leg["base"]["joint"] + leg["platform"]["joint"] == "SS"
    ]
    skip = len(c.spec["rods"]) + 1
    kept = [i for i in range(skip + 2 * len(c.spec["legs"])) if (i - skip) // 2 not in free or i < skip]
    first, second = o.differentiate(
        lambda t: tables(o.close(c.spec, o.along(pose, V, A, t)), lambda jet: jet.x)[:, kept], 8e-3
    )
    motion = o.moving(pose, V, A)
    agree(first, tables(motion, lambda jet: jet.d)[:, kept], STENCIL)
    agree(second, tables(motion, lambda jet: jet.dd)[:, kept], STENCIL)


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
    assert np.sum(np.abs(ell[:, :, None] - limits).min(axis=(1, 2)) < 2e-6) >= 2, "no pose near a limit"
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
    agree(c.kinematics.leg_spin, np.sum(omega * delta, axis=-1), floor=1)
    agree(c.kinematics.leg_spin_rate, np.sum(eps * delta + omega * rate, axis=-1), floor=1)


@each
def test_mass_centres(name):
    c = any_case(name)
    links = o.links_at(c.spec, c.jets)
    for kind in ("cylinder", "piston"):
        found = [k.center for k in links if k.name == kind]
        agree(getattr(c.kinematics, f"{kind}_velocity"), np.stack([k.d for k in found], axis=1))
        agree(getattr(c.kinematics, f"{kind}_acceleration"), np.stack([k.dd for k in found], axis=1))


@pytest.mark.parametrize("name", ["lu", "rod-of-one", "rod-lined"])
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
        k = c.mech.kinematics(matrix(o.close(c.spec, o.along(pose, V, A, t))), 0 * V, 0 * A)
        flat = []
        for key, value in here.items():
            change = np.nan_to_num(getattr(k, key) - value)
            if key != "lengths":
                change = (change + np.pi) % (2 * np.pi) - np.pi
            flat.append(change.reshape(len(V), -1))
        return np.concatenate(flat, axis=1)

    first, _ = o.differentiate(moved, 2e-4)  # short, for gimbal poses
    expected = [np.nan_to_num(getattr(now, r)).reshape(len(V), -1) for _, r in names]
    if c.spec["rods"]:
        expected.append(np.sum(now.rod_omega * [r["axis"] for r in c.spec["rods"]], axis=-1))
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
    below = ["U" if leg["base"]["rod"] is not None else leg["base"]["joint"] for leg in c.spec["legs"]]
    return all(b + leg["platform"]["joint"] in known for b, leg in zip(below, c.spec["legs"], strict=True))


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
    damping = spec["linear_damping"] * np.sum(V[:, :3] ** 2, axis=1)
    damping += spec["angular_damping"] * np.sum(V[:, 3:] ** 2, axis=1)
    agree(got.damping, -damping)
    agree(got.friction, (1 / spec["efficiency"] - 1) * np.sum(platform * V, axis=1), ROUNDING)
    assert np.all(np.abs(got.residual) < tol)


def motion_coordinates(name, n=6):
    """Values, rates and second rates (n,) of the independent coordinates of a set."""
    rng = np.random.default_rng(SEED + 3)
    if name == "lu":
        center = dict(zip(LU, (0, 0, 0.74, 0, 0), strict=True))
        span = dict(zip(LU, (0.4, 0.1, 0.08, 0.4, 0.4), strict=True))
    else:
        free = ("x", "y", "z", "rx", "ry", "rz") if name == "stewart-gough" else ("z", "rx", "ry")
        center = {k: {"z": 0.6 if name == "stewart-gough" else 0.5}.get(k, 0.0) for k in free}
        span = {k: 0.08 if k in "xyz" else 0.3 for k in free}

    def about(mean):
        return {k: mean[k] + rng.uniform(-1, 1, n) * span[k] for k in span}

    zero = dict.fromkeys(center, 0.0)
    return about(center), about(zero), about(zero)


def at_time(q, q1, q2, t):
    """Coordinates with rates at time t of a motion with constant second rates."""
    return {k: q[k] + q1[k] * t + q2[k] * t * t / 2 for k in q}, {k: q1[k] + q2[k] * t for k in q}, q2


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


def test_legs_on_one_rod_keep_the_angle_between_their_planes():
    """A rod ties legs in different planes through it: one degree of freedom less than two UPU legs leave.

    The rod carries both revolute joints, so that the angle between their axes stays. Where both platform axes
    lie on one line, as in the paper, the angle stays anyway; elsewhere one of four actuators is redundant.
    """
    rng = np.random.default_rng(SEED)
    tables = draw("rod-of-two", ["UPS", "rRPU", "SPU", "rRPU"], rng)
    spec = o.read(tables)
    home = o.home(spec)
    counted = o.mobility(spec, home)
    assert o.dof(spec, home) == counted.joint_freedoms - counted.closure_rank == 3
    mech = pp.Mechanism.from_dict(tables)
    assert (mech.dof, mech.n_rows, mech.redundantly_actuated) == (3, 7, True)


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


# ------------------------------------------------------------------------------------------------------------
# The paper's mechanism: coordinates
# ------------------------------------------------------------------------------------------------------------


def as_dict(names, jets, which="x"):
    return {k: getattr(j, which) for k, j in zip(names, jets, strict=True)}


def lu_state():
    jets = lu_jets()
    return lu().mech.state(*(as_dict(LU, jets, w) for w in ("x", "d", "dd")))


def test_natural_coordinates():
    state = lu_state()
    assert np.all(np.isin(state.status, (pp.Status.OK, pp.Status.OUT_OF_STROKE)))
    agree(state.pose, lu().T, EXACT * 10)
    agree(state.twist, lu().twist)
    agree(state.acceleration, lu().acceleration)


def test_natural_coordinates_of_a_pose():
    found = lu().mech.coordinates(lu().T, "natural")
    agree(np.stack([found[k] for k in LU], axis=1), lu_coordinates(), 1e-12)


PAPER = ("x", "y", "z", "alpha", "beta")


def lu_paper_jets():
    """The paper's five coordinates of the sample off the fold, with rates; their branch; and γ."""
    q = lu_coordinates()
    q = q[np.abs(q[:, 4]) > 1e-2]
    center = lu_pose(q)[1]
    rng = np.random.default_rng(SEED + 4)
    values = np.column_stack([center, q[:, 0], q[:, 3]])
    rates = rng.normal(size=(2, *values.shape)) * ([0.1] * 3 + [0.5] * 2)
    jets = [o.Jet(x, d, dd) for x, d, dd in zip(values.T, rates[0].T, rates[1].T, strict=True)]
    return jets, np.sign(q[:, 4]), q[:, 4]


@pytest.mark.parametrize("branch", [1, -1])
def test_eq5_paper_coordinates(branch):
    """γ of Eq. 5 and its rates, and the pose, twist and acceleration that follow, on both branches."""
    jets, sign, gamma = lu_paper_jets()
    keep = sign == branch
    jets = [o.Jet(j.x[keep], j.d[keep], j.dd[keep]) for j in jets]
    state = lu().mech.state(*(as_dict(PAPER, jets, w) for w in ("x", "d", "dd")), branch=branch)
    near_fold = 1e-10 / np.abs(gamma[keep])
    agree(state.coordinates["gamma"], gamma[keep], near_fold)
    expected = branch * o.arccos(o.eq5(jets[1], jets[2], jets[3]))
    agree(state.coordinate_rates["gamma"], expected.d, near_fold)
    agree(state.coordinate_second_rates["gamma"], expected.dd, near_fold)
    pose = o.paper_pose(*jets, branch=branch)
    twist, acceleration = o.twist_of(pose)
    agree(state.pose[:, :3, :3], pose[0].x, 1e-12)
    agree(state.pose[:, :3, 3], pose[1].x, EXACT)
    agree(state.twist, twist, per_pose(near_fold))
    agree(state.acceleration, acceleration, per_pose(near_fold))


def test_eq5_has_no_pose_beyond_the_fold():
    """On both sides of |cos γ| = 1, and on it."""
    z, alpha = 0.74, 0.05
    span = o.E_SMALL * o.S18
    fold = (o.E1 * o.S18 * math.cos(alpha) - z * math.sin(alpha) - span) / math.cos(alpha)
    y = fold + np.array([-1e-3, -1e-9, 1e-9, 1e-3])
    ones = np.ones(4)
    q = dict(zip(PAPER, (0 * ones, y, z * ones, alpha * ones, 0.1 * ones), strict=True))
    state = lu().mech.state(q)
    assert list(state.status[:1]) == [pp.Status.NO_BRANCH]
    assert state.status[3] in (pp.Status.OK, pp.Status.OUT_OF_STROKE)
    assert np.all(np.isnan(state.pose[0]))
    assert state.status[1] == pp.Status.NO_BRANCH
    assert np.cos(state.coordinates["gamma"][3]) == pytest.approx(float(o.eq5(y[3], z, alpha).x), abs=1e-13)


def test_tool_coordinates():
    """The tip stands and the axis points where they were told to, and the joints close."""
    c = lu()
    rng = np.random.default_rng(SEED + 5)
    names = c.mech.coordinate_sets["tool"]
    direction = np.array([0, 0, 1.0]) + rng.uniform(-0.4, 0.4, (12, 3))
    tip = np.array([0, 0.037, 0.74]) + rng.uniform(-0.04, 0.04, (12, 3))
    state = c.mech.state(dict(zip(names, np.hstack([tip, 3 * direction]).T, strict=True)))
    good = np.isin(state.status, (pp.Status.OK, pp.Status.OUT_OF_STROKE))
    assert np.sum(good) >= 6
    pose = pair(state.pose[good])
    agree(pose[1], tip[good], EXACT)
    agree(
        pose[0][:, :, 2], direction[good] / np.linalg.norm(direction[good], axis=1, keepdims=True), EXACT * 10
    )
    assert np.max(np.abs(o.residuals(c.spec, pose).x)) < 1e-12


def test_pose_coordinates():
    """R = Rx Ry Rz."""
    c = case("stewart-gough")
    q = motion_coordinates("stewart-gough")[0]
    T = c.mech.pose(q)
    R = o.axis_turn(0, q["rx"]).x @ o.axis_turn(1, q["ry"]).x @ o.axis_turn(2, q["rz"]).x
    agree(T[:, :3, :3], R, EXACT)
    agree(T[:, :3, 3], np.column_stack([q[k] for k in "xyz"]), EXACT)
    back = c.mech.coordinates(T, "pose")
    for k, value in q.items():
        agree(back[k], value, EXACT * 10)


# ------------------------------------------------------------------------------------------------------------
# The paper's equations
# ------------------------------------------------------------------------------------------------------------

RPU, SPU = (0, 2), (1, 3, 4)


@functools.cache
def lu_moving():
    """For each pose the five legs as the paper's formulas take them."""
    c = lu()
    return [
        [o.lu_leg(i, (c.pose[0][k], c.pose[1][k]), c.twist[k], c.acceleration[k]) for i in range(1, 6)]
        for k in range(len(c.twist))
    ]


def printed(f, legs=range(5)):
    """f(leg) of these legs at all poses (N, legs, ...)."""
    return np.array([[f(at[i]) for i in legs] for at in lu_moving()])


def l_axes():
    """Unit vectors l of all poses, the direction from b3 to b1."""
    return lu().pose[0][:, :, 0]


@functools.cache
def lu_dynamics():
    c = lu()
    return c.mech.inverse_dynamics(c.T, c.twist, c.acceleration)


def test_eq1():
    m = lu().mech.mobility()
    assert m.dof == 5
    assert 6 * (m.links - m.joints - 1) + m.joint_freedoms + m.redundant - m.passive == 5
    assert (m.links, m.joints, m.joint_freedoms, m.closure_rank, m.redundant, m.passive) == (
        13,
        16,
        27,
        22,
        2,
        0,
    )
    assert (m.published.redundant, m.published.passive) == (3, 1)
    assert 6 * (13 - 16 - 1) + 27 + m.published.redundant - m.published.passive == m.published.dof


def test_eq2():
    q = lu_coordinates()
    agree(lu_state().pose[:, :3, :3], [o.eq2(a, b, g) for a, _, _, b, g in q], EXACT * 10)


def test_eq3():
    ik = lu().mech.inverse_kinematics(lu().T)
    agree(ik.vectors, printed(lambda m: m.r_), EXACT)
    agree(ik.directions, printed(lambda m: m.delta), EXACT)


def test_eq4():
    vectors = lu_state().pose[:, :3, 0], lu().mech.inverse_kinematics(lu_state().pose).vectors[:, 0]
    assert np.max(np.abs([o.eq4(l, r) for l, r in zip(*vectors, strict=True)])) < 1e-15


def test_eq6():
    agree(lu().kinematics.rates, printed(lambda m: o.eq6(m)[1]))
    agree(lu().mech.jacobian(lu().T)[:, :5], printed(lambda m: o.eq6(m)[2]))


def force_directions(at):
    """c1 and c3 = -c1."""
    c1 = np.cross(at[0].r_, o.LU_L)
    c1 /= np.linalg.norm(c1)
    return c1, -c1


def test_eq7():
    """The product's coupled forces, f_c3 along c3 = -c1, are in the ratio k."""
    forces = lu().mech.coupled_forces(lu().T, lu_dynamics().constraint).forces
    for at, (f1, f3) in zip(lu_moving(), forces, strict=True):
        k = o.eq7(at[0].r_, at[2].r_, *force_directions(at))
        assert -f3 == pytest.approx(k * f1, rel=1e-10)


def test_eq8():
    """They do no work."""
    c = lu()
    forces = c.mech.coupled_forces(c.T, lu_dynamics().constraint).forces
    for at, (f1, f3), V in zip(lu_moving(), forces, c.twist, strict=True):
        c1, _ = force_directions(at)
        total = np.concatenate([(f1 + f3) * c1, np.cross(at[0].e, f1 * c1) + np.cross(at[2].e, f3 * c1)])
        assert abs(total @ V) < 1e-12 * (abs(f1) + abs(f3)) * np.linalg.norm(V)


def test_eq10():
    """The row made of both forces is the length of l times the product's row."""
    rows = lu().mech.jacobian(lu().T)[:, 5]
    expected = []
    for at in lu_moving():
        ll = at[0].e - at[2].e
        c, tau = o.eq10(at[0].e, at[0].r_, at[2].r_, *force_directions(at), ll)
        expected.append(np.concatenate([c, tau]) / np.linalg.norm(ll))
    agree(rows, expected)


def test_eq11():
    rows = lu().mech.jacobian(lu().T)[:, 5]
    pairs = zip(lu_moving(), l_axes(), strict=True)
    agree(rows, [np.concatenate(o.eq11(at[0].e, at[0].r_, l)) for at, l in pairs])


def test_eq12():
    row, V = lu().mech.jacobian(lu().T)[:, 5], lu().twist
    assert np.all(np.abs(np.sum(row * V, axis=1)) < 1e-14 * np.linalg.norm(V, axis=1))


def test_eq13():
    J = [o.eq13(at, l) for at, l in zip(lu_moving(), l_axes(), strict=True)]
    agree(lu().mech.jacobian(lu().T), J)
    rates = np.column_stack([lu().kinematics.rates, np.zeros(len(J))])
    twist, _ = lu().mech.platform_twist(lu().T, lu().kinematics.rates)
    agree(twist, np.linalg.solve(J, rates[..., None])[..., 0], ROUNDING * per_pose(lu().condition))


def test_eq15():
    """The product's matrices are the symmetric parts of the printed ones."""
    h = printed(o.eq15)
    agree(lu().mech.hessian(lu().T)[:, :5], (h + np.swapaxes(h, -1, -2)) / 2)


def test_eq16():
    """The rates c' and τ' against the product's row along the motion."""
    q = motion_coordinates("lu")
    mech = lu().mech

    def row(t):
        return mech.jacobian(mech.pose(at_time(*q, t)[0]))[:, 5]

    first, _ = o.differentiate(row, 8e-3)
    state, expected = mech.state(*q), []
    for T, V in zip(state.pose, state.twist, strict=True):
        m = o.lu_leg(1, (T[:3, :3], T[:3, 3]), V, 0 * V)
        Q, Q1 = o.eq16(m.e, m.r_, T[:3, 0])
        expected.append(np.concatenate([-Q @ V[3:], -Q.T @ V[:3] + Q1 @ V[3:]]))
    agree(first, expected, STENCIL)


def test_eq17():
    h = np.array([o.eq17(at[0].e, at[0].r_, l) for at, l in zip(lu_moving(), l_axes(), strict=True)])
    agree(lu().mech.hessian(lu().T)[:, 5], (h + np.swapaxes(h, -1, -2)) / 2)


def test_eq18():
    c = lu()
    J, H = c.mech.jacobian(c.T)[:, 5], c.mech.hessian(c.T)[:, 5]
    left = np.sum(J * c.acceleration, axis=1) + np.einsum("nij,ni,nj->n", H, c.twist, c.twist)
    assert np.all(np.abs(left) < 1e-13 * np.linalg.norm(c.acceleration, axis=1))


def test_eq19():
    c = lu()
    a_r = np.column_stack([c.kinematics.accelerations, np.zeros(len(c.twist))])
    expected = [o.eq19(at, l, a, V) for at, l, a, V in zip(lu_moving(), l_axes(), a_r, c.twist, strict=True)]
    got, _ = c.mech.platform_acceleration(c.T, c.twist, c.kinematics.accelerations)
    agree(got, expected, ROUNDING * per_pose(c.condition))


def test_eq20():
    w, r = lu().kinematics.leg_omega, printed(lambda m: m.r_)
    agree(np.cross(w, r), printed(lambda m: o.eq6(m)[0] - o.eq6(m)[1] * m.delta))


def test_eq21():
    w, d, r = lu().kinematics.leg_omega, printed(lambda m: m.delta), printed(lambda m: m.r)[..., None]
    across_ = r * (w - d * np.sum(w * d, axis=-1, keepdims=True))
    agree(across_, printed(lambda m: np.cross(m.delta, o.eq6(m)[0])))


def test_eq22():
    w1, w2 = np.moveaxis(printed(o.eq25, RPU), -1, 0)[..., None]
    R1, R2 = np.moveaxis(printed(o.eq22, RPU), 2, 0)
    agree(lu().kinematics.leg_omega[:, RPU], w1 * R1 + w2 * R2)


def test_eq23():
    w, r = lu().kinematics.leg_omega[:, RPU], printed(lambda m: m.r_, RPU)

    def right(m):
        return -o.skew(m.delta) @ o.skew(m.delta) @ (m.v - o.skew(m.e) @ m.omega)

    agree(np.cross(w, r), printed(right, RPU))


def test_eq24():
    """The product's joint rates below, times D_i1."""
    rates = lu().kinematics.base_joint_rates[:, RPU]

    def right(m):
        R1, R2 = o.eq22(m)
        u = o.skew(m.delta) @ o.skew(m.delta) @ (m.v - o.skew(m.e) @ m.omega)
        return np.array([R2 @ u, -R1 @ u])

    D1 = printed(lambda m: np.cross(*o.eq22(m)) @ m.r_, RPU)[..., None]
    agree(np.abs(rates * D1), np.abs(printed(right, RPU)))


def test_eq25():
    """The base joint's rates, up to the sense in which each angle is counted."""
    agree(np.abs(lu().kinematics.base_joint_rates[:, RPU]), np.abs(printed(o.eq25, RPU)))


def test_eq26():
    agree(lu().kinematics.leg_omega[:, RPU], printed(lambda m: o.eq26(m) @ m.V, RPU))


def test_eq27():
    agree(lu().kinematics.leg_omega[:, RPU], printed(lambda m: np.divide(*o.eq27(m)), RPU))


def test_eq28():
    agree(lu().kinematics.leg_eps[:, RPU], printed(o.eq28, RPU))


def test_eq29():
    agree(lu().kinematics.leg_omega[:, SPU], printed(o.eq29, SPU))


def test_eq30():
    w, r = lu().kinematics.leg_omega[:, SPU], printed(lambda m: m.r_, SPU)

    def left(m):
        (R1, R2), (phi1, phi2) = o.eq33_axes(m), o.eq32(m)
        return np.cross(m.omega, m.r_) - np.cross(phi1 * R1, m.r_) - np.cross(phi2 * R2, m.r_)

    agree(np.cross(w, r), printed(left, SPU))


def test_eq31():
    """Eq. 30 along both axes of the joint, with the product's ω_ri on the right."""
    for j, other in ((0, 1), (1, 0)):

        def left(m, j=j, other=other):
            R, phi = o.eq33_axes(m), o.eq32(m)
            return (np.cross(m.omega, m.r_) - np.cross(phi[other] * R[other], m.r_)) @ R[j]

        w, r = lu().kinematics.leg_omega[:, SPU], printed(lambda m: m.r_, SPU)
        axis = printed(lambda m, j=j: o.eq33_axes(m)[j], SPU)
        agree(np.sum(np.cross(w, r) * axis, axis=-1), printed(left, SPU))


def test_eq32():
    """The platform joint's rates, up to the sense in which each angle is counted."""
    agree(np.abs(lu().kinematics.platform_joint_rates[:, SPU]), np.abs(printed(o.eq32, SPU)))


def test_eq33():
    agree(lu().kinematics.leg_omega[:, SPU], printed(lambda m: o.eq33(m) @ m.V, SPU))


def test_eq34a():
    agree(lu().kinematics.leg_omega[:, SPU], printed(o.eq34a, SPU))
    agree(lu().kinematics.accelerations, printed(lambda m: o.eq34a_rates(m)[4]))


def test_eq34b():
    """d'_i1 and d'_i2 are what rotates Eq. 34a into the product's angular acceleration."""

    def eps(m):
        R1, R2 = o.eq33_axes(m)
        d1, d2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
        d1_rate, d2_rate = o.eq34b(m)
        v_i, v_r, delta_rate, a_i, a_r = o.eq34a_rates(m)
        D = v_r * m.delta - v_i - np.cross(m.r_, m.omega)
        D_rate = a_r * m.delta + v_r * delta_rate - a_i - np.cross(v_i, m.omega) - np.cross(m.r_, m.eps)
        return m.eps + (d2_rate @ D + d2 @ D_rate) / d1 - d2 @ D * d1_rate / d1**2

    agree(lu().kinematics.leg_eps[:, SPU], printed(eps, SPU))


def test_eq35():
    agree(lu().kinematics.leg_eps[:, SPU], printed(o.eq35, SPU))


def test_eq36():
    agree(lu().kinematics.rod_omega, printed(lambda m: o.eq36(m)[0], (0,)))
    agree(lu().kinematics.rod_omega, printed(lambda m: o.eq36(m)[1] @ m.V, (0,)))


def test_eq37():
    agree(lu().kinematics.rod_eps, printed(o.eq37, (0,)))


def by_leg(rpu, spu):
    """A formula for RPU legs and another for SPU legs, at all poses (N, 5, ...)."""
    return np.array([[(rpu if i in RPU else spu)(at[i]) for i in range(5)] for at in lu_moving()])


def test_eq38():
    k = lu().kinematics
    for which, got in enumerate((k.piston_velocity, k.cylinder_velocity)):
        agree(got, by_leg(*(lambda m, f=f, w=which: o.eq38(m, f(m))[w] @ m.V for f in (o.eq26, o.eq33))))


def test_eq39():
    k = lu().kinematics
    turning = ((o.eq26, o.eq28), (o.eq33, o.eq35))
    for which, got in enumerate((k.piston_acceleration, k.cylinder_acceleration)):
        agree(got, by_leg(*(lambda m, f=f, g=g, w=which: o.eq39(m, f(m) @ m.V, g(m))[w] for f, g in turning)))


@pytest.mark.parametrize(("eta", "mu"), [(1.0, 0.0), (0.8, 7.0)])
def test_eq43(eta, mu):
    """Active forces and f_c, with the weights and inertias of Eq. 40, exact for isotropic ones."""
    c = lu()
    tables = o.lu()
    tables["dynamics"] = {"efficiency": eta, "linear_damping": mu, "angular_damping": mu}
    mech = pp.Mechanism.from_dict(tables)
    load = o.load_at(c.spec, c.pose)
    F = np.array([o.eq43(at, l, w, eta, mu) for at, l, w in zip(lu_moving(), l_axes(), load, strict=True)])
    got = mech.inverse_dynamics(c.T, c.twist, c.acceleration)
    agree(np.hstack([got.forces, got.constraint]), F, FORCES * per_pose(c.condition))
    # f_c on its own, since it is small beside the active forces.
    agree(got.constraint, F[:, 5:], 10 * FORCES * per_pose(c.condition))


def test_eq40_lacks_the_gyroscopic_torque():
    """With unequal moments of inertia the platform's -ω × I ω is there, other than in print."""
    tables = o.lu()
    tables["platform"]["inertia"] = [5, 3, 7]
    c, mech, inertia = lu(), pp.Mechanism.from_dict(tables), np.diag([5.0, 3.0, 7.0])
    change = mech.inverse_dynamics(c.T, c.twist, c.acceleration).forces - lu_dynamics().forces
    J = c.mech.jacobian(c.T)
    R, w, eps = c.pose[0], c.twist[:, 3:], c.acceleration[:, 3:]
    world = R @ inertia @ np.swapaxes(R, 1, 2)
    torque = -o.times(world, eps) - np.cross(w, o.times(world, w)) + 5 * eps
    wrench = np.concatenate([0 * torque, torque], axis=1)
    expected = np.linalg.solve(np.swapaxes(J, 1, 2), -wrench[..., None])[:, :5, 0]
    error = np.max(np.abs(change - expected), axis=1) / np.max(np.abs(lu_dynamics().forces), axis=1)
    assert np.all(error < 10 * FORCES * c.condition)


def test_eq42():
    """Virtual work along feasible motions, with the product's forces and the printed velocities."""
    c = lu()
    W, _ = o.generalised_force(c.spec, c.pose, c.twist, c.acceleration)
    Z, scale = o.feasible_directions(c.spec, c.pose)
    moves = np.swapaxes(Z, 1, 2) / scale
    rows = c.mech.jacobian(c.T)[:, :5]
    work = np.einsum("nki,nji,nj->nk", moves, rows, lu_dynamics().forces)
    size = np.max(np.abs(lu_dynamics().forces), axis=1)
    assert np.all(np.abs(work + o.times(moves, W)) < FORCES * 10 * per_pose(size * c.condition))


def test_eq44_as_printed():
    """The print's own split, where it has one: it fails where l is along L, or where d1 = -d3."""
    c = lu()
    f_c = lu_dynamics().constraint
    got = c.mech.coupled_forces(c.T, f_c, as_printed=True)
    for k, at in enumerate(lu_moving()):
        c1, _ = force_directions(at)
        f1, f3, torque = o.eq44(at[0].r_, at[2].r_, c1, f_c[k, 0])
        assert got.forces[k] == pytest.approx([f1, f3], rel=1e-11)
        # The rod feels the reaction of r1 × f_c1 c1: its part along L, with the other sign.
        assert got.torque[k] == pytest.approx(-torque @ o.LU_L, rel=1e-11)


@pytest.mark.parametrize("name", ["lu", "rod-lined"])
def test_coupled_forces_are_the_constraint_wrench(name):
    """Both forces are f_c (c, τ), found from six equations of statics; finite also where l is along L."""
    c = any_case(name)
    f_c = c.mech.inverse_dynamics(c.T, c.twist, c.acceleration).constraint
    got = c.mech.coupled_forces(c.T, f_c)
    on_rod = [i for i, leg in enumerate(c.spec["legs"]) if leg["base"]["rod"] is not None]
    assert got.legs == tuple(c.spec["legs"][i]["name"] for i in on_rod)
    L = c.spec["rods"][0]["axis"]
    expected, torques = [], []
    for k in range(len(c.twist)):
        first, second = (c.legs[i] for i in on_rod)
        e1, e3, r1, r3 = (x.x[k] for x in (first.e, second.e, first.r, second.r))
        l = first.platform_axis.x[k]
        forces, left_over = o.coupled_forces(e1, e3, r1, r3, l, f_c[k, 0], L)
        assert np.max(np.abs(left_over)) < 1e-11 * np.max(np.abs(forces))
        noted, torque = o.coupled_forces_of_the_notes(r1, r3, e1 - e3, f_c[k, 0], L)
        assert forces == pytest.approx(noted * np.sign((e1 - e3) @ l), rel=1e-9)
        expected.append(forces)
        torques.append(torque * np.sign((e1 - e3) @ l))
    agree(got.forces, expected, 1e-9)
    agree(got.torque, torques, 1e-9)
