"""The numbers of a mechanism file as tables, in the units of the report: mm, kg, N."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from polypod.files.units import SHOWN
from polypod.legs.drive import Drive
from polypod.legs.drives import drive_of, kinds_among
from polypod.mechanism import Mechanism
from polypod.summary.tables import Table


def data_tables(mech: Mechanism) -> list[Table]:
    """Joints, links, rods, load and the rest of the settings."""
    spec = mech.geometry
    drives = [_drives(mech, spec, drive) for drive in kinds_among(mech.drives) if drive.parameters]
    tables = (_joints(mech, spec), *drives, _rods(spec), _links(mech, spec), _settings(spec))
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
        drive = drive_of(leg)
        bodies += [
            (f"{link} {name}", body) for link, body in zip(drive.links, drive.bodies(leg), strict=True)
        ]
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


def _drives(mech: Mechanism, spec: dict[str, Any], drive: Drive) -> Table:
    """The parameters of all drives of a kind."""
    rows = [
        (leg["name"], *(_parameter(leg[drive.key][key], kind) for key, kind in drive.parameters.items()))
        for leg, own in zip(spec["legs"], mech.drives, strict=True)
        if own == drive
    ]
    headers = (
        f"{key} / {SHOWN[kind][1]}>" if kind in SHOWN else key if kind == "direction" else f"{key}>"
        for key, kind in drive.parameters.items()
    )
    return Table(drive.parameters_title, ("leg", *headers), rows)


def _parameter(value: Any, kind: str) -> str:
    match kind:
        case "direction":
            return _vector(value, digits=4)
        case "sign":
            return f"{value:+.0f}"
    return f"{SHOWN[kind][0] * value:.2f}"


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
