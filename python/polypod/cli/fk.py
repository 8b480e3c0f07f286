"""`polypod fk`: the poses that have given leg lengths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

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
    from polypod.solution.poses_of_lengths import load_lengths, save_table, tabulate_continued, tabulate_modes

    if result is not None:
        check_result_path(result, mechanism, str(lengths), suffixes=(".csv",))
    mech = load(mechanism)
    sets = load_lengths(lengths, mech)
    with working("finding poses"):
        one = near or mode is not None
        facts = tabulate_continued(mech, sets, mode) if one else tabulate_modes(mech, sets)
    if result is not None:
        save_table(facts, mech, result)
    if as_json:
        print_json(facts if result is None else {**facts, "result": str(result)})
    else:
        _print_poses(console(), facts)
        if result is not None:
            print_written(result)
    if facts["without_pose"] or facts["incomplete"]:
        raise typer.Exit(1)


def _print_poses(out: Console, facts: dict[str, Any]) -> None:
    """One table; narrow, so that position and status stay whole where there is room for 80 characters."""
    from polypod.files.units import KIND_OF_COORDINATE, from_si

    rows = [(row, mode) for row in facts["rows"] for mode in row["modes"]]
    if rows:
        coordinates = rows[0][1]["coordinates"]
        angles = [name for name in coordinates if KIND_OF_COORDINATE[name] == "angle"]
        headers = ["row>", "mode>", "o / mm>", *(f"{name} / deg>" for name in angles)]
        poses = new_table(f"Poses of {escape(facts['mechanism'])}", *headers, "side", "det J", "status")
        poses.box, poses.pad_edge, poses.collapse_padding = None, False, True
        poses.columns[2].no_wrap, poses.columns[-1].overflow = True, "fold"
        for row, mode in rows:
            position = ", ".join(f"{1e3 * line[3]:.1f}" for line in mode["pose"][:3])
            turns = [mode["coordinates"][name] for name in angles]
            poses.add_row(
                str(row["row"]),
                str(mode["mode"]),
                position,
                *(fixed(None if turn is None else from_si(turn, "angle", "deg")) for turn in turns),
                {True: "above", False: "below", None: ""}[mode["above"]],
                {1: "+", 0: "0", -1: "-", None: ""}[mode["determinant_sign"]],
                mode["status"],
            )
        out.print(poses)
    for row in facts["rows"]:
        said = []
        if not row["modes"]:
            said.append("no pose has these lengths" if row["status"] == "OK" else "no pose was found")
        if row["status"] != "OK":
            said.append(f"{row['status']}: {row['message']}")
        if said:
            out.print(f"Row {row['row']}: {escape('; '.join(said))}", soft_wrap=True)
