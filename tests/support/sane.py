"""Invariants of a mechanism that has been loaded, and of an error that refuses one.

Written from the page "Mechanism files" alone: keys, units, polar points and rotations are read here once
more.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator
from typing import Any

import numpy as np

import polypod as pp
from polypod import SingularityKind, Status

Tables = dict[str, Any]

# --- keys ---------------------------------------------------------------------------------------------------

BODY = {"mass", "center", "inertia"}
ENDS = {"min", "max"}
POINT, AXIS = {"radius", "angle", "z"}, {"angle", "z"}
TOP = {"name", "description", "source"}
JOINT = {"joint", "point", "axis", "normal", "rod", "cone", "range"}
KEYS: dict[tuple[str, ...], set[str]] = {
    (): TOP
    | {"units", "home", "platform", "dynamics", "load", "tool", "limits", "published", "rods", "legs"},
    ("units",): {"length", "angle", "mass", "inertia", "force", "torque", "acceleration"},
    ("home",): {"position", "rotation_vector"},
    ("platform",): BODY,
    ("dynamics",): {"gravity", "efficiency", "linear_damping", "angular_damping"},
    ("load",): {"force", "torque", "axes"},
    ("tool",): {"point", "axis"},
    ("tool", "point"): POINT,
    ("tool", "axis"): AXIS,
    ("limits",): {"sigma_min", "clearance", "joint_reach"},
    ("published",): {"dof", "redundant", "passive"},
    ("rods",): BODY | {"name", "point", "axis", "range"},
    ("rods", "point"): POINT,
    ("rods", "axis"): AXIS,
    ("rods", "range"): ENDS,
    ("legs",): {"name", "actuated", "stroke", "radius", "force", "base", "platform", "cylinder", "piston"}
    | {"slider", "carriage", "strut"},
    ("legs", "slider"): {"axis", "strut", "branch"},
    ("legs", "slider", "axis"): AXIS,
    ("legs", "carriage"): {"mass", "center"},
    ("legs", "stroke"): ENDS,
    ("legs", "force"): ENDS,
}
for link in ("cylinder", "piston", "strut"):
    KEYS["legs", link] = BODY
for side in ("base", "platform"):
    KEYS |= {("legs", side): JOINT, ("legs", side, "point"): POINT, ("legs", side, "range"): ENDS}
    KEYS |= {
        ("legs", side, "axis"): AXIS,
        ("legs", side, "normal"): AXIS,
        ("legs", side, "cone"): {"angle", "axis"},
    }
    KEYS["legs", side, "cone", "axis"] = AXIS


def unknown_keys(value: Any, path: tuple[str, ...] = ()) -> Iterator[str]:
    """Keys that the format does not have, with what they stand in."""
    if isinstance(value, dict):
        yield from (".".join((*path, str(key))) for key in value.keys() - KEYS.get(path, set()))
        for key, entry in value.items():
            yield from unknown_keys(entry, (*path, key))
    elif isinstance(value, (list, tuple)):
        for entry in value:
            yield from unknown_keys(entry, path)


# --- numbers in SI ------------------------------------------------------------------------------------------

SIZES = {
    **{"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254, "rad": 1.0, "deg": math.pi / 180},
    **{"kg": 1.0, "g": 1e-3, "lb": 0.45359237, "kg m^2": 1.0, "kg mm^2": 1e-6, "g mm^2": 1e-9},
    **{"N": 1.0, "kN": 1e3, "mN": 1e-3, "N m": 1.0, "N mm": 1e-3, "kN m": 1e3, "m/s^2": 1.0, "mm/s^2": 1e-3},
}


def expected(data: Tables) -> Tables:
    """Expected `mech.geometry`, from the content of a file."""
    units = {kind: SIZES[unit] for kind, unit in data.get("units", {}).items()}

    def si(value: Any, kind: str) -> Any:
        return None if value is None else np.asarray(value, dtype=float) * units[kind]

    def turned(angle: float) -> np.ndarray:
        return np.array([math.cos(angle * units["angle"]), math.sin(angle * units["angle"])])

    def point(value: Any) -> Any:
        if isinstance(value, dict):
            xy = value["radius"] * turned(value["angle"])
            return np.array([*xy, value.get("z", 0.0)]) * units["length"]
        return si(value, "length")

    def axis(value: Any) -> Any:
        return np.array([*turned(value["angle"]), value.get("z", 0.0)]) if isinstance(value, dict) else value

    def ends(value: Any, kind: str) -> Any:
        return None if value is None else si([value["min"], value["max"]], kind)

    def body(value: Any, sign: float = 0.0) -> Any:
        if value is None:
            return None
        center, inertia = value["center"], np.asarray(value["inertia"], dtype=float)
        inertia = inertia if inertia.ndim == 2 else np.diag(np.broadcast_to(inertia, 3))
        center = [0.0, sign * center, 0.0] if isinstance(center, (int, float)) else center
        return {
            "mass": si(value["mass"], "mass"),
            "center": si(center, "length"),
            "inertia": si(inertia, "inertia"),
        }

    names = [rod["name"] for rod in data.get("rods", [])]

    def joint(value: Any) -> Tables:
        cone = value.get("cone")
        return {
            "joint": value["joint"],
            "point": point(value["point"]),
            "axis": axis(value.get("axis")),
            "normal": axis(value.get("normal")),
            "rod": None if value.get("rod") is None else names.index(value["rod"]),
            "cone": cone and {"angle": si(cone["angle"], "angle"), "axis": axis(cone.get("axis"))},
            "range": ends(value.get("range"), "angle"),
        }

    def slider(value: Any, carriage: Any) -> Any:
        if value is None:
            return None
        if carriage is not None:
            center = si(carriage.get("center", [0.0, 0.0, 0.0]), "length")
            carriage = {"mass": si(carriage["mass"], "mass"), "center": center}
        rail = {"axis": axis(value["axis"]), "strut": si(value["strut"], "length")}
        return rail | {"branch": value["branch"], "carriage": carriage}

    def leg(number: int, value: Any) -> Tables:
        upper = "piston" if value.get("slider") is None else "strut"
        return {
            "name": str(number) if value.get("name") is None else value["name"],
            "actuated": value.get("actuated", True),
            "slider": slider(value.get("slider"), value.get("carriage")),
            "stroke": ends(value.get("stroke"), "length"),
            "radius": si(value.get("radius"), "length"),
            "force": ends(value.get("force"), "force"),
            "base": joint(value["base"]),
            "platform": joint(value["platform"]),
            "cylinder": body(value.get("cylinder"), +1.0),
            "piston": body(value.get(upper), -1.0),
        }

    def rod(value: Any) -> Tables:
        own = {"name": value["name"], "point": point(value["point"]), "axis": axis(value["axis"])}
        return own | {
            "body": body(value) if "mass" in value else None,
            "range": ends(value.get("range"), "angle"),
        }

    dynamics, load, tool = (data.get(key, {}) for key in ("dynamics", "load", "tool"))
    limits, home = data.get("limits", {}), data["home"]
    gravity = dynamics.get("gravity")
    rotation, force, torque = home.get("rotation_vector"), load.get("force"), load.get("torque")
    return {
        "name": data["name"],
        "platform": body(data.get("platform")),
        "rods": [rod(value) for value in data.get("rods", [])],
        "legs": [leg(i, value) for i, value in enumerate(data["legs"], 1)],
        "gravity": [0.0, 0.0, -9.81] if gravity is None else si(gravity, "acceleration"),
        "efficiency": dynamics.get("efficiency", 1.0),
        "linear_damping": dynamics.get("linear_damping", 0.0),
        "angular_damping": dynamics.get("angular_damping", 0.0),
        "load": {
            "force": np.zeros(3) if force is None else si(force, "force"),
            "torque": np.zeros(3) if torque is None else si(torque, "torque"),
            "axes": load.get("axes", "base"),
        },
        "home": {
            "position": si(home["position"], "length"),
            "rotation_vector": np.zeros(3) if rotation is None else si(rotation, "angle"),
        },
        "tool": {
            "point": point(tool.get("point", [0.0] * 3)) if tool.get("point") else np.zeros(3),
            "axis": axis(tool.get("axis", [0.0, 0.0, 1.0])),
        },
        "limits": {
            "sigma_min": limits.get("sigma_min"),
            "clearance": si(limits.get("clearance"), "length"),
            "joint_reach": si(limits.get("joint_reach"), "length"),
        },
    }


def different(found: Any, wanted: Any, place: str = "") -> Iterator[str]:
    """Places where `found` is not `wanted`, numbers to rounding."""
    if isinstance(wanted, dict):
        if not isinstance(found, dict) or not wanted.keys() <= found.keys():
            yield place
            return
        for key, value in wanted.items():
            yield from different(found[key], value, f"{place}.{key}")
    elif isinstance(wanted, list) and wanted and isinstance(wanted[0], dict):
        if len(found) != len(wanted):
            yield place
            return
        for i, value in enumerate(wanted):
            yield from different(found[i], value, f"{place}.{i + 1}")
    elif wanted is None or isinstance(wanted, (str, bool)):
        if found != wanted or type(found) is not type(wanted):
            yield place
    else:
        a, b = (np.asarray(value, dtype=float) for value in (found, wanted))
        if a.shape != b.shape or not (np.abs(a - b) <= 1e-14 * max(1e-300, np.abs(b).max(initial=0.0))).all():
            yield f"{place}: {found} for {wanted}"


# --- a mechanism --------------------------------------------------------------------------------------------


def numbers(value: Any) -> Iterator[float]:
    """All numbers in nested lists and tables."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, (list, tuple, np.ndarray)):
        for entry in value:
            yield from numbers(entry)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield value


def rotation(vector: Any) -> np.ndarray:
    """Rodrigues' formula."""
    vector = np.asarray(vector, dtype=float)
    angle = math.sqrt(float(vector @ vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k


BEYOND_LIMITS = (Status.OUT_OF_STROKE, Status.OUT_OF_CONE, Status.OUT_OF_ANGLE)
"""Said of the home pose by its status and by a warning: numbers stand."""


def present(value: Any) -> Any:
    """Without entries that are None, which a dictionary may have in place of no entry."""
    if isinstance(value, dict):
        return {key: present(entry) for key, entry in value.items() if entry is not None}
    return [present(entry) for entry in value] if isinstance(value, list) else value


def nonsense(mech: pp.Mechanism, data: Tables) -> list[str]:
    """Faults of a mechanism that was loaded from `data`."""
    data = present(data)
    wrong = [f"unknown key {key}" for key in unknown_keys(data)]
    wrong += [f"number {n} in the file" for n in numbers(data) if not math.isfinite(n)]
    if wrong:
        return wrong
    facts = expected(data)
    wrong += [f"not as in the file: {place}" for place in different(mech.geometry, facts)]
    wrong += _bodies(facts) + _ranges(facts) + _home(mech, facts) + _answers(mech)
    mobility = mech.mobility()
    felt = mech.dof - len(mobility.idle)
    if not (mech.dof == mobility.dof and felt <= int(mech.actuated.sum()) and 1 <= mech.dof <= 6):
        wrong.append(f"{mech.dof} degrees of freedom, {mech.actuated.sum()} actuators")
    if len(set(mech.leg_names)) < mech.n_legs or not all(mech.leg_names) or not mech.name.strip():
        wrong.append(f"names {mech.name!r} {mech.leg_names}")
    text = mech.to_toml()
    if pp.Mechanism.from_toml(text) != mech:
        wrong.append("another one when written and read")
    return wrong


def _bodies(facts: Tables) -> list[str]:
    links = [leg[link] for leg in facts["legs"] for link in ("cylinder", "piston")]
    wrong = []
    for body in [facts["platform"], *links, *(rod["body"] for rod in facts["rods"])]:
        if body is None:
            continue
        inertia = body["inertia"]
        moments = np.linalg.eigvalsh(inertia)
        scale = abs(inertia).max()
        if not body["mass"] > 0.0:
            wrong.append(f"mass {body['mass']}")
        if abs(inertia - inertia.T).max() > 1e-8 * scale:
            wrong.append("inertia is not symmetric")
        if not (moments[0] > 0.0 and moments[0] + moments[1] >= moments[2] * (1 - 1e-8)):
            wrong.append(f"moments of inertia {moments}")
    return wrong


def _ranges(facts: Tables) -> list[str]:
    joints = [leg[side] for leg in facts["legs"] for side in ("base", "platform")]
    pairs = [leg[key] for leg in facts["legs"] for key in ("stroke", "force")]
    pairs += [part["range"] for part in (*joints, *facts["rods"])]
    wrong = [f"range {pair}" for pair in pairs if pair is not None and not pair[0] < pair[1]]
    wrong += [f"cone {j['cone']}" for j in joints if j["cone"] and not 0.0 < j["cone"]["angle"] <= math.pi]
    wrong += [
        f"radius {leg['radius']}"
        for leg in facts["legs"]
        if leg["radius"] is not None and not leg["radius"] > 0
    ]
    wrong += [
        f"stroke {leg['stroke']}"
        for leg in facts["legs"]
        if leg["stroke"] is not None and leg["stroke"][0] < 0 and leg["slider"] is None
    ]
    rails = [leg["slider"] for leg in facts["legs"] if leg["slider"] is not None]
    wrong += [f"rail {rail}" for rail in rails if not (rail["strut"] > 0.0 and abs(rail["branch"]) == 1.0)]
    masses = [rail["carriage"]["mass"] for rail in rails if rail["carriage"] is not None]
    wrong += [f"carriage of {mass} kg" for mass in masses if not mass > 0.0]
    if not (
        0.0 < facts["efficiency"] <= 1.0
        and facts["linear_damping"] >= 0.0
        and facts["angular_damping"] >= 0.0
    ):
        wrong.append("efficiency or damping")
    return wrong


def _home(mech: pp.Mechanism, facts: Tables) -> list[str]:
    """The pose is the file's, legs have the lengths between its points, joints take them."""
    turn, o = rotation(facts["home"]["rotation_vector"]), facts["home"]["position"]
    wrong, size = [], mech.characteristic_length
    if not (np.isfinite(mech.home).all() and abs(mech.home[:3, :3] - turn).max() < 1e-12):
        wrong.append("home is not rotated as in the file")
    ends = [(leg["base"]["point"], o + turn @ leg["platform"]["point"]) for leg in facts["legs"]]
    vectors = np.array([b - a for a, b in ends])
    lengths = np.linalg.norm(vectors, axis=1)
    coordinates = lengths.copy()
    for i, leg in enumerate(facts["legs"]):
        if leg["slider"] is not None:
            coordinates[i], vectors[i] = on_rail(leg["slider"], vectors[i])
            lengths[i] = leg["slider"]["strut"]
    found = mech.inverse_kinematics(mech.home)
    if int(found.status) not in (Status.OK, *BEYOND_LIMITS):
        wrong.append(f"home has status {Status(int(found.status)).name}")
    elif int(found.status) in BEYOND_LIMITS and not any("beyond a limit" in note for note in mech.warnings):
        wrong.append("home is beyond a limit without a warning")
    if not (np.isfinite(size) and size > 0.0 and (lengths > 1e-9 * size).all()):
        wrong.append(f"lengths {lengths} of size {size}")
    # Where a strut is nearly perpendicular to its rail the place goes by a root.
    slack = 1e-12 if all(leg["slider"] is None for leg in facts["legs"]) else 1e-8
    if not abs(found.lengths - coordinates).max() <= slack * (abs(np.array(ends)).max() + abs(o).max()):
        wrong.append(f"lengths {found.lengths} for {coordinates}")
    rods = facts["rods"]
    for leg, vector, length in zip(facts["legs"], vectors, lengths, strict=True):
        wrong += _joints(leg, vector / length, turn, rods)
    return wrong


def on_rail(slider: Tables, vector: np.ndarray) -> tuple[float, np.ndarray]:
    """Where on its rail the carriage is, and the strut: of two places the one on the side of the branch."""
    axis = np.asarray(slider["axis"], dtype=float)
    axis = axis / np.linalg.norm(axis)
    along = float(axis @ vector)
    half = np.sqrt(along**2 - (vector @ vector - slider["strut"] ** 2))
    roots = [along - half, along + half]
    place = next(q for q in roots if (vector - q * axis) @ axis * slider["branch"] >= 0.0)
    return place, vector - place * axis


def _joints(leg: Tables, along: np.ndarray, turn: np.ndarray, rods: list[Tables]) -> list[str]:
    """The table of the page: how axes stand to the leg, and the leg's two normals to each other."""
    wrong, normals = [], []
    for side, body in (("base", np.eye(3)), ("platform", turn)):
        joint, kind = leg[side], leg[side]["joint"]
        on_rod = joint["rod"] is not None
        axis = rods[joint["rod"]]["axis"] if on_rod else joint["axis"]
        if kind == "S":
            continue
        axis = body @ np.asarray(axis, dtype=float)
        axis = axis / np.linalg.norm(axis)
        if kind == "U" or on_rod:
            normal = np.cross(axis, along)
            if np.linalg.norm(normal) < 0.9e-6:
                wrong.append("an axis along its leg")
            normals.append((normal / np.linalg.norm(normal), axis))
        elif kind == "R":
            wrong += ["an R joint that is not perpendicular to its leg"] if abs(axis @ along) > 1.1e-6 else []
            normals.append((axis, None))
        else:
            normal = body @ np.asarray(joint["normal"], dtype=float)
            wrong += ["an F joint that is not along its leg"] if not axis @ along > 0.999999 else []
            normals.append((normal / np.linalg.norm(normal), None))
    if len(normals) == 2:
        # Where both are U joints near the leg's line, the home tolerance is one of distances.
        (n, u), (m, w) = normals
        slack = (
            1e-5 / min(np.linalg.norm(np.cross(a, along)) for a in (u, w) if a is not None)
            if u is not None or w is not None
            else 1e-5
        )
        if np.linalg.norm(np.cross(n, m)) > slack:
            wrong.append(
                f"the two normals of leg {leg['name']} are not one: {np.linalg.norm(np.cross(n, m)):.2g}"
            )
    return wrong


def _answers(mech: pp.Mechanism) -> list[str]:
    """Faults of the first answers at home, which must be numbers."""
    wrong = []
    if not all(isinstance(note, str) and note for note in mech.warnings):
        wrong.append("an empty warning")
    uncontrolled = mech.mobility().uncontrolled
    sigma = mech.conditioning(mech.home)
    found = mech.inverse_dynamics(mech.home, np.zeros(6), np.zeros(6))
    status = Status(int(found.status))
    if not np.isfinite([sigma.sigma_min, sigma.sigma_max]).all():
        wrong.append(f"singular values {sigma.sigma_min} {sigma.sigma_max}")
    if status in (Status.OK, *BEYOND_LIMITS):
        wrong += [] if np.isfinite(found.forces).all() else ["forces are no numbers"]
        # Next to a singular pose there are forces; a warning then says so.
        if sigma.sigma_min < 1e-15 * sigma.sigma_max and not any("singular at" in n for n in mech.warnings):
            wrong.append(f"forces where the least singular value is {sigma.sigma_min}")
    elif status is not Status.SINGULAR:
        wrong.append(f"inverse dynamics at home has status {status.name}")
    elif not uncontrolled and mech.singularity(mech.home).kind == SingularityKind.NONE:
        wrong.append(f"singular with least singular value {sigma.sigma_min}")
    return wrong


# --- an error -----------------------------------------------------------------------------------------------


def text_of(content: bytes) -> str:
    """As a file is read: with any line ends, with a mark of its encoding or without."""
    if content in (b"\xef", b"\xef\xbb"):
        return ""  # the beginning of that mark
    text = content.decode("utf-8-sig", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


WHOLE = ("toml", "file", "mechanism")
"""Places that mean the file itself."""


def vague(error: pp.MechanismError, content: bytes | str | Tables) -> list[str]:
    """Faults of an error: without a place in the file, without words, without their line."""
    text = text_of(content) if isinstance(content, bytes) else content
    data = text
    if isinstance(text, str):
        try:
            data = tomllib.loads(text)
        except (ValueError, RecursionError):
            data = None
    wrong = [] if error.faults else ["no fault"]
    if len(set(error.faults)) < len(error.faults):
        wrong.append("a fault twice")
    known = {} if data is None else dict(places(data))
    lines = text.split("\n") if isinstance(text, str) else []
    for fault in error.faults:
        wrong += [f"{problem}: {str(fault)[:200]}" for problem in _vague(fault, lines, data, known)]
    if len(str(error)) > 400 * (len(error.faults) + 1):
        wrong.append(f"{len(str(error))} characters for {len(error.faults)} faults")
    return wrong


def _vague(
    fault: Any, lines: list[str], data: Tables | None, known: dict[str, tuple[Any, ...]]
) -> Iterator[str]:
    texts = any(quote in text for quote in ("'''", '"""') for text in lines)
    message, line = fault.message, lines[fault.line - 1] if 1 <= (fault.line or 0) <= len(lines) else None
    if not message.strip() or not message.isprintable() or "Traceback" in message or "pydantic" in message:
        yield "no message"
    if not fault.place.strip() or not fault.place.isprintable():
        yield "no place"
    if data is None:
        if fault.place not in WHOLE:
            yield "a place in a text that cannot be read"
        if lines and "UTF-8" not in message and line is None:
            yield "no line"
        return
    path = known.get(fault.place)
    holder = fault.place.rpartition(".")[0]
    absent = any(word in message for word in ("is missing", "there is none"))
    top = fault.place.partition(".")[0]
    if (
        path is None
        and fault.place not in WHOLE
        and not (absent and (top == "units" or holder in known or not holder))
    ):
        yield "no such place"
    if not lines or fault.place in WHOLE or top not in data:
        return
    last = [key for key in (path or known.get(holder) or (top,)) if isinstance(key, str)][-1]
    if line is None:
        yield "no line"
    elif last not in line and json.dumps(last)[1:-1] not in line and not line.endswith("["):
        yield f"line {fault.line} says {line!r}"
    elif (number := re.match(rf"{top}\.(\d+)", fault.place)) and f"[[{top}]]" in lines and not texts:
        # The one table among those of its array; texts of several lines may hold what looks like one.
        headers = [text.partition("#")[0].strip() for text in lines[: fault.line]]
        before = headers.count(f"[[{top}]]")
        if before != int(number[1]):
            yield f"line {fault.line} is in {top}.{before}"


def places(value: Any, place: str = "", path: tuple[Any, ...] = ()) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """All places of a file's content, such as `legs.3.base`, with the keys on the way."""
    entries = (
        value.items() if isinstance(value, dict) else enumerate(value, 1) if isinstance(value, list) else ()
    )
    for key, entry in entries:
        word = (
            str(key)
            if re.fullmatch(r"[\w-]+", str(key), re.ASCII)
            else json.dumps(key, ensure_ascii=not key.isprintable())
        )
        at = f"{place}.{word}" if place else word
        yield at, (*path, key)
        yield from places(entry, at, (*path, key))
        if not place and key in ("legs", "rods") and isinstance(entry, dict):
            yield from places([entry], at, (*path, key))  # one table in place of a list is its first
