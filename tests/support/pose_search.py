"""All poses with given leg lengths, by a search with equations of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import polypod as pp
from support.assembly import APART, differs

Array = NDArray[np.float64]


def equations(mech: pp.Mechanism, lengths: Array, pose: tuple[Array, Array]) -> tuple[Array, Array]:
    """Residuals of lengths and joints at poses (N, 3, 3) and (N, 3), real or complex; and rows by (v, ω).

    r·r = ℓ² for actuated legs; for a leg on a rod: r, the rod's line and the platform's axis in one plane;
    for an R joint: r at right angles to its axis.
    """
    R, o = pose
    values, rows = [], []

    def turned(a: Array) -> Array:
        """Of a vector of the platform, its rate by (v, ω): (N, 3, 6)."""
        x, y, z = np.moveaxis(a, -1, 0)
        n = np.zeros_like(x)
        cross = np.array([[n, z, -y], [-z, n, x], [y, -x, n]])
        return np.concatenate([np.zeros_like(R), np.moveaxis(cross, -1, 0)], axis=-1)

    geometry = mech.geometry
    for leg, length in zip(geometry["legs"], lengths, strict=True):
        base, platform = leg["base"], leg["platform"]
        e = R @ np.array(platform["point"])
        r = o + e - np.array(base["point"])
        rate = turned(e) + np.eye(3, 6)
        if leg["actuated"]:
            values.append(np.sum(r * r, axis=-1) - length**2)
            rows.append(2 * np.einsum("ni,nij->nj", r, rate))
        if base["rod"] is not None:
            line, a = np.array(geometry["rods"][base["rod"]]["axis"]), R @ np.array(platform["axis"])
            values.append(np.cross(a, r) @ line)
            by_axis = np.einsum("ni,nij->nj", np.cross(r, line), turned(a))
            rows.append(by_axis + np.einsum("ni,nij->nj", np.cross(line, a), rate))
        elif base["joint"] == "R":
            values.append(r @ np.array(base["axis"]))
            rows.append(np.einsum("i,nij->nj", np.array(base["axis"]), rate))
    return np.stack(values, axis=-1), np.stack(rows, axis=-2)


def cayley(w: Array) -> Array:
    """A rotation (N, 3, 3) for real w, a complex orthogonal matrix for complex w."""
    x, y, z = np.moveaxis(w, -1, 0) / 2
    n = np.zeros_like(x)
    half = np.moveaxis(np.array([[n, -z, y], [z, n, -x], [-y, x, n]]), -1, 0)
    return np.linalg.solve(np.eye(3) - half, np.eye(3) + half)


def search(
    mech: pp.Mechanism, lengths: Array, starts: int, rng: np.random.Generator, over: type = float
) -> Array:
    """Different poses (k, 4, 4) that least-squares Newton steps find from random ones all over the space."""

    def random(size: float) -> Array:
        values = rng.normal(size=(starts, 3)) * size
        return values + 1j * rng.normal(size=(starts, 3)) * size if over is complex else values

    scale = np.array([1, 1, 1, *[mech.characteristic_length] * 3])
    R, o = cayley(random(2.0)), random(0.6 * np.abs(lengths).max())
    if over is complex:  # complex solutions may be far away
        o = o * 10.0 ** rng.uniform(0, 3, (starts, 1))
    for _ in range(80):
        value, rows = equations(mech, lengths, (R, o))
        step = -np.einsum("nij,nj->ni", np.linalg.pinv(rows / scale, rcond=1e-10), value)
        longest = 0.4 + 0.4 * np.linalg.norm(o, axis=-1, keepdims=True) / mech.characteristic_length
        step *= np.minimum(1, longest / np.maximum(np.linalg.norm(step, axis=-1, keepdims=True), 1e-300))
        step /= scale
        R, o = cayley(step[:, 3:]) @ R, o + step[:, :3]
    value, rows = equations(mech, lengths, (R, o))
    size = 1 + np.maximum(np.abs(R).max(axis=(-1, -2)), np.abs(o).max(axis=-1))
    met = np.abs(value).max(axis=-1) < 1e-11 * size**2
    pose = np.concatenate([R, o[:, :, None]], axis=-1)[met]
    found: list[Array] = []
    for candidate in pose:
        if not found or differs(np.array(found), candidate).min() > APART:
            found.append(candidate)
    return np.array(found).reshape(-1, 3, 4)
