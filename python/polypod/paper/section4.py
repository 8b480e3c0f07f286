"""The paper's Section 4, both ways: sizes of the reachable workspace beside those that it prints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polypod.mechanism import Mechanism
from polypod.workspaces.length_lattice import LengthLattice, length_lattice
from polypod.workspaces.reachable import extremes_within
from polypod.workspaces.search import workspace
from polypod.workspaces.workspace import Workspace

Array = NDArray[np.float64]

PRINTED = (1.350, 1.371, 0.511)
"""The volume dimensions of W along X, Y and Z in the paper's Section 4, m."""


@dataclass(frozen=True, eq=False)
class Section4:
    """The workspace of the paper's manipulator: flooded in pose space, and by the paper's lattice of lengths.

    The lattice stays in one aspect; to compare like with like, there is a flood of that aspect, too.

    The printed height is that of an upper part only: the strokes alone allow far lower positions. `cut` means
    the part from the printed height below the highest position of o upwards.
    """

    flood: Workspace
    """The reachable workspace [T40]."""
    aspect: Workspace
    """The part of it within the lattice's aspect."""
    lattice: LengthLattice
    """The lattice of lengths [T41]."""

    @property
    def cut_at(self) -> float:
        """Z of the cut, m."""
        return float(self.flood.extents[2, 1]) - PRINTED[2]

    def facts(self) -> dict[str, Any]:
        """Sizes along X, Y, Z, m: printed, of both ways in full and cut, and how far the cuts are off."""
        top, z = float(self.flood.extents[2, 1]), self.cut_at

        def sizes(of: Workspace | LengthLattice, cut: Array) -> dict[str, Any]:
            return {
                "full": np.ptp(of.extents, axis=1).tolist(),
                "highest": float(of.extents[2, 1]),
                "cut": [*cut.tolist(), float(of.extents[2, 1]) - z],
                "off": (cut / PRINTED[:2] - 1.0).tolist(),
            }

        def flooded(of: Workspace) -> dict[str, Any]:
            above = extremes_within(of, {"z": (z, top)})
            return {
                "step": of.inputs["step"]["x"],
                **sizes(of, np.ptp(above.values, axis=1)[:2]),
                "extent_error": float(max(of.extremes.errors.max(), above.errors.max())),
                "volume": of.volume,
                "volume_error": of.volume_error,
            }

        return {
            "printed": list(PRINTED),
            "highest": top,
            "cut_at": z,
            "flood": flooded(self.flood),
            "aspect": flooded(self.aspect),
            "lattice": {
                "step": self.lattice.step,
                "nodes": self.lattice.nodes,
                "inside": self.lattice.inside,
                "poses": self.lattice.poses,
                **sizes(self.lattice, self.lattice.widths_above(z)),
            },
        }


def section4(
    mech: Mechanism, *, step: float = 0.02, lattice_step: float = 0.02, threads: int = 0
) -> Section4:
    """Both workspaces of the paper's manipulator; the paper's own step of lengths is 10 mm."""
    lattice = length_lattice(mech, step=lattice_step, layer=0.5 * lattice_step, threads=threads)
    return Section4(
        workspace(mech, step=step, threads=threads),
        workspace(mech, step=step, threads=threads, keep_aspect=True, start=lattice.inputs["start"]),
        lattice,
    )


def as_markdown(facts: dict[str, Any]) -> str:
    """The table of `Section4.facts`, in mm."""

    def row(name: str, sizes: list[float]) -> str:
        return f"| {name} | " + " | ".join(f"{1e3 * size:.1f}" for size in sizes) + " |"

    flood, aspect, lattice = facts["flood"], facts["aspect"], facts["lattice"]
    lengths = f"lengths in steps of {1e3 * lattice['step']:g} mm"
    rows = [
        "| sizes / mm | X | Y | Z |",
        "|---|---|---|---|",
        row("printed", facts["printed"]),
        row("in pose space, full, Z ≥ 0", flood["full"]),
        row("... cut at the printed height", flood["cut"]),
        row("in pose space, one aspect, full", aspect["full"]),
        row("... cut at the same height", aspect["cut"]),
        row(f"lattice of {lengths}, the same aspect, full", lattice["full"]),
        row("... cut at the same height", lattice["cut"]),
    ]

    error = max(flood["extent_error"], aspect["extent_error"])

    def off(way: dict[str, Any]) -> str:
        return " and ".join(f"{100 * share:+.1f} %" for share in way["off"])

    return "\n".join(rows) + (
        f"\n\nThe highest position of o is {1e3 * facts['highest']:.1f} mm. Cut 511 mm below it, X and Y "
        f"differ from the print by {off(flood)} (pose space), {off(aspect)} (one aspect) and "
        f"{off(lattice)} (lattice). Sizes in pose space are those of poses found by optimisation, to "
        f"{1e3 * error:.1g} mm; those of the lattice are of its nodes, inner bounds."
    )
