"""Legs, rods, links and constraints at a pose, and the directions that keep the joints closed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from support.oracle.jets import Jet, apply, columns, concat, cross, dot, jet, norm, unit
from support.oracle.rotations import moving, turn
from support.oracle.tables import home


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
