"""`polypod simulate`: a mechanism that falls, or follows a motion."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.markup import escape

from polypod.cli.shared import (
    JsonOption,
    MechanismArgument,
    ResultOption,
    check_result_path,
    console,
    pose_at,
    print_json,
    print_written,
    progress_bar,
)
from polypod.cli.solve import print_solution

app = typer.Typer()


@app.command(
    epilog="Example: [bold]polypod simulate lu-3spu-2rpu-r --follow lu-3spu-2rpu-r --until 1 -o run.nc[/bold]"
)
def simulate(
    mechanism: MechanismArgument,
    result: ResultOption,
    until: Annotated[float, typer.Option(metavar="T", help="Last time, s.")],
    step: Annotated[float, typer.Option(metavar="T", help="Time between states of the result, s.")] = 0.01,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Coordinate of the pose at the start, such as alpha=10deg; repeatable. By default the "
            "centre pose, or that of the motion to follow.",
        ),
    ] = None,
    branch: Annotated[int, typer.Option(help="Of the pose at the start: +1 or -1, the sign of sin γ.")] = 1,
    follow: Annotated[
        str | None,
        typer.Option(metavar="MOTION", help="Follow a motion by computed torque; else there are no forces."),
    ] = None,
    frequency: Annotated[
        float, typer.Option(metavar="X", help="Of the decay of errors when following, rad/s.")
    ] = 20.0,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="What the controller takes for the mechanism: the same by default."
        ),
    ] = None,
    tolerance: Annotated[float, typer.Option(metavar="X", help="Of the integration, relative.")] = 1e-8,
    go_on: Annotated[bool, typer.Option("--go-on", help="Pass limits and singularities.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate a mechanism from rest, falling or following a motion, and save the motion in RESULT.

    It ends at the first limit or singularity. The exit status is 1 if it ends without an answer.
    """
    from polypod.cli.quantities import named
    from polypod.mechanism import load
    from polypod.motion.motion_file import load_motion
    from polypod.solution.computed_torque import ComputedTorque
    from polypod.solution.simulate import STOPS
    from polypod.solution.simulate import simulate as run
    from polypod.summary.solution_facts import summarise

    check_result_path(result, mechanism)
    mech = load(mechanism)
    motion = None if follow is None else load_motion(follow, mech)
    law = None if motion is None else ComputedTorque(load(model) if model else mech, motion, frequency)
    coordinates = dict(named("--at", text) for text in at or [])
    if motion is not None and not at:
        coordinates = {name: float(values[0]) for name, values in motion.coordinates.items()}
        branch = motion.branch
    pose = mech.home if not coordinates else pose_at(mech, coordinates, branch)
    with progress_bar("simulating", 1) as progress:
        solution = run(
            mech,
            pose,
            forces=law,
            until=until,
            step=step,
            tolerance=tolerance,
            stop=() if go_on else STOPS,
            progress=progress,
        )
    solution.save(result)
    facts, end = summarise(mech, solution), solution.end or {}
    if as_json:
        print_json({**facts, "ended": end, "result": str(result)})
    else:
        print_solution(console(), facts)
        console().print(f"Ended at {end['time']:.9g} s: {escape(end['reason'])}.", highlight=False)
        print_written(result)
    if end["kind"] == "no answer":
        raise typer.Exit(1)
