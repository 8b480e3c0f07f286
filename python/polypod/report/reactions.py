"""Sizes of the reactions in all joints along a solved motion, and what balance leaves open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polypod.answers.parts import Joint
from polypod.mechanism import Mechanism
from polypod.solution.solution import Solution
from polypod.solution.solve import CHUNK
from polypod.summary.tables import Table, clock, fixed

Array = NDArray[np.float64]

COMPONENTS = ("force 1", "force 2", "force 3", "torque 1", "torque 2", "torque 3")
"""Of a reaction in joint axes, as in the variables of a solution."""


@dataclass(frozen=True)
class Reactions:
    """Reactions without couples in U joints [T47] of j joints at the N instants of a motion, as sizes."""

    time: Array
    """(N,), s."""
    joints: tuple[Joint, ...]
    force: Array
    """(N, j): |F|, N."""
    torque: Array
    """(N, j): |T| about the joint's point, N m."""
    undetermined: NDArray[np.bool_]
    """(j, 6): components in joint axes that balance alone leaves open at one state or more."""


def reactions_along(mech: Mechanism, solution: Solution) -> Reactions:
    """The reactions, some states at a time: only their sizes are kept."""
    data = solution.dataset
    time, joints, axes = data["time"].to_numpy(), mech.joint_list, data.attrs["wrench_axes"]
    pose, twist, acceleration, wrench = (
        data[name].to_numpy() for name in ("pose", "twist", "acceleration", "wrench")
    )
    force, torque = np.full((2, len(time), len(joints)), np.nan)
    undetermined = np.zeros((len(joints), 6), dtype=np.bool_)
    for start in range(0, len(time), CHUNK):
        chunk = slice(start, start + CHUNK)
        answer = mech.joint_reactions(pose[chunk], twist[chunk], acceleration[chunk], wrench[chunk], axes)
        force[chunk] = np.linalg.norm(answer.reactions[..., :3], axis=-1)
        torque[chunk] = np.linalg.norm(answer.reactions[..., 3:], axis=-1)
        known = np.isfinite(answer.reactions).all(axis=(-2, -1))
        undetermined |= ~answer.determinate_in_joint[known].all(axis=0)
    return Reactions(time, joints, force, torque, undetermined)


def reactions_table(found: Reactions) -> Table:
    """Peaks of every joint, and its components that are statically indeterminate."""
    rows = []
    for i, joint in enumerate(found.joints):
        peaks = [*_peak(found.time, found.force[:, i]), *_peak(found.time, found.torque[:, i])]
        left = [name for name, out in zip(COMPONENTS, found.undetermined[i], strict=True) if out]
        rows.append((joint.name, joint.kind, " and ".join(joint.links), *peaks, ", ".join(left) or "none"))
    headers = ("peak |F| / N>", "at / s>", "peak |T| / N m>", "at / s>", "left open by balance")
    return Table("Joints", ("joint", "kind", "between", *headers), rows)


def _peak(time: Array, values: Array) -> tuple[str, str]:
    if not np.isfinite(values).any():
        return "none", ""
    at = int(np.nanargmax(values))
    return fixed(float(values[at])), clock(float(time[at]))


def families(found: Reactions) -> list[tuple[str, list[int]]]:
    """Joints that belong together, by index: rods, then base, prismatic and platform joints of all legs."""
    # Each leg has its three joints in this order; rods come before all of them.
    rods = sum(joint.name.startswith("rod ") for joint in found.joints)
    driven = dict.fromkeys(joint.name.split()[0] for joint in found.joints[rods + 1 :: 3])
    names = ("base joints", f"{' and '.join(driven)} joints", "platform joints")
    of_legs = [(name, list(range(rods + k, len(found.joints), 3))) for k, name in enumerate(names)]
    return [("rods", list(range(rods))), *of_legs] if rods else of_legs
