"""The numbers of a mechanism file as tables, in the units of the report: mm, kg, N."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from polypod.mechanism import Mechanism
from polypod.summary.tables import Table


def data_tables(mech: Mechanism) -> list[Table]:
    """Joints, links, rods, load and the rest of the settings."""
    spec = mech.geometry
    tables = (_joints(mech, spec), _rails(spec), _rods(spec), _links(mech, spec), _settings(spec))
    return [table for table in tables if table.rows]


def _joints(mech: Mechanism, spec: dict[str, Any]) -> Table:
    rows = []
    for name, leg in zip(mech.leg_names, spec["legs"], strict=True):
        for end in ("base", "platform"):
            joint = leg[end]
            axis = "" if joint["axis"] is None else _vector(joint["axis"], digits=4)
            if joint["rod"] is not None:
                axis = f"on rod {mech.rod_names[joint['rod']]}"
            rows.append((name, end, joint["joint"], *_millimetres(joint["point"]), axis))
    headers = ("leg", "end", "joint", "x / mm>", "y / mm>", "z / mm>", "axis")
    return Table("Joints, in the axes of base and platform", headers, rows)


def _rods(spec: dict[str, Any]) -> Table:
    rows = [
        (rod["name"], *_millimetres(rod["point"]), _vector(rod["axis"], digits=4)) for rod in spec["rods"]
    ]
    return Table("Rods", ("rod", "x / mm>", "y / mm>", "z / mm>", "axis"), rows)


def _links(mech: Mechanism, spec: dict[str, Any]) -> Table:
    bodies = [("platform", spec["platform"]), *((f"rod {rod['name']}", rod["body"]) for rod in spec["rods"])]
    for name, leg in zip(mech.leg_names, spec["legs"], strict=True):
        if leg["slider"] is None:
            bodies += [(f"{part} {name}", leg[part]) for part in ("cylinder", "piston")]
        else:
            bodies += [(f"carriage {name}", leg["slider"]["carriage"]), (f"strut {name}", leg["piston"])]
    rows = [
        (
            name,
            f"{body['mass']:g}",
            _vector([1e3 * c for c in body["center"]], digits=5),
            *_moments(body),
        )
        for name, body in bodies
        if body is not None
    ]
    inertia = tuple(f"I_{axes}>" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
    headers = ("link", "mass / kg>", "mass centre / mm", *inertia)
    return Table("Links, each in its own axes; inertia about the mass centre, kg m²", headers, rows)


def _moments(body: dict[str, Any]) -> list[str]:
    """Six components of the inertia; none for a carriage."""
    if "inertia" not in body:
        return [""] * 6
    entries = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return [f"{body['inertia'][i][j]:.4g}" for i, j in entries]


def _rails(spec: dict[str, Any]) -> Table:
    rows = [
        (
            leg["name"],
            _vector(leg["slider"]["axis"], digits=4),
            f"{1e3 * leg['slider']['strut']:.2f}",
            f"{leg['slider']['branch']:+.0f}",
        )
        for leg in spec["legs"]
        if leg["slider"] is not None
    ]
    headers = ("leg", "axis", "strut / mm>", "branch>")
    return Table("Rails, through the base points, and struts", headers, rows)


def _settings(spec: dict[str, Any]) -> Table:
    load = spec["load"]
    rows = [
        ("load F_o / N", _vector(load["force"])),
        ("load T_o / N m", _vector(load["torque"])),
        ("axes of the load", load["axes"]),
        ("gravity / m/s²", _vector(spec["gravity"])),
        ("efficiency η", f"{spec['efficiency']:g}"),
        ("damping, linear and angular", f"{spec['linear_damping']:g}, {spec['angular_damping']:g}"),
        ("tool point / mm", ", ".join(_millimetres(spec["tool"]["point"]))),
        ("tool axis", _vector(spec["tool"]["axis"], digits=4)),
    ]
    return Table("Load and settings", ("", ""), rows)


def _millimetres(point: Sequence[float]) -> list[str]:
    return [f"{1e3 * x + 0.0:.2f}" for x in point]


def _vector(values: Sequence[float], digits: int = 6) -> str:
    return ", ".join(f"{x:.{digits}g}" for x in values)
