"""A second model of a mechanism, in numpy, made from positions alone.

Nothing here is shared with Polypod, and the road is another one. Links have frames that are functions of
the pose; their velocities and accelerations are the rates of those functions along a motion (`Jet`: value,
rate and second rate), angular velocity is read off R' Rᵀ, and forces come from virtual work over directions
that keep the joints closed. Constraints are written as what the joints hold together, not as wrenches.

The second half holds the paper's equations as printed, one function for each, with the slips of the print put
right where the docstring says so.

SI units. Poses are a pair (R, o) with shapes (..., 3, 3) and (..., 3); twists, accelerations and wrenches
(..., 6), linear part first, in base axes, at o. A scalar that belongs to a vector keeps a last axis of one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

# ------------------------------------------------------------------------------------------------------------
# Numbers with rates
# ------------------------------------------------------------------------------------------------------------


class Jet:
    """An array x of numbers with their rate d and their second rate dd."""

    __array_ufunc__ = None  # numpy leaves `array * jet` to the jet
    __slots__ = ("d", "dd", "x")

    def __init__(self, x, d=None, dd=None):
        self.x = np.asarray(x, float)
        self.d = np.zeros_like(self.x) if d is None else d
        self.dd = np.zeros_like(self.x) if dd is None else dd

    def __add__(self, other):
        b = jet(other)
        return Jet(self.x + b.x, self.d + b.d, self.dd + b.dd)

    def __neg__(self):
        return Jet(-self.x, -self.d, -self.dd)

    def __sub__(self, other):
        return self + -jet(other)

    def __rsub__(self, other):
        return jet(other) - self

    def __mul__(self, other):
        return bilinear(np.multiply, self, other)

    def __truediv__(self, other):
        b = jet(other)
        return self * chain(b, 1 / b.x, -1 / b.x**2, 2 / b.x**3)

    __radd__, __rmul__ = __add__, __mul__


def jet(x) -> Jet:
    return x if isinstance(x, Jet) else Jet(x)


def bilinear(f, a, b) -> Jet:
    """f(a, b) for an f that is linear in both: the product rule."""
    a, b = jet(a), jet(b)
    return Jet(f(a.x, b.x), f(a.d, b.x) + f(a.x, b.d), f(a.dd, b.x) + 2 * f(a.d, b.d) + f(a.x, b.dd))


def chain(a: Jet, f, f1, f2) -> Jet:
    """A function of a, given by its value and its first and second derivatives there: the chain rule."""
    return Jet(f, f1 * a.d, f1 * a.dd + f2 * a.d**2)


def sin(a) -> Jet:
    a = jet(a)
    return chain(a, np.sin(a.x), np.cos(a.x), -np.sin(a.x))


def cos(a) -> Jet:
    a = jet(a)
    return chain(a, np.cos(a.x), -np.sin(a.x), -np.cos(a.x))


def arccos(a) -> Jet:
    a = jet(a)
    w = 1 - a.x**2
    return chain(a, np.arccos(a.x), -1 / np.sqrt(w), -a.x / w**1.5)


def dot(a, b) -> Jet:
    return bilinear(lambda p, q: np.sum(p * q, axis=-1, keepdims=True), a, b)


def cross(a, b) -> Jet:
    return bilinear(np.cross, a, b)


def apply(R, m) -> Jet:
    return bilinear(lambda p, q: np.einsum("...ij,...j->...i", p, q), R, m)


def matmul(A, B) -> Jet:
    return bilinear(np.matmul, A, B)


def norm(a) -> Jet:
    s = dot(a, a)
    root = np.sqrt(s.x)
    return chain(s, root, 0.5 / root, -0.25 / root**3)


def unit(a) -> Jet:
    return jet(a) / norm(a)


def concat(items) -> Jet:
    """Arrays side by side along the last axis."""
    items = [jet(i) for i in items]
    return Jet(*(_side_by_side([getattr(i, s) for i in items]) for s in ("x", "d", "dd")))


def _side_by_side(arrays):
    shape = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
    return np.concatenate([np.broadcast_to(a, (*shape, a.shape[-1])) for a in arrays], axis=-1)


def columns(*vectors) -> Jet:
    """The matrix (..., 3, 3) with these columns."""
    flat = concat(vectors)
    return Jet(*(np.swapaxes(a.reshape(*a.shape[:-1], 3, 3), -1, -2) for a in (flat.x, flat.d, flat.dd)))


# ------------------------------------------------------------------------------------------------------------
# Turns
# ------------------------------------------------------------------------------------------------------------


def skew(u):
    """The matrix u× of Eq. 14."""
    u = np.asarray(u, float)
    x, y, z, o = u[..., 0], u[..., 1], u[..., 2], np.zeros(u.shape[:-1])
    return np.stack([np.stack([o, -z, y], -1), np.stack([z, o, -x], -1), np.stack([-y, x, o], -1)], -2)


def vee(W):
    """The vector of the antisymmetric part of W, the inverse of `skew`."""
    parts = [W[..., 2, 1] - W[..., 1, 2], W[..., 0, 2] - W[..., 2, 0], W[..., 1, 0] - W[..., 0, 1]]
    return 0.5 * np.stack(parts, -1)


def turn(phi):
    """The rotation matrix of a rotation vector (..., 3), by Rodrigues."""
    phi = np.asarray(phi, float)
    angle = np.linalg.norm(phi, axis=-1)[..., None, None]
    K = skew(phi)
    half = np.sinc(angle / (2 * np.pi))  # sin(angle/2) / (angle/2)
    return np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * half**2 * K @ K


def axis_turn(axis: int, angle) -> Jet:
    """The rotation by `angle` (...,) about a coordinate axis."""
    a = jet(angle)
    a = Jet(a.x[..., None], a.d[..., None], a.dd[..., None])
    basis = np.eye(3)
    e = [basis[k] for k in range(3)]
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    cols = [None, None, None]
    cols[i] = Jet(e[i])
    cols[j] = cos(a) * e[j] + sin(a) * e[k]
    cols[k] = cos(a) * e[k] - sin(a) * e[j]
    return columns(*cols)


def spin_of(frame: Jet):
    """Angular velocity and acceleration of a frame: E' Eᵀ = [ω]; E'' Eᵀ = [ε] + [ω][ω], last symmetric."""
    Et = np.swapaxes(frame.x, -1, -2)
    return vee(frame.d @ Et), vee(frame.dd @ Et)


def twist_of(pose):
    """Twist and acceleration (..., 6) of a pose with rates."""
    omega, eps = spin_of(pose[0])
    return _side_by_side([pose[1].d, omega]), _side_by_side([pose[1].dd, eps])


def moving(pose, twist, acceleration=None):
    """The pose as jets along a motion with this twist and acceleration."""
    R, o = np.asarray(pose[0], float), np.asarray(pose[1], float)
    twist = np.asarray(twist, float)
    acceleration = np.zeros_like(twist) if acceleration is None else np.asarray(acceleration, float)
    W, E = skew(twist[..., 3:]), skew(acceleration[..., 3:])
    return Jet(R, W @ R, (E + W @ W) @ R), Jet(o, twist[..., :3], acceleration[..., :3])


def along(pose, twist, acceleration, t):
    """The pose at time t on a true motion that starts with this twist and acceleration."""
    twist, acceleration = np.asarray(twist), np.asarray(acceleration)
    step = twist * t + acceleration * t**2 / 2
    return turn(step[..., 3:]) @ pose[0], pose[1] + step[..., :3]


# Eighth-order central differences: weights of f(t + k h), k = 1..4; antisymmetric and symmetric.
_FIRST = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
_SECOND = np.array([8 / 5, -1 / 5, 8 / 315, -1 / 560])
_SECOND_0 = -205 / 72


def differentiate(f, h):
    """f', f'' at 0 by eighth-order central differences with step h."""
    plus = [np.asarray(f(k * h)) for k in range(1, 5)]
    minus = [np.asarray(f(-k * h)) for k in range(1, 5)]
    middle = np.asarray(f(0.0))
    first = sum(w * (p - m) for w, p, m in zip(_FIRST, plus, minus, strict=True)) / h
    second = sum(w * (p + m) for w, p, m in zip(_SECOND, plus, minus, strict=True)) + _SECOND_0 * middle
    return first, second / h**2


# ------------------------------------------------------------------------------------------------------------
# The mechanism: a file's tables, read into SI
# ------------------------------------------------------------------------------------------------------------

_UNITS = {
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254},
    "angle": {"rad": 1.0, "deg": math.pi / 180},
    "mass": {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    "inertia": {"kg m^2": 1.0, "kg mm^2": 1e-6, "g mm^2": 1e-9},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3},
    "torque": {"N m": 1.0, "N mm": 1e-3, "kN m": 1e3},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3},
}


def read(d: dict) -> dict:
    """The SI description of a mechanism file's tables."""
    scale = {kind: _UNITS[kind][name] for kind, name in d.get("units", {}).items()}
    length, angle = scale.get("length", 1.0), scale.get("angle", 1.0)

    def point(p):
        if isinstance(p, dict):
            a = p["angle"] * angle
            p = [p["radius"] * math.cos(a), p["radius"] * math.sin(a), p.get("z", 0.0)]
        return np.array(p, float) * length

    def axis(a):
        if a is None:
            return None
        if isinstance(a, dict):
            a = [math.cos(a["angle"] * angle), math.sin(a["angle"] * angle), a.get("z", 0.0)]
        return np.array(a, float) / np.linalg.norm(a)

    def body(b, along_leg=0):
        if b is None:
            return None
        c = b.get("center", 0.0 if along_leg else [0, 0, 0])
        c = np.array(c, float) if np.ndim(c) else np.array([0, along_leg * c, 0.0])
        inertia = np.array(b.get("inertia", 0.0), float)
        inertia = inertia * np.eye(3) if inertia.ndim < 2 else inertia
        mass = b["mass"] * scale.get("mass", 1.0)
        return {"mass": mass, "center": c * length, "inertia": inertia * scale.get("inertia", 1.0)}

    rods = d.get("rods", [])
    names = [r["name"] for r in rods]

    def joint(j):
        rod = names.index(j["rod"]) if "rod" in j else None
        return {
            "joint": j["joint"],
            "point": point(j["point"]),
            "axis": axis(j.get("axis")),
            "normal": axis(j.get("normal")),
            "rod": rod,
        }

    dynamics, load, home, tool = (d.get(k, {}) for k in ("dynamics", "load", "home", "tool"))
    return {
        "name": d["name"],
        "platform": body(d.get("platform")),
        "rods": [
            {
                "name": r["name"],
                "point": point(r["point"]),
                "axis": axis(r["axis"]),
                "body": body(r) if "mass" in r else None,
            }
            for r in rods
        ],
        "legs": [
            {
                "name": leg.get("name", str(i + 1)),
                "actuated": leg.get("actuated", True),
                "stroke": [v * length for v in (leg["stroke"]["min"], leg["stroke"]["max"])]
                if "stroke" in leg
                else None,
                "base": joint(leg["base"]),
                "platform": joint(leg["platform"]),
                "cylinder": body(leg.get("cylinder"), along_leg=1),
                "piston": body(leg.get("piston"), along_leg=-1),
            }
            for i, leg in enumerate(d["legs"])
        ],
        "gravity": np.array(dynamics.get("gravity", [0, 0, -9.81]), float) * scale.get("acceleration", 1.0)
        if "gravity" in dynamics
        else np.array([0, 0, -9.81]),
        "efficiency": dynamics.get("efficiency", 1.0),
        "linear_damping": dynamics.get("linear_damping", 0.0),
        "angular_damping": dynamics.get("angular_damping", 0.0),
        "load": {
            "force": np.array(load.get("force", [0, 0, 0]), float) * scale.get("force", 1.0),
            "torque": np.array(load.get("torque", [0, 0, 0]), float) * scale.get("torque", 1.0),
            "axes": load.get("axes", "base"),
        },
        "home": {
            "position": np.array(home["position"], float) * length,
            "rotation_vector": np.array(home.get("rotation_vector", [0, 0, 0]), float) * angle,
        },
        "tool": {"point": point(tool.get("point", [0, 0, 0])), "axis": axis(tool.get("axis", [0, 0, 1]))},
    }


def home(spec):
    return turn(spec["home"]["rotation_vector"]), spec["home"]["position"]


LU_ANGLES = (18.0, 90.0, 162.0, 234.0, 306.0)


def lu() -> dict:
    """The paper's mechanism, Table II, as a file's tables. At home m is parallel to B, 740 mm above it."""
    legs = []
    for i, theta in enumerate(LU_ANGLES):
        on_rod = i in (0, 2)
        base = {"joint": "R", "rod": "L"} if on_rod else {"joint": "S"}
        base["point"] = {"radius": 270 if on_rod else 265, "angle": theta}
        inward = [-math.cos(math.radians(theta)), -math.sin(math.radians(theta)), 0]
        platform = {"joint": "U", "axis": [1, 0, 0] if on_rod else inward}
        platform["point"] = {"radius": 150, "angle": theta}
        piston = {"mass": 3, "center": 100 if on_rod else 98, "inertia": 3}
        cylinder = {"mass": 2, "center": 50, "inertia": 2}
        stroke = {"min": 650, "max": 850}
        legs.append(
            {"base": base, "platform": platform, "piston": piston, "cylinder": cylinder, "stroke": stroke}
        )
    s18 = math.sin(math.radians(18))
    return {
        "name": "lu-3spu-2rpu-r",
        "units": {
            "length": "mm",
            "angle": "deg",
            "mass": "kg",
            "inertia": "kg m^2",
            "force": "N",
            "torque": "N m",
        },
        "load": {"force": [10, 10, 500], "torque": [0, 0, 1000]},
        "home": {"position": [0, 120 * s18, 740]},
        "platform": {"mass": 3, "center": [0, 0, 0], "inertia": 5},
        "rods": [
            {
                "name": "L",
                "point": [0, 270 * s18, 0],
                "axis": [1, 0, 0],
                "mass": 2,
                "center": [0, 0, 0],
                "inertia": 2,
            }
        ],
        "legs": legs,
    }


# ------------------------------------------------------------------------------------------------------------
# Geometry
# ------------------------------------------------------------------------------------------------------------


@dataclass
class Leg:
    """One leg at a pose. `frame` has the columns n, δ, n×δ; `base_axis`, `platform_axis` are in base axes."""

    e: Jet
    b: Jet
    r: Jet
    length: Jet
    delta: Jet
    n: Jet
    frame: Jet
    base_axis: np.ndarray | None
    platform_axis: Jet | None


def leg_at(spec, leg, pose) -> Leg:
    """The leg's geometry at the pose (R, o), whose entries may carry rates."""
    R, o = pose
    base, platform = leg["base"], leg["platform"]
    e = apply(R, platform["point"])
    b = e + o
    r = b - base["point"]
    delta = unit(r)
    base_axis = spec["rods"][base["rod"]]["axis"] if base["rod"] is not None else base["axis"]
    platform_axis = None if platform["axis"] is None else apply(R, platform["axis"])

    # The normal: given by the base joint if that one keeps the leg from spinning, else by the platform joint.
    if base["joint"] == "U" or base["rod"] is not None:
        N = cross(base_axis, delta)
    elif base["joint"] == "R":
        N = Jet(base_axis)
    elif base["joint"] == "F":
        N = Jet(base["normal"])
    elif platform["joint"] == "U":
        N = cross(platform_axis, delta)
    elif platform["joint"] == "R":
        N = platform_axis
    elif platform["joint"] == "F":
        N = apply(R, platform["normal"])
    else:
        N = None
    if N is None:
        # S and S: symmetric, any normal that is carried along without spin.
        some = np.where(np.abs(delta.x[..., :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
        n0 = np.cross(some, delta.x)
        n0 /= np.linalg.norm(n0, axis=-1, keepdims=True)
        w, eps = np.cross(delta.x, delta.d), np.cross(delta.x, delta.dd)
        n = Jet(n0, np.cross(w, n0), np.cross(eps, n0) + np.cross(w, np.cross(w, n0)))
    else:
        # Where the joints hold, N is perpendicular to δ already; taking off the rest makes E a frame at any
        # pose.
        n = unit(N - dot(N, delta) * delta)
    frame = columns(n, delta, cross(n, delta))
    return Leg(e, b, r, norm(r), delta, n, frame, base_axis, platform_axis)


def legs_at(spec, pose) -> list[Leg]:
    return [leg_at(spec, leg, pose) for leg in spec["legs"]]


def rod_frame(spec, k, legs) -> Jet:
    """The frame (L, n, L×n) of rod k, which rotates with the first leg that it carries."""
    first = next(i for i, leg in enumerate(spec["legs"]) if leg["base"]["rod"] == k)
    L = spec["rods"][k]["axis"]
    n = unit(cross(L, legs[first].delta))
    return columns(L, n, cross(L, n))


@dataclass
class Link:
    """A link with mass: its mass centre and its frame, with rates."""

    name: str
    body: dict
    center: Jet
    frame: Jet


def links_at(spec, pose) -> list[Link]:
    R, o = jet(pose[0]), jet(pose[1])
    legs = legs_at(spec, (R, o))
    links = []
    if spec["platform"]:
        links.append(Link("platform", spec["platform"], apply(R, spec["platform"]["center"]) + o, R))
    for k, rod in enumerate(spec["rods"]):
        if rod["body"]:
            frame = rod_frame(spec, k, legs)
            links.append(Link("rod", rod["body"], apply(frame, rod["body"]["center"]) + rod["point"], frame))
    for leg, at in zip(spec["legs"], legs, strict=True):
        if leg["cylinder"]:
            center = apply(at.frame, leg["cylinder"]["center"]) + leg["base"]["point"]
            links.append(Link("cylinder", leg["cylinder"], center, at.frame))
        if leg["piston"]:
            center = apply(at.frame, leg["piston"]["center"]) + at.b
            links.append(Link("piston", leg["piston"], center, at.frame))
    return links


def residuals(spec, pose) -> Jet:
    """Closure residuals of the joints, side by side (..., k); zero where the mechanism closes.

    In the leg's frame (n, δ, w): a universal joint's two axes stay perpendicular (u·n = 0), a revolute
    joint's axis is n (u·δ = u·w = 0), a fixed joint keeps direction and normal (d·n = d·w = n'·w = 0). Of the
    joint that n was made from, what holds anyway is left out. Legs on one rod keep the angle between their
    normals, that of the home pose, or of the mechanism `spec["tied"]` at its home pose.
    """
    R, o = jet(pose[0]), jet(pose[1])
    legs = legs_at(spec, (R, o))
    parts = [dot(o, np.zeros(3))]  # one zero, for mechanisms without constraints
    for leg, at in zip(spec["legs"], legs, strict=True):
        w = cross(at.n, at.delta)
        for side in ("base", "platform"):
            j = leg[side]
            on_platform = side == "platform"
            axis = at.platform_axis if on_platform else at.base_axis
            gives_n = side == ("platform" if leg["base"]["joint"] == "S" else "base")
            if j["joint"] == "U" and not gives_n:
                parts.append(dot(axis, at.n))
            elif j["joint"] == "R" and j["rod"] is None:
                parts += [dot(axis, at.delta)] + ([] if gives_n else [dot(axis, w)])
            elif j["joint"] == "F":
                normal = apply(R, j["normal"]) if on_platform else j["normal"]
                parts += [dot(axis, at.n), dot(axis, w)] + ([] if gives_n else [dot(normal, w)])
    for k in range(len(spec["rods"])):
        carried = [i for i, leg in enumerate(spec["legs"]) if leg["base"]["rod"] == k]
        frame = rod_frame(spec, k, legs)
        for i in carried[1:]:
            tied = spec.get("tied", spec)
            at_home = [leg_at(tied, tied["legs"][m], home(tied)) for m in (carried[0], i)]
            kept = rod_frame(tied, k, {carried[0]: at_home[0]}).x.T @ at_home[1].n.x
            parts.append(dot(legs[i].base_axis, cross(apply(frame, kept), legs[i].n)))
    return concat(parts)


def theory_constraints(spec, pose) -> Jet:
    """The constraints g of the theory page, table T9, for legs with at most one of kind D."""
    R, o = jet(pose[0]), jet(pose[1])
    parts = []
    for leg in spec["legs"]:
        at = leg_at(spec, leg, (R, o))
        kinds = ("U" if leg["base"]["rod"] is not None else leg["base"]["joint"]) + leg["platform"]["joint"]
        aB, aP, r = at.base_axis, at.platform_axis, at.r
        if kinds == "UU":
            parts.append(dot(cross(aP, r), aB))
        elif kinds == "RS":
            parts.append(dot(r, aB))
        elif kinds == "SR":
            parts.append(dot(r, aP))
        elif kinds == "RU":
            parts += [dot(r, aB), dot(aB, aP)]
        elif kinds == "UR":
            parts += [dot(r, aP), dot(aB, aP)]
    return concat(parts)


UNIT_TWISTS = np.eye(6)


def six_directions(pose):
    """The pose along the six unit twists: jets with a leading axis of six."""
    R, o = np.asarray(pose[0], float), np.asarray(pose[1], float)
    return moving((R, o), UNIT_TWISTS.reshape(6, *([1] * (o.ndim - 1)), 6) + np.zeros((*o.shape[:-1], 6)))


def gradient(f, pose):
    """df/d(twist), shape (..., k, 6), of a function of the pose with values (..., k)."""
    return np.moveaxis(f(six_directions(pose)).d, 0, -1)


def characteristic_length(spec) -> float:
    return math.sqrt(np.mean([np.sum(leg["platform"]["point"] ** 2) for leg in spec["legs"]]))


# Singular values of the scaled closure gradient below this share of the largest, or of 1/m, are zero.
RANK_TOLERANCE = 1e-7
# The same while closing: redundant constraints only agree where all are met.
CLOSING = 1e-4


def closure_gradient(spec, pose):
    """Gradient (..., k, 6) of the residuals on scaled twists (v, Λω), and the scale (6,) of a twist."""
    scale = np.array([1, 1, 1] + [characteristic_length(spec)] * 3)
    return gradient(lambda p: residuals(spec, p), pose) / scale, scale


def feasible_directions(spec, pose):
    """A basis (..., 6, dof) of the twists (v, Λω) that keep the joints closed, orthonormal; and the scale."""
    C, scale = closure_gradient(spec, pose)
    _, s, Vt = np.linalg.svd(C)
    ranks = np.sum(s > RANK_TOLERANCE * np.maximum(s[..., :1], 1), axis=-1)
    rank = int(np.max(ranks))
    assert np.all(ranks == rank), "the poses of one batch have one mobility"
    return np.swapaxes(Vt[..., rank:, :], -1, -2), scale


def dof(spec, pose) -> int:
    return feasible_directions(spec, pose)[0].shape[-1]


def times(A, x):
    """A x for stacks of matrices and vectors."""
    return np.einsum("...ij,...j->...i", A, x)


def close(spec, pose, iterations=25):
    """The poses nearby at which all joints close: Newton's method with the least step, up to 0.1."""
    R, o = np.array(pose[0], float), np.array(pose[1], float)
    for _ in range(iterations):
        g = residuals(spec, (R, o)).x
        if np.max(np.abs(g)) < 2e-15:
            break
        C, scale = closure_gradient(spec, (R, o))
        step = -times(np.linalg.pinv(C, rcond=CLOSING), g) / scale
        step *= np.minimum(1, 0.1 / np.maximum(np.linalg.norm(step, axis=-1, keepdims=True), 0.1))
        R, o = turn(step[..., 3:]) @ R, o + step[..., :3]
        U, _, Vt = np.linalg.svd(R)
        R = U @ Vt
    return R, o


def feasible_motion(spec, pose, q, q2):
    """Twist and acceleration (..., 6) that keep the joints closed, from free numbers (..., 6)."""
    Z, scale = feasible_directions(spec, pose)
    k = Z.shape[-1]
    twist = times(Z, q[..., :k]) / scale
    g2 = residuals(spec, moving(pose, twist)).dd
    C, _ = closure_gradient(spec, pose)
    back = times(np.linalg.pinv(C, rcond=RANK_TOLERANCE), g2)
    return twist, (times(Z, q2[..., :k]) - back) / scale


# ------------------------------------------------------------------------------------------------------------
# Forces
# ------------------------------------------------------------------------------------------------------------


def load_at(spec, pose, wrench=None, axes="base"):
    """The load on the platform at o, in base axes: the given one, else the file's."""
    R = np.asarray(pose[0])
    if wrench is None:
        wrench = np.concatenate([spec["load"]["force"], spec["load"]["torque"]])
        axes = spec["load"]["axes"]
    wrench = np.broadcast_to(wrench, (*R.shape[:-2], 6))
    if axes == "platform":
        turned = [np.einsum("...ij,...j->...i", R, wrench[..., s]) for s in (slice(0, 3), slice(3, 6))]
        wrench = np.concatenate(turned, axis=-1)
    return wrench


def link_wrench(link: Link, gravity):
    """Weight and inertia of a moving link, by Newton and Euler: force at the mass centre, and torque."""
    omega, eps = spin_of(link.frame)
    E = link.frame.x
    inertia = E @ link.body["inertia"] @ np.swapaxes(E, -1, -2)
    spin = np.einsum("...ij,...j->...i", inertia, omega)
    torque = -np.einsum("...ij,...j->...i", inertia, eps) - np.cross(omega, spin)
    return link.body["mass"] * (gravity - link.center.dd), torque


def generalised_force(spec, pose, twist, acceleration, wrench=None, axes="base"):
    """All given forces' work on the six unit twists (..., 6), which actuators and constraints balance.

    And the platform's own share: load, weight, inertia and damping, not yet divided by the efficiency.
    """
    now = links_at(spec, moving(pose, twist, acceleration))
    shifted = links_at(spec, six_directions(pose))
    twist = np.asarray(twist)
    platform = load_at(spec, pose, wrench, axes) - np.concatenate(
        [spec["linear_damping"] * twist[..., :3], spec["angular_damping"] * twist[..., 3:]], axis=-1
    )
    rest = np.zeros_like(platform)
    for link, moved in zip(now, shifted, strict=True):
        force, torque = link_wrench(link, spec["gravity"])
        work = np.moveaxis(np.sum(moved.center.d * force + spin_of(moved.frame)[0] * torque, axis=-1), 0, -1)
        if link.name == "platform":
            platform = platform + work
        else:
            rest = rest + work
    return platform / spec["efficiency"] + rest, platform


def actuated(spec):
    return [i for i, leg in enumerate(spec["legs"]) if leg["actuated"]]


def lengths(spec, pose) -> Jet:
    return concat([at.length for at in legs_at(spec, pose)])


def leg_gradient(spec, pose):
    """Gradient (..., n, 6) of the actuated legs' lengths."""
    return gradient(lambda p: lengths(spec, p), pose)[..., actuated(spec), :]


def active_forces(spec, pose, twist, acceleration, wrench=None, axes="base"):
    """Forces (..., n) of the actuated legs, by virtual work on independent feasible directions only."""
    W, _ = generalised_force(spec, pose, twist, acceleration, wrench, axes)
    Z, scale = feasible_directions(spec, pose)
    Zt = np.swapaxes(Z, -1, -2) / scale
    columns_ = Zt @ np.swapaxes(leg_gradient(spec, pose), -1, -2)
    return np.linalg.solve(columns_, -times(Zt, W)[..., None])[..., 0]


def reaction_wrench(spec, pose, twist, acceleration, wrench=None, axes="base"):
    """The wrench (..., 6) of all constraints on the platform: what actuators and given forces leave over."""
    W, _ = generalised_force(spec, pose, twist, acceleration, wrench, axes)
    f = active_forces(spec, pose, twist, acceleration, wrench, axes)
    return -W - times(np.swapaxes(leg_gradient(spec, pose), -1, -2), f)


def conditioning(spec, pose):
    """Singular values, largest first, of the actuated legs' rates on the feasible unit twists (v, Λω)."""
    Z, scale = feasible_directions(spec, pose)
    return np.linalg.svd(leg_gradient(spec, pose) / scale @ Z, compute_uv=False)


def energy(spec, pose, twist, acceleration):
    """Kinetic and potential energy and their rates."""
    K = P = dK = dP = 0.0
    for link in links_at(spec, moving(pose, twist, acceleration)):
        omega, eps = spin_of(link.frame)
        v, a, m = link.center.d, link.center.dd, link.body["mass"]
        E = link.frame.x
        inertia = E @ link.body["inertia"] @ np.swapaxes(E, -1, -2)
        K = K + 0.5 * m * np.sum(v * v, -1) + 0.5 * np.einsum("...i,...ij,...j->...", omega, inertia, omega)
        dK = dK + m * np.sum(v * a, -1) + np.einsum("...i,...ij,...j->...", omega, inertia, eps)
        P = P - m * link.center.x @ spec["gravity"]
        dP = dP - m * v @ spec["gravity"]
    return K, P, dK, dP


# ------------------------------------------------------------------------------------------------------------
# Mobility
# ------------------------------------------------------------------------------------------------------------


@dataclass
class Mobility:
    links: int
    joints: int
    joint_freedoms: int
    loops: int
    closure_rank: int


def mobility(spec, pose) -> Mobility:
    """Rank of the loop closures at a pose, with the rate of every joint degree of freedom as an unknown.

    A chain of joint screws leads from the base over each leg to the platform; the first leg's chain closes a
    loop with every other one's. Legs on one rod share the rod's own joint.
    """
    R, o = pose
    scale = characteristic_length(spec)
    chains, rod_joint = [], {}
    count, joints, welded = 0, 0, 0

    def screw(axis, point):
        return np.concatenate([np.cross(point, axis) / scale, axis])

    for leg in spec["legs"]:
        at = leg_at(spec, leg, (R, o))
        delta, n, b, B = at.delta.x, at.n.x, at.b.x, leg["base"]["point"]
        chain_ = []
        rod = leg["base"]["rod"]
        if rod is not None:
            if rod not in rod_joint:
                rod_joint[rod] = count
                count += 1
                joints += 1
            chain_.append((rod_joint[rod], screw(at.base_axis, B)))
        for side, point in (("base", B), ("platform", b)):
            kind = leg[side]["joint"]
            axis = (
                at.base_axis if side == "base" else None if at.platform_axis is None else at.platform_axis.x
            )
            axes = {"S": list(np.eye(3)), "U": [axis, n], "R": [n], "F": []}[kind]
            for a in axes:
                chain_.append((count, screw(a, point)))
                count += 1
            joints += kind != "F"
            welded += kind == "F"
        chain_.append((count, np.concatenate([delta / scale, np.zeros(3)])))
        count += 1
        joints += 1
        chains.append(chain_)

    matrix = np.zeros((6 * (len(chains) - 1), count))
    for k, chain_ in enumerate(chains[1:]):
        for column, s in chains[0]:
            matrix[6 * k : 6 * k + 6, column] -= s
        for column, s in chain_:
            matrix[6 * k : 6 * k + 6, column] += s
    values = np.linalg.svd(matrix, compute_uv=False) if matrix.size else np.zeros(0)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0])) if matrix.size else 0
    links = 2 + len(rod_joint) + 2 * len(chains) - welded
    return Mobility(links, joints, count, joints - links + 1, rank)


# ------------------------------------------------------------------------------------------------------------
# The paper's mechanism: poses by coordinates
# ------------------------------------------------------------------------------------------------------------

S18 = math.sin(math.radians(18))
E1, E_SMALL = 0.270, 0.150


def natural_pose(alpha, p, h, beta, gamma):
    """Pose from natural coordinates: the middle of b1b3 is at (p, E1 sin 18°, 0) + h Rx(α) ez."""
    Ra = axis_turn(0, alpha)
    R = matmul(matmul(Ra, axis_turn(1, beta)), axis_turn(0, gamma))
    p, h = (Jet(*(a[..., None] for a in (j.x, j.d, j.dd))) for j in (jet(p), jet(h)))
    middle = p * np.array([1.0, 0, 0]) + np.array([0, E1 * S18, 0]) + h * apply(Ra, np.array([0, 0, 1.0]))
    return R, middle - apply(R, np.array([0, E_SMALL * S18, 0]))


def paper_pose(x, y, z, alpha, beta, branch=1):
    """Pose from the paper's coordinates: Eq. 2, with γ of Eq. 5 on the branch of its sign."""
    gamma = branch * arccos(eq5(y, z, alpha))
    R = matmul(matmul(axis_turn(0, alpha), axis_turn(1, beta)), axis_turn(0, gamma))
    o = concat([Jet(*(a[..., None] for a in (j.x, j.d, j.dd))) for j in map(jet, (x, y, z))])
    return R, o


# ------------------------------------------------------------------------------------------------------------
# The paper's equations, as printed. One pose; 3-vectors; names as in the paper.
# ------------------------------------------------------------------------------------------------------------


@dataclass
class Moving:
    """Inputs of the paper's formulas of one leg."""

    v: np.ndarray
    omega: np.ndarray
    a: np.ndarray
    eps: np.ndarray
    e: np.ndarray
    r_: np.ndarray  # vector
    lp: float = 0.0
    lq: float = 0.0

    @property
    def r(self):
        return np.linalg.norm(self.r_)

    @property
    def delta(self):
        return self.r_ / self.r

    @property
    def V(self):
        return np.concatenate([self.v, self.omega])

    @property
    def A(self):
        return np.concatenate([self.a, self.eps])


LU_L = np.array([1.0, 0, 0])


def lu_leg(i, pose, twist, acceleration) -> Moving:
    """Leg i = 1..5 of the paper's mechanism at a pose."""
    theta = math.radians(LU_ANGLES[i - 1])
    direction = np.array([math.cos(theta), math.sin(theta), 0])
    e = pose[0] @ (E_SMALL * direction)
    B = (0.270 if i in (1, 3) else 0.265) * direction
    r = pose[1] + e - B
    lp = 0.100 if i in (1, 3) else 0.098
    return Moving(twist[:3], twist[3:], acceleration[:3], acceleration[3:], e, r, lp, 0.050)


def eq2(alpha, beta, gamma):
    """R of Eq. 2 in closed form."""
    sa, ca, sb, cb = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
    sg, cg = math.sin(gamma), math.cos(gamma)
    return np.array(
        [
            [cb, sb * sg, sb * cg],
            [sa * sb, ca * cg - sa * cb * sg, -ca * sg - sa * cb * cg],
            [-ca * sb, sa * cg + ca * cb * sg, -sa * sg + ca * cb * cg],
        ]
    )


def eq4(l, r1, L=LU_L):
    """(l r1 L), zero where l, r1, L lie in a plane. The print has lost the determinant's middle columns."""
    return np.linalg.det(np.array([l, r1, L]))


def eq5(Y, Z, alpha):
    """The cosine of γ."""
    return (E1 * S18 * cos(alpha) - Z * sin(alpha) - Y * cos(alpha)) / (E_SMALL * S18)


def eq6(m: Moving):
    """v_i and v_ri, and the row (δᵀ, (e×δ)ᵀ)."""
    v_i = m.v + np.cross(m.omega, m.e)
    return v_i, v_i @ m.delta, np.concatenate([m.delta, np.cross(m.e, m.delta)])


def eq7(r1, r3, c1, c3, L=LU_L):
    """The ratio k in f_c3 = k f_c1, from the balance of moments about L."""
    return -(np.cross(r1, c1) @ L) / (np.cross(r3, c3) @ L)


def eq10(e1, r1, r3, c1, c3, ll, L=LU_L):
    """c_l and τ_l: the couple-constrained wrench from both forces. ll is the vector b3b1."""
    m1, m3 = np.cross(r1, c1) @ L, np.cross(r3, c3) @ L
    c = m3 * c1 - m1 * c3
    return c, np.cross(e1, c) + np.cross(ll, m1 * c3)


def eq11(e1, r1, l, L=LU_L):
    """The wrench (c, τ)."""
    c = np.cross(L, l)
    return c, np.cross(e1, c) - np.cross(l, np.cross(L, r1))


def eq13(legs: list[Moving], l, L=LU_L):
    """J."""
    rows = [eq6(m)[2] for m in legs]
    return np.array([*rows, np.concatenate(eq11(legs[0].e, legs[0].r_, l, L))])


def eq15(m: Moving):
    """h_ri, unsymmetric as printed."""
    s, d2 = skew, skew(m.delta) @ skew(m.delta)
    h = np.block(
        [
            [-d2, d2 @ s(m.e)],
            [-s(m.e) @ d2, m.r * s(m.e) @ s(m.delta) + s(m.e) @ d2 @ s(m.e)],
        ]
    )
    return h / m.r


def eq16(e1, r1, l, L=LU_L):
    """Q and Q1 of c' = -Q ω and τ' = -Qᵀ v + Q1 ω: the last line; the one above has a slip of sign."""
    s = skew
    Q = s(L) @ s(l)
    Q1 = s(np.cross(L, l)) @ s(e1) - s(e1) @ s(L) @ s(l) - s(np.cross(L, r1)) @ s(l) + s(l) @ s(L) @ s(e1)
    return Q, Q1


def eq17(e1, r1, l, L=LU_L):
    """h_c, unsymmetric as printed."""
    Q, Q1 = eq16(e1, r1, l, L)
    return np.block([[np.zeros((3, 3)), -Q], [-Q.T, Q1.T]])


def eq19(legs: list[Moving], l, accelerations, V):
    """A_o from the legs' accelerations (6,) and V_o = J⁻¹ V_r."""
    J = eq13(legs, l)
    H = [eq15(m) for m in legs] + [eq17(legs[0].e, legs[0].r_, l)]
    return np.linalg.solve(J, accelerations - np.array([V @ h @ V for h in H]))


def eq22(m: Moving, L=LU_L):
    """R_i1, R_i2 of an RPU leg."""
    R2 = np.cross(L, m.delta)
    return L / np.linalg.norm(L), R2 / np.linalg.norm(R2)


def eq25(m: Moving):
    """ω_i1, ω_i2 of an RPU leg."""
    R1, R2 = eq22(m)
    D1 = np.cross(R1, R2) @ m.r_
    u = skew(m.delta) @ skew(m.delta) @ (m.v - skew(m.e) @ m.omega)
    return R2 @ u / D1, -R1 @ u / D1


def eq26(m: Moving):
    """J_ωi of an RPU leg: ω_ri = J_ωi V_o."""
    R1, R2 = eq22(m)
    D1, D2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    return D2 @ skew(m.delta) @ skew(m.delta) @ np.hstack([np.eye(3), -skew(m.e)]) / D1


def eq27(m: Moving):
    """D_i3 / D_i1 = ω_ri of an RPU leg."""
    R1, R2 = eq22(m)
    v_i, v_r, _ = eq6(m)
    D1, D2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    return -D2 @ (v_i - v_r * m.delta), D1


def eq34a_rates(m: Moving):
    """v_i, v_ri, δ', a_i, a_ri."""
    v_i, v_r, _ = eq6(m)
    delta_rate = (v_i - v_r * m.delta) / m.r
    a_i = m.a + np.cross(m.eps, m.e) + np.cross(m.omega, np.cross(m.omega, m.e))
    return v_i, v_r, delta_rate, a_i, a_i @ m.delta + v_i @ delta_rate


def eq28(m: Moving):
    """ε_ri of an RPU leg."""
    R1, R2 = eq22(m)
    v_i, v_r, delta_rate, a_i, a_r = eq34a_rates(m)
    D3, D1 = eq27(m)
    w = D3 / D1
    R2_rate = np.cross(w, R2)
    D3_rate = (np.outer(R2_rate, R1) - np.outer(R1, R2_rate)) @ (v_i - v_r * m.delta) + (
        np.outer(R2, R1) - np.outer(R1, R2)
    ) @ (a_i - a_r * m.delta - v_r * delta_rate)
    D1_rate = np.cross(R1, R2_rate) @ m.r_ + np.cross(R1, R2) @ v_i
    return (D3_rate * D1 - D1_rate * D3) / D1**2


def eq33_axes(m: Moving):
    """R_i1, R_i2 of an SPU leg."""
    R1 = -m.e / np.linalg.norm(m.e)
    R2 = np.cross(R1, m.r_)
    return R1, R2 / np.linalg.norm(R2)


def eq32(m: Moving):
    """φ'_i1, φ'_i2: rates in the universal joint of an SPU leg."""
    R1, R2 = eq33_axes(m)
    d1 = np.cross(R1, R2) @ m.r_
    u = skew(m.delta) @ skew(m.delta) @ (m.v - skew(m.e) @ m.omega)
    phi1 = (-(skew(m.r_) @ R2) @ m.omega - u @ R2) / d1
    phi2 = ((skew(m.r_) @ R1) @ m.omega + u @ R1) / d1
    return phi1, phi2


def eq29(m: Moving):
    """ω_ri = ω - φ'_i1 R_i1 - φ'_i2 R_i2 of an SPU leg."""
    R1, R2 = eq33_axes(m)
    phi1, phi2 = eq32(m)
    return m.omega - phi1 * R1 - phi2 * R2


def eq33(m: Moving):
    """J_ωri of an SPU leg: ω_ri = J_ωri V_o. The last line of the print has r_i for its hat."""
    R1, R2 = eq33_axes(m)
    d1, d2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    D = skew(m.delta) @ skew(m.delta)
    return np.hstack([d2 @ D, d1 * np.eye(3) - d2 @ skew(m.r_) - d2 @ D @ skew(m.e)]) / d1


def eq34a(m: Moving):
    """ω_ri = ω + d_i2 D_i / d_i1 of an SPU leg."""
    R1, R2 = eq33_axes(m)
    d1, d2 = np.cross(R1, R2) @ m.r_, np.outer(R1, R2) - np.outer(R2, R1)
    D = skew(m.delta) @ skew(m.delta)
    return m.omega + d2 @ (D @ m.v - skew(m.r_) @ m.omega - D @ skew(m.e) @ m.omega) / d1


def eq34b(m: Moving):
    """d'_i1, d'_i2 of an SPU leg, with r_i for the printed r_1."""
    R1, R2 = eq33_axes(m)
    v_i = eq6(m)[0]
    R1_rate, R2_rate = np.cross(m.omega, R1), np.cross(eq34a(m), R2)
    d1_rate = (m.omega @ R2) * (R1 @ m.r_) + np.cross(R1, R2) @ v_i
    d2_rate = np.outer(R1_rate, R2) + np.outer(R1, R2_rate) - np.outer(R2_rate, R1) - np.outer(R2, R1_rate)
    return d1_rate, d2_rate


def eq35(m: Moving):
    """ε_ri of an SPU leg, with r_i for the printed r_1."""
    R1, R2 = eq33_axes(m)
    v_i, v_r, _, a_i, a_r = eq34a_rates(m)
    w = eq34a(m)
    R1_rate, R2_rate = np.cross(m.omega, R1), np.cross(w, R2)
    first = (m.omega - w) * ((m.omega @ R2) * (R1 @ m.r_) + np.cross(R1, R2) @ v_i)
    second = (
        np.outer(R1_rate, R2) + np.outer(R1, R2_rate) - np.outer(R2_rate, R1) - np.outer(R2, R1_rate)
    ) @ (v_r * m.delta - v_i - np.cross(m.r_, m.omega))
    third = (np.outer(R1, R2) - np.outer(R2, R1)) @ (
        a_r * m.delta
        - a_i
        - np.cross(m.r_, m.eps)
        - np.cross(v_i, m.omega)
        + v_r * (v_i - v_r * m.delta) / m.r
    )
    return m.eps + (first + second + third) / (np.cross(R1, R2) @ m.r_)


def eq36(m1: Moving):
    """ω_L from leg 1, and J_ωL."""
    R1, R2 = eq22(m1)
    D11 = np.cross(R1, R2) @ m1.r_
    D = skew(m1.delta) @ skew(m1.delta)
    J = np.outer(R1, R2) @ D @ np.hstack([np.eye(3), -skew(m1.e)]) / D11
    return np.outer(R1, R2) @ (D @ m1.v - D @ skew(m1.e) @ m1.omega) / D11, J


def eq37(m1: Moving):
    """ε_L."""
    R1, R2 = eq22(m1)
    v_1, v_r, delta_rate, a_1, a_r = eq34a_rates(m1)
    D3, D11 = eq27(m1)
    R2_rate = np.cross(D3 / D11, R2)
    D_L = np.outer(R1, R2) @ (v_r * m1.delta - v_1)
    D_L_rate = np.outer(R1, R2_rate) @ (v_r * m1.delta - v_1) + np.outer(R1, R2) @ (
        a_r * m1.delta + v_r * delta_rate - a_1
    )
    D11_rate = np.cross(R1, R2_rate) @ m1.r_ + np.cross(R1, R2) @ v_1
    return (D_L_rate * D11 - D11_rate * D_L) / D11**2


def eq38(m: Moving, J_omega):
    """J_vpi and J_vqi: v_pi = J_vpi V_o, v_qi = J_vqi V_o."""
    row = np.concatenate([m.delta, np.cross(m.e, m.delta)])
    J_vp = np.outer(m.delta, row) - (m.r - m.lp) * skew(m.delta) @ J_omega
    return J_vp, -m.lq * skew(m.delta) @ J_omega


def eq39(m: Moving, w, w_rate):
    """a_pi and a_qi from the leg's angular velocity and acceleration."""
    _, v_r, _, _, a_r = eq34a_rates(m)
    d, turning = skew(m.delta), np.cross(w, np.cross(w, m.delta))
    a_p = a_r * m.delta - (m.r - m.lp) * d @ w_rate - 2 * v_r * d @ w + (m.r - m.lp) * turning
    return a_p, -m.lq * d @ w_rate + m.lq * turning


def eq40(mass, a, inertia, eps, gravity):
    """G + f and t of a link as printed; t lacks -ω × I ω, which is nothing for an isotropic I."""
    return mass * (gravity - a), -inertia @ eps


def eq43(legs: list[Moving], l, load, eta=1.0, mu=0.0, gravity=(0.0, 0.0, -9.81)):
    """F_r = (f_a1 … f_a5, f_c) of the paper's mechanism with the masses of Table II."""
    gravity, eye = np.array(gravity), np.eye(3)
    m0 = legs[0]
    force, torque = eq40(3.0, m0.a, 5 * eye, m0.eps, gravity)
    total = (load + np.concatenate([force - mu * m0.v, torque - mu * m0.omega])) / eta
    force, torque = eq40(2.0, np.zeros(3), 2 * eye, eq37(m0), gravity)
    total = total + eq36(m0)[1].T @ torque
    for i, m in enumerate(legs):
        rpu = i in (0, 2)
        J_omega, w_rate = (eq26(m), eq28(m)) if rpu else (eq33(m), eq35(m))
        J_p, J_q = eq38(m, J_omega)
        a_p, a_q = eq39(m, J_omega @ m.V, w_rate)
        force, torque = eq40(3.0, a_p, 3 * eye, w_rate, gravity)
        total = total + J_p.T @ force + J_omega.T @ torque
        force, torque = eq40(2.0, a_q, 2 * eye, w_rate, gravity)
        total = total + J_q.T @ force + J_omega.T @ torque
    return np.linalg.solve(eq13(legs, l).T, -total)


def eq44(r1, r3, c1, f_c, L=LU_L):
    """f_c1, f_c3 and the torque vector T_c1 as printed."""
    k = (np.cross(r1, c1) @ L) / (np.cross(r3, c1) @ L)
    f_c1 = f_c / (1 + k)
    return f_c1, f_c - f_c1, np.cross(r1, f_c1 * c1)


def coupled_forces(e1, e3, r1, r3, l, f_c, L=LU_L):
    """f_c1, f_c3 along c1 = r1×L/|r1×L|, from statics alone: at b1 and b3 they are the wrench f_c (c, τ).

    Six equations for two unknowns; that they hold is what Eq. 7-11 say. Returns the forces and the rest.
    """
    c1 = np.cross(r1, L) / np.linalg.norm(np.cross(r1, L))
    A = np.array([np.concatenate([c1, np.cross(e, c1)]) for e in (e1, e3)]).T
    wrench = f_c * np.concatenate(eq11(e1, r1, l, L))
    forces = np.linalg.lstsq(A, wrench, rcond=None)[0]
    return forces, A @ forces - wrench


def coupled_forces_of_the_notes(r1, r3, ll, f_c, L=LU_L):
    """f_c1, f_c3 from the massless rod's balance about L, and the torque on it. ll is the vector b3b1."""
    c1 = np.cross(r1, L) / np.linalg.norm(np.cross(r1, L))
    d1, d3, length = np.cross(r1, L) @ c1, np.cross(r3, L) @ c1, np.linalg.norm(ll)
    return np.array([f_c * d3 / length, -f_c * d1 / length]), f_c * d3 / length * d1
