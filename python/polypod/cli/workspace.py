"""`polypod workspace`: where a mechanism can go."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from polypod.cli.shared import (
    JsonOption,
    MechanismArgument,
    console,
    new_table,
    print_json,
    print_words,
    print_written,
    progress_bar,
)
from polypod.errors import WorkspaceError

app = typer.Typer()


class Kind(StrEnum):
    """Kinds of result of `polypod workspace`."""

    REACHABLE = "reachable"
    SLICE = "slice"
    LATTICE = "lattice"


@app.command(
    epilog="Example: [bold]polypod workspace lu-3spu-2rpu-r --step 20mm -o workspace.stl[/bold]\n\n"
    "Tilt at a point: [bold]polypod workspace lu-3spu-2rpu-r --vary azimuth,tilt "
    "--fix x=0 --fix y=100mm --fix z=700mm[/bold]"
)
def workspace(
    mechanism: MechanismArgument,
    kind: Annotated[
        Kind | None,
        typer.Option(
            help="All positions whatever the orientation, some coordinates over fixed others, or all "
            "positions for a lattice of leg lengths; by default a slice if coordinates vary.",
        ),
    ] = None,
    vary: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Slice: coordinates that vary, such as x,y,z.")
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE", help="Slice: a fixed coordinate, such as alpha=10deg; repeatable."
        ),
    ] = None,
    step: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]VALUE", help="Cell width or step of lengths, such as 20mm; repeatable by name."
        ),
    ] = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FROM:TO", help="Bounds of a coordinate, such as z=200mm:900mm; repeatable."
        ),
    ] = None,
    branch: Annotated[int, typer.Option(help="Slice: +1 or -1, the sign of sin γ.")] = 1,
    keep_aspect: Annotated[
        bool, typer.Option("--keep-aspect", help="Only what is reached without crossing a singularity.")
    ] = False,
    sigma_min: Annotated[
        float | None, typer.Option(metavar="X", help="Floor for the smallest singular value.")
    ] = None,
    threads: Annotated[int, typer.Option(metavar="N", help="Threads; 0 for those of batches.")] = 0,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Save the boundary (.stl, .ply, .glb) or all (.nc)."
        ),
    ] = None,
    draw: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it into a .png or .svg file.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find where a mechanism can go within its limits: extents, volume, what ends it; meshes and figures.

    Values without a unit are in m and rad.
    """
    from polypod.cli.quantities import interval, named, names_of, steps_of
    from polypod.mechanism import load
    from polypod.workspaces.length_lattice import length_lattice
    from polypod.workspaces.search import workspace as find

    names = None if vary is None else names_of(vary)
    kind = kind or (Kind.SLICE if names else Kind.REACHABLE)
    _check_workspace_options(kind, names, fix, output, draw, bounds, keep_aspect)
    mech = load(mechanism)
    widths = steps_of(step or [], names or ("x", "y", "z"))
    if kind is Kind.LATTICE:
        if isinstance(widths, dict):
            raise WorkspaceError(
                f"--step: the step of lengths is one number, not one for {next(iter(widths))}"
            )
        with progress_bar("length lattice", 1) as progress:
            lattice = length_lattice(
                mech,
                step=widths,
                bounds=dict(interval("--bounds", text) for text in bounds or []),
                sigma_min=sigma_min,
                threads=threads,
                progress=progress,
            )
        print_json(lattice.facts()) if as_json else _print_lattice(console(), lattice.facts())
        return
    with progress_bar(f"{kind} workspace", 1) as progress:
        found = find(
            mech,
            names,
            dict(named("--fix", text) for text in fix or []),
            step=widths,
            bounds=dict(interval("--bounds", text) for text in bounds or []),
            branch=branch,
            keep_aspect=keep_aspect,
            sigma_min=sigma_min,
            threads=threads,
            progress=progress,
        )
    if output is not None:
        found.save(output)
    if draw is not None:
        from matplotlib.figure import Figure

        from polypod.plots import plot_workspace, save_figure

        size = (8.0, 7.4) if len(found.names) == 3 else (5.6, 5.2)
        save_figure(plot_workspace(found, Figure(figsize=size)), draw)
    if as_json:
        print_json(found.facts())
        return
    _print_workspace(console(), found.facts())
    for path in (output, draw):
        if path is not None:
            print_written(path)


def _check_workspace_options(
    kind: Kind,
    names: list[str] | None,
    fix: list[str] | None,
    output: Path | None,
    draw: Path | None,
    bounds: list[str] | None,
    keep_aspect: bool,
) -> None:
    """Before any work: options that do not go together, and files that could not be written after it."""
    from polypod.workspaces.workspace import check_suffix

    if kind is Kind.SLICE and not names:
        raise WorkspaceError("--kind slice needs --vary, such as --vary x,y,z")
    if kind is not Kind.SLICE and (names or fix):
        raise WorkspaceError(f"{'--vary' if names else '--fix'} is for slices, not for --kind {kind}")
    if kind is Kind.LATTICE:
        for option, given in (
            ("--output", output),
            ("--draw", draw),
            ("--keep-aspect", keep_aspect),
        ):
            if given:
                why = "is within one aspect anyway" if option == "--keep-aspect" else "gives sizes only"
                raise WorkspaceError(f"{option} is not for --kind lattice, which {why}")
    for path in (output, draw):
        if path is not None and not path.parent.is_dir():
            raise WorkspaceError(f"{path.parent} is no directory; make it first")
    if output is not None:
        check_suffix(output, names or tuple("xyz"))
    if draw is not None and draw.suffix not in (".png", ".svg"):
        raise WorkspaceError(f"{draw} ends in {draw.suffix!r}; a figure's file ends in .png or .svg")


def _print_workspace(out: Console, facts: dict[str, Any]) -> None:
    from polypod.files.units import coordinate_unit, readable
    from polypod.summary.tables import ends_table, extent_limits_table, extents_table

    fixed = ", ".join(
        f"{name} = {readable(value, coordinate_unit(name))}" for name, value in facts.get("fixed", {}).items()
    )
    what = (
        "reachable workspace" if facts["kind"] == "reachable" else f"slice at {fixed}" if fixed else "slice"
    )
    out.print(
        f"[bold]{escape(facts['mechanism'])}[/bold]: {escape(what)}, "
        f"{facts['inside']} of {facts['nodes']} nodes",
        highlight=False,
    )
    print_words(out, extents_table(facts))
    print_words(out, extent_limits_table(facts))
    print_words(out, ends_table(facts))


def _print_lattice(out: Console, facts: dict[str, Any]) -> None:
    from polypod.files.units import readable

    out.print(
        f"[bold]{escape(facts['mechanism'])}[/bold]: lattice of leg lengths, steps of "
        f"{readable(facts['step'], 'm')}, "
        f"{facts['inside']} of {facts['nodes']} combinations inside all limits, {facts['poses']} poses",
        highlight=False,
    )
    table = new_table("Extents of o", "", "least>", "greatest>", "width>")
    for name, (low, high) in facts["extents"].items():
        table.add_row(name, *(readable(value, "m") for value in (low, high, high - low)))
    out.print(table)
