"""`polypod info`: what a mechanism is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from polypod.cli.shared import (
    JsonOption,
    MechanismArgument,
    console,
    fixed,
    new_table,
    print_json,
    range_mm,
    significant,
)

if TYPE_CHECKING:
    from polypod.mechanism import Mechanism

app = typer.Typer()


@app.command(epilog="Example: [bold]polypod info lu-3spu-2rpu-r[/bold]")
def info(
    mechanism: MechanismArgument,
    as_json: JsonOption = False,
    draw: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the mechanism at its centre pose into a .png or .svg file."),
    ] = None,
) -> None:
    """Tell what a mechanism is: freedoms, joints, constraints, coordinates, conditioning, warnings."""
    from polypod.mechanism import load
    from polypod.summary import describe

    mech = load(mechanism)
    facts = describe(mech)
    if draw is not None:
        _draw(mech, draw)
    if as_json:
        print_json(facts)
    else:
        _print_mechanism(console(), facts)


def _draw(mech: Mechanism, path: Path) -> None:
    from matplotlib.figure import Figure

    from polypod.plots import plot_poses, save_figure

    save_figure(plot_poses(mech, {"centre pose": mech.home}, Figure(figsize=(6.0, 6.0))), path)


def _print_mechanism(out: Console, facts: dict[str, Any]) -> None:
    mobility = facts["mobility"]
    out.print(f"[bold]{escape(facts['name'])}[/bold]  {escape(facts['description'])}")
    if facts["source"]:
        out.print(f"[dim]{escape(facts['source'])}[/dim]")

    legs = new_table("Legs", "leg", "joints", "actuated", "length at home / mm>", "stroke / mm>")
    for leg in facts["legs"]:
        actuated, home = "yes" if leg["actuated"] else "no", fixed(leg["home_length"], 1e3)
        legs.add_row(escape(leg["name"]), leg["joints"], actuated, home, range_mm(leg["stroke"]))
    out.print(legs)
    _print_mobility(out, mobility)
    _print_accounting(out, mobility, facts["accounting"])

    topology = new_table("Links by number of joints", "kind", "number>", "links")
    for kind, names in facts["links_by_joints"].items():
        topology.add_row(kind, str(len(names)), escape(", ".join(names)))
    out.print(topology)

    if facts["constraints"]:
        constraints = new_table("Constraints on the platform", "leg", "kind", "condition", "independent")
        for row in facts["constraints"]:
            constraints.add_row(
                escape(row["leg"]), row["kind"], row["condition"], "yes" if row["independent"] else "no"
            )
        out.print(constraints)

    sets = new_table("Coordinate sets", "set", "coordinates")
    for name, coordinates in facts["coordinate_sets"].items():
        of = (
            f"{mobility['dof']} independent ones of "
            if name == "pose" and len(coordinates) > mobility["dof"]
            else ""
        )
        sets.add_row(name, of + ", ".join(coordinates))
    out.print(sets)

    _print_centre_pose(out, facts)
    _print_limits(out, facts["limits"])
    for warning in facts["warnings"]:
        out.print(f"[bold yellow]Warning:[/bold yellow] {escape(warning)}")


def _print_mobility(out: Console, mobility: dict[str, Any]) -> None:
    table = new_table("Mobility, from ranks at generic poses", "", ">", "")
    for term, key, remark in (
        ("freedoms of the platform", "dof", ""),
        ("links, with the base", "links", ""),
        ("joints", "joints", ""),
        ("joint freedoms", "joint_freedoms", ""),
        ("independent loops", "loops", f"{6 * mobility['loops']} closure equations"),
        ("rank of the loop closures", "closure_rank", ""),
        ("redundant constraints", "redundant", _of_legs("couple", mobility["redundant_legs"])),
        ("passive freedoms", "passive", _of_legs("spin of", mobility["passive_legs"])),
    ):
        table.add_row(term, str(mobility[key]), remark)
    out.print(table)


def _print_accounting(out: Console, mobility: dict[str, Any], accounting: dict[str, Any]) -> None:
    """The terms of Eq. 1, beside those that the source of the mechanism prints."""
    columns = {"from ranks": accounting["computed"], "published": accounting["published"]}
    columns = {name: terms for name, terms in columns.items() if terms}
    eq1 = new_table("Eq. 1:  M = 6 (n_0 - n_k - 1) + ΣM_i + ς - M_0", "", *(f"{name}>" for name in columns))
    for term, text in (
        ("6 (n_0 - n_k - 1)", str(6 * (mobility["links"] - mobility["joints"] - 1))),
        ("ΣM_i", str(mobility["joint_freedoms"])),
    ):
        eq1.add_row(term, *(text for _ in columns))
    for term, key in (("ς", "redundant"), ("M_0", "passive"), ("M", "sum")):
        eq1.add_row(term, *(str(terms[key]) for terms in columns.values()))
    out.print(eq1)
    if accounting["note"]:
        out.print(f"{accounting['note'][0].upper()}{accounting['note'][1:]}.")


def _print_centre_pose(out: Console, facts: dict[str, Any]) -> None:
    centre = facts["centre_pose"]
    table = new_table("At the centre pose", "", ">")
    table.add_row("position of o / mm", ", ".join(f"{1e3 * row[3]:.1f}" for row in centre["pose"][:3]))
    for key in ("sigma_min", "sigma_max", "condition"):
        table.add_row(_CONDITIONING[key], significant(centre[key]))
    table.add_row("characteristic length / mm", f"{1e3 * facts['characteristic_length']:.1f}")
    out.print(table)


def _print_limits(out: Console, limits: list[dict[str, Any]]) -> None:
    """What the mechanism file allows, and the slack that the centre pose leaves."""
    from polypod.units import readable

    if not limits:
        return
    table = new_table("Limits", "limit", "allowed>", "slack at home>", "relative>", "")
    for row in limits:
        least, greatest = (None if end is None else readable(end, row["unit"]) for end in row["allowed"])
        if least is None or greatest is None:
            allowed = f"at most {greatest}" if least is None else f"at least {least}"
        else:
            allowed = f"{least} to {greatest}"
        slack = "none" if row["margin"] is None else readable(row["margin"], row["unit"])
        table.add_row(
            escape(row["name"]), allowed, slack, significant(row["relative"]), "binds" if row["binds"] else ""
        )
    out.print(table)


_CONDITIONING = {
    "sigma_min": "smallest singular value of the leg Jacobian",
    "sigma_max": "largest singular value",
    "condition": "condition number",
}


def _of_legs(what: str, names: tuple[str, ...]) -> str:
    if not names:
        return ""
    return escape(f"{what} leg{'s' if len(names) > 1 else ''} {', '.join(names)}")
