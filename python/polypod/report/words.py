"""Texts of a report, and its overview."""

from __future__ import annotations

from typing import Any

from polypod.answers import leg_words
from polypod.files.units import coordinate_unit, instant, readable
from polypod.legs.drives import kinds_among
from polypod.mechanism import Mechanism
from polypod.report.content import Along, Content
from polypod.summary.tables import Table, fixed, in_range, outcome, significant


def warnings(content: Content) -> list[str]:
    """Warnings at the top: of the mechanism, of its motion, of limits and of lost states."""
    found = [_sentence(warning) for warning in content.facts["warnings"]]
    if content.along is None:
        return found
    facts = content.along.facts
    said = (*facts["warnings"], *facts["singularities"]["warnings"])
    found += [_sentence(warning) for warning in said]
    found += [
        f"Limit passed: {row['limit']} at {row['states']} of {facts['states']} states, first at "
        f"{instant(row['first_time'])}, by {readable(-row['margin'], row['unit'])} at most, at "
        f"{instant(row['time'])}."
        for row in (facts["limits"] or {"passed": []})["passed"]
    ]
    return found + lost(facts)


def lost(facts: dict[str, Any]) -> list[str]:
    """A sentence for each outcome other than OK."""
    return [
        f"{row['count']} of {facts['states']} states are {row['status']}, first at "
        f"{instant(row['first_time'])}: {row['message']}."
        for row in facts["outcomes"]
    ]


def outcomes(facts: dict[str, Any]) -> str:
    """Outcomes of all states, in one sentence."""
    if not facts["outcomes"]:
        return outcome(facts)
    without, states = facts["without_answer"], facts["states"]
    if not without:
        return "All states have an answer, but not all are without reservation."
    return f"{without} of {states} states have no answer; curves have gaps there, and the gaps are grey."


def glance(content: Content) -> list[tuple[str, str]]:
    """The few facts that come first: name and value."""
    facts, mobility = content.facts, content.facts["mobility"]
    found = [
        ("freedoms", str(mobility["dof"])),
        ("legs", "+".join(leg["joints"] for leg in facts["legs"])),
        ("redundant constraints", str(mobility["redundant"])),
    ]
    if content.along is not None:
        found += _of_motion(content.along)
    if content.workspace is not None:
        volume = content.workspace
        found.append(
            ("workspace", f"{volume.volume:.3g} {volume.volume_unit}".replace("^3", "³").replace("^2", "²"))
        )
    return found


def workspace_words(facts: dict[str, Any]) -> str:
    """Description of the workspace, in one sentence."""
    if facts["kind"] == "reachable":
        return "All positions of o that can be reached inside all limits, whatever the orientation."
    *names, last = facts["extents"]
    fixed = ", ".join(
        f"{name} = {readable(value, coordinate_unit(name))}" for name, value in facts["fixed"].items()
    )
    at = f" at {fixed}" if fixed else ""
    return f"All values that {', '.join(names)} and {last} can take together inside all limits{at}."


def _of_motion(along: Along) -> list[tuple[str, str]]:
    facts = along.facts
    peaks = [row["force"] for row in along.actuators if row["force"]["peak"] is not None]
    powers = [row["power"] for row in along.actuators if row["power"]["peak"] is not None]
    found = [("motion", f"{facts['end'] - facts['start']:g} s, {facts['states']} states")]
    for name, rows, unit in (("peak force", peaks, "N"), ("peak power of an actuator", powers, "W")):
        if rows:
            peak = max(abs(row["peak"]) for row in rows)
            found.append((name, f"{f'{peak:.0f}' if peak >= 100.0 else significant(peak)} {unit}"))
    if nearest := facts["nearest_to_singular"]:
        found.append(("smallest singular value", significant(nearest["sigma_min"])))
    if facts["without_answer"]:
        found.append(("states without an answer", str(facts["without_answer"])))
    return found


def actuators_table(rows: list[dict[str, Any]], mech: Mechanism) -> Table:
    """What the motion asks of each actuator."""
    cells, drives = [], mech.drives
    for row in rows:
        scale = leg_words.factor(drives[mech.leg_names.index(row["leg"])])
        force, speed, power, stroke = (row[key] for key in ("force", "speed", "power", "stroke"))
        cells.append(
            (
                row["leg"],
                fixed(force["peak"]),
                fixed(force["rms"]),
                fixed(speed["peak"], scale),
                fixed(speed["rms"], scale),
                fixed(power["peak"]),
                fixed(power["rms"]),
                "none" if stroke["used"] is None else in_range([stroke["least"], stroke["greatest"]], scale),
                fixed(stroke["used"], scale),
                "" if stroke["share"] is None else f"{100 * stroke['share']:.1f} %",
            )
        )
    speed, force = leg_words.unit(drives, "/s"), leg_words.force_unit(drives)
    place = leg_words.unit(drives)
    headers = (
        *("leg", f"peak force / {force}>", f"rms / {force}>", f"peak speed / {speed}>", f"rms / {speed}>"),
        *("peak power / W>", "rms / W>", f"{leg_words.word(drives)} / {place}>"),
        *(f"stroke used / {place}>", "of the stroke>"),
    )
    note = (
        "Peaks are the values of largest size, with their signs: forces are positive when they push the "
        "platform away, speeds when the leg becomes longer, powers when the actuator drives."
    )
    note = " ".join([note, *(drive.signs for drive in kinds_among(drives) if drive.signs)])
    return Table("Actuators", headers, cells, note)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
