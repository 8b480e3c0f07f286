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
    print_json,
    print_words,
    print_written,
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
    """Show a mechanism: degrees of freedom, joints, constraints, coordinates, conditioning, warnings."""
    from polypod.mechanism import load
    from polypod.summary.mechanism_facts import describe

    mech = load(mechanism)
    facts = describe(mech)
    if draw is not None:
        _draw(mech, draw)
    if as_json:
        print_json(facts)
        return
    _print_mechanism(console(), facts)
    if draw is not None:
        print_written(draw)


def _draw(mech: Mechanism, path: Path) -> None:
    from matplotlib.figure import Figure

    from polypod.plots import plot_poses, save_figure

    save_figure(plot_poses(mech, {"centre pose": mech.home}, Figure(figsize=(6.0, 6.0))), path)


def _print_mechanism(out: Console, facts: dict[str, Any]) -> None:
    from polypod.summary.tables import mechanism_tables

    out.print(f"[bold]{escape(facts['name'])}[/bold]  {escape(facts['description'])}")
    if facts["source"]:
        out.print(f"[dim]{escape(facts['source'])}[/dim]")
    for table in mechanism_tables(facts):
        print_words(out, table)
    for warning in facts["warnings"]:
        out.print(f"[bold yellow]Warning:[/bold yellow] {escape(warning)}")
