"""A mechanism at a pose as one STL file, for whatever reads meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.bodies.links import link_frames, links_of
from polypod.errors import ExportError
from polypod.mechanism import Mechanism

Array = NDArray[np.float64]


def mechanism_mesh(mech: Mechanism, pose: Array) -> trimesh.Trimesh:
    """All links at a pose (4, 4) in base axes, m: closed surfaces that overlap, one for each piece.

    Raises ExportError where the pose leaves a link no place.
    """
    frames, _, status = link_frames(mech, pose)
    placed = []
    for link, frame in zip(links_of(mech), frames, strict=True):
        if not np.isfinite(frame).all():
            raise ExportError(f"{link.name} has no place at this pose: {Status(int(status)).message}")
        mesh = link.mesh()
        mesh.apply_transform(frame)
        placed.append(mesh)
    joined: trimesh.Trimesh = trimesh.util.concatenate(placed)  # type: ignore[assignment]
    return joined


def write_stl(mech: Mechanism, pose: Array, path: Path) -> list[str]:
    """Writes the mesh; what the format leaves out."""
    mechanism_mesh(mech, pose).export(path, file_type="stl")
    return [
        "STL has no units, colours or names: lengths are in m, and all links are one mesh.",
        "the pieces of a link overlap, each a closed surface; unite them before printing or meshing.",
    ]
