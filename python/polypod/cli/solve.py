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
    fixed,
    new_table,
    print_json,
    print_written,
    progress_bar,
    range_mm,
    significant,
)

if TYPE_CHECKING:
    from polypod.mechanism import Mechanism
    from polypod.motion import Motion
    from polypod.results import Solution

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
    from polypod.motion import load_motion
    from polypod.summary import summarise

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
    from polypod.solution import CHUNK
    from polypod.solution import solve as solve_motion

    if len(motion.time) <= CHUNK:
        return solve_motion(mech, motion, reactions=reactions)
    with progress_bar("solving", len(motion.time)) as progress:
        return solve_motion(mech, motion, reactions=reactions, progress=progress)


def _length_mm(leg: dict[str, Any]) -> str:
    """The lengths that a leg passes, marked where they leave its stroke."""
    if leg["length"][0] is None:
        return "none"
    return range_mm(leg["length"]) + (" outside" if leg["outside_stroke"] else "")


def print_solution(out: Console, facts: dict[str, Any]) -> None:
    """The summary of a solution: legs, platform, power, limits, outcomes."""
    out.print(
        f"[bold]{escape(facts['mechanism'])}[/bold] along [bold]{escape(facts['motion'])}[/bold] "
        f"({escape(facts['coordinate_set'])} coordinates): {facts['states']} states "
        f"from {facts['start']:g} s to {facts['end']:g} s",
        highlight=False,
    )
    legs = new_table("Legs", "leg", "length / mm>", "stroke / mm>", "peak speed / mm/s>", "peak force / N>")
    for leg in facts["legs"]:
        peaks = (fixed(leg["peak_rate"], 1e3), fixed(leg["peak_force"]))
        legs.add_row(escape(leg["name"]), _length_mm(leg), range_mm(leg["stroke"]), *peaks)
    out.print(legs)
    _print_whole(out, facts)
    _print_limits(out, facts["limits"])
    if coupled := facts["coupled"]:
        out.print(f"Note: {coupled['note']}.")
    for warning in facts["singularities"]["warnings"]:
        out.print(f"[bold yellow]Warning:[/bold yellow] {escape(warning)}")
    _print_outcomes(out, facts)


def _print_whole(out: Console, facts: dict[str, Any]) -> None:
    from polypod.units import readable

    whole = new_table("Along the motion", "", ">")
    platform, power = facts["platform"], facts["power"]
    whole.add_row("peak speed of o / mm/s", fixed(platform["peak_speed"], 1e3))
    whole.add_row("peak angular speed / rad/s", significant(platform["peak_angular_speed"]))
    whole.add_row("peak actuator power / W", fixed(power["peak_actuators"]))
    whole.add_row("residual of the power balance / W", significant(power["greatest_residual"], 1))
    whole.add_row("... relative to the power that flows", significant(power["relative_residual"], 1))
    if coupled := facts["coupled"]:
        names = ", ".join(f"f_c{leg}" for leg in coupled["legs"])
        whole.add_row(
            escape(f"peak couple-constrained forces {names} / N"),
            ", ".join(map(fixed, coupled["peak_forces"])),
        )
        whole.add_row("peak couple-constrained torque T_c / N m", fixed(coupled["peak_torque"]))
    if nearest := facts["nearest_to_singular"]:
        whole.add_row("nearest to singular: time / s", f"{nearest['time']:g}")
        whole.add_row("... smallest singular value", significant(nearest["sigma_min"]))
        whole.add_row("... condition number", significant(nearest["condition"]))
    if limits := facts["limits"]:
        least = limits["least"]
        whole.add_row("least slack: limit", escape(least["limit"]) if least else "none")
        if least:
            whole.add_row("... slack", readable(least["margin"], least["unit"]))
            whole.add_row("... relative to the limit's scale", significant(least["relative"]))
            whole.add_row("... time / s", f"{least['time']:g}")
    out.print(whole)


def _print_limits(out: Console, limits: dict[str, Any] | None) -> None:
    """The limits that the motion passes."""
    from polypod.units import readable

    if not limits or not limits["passed"]:
        return
    passed = new_table("Limits that are passed", "limit", "states>", "first at / s>", "furthest>", "at / s>")
    for row in limits["passed"]:
        passed.add_row(
            escape(row["limit"]),
            str(row["states"]),
            f"{row['first_time']:g}",
            readable(-row["margin"], row["unit"]),
            f"{row['time']:g}",
        )
    out.print(passed)


def _print_outcomes(out: Console, facts: dict[str, Any]) -> None:
    """The states without an answer, or how good all of them are."""
    limits = facts["limits"]
    if facts["outcomes"]:
        outcomes = new_table("Outcomes other than OK", "status", "states>", "first at / s>", "meaning")
        for row in facts["outcomes"]:
            outcomes.add_row(
                row["status"], str(row["count"]), f"{row['first_time']:g}", escape(row["message"])
            )
        out.print(outcomes)
    elif not limits:
        out.print("All states have an answer; the mechanism file sets no limits.")
    elif limits["passed"]:
        out.print("All states have an answer, but some are beyond a limit.")
    else:
        out.print("All states have an answer, within all limits.")
