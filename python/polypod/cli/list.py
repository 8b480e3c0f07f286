"""`polypod list`: the built-in mechanisms."""

from __future__ import annotations

import typer
from rich.markup import escape

from polypod.cli.shared import JsonOption, console, print_json

app = typer.Typer()


@app.command("list", epilog="Example: [bold]polypod list[/bold]")
def list_(as_json: JsonOption = False) -> None:
    """List the built-in mechanisms, a line each; `polypod info NAME` shows more."""
    from polypod.summary.mechanism_facts import catalogue

    facts = catalogue()
    if as_json:
        print_json(facts)
        return
    names, legs = (max(len(mechanism[key]) for mechanism in facts) for key in ("name", "legs"))
    for mechanism in facts:
        words = (
            f"{mechanism['legs']:{legs}}  {mechanism['dof']} degrees of freedom  {mechanism['description']}"
        )
        # A line each, however narrow the terminal: for eyes and for grep.
        console().print(f"[bold]{mechanism['name']:{names}}[/bold]  {escape(words)}", soft_wrap=True)
