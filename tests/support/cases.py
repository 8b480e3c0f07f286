"""States for comparisons with the oracle: of the paper's mechanism, files, and drawn ones of all leg types.

Poses are sampled by one recipe: the centre pose · uniform · near it, down to 1e-12 · at the stroke limits
and on both sides · near singularities and on both sides · at and near the poses where a formula degenerates.
Seeds are fixed.
"""

from __future__ import annotations

import functools
import math
import tomllib
from dataclasses import dataclass

import numpy as np
import pytest

import polypod as pp
from support import DATA
from support import oracle as o

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
    units = {kind: list(names)[rng.integers(len(names))] for kind, names in o.UNITS.items()}
    per = {kind: 1 / o.UNITS[kind][unit] for kind, unit in units.items()}
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
        per = o.UNITS["length"][tables["units"]["length"]]
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


def as_dict(names, jets, which="x"):
    return {k: getattr(j, which) for k, j in zip(names, jets, strict=True)}


def lu_state():
    jets = lu_jets()
    return lu().mech.state(*(as_dict(LU, jets, w) for w in ("x", "d", "dd")))
