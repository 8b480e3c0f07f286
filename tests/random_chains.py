"""Random mechanisms of all leg kinds, and their mobility by definition: screws of all joints, closed loops.

Nothing here is shared with Polypod: a leg is the row of its joints as screws at home, a pose the product of
their exponentials, and freedoms are null vectors of the loop closures.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEED = 70011
SI = {"length": "m", "angle": "rad", "mass": "kg", "inertia": "kg m^2"}
POSES = 3
"""At which a mechanism's freedoms are counted: at a singular one a rank is less."""
RANK = 1e-7
"""Singular values below this part of the largest are zero: poses are known to 1e-12."""

FREEDOMS = {"S": 3, "U": 2, "R": 1, "F": 0}
KINDS = tuple(f"{below}P{above}" for below, above in itertools.product("SURF", repeat=2))
"""Without rods; with one, base R."""
ON_ROD = tuple(f"(R)P{above}" for above in "SURF")


def constraints_of(kind: str) -> int:
    """Of one leg with generic axes: six less its joints' freedoms. A rod's turning counts as the leg's."""
    below, above = ("U" if kind[0] == "(" else kind[0]), kind[-1]
    return max(0, 6 - (FREEDOMS[below] + 1 + FREEDOMS[above]))


@dataclass
class Leg:
    kind: str
    screws: list[Array]
    """(6,) each, velocity at the origin and turn, base axes at home; from the base up, without the rod's."""
    slide: int
    """Which of them is the prismatic joint."""
    length: float
    rod: int | None = None
    actuated: bool = True
    table: dict[str, Any] = field(default_factory=dict)


@dataclass
class Drawn:
    """A random mechanism: its joints as screws, and its file."""

    number: int
    style: str
    legs: list[Leg]
    rods: list[Array]
    """Screw of each rod's turning."""
    home: Array
    """(4, 4)."""
    data: dict[str, Any]
    poses: list[Array] = field(default_factory=list)
    """Joint values of some poses near home, with all loops closed."""

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(leg.kind for leg in self.legs)


# --- drawing ------------------------------------------------------------------------------------------------


def unit(v: Array) -> Array:
    return v / np.linalg.norm(v)


def draw(number: int) -> Drawn:
    """The mechanism of a number, the same every time.

    Its legs have points and axes in general positions, or, every second time, points on a grid and axes that
    are often parallel, which makes redundant constraints.
    """
    rng = np.random.default_rng([SEED, number])
    style = ("general", "aligned")[number % 2]
    turn = rotation(rng.normal(size=3) * 0.4) if style == "general" or rng.random() < 0.3 else np.eye(3)
    home = np.eye(4)
    home[:3, :3], home[:3, 3] = turn, np.array([0.0, 0.0, 1.0])
    if style == "general":
        home[:3, 3] += rng.normal(size=3) * 0.2
    kinds = _general_kinds(rng) if style == "general" else _aligned_kinds(rng)
    rods: list[Array] = []
    lines: list[tuple[Array, Array]] = []
    legs: list[Leg] = []
    for kind in kinds:
        on_rod = kind[0] == "("
        if on_rod and not lines:
            point, axis = _point(rng, style, 0.8), _axis(rng, style)
            lines.append((point, axis))
            rods.append(turning(axis, point))
        legs.append(_leg(rng, style, kind, home, lines[0] if on_rod else None, legs))
    data: dict[str, Any] = {"name": f"drawn {number}", "units": dict(SI)}
    data["home"] = {"position": home[:3, 3].tolist(), "rotation_vector": rotation_vector(turn).tolist()}
    data["platform"] = body(rng)
    data["rods"] = [{"name": "L", "point": p.tolist(), "axis": a.tolist()} | body(rng) for p, a in lines]
    data["legs"] = [leg.table for leg in legs]
    drawn = Drawn(number, style, legs, rods, home, data)
    drawn.poses = positions(drawn, POSES)
    _actuate(rng, drawn)
    return drawn


def _general_kinds(rng: np.random.Generator) -> list[str]:
    """Legs that leave at least one freedom, and as many legs as freedoms."""
    left, kinds = int(rng.integers(0, 6)), []
    constrained = [kind for kind in KINDS if constraints_of(kind)]
    free = [kind for kind in KINDS if not constraints_of(kind)]
    if (
        left >= 1 and rng.random() < 0.3
    ):  # a rod: its first leg as one on a U joint, one more constraint each other
        first, *others = rng.choice(ON_ROD, size=int(rng.integers(2, 4))).tolist()
        cost = constraints_of(first) + sum(constraints_of(kind) + 1 for kind in others)
        if cost <= left:
            kinds, left = [first, *others], left - cost
    while left and (fitting := [kind for kind in constrained if constraints_of(kind) <= left]):
        kinds.append(str(rng.choice(fitting)))
        left -= constraints_of(kinds[-1])
    return _filled(rng, kinds, free)


def _filled(rng: np.random.Generator, kinds: list[str], free: list[str]) -> list[str]:
    """With unconstrained legs to have one for each freedom, and sometimes more."""
    used = sum(constraints_of(kind) for kind in kinds) + max(0, sum(kind in ON_ROD for kind in kinds) - 1)
    missing = max(0, 6 - used - len(kinds)) + int(rng.random() < 0.15)
    kinds = kinds + rng.choice(free, size=missing).tolist()
    return [str(kind) for kind in rng.permutation(kinds)]


def _aligned_kinds(rng: np.random.Generator) -> list[str]:
    """One to four legs of any kinds, often several of one, and sometimes free ones beside them."""
    table = KINDS + ON_ROD
    if rng.random() < 0.4:
        kinds = [str(rng.choice(table))] * int(rng.integers(2, 5))
    else:
        kinds = rng.choice(table, size=int(rng.integers(1, 5))).tolist()
    return [
        str(kind) for kind in kinds + rng.choice(["UPS", "SPS", "SPU"], size=int(rng.integers(0, 4))).tolist()
    ]


def _point(rng: np.random.Generator, style: str, size: float) -> Array:
    if style == "aligned":
        return np.array([*(rng.integers(-2, 3, 2) * size / 2), 0.0])
    return rng.uniform(-1, 1, 3) * [size, size, 0.3 * size]


def _axis(rng: np.random.Generator, style: str) -> Array:
    return np.eye(3)[rng.integers(3)] if style == "aligned" else unit(rng.normal(size=3))


def _leg(
    rng: np.random.Generator,
    style: str,
    kind: str,
    home: Array,
    line: tuple[Array, Array] | None,
    others: list[Leg],
) -> Leg:
    """A leg whose axes fit at home: both joints give it one normal."""
    turn, o = home[:3, :3], home[:3, 3]
    while True:
        below = _point(rng, style, 0.9) if line is None else line[0] + line[1] * rng.integers(-2, 3) * 0.4
        local = _point(rng, style, 0.5)
        r = o + turn @ local - below
        length = float(np.linalg.norm(r))
        known = [leg.table["base"]["point"] + leg.table["platform"]["point"] for leg in others]
        apart = all(np.abs(np.array([*below, *local]) - other).max() > 1e-3 for other in known)
        along = 0.0 if line is None else abs(unit(r) @ line[1])
        if length > 0.4 and apart and along < 0.95:
            break
    delta = r / length
    normal = unit(np.cross(line[1], delta)) if line is not None else _normal(rng, style, delta)
    base_letter, letter = ("R" if line is not None else kind[0]), kind[-1]
    above = below + r
    base, first = _joint(rng, style, base_letter, below, delta, normal, np.eye(3), below)
    platform, last = _joint(rng, style, letter, local, delta, normal, turn, above)
    if line is not None:
        del base["axis"]
        base["rod"], first = "L", [turning(normal, below)]
    elif base_letter == "U":
        first = [first[0], turning(normal, below)]
    if letter == "U":
        last = [turning(normal, above), last[0]]
    screws = [*first, np.concatenate([delta, np.zeros(3)]), *last]
    table = {"base": base, "platform": platform}
    spins = base_letter == letter == "S"
    if rng.random() < 0.8:
        table |= {"cylinder": body(rng, spins=spins), "piston": body(rng, spins=spins)}
    return Leg(kind, screws, len(first), length, None if line is None else 0, table=table)


def _normal(rng: np.random.Generator, style: str, delta: Array) -> Array:
    square = [axis for axis in np.eye(3) if abs(axis @ delta) < 1e-12]
    if style == "aligned" and square:
        return square[rng.integers(len(square))]
    return unit(np.cross(delta, rng.normal(size=3)))


def _joint(
    rng: np.random.Generator,
    style: str,
    letter: str,
    point: Array,
    delta: Array,
    normal: Array,
    turn: Array,
    at: Array,
) -> tuple[dict[str, Any], list[Array]]:
    """The joint in its body's axes, and its screws; of a U joint the one that is fixed in the body."""
    table: dict[str, Any] = {"joint": letter, "point": point.tolist()}
    size = rng.uniform(0.2, 5.0) * rng.choice([-1.0, 1.0])
    match letter:
        case "S":
            return table, [turning(axis, at) for axis in np.eye(3)]
        case "U":
            square = [a for a in np.eye(3) if abs(a @ normal) < 1e-12 and abs(a @ delta) < 0.9]
            angle = rng.uniform(0.5, np.pi - 0.5)
            axis = np.cos(angle) * delta + np.sin(angle) * np.cross(normal, delta)
            if style == "aligned" and square:
                axis = square[rng.integers(len(square))]
        case "R":
            axis = normal
        case _:
            table["normal"] = (turn.T @ normal * size).tolist()
            axis, size = delta, abs(size)
    table["axis"] = (turn.T @ axis * size).tolist()
    return table, [] if letter == "F" else [turning(axis, at)]


def _actuate(rng: np.random.Generator, drawn: Drawn) -> None:
    """As many legs as there are freedoms, if there are as many; now and then another number."""
    dof = Mobility.of(drawn).dof
    number = dof if rng.random() < 0.9 else int(rng.integers(0, len(drawn.legs) + 1))
    chosen = rng.permutation(len(drawn.legs))[:number]
    for i, leg in enumerate(drawn.legs):
        leg.actuated = i in chosen
        leg.table["actuated"] = bool(leg.actuated)


def body(rng: np.random.Generator, *, spins: bool = False) -> dict[str, Any]:
    """A body made of points with mass; one of a leg that spins freely is symmetric about it."""
    points, masses = rng.normal(size=(5, 3)) * 0.1, rng.uniform(0.2, 1, 5)
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    center = rng.uniform(-0.1, 0.1, 3)
    if spins:
        center[[0, 2]], inertia = 0.0, np.diag([0.03, 0.01, 0.03])
    return {"mass": float(masses.sum()), "center": center.tolist(), "inertia": inertia.tolist()}


# --- screws -------------------------------------------------------------------------------------------------


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
    """Of a turn of less than half a circle."""
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    sine, cosine = float(np.linalg.norm(axis)), (np.trace(turn) - 1) / 2
    return axis * (np.arctan2(sine, cosine) / sine if sine > 1e-12 else 1.0)


def turning(axis: Array, point: Array) -> Array:
    """The screw of a turn about a line."""
    return np.concatenate([np.cross(point, axis), axis])


def skews(v: Array) -> Array:
    """(n, 3, 3) of (n, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 2, 1], out[:, 0, 2], out[:, 1, 0] = v.T
    return out - np.swapaxes(out, 1, 2)


def exponentials(screws: Array, values: Array) -> Array:
    """(n, 4, 4): displacements of joints with these screws, turns about unit axes or pure translations."""
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
    freedom more than it has: `extent` counts those that it has.
    """
    for q in drawn.poses:
        s = np.linalg.svd(closures(drawn, chains(drawn, q)[1]), compute_uv=False)
        if np.any((s > 1e-11 * s[0]) & (s < 1e-5 * s[0])):
            return False
    return True


def extent(drawn: Drawn) -> int:
    """Freedoms of the platform from the poses that it has near home: in how many directions they lie."""
    reach, moves = 0.02, []
    for q in positions(drawn, 30, reach):
        by = chains(drawn, q)[0][0]
        moves.append([*((by @ drawn.home)[:3, 3] - drawn.home[:3, 3]), *rotation_vector(by[:3, :3])])
    # Paths are bent by a fiftieth; double roots are known to 3e-7.
    return int(np.sum(np.linalg.svd(np.array(moves), compute_uv=False) > 0.1 * reach))


@dataclass(frozen=True)
class Mobility:
    """From ranks, at the poses where they are greatest."""

    dof: int
    passive: int
    closure_rank: int
    uncontrolled: int
    """Freedoms left with all actuators locked."""

    @classmethod
    def of(cls, drawn: Drawn) -> Mobility:
        found = [cls.at(drawn, q) for q in drawn.poses]
        least = (
            min(values)
            for values in zip(
                *((m.dof, m.passive, -m.closure_rank, m.uncontrolled) for m in found), strict=True
            )
        )
        dof, passive, negative, uncontrolled = least
        return cls(dof, passive, -negative, uncontrolled)

    @classmethod
    def at(cls, drawn: Drawn, q: Array) -> Mobility:
        _, joints = chains(drawn, q)
        matrix = closures(drawn, joints)
        still = joints.shape[1] - rank(joints)
        full = rank(matrix)
        locked = [column for leg, column in zip(drawn.legs, slides(drawn), strict=True) if leg.actuated]
        free = np.delete(matrix, locked, axis=1)
        loose = free.shape[1] - rank(free) - (free.shape[1] - 6 - rank(free[:, :-6]))
        return cls(matrix.shape[1] - full - still, still, full - 6, loose)


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
        base, platform = leg["base"], leg["platform"]
        below, above = np.array(base["point"]), home[:3, 3] + turn @ np.array(platform["point"])
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
        screws = [*lower, np.concatenate([delta, np.zeros(3)]), *upper]
        kind = f"{letters[0]}P{letters[1]}"
        legs.append(Leg(kind, screws, len(lower), float(np.linalg.norm(above - below)), rod, leg["actuated"]))
    drawn = Drawn(0, "given", legs, rods, home, {})
    drawn.poses = positions(drawn, POSES)
    return drawn


def _of_axis(axis: Array, letter: str, delta: Array) -> Array:
    return axis if letter == "R" else unit(np.cross(axis, delta))


def _screws(letter: str, axis: Array | None, normal: Array | None, at: Array) -> list[Array]:
    """From the body inwards: the axis fixed in the body, then the leg's normal."""
    axes = {"S": list(np.eye(3)), "U": [axis, normal], "R": [normal], "F": []}[letter]
    return [turning(a, at) for a in axes if a is not None]
