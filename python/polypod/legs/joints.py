"""Joints at the ends of a leg: their kinds, and all that follows from a kind.

The core has the same kinds in `model/joint.rs`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

JointLetter = Literal["S", "U", "R", "F"]


@dataclass(frozen=True)
class JointKind:
    """Facts of a kind of joint."""

    letter: JointLetter
    name: str
    freedoms: int
    normal: Literal["free", "across", "along"]
    """What it does to the leg's normal n: nothing, or holds it perpendicular to an axis of its body or along
    one."""
    has_axis: bool
    """Whether a mechanism file gives it an axis; on a rod it takes that from the rod."""
    has_normal: bool
    """Whether a mechanism file gives it a normal, which is then the axis that n is held along."""
    on_rod: bool
    """Whether a rod may carry it."""
    marker: tuple[str, float]
    """Matplotlib's symbol for it in legends, and its size in points."""


JOINTS: dict[JointLetter, JointKind] = {
    kind.letter: kind
    for kind in (
        JointKind("S", "spherical", 3, "free", False, False, False, ("o", 6.0)),
        JointKind("U", "universal", 2, "across", True, False, False, ("P", 7.5)),
        JointKind("R", "revolute", 1, "along", True, False, True, ("$\u25ac$", 8.0)),
        JointKind("F", "fixed", 0, "along", True, True, False, ("s", 5.5)),
    )
}

CARRIED = next(letter for letter, kind in JOINTS.items() if kind.on_rod)
"""The letter of joints on rods."""
