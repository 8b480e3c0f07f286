"""Mechanisms, lengths and poses for forward kinematics."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import polypod as pp
from polypod import Status
from support import DATA

Array = NDArray[np.float64]

LU = pp.load("lu-3spu-2rpu-r")
HEXAPOD = pp.load(DATA / "stewart-gough.toml")
RPS = pp.load(DATA / "3-rps.toml")
MECHANISMS = {mech.name: mech for mech in (LU, HEXAPOD, RPS)}
FLAT = {"alpha": 0.1, "p": 0.3, "h": 0.7, "gamma": -0.06}  # det J changes its sign near beta = 0.075 rad

LENGTH = 1e-12  # m, of legs about 1 m long: rounding of lengths at a pose that Newton's method ended in
APART = 1e-6  # 1 and m: two modes of generic lengths are farther from each other


def code(status: Any) -> Status:
    return Status(int(status))


def lengths_at(mech: pp.Mechanism, pose: Array) -> Array:
    return mech.inverse_kinematics(pose).lengths


def sampled(mech: pp.Mechanism, rng: np.random.Generator, count: int, spread: float = 1.0) -> Array:
    """Poses (count, 4, 4) over the workspace that keep all constraints, `spread` the share of it."""
    q: dict[str, Array]
    if "natural" in mech.coordinate_sets:
        middle, width = [0.0, 0.0, 0.65, 0.0, 0.0], [0.5, 0.35, 0.12, 0.9, 0.9]
        values = np.array(middle) + spread * np.array(width) * rng.uniform(-1, 1, (count, 5))
        q = dict(zip(mech.coordinate_sets["natural"], values.T, strict=True))
    else:
        names = mech.coordinate_sets["pose"] if mech.dof == 6 else ("z", "rx", "ry")
        width = {"x": 0.15, "y": 0.15, "z": 0.08, "rx": 0.4, "ry": 0.4, "rz": 0.4}
        home = mech.coordinates(mech.home, "pose")
        q = {n: home[n] + spread * width[n] * rng.uniform(-1, 1, count) for n in names}
    return mech.pose(q)


def differs(a: Array, b: Array) -> Array:
    """(...): the largest difference of entries, 1 and m."""
    return np.abs(a - b).max(axis=(-1, -2))


def determinant(mech: pp.Mechanism, pose: Array) -> Array:
    return np.linalg.det(mech.jacobian(pose))


def singular_pose(
    mech: pp.Mechanism = LU,
    others: dict[str, float] = FLAT,
    name: str = "beta",
    low: float = 0,
    high: float = 0.25,
) -> Array:
    """Where det J vanishes up to rounding on a line of coordinates, by bisection."""
    below = np.sign(determinant(mech, mech.pose({**others, name: low})))
    for _ in range(60):
        middle = (low + high) / 2
        same = np.sign(determinant(mech, mech.pose({**others, name: middle}))) == below
        low, high = (middle, high) if same else (low, middle)
    return mech.pose({**others, name: low})
