"""`polypod fk`: the poses that have given leg lengths."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape

from polypod.cli.shared import (
    JsonOption,
    MechanismArgument,
    check_result_path,
    console,
    fixed,
    new_table,
    print_json,
    print_written,
    working,
)

if TYPE_CHECKING:
    from polypod.solution.poses_of_lengths import PosesOfLengths

app = typer.Typer()


@app.command(epilog="Example: [bold]polypod fk lu-3spu-2rpu-r lengths.csv -o poses.csv[/bold]")
def fk(
    mechanism: MechanismArgument,
    lengths: Annotated[
        Path,
        typer.Argument(
            metavar="LENGTHS",
            help="A .csv file: a header such as 1 [mm], 2 [mm], ... and rows of leg lengths.",
        ),
    ],
    result: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="RESULT", help="Table of the poses, .csv; it is overwritten."),
    ] = None,
    near: Annotated[
        bool, typer.Option("--near", help="Follow one pose from home along the rows instead of finding all.")
    ] = False,
    mode: Annotated[
        int | None,
        typer.Option(
            "--follow",
            min=1,
            metavar="MODE",
            help="The same from this mode of the first row instead of home.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the poses that have given leg lengths: all assembly modes, or one that is followed along the rows.

    The exit status is 1 if a row has no pose, or if one of its poses may be missing.
    """
    from polypod.mechanism import load
    from polypod.solution.poses_of_lengths import all_modes, followed, load_lengths

    if result is not None:
        check_result_path(result, mechanism, str(lengths), suffixes=(".csv",))
    mech = load(mechanism)
    sets = load_lengths(lengths, mech)
    with working("finding poses"):
        one = near or mode is not None
        poses = followed(mech, sets, mode) if one else all_modes(mech, sets)
    if result is not None:
        poses.save(result)
    if as_json:
        print_json(poses.facts() if result is None else {**poses.facts(), "result": str(result)})
    else:
        _print_poses(console(), poses)
        if result is not None:
            print_written(result)
    if poses.without_pose or poses.incomplete:
        raise typer.Exit(1)


MOST_POSES = 40
"""Poses that a table shows, and rows without an answer that are told: more is no longer read on a screen."""


def _print_poses(out: Console, found: PosesOfLengths) -> None:
    """One table; narrow, so that position and status stay whole where there is room for 80 characters."""
    import numpy as np

    from polypod.answers.status import Status
    from polypod.files.units import from_si

    total = len(found.pose)
    if total:
        rotation = {name: from_si(q[:MOST_POSES], "angle", "deg") for name, q in found.rotation.items()}
        headers = ["row>", "mode>", "o / mm>", *(f"{name} / deg>" for name in rotation)]
        table = new_table(f"Poses of {escape(found.mech.name)}", *headers, "side", "det J", "status")
        table.box, table.pad_edge, table.collapse_padding = None, False, True
        table.columns[2].no_wrap, table.columns[-1].overflow = True, "fold"
        rows = found.row
        for i in range(min(total, MOST_POSES)):
            table.add_row(
                str(rows[i]),
                str(found.mode[i]),
                ", ".join(f"{1e3 * x:.1f}" for x in found.pose[i, :3, 3]),
                *(fixed(float(q[i]) if np.isfinite(q[i]) else None) for q in rotation.values()),
                {1.0: "above", 0.0: "below"}.get(float(found.above[i]), ""),
                {1.0: "+", 0.0: "0", -1.0: "-"}.get(float(found.determinant_sign[i]), ""),
                Status(int(found.status[i])).name,
            )
        out.print(table)
        if total > MOST_POSES:
            out.print(
                f"... and {total - MOST_POSES} more, {total} poses of {len(found.number)} rows in all: "
                "-o FILE.csv writes all, --json prints them.",
                highlight=False,
            )
    told = np.flatnonzero((found.number == 0) | (found.row_status != Status.OK))
    for row in told[:MOST_POSES].tolist():
        status, said = Status(int(found.row_status[row])), []
        if not found.number[row]:
            said.append("no pose has these lengths" if status == Status.OK else "no pose was found")
        if status != Status.OK:
            said.append(f"{status.name}: {status.message}")
        out.print(f"Row {row + 1}: {escape('; '.join(said))}", soft_wrap=True)
    if len(told) > MOST_POSES:
        out.print(
            f"... and {len(told) - MOST_POSES} more: {found.without_pose} of {len(found.number)} rows "
            f"have no pose, and {found.incomplete} may lack one.",
            soft_wrap=True,
            highlight=False,
        )
