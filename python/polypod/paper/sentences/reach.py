"""Reach in every direction: of o inside a workspace, with the platform level, and in tilt."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from polypod.answers.answer import Array
from polypod.mechanism import Mechanism
from polypod.paper.sentences.poses import moved
from polypod.workspaces.workspace import Workspace

DIRECTIONS = 500
"""All over the sphere."""

HORIZONTAL = 72
"""Directions in the plane, every 5°."""

_TOGETHER = 16
"""Rays that are intersected with all faces at a time."""

_EDGE = 1e-9
"""By which a ray may miss a triangle, as a part of its sides: one through an edge must meet a side of it."""

_MARCH = 0.005
"""Steps, m, by which level moves are followed."""

_TILT_MARCH = np.radians(1.0)
"""Steps, rad, by which tilts are followed."""

_END = 1e-12
"""Below which steps, m or rad, end."""

_AZIMUTHS = 180
"""At which tilts are followed at a time."""

_ZOOMS = 3
"""Times that the best azimuth is looked for, each within two steps of the one before: to 0.001°."""


def circle(count: int = HORIZONTAL) -> Array:
    """(count, 3): unit vectors in X-Y, the first along X."""
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=-1)


def sphere(count: int = DIRECTIONS) -> Array:
    """(count, 3): unit vectors evenly over the sphere, on a spiral of the golden angle."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    return np.stack([np.sqrt(1.0 - z**2) * np.cos(angle), np.sqrt(1.0 - z**2) * np.sin(angle), z], axis=-1)


def reach_inside(vertices: Array, faces: NDArray[np.int64], origin: Array, directions: Array) -> Array:
    """(D,): how far one can go from a point inside a closed mesh before its surface is met; inf if never.

    Rays against triangles by Cramer's rule: origin + t d = a + u (b - a) + v (c - a).
    """
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    to_b, to_c, to_origin = b - a, c - a, origin - a
    normal = np.cross(to_b, to_c)
    height = np.einsum("fi,fi->f", to_origin, normal)
    found = []
    for start in range(0, len(directions), _TOGETHER):
        d = directions[start : start + _TOGETHER]
        with np.errstate(divide="ignore", invalid="ignore"):  # a ray along a face's plane does not meet it
            det = -d @ normal.T
            side = np.cross(d[:, None], to_origin)
            t = height / det
            u = -np.einsum("dfi,fi->df", side, to_c) / det
            v = np.einsum("dfi,fi->df", side, to_b) / det
            met = (t > 0.0) & (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE)
        found.append(np.min(np.where(met, t, np.inf), axis=1))
    return np.concatenate(found)


def reach(workspace: Workspace, origin: Array, directions: Array) -> Array:
    """(D,): the same inside the boundary of a workspace of positions, m; as exact as its grid resolves it."""
    return reach_inside(workspace.vertices, workspace.faces, origin, directions)


def largest_ball(workspace: Workspace) -> tuple[Array, float]:
    """Centre (3,) and radius, m, of the largest ball of positions, both to about a step of the grid."""
    steps = [axis[1] - axis[0] for axis in workspace.axes]
    padded = np.pad(workspace.mask, 1)
    distance = distance_transform_edt(padded, sampling=steps)[1:-1, 1:-1, 1:-1]
    at = np.unravel_index(int(np.argmax(distance)), distance.shape)
    centre = np.array([axis[i] for axis, i in zip(workspace.axes, at, strict=True)])
    return centre, float(distance[at])


def mirror_difference(workspace: Workspace, height: float) -> tuple[float, float]:
    """How far a workspace and its mirror image in OYZ, and in OXZ, are apart at a height, m.

    The greatest difference of the horizontal reach from the Z axis in mirrored directions.
    """
    found = reach(workspace, np.array([0.0, 0.0, height]), circle())
    direction = np.arange(HORIZONTAL)
    mirrored = (found[(sign * HORIZONTAL // 2 - direction) % HORIZONTAL] for sign in (1, 0))
    in_oyz, in_oxz = (float(np.max(np.abs(found - image))) for image in mirrored)
    return in_oyz, in_oxz


def interrupted(workspace: Workspace, above: float = -np.inf) -> float:
    """The share of the vertical lines of a grid through a workspace on which it is interrupted; no unit.

    Only the part above a height, m.
    """
    inside = workspace.mask[:, :, workspace.axes[2] > above]
    begins = inside & ~np.pad(inside, ((0, 0), (0, 0), (1, 0)))[:, :, :-1]
    pieces = begins.sum(axis=-1)
    return float(np.mean(pieces[pieces > 0] > 1))


def level_reach(mech: Mechanism, directions: Array) -> Array:
    """(D,): how far o can go from home straight along directions (D, 3), its orientation kept, m.

    To where the first limit is met.
    """
    home = mech.home[:3, 3]
    return _first_limit(
        mech, len(directions), _MARCH, lambda d, _: moved(mech.home, home + d[:, None] * directions)
    )


def tilts_at_home(mech: Mechanism) -> tuple[float, float]:
    """The least and the greatest tilt of the tool axis that home's position of o allows, over azimuths, rad.

    From home to where the first limit is met, with the tool tip in o.
    """
    tip = dict(zip(("tip_x", "tip_y", "tip_z"), mech.home[:3, 3].tolist(), strict=True))

    def tilted(azimuth: Array) -> Array:
        """(D,): tilts at azimuths (D,)."""

        def pose(tilt: Array, guess: Array) -> Array:
            x, y = np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth)
            return mech.pose({**tip, "axis_x": x, "axis_y": y, "axis_z": np.cos(tilt)}, guess=guess)

        return _first_limit(mech, len(azimuth), _TILT_MARCH, pose)

    def best(of: Callable[[Array], np.intp]) -> float:
        """The extreme tilt, looked for more and more narrowly about the best azimuth."""
        azimuth, width = 0.0, np.pi
        for _ in range(_ZOOMS):
            at = azimuth + width * np.linspace(-1.0, 1.0, _AZIMUTHS)
            tilts = tilted(at)
            azimuth, width = float(at[of(tilts)]), 4.0 * width / _AZIMUTHS
        return float(tilts[of(tilts)])

    return best(np.argmin), best(np.argmax)


def _first_limit(mech: Mechanism, count: int, step: float, pose_at: Callable[[Array, Array], Array]) -> Array:
    """(count,): how far ways from home lead inside all limits, in the unit of `step`.

    `pose_at` takes distances (count,) and the poses before them. Each way goes on by steps, halved where one
    would leave the limits: a limit that is passed and met again within one is overlooked.
    """
    distance, steps = np.zeros(count), np.full(count, step)
    pose = np.broadcast_to(mech.home, (count, 4, 4))
    while steps.max() > _END:
        trial = pose_at(distance + steps, pose)
        within = mech.limits(trial).within
        distance, steps = np.where(within, distance + steps, distance), np.where(within, steps, 0.5 * steps)
        pose = np.where(within[:, None, None], trial, pose)
    return distance
