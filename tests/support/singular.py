"""Mechanisms with known singular poses, and J by the independent model."""

from __future__ import annotations

import numpy as np

import polypod as pp
from polypod import SingularityKind
from support import DATA
from support import oracle as o

LU = pp.load("lu-3spu-2rpu-r")
GOUGH = pp.load(DATA / "stewart-gough.toml")
RPS = pp.load(DATA / "3-rps.toml")
ALL = {"lu": LU, "stewart-gough": GOUGH, "3-rps": RPS}
SPECS = {name: o.read(mech.to_dict()) for name, mech in ALL.items()}
NATURAL = {"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6}
Kind = SingularityKind


def matrix(pose) -> np.ndarray:
    """(R, o) as homogeneous matrices."""
    R, p = (o.jet(part).x for part in pose)
    T = np.zeros((*p.shape[:-1], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    return T


def independent_jacobian(name: str, pose, length: float) -> np.ndarray:
    """Legs over constraints, differentiated from positions, torque columns divided by the length."""
    rows = [o.leg_gradient(SPECS[name], pose)]
    if name != "stewart-gough":
        k = 6 - ALL[name].dof
        rows.append(o.gradient(lambda p: o.theory_constraints(SPECS[name], p), pose)[..., :k, :])
    return np.concatenate(rows, axis=-2) / np.array([1, 1, 1, length, length, length])


def hexapod(base, platform, position) -> pp.Mechanism:
    """6-SPS with its home at a pose, platform parallel to the base."""
    legs = [
        {"base": {"joint": "S", "point": [*b]}, "platform": {"joint": "S", "point": [*p]}}
        for b, p in zip(base, platform, strict=True)
    ]
    tables = {"name": "hexapod", "units": {"length": "m", "angle": "rad"}, "home": {"position": [*position]}}
    return pp.Mechanism.from_dict({**tables, "legs": legs})


QUARTER = {"x": 0.0, "y": 0.0, "z": 0.6, "rx": 0.0, "ry": 0.0, "rz": np.pi / 2}
