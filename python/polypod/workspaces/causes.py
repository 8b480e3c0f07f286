"""What ends a workspace."""

from __future__ import annotations

from polypod.mechanism import Mechanism

SINGULARITY, EDGE_OF_GRID, NO_POSE = "singularity", "edge of grid", "no pose"
"""Causes of a workspace's boundary other than limits.

Beyond, the sign of det J changes; the grid ends; no pose was found.
"""


def label_names(mech: Mechanism) -> tuple[str, ...]:
    """Possible causes of a workspace's boundary."""
    return (*(limit.name for limit in mech.limit_list), SINGULARITY, EDGE_OF_GRID, NO_POSE)
