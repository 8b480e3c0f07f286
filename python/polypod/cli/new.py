"""`polypod new`: a mechanism file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from polypod.cli.shared import print_written

app = typer.Typer()


@app.command(epilog="Example: [bold]polypod new machine.toml[/bold]")
def new(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="The mechanism file to write, .toml.")],
    like: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Start from this built-in mechanism instead of the template."),
    ] = None,
) -> None:
    """Write a mechanism file to start from: a small machine with every entry explained."""
    from polypod.cli.templates import starting_text

    text = starting_text(path, like)
    with path.open("x", encoding="utf-8") as file:
        file.write(text)
    print_written(path)
