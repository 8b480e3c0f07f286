"""Degrees of freedom from ranks of joint screws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from support.oracle.geometry import RANK_TOLERANCE, characteristic_length, leg_at


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
