"""`polypod list`: the built-in mechanisms."""

from __future__ import annotations

import typer
from rich.markup import escape

from polypod.cli.shared import JsonOption, console, new_table, print_json

app = typer.Typer()


@app.command("list", epilog="Example: [bold]polypod list[/bold]")
def list_(as_json: JsonOption = False) -> None:
    """List the built-in mechanisms, a line each; `polypod info NAME` tells more."""
    from polypod.summary import catalogue

    facts = catalogue()
    if as_json:
        print_json(facts)
        return
    table = new_table("Built-in mechanisms", "name", "legs", "freedoms>", "")
    for mechanism in facts:
        table.add_row(
            escape(mechanism["name"]),
            mechanism["legs"],
            str(mechanism["dof"]),
            escape(mechanism["description"]),
        )
    console().print(table)
