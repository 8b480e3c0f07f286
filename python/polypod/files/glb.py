"""GLB files (glTF 2.0): a scene of trimesh as one, and one of a single coloured mesh.

glTF is right-handed with y up and in metres, Polypod has z up.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""From Polypod's axes to glTF's: (x, y, z) becomes (x, z, -y)."""


def mesh_glb(mesh: trimesh.Trimesh, colors: NDArray[np.uint8], name: str) -> bytes:
    """A GLB file of one mesh in base axes, m, with colours (v, 3) of its vertices."""
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, vertex_colors=linear_rgb(colors))
    scene: Any = trimesh.Scene(base_frame=unused_name("scene", {name}))
    scene.graph.update(name, matrix=Y_UP)
    scene.add_geometry(mesh, f"{name}/mesh", f"{name}/mesh", name)
    return glb_of(scene)


def glb_of(scene: Any, **options: Any) -> bytes:
    """The file of a scene, with the normals of its faces."""
    gltf: Any = trimesh.exchange.gltf
    data: bytes = gltf.export_glb(scene, include_normals=True, **options)
    return data


def unused_name(name: str, taken: set[str]) -> str:
    """The name, or with a number if it is taken; it is then."""
    found, number = name, 2
    while found in taken:
        found, number = f"{name} {number}", number + 1
    taken.add(found)
    return found


def linear_rgb(srgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours as glTF counts them, by light, from the steps of a display; both from 0 to 255."""
    part = srgb / 255.0
    light = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255.0 * light), np.uint8)
