"""`polypod demo`: the published manipulator along the built-in motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from polypod.cli.shared import console, working

app = typer.Typer()


@app.command(epilog="Example: [bold]polypod demo -o demo[/bold]")
def demo(
    directory: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="DIR", help="Directory for the results; made if need be."),
    ] = Path("polypod-demo"),
) -> None:
    """Solve the published manipulator along the built-in motion: tables, figures and a summary in DIR."""
    from rich.markdown import Markdown

    from polypod.report.demo import run_demo

    with working("solving and drawing"):
        result = run_demo(directory)
    console().print(Markdown(result.text))
