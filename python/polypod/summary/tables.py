"""Facts of mechanisms and solutions as tables of words: what the command line prints and the report shows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from polypod.answers.leg_words import factor, force_unit, unit, word
from polypod.files.units import coordinate_unit, instant, readable
from polypod.legs.drive import Drive
from polypod.legs.drives import drive_of_letters

Facts = dict[str, Any]


@dataclass(frozen=True)
class Table:
    """A table of texts; a header that ends in `>` puts its column to the right."""

    title: str
    headers: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    note: str = ""
    """A sentence below it."""

    @property
    def columns(self) -> list[tuple[str, bool]]:
        """Each column's header and whether it stands to the right."""
        return [(header.removesuffix(">"), header.endswith(">")) for header in self.headers]


# --- a mechanism --------------------------------------------------------------------------------------------


def mechanism_tables(facts: Facts) -> list[Table]:
    """All tables on the facts of `describe`, but those without rows."""
    tables = (
        legs_table(facts),
        mobility_table(facts),
        accounting_table(facts),
        topology_table(facts),
        constraints_table(facts),
        wrenches_table(facts),
        screws_table(facts),
        coupled_table(facts),
        coordinates_table(facts),
        centre_table(facts),
        limits_table(facts),
    )
    return [table for table in tables if table.rows]


def legs_table(facts: Facts) -> Table:
    """Joints, actuation and strokes."""
    drives = _drives(facts)
    rows = [
        (
            leg["name"],
            leg["joints"],
            "yes" if leg["actuated"] else "no",
            fixed(leg["home_length"], factor(drive)),
            in_range(leg["stroke"], factor(drive)),
        )
        for leg, drive in zip(facts["legs"], drives, strict=True)
    ]
    at_home, stroke = f"{word(drives)} at home / {unit(drives)}>", f"stroke / {unit(drives)}>"
    return Table("Legs", ("leg", "joints", "actuated", at_home, stroke), rows)


def _drives(facts: Facts) -> list[Drive]:
    return [drive_of_letters(leg["joints"]) for leg in facts["legs"]]


def mobility_table(facts: Facts) -> Table:
    """The terms of mobility."""
    mobility = facts["mobility"]
    terms: tuple[tuple[str, str, str], ...] = (
        ("degrees of freedom of the platform", "dof", _idle(mobility["idle"])),
        ("links, with the base", "links", ""),
        ("joints", "joints", ""),
        ("joint degrees of freedom", "joint_freedoms", ""),
        ("independent loops", "loops", f"{6 * mobility['loops']} closure equations"),
        ("rank of the loop closures", "closure_rank", ""),
        ("redundant constraints", "redundant", _of_legs("couple", mobility["redundant_legs"])),
        ("passive degrees of freedom", "passive", _of_legs("spin of", mobility["passive_legs"])),
    )
    if mobility["rows"] > 6:
        terms = (
            *terms,
            ("rows of the Jacobian", "rows", "more actuators than it takes: forces are a choice"),
        )
    rows = [(term, str(mobility[key]), remark) for term, key, remark in terms]
    return Table("Mobility, from ranks at generic poses", ("", ">", ""), rows)


def _idle(freedoms: Sequence[Mapping[str, Any]]) -> str:
    """Those that no leg feels, in words."""
    if not freedoms:
        return ""
    count = "one of them" if len(freedoms) == 1 else f"{len(freedoms)} of them"
    lines = [
        f"spin about the line through {_triple(row['point'], 1e3)} mm along {_triple(row['axis'])} "
        f"({row['body']} axes)"
        for row in freedoms
    ]
    return f"{count} idle: {'; '.join(lines)}, which move no leg"


def _triple(vector: Sequence[float], factor: float = 1.0) -> str:
    return f"({', '.join(f'{factor * x + 0.0:.6g}' for x in vector)})"


def accounting_table(facts: Facts) -> Table:
    """Eq. 1 from ranks, beside the published terms where there are some."""
    mobility, accounting = facts["mobility"], facts["accounting"]
    columns = {"from ranks": accounting["computed"], "published": accounting["published"]}
    columns = {name: terms for name, terms in columns.items() if terms}
    rows = [
        (term, *(text for _ in columns))
        for term, text in (
            ("6 (n_0 - n_k - 1)", str(6 * (mobility["links"] - mobility["joints"] - 1))),
            ("ΣM_i", str(mobility["joint_freedoms"])),
        )
    ]
    for term, key in (("ς", "redundant"), ("M_0", "passive"), ("M", "sum")):
        rows.append((term, *(str(terms[key]) for terms in columns.values())))
    note = accounting["note"]
    return Table(
        "Eq. 1:  M = 6 (n_0 - n_k - 1) + ΣM_i + ς - M_0",
        ("", *(f"{name}>" for name in columns)),
        rows,
        f"{note[0].upper()}{note[1:]}." if note else "",
    )


def topology_table(facts: Facts) -> Table:
    """Links by their number of joints."""
    rows = [(kind, str(len(names)), ", ".join(names)) for kind, names in facts["links_by_joints"].items()]
    return Table("Links by number of joints", ("kind", "number>", "links"), rows)


def constraints_table(facts: Facts) -> Table:
    """The scalar constraints on the platform."""
    rows = [
        (row["leg"], row["kind"], row["condition"], "yes" if row["independent"] else "no")
        for row in facts["constraints"]
    ]
    return Table("Constraints on the platform", ("leg", "kind", "condition", "independent"), rows)


def wrenches_table(facts: Facts) -> Table:
    """Table of the wrenches that the constraints can transmit at the centre pose."""
    rows = [
        (
            row["leg"],
            row["kind"],
            "nothing" if row["axis"] is None else "couple" if row["couple"] else "force",
            _vector(row["axis"], 3) if row["axis"] else "",
            _vector(row["point"], 1, 1e3) if row["point"] else "",
            _pitch(row["pitch"]),
            "" if row["independent"] else "redundant",
        )
        for row in facts["constraint_wrenches"]
    ]
    headers = ("leg", "kind", "holds by a", "direction>", "through / mm>", "pitch / mm>", "")
    return Table("Constraint wrenches at the centre pose, base axes", headers, rows)


def screws_table(facts: Facts) -> Table:
    """Table of the degrees of freedom of the platform at the centre pose."""
    rows = [
        (
            row["kind"],
            _vector(row["axis"], 3),
            _vector(row["point"], 1, 1e3) if row["point"] else "",
            _pitch(row["pitch"]),
        )
        for row in facts["freedoms"]["screws"]
    ]
    headers = ("degree of freedom", "axis>", "through / mm>", "pitch / mm/rad>")
    return Table("Degrees of freedom at the centre pose: principal screws, base axes", headers, rows)


def _pitch(value: float | None) -> str:
    return "" if value is None else f"{1e3 * value:z.2f}"


def coupled_table(facts: Facts) -> Table:
    """Table of the dependent coordinates when one independent coordinate is moved from the centre pose."""
    rows = []
    for row in facts["freedoms"]["coupled"]:
        moved = row["coordinate"]
        if row["follow"] is None:
            follow = "not determined there"
        else:
            changes = (f"{n} {_signed(c, coordinate_unit(n))}" for n, c in row["follow"].items())
            follow = ", ".join(changes) or "nothing"
        rows.append((moved, _signed(row["change"], coordinate_unit(moved)), follow))
    note = "The other independent coordinates stay where they are." if rows else ""
    headers = ("moved", "by>", "follow")
    return Table("Degrees of freedom: independent coordinates, and what follows", headers, rows, note)


def _vector(values: Sequence[float], digits: int, factor: float = 1.0) -> str:
    # + 0.0: never -0.0
    return ", ".join(f"{round(factor * value, digits) + 0.0:.{digits}f}" for value in values)


def _signed(value: float, unit: str) -> str:
    factor, name = {"m": (1e3, "mm"), "rad": (180 / math.pi, "deg")}[unit]
    return f"{factor * value:+.2f} {name}"


def coordinates_table(facts: Facts) -> Table:
    """The coordinate sets."""
    dof, rows = facts["mobility"]["dof"], []
    for name, coordinates in facts["coordinate_sets"].items():
        of = f"{dof} independent ones of " if name == "pose" and len(coordinates) > dof else ""
        rows.append((name, of + ", ".join(coordinates)))
    return Table("Coordinate sets", ("set", "coordinates"), rows)


_CONDITIONING = {
    "sigma_min": "smallest singular value of the leg Jacobian",
    "sigma_max": "largest singular value",
    "condition": "condition number",
}


def centre_table(facts: Facts) -> Table:
    """Position and conditioning at the centre pose."""
    centre = facts["centre_pose"]
    rows = [
        ("position of o / mm", ", ".join(f"{1e3 * row[3]:.1f}" for row in centre["pose"][:3])),
        *((text, significant(centre[key])) for key, text in _CONDITIONING.items()),
        ("characteristic length / mm", f"{1e3 * facts['characteristic_length']:.1f}"),
    ]
    return Table("At the centre pose", ("", ">"), rows)


def limits_table(facts: Facts) -> Table:
    """Table of the limits of the mechanism file, and their slack at the centre pose."""
    rows = [
        (
            row["name"],
            allowed(row),
            "none" if row["margin"] is None else readable(row["margin"], row["unit"]),
            significant(row["relative"]),
            "binds" if row["binds"] else "",
        )
        for row in facts["limits"]
    ]
    return Table("Limits", ("limit", "allowed>", "slack at home>", "relative>", ""), rows)


def allowed(limit: Facts) -> str:
    """Allowed range of a limit."""
    least, greatest = (None if end is None else readable(end, limit["unit"]) for end in limit["allowed"])
    if least is None or greatest is None:
        return f"at most {greatest}" if least is None else f"at least {least}"
    return f"{least} to {greatest}"


def _of_legs(what: str, names: tuple[str, ...]) -> str:
    return f"{what} leg{'s' if len(names) > 1 else ''} {', '.join(names)}" if names else ""


# --- a solution ---------------------------------------------------------------------------------------------


def motion_tables(facts: Facts) -> list[Table]:
    """The tables on the facts of `summarise`, but those without rows."""
    tables = (motion_table(facts), peaks_table(facts), passed_table(facts))
    return [table for table in tables if table.rows]


def motion_table(facts: Facts) -> Table:
    """Lengths or places, speeds and forces of the legs along a motion."""
    drives = _drives(facts)
    rows = [
        (
            leg["name"],
            _passed(leg, factor(drive)),
            in_range(leg["stroke"], factor(drive)),
            fixed(leg["peak_rate"], factor(drive)),
            fixed(leg["peak_force"]),
        )
        for leg, drive in zip(facts["legs"], drives, strict=True)
    ]
    headers = (
        *("leg", f"{word(drives)} / {unit(drives)}>", f"stroke / {unit(drives)}>"),
        *(f"peak speed / {unit(drives, '/s')}>", f"peak force / {force_unit(drives)}>"),
    )
    return Table("Legs", headers, rows)


def peaks_table(facts: Facts) -> Table:
    """Peaks of the whole mechanism along a motion."""
    platform, power = facts["platform"], facts["power"]
    rows = [
        ("peak speed of o / mm/s", fixed(platform["peak_speed"], 1e3)),
        ("peak angular speed / rad/s", significant(platform["peak_angular_speed"])),
        ("peak power, all actuators / W", fixed(power["peak_actuators"])),
        ("residual of the power balance / W", significant(power["greatest_residual"], 1)),
        ("... relative to the power that flows", significant(power["relative_residual"], 1)),
        *_coupled_rows(facts["coupled"]),
    ]
    if nearest := facts["nearest_to_singular"]:
        rows += [
            ("nearest to singular: time / s", clock(nearest["time"])),
            ("... smallest singular value", significant(nearest["sigma_min"])),
            ("... condition number", significant(nearest["condition"])),
        ]
    if limits := facts["limits"]:
        rows += _least_slack_rows(limits["least"])
    return Table("Along the motion", ("", ">"), rows)


def _coupled_rows(coupled: Facts | None) -> list[tuple[str, ...]]:
    if not coupled:
        return []
    names = ", ".join(f"f_c{leg}" for leg in coupled["legs"])
    return [
        (
            f"peak couple-constrained forces {names} / N",
            ", ".join(map(fixed, coupled["peak_forces"])),
        ),
        ("peak couple-constrained torque T_c / N m", fixed(coupled["peak_torque"])),
    ]


def _least_slack_rows(least: Facts | None) -> list[tuple[str, ...]]:
    if not least:
        return [("least slack: limit", "none")]
    return [
        ("least slack: limit", least["limit"]),
        ("... slack", readable(least["margin"], least["unit"])),
        ("... relative to the limit's scale", significant(least["relative"])),
        ("... time / s", clock(least["time"])),
    ]


def passed_table(facts: Facts) -> Table:
    """The limits that a motion passes."""
    rows = [
        (
            row["limit"],
            str(row["states"]),
            clock(row["first_time"]),
            readable(-row["margin"], row["unit"]),
            clock(row["time"]),
        )
        for row in (facts["limits"] or {"passed": []})["passed"]
    ]
    headers = ("limit", "states>", "first at / s>", "furthest>", "at / s>")
    return Table("Limits that are passed", headers, rows)


def outcomes_table(facts: Facts) -> Table:
    """Table of the states that are not OK."""
    rows = [
        (row["status"], str(row["count"]), clock(row["first_time"]), row["message"])
        for row in facts["outcomes"]
    ]
    return Table("Outcomes other than OK", ("status", "states>", "first at / s>", "meaning"), rows)


def clock(time: float) -> str:
    """A time in a column of seconds; one since 1970 as a date."""
    return instant(time).removesuffix(" s")


def outcome(facts: Facts) -> str:
    """One sentence on all states where every one has the outcome OK, else nothing."""
    if facts["outcomes"]:
        return ""
    if not facts["limits"]:
        return "All states have an answer; the mechanism file sets no limits."
    if facts["limits"]["passed"]:
        return "All states have an answer, but some are beyond a limit."
    return "All states have an answer, within all limits."


def coupled_note(facts: Facts) -> str:
    """Assumptions of the couple-constrained forces, if there are any."""
    return f"Note: {facts['coupled']['note']}." if facts["coupled"] else ""


def _passed(leg: Facts, factor: float) -> str:
    """The lengths that a leg passes, marked where they leave its stroke."""
    if leg["length"][0] is None:
        return "none"
    return in_range(leg["length"], factor) + (" outside" if leg["outside_stroke"] else "")


# --- a workspace --------------------------------------------------------------------------------------------


def extents_table(facts: Facts) -> Table:
    """How far a workspace reaches, from the facts of `Workspace.facts`."""
    rows = []
    for name, (low, high) in facts["extents"].items():
        unit, (below, above) = coordinate_unit(name), facts["extent_errors"][name]
        ends = (_exact(low, below, unit), _exact(high, above, unit), _exact(high - low, below + above, unit))
        rows.append((name, *ends, readable(facts["step"][name], unit)))
    return Table("Extents", ("", "least>", "greatest>", "width>", "step>"), rows, content(facts))


def _exact(value: float, error: float, unit: str) -> str:
    """A value, with its error where that shows."""
    off = readable(error, unit)
    return readable(value, unit) + (f" ± {off}" if off != readable(0.0, unit) else "")


def extent_limits_table(facts: Facts) -> Table:
    """What ends a workspace where it reaches farthest."""
    rows = [
        (f"{end} {name}", ", ".join(limits))
        for name, pair in facts["extent_limits"].items()
        for end, limits in zip(("least", "greatest"), pair, strict=True)
    ]
    return Table("What ends the extents", ("", "limits that bind there"), rows)


def content(facts: Facts) -> str:
    """Volume or area with its error."""
    word = "volume" if len(facts["extents"]) == 3 else "area"
    return f"{word}: {facts['volume']:.5g} ± {facts['volume_error']:.1g} {facts['volume_unit']}"


def ends_table(facts: Facts) -> Table:
    """Table of the causes of a workspace's boundary."""
    rows = [(name, f"{100 * share:.1f} %") for name, share in facts["boundary"].items()]
    return Table("What ends it", ("", "part of the boundary>"), rows)


# --- numbers ------------------------------------------------------------------------------------------------


def in_range(limits: list[float | None], factor: float) -> str:
    """Least and greatest value, in SI, written in another unit."""
    low, high = (fixed(value, factor) for value in limits)
    return "free" if limits == [None, None] else f"{low} to {high}"


def fixed(value: float | None, scale: float = 1.0) -> str:
    """One decimal, as readings have."""
    return "none" if value is None else f"{scale * value:z.1f}"


def significant(value: float | None, digits: int = 3) -> str:
    """A number whose size is not known beforehand."""
    return "none" if value is None else f"{value:.{digits}g}"
