"""A mechanism as a GLB scene (glTF 2.0): a node for each link, and its motion as an animation.

glTF is right-handed with y up and in metres, Polypod has z up: the root's node rotates by -90 degrees about
x, so that base axes stand under it as they are.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polypod.bodies.links import Link, link_frames, links_of
from polypod.bodies.palette import rgb
from polypod.bodies.pieces import Piece
from polypod.errors import ExportError
from polypod.files.glb import Y_UP, glb_of, linear_rgb, unused_name
from polypod.legs.drives import LINK_PLACE
from polypod.mechanism import Mechanism
from polypod.vectors import inverse

Array = NDArray[np.float64]

STILL = 1e-9
"""Largest change over a motion, m or a pure number, that needs no channel."""
SHARP = np.radians(40.0)
"""Edges with more between their faces stay edges when shaded."""
FLOAT = 5126
"""glTF's code for single precision."""


@dataclass(frozen=True, eq=False)
class _Track:
    """A node's place in its parent over time."""

    name: str
    translation: Array
    """(t, 3), m."""
    rotation: Array
    """(t, 4): x, y, z, w."""


def glb(mech: Mechanism, poses: Array, time: Array | None = None) -> tuple[bytes, list[str]]:
    """A GLB file of a mechanism, and what it leaves out.

    Args:
        mech: the mechanism.
        poses: (4, 4), or (t, 4, 4) for an animation; poses without a place for each link are left out.
        time: (t,), s, for an animation.

    Raises:
        ExportError: no pose has a place for each link.
    """
    links, notes = links_of(mech), []
    found = link_frames(mech, poses.reshape(-1, 4, 4))
    placed = np.isfinite(found.frames).all(axis=(-3, -2, -1))
    if not placed.any():
        raise ExportError("there is no pose that has a place for each link")
    if not placed.all():
        notes.append(f"{np.sum(~placed)} instants without a place for each link are left out.")
    frames = found.frames[placed]
    known = np.atleast_1d(found.turn_known[placed].all(axis=0))
    free = [link.name for link, turns in zip(links, known, strict=True) if not turns]
    if free:
        notes.append(
            f"how these rotate about their own line is not known and drawn anyhow: {', '.join(free)}."
        )
    parents = _parents(mech, links)
    base = unused_name("scene", {link.name for link in links} | {mech.name})
    scene: Any = trimesh.Scene(base_frame=base)
    taken = {base}
    root = unused_name(mech.name, taken)
    scene.graph.update(root, matrix=Y_UP)
    nodes, tracks = [], []
    for i, link in enumerate(links):
        nodes.append(unused_name(link.name, taken))
        parent, now = root, frames[:, i]
        if (k := parents[i]) is not None:
            on = zip(frames[:, k], now, strict=True)
            parent, now = nodes[k], np.stack([inverse(above) @ frame for above, frame in on])
        scene.graph.update(nodes[i], parent, matrix=now[0])
        tracks.append(_track(nodes[i], now))
        for piece in link.pieces:
            name = unused_name(f"{link.name}/{piece.name}", taken)
            scene.add_geometry(_shaded(piece), name, name, nodes[i])
    if time is None:
        return glb_of(scene), notes
    notes.append(
        f"the animation has {len(frames)} frames, with positions and rotations interpolated between them; "
        "forces and all other results are not in it."
    )
    return glb_of(scene, buffer_postprocessor=partial(_animate, tracks, time[placed])), notes


def _parents(mech: Mechanism, links: tuple[Link, ...]) -> list[int | None]:
    """The link that each hangs on: of a leg the second on the first, that on its rod or on the base."""
    index = {(link.kind, link.index): i for i, link in enumerate(links)}
    found: list[int | None] = []
    for link in links:
        match LINK_PLACE.get(link.kind):
            case 0:
                rod = mech.geometry["legs"][link.index]["base"]["rod"]
                found.append(index["base", 0] if rod is None else index["rod", rod])
            case 1:
                found.append(index[mech.drives[link.index].links[0], link.index])
            case None:
                found.append(index["base", 0] if link.kind == "rod" else None)
    return found


def _shaded(piece: Piece) -> trimesh.Trimesh:
    """A piece in its colour, with round faces that look round."""
    mesh: trimesh.Trimesh = trimesh.graph.smooth_shade(piece.mesh, angle=SHARP, facet_minarea=None)
    srgb = np.array(rgb(piece.color), np.uint8)
    color = [*linear_rgb(srgb).tolist(), 255]
    visual: Any = trimesh.visual
    material = visual.material.PBRMaterial(
        name=piece.color, baseColorFactor=color, metallicFactor=0.1, roughnessFactor=0.6
    )
    mesh.visual = visual.TextureVisuals(material=material)
    return mesh


# --- animation ----------------------------------------------------------------------------------------------


def _track(name: str, frames: Array) -> _Track:
    """Of frames (t, 4, 4); quaternions go the shorter way from one to the next."""
    rotation = Rotation.from_matrix(frames[:, :3, :3]).as_quat()
    signs = np.where(np.sum(rotation[1:] * rotation[:-1], axis=-1) < 0.0, -1.0, 1.0)
    rotation[1:] *= np.cumprod(signs)[:, None]
    return _Track(name, frames[:, :3, 3], rotation)


def _animate(
    tracks: list[_Track], time: Array, buffers: MutableMapping[Any, bytes], tree: dict[str, Any]
) -> None:
    """Adds an animation to the tables and data of a GLB file before they are written."""
    nodes = {node["name"]: (i, node) for i, node in enumerate(tree["nodes"])}
    animation: dict[str, Any] = {"name": "motion", "samplers": [], "channels": []}
    clock = _accessor(tree, buffers, time - time[0], "SCALAR")
    for track in tracks:
        index, node = nodes[track.name]
        # An animated node has its position and rotation apart, not as a matrix.
        node.pop("matrix", None)
        for path, values in (("translation", track.translation), ("rotation", track.rotation)):
            node[path] = values[0].tolist()
            if np.ptp(values, axis=0).max() <= STILL:
                continue
            output = _accessor(tree, buffers, values, f"VEC{values.shape[1]}")
            animation["channels"].append(
                {"sampler": len(animation["samplers"]), "target": {"node": index, "path": path}}
            )
            animation["samplers"].append({"input": clock, "output": output, "interpolation": "LINEAR"})
    if animation["channels"]:
        tree["animations"] = [animation]


def _accessor(tree: dict[str, Any], buffers: MutableMapping[Any, bytes], values: Array, kind: str) -> int:
    """Adds data in single precision; its index."""
    data = np.ascontiguousarray(values, "<f4")
    columns = data.reshape(len(data), -1)
    key = ("polypod", len(buffers))
    buffers[key] = data.tobytes()
    tree["accessors"][key] = {
        "bufferView": len(buffers) - 1,
        "componentType": FLOAT,
        "count": len(data),
        "type": kind,
        "min": columns.min(axis=0).tolist(),
        "max": columns.max(axis=0).tolist(),
    }
    return len(tree["accessors"]) - 1
