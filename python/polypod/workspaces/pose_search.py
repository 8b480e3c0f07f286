"""Single places of a reachable workspace in pose space: its ends [T76], and whether o reaches a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation, Slerp

from polypod import _core
from polypod.mechanism import Mechanism
from polypod.workspaces.causes import NO_POSE, SINGULARITY
from polypod.workspaces.extremes import Bounded, between

Array = NDArray[np.float64]

INSIDE = 1e-10
"""Margin, relative to its scale, by which limits are kept: rounding of fitted poses."""

AHEAD = 1e-6
"""How far legs reach ahead at least, in characteristic lengths, and the least δ·d of a drive."""

_PIECES = 33
"""Places between two poses at which the way is tried."""

_JUMP = 0.1
"""The most by which fitting may rotate from one place of a way to the next, beyond what the way does, rad."""

_NEARBY = 12
"""Places of the boundary from which the way to an end is tried, or to a point."""


class PoseSpace:
    """The poses inside all limits about those of a boundary."""

    samples = 2048
    """Places of each kind that are tried for the error of the volume: each takes some fits."""

    def __init__(
        self, mech: Mechanism, boundary: Array, box: Array, *, aspect: bool = False, threads: int = 0
    ) -> None:
        """About poses (v, 4, 4), o in a box (3, 2); `aspect` keeps the sign of det J."""
        self.mech, self.boundary, self.box = mech, boundary, box
        self.aspect, self.threads = aspect, threads

    def search(self, axis: int, sense: int, start: int) -> PoseSearch:
        """The search for an end of the position of o along an axis, from a pose of the boundary."""
        return PoseSearch(self.mech, self.boundary, start, axis, sense, box=self.box, aspect=self.aspect)

    def reaches(self, points: Array) -> NDArray[np.bool_]:
        """(n,): which points (n, 3) o reaches, on straight ways from poses of the boundary nearby.

        Where no such way is open, a pose is looked for at the point itself, and the way back from it. From
        points that are reached others may be.
        """
        poses = np.full((len(points), 4, 4), np.nan)
        known = self.boundary
        while len(known):
            left = np.flatnonzero(np.isnan(poses[:, 0, 0]))
            if not len(left):
                break
            near = KDTree(known[:, :3, 3]).query(points[left], k=min(_NEARBY, len(known)))[1]
            for nearby in near.reshape(len(left), -1).T:
                still = np.isnan(poses[left, 0, 0])
                poses[left[still]] = self._led(known[nearby[still]], points[left[still]])
            known = poses[left[np.isfinite(poses[left, 0, 0])]]
        return np.asarray(np.isfinite(poses[:, 0, 0]))

    def _led(self, poses: Array, points: Array) -> Array:
        """(n, 4, 4): poses at points (n, 3) that straight ways join to given ones; NaN where none does."""
        ends = self._open(poses, points)
        left = np.flatnonzero(np.isnan(ends[:, 0, 0]))
        there = poses[left]
        there[:, :3, 3] = points[left]
        there = _core.fit_poses(self.mech._core, np.ascontiguousarray(there).reshape(-1))
        found = np.isfinite(there[:, 0, 0])
        if self.aspect:
            signs = (np.sign(self.mech.determinant(of).determinant) for of in (there, self.boundary[:1]))
            found &= np.equal(*signs)
        left, there = left[found], there[found]
        back = self._open(there, poses[left, :3, 3])
        for i in np.flatnonzero(np.isfinite(back[:, 0, 0])):
            # At the place that it came from, the platform may be rotated otherwise.
            if last_of(self.mech, straight(back[i], poses[left[i]]), aspect=self.aspect) is not None:
                ends[left[i]] = there[i]
        return ends

    def _open(self, poses: Array, points: Array) -> Array:
        """(n, 4, 4): poses at the ends of straight ways of o from poses to points (n, 3); NaN if not open."""
        ways = np.ascontiguousarray(poses).reshape(-1), np.ascontiguousarray(points).reshape(-1)
        return np.asarray(_core.lead_poses(self.mech._core, *ways, self.aspect, self.threads))


class PoseSearch:
    """Poses about one of the boundary, as a translation in characteristic lengths and a rotation vector.

    Coordinates of drives that move their foot are variables of their own, in characteristic lengths: at dead
    positions they are no smooth functions of the pose.
    """

    def __init__(
        self, mech: Mechanism, boundary: Array, start: int, axis: int, sense: int, *, box: Array, aspect: bool
    ) -> None:
        """Of the position of o along an axis towards a sense, from one of the boundary's poses (v, 4, 4)."""
        self.mech, self._boundary, self._start = mech, boundary, boundary[start]
        self.scale = mech.characteristic_length
        self._axis = axis
        lengths = mech.inverse_kinematics(self._start).lengths[mech.moves_feet]
        # Where a strut does not reach its rail, its carriage is next to it.
        self._coordinates = np.where(np.isfinite(lengths), lengths, 0.0)
        self._objective = np.zeros(6 + len(lengths))
        self._objective[axis] = sense
        room = (box - self._start[:3, 3:]) / self.scale
        self.box = np.concatenate([room, np.tile([-np.inf, np.inf], (3 + len(lengths), 1))])
        bounds = self._bounds(np.zeros(6 + len(lengths)))
        det = float(bounds["determinant"][0][0])
        # That of redundant actuation, of JᵀJ, has one sign.
        self._det = det if aspect and np.isfinite(det) else None
        limits = [limit.name for limit in mech.limit_list]
        others = len(bounds["ahead"][0]), int(self._det is not None)
        self.names = (*limits, *[NO_POSE] * others[0], *[SINGULARITY] * others[1])
        self.least = np.repeat([INSIDE, AHEAD, INSIDE], [len(limits), *others])

    def pose(self, x: Array) -> Array:
        """(4, 4): the pose at variables (6 + k,)."""
        pose: Array = self._start.copy()
        pose[:3, 3] += self.scale * x[:3]
        pose[:3, :3] = Rotation.from_rotvec(x[3:6]).as_matrix() @ pose[:3, :3]
        return pose

    def _bounds(self, x: Array) -> dict[str, tuple[Array, Array]]:
        bounds: dict[str, tuple[Array, Array]] = _core.pose_bounds(
            self.mech._core,
            np.ascontiguousarray(self.pose(x)).reshape(-1),
            self._coordinates + self.scale * x[6:],
        )
        return bounds

    def at(self, x: Array) -> Bounded:
        """What bounds the pose."""
        bounds = self._bounds(x)
        by_x = self.scale * np.eye(len(x))
        by_x[3:6, 3:6] = left_jacobian(x[3:6])
        positive = [bounds["limits"], bounds["ahead"]]
        if self._det is not None:
            value, row = bounds["determinant"]
            positive.append((value / self._det, row / self._det))
        return Bounded(
            (bounds["constraints"][0], bounds["constraints"][1] @ by_x),
            (
                np.concatenate([value for value, _ in positive]) - self.least,
                np.concatenate([row for _, row in positive]) @ by_x,
            ),
            (float(self._objective @ x), self._objective),
        )

    def value(self, x: Array) -> float:
        """The position of o along the axis, m."""
        return float(self._start[self._axis, 3] + self.scale * x[self._axis])

    def reached(self, way: Array) -> Array | None:
        """The pose at the end of ways from place to place (w, 6), if all are open; else none.

        Without a place between, the way from poses of the boundary nearby is tried, too.
        """
        if len(way) > 2:
            way = np.stack([self.pose(x) for x in between(way, _PIECES)])
            return last_of(self.mech, way, aspect=self._det is not None)
        end = self.pose(way[-1])
        turns = end[:3, :3] @ self._boundary[:, :3, :3].transpose(0, 2, 1)
        apart = Rotation.from_matrix(turns).magnitude()
        apart += np.linalg.norm(end[:3, 3] - self._boundary[:, :3, 3], axis=1) / self.scale
        starts = [self._start, *self._boundary[np.argsort(apart, kind="stable")[:_NEARBY]]]
        for start in starts:
            pose = last_of(self.mech, straight(start, end), aspect=self._det is not None)
            if pose is not None:
                return pose
        return None


def last_of(mech: Mechanism, way: Array, *, aspect: bool) -> Array | None:
    """The last pose of a way (w, 4, 4) if poses inside all limits lie next to all of it; else none.

    Next to: without a jump of the rotation and, with `aspect`, with one sign of det J.
    """
    fitted = _core.fit_poses(mech._core, np.ascontiguousarray(way).reshape(-1))
    if not np.isfinite(fitted).all() or (_turns(fitted) > _turns(way) + _JUMP).any():
        return None
    if aspect:
        signs = np.sign(mech.determinant(fitted).determinant)
        if not (signs == signs[0]).all():
            return None
    return np.asarray(fitted[-1])


def straight(start: Array, end: Array) -> Array:
    """(w, 4, 4): poses between two, o on a straight line and the rotation about one axis."""
    t = np.linspace(0.0, 1.0, _PIECES)
    way = np.tile(np.eye(4), (_PIECES, 1, 1))
    ends = Rotation.from_matrix(np.stack([start[:3, :3], end[:3, :3]]))
    way[:, :3, :3] = Slerp([0.0, 1.0], ends)(t).as_matrix()
    way[:, :3, 3] = start[:3, 3] + t[:, None] * (end[:3, 3] - start[:3, 3])
    way[-1] = end
    return way


def _turns(way: Array) -> Array:
    """(w - 1,): angles by which poses (w, 4, 4) are rotated from one to the next, rad."""
    steps = way[1:, :3, :3] @ way[:-1, :3, :3].transpose(0, 2, 1)
    return np.asarray(Rotation.from_matrix(steps).magnitude())


def left_jacobian(w: Array) -> Array:
    """(3, 3): the angular velocity in base axes by the rate of a rotation vector (3,), rad."""
    angle = float(np.linalg.norm(w))
    cross = np.cross(np.eye(3), w)
    if angle < 1e-4:
        return np.asarray(np.eye(3) + 0.5 * cross + cross @ cross / 6.0)
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)
