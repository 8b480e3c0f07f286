"""Mechanisms as screws: poses are products of exponentials, degrees of freedom are null vectors.

Nothing here is shared with Polypod: a leg is the row of its joints as screws at home.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEED = 70011
SI = {"length": "m", "angle": "rad", "mass": "kg", "inertia": "kg m^2"}
POSES = 3
"""At which a mechanism's degrees of freedom are counted: at a singular one a rank is less."""
IDLE_POSES = 8
"""At which twists that no leg feels are held against one another."""
IDLE_REACH = 0.1
"""From farther off loops close in other modes, and with struts on the other side."""
RANK = 1e-7
"""Singular values below this part of the largest are zero: poses are known to 1e-12."""
COMMON = 1e-6
"""How far lines may move from pose to pose and still be fixed."""


@dataclass
class Leg:
    kind: str
    screws: list[Array]
    """(6,) each, velocity at the origin and rotation, base axes at home; from the base up, without the
    rod's."""
    lower: int
    """How many of them are the base joint's."""
    coordinate: float
    """At home: its length, or the place of its carriage."""
    rod: int | None = None
    actuated: bool = True
    slider: bool = False
    fault: str | None = None
    """The place in its table that must be refused."""
    table: dict[str, Any] = field(default_factory=dict)

    @property
    def slide(self) -> int:
        """Which screw is the prismatic joint: a slider's goes before its base joint."""
        return 0 if self.slider else self.lower


@dataclass
class Drawn:
    """A random mechanism: its joints as screws, and its file."""

    number: int
    style: str
    legs: list[Leg]
    rods: list[Array]
    """Screw of each rod's rotation."""
    home: Array
    """(4, 4)."""
    data: dict[str, Any]
    poses: list[Array] = field(default_factory=list)
    """Joint values of some poses near home, with all loops closed."""

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(leg.kind for leg in self.legs)

    @property
    def faults(self) -> list[str]:
        """Places in its file that must be refused."""
        return [f"legs.{i}.{leg.fault}" for i, leg in enumerate(self.legs, 1) if leg.fault]


# --- screws -------------------------------------------------------------------------------------------------


def unit(v: Array) -> Array:
    return v / np.linalg.norm(v)


def skew(v: Array) -> Array:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    if angle < 1e-300:
        return np.eye(3)
    k = skew(vector / angle)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def rotation_vector(turn: Array) -> Array:
    """Of a rotation of less than half a circle."""
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine, cosine = float(np.linalg.norm(axis)), (np.trace(turn) - 1) / 2
    return axis * (np.arctan2(sine, cosine) / sine if sine > 1e-12 else 1.0)


def turning(axis: Array, point: Array) -> Array:
    """The screw of a rotation about a line."""
    return np.concatenate([np.cross(point, axis), axis])


def skews(v: Array) -> Array:
    """(n, 3, 3) of (n, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 2, 1], out[:, 0, 2], out[:, 1, 0] = v.T
    return out - np.swapaxes(out, 1, 2)


def exponentials(screws: Array, values: Array) -> Array:
    """(n, 4, 4): displacements of joints with these screws, about unit axes or pure translations."""
    v, k = screws[:, :3], skews(screws[:, 3:])
    turns = np.eye(3) + np.sin(values)[:, None, None] * k + (1 - np.cos(values))[:, None, None] * (k @ k)
    points = (k @ v[:, :, None])[:, :, 0]
    arcs = points - (turns @ points[:, :, None])[:, :, 0]
    out = np.tile(np.eye(4), (len(values), 1, 1))
    out[:, :3, :3] = turns
    out[:, :3, 3] = np.where(screws[:, 3:].any(axis=1)[:, None], arcs, v * values[:, None])
    return out


def carried(screws: Array, by: Array) -> Array:
    """(n, 6): screws that displacements (n, 4, 4) have carried along."""
    w = (by[:, :3, :3] @ screws[:, 3:, None])[:, :, 0]
    v = (by[:, :3, :3] @ screws[:, :3, None])[:, :, 0] + (skews(by[:, :3, 3]) @ w[:, :, None])[:, :, 0]
    return np.hstack([v, w])


# --- loops --------------------------------------------------------------------------------------------------


def chains(drawn: Drawn, q: Array) -> tuple[list[Array], Array]:
    """The platform's displacement by each leg, (4, 4); and all screws, (6 legs, joints), at joint values q.

    q holds the rods' turns, then the joints of each leg.
    """
    screws = np.array([*drawn.rods, *(screw for leg in drawn.legs for screw in leg.screws)])
    each = exponentials(screws, q)
    before = np.tile(np.eye(4), (len(q), 1, 1))
    ends, column = [], len(drawn.rods)
    for leg in drawn.legs:
        here = np.eye(4) if leg.rod is None else each[leg.rod]
        for _ in leg.screws:
            before[column] = here
            here = here @ each[column]
            column += 1
        ends.append(here)
    now, joints, column = carried(screws, before), np.zeros((6 * len(drawn.legs), len(q))), len(drawn.rods)
    for i, leg in enumerate(drawn.legs):
        rows, own = slice(6 * i, 6 * i + 6), slice(column, column + len(leg.screws))
        joints[rows, own] = now[own].T
        if leg.rod is not None:
            joints[rows, leg.rod] = now[leg.rod]
        column = own.stop
    return ends, joints


def count(drawn: Drawn) -> int:
    """Number of joint values."""
    return len(drawn.rods) + sum(len(leg.screws) for leg in drawn.legs)


def slides(drawn: Drawn) -> NDArray[np.intp]:
    """Entry of each leg's prismatic joint."""
    first = len(drawn.rods) + np.cumsum([0, *(len(leg.screws) for leg in drawn.legs[:-1])])
    return np.array([f + leg.slide for f, leg in zip(first, drawn.legs, strict=True)])


def closures(drawn: Drawn, joints: Array) -> Array:
    """(6 legs, joints + 6): joint rates and the platform's twist, of which each leg makes zero."""
    return np.hstack([joints, np.tile(-np.eye(6), (len(drawn.legs), 1))])


def positions(drawn: Drawn, number: int, reach: float = 0.25) -> list[Array]:
    """Joint values near home with all loops closed; home itself is none of them."""
    rng = np.random.default_rng([SEED, drawn.number, 1])
    found: list[Array] = []
    for _ in range(number + 3):
        q = reach * rng.uniform(-1, 1, count(drawn))
        if (closed := close(drawn, q)) is not None:
            found.append(closed)
        if len(found) == number:
            break
    return found or [np.zeros(count(drawn))]


def close(drawn: Drawn, q: Array) -> Array | None:
    """Joint values near q with all loops closed, by damped Gauss-Newton steps of least size."""
    for _ in range(60):
        ends, joints = chains(drawn, q)
        left = inverse(ends[0])
        error = np.concatenate([np.zeros(6), *(_screw_of(end @ left) for end in ends[1:])])
        size = float(np.abs(error).max())
        if size < 1e-13:
            return q
        # The first leg's end is the platform.
        loops = joints - np.tile(joints[:6], (len(drawn.legs), 1))
        u, s, vt = np.linalg.svd(loops, full_matrices=False)
        keep = s > 1e-9 * s[0] if len(s) and s[0] > 0 else np.zeros(len(s), dtype=bool)
        gain = np.where(keep, s / (s * s + min(size, 1.0) ** 2), 0.0)
        step = -vt.T @ (gain * (u.T @ error))
        q = q + step * min(1.0, 0.5 / max(float(np.abs(step).max()), 1e-300))
    return None


def inverse(pose: Array) -> Array:
    out = np.eye(4)
    out[:3, :3] = pose[:3, :3].T
    out[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return out


def _screw_of(pose: Array) -> Array:
    """A small displacement as a screw, to first order."""
    return np.concatenate([pose[:3, 3], rotation_vector(pose[:3, :3])])


# --- mobility -----------------------------------------------------------------------------------------------


def rank(matrix: Array) -> int:
    s = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(s > RANK * s[0])) if len(s) and s[0] > 0.0 else 0


def clear(drawn: Drawn) -> bool:
    """Whether the ranks are clear at all poses.

    They are not where loops close as a double root, a leg at a dead point in every pose, say: such poses are
    known to the square root of rounding, and so are the singular values there. The platform then feels a
    degree of freedom more than it has: `extent` counts those that it has.
    """
    for q in drawn.poses:
        s = np.linalg.svd(closures(drawn, chains(drawn, q)[1]), compute_uv=False)
        if np.any((s > 1e-11 * s[0]) & (s < 1e-5 * s[0])):
            return False
    return True


def extent(drawn: Drawn) -> int:
    """Degrees of freedom of the platform: the number of directions in which its poses near home lie.

    Another mode that happens to be near home is away from it by as much at any reach.
    """
    return min(_directions(drawn, reach) for reach in (0.02, 0.06))


def _directions(drawn: Drawn, reach: float) -> int:
    off = []
    for q in positions(drawn, 30, reach):
        end = chains(drawn, q)[0][0]
        off.append([*((end @ drawn.home)[:3, 3] - drawn.home[:3, 3]), *rotation_vector(end[:3, :3])])
    # Paths are bent by a fiftieth; double roots are known to 3e-7.
    return int(np.sum(np.linalg.svd(np.array(off), compute_uv=False) > 0.1 * reach))


@dataclass(frozen=True)
class Mobility:
    """From ranks, at the poses where they are greatest."""

    dof: int
    passive: int
    closure_rank: int
    uncontrolled: int
    """Degrees of freedom left with all actuators locked, idle ones too."""
    idle: int

    @classmethod
    def of(cls, drawn: Drawn) -> Mobility:
        found = [ranks(drawn, q) for q in drawn.poses]
        dof, passive, negative, uncontrolled = (min(values) for values in zip(*found, strict=True))
        return cls(dof, passive, -negative, uncontrolled, idle(drawn))


def ranks(drawn: Drawn, q: Array) -> tuple[int, int, int, int]:
    """Degrees of freedom, passive ones, the closures' rank with a minus sign, and with actuators locked."""
    joints = chains(drawn, q)[1]
    full, still = rank(closures(drawn, joints)), joints.shape[1] - rank(joints)
    locked = [column for leg, column in zip(drawn.legs, slides(drawn), strict=True) if leg.actuated]
    dof = joints.shape[1] + 6 - full - still
    return dof, still, 6 - full, moves(drawn, np.delete(joints, locked, axis=1)).shape[1]


def moves(drawn: Drawn, joints: Array) -> Array:
    """(6, k): an orthonormal basis of the platform's twists with these joint rates free."""
    _, s, vt = np.linalg.svd(closures(drawn, joints))
    free = vt[int(np.sum(s > RANK * s[0])) :, -6:].T
    u, s, _ = np.linalg.svd(free, full_matrices=False)
    return u[:, s > RANK]


def unfelt(drawn: Drawn) -> list[tuple[Array, Array]]:
    """The platform's displacements (4, 4) at some poses, and its twists (6, k) there that no leg feels."""
    found = []
    for q in positions(drawn, IDLE_POSES, IDLE_REACH):
        ends, joints = chains(drawn, q)
        found.append((ends[0], moves(drawn, np.delete(joints, slides(drawn), axis=1))))
    least = min(twists.shape[1] for _, twists in found)
    return [(end, twists) for end, twists in found if twists.shape[1] == least]


def idle(drawn: Drawn) -> int:
    """Number of rotations about lines fixed in the platform or the base that no leg feels."""
    for q in drawn.poses:
        if moves(drawn, np.delete(chains(drawn, q)[1], slides(drawn), axis=1)).shape[1] == 0:
            return 0
    free = unfelt(drawn)
    end, twists = free[0]
    in_base = turns([t for _, t in free])
    in_platform = turns([by(inverse(end), t) for end, t in free])
    both = np.hstack([by(end, in_platform), in_base])
    return min(rank(both), rank(both[3:]), twists.shape[1])


def by(displacement: Array, twists: Array) -> Array:
    """(6, k): twists carried by a displacement (4, 4)."""
    return carried(twists.T, np.tile(displacement, (twists.shape[1], 1, 1))).T


def turns(spaces: list[Array]) -> Array:
    """(6, k): what is common to spaces of twists (6, n), if all of it is rotations about lines."""
    off = np.vstack([np.eye(6) - t @ np.linalg.pinv(t) for t in spaces])
    _, s, vt = np.linalg.svd(off)
    common = vt[s < COMMON].T
    pitches = common[:3].T @ common[3:]
    pure = abs(pitches + pitches.T).max(initial=0.0) < COMMON
    return common if pure and rank(common[3:]) == common.shape[1] else np.zeros((6, 0))


# --- given mechanisms ---------------------------------------------------------------------------------------


def of_geometry(geometry: dict[str, Any]) -> Drawn:
    """The screws of a mechanism that is given by its points and axes, SI, as `mech.geometry` has them."""
    home = np.eye(4)
    home[:3, :3] = rotation(np.array(geometry["home"]["rotation_vector"]))
    home[:3, 3] = geometry["home"]["position"]
    turn = home[:3, :3]
    rods = [turning(unit(np.array(rod["axis"])), np.array(rod["point"])) for rod in geometry["rods"]]
    legs = []
    for leg in geometry["legs"]:
        base, platform, slider = leg["base"], leg["platform"], leg["slider"]
        below, above = np.array(base["point"]), home[:3, 3] + turn @ np.array(platform["point"])
        place, slide = float(np.linalg.norm(above - below)), unit(above - below)
        if slider:
            slide = unit(np.array(slider["axis"]))
            along = slide @ (above - below)
            far = above - below - along * slide
            place = along - slider["branch"] * float(np.sqrt(slider["strut"] ** 2 - far @ far))
            below = below + place * slide
        delta = unit(above - below)
        rod = base["rod"]
        own = None if rod is None else geometry["rods"][rod]["axis"]
        axes = [
            a and body @ unit(np.array(a))
            for a, body in ((own or base["axis"], np.eye(3)), (platform["axis"], turn))
        ]
        letters = ("R" if rod is not None else base["joint"]), platform["joint"]
        normal = next(
            (
                _of_axis(a, letter, delta)
                for a, letter in zip(axes, ("U" if rod is not None else letters[0], letters[1]), strict=True)
                if letter in "UR" and a is not None
            ),
            None,
        )
        lower = _screws(
            "R" if rod is not None else letters[0], None if rod is not None else axes[0], normal, below
        )
        upper = _screws(letters[1], axes[1], normal, above)[::-1]
        prismatic = np.concatenate([slide, np.zeros(3)])
        screws = [prismatic, *lower, *upper] if slider else [*lower, prismatic, *upper]
        kind = f"P{letters[0]}{letters[1]}" if slider else f"{letters[0]}P{letters[1]}"
        legs.append(Leg(kind, screws, len(lower), place, rod, leg["actuated"], bool(slider)))
    drawn = Drawn(0, "given", legs, rods, home, {})
    drawn.poses = positions(drawn, POSES)
    return drawn


def _of_axis(axis: Array, letter: str, delta: Array) -> Array:
    return axis if letter == "R" else unit(np.cross(axis, delta))


def _screws(letter: str, axis: Array | None, normal: Array | None, at: Array) -> list[Array]:
    """From the body inwards: the axis fixed in the body, then the leg's normal."""
    axes = {"S": list(np.eye(3)), "U": [axis, normal], "R": [normal], "F": []}[letter]
    return [turning(a, at) for a in axes if a is not None]
