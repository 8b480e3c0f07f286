"""From the content of a mechanism file to the SI description that the core works on.

Here the form is checked: types, keys, units, names. What the numbers mean (a negative mass, an axis along
its leg) the core checks, on all parts that could be read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from polypod.errors import Fault, alternatives, place_of, shown
from polypod.files.mechanism_schema import (
    Body,
    Dynamics,
    Header,
    Home,
    Joint,
    Leg,
    Limits,
    Link,
    Load,
    PolarAxis,
    PolarPoint,
    Published,
    Range,
    Rod,
    Tool,
)
from polypod.files.tables import read_table
from polypod.files.units import MECHANISM_KINDS, Units, cos_sin, from_si, read_units
from polypod.legs.drives import DRIVES, KEYED, LINK_PLACE, TELESCOPE
from polypod.legs.joints import CARRIED, JOINTS

STANDARD_GRAVITY = (0.0, 0.0, -9.81)
"""m/s^2 in base axes, where the file gives none."""

SECTIONS = ("units", "dynamics", "load", "home", "tool", "limits", "published", "platform", "rods", "legs")

# Which kind of quantity stands under a key, wherever in the file.
KIND_OF_KEY = {
    **dict.fromkeys(("point", "radius", "position", "center", "stroke", "strut"), "length"),
    **dict.fromkeys(("clearance", "joint_reach"), "length"),
    **dict.fromkeys(("angle", "rotation_vector", "range"), "angle"),
    **{kind: kind for kind in ("mass", "inertia", "force", "torque")},
    "gravity": "acceleration",
}

LARGEST = {
    **{"length": 1e4, "angle": 4 * math.pi, "mass": 1e9, "inertia": 1e15, "force": 1e12, "torque": 1e12},
    "acceleration": 1e6,
}
"""Of each kind in SI: beyond that a number is a slip, in its unit or its digits."""

LEAST_EFFICIENCY = 1e-3

_Quantity = tuple[tuple[str | int, ...], str, float]


def read_spec(data: dict[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """The SI description of a mechanism file's content `data`, and everything wrong with its form.

    A part that cannot be read is None in the description (or its default), so that the core can still check
    all others; the description stands for the file only if there are no faults.
    """
    units, faults = read_units(data.get("units", {}), set(_kinds(data)), MECHANISM_KINDS)
    faults += _too_large(data, units)
    header = {key: value for key, value in data.items() if key in Header.model_fields}
    keys = (*Header.model_fields, *SECTIONS)
    faults += [
        Fault(place_of(key), f"is no key here; {alternatives(key, keys)}") for key in data if key not in keys
    ]

    head = read_table(Header, header, "", faults)
    dynamics = read_table(Dynamics, data.get("dynamics", {}), "dynamics", faults) or Dynamics()
    if 0.0 < dynamics.efficiency < LEAST_EFFICIENCY:
        message = f"is {dynamics.efficiency}; less than {LEAST_EFFICIENCY} makes forces without bound"
        faults.append(Fault("dynamics.efficiency", message))
    load = read_table(Load, data.get("load", {}), "load", faults) or Load()
    tool = read_table(Tool, data.get("tool", {}), "tool", faults) or Tool()
    limits = read_table(Limits, data.get("limits", {}), "limits", faults) or Limits()
    home = read_table(Home, data["home"], "home", faults) if "home" in data else None
    if "home" not in data:
        faults.append(Fault("home", "is missing; needs the centre pose, such as position = [0, 0, 700]"))
    if "published" in data:
        read_table(Published, data["published"], "published", faults)
    platform = read_table(Body, data["platform"], "platform", faults) if "platform" in data else None

    rods = _list(data, "rods", faults)
    legs = _list(data, "legs", faults)
    rod_names = [rod.get("name") if isinstance(rod, dict) else None for rod in rods]
    gravity = STANDARD_GRAVITY if dynamics.gravity is None else units.vector(dynamics.gravity, "acceleration")
    spec = {
        "name": head.name if head else "",
        "angles_known": not any(fault.place in ("units", "units.angle") for fault in faults),
        "platform": platform and _body(platform.mass, platform.center, platform.inertia, units),
        "rods": [_rod(rod, f"rods.{i}", units, faults) for i, rod in enumerate(rods, 1)],
        "legs": [_leg(leg, i, rod_names, units, faults) for i, leg in enumerate(legs, 1)],
        "gravity": list(gravity),
        "efficiency": dynamics.efficiency,
        "linear_damping": dynamics.linear_damping,
        "angular_damping": dynamics.angular_damping,
        "load": {
            "force": units.vector(load.force, "force"),
            "torque": units.vector(load.torque, "torque"),
            "axes": load.axes,
        },
        "home": home
        and {
            "position": units.vector(home.position, "length"),
            "rotation_vector": units.vector(home.rotation_vector, "angle"),
        },
        "tool": {"point": _point(tool.point, units), "axis": _axis(tool.axis, units)},
        "limits": {
            "sigma_min": limits.sigma_min,
            "clearance": None if limits.clearance is None else units.si(limits.clearance, "length"),
            "joint_reach": None if limits.joint_reach is None else units.si(limits.joint_reach, "length"),
        },
    }
    return spec, faults


def _kinds(data: object) -> Iterator[str]:
    """Kinds of the quantities that occur anywhere in `data`."""
    if isinstance(data, dict):
        kinds = _kinds_of_keys(data)
        for key, value in data.items():
            if key in kinds:
                yield kinds[key]
            yield from _kinds(value)
    elif isinstance(data, (list, tuple)):
        for value in data:
            yield from _kinds(value)


def _kinds_of_keys(table: dict[str, Any]) -> dict[str, str]:
    """Kinds of quantities under the keys of a table: in that of a leg its drive's own."""
    drive = next((drive for key, drive in KEYED.items() if key in table), None)
    own = {} if drive is None else {"stroke": drive.coordinate_kind, "force": drive.force_kind}
    return KIND_OF_KEY | own


def _quantities(value: object, kind: str | None = None, *path: str | int) -> Iterator[_Quantity]:
    """Every number that has a kind, with its place and the kind."""
    if isinstance(value, dict):
        kinds = _kinds_of_keys(value)
        for key, entry in value.items():
            yield from _quantities(entry, kinds.get(key, kind), *path, key)
    elif isinstance(value, (list, tuple)):
        for i, entry in enumerate(value, 1):
            yield from _quantities(entry, kind, *path, i)
    elif kind and isinstance(value, (int, float)):
        yield path, kind, value


def _too_large(data: dict[str, Any], units: Units) -> Iterator[Fault]:
    """Faults of numbers beyond the largest of their kind."""
    largest = {kind: from_si(LARGEST[kind], kind, unit) for kind, unit in units.chosen.items()}
    for path, kind, value in _quantities(data):
        if kind in largest and largest[kind] < abs(value) < math.inf:
            most, unit = largest[kind], units.of(kind)
            message = f"is {shown(value)} {unit}, more than {most:.4g} {unit}; check the number and its unit"
            yield Fault(place_of(*path), message)


def _list(data: dict[str, Any], key: str, faults: list[Fault]) -> list[Any]:
    value = data.get(key, [])
    if not isinstance(value, (list, tuple)):
        faults.append(Fault(key, f"is {shown(value)}; needs one table [[{key}]] for each"))
        return [value] if isinstance(value, dict) else []
    return list(value)


def _rod(data: object, place: str, units: Units, faults: list[Fault]) -> dict[str, Any] | None:
    rod = read_table(Rod, data, place, faults)
    absent = [key for key in Body.model_fields if isinstance(data, dict) and key not in data]
    if len(absent) < len(Body.model_fields):
        message = f"is missing; a body needs {', '.join(Body.model_fields)}"
        faults += [Fault(f"{place}.{key}", message) for key in absent]
    if rod is None:
        return None
    body = None
    if rod.mass is not None and rod.center is not None and rod.inertia is not None:
        body = _body(rod.mass, rod.center, rod.inertia, units)
    return {
        "name": rod.name,
        "point": _point(rod.point, units),
        "axis": _axis(rod.axis, units),
        "body": body,
        "range": _range(rod.range, "angle", units),
    }


def _leg(
    data: object, number: int, rod_names: list[Any], units: Units, faults: list[Fault]
) -> dict[str, Any] | None:
    place = f"legs.{number}"
    leg = read_table(Leg, data, place, faults)
    if leg is None:
        return None
    if isinstance(data, dict) and any(key in data and getattr(leg, key) is None for key in KEYED):
        return None  # its faults are known, and which links it may have is not
    drive = next((drive for key, drive in KEYED.items() if getattr(leg, key) is not None), TELESCOPE)
    of = drive.name if drive.key else f"{drive.name} (one without {' or '.join(KEYED)})"
    for key in (*KEYED, *LINK_PLACE):
        if key not in (drive.key, *drive.links) and getattr(leg, key) is not None:
            message = f"must not be given; a {of} has {' and '.join(drive.links)}"
            faults.append(Fault(f"{place}.{key}", message))
    base = _joint(leg.base, f"{place}.base", rod_names, units, faults)
    platform = _joint(leg.platform, f"{place}.platform", None, units, faults)
    if base is None or platform is None:
        return None
    above = next(filter(None, (getattr(leg, drive.links[1]) for drive in DRIVES)), None)
    return {
        "name": str(number) if leg.name is None else leg.name,
        "actuated": leg.actuated,
        **{key: read(leg, units) for key, read in DRIVE_TABLES.items()},
        "stroke": leg.stroke and units.vector((leg.stroke.min, leg.stroke.max), drive.coordinate_kind),
        "radius": None if leg.radius is None else units.si(leg.radius, "length"),
        "force": _range(leg.force, drive.force_kind, units),
        "base": base,
        "platform": platform,
        "cylinder": leg.cylinder and _link(leg.cylinder, +1, units),
        "piston": above and _link(above, -1, units),
    }


def _slider(leg: Leg, units: Units) -> dict[str, Any] | None:
    slider, carriage = leg.slider, leg.carriage
    return (
        None
        if slider is None
        else {
            "axis": _axis(slider.axis, units),
            "strut": units.si(slider.strut, "length"),
            "branch": float(slider.branch),
            "carriage": carriage
            and {
                "mass": units.si(carriage.mass, "mass"),
                "center": units.vector(carriage.center, "length"),
            },
        }
    )


DRIVE_TABLES: dict[str, Callable[[Leg, Units], dict[str, Any] | None]] = {"slider": _slider}
"""What the core is told of a drive, by the key of its table in a leg; None where the leg has another one."""


def _joint(
    joint: Joint, place: str, rod_names: list[Any] | None, units: Units, faults: list[Fault]
) -> dict[str, Any] | None:
    """`rod_names` is None on the platform, which carries no rods. None where the rod is unknown."""
    letter, axis, normal, rod = joint.joint, joint.axis, joint.normal, joint.rod
    kind = JOINTS[letter]
    on_rod = kind.on_rod and rod is not None and rod_names is not None
    may_have = {"axis": kind.has_axis and not on_rod, "normal": kind.has_normal}
    for key, value in {"axis": axis, "normal": normal}.items():
        if may_have[key] and value is None:
            faults.append(Fault(f"{place}.{key}", f"is missing; a {letter} joint needs it"))
        if not may_have[key] and value is not None:
            of = f"{letter} on a rod takes it from the rod" if on_rod else f"a {letter} joint has none"
            faults.append(Fault(f"{place}.{key}", f"must not be given; {of}"))
    if rod is not None and rod_names is None:
        faults.append(Fault(f"{place}.rod", "a rod carries base joints only"))
    elif rod is not None and not kind.on_rod:
        faults.append(Fault(f"{place}.joint", f"is {letter}; on a rod it must be {CARRIED}"))
    if rod is not None and rod_names is not None and rod not in rod_names:
        names = [name for name in rod_names if isinstance(name, str) and name.isprintable() and name.strip()]
        faults.append(Fault(f"{place}.rod", f"is {shown(rod)}, no rod's name; {alternatives(rod, names)}"))
        return None
    return {
        "joint": letter,
        "point": _point(joint.point, units),
        "axis": _axis(axis, units) if axis is not None and may_have["axis"] else None,
        "normal": _axis(normal, units) if normal is not None and may_have["normal"] else None,
        "rod": rod_names.index(rod) if on_rod and rod_names else None,
        "cone": joint.cone
        and {
            "angle": units.si(joint.cone.angle, "angle"),
            "axis": None if joint.cone.axis is None else _axis(joint.cone.axis, units),
        },
        "range": _range(joint.range, "angle", units),
    }


def _range(given: Range | None, kind: str, units: Units) -> list[float] | None:
    return None if given is None else units.vector((given.min, given.max), kind)


def _link(link: Link, sign: int, units: Units) -> dict[str, Any]:
    """In leg axes (n, delta, n x delta); a distance goes along `sign` delta, from B to b or from b to B."""
    center = link.center if isinstance(link.center, list) else [0.0, sign * link.center, 0.0]
    return _body(link.mass, center, link.inertia, units)


def _body(
    mass: float, center: list[float], inertia: float | list[float] | list[list[float]], units: Units
) -> dict[str, Any]:
    given = np.array(inertia, dtype=float)
    matrix = given if given.ndim == 2 else np.eye(3) * given
    return {
        "mass": units.si(mass, "mass"),
        "center": units.vector(center, "length"),
        "inertia": units.si(matrix, "inertia").tolist(),
    }


def _point(point: list[float] | PolarPoint, units: Units) -> list[float]:
    if isinstance(point, list):
        return units.vector(point, "length")
    c, s = cos_sin(point.angle, units.of("angle"))
    return units.vector((point.radius * c, point.radius * s, point.z), "length")


def _axis(axis: list[float] | PolarAxis, units: Units) -> list[float]:
    return axis if isinstance(axis, list) else [*cos_sin(axis.angle, units.of("angle")), axis.z]
