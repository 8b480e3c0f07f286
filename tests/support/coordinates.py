"""Coordinates of the paper's mechanism by the recipe of the oracle's states, and their poses."""

import math

import numpy as np
from numpy.typing import NDArray

import polypod as pp
from support import DATA

Array = NDArray[np.float64]
Series = dict[str, Array]

LU = pp.load("lu-3spu-2rpu-r")
RPS = pp.load(DATA / "3-rps.toml")
GOUGH = pp.load(DATA / "stewart-gough.toml")
SEED = 20240301

E1_S, E_S = (
    0.27 * math.sin(math.pi / 10),
    0.15 * math.sin(math.pi / 10),
)  # m, E_1 sin θ_1 and e sin θ_1, Table II
NATURAL = LU.coordinate_sets["natural"]
CENTRE = np.array([0, 0, 0.74, 0, 0])
SPAN = np.array([0.5, 0.2, 0.09, 0.7, 0.9])


def recipe() -> Series:
    """Natural coordinates of the paper's mechanism, (N,) each."""
    rng = np.random.default_rng(SEED)
    uniform = CENTRE + rng.uniform(-1, 1, (40, 5)) * SPAN
    normal = CENTRE + rng.normal(size=(20, 5)) * SPAN / 3
    near = [CENTRE + rng.uniform(-1, 1, (2, 5)) * s for s in (1e-3, 1e-6, 1e-9, 1e-12)]
    special = CENTRE + rng.uniform(-1, 1, (12, 5)) * SPAN
    special[:6, 3] = 0, 1e-12, -1e-12, 1e-6, -1e-6, 1e-3
    special[6:, 4] = 0, 1e-12, -1e-12, 1e-5, -1e-5, 3.0
    q = np.concatenate([[CENTRE], uniform, normal, *near, special])
    return dict(zip(NATURAL, q.T, strict=True))


Q = recipe()
POSES = LU.pose(Q)


def given(mech: pp.Mechanism, pose: Array, set: str, *dependent: str) -> Series:
    """The coordinates of poses without the dependent ones."""
    names = [name for name in mech.coordinate_sets[set] if name not in dependent]
    all_of_them = mech.coordinates(pose, set)
    return {name: all_of_them[name] for name in names}


def case_name(value: object) -> str:
    match value:
        case pp.Mechanism():
            return value.name
        case tuple():
            return "-".join(value) or "none"
    return str(value)


def at_cosine(cosine: float) -> dict[str, float]:
    """The paper's coordinates, α = 0, at which Eq. 5 gives this cos γ."""
    return {"x": 0.1, "y": E1_S - cosine * E_S, "z": 0.7, "alpha": 0.0, "beta": 0.4}
