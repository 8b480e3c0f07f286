"""Poses over which the sentences are judged: random upright ones, and those with the platform kept level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from polypod.answers.answer import Array
from polypod.errors import UnsupportedError
from polypod.mechanism import Mechanism

SAMPLES = 4000
"""Random poses of each mechanism."""

SEED = 1

_BATCH = 200_000
"""Random coordinates at a time."""

_MOST_BATCHES = 200
"""Of which none gives a pose, before the search is given up."""

CONFIDENCE = 0.95
"""Of the intervals of `Quantile`."""


class Quantile(NamedTuple):
    """A quantile of random samples."""

    value: float
    low: float
    high: float
    """Between `low` and `high` lies the quantile of the distribution, with the probability `CONFIDENCE`."""


def upright_poses(mech: Mechanism, count: int = SAMPLES, seed: int = SEED) -> Array:
    """(count, 4, 4): random poses, uniform in the natural coordinates (α, p, h, β, γ), inside all limits.

    Upright: every leg points upwards from the base and meets the platform from below, and the platform is
    rotated by less than 90° from the base axes, the orientation in which it is assembled. So poses are left
    out in which the platform is turned over or its legs cross.

    Raises:
        UnsupportedError: no natural coordinates, a leg without a greatest length, or no such pose.
    """
    longest = float(np.max(mech.stroke[:, 1]))
    if "natural" not in mech.coordinate_sets or not np.isfinite(longest):
        raise UnsupportedError(f"{mech.name}: random poses need natural coordinates and strokes of all legs")
    rng = np.random.default_rng(seed)
    found: list[Array] = []
    drawn = 0
    while sum(map(len, found)) < count:
        drawn += 1
        if not sum(map(len, found)) and drawn > _MOST_BATCHES:
            raise UnsupportedError(f"{mech.name}: has no upright pose inside its limits, or hardly any")
        found.append(_upright(mech, rng.uniform(size=(5, _BATCH)), longest))
    return np.concatenate(found)[:count]


def _upright(mech: Mechanism, uniform: Array, longest: float) -> Array:
    """(N, 4, 4): the upright ones of those with coordinates spread over a box that holds them all.

    The middle of b_1 b_3 is that of B_1 B_3 plus the mean of r_1 and r_3, at most the longest leg away. With
    ψ = α + γ the trace of R is cos β + cos ψ (1 + cos β), above 1 for rotations below 90°.
    """
    alpha, beta, psi = np.pi * (uniform[:3] - 0.5)
    p, h = longest * (2.0 * uniform[3] - 1.0), longest * uniform[4]
    near = (p**2 + h**2 <= longest**2) & (np.cos(beta) + np.cos(psi) * (1.0 + np.cos(beta)) > 1.0)
    names = ("alpha", "p", "h", "beta", "gamma")
    values = (alpha, p, h, beta, psi - alpha)
    pose = mech.pose({name: value[near] for name, value in zip(names, values, strict=True)})
    directions = mech.inverse_kinematics(pose).directions
    below = np.einsum("...ij,...j->...i", directions, pose[:, :3, 2]) > 0.0
    upright = np.all((directions[..., 2] > 0.0) & below, axis=-1)
    pose = pose[upright]
    return pose[mech.limits(pose).within]


def level_poses(mech: Mechanism, height: float, spacing: float) -> Array:
    """(N, 4, 4): poses in home's orientation at a height of o, on a square grid, inside all limits; m."""
    reach = float(np.max(mech.stroke[:, 1])) + mech.characteristic_length
    steps = int(reach / spacing)
    line = spacing * np.arange(-steps, steps + 1)
    pose = moved(
        mech.home, np.stack(np.meshgrid(line, line, [height], indexing="ij"), axis=-1).reshape(-1, 3)
    )
    return pose[mech.limits(pose).within]


def moved(pose: Array, positions: ArrayLike) -> Array:
    """(..., 4, 4): a pose with o at other positions (..., 3), m."""
    positions = np.asarray(positions, dtype=float)
    result = np.broadcast_to(pose, (*positions.shape[:-1], 4, 4)).copy()
    result[..., :3, 3] = positions
    return result


def quantile(values: Array, share: float) -> Quantile:
    """The quantile below which a share of independent samples (N,) lies, with its sampling error.

    The interval lies between two of the sorted samples: how many of N lie below is binomial, here taken as
    normal.
    """
    n = len(values)
    ranks = n * share + norm.ppf(0.5 * (1.0 + CONFIDENCE)) * np.sqrt(n * share * (1.0 - share)) * np.array(
        [-1, 1]
    )
    low, high = np.sort(values)[np.clip(ranks.round().astype(int), 0, n - 1)]
    return Quantile(float(np.quantile(values, share)), float(low), float(high))
