"""What a picture in space consists of: bodies as faces, vectors, axes, mass centres, and names."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from trimesh import Trimesh

from polypod.bodies.drawing import Clip, Placed, moved
from polypod.bodies.drives import DRAWINGS
from polypod.bodies.links import link_frames, links_of
from polypod.bodies.palette import INK
from polypod.bodies.solids import four_sided, tube
from polypod.mechanism import Mechanism

Array = NDArray[np.float64]

LIGHT = np.array([-0.35, -0.55, 0.76])
"""Direction towards the light, base axes."""


class Label(NamedTuple):
    """A name in the picture, m, base axes."""

    text: str
    point: Array
    """(3,): what it names."""
    wanted: Array
    """(3,): where it should stand."""
    color: str = INK


class Vector(NamedTuple):
    """An arrow in the picture, m, base axes."""

    name: str
    """Such as `delta 1`, apart from the formula of its label."""
    ends: Array
    """(2, 3): tail and head."""
    color: str
    double: bool = False
    """Whether it has two heads, as rotations and torques have."""


class Faces:
    """Faces of bodies with their colours; m, base axes."""

    def __init__(self) -> None:
        self._corners: list[Array] = []
        self._normals: list[Array] = []
        self._colors: list[Array] = []

    def add(
        self,
        mesh: Trimesh,
        color: str,
        place: Array | None = None,
        clip: Clip | None = None,
        fade: float = 0.0,
    ) -> None:
        """The faces of a body in axes that stand at `place` (4, 4), as far as nothing hides them.

        `fade` is the share of white in their colour.
        """
        place = np.eye(4) if place is None else place
        corners, normals = four_sided(mesh)
        if clip is not None:
            corners, shown = clip(corners)
            corners, normals = corners[shown], normals[shown]
        self._corners.append(moved(corners, place))
        self._normals.append(normals @ place[:3, :3].T)
        mixed = fade + (1.0 - fade) * np.array(to_rgb(color))
        self._colors.append(np.broadcast_to(mixed, (len(corners), 3)))

    def corners(self) -> Array:
        """(N, 4, 3), m."""
        return np.concatenate([np.zeros((0, 4, 3)), *self._corners])

    def seen(self, viewer: Array) -> tuple[Array, Array]:
        """Corners (k, 4, 3) and colours (k, 3) in the light of the faces that look towards a viewer.

        Red, green, blue from 0 to 1. In perspective some that look a little away are seen, too.
        """
        normals = np.concatenate(self._normals)
        front = normals @ viewer > -0.25
        towards = normals[front] @ (LIGHT / np.linalg.norm(LIGHT))
        diffuse = 0.58 + 0.42 * (0.5 + 0.5 * towards)
        gloss = 0.32 * np.clip(towards, 0.0, 1.0) ** 12
        shaded = np.concatenate(self._colors)[front] * diffuse[:, None]
        return self.corners()[front], np.clip(shaded + (1.0 - shaded) * gloss[:, None], 0.0, 1.0)


class Picture:
    """Bodies, vectors and names in space, as `draw` draws them."""

    def __init__(self) -> None:
        self.faces = Faces()
        self.overlay = Faces()
        """Drawn over the bodies even where they hide it."""
        self.vectors: list[Vector] = []
        self.axes: list[tuple[Array, Array]] = []
        """Ends of axes of rotation, m."""
        self.mass_centres: list[Array] = []
        self.labels: list[Label] = []
        self.lines: list[tuple[Array, Array]] = []
        """Ends of what names should not cover, m."""

    def corners(self) -> Array:
        """(n, 3): two corners of each face, the ends of lines, and the labels, m."""
        bodies = [faces.corners()[:, ::2].reshape(-1, 3) for faces in (self.faces, self.overlay)]
        ends = [end for vector in self.vectors for end in vector.ends]
        ends += [end for line in self.axes for end in line]
        return np.concatenate(
            [*bodies, *(label.wanted[None] for label in self.labels), np.reshape(ends, (-1, 3))]
        )

    def add_links(
        self, mech: Mechanism, pose: Array, names: Collection[str] | None = None, fade: float = 0.0
    ) -> None:
        """Links at a pose, all or those of some names; but nothing inside a barrel or a carriage.

        Faces sorted by depth would not hide it.
        """
        frames = link_frames(mech, pose).frames
        found = [Placed(link.name, link.pieces, at) for link, at in zip(links_of(mech), frames, strict=True)]
        placed = [
            bool(np.isfinite(each.frame).all()) for each in found
        ]  # a leg without length has no direction
        clips: dict[tuple[str, str], Clip] = {}
        for i, (leg, drive) in enumerate(zip(mech.geometry["legs"], mech.drives, strict=True)):
            first = 1 + len(mech.rod_names) + 2 * i
            if placed[first] and placed[first + 1]:
                clips |= DRAWINGS[drive].clips(leg, found[first], found[first + 1])
        for link, has_place in zip(found, placed, strict=True):
            if has_place and (names is None or link.name in names):
                for piece in link.pieces:
                    clip = clips.get((link.name, piece.name)) or clips.get((link.name, ""))
                    self.faces.add(piece.mesh, piece.color, link.frame, clip, fade)

    def add_triad(self, faces: Faces, pose: Array, size: float, origin: str, names: str) -> None:
        """Axes of length `size`, m, with their names, among some faces."""
        start = pose[:3, 3]
        for column, name in enumerate(names):
            tip, neck = (start + part * size * pose[:3, column] for part in (1.0, 0.78))
            faces.add(tube(start, neck, 0.027 * size, sides=10), INK)
            faces.add(tube(neck, tip, 0.083 * size, end_radius=0.0), INK)
            self.labels.append(Label(f"${name}$", tip, start + 1.17 * (tip - start)))
            self.lines.append((start, tip))
        self.labels.append(Label(f"${origin}$", start, start - 0.16 * size * pose[:3, :3].sum(axis=1)))
