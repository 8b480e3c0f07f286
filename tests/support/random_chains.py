"""Random mechanisms of all leg kinds: files, with the screws that they are drawn from.

Those of the first numbers have telescopic legs in general positions, or, every second one, points on a grid
and axes that are often parallel, which makes redundant constraints. Later ones, in both ways, have legs on
sliders too, more actuators than degrees of freedom, or local degrees of freedom.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from support.random_screws import (
    POSES,
    SEED,
    SI,
    Array,
    Drawn,
    Leg,
    Mobility,
    positions,
    rotation,
    rotation_vector,
    turning,
    unit,
)

TELESCOPIC = 10_000
"""From this number on, the other styles."""
STYLES = ("rails", "aligned rails", "redundant", "idle")
FREEDOMS = {"S": 3, "U": 2, "R": 1, "F": 0}
KINDS = tuple(f"{below}P{above}" for below, above in itertools.product("SURF", repeat=2))
"""Without rods; with one, base R."""
ON_ROD = tuple(f"(R)P{above}" for above in "SURF")
ON_RAIL = ("PUS", "PSS", "PSU", "PRS", "PRU", "PUU")
FREE = ("UPS", "SPS", "SPU", "PUS", "PSS", "PSU")
"""Without constraints."""
TRIES = 2_000
"""To place a leg."""
FAULTY = 0.03
"""Share of sliders that must be refused."""
FAULTS = ("base.axis", "base.joint", "platform.joint", "slider.strut")


def letters(kind: str) -> tuple[str, str]:
    """Joints of a leg, below and above. A rod's rotation counts as the leg's."""
    return "U" if kind[0] == "(" else kind.replace("P", "", 1)[0], kind[-1]


def constraints_of(kind: str) -> int:
    """Of one leg with generic axes: six less its joints' degrees of freedom."""
    below, above = letters(kind)
    return max(0, 6 - (FREEDOMS[below] + 1 + FREEDOMS[above]))


@dataclass(frozen=True)
class Lines:
    """Where points must lie: a point and a unit direction each, of the platform in its axes."""

    base: tuple[Array, Array] | None = None
    platform: tuple[Array, Array] | None = None
    """Without a direction, of length zero, all joints are at the point."""


# --- mechanisms ---------------------------------------------------------------------------------------------


class NoRoom(Exception):
    """A leg finds no place: a rod that goes through the point where all legs end, say."""


def draw(number: int) -> Drawn:
    """The mechanism of a number, the same every time."""
    for again in itertools.count():
        try:
            return _draw(number, np.random.default_rng([SEED, number, *[2] * again]))
        except NoRoom:
            continue
    raise AssertionError


def _draw(number: int, rng: np.random.Generator) -> Drawn:
    if number < TELESCOPIC:
        style = name = ("general", "aligned")[number % 2]
    else:
        name = STYLES[number % len(STYLES)]
        style = {"rails": "general", "aligned rails": "aligned"}.get(name, "")
        style = style or ("general", "aligned")[int(rng.random() < 0.4)]
    turn = rotation(rng.normal(size=3) * 0.4) if style == "general" or rng.random() < 0.3 else np.eye(3)
    home = np.eye(4)
    home[:3, :3], home[:3, 3] = turn, np.array([0.0, 0.0, 1.0])
    if style == "general":
        home[:3, 3] += rng.normal(size=3) * 0.2
    lines = _lines(rng, style) if name == "idle" else Lines()
    kinds = _kinds(rng, name, lines)
    rod, legs = lines.base, []
    for kind in kinds:
        on_rod = kind[0] == "("
        if on_rod and rod is None:
            rod = _point(rng, style, 0.8), _axis(rng, style)
        own = Lines(rod if on_rod else lines.base, lines.platform)
        legs.append((_slider if kind[0] == "P" else _leg)(rng, style, kind, home, own, legs))
    rods = [rod] if rod is not None and any(kind[0] == "(" for kind in kinds) else []
    data: dict[str, Any] = {"name": f"drawn {number}", "units": dict(SI)}
    data["home"] = {"position": home[:3, 3].tolist(), "rotation_vector": rotation_vector(turn).tolist()}
    data["platform"] = body(rng)
    data["rods"] = [{"name": "L", "point": p.tolist(), "axis": a.tolist()} | body(rng) for p, a in rods]
    data["legs"] = [leg.table for leg in legs]
    drawn = Drawn(number, name, legs, [turning(a, p) for p, a in rods], home, data)
    if not drawn.faults:
        drawn.poses = positions(drawn, POSES)
        _actuate(rng, drawn)
    return drawn


def _kinds(rng: np.random.Generator, name: str, lines: Lines) -> list[str]:
    """Of the legs in a style."""
    rails = KINDS + 3 * ON_RAIL
    match name:
        case "general":
            return _general_kinds(rng, KINDS, ON_ROD)
        case "aligned":
            return _aligned_kinds(rng, KINDS + ON_ROD, ["UPS", "SPS", "SPU"])
        case "rails":
            return _general_kinds(rng, rails, ON_ROD)
        case "aligned rails":
            return _aligned_kinds(rng, rails, ["UPS", *ON_RAIL[:3]])
        case "redundant":
            kinds = _general_kinds(rng, rails, ON_ROD)
            return [*kinds, *map(str, rng.choice(FREE, size=int(rng.integers(1, 4))))]
    # Above, S alone lets the platform spin about the line; below, also what has its axis there.
    table = rails if rng.random() < 0.5 else KINDS
    fitting = [kind for kind in table if kind[-1] == "S" or lines.platform is None]
    if lines.base is not None:
        fitting = [kind for kind in fitting if letters(kind)[0] in "SU"]
    on_rod = tuple(kind for kind in ON_ROD if kind[-1] == "S" or lines.platform is None)
    kinds = _general_kinds(rng, tuple(fitting), on_rod)
    # One leg fewer holds all the rest.
    return kinds[1:] if len(kinds) > 2 and rng.random() < 0.7 else kinds


def _general_kinds(rng: np.random.Generator, table: tuple[str, ...], on_rod: tuple[str, ...]) -> list[str]:
    """Legs that leave at least one degree of freedom, and as many legs as degrees of freedom."""
    left, kinds = int(rng.integers(0, 6)), []
    constrained = [kind for kind in table if constraints_of(kind)]
    free = [kind for kind in table if not constraints_of(kind)]
    if (
        left >= 1 and rng.random() < 0.3
    ):  # a rod: its first leg as one on a U joint, one more constraint each other
        first, *others = rng.choice(on_rod, size=int(rng.integers(2, 4))).tolist()
        cost = constraints_of(first) + sum(constraints_of(kind) + 1 for kind in others)
        if cost <= left:
            kinds, left = [first, *others], left - cost
    while left and (fitting := [kind for kind in constrained if constraints_of(kind) <= left]):
        kinds.append(str(rng.choice(fitting)))
        left -= constraints_of(kinds[-1])
    return _filled(rng, kinds, free)


def _filled(rng: np.random.Generator, kinds: list[str], free: list[str]) -> list[str]:
    """With unconstrained legs to have one for each degree of freedom, and sometimes more."""
    used = sum(constraints_of(kind) for kind in kinds) + max(0, sum(kind in ON_ROD for kind in kinds) - 1)
    missing = max(0, 6 - used - len(kinds)) + int(rng.random() < 0.15)
    kinds = kinds + rng.choice(free, size=missing).tolist()
    return [str(kind) for kind in rng.permutation(kinds)]


def _aligned_kinds(rng: np.random.Generator, table: tuple[str, ...], free: list[str]) -> list[str]:
    """One to four legs of any kinds, often several of one, and sometimes free ones beside them."""
    if rng.random() < 0.4:
        kinds = [str(rng.choice(table))] * int(rng.integers(2, 5))
    else:
        kinds = rng.choice(table, size=int(rng.integers(1, 5))).tolist()
    return [str(kind) for kind in kinds + rng.choice(free, size=int(rng.integers(0, 4))).tolist()]


def _lines(rng: np.random.Generator, style: str) -> Lines:
    """A line for all joints above, or below, or one each; or a point above."""
    # The line below is rather level: legs must not lie along it.
    level = np.eye(3)[rng.integers(2)] if style == "aligned" else unit(rng.normal(size=3) * [1.0, 1.0, 0.2])
    below, above = (_point(rng, style, 0.5), level), (_point(rng, style, 0.3), _axis(rng, style))
    match rng.choice(["above", "below", "both", "point"], p=[0.4, 0.35, 0.15, 0.1]):
        case "above":
            return Lines(platform=above)
        case "below":
            return Lines(base=below)
        case "both":
            return Lines(below, above)
    return Lines(platform=(above[0], np.zeros(3)))


def _actuate(rng: np.random.Generator, drawn: Drawn) -> None:
    """As many legs as degrees of freedom that need one, if there are as many; now and then another number."""
    own = Mobility.of(drawn)
    number = own.dof
    if drawn.number >= TELESCOPIC:
        number += int(rng.integers(1, 4)) if drawn.style == "redundant" else -own.idle
    if rng.random() >= 0.9:
        number = int(rng.integers(0, len(drawn.legs) + 1))
    chosen = rng.permutation(len(drawn.legs))[:number]
    for i, leg in enumerate(drawn.legs):
        leg.actuated = i in chosen
        leg.table["actuated"] = bool(leg.actuated)


# --- legs ---------------------------------------------------------------------------------------------------


def _point(rng: np.random.Generator, style: str, size: float) -> Array:
    if style == "aligned":
        return np.array([*(rng.integers(-2, 3, 2) * size / 2), 0.0])
    return rng.uniform(-1, 1, 3) * [size, size, 0.3 * size]


def _axis(rng: np.random.Generator, style: str) -> Array:
    return np.eye(3)[rng.integers(3)] if style == "aligned" else unit(rng.normal(size=3))


def _on(rng: np.random.Generator, style: str, size: float, line: tuple[Array, Array] | None) -> Array:
    """A point of a line, or anywhere."""
    return _point(rng, style, size) if line is None else line[0] + line[1] * rng.integers(-2, 3) * 0.4


def _apart(base: Array, platform: Array, others: list[Leg]) -> bool:
    """Whether no other leg has these points."""
    known = [leg.table["base"]["point"] + leg.table["platform"]["point"] for leg in others]
    return all(np.abs(np.array([*base, *platform]) - other).max() > 1e-3 for other in known)


def _leg(
    rng: np.random.Generator, style: str, kind: str, home: Array, lines: Lines, others: list[Leg]
) -> Leg:
    """A leg whose axes fit at home: both joints give it one normal."""
    turn, o = home[:3, :3], home[:3, 3]
    line = lines.base
    for _ in range(TRIES):
        below = _on(rng, style, 0.9, line)
        local = _on(rng, style, 0.5, lines.platform)
        r = o + turn @ local - below
        length = float(np.linalg.norm(r))
        lean = 0.0 if line is None else abs(unit(r) @ line[1])
        if length > 0.4 and _apart(below, local, others) and lean < 0.95:
            break
    else:
        raise NoRoom
    delta = r / length
    on_rod = kind[0] == "("
    base_letter, letter = ("R" if on_rod else kind[0]), kind[-1]
    along = line[1] if line is not None and base_letter != "S" else None
    normal = unit(np.cross(along, delta)) if along is not None else _normal(rng, style, delta)
    base, lower = _joint(rng, style, base_letter, below, delta, normal, np.eye(3), below, along)
    platform, upper = _joint(rng, style, letter, local, delta, normal, turn, below + r)
    if on_rod:
        del base["axis"]
        base["rod"] = "L"
    screws = [*lower, np.concatenate([delta, np.zeros(3)]), *_inwards(letter, upper)]
    table = {"base": base, "platform": platform}
    spins = base_letter == letter == "S"
    if rng.random() < 0.8:
        table |= {"cylinder": body(rng, spins=spins), "piston": body(rng, spins=spins)}
    return Leg(kind, screws, len(lower), length, 0 if on_rod else None, table=table)


def _slider(
    rng: np.random.Generator, style: str, kind: str, home: Array, lines: Lines, others: list[Leg]
) -> Leg:
    """A leg on a rail, which is the line below if there is one."""
    turn, o = home[:3, :3], home[:3, 3]
    _, base_letter, letter = kind
    for _ in range(TRIES):
        foot, local = _on(rng, style, 0.9, lines.base), _on(rng, style, 0.5, lines.platform)
        rail = _axis(rng, style) if lines.base is None else lines.base[1]
        place = float(rng.choice([-0.5, 0.0, 0.5]) if style == "aligned" else rng.uniform(-0.5, 0.5))
        r = o + turn @ local - foot
        length = float(np.linalg.norm(r))
        lean, across = unit(r) @ rail, float(np.linalg.norm(np.cross(unit(r), rail)))
        if length > 0.4 and abs(lean) > 0.1 and across > 0.3 and _apart(foot - place * rail, local, others):
            break
    else:
        raise NoRoom
    delta, square = r / length, unit(np.cross(rail, r))
    fault = str(rng.choice(FAULTS)) if rng.random() < FAULTY else None
    if fault == "base.axis" and kind not in ("PRS", "PRU", "PUU"):
        fault = None
    base_letter = "F" if fault == "base.joint" else base_letter
    letter = str(rng.choice(["R", "F"])) if fault == "platform.joint" else letter
    held = base_letter == "R" or (base_letter == "U" and (letter == "U" or lines.base is not None))
    held &= fault != "base.axis"
    normal = square if held else rotation(delta * rng.uniform(0.3, 2.8)) @ square
    base, lower = _joint(
        rng, style, base_letter, foot, delta, normal, np.eye(3), foot, rail if held else None
    )
    platform, upper = _joint(rng, style, letter, local, delta, normal, turn, foot + r)
    base["point"] = (foot - place * rail).tolist()
    branch = 1.0 if lean > 0.0 else -1.0
    strut = 0.95 * across * length if fault == "slider.strut" else length
    table = {"base": base, "platform": platform}
    table["slider"] = {"axis": (rail * rng.uniform(0.2, 5.0)).tolist(), "strut": strut, "branch": branch}
    if rng.random() < 0.8:
        table["strut"] = body(rng, spins=base_letter == letter == "S")
        table["carriage"] = {"mass": float(rng.uniform(0.5, 3.0)), "center": rng.normal(size=3).tolist()}
    screws = [np.concatenate([rail, np.zeros(3)]), *lower, *_inwards(letter, upper)]
    return Leg(kind, screws, len(lower), place, slider=True, fault=fault, table=table)


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
    along: Array | None = None,
) -> tuple[dict[str, Any], list[Array]]:
    """The joint in its body's axes, and its screws from the body on; a U joint may have its axis given."""
    table: dict[str, Any] = {"joint": letter, "point": point.tolist()}
    size = rng.uniform(0.2, 5.0) * rng.choice([-1.0, 1.0])
    match letter:
        case "S":
            return table, [turning(axis, at) for axis in np.eye(3)]
        case "U":
            square = [a for a in np.eye(3) if abs(a @ normal) < 1e-12 and abs(a @ delta) < 0.9]
            angle = rng.uniform(0.5, np.pi - 0.5)
            axis = np.cos(angle) * delta + np.sin(angle) * np.cross(normal, delta)
            if along is not None:
                axis = along
            elif style == "aligned" and square:
                axis = square[rng.integers(len(square))]
        case "R":
            axis = normal
        case _:
            table["normal"] = (turn.T @ normal * size).tolist()
            axis, size = delta, abs(size)
    table["axis"] = (turn.T @ axis * size).tolist()
    screws = {"U": [turning(axis, at), turning(normal, at)], "R": [turning(axis, at)], "F": []}
    return table, screws[letter]


def _inwards(letter: str, screws: list[Array]) -> list[Array]:
    """From the leg to the body."""
    return screws[::-1] if letter == "U" else screws


def body(rng: np.random.Generator, *, spins: bool = False) -> dict[str, Any]:
    """A body made of points with mass; one of a leg that spins freely is symmetric about it."""
    points, masses = rng.normal(size=(5, 3)) * 0.1, rng.uniform(0.2, 1, 5)
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    center = rng.uniform(-0.1, 0.1, 3)
    if spins:
        center[[0, 2]], inertia = 0.0, np.diag([0.03, 0.01, 0.03])
    return {"mass": float(masses.sum()), "center": center.tolist(), "inertia": inertia.tolist()}
