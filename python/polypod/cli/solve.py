"""`polypod solve`: a mechanism along a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from polypod.cli.shared import (
    JsonOption,
    MechanismArgument,
    MotionArgument,
    ResultOption,
    check_result_path,
    console,
    print_json,
    print_words,
    print_written,
    progress_bar,
)

if TYPE_CHECKING:
    from polypod.mechanism import Mechanism
    from polypod.motion.motion import Motion
    from polypod.solution.solution import Solution

app = typer.Typer()


@app.command(epilog="Example: [bold]polypod solve lu-3spu-2rpu-r lu-3spu-2rpu-r -o result.nc[/bold]")
def solve(
    mechanism: MechanismArgument,
    motion: MotionArgument,
    result: ResultOption,
    samples: Annotated[
        int | None,
        typer.Option(
            min=2,
            metavar="N",
            help="Solve at N instants evenly over the motion instead of at its own.",
        ),
    ] = None,
    reactions: Annotated[
        bool, typer.Option("--reactions", help="Also save the reactions of all joints.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Solve a mechanism along a motion: kinematics, forces, power and conditioning, saved in RESULT.

    The exit status is 1 if some states have no answer.
    """
    import numpy as np

    from polypod.mechanism import load
    from polypod.motion.motion_file import load_motion
    from polypod.summary.solution_facts import summarise

    check_result_path(result, mechanism, motion)
    mech = load(mechanism)
    path = load_motion(motion, mech)
    if samples is not None:
        path = path.sample(np.linspace(path.time[0], path.time[-1], samples))
    solution = _solve_with_progress(mech, path, reactions=reactions)
    solution.save(result)
    facts = summarise(mech, solution)
    if as_json:
        print_json({**facts, "result": str(result)})
    else:
        print_solution(console(), facts)
        print_written(result)
    if facts["without_answer"]:
        raise typer.Exit(1)


def _solve_with_progress(mech: Mechanism, motion: Motion, *, reactions: bool = False) -> Solution:
    """Solves, with a bar on the terminal when there is more than a moment's work."""
    from polypod.solution.solve import CHUNK
    from polypod.solution.solve import solve as solve_motion

    if len(motion.time) <= CHUNK:
        return solve_motion(mech, motion, reactions=reactions)
    with progress_bar("solving", len(motion.time)) as progress:
        return solve_motion(mech, motion, reactions=reactions, progress=progress)


def print_solution(out: Console, facts: dict[str, Any]) -> None:
    """The summary of a solution: legs, platform, power, limits, outcomes."""
    from polypod.files.units import instant
    from polypod.summary.tables import coupled_note, motion_tables, outcome, outcomes_table

    out.print(
        f"[bold]{escape(facts['mechanism'])}[/bold] along [bold]{escape(facts['motion'])}[/bold] "
        f"({escape(facts['coordinate_set'])} coordinates): {facts['states']} states "
        f"from {instant(facts['start'])} to {instant(facts['end'])}",
        highlight=False,
    )
    for table in motion_tables(facts):
        print_words(out, table)
    if note := coupled_note(facts):
        out.print(note)
    for warning in (*facts["warnings"], *facts["singularities"]["warnings"]):
        out.print(f"[bold yellow]Warning:[/bold yellow] {escape(warning)}")
    if facts["outcomes"]:
        print_words(out, outcomes_table(facts))
        out.print(f"What they mean: polypod explain {facts['outcomes'][0]['status']}", highlight=False)
    else:
        out.print(outcome(facts))
