"""`polypod verify`: the answers along a motion against other engines."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from polypod.cli.shared import (
    JsonOption,
    MechanismArgument,
    MotionArgument,
    console,
    new_table,
    print_json,
    progress_bar,
    significant,
)

app = typer.Typer()


@app.command(
    epilog="Example: [bold]polypod verify lu-3spu-2rpu-r lu-3spu-2rpu-r[/bold]\n\n"
    "The engines come with: [bold]pip install polypod\\[verify][/bold]"
)
def verify(
    mechanism: MechanismArgument,
    motion: MotionArgument,
    engine: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Engine: pinocchio (the default), exudyn, mujoco; repeatable."),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(metavar="X", help="Largest relative error that counts as agreement; 1e-9 by default."),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            min=2, metavar="N", help="Compare at N instants evenly over the motion instead of at its own."
        ),
    ] = None,
    integration: Annotated[
        bool,
        typer.Option(
            "--integrate", help="Also apply the forces in Exudyn over time, with steps that are halved."
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Compare all quantities along a motion with other engines, which know the mechanism file alone.

    The exit status is 1 if an error exceeds the tolerance or a state has no answer to compare.
    """
    import numpy as np

    from polypod.mechanism import load
    from polypod.motion.motion_file import load_motion
    from polypod.verify import TOLERANCE, integrate
    from polypod.verify import verify as verify_motion

    mech = load(mechanism)
    path = load_motion(motion, mech)
    compared = path
    if samples is not None:
        compared = path.sample(np.linspace(path.time[0], path.time[-1], samples))
    with progress_bar("comparing", len(compared.time)) as progress:
        found = verify_motion(
            mech,
            compared,
            engine or ("pinocchio",),
            TOLERANCE if tolerance is None else tolerance,
            progress=progress,
        )
    facts = found.facts()
    if integration:
        with progress_bar("integrating", 1) as progress:
            followed = integrate(mech, path, progress=progress)
        facts["integration"] = followed.facts()
        facts["agrees"] = found.agrees and followed.agrees
    if as_json:
        print_json(facts)
    else:
        _print_verification(console(), facts)
    if not facts["agrees"]:
        raise typer.Exit(1)


def _print_verification(out: Console, facts: dict[str, Any]) -> None:
    from polypod.verify.verdict import verdict

    out.print(
        f"[bold]{escape(facts['mechanism'])}[/bold] along [bold]{escape(facts['motion'])}[/bold]",
        highlight=False,
    )
    for engine in facts["engines"]:
        title = f"Errors against {engine['engine']} {engine['version']}"
        headers = ("max error>", "rms>", "relative>", "rms>", "at / s>", "part")
        table = new_table(title, "", "unit", *headers, "")
        table.box, table.pad_edge, table.collapse_padding = None, False, True
        for row in engine["quantities"]:
            errors = (row[key] for key in ("max", "rms", "relative_max", "relative_rms"))
            time, part = row["worst"]["time"], row["worst"]["part"]
            table.add_row(
                "≈ " * row["approximate"] + row["title"],
                escape(row["unit"]),
                *(significant(error, 2) for error in errors),
                significant(time),
                escape(part),
                "" if row["agrees"] else "[bold red]exceeds[/bold red]",
            )
        out.print(table)
        colour = "green" if engine["agrees"] else "red"
        out.print(f"[bold {colour}]{escape(verdict(facts, engine))}[/bold {colour}]")
        for note in engine["notes"]:
            out.print(escape(note), highlight=False)
    if "integration" in facts:
        _print_integration(out, facts["integration"])
    out.print(f"Relative errors are relative to {facts['relative_to']}.")


def _print_integration(out: Console, facts: dict[str, Any]) -> None:
    from polypod.verify.verdict import integration_verdict

    headers = ("position / m>", "rotation / rad>", "legs / m>", "order>")
    table = new_table("The motion under the forces, by step", "step / s>", *headers)
    table.box, table.pad_edge = None, False
    for row in facts["steps"]:
        errors = (row["errors"][key] for key in ("position", "rotation", "lengths"))
        order = "" if row["order"] is None else f"{row['order']:.2f}"
        table.add_row(significant(row["step"]), *(significant(error, 2) for error in errors), order)
    out.print(table)
    colour = "green" if facts["agrees"] else "red"
    out.print(f"[bold {colour}]{escape(integration_verdict(facts))}[/bold {colour}]")
