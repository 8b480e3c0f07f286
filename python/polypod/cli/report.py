"""`polypod report`: a mechanism, and its motion, as one page."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from polypod.cli.shared import (
    MechanismArgument,
    check_result_path,
    print_written,
    progress_bar,
)
from polypod.errors import PolypodError, WorkspaceError

app = typer.Typer()


@app.command(epilog="Example: [bold]polypod report lu-3spu-2rpu-r lu-3spu-2rpu-r -o report.html[/bold]")
def report(
    mechanism: MechanismArgument,
    motion: Annotated[
        str | None,
        typer.Argument(
            metavar="[MOTION]",
            help="A motion file (.csv or .toml) or a built-in motion's name; without it the report is on the "
            "mechanism alone.",
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FILE", help="File for the page, .html; it is overwritten."),
    ] = Path("report.html"),
    samples: Annotated[
        int | None,
        typer.Option(min=2, metavar="N", help="Solve at N instants evenly over the motion."),
    ] = None,
    step: Annotated[
        str | None,
        typer.Option(metavar="VALUE", help="Cell width of the workspace, such as 20mm; by default 64 cells."),
    ] = None,
    workspace: Annotated[bool, typer.Option("--workspace/--no-workspace", help="Find the workspace.")] = True,
) -> None:
    """Write all about a mechanism and its motion into one page, to open in a browser or to print.

    The page needs no network and no other file. The exit status is 1 if some states have no answer.
    """
    from polypod.cli.quantities import quantity
    from polypod.mechanism import load
    from polypod.report.content import gather
    from polypod.report.page import render, save

    check_result_path(output, mechanism, *filter(None, [motion]), suffixes=(".html",))
    if step is not None and not workspace:
        raise WorkspaceError("--step is for the workspace, which --no-workspace leaves out")
    if samples is not None and motion is None:
        raise PolypodError("--samples: there is no MOTION to sample")
    mech = load(mechanism)
    width = None if step is None else quantity("--step", step, "length")
    with progress_bar("solving", 1) as progress:
        content = gather(mech, motion, samples=samples, workspace=workspace, step=width, progress=progress)
    save(render(content, _command_line()), output)
    print_written(output)
    if content.along is not None and content.along.facts["without_answer"]:
        raise typer.Exit(1)


def _command_line() -> str:
    """The command line, for reproduction."""
    return shlex.join(["polypod", *sys.argv[1:]])
