"""A mechanism's joints as scalar constraints between free links: velocities, and which are redundant.

For engines that give every link six degrees of freedom and want independent constraints [T63].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from polypod.answers.status import Status
from polypod.multibody.placement import BASE, PLATFORM, Placements
from polypod.multibody.tree import POINT, Body, Closure, Multibody, X, Y, Z
from polypod.vectors import cross, inverse, perpendiculars

Array = NDArray[np.float64]

RANK = 1e-9
"""Singular values below this part of the largest are zero. Redundant ones are below 1e-12."""
FEASIBLE = 1e-8
"""How much of the platform's motion, as a part of it, may break the constraints."""
CLOSED = 1e-10
"""Largest error of a joint where the links are put, a cosine or a part of the characteristic length."""


@dataclass(frozen=True, eq=False)
class Slide:
    """The second body's point, seen from the first's, stays perpendicular to an axis of the first."""

    name: str
    bodies: tuple[str, str]
    points: tuple[Array, Array]
    """(3,) each, in the frames of the two bodies."""
    axis: Array
    """(3,): unit vector in the axes of the first body."""


@dataclass(frozen=True, eq=False)
class Square:
    """An axis of the first and one of the second body stay perpendicular."""

    name: str
    bodies: tuple[str, str]
    axes: tuple[Array, Array]
    """(3,) each, unit vectors in the axes of the two bodies."""


Row = Slide | Square


def rows_of(tree: Multibody) -> tuple[Row, ...]:
    """All scalar constraints, of the joints first, then of the closures; redundant ones too."""
    joints = [row for body in tree.bodies for row in _joint_rows(body, tree.zero[body.parent])]
    return (*joints, *(row for closure in tree.closures for row in _closure_rows(closure)))


def _joint_rows(body: Body, parent: Array) -> list[Row]:
    """Constraints of a body's joint to its parent, with the frame (4, 4) at zero."""
    seen = inverse(parent) @ body.zero
    bodies = (body.parent, body.name)
    slides: Sequence[Array] = (X, Y, Z)
    squares: Sequence[tuple[Array, Array]] = ((X, Y), (Y, Z), (Z, X))
    match [freedom.kind for freedom in body.freedoms]:
        case ["free"]:
            return []
        case ["spherical"]:
            squares = ()
        case ["revolute"]:
            axis = body.freedoms[0].axis
            squares = [(axis, other) for other in perpendiculars(axis)]
        case ["revolute", "revolute"]:
            squares = [(body.freedoms[0].axis, body.freedoms[1].axis)]
        case ["prismatic"]:
            slides = perpendiculars(body.freedoms[0].axis)
        case []:
            pass
        case kinds:
            raise NotImplementedError(f"{body.name}: no constraints for the degrees of freedom {kinds}")
    name = f"{body.name} on {body.parent}"
    points = (seen[:3, 3], POINT)
    turn = seen[:3, :3]
    return [
        *(Slide(name, bodies, points, turn @ axis) for axis in slides),
        *(Square(name, bodies, (turn @ first, second)) for first, second in squares),
    ]


def _closure_rows(closure: Closure) -> list[Row]:
    slides: list[Row] = []
    if closure.points:
        slides = [Slide(closure.name, closure.bodies, closure.points, axis) for axis in (X, Y, Z)]
    return [*slides, *(Square(closure.name, closure.bodies, pair) for pair in closure.squares)]


def residual(rows: Sequence[Row], placements: Placements, scale: float) -> Array:
    """(rows,): errors of the constraints, pure numbers: distances over the scale (m), cosines."""
    at = {BASE: np.eye(4)} | placements
    errors = []
    for row in rows:
        first, second = (at[body] for body in row.bodies)
        if isinstance(row, Square):
            errors.append((first[:3, :3] @ row.axes[0]) @ (second[:3, :3] @ row.axes[1]))
        else:
            a, b = (
                frame[:3, :3] @ p + frame[:3, 3] for frame, p in zip((first, second), row.points, strict=True)
            )
            errors.append((first[:3, :3] @ row.axis) @ (b - a) / scale)
    return np.array(errors)


def jacobian(rows: Sequence[Row], bodies: Sequence[str], placements: Placements, scale: float) -> Array:
    """(rows, 6 bodies): of `residual` by the bodies' twists, in pure numbers [T63].

    A twist is the velocity of the body's origin over the scale, and the angular velocity, in base axes.
    """
    at = {BASE: np.eye(4)} | placements
    column = {body: 6 * i for i, body in enumerate(bodies)}
    found = np.zeros((len(rows), 6 * len(bodies)))
    for out, row in zip(found, rows, strict=True):
        frames = tuple(at[body] for body in row.bodies)
        for body, twist in zip(row.bodies, _gradients(row, *frames), strict=True):
            if body != BASE:
                out[column[body] :][:6] += [
                    *twist[:3],
                    *(twist[3:] / (1.0 if isinstance(row, Square) else scale)),
                ]
    return found


def _gradients(row: Row, first: Array, second: Array) -> tuple[Array, Array]:
    """Of a constraint by velocity and angular velocity of the first and second body's frame (4, 4)."""
    if isinstance(row, Square):
        normal = cross(first[:3, :3] @ row.axes[0], second[:3, :3] @ row.axes[1])
        return np.array([*POINT, *normal]), np.array([*POINT, *-normal])
    axis = first[:3, :3] @ row.axis
    arm = second[:3, :3] @ row.points[1]
    # The axis rotates with the first body, so that all of it moves with the arm to the second body's point.
    reach = second[:3, 3] + arm - first[:3, 3]
    return np.array([*-axis, *cross(axis, reach)]), np.array([*axis, *cross(arm, axis)])


def redundant(jacobian: Array) -> NDArray[np.intp]:
    """Rows of (m, n) that others say already: as many as m exceeds the rank, and without them the rank stays.

    Those that take part most in the dependences, by a pivoted QR decomposition of the left null space, so
    that the rest is as well conditioned as can be.
    """
    left, sizes, _ = np.linalg.svd(jacobian)
    rank = int(np.sum(sizes > RANK * sizes[0]))
    pivots = qr(left[:, rank:].T, pivoting=True, mode="r")[1]
    return np.sort(pivots[: len(jacobian) - rank])


@dataclass(eq=False)
class Start:
    """Where all links are and how they move."""

    placements: Placements
    twists: Array
    """(bodies, 6): velocity of each body's origin, m/s, and angular velocity, rad/s, in base axes."""
    redundant: NDArray[np.intp]
    """Numbers of the rows that others say already."""
    freedoms: int
    closure: float
    """Largest error of a joint."""
    status: Status


class Links:
    """A mechanism's links and all scalar constraints between them."""

    def __init__(self, tree: Multibody) -> None:
        self.tree = tree
        self.rows = rows_of(tree)
        self.bodies = [body.name for body in tree.bodies]

    def start(self, pose: Array, twist: Array) -> Start:
        """All links with the platform at `pose` (4, 4) and `twist` (6,), by the constraints [T63]."""
        placements, scale = self.tree.start(pose), self.tree.scale
        nothing = np.zeros((len(self.bodies), 6))
        if not all(np.isfinite(frame).all() for frame in placements.values()):
            return Start(placements, nothing, np.zeros(0, np.intp), 0, np.nan, Status.SINGULAR)
        worst = self.worst(placements)
        rows = jacobian(self.rows, self.bodies, placements, scale)
        others_say = redundant(rows)
        freedoms = rows.shape[1] - len(rows) + len(others_say)
        if worst > CLOSED:
            return Start(placements, nothing, others_say, freedoms, worst, Status.OFF_CONSTRAINT)
        platform = np.arange(6) + 6 * self.bodies.index(PLATFORM)
        others = np.setdiff1d(np.arange(rows.shape[1]), platform)
        moved = np.zeros(rows.shape[1])
        moved[platform] = [*(twist[:3] / scale), *twist[3:]]
        given = rows @ moved
        moved[others] = np.linalg.lstsq(rows[:, others], -given, rcond=RANK)[0]
        off = np.max(np.abs(rows @ moved), initial=0.0) > FEASIBLE * np.max(np.abs(given), initial=0.0)
        twists = moved.reshape(-1, 6) * ([scale] * 3 + [1.0] * 3)
        status = Status.OFF_CONSTRAINT if off else Status.OK
        return Start(placements, twists, others_say, freedoms, worst, status)

    def worst(self, placements: Placements) -> float:
        """Largest error of a constraint, a cosine or a part of the characteristic length."""
        return float(np.max(np.abs(residual(self.rows, placements, self.tree.scale)), initial=0.0))

    def words(self, numbers: NDArray[np.intp]) -> tuple[str, ...]:
        """Constraints in words."""
        kinds = {Slide: "displacement", Square: "turn"}
        return tuple(f"{kinds[type(self.rows[i])]} of {self.rows[i].name}" for i in numbers)
