"""The command line. Each command is a thin layer over the functions that Python users call.

Exit status: 0 done, 1 done but some states have no answer, 2 wrong input.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from polypod.errors import PolypodError, WorkspaceError

# Commands import the rest where they need it, so that help comes at once.
if TYPE_CHECKING:
    from polypod.mechanism import Mechanism
    from polypod.motion import Motion
    from polypod.results import Solution

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    epilog="Start with: [bold]polypod demo[/bold]",
)

RESULT_SUFFIXES = (".nc", ".csv")


def main() -> None:
    """Runs the command line; whatever is wrong with the input becomes one message and exit status 2."""
    try:
        app()
    except (PolypodError, OSError) as error:
        print(f"polypod: {_readable(error)}", file=sys.stderr)
        sys.exit(2)


def _readable(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def _print_version(wanted: bool) -> None:
    if wanted:
        from polypod import __version__

        print(f"polypod {__version__}")
        raise typer.Exit


@app.callback()
def _polypod(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Kinematics and dynamics of parallel manipulators on telescopic legs."""


MechanismArgument = Annotated[
    str, typer.Argument(metavar="MECHANISM", help="A mechanism file (.toml) or a built-in mechanism's name.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables: SI units, radians.")]


# --- demo ---------------------------------------------------------------------------------------------------


@app.command(epilog="Example: [bold]polypod demo -o demo[/bold]")
def demo(
    directory: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="DIR", help="Directory for the results; made if need be."),
    ] = Path("polypod-demo"),
) -> None:
    """Solve the published manipulator along the built-in motion: tables, figures and a summary in DIR."""
    from rich.markdown import Markdown

    from polypod.demo import run_demo

    with _working("solving and drawing"):
        result = run_demo(directory)
    _console().print(Markdown(result.text))


# --- info ---------------------------------------------------------------------------------------------------


@app.command(epilog="Example: [bold]polypod info lu-3spu-2rpu-r[/bold]")
def info(
    mechanism: MechanismArgument,
    as_json: JsonOption = False,
    draw: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the mechanism at its centre pose into a .png or .svg file."),
    ] = None,
) -> None:
    """Tell what a mechanism is: freedoms, joints, constraints, coordinates, conditioning, warnings."""
    from polypod.mechanism import load
    from polypod.summary import describe

    mech = load(mechanism)
    facts = describe(mech)
    if draw is not None:
        _draw(mech, draw)
    if as_json:
        _print_json(facts)
    else:
        _print_mechanism(_console(), facts)


def _draw(mech: Mechanism, path: Path) -> None:
    from matplotlib.figure import Figure

    from polypod.plots import plot_poses, save_figure

    save_figure(plot_poses(mech, {"centre pose": mech.home}, Figure(figsize=(6.0, 6.0))), path)


def _print_mechanism(out: Console, facts: dict[str, Any]) -> None:
    mobility, accounting = facts["mobility"], facts["accounting"]
    out.print(f"[bold]{escape(facts['name'])}[/bold]  {escape(facts['description'])}")
    if facts["source"]:
        out.print(f"[dim]{escape(facts['source'])}[/dim]")

    legs = _table("Legs", "leg", "joints", "actuated", "length at home / mm>", "stroke / mm>")
    for leg in facts["legs"]:
        actuated, home = "yes" if leg["actuated"] else "no", _f(leg["home_length"], 1e3)
        legs.add_row(escape(leg["name"]), leg["joints"], actuated, home, _range_mm(leg["stroke"]))
    out.print(legs)

    table = _table("Mobility, from ranks at generic poses", "", ">", "")
    for term, key, remark in (
        ("freedoms of the platform", "dof", ""),
        ("links, with the base", "links", ""),
        ("joints", "joints", ""),
        ("joint freedoms", "joint_freedoms", ""),
        ("independent loops", "loops", f"{6 * mobility['loops']} closure equations"),
        ("rank of the loop closures", "closure_rank", ""),
        ("redundant constraints", "redundant", _of_legs("couple", mobility["redundant_legs"])),
        ("passive freedoms", "passive", _of_legs("spin of", mobility["passive_legs"])),
    ):
        table.add_row(term, str(mobility[key]), remark)
    out.print(table)

    columns = {"from ranks": accounting["computed"], "published": accounting["published"]}
    columns = {name: terms for name, terms in columns.items() if terms}
    eq1 = _table("Eq. 1:  M = 6 (n_0 - n_k - 1) + ΣM_i + ς - M_0", "", *(f"{name}>" for name in columns))
    for term, text in (
        ("6 (n_0 - n_k - 1)", str(6 * (mobility["links"] - mobility["joints"] - 1))),
        ("ΣM_i", str(mobility["joint_freedoms"])),
    ):
        eq1.add_row(term, *(text for _ in columns))
    for term, key in (("ς", "redundant"), ("M_0", "passive"), ("M", "sum")):
        eq1.add_row(term, *(str(terms[key]) for terms in columns.values()))
    out.print(eq1)
    if accounting["note"]:
        out.print(f"{accounting['note'][0].upper()}{accounting['note'][1:]}.")

    topology = _table("Links by number of joints", "kind", "number>", "links")
    for kind, names in facts["links_by_joints"].items():
        topology.add_row(kind, str(len(names)), escape(", ".join(names)))
    out.print(topology)

    if facts["constraints"]:
        constraints = _table("Constraints on the platform", "leg", "kind", "condition", "independent")
        for row in facts["constraints"]:
            constraints.add_row(
                escape(row["leg"]), row["kind"], row["condition"], "yes" if row["independent"] else "no"
            )
        out.print(constraints)

    sets = _table("Coordinate sets", "set", "coordinates")
    for name, coordinates in facts["coordinate_sets"].items():
        of = (
            f"{mobility['dof']} independent ones of "
            if name == "pose" and len(coordinates) > mobility["dof"]
            else ""
        )
        sets.add_row(name, of + ", ".join(coordinates))
    out.print(sets)

    centre = facts["centre_pose"]
    table = _table("At the centre pose", "", ">")
    table.add_row("position of o / mm", ", ".join(f"{1e3 * row[3]:.1f}" for row in centre["pose"][:3]))
    for key in ("sigma_min", "sigma_max", "condition"):
        table.add_row(_CONDITIONING[key], _g(centre[key]))
    table.add_row("characteristic length / mm", f"{1e3 * facts['characteristic_length']:.1f}")
    out.print(table)
    _print_limits(out, facts["limits"])
    for warning in facts["warnings"]:
        out.print(f"[bold yellow]Warning:[/bold yellow] {escape(warning)}")


def _print_limits(out: Console, limits: list[dict[str, Any]]) -> None:
    """What the mechanism file allows, and the slack that the centre pose leaves."""
    from polypod.units import readable

    if not limits:
        return
    table = _table("Limits", "limit", "allowed>", "slack at home>", "relative>", "")
    for row in limits:
        least, greatest = (None if end is None else readable(end, row["unit"]) for end in row["allowed"])
        if least is None or greatest is None:
            allowed = f"at most {greatest}" if least is None else f"at least {least}"
        else:
            allowed = f"{least} to {greatest}"
        slack = "none" if row["margin"] is None else readable(row["margin"], row["unit"])
        table.add_row(
            escape(row["name"]), allowed, slack, _g(row["relative"]), "binds" if row["binds"] else ""
        )
    out.print(table)


_CONDITIONING = {
    "sigma_min": "smallest singular value of the leg Jacobian",
    "sigma_max": "largest singular value",
    "condition": "condition number",
}


def _of_legs(what: str, names: tuple[str, ...]) -> str:
    if not names:
        return ""
    return escape(f"{what} leg{'s' if len(names) > 1 else ''} {', '.join(names)}")


# --- solve --------------------------------------------------------------------------------------------------


@app.command(epilog="Example: [bold]polypod solve lu-3spu-2rpu-r lu-3spu-2rpu-r -o result.nc[/bold]")
def solve(
    mechanism: MechanismArgument,
    motion: Annotated[
        str,
        typer.Argument(metavar="MOTION", help="A motion file (.csv or .toml) or a built-in motion's name."),
    ],
    result: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="RESULT", help="File for the results: .nc or .csv; it is overwritten."
        ),
    ],
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

    _check_result_path(result, mechanism, motion)
    mech = load(mechanism)
    path = load_motion(motion, mech)
    if samples is not None:
        path = path.sample(np.linspace(path.time[0], path.time[-1], samples))
    solution = _solve_with_progress(mech, path, reactions=reactions)
    solution.save(result)
    facts = summarise(mech, solution)
    if as_json:
        _print_json({**facts, "result": str(result)})
    else:
        _print_solution(_console(), facts)
        _console().print(f"Written: {escape(str(result))}", highlight=False, soft_wrap=True)
    if facts["without_answer"]:
        raise typer.Exit(1)


def _check_result_path(path: Path, *inputs: str, suffixes: tuple[str, ...] = RESULT_SUFFIXES) -> None:
    """Before any work: what would fail after it."""
    from polypod.errors import SolutionError

    if path.suffix not in suffixes:
        raise SolutionError(
            f"{path} ends in {path.suffix!r}; a result's file ends in {' or '.join(suffixes)}"
        )
    if path.exists() and any(Path(name).exists() and path.samefile(name) for name in inputs):
        raise SolutionError(f"{path} is an input; the result would overwrite it, give it another name")
    if path.is_dir():
        raise SolutionError(f"{path} is a directory; the result needs a file")
    if not path.parent.is_dir():
        raise SolutionError(
            f"{path.parent} is no directory; make it first, or choose another place for the result"
        )


def _solve_with_progress(mech: Mechanism, motion: Motion, *, reactions: bool = False) -> Solution:
    """Solves, with a bar on the terminal when there is more than a moment's work."""
    from polypod.solution import CHUNK
    from polypod.solution import solve as solve_motion

    if len(motion.time) <= CHUNK:
        return solve_motion(mech, motion, reactions=reactions)
    with _bar("solving", len(motion.time)) as progress:
        return solve_motion(mech, motion, reactions=reactions, progress=progress)


def _length_mm(leg: dict[str, Any]) -> str:
    """The lengths that a leg passes, marked where they leave its stroke."""
    if leg["length"][0] is None:
        return "none"
    return _range_mm(leg["length"]) + (" outside" if leg["outside_stroke"] else "")


def _print_solution(out: Console, facts: dict[str, Any]) -> None:
    from polypod.units import readable

    out.print(
        f"[bold]{escape(facts['mechanism'])}[/bold] along [bold]{escape(facts['motion'])}[/bold] "
        f"({escape(facts['coordinate_set'])} coordinates): {facts['states']} states "
        f"from {facts['start']:g} s to {facts['end']:g} s",
        highlight=False,
    )
    legs = _table("Legs", "leg", "length / mm>", "stroke / mm>", "peak speed / mm/s>", "peak force / N>")
    for leg in facts["legs"]:
        peaks = (_f(leg["peak_rate"], 1e3), _f(leg["peak_force"]))
        legs.add_row(escape(leg["name"]), _length_mm(leg), _range_mm(leg["stroke"]), *peaks)
    out.print(legs)

    whole = _table("Along the motion", "", ">")
    platform, power = facts["platform"], facts["power"]
    whole.add_row("peak speed of o / mm/s", _f(platform["peak_speed"], 1e3))
    whole.add_row("peak angular speed / rad/s", _g(platform["peak_angular_speed"]))
    whole.add_row("peak actuator power / W", _f(power["peak_actuators"]))
    whole.add_row("residual of the power balance / W", _g(power["greatest_residual"], 1))
    whole.add_row("... relative to the power that flows", _g(power["relative_residual"], 1))
    if coupled := facts["coupled"]:
        names = ", ".join(f"f_c{leg}" for leg in coupled["legs"])
        whole.add_row(
            escape(f"peak couple-constrained forces {names} / N"), ", ".join(map(_f, coupled["peak_forces"]))
        )
        whole.add_row("peak couple-constrained torque T_c / N m", _f(coupled["peak_torque"]))
    if nearest := facts["nearest_to_singular"]:
        whole.add_row("nearest to singular: time / s", f"{nearest['time']:g}")
        whole.add_row("... smallest singular value", _g(nearest["sigma_min"]))
        whole.add_row("... condition number", _g(nearest["condition"]))
    if limits := facts["limits"]:
        least = limits["least"]
        whole.add_row("least slack: limit", escape(least["limit"]) if least else "none")
        if least:
            whole.add_row("... slack", readable(least["margin"], least["unit"]))
            whole.add_row("... relative to the limit's scale", _g(least["relative"]))
            whole.add_row("... time / s", f"{least['time']:g}")
    out.print(whole)
    if limits and limits["passed"]:
        passed = _table("Limits that are passed", "limit", "states>", "first at / s>", "furthest>", "at / s>")
        for row in limits["passed"]:
            passed.add_row(
                escape(row["limit"]),
                str(row["states"]),
                f"{row['first_time']:g}",
                readable(-row["margin"], row["unit"]),
                f"{row['time']:g}",
            )
        out.print(passed)
    if coupled:
        out.print(f"Note: {coupled['note']}.")
    for warning in facts["singularities"]["warnings"]:
        out.print(f"[bold yellow]Warning:[/bold yellow] {escape(warning)}")

    if facts["outcomes"]:
        outcomes = _table("Outcomes other than OK", "status", "states>", "first at / s>", "meaning")
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


# --- simulate -----------------------------------------------------------------------------------------------


@app.command(
    epilog="Example: [bold]polypod simulate lu-3spu-2rpu-r --follow lu-3spu-2rpu-r --until 1 -o run.nc[/bold]"
)
def simulate(
    mechanism: MechanismArgument,
    result: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="RESULT", help="File for the results: .nc or .csv; it is overwritten."
        ),
    ],
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
    from polypod.control import ComputedTorque
    from polypod.mechanism import load
    from polypod.motion import load_motion
    from polypod.quantities import named
    from polypod.simulation import STOPS
    from polypod.summary import summarise

    _check_result_path(result, mechanism)
    mech = load(mechanism)
    motion = None if follow is None else load_motion(follow, mech)
    law = None if motion is None else ComputedTorque(load(model) if model else mech, motion, frequency)
    coordinates = dict(named("--at", text) for text in at or [])
    if motion is not None and not at:
        coordinates = {name: float(values[0]) for name, values in motion.coordinates.items()}
        branch = motion.branch
    pose = mech.home if not coordinates else _pose_at(mech, coordinates, branch)
    with _bar("simulating", 1) as progress:
        solution = mech.simulate(
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
        _print_json({**facts, "ended": end, "result": str(result)})
    else:
        _print_solution(_console(), facts)
        _console().print(f"Ended at {end['time']:.9g} s: {escape(end['reason'])}.", highlight=False)
        _console().print(f"Written: {escape(str(result))}", highlight=False, soft_wrap=True)
    if end["kind"] == "no answer":
        raise typer.Exit(1)


def _pose_at(mech: Mechanism, coordinates: dict[str, float], branch: int) -> Any:
    """The pose with these coordinates; wrong input where there is none."""
    from polypod.status import Status

    state = mech.state(coordinates, branch=branch)
    status = Status(int(state.status))
    if not status.has_answer:
        raise PolypodError(f"--at: {status.message}")
    return state.pose


# --- fk -----------------------------------------------------------------------------------------------------


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
    from polypod.lengths import load_lengths, save_table, tabulate_continued, tabulate_modes
    from polypod.mechanism import load

    if result is not None:
        _check_result_path(result, mechanism, str(lengths), suffixes=(".csv",))
    mech = load(mechanism)
    sets = load_lengths(lengths, mech)
    with _working("finding poses"):
        one = near or mode is not None
        facts = tabulate_continued(mech, sets, mode) if one else tabulate_modes(mech, sets)
    if result is not None:
        save_table(facts, mech, result)
    if as_json:
        _print_json(facts if result is None else {**facts, "result": str(result)})
    else:
        _print_poses(_console(), facts)
        if result is not None:
            _console().print(f"Written: {escape(str(result))}", soft_wrap=True)
    if facts["without_pose"] or facts["incomplete"]:
        raise typer.Exit(1)


def _print_poses(out: Console, facts: dict[str, Any]) -> None:
    """One table; narrow, so that position and status stay whole where there is room for 80 characters."""
    from polypod.units import KIND_OF_COORDINATE, from_si

    rows = [(row, mode) for row in facts["rows"] for mode in row["modes"]]
    if rows:
        coordinates = rows[0][1]["coordinates"]
        angles = [name for name in coordinates if KIND_OF_COORDINATE[name] == "angle"]
        headers = ["row>", "mode>", "o / mm>", *(f"{name} / deg>" for name in angles)]
        poses = _table(f"Poses of {escape(facts['mechanism'])}", *headers, "side", "det J", "status")
        poses.box, poses.pad_edge, poses.collapse_padding = None, False, True
        poses.columns[2].no_wrap, poses.columns[-1].overflow = True, "fold"
        for row, mode in rows:
            position = ", ".join(f"{1e3 * line[3]:.1f}" for line in mode["pose"][:3])
            turns = [mode["coordinates"][name] for name in angles]
            poses.add_row(
                str(row["row"]),
                str(mode["mode"]),
                position,
                *(_f(None if turn is None else from_si(turn, "angle", "deg")) for turn in turns),
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


# --- workspace ----------------------------------------------------------------------------------------------


class Kind(StrEnum):
    """What `polypod workspace` finds."""

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
        typer.Option(metavar="NAME=FROM:TO", help="Bounds of a coordinate, such as z=0.2:900mm; repeatable."),
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
        typer.Option("-o", "--output", metavar="FILE", help="Save the boundary (.stl, .ply) or all (.nc)."),
    ] = None,
    draw: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it into a .png or .svg file.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find where a mechanism can go within its limits: extents, volume, what ends it; meshes and figures.

    Values without a unit are in m and rad.
    """
    from polypod.mechanism import load
    from polypod.quantities import interval, named, names_of, steps_of

    names = None if vary is None else names_of(vary)
    kind = kind or (Kind.SLICE if names else Kind.REACHABLE)
    _check_workspace_options(kind, names, fix, output, draw, bounds, keep_aspect)
    mech = load(mechanism)
    widths = steps_of(step or [])
    if kind is Kind.LATTICE:
        if isinstance(widths, dict):
            raise WorkspaceError(
                f"--step: the step of lengths is one number, not one for {next(iter(widths))}"
            )
        with _bar("length lattice", 1) as progress:
            lattice = mech.length_lattice(
                step=widths,
                bounds=dict(interval("--bounds", text) for text in bounds or []),
                sigma_min=sigma_min,
                threads=threads,
                progress=progress,
            )
        _print_json(lattice.facts()) if as_json else _print_lattice(_console(), lattice.facts())
        return
    with _bar(f"{kind} workspace", 1) as progress:
        found = mech.workspace(
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
        _print_json(found.facts())
        return
    _print_workspace(_console(), found.facts())
    for path in (output, draw):
        if path is not None:
            _console().print(f"Written: {escape(str(path))}", highlight=False, soft_wrap=True)


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
    from polypod.workspace import check_suffix

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
        check_suffix(output, len(names or "xyz"))
    if draw is not None and draw.suffix not in (".png", ".svg"):
        raise WorkspaceError(f"{draw} ends in {draw.suffix!r}; a figure's file ends in .png or .svg")


def _print_workspace(out: Console, facts: dict[str, Any]) -> None:
    from polypod.units import coordinate_unit, readable

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
    table = _table("Extents", "", "least>", "greatest>", "width>", "step>")
    for name, (low, high) in facts["extents"].items():
        values = (low, high, high - low, facts["step"][name])
        table.add_row(name, *(readable(value, coordinate_unit(name)) for value in values))
    out.print(table)
    word = "volume" if len(facts["extents"]) == 3 else "area"
    out.print(
        f"{word}: {facts['volume']:.5g} ± {facts['volume_error']:.1g} {facts['volume_unit']}", highlight=False
    )
    ends = _table("What ends it", "", "part of the boundary>")
    for name, share in facts["boundary"].items():
        ends.add_row(escape(name), f"{100 * share:.1f} %")
    out.print(ends)


def _print_lattice(out: Console, facts: dict[str, Any]) -> None:
    from polypod.units import readable

    out.print(
        f"[bold]{escape(facts['mechanism'])}[/bold]: lattice of leg lengths, steps of "
        f"{readable(facts['step'], 'm')}, "
        f"{facts['inside']} of {facts['nodes']} combinations inside all limits, {facts['poses']} poses",
        highlight=False,
    )
    table = _table("Extents of o", "", "least>", "greatest>", "width>")
    for name, (low, high) in facts["extents"].items():
        table.add_row(name, *(readable(value, "m") for value in (low, high, high - low)))
    out.print(table)


# --- printing -----------------------------------------------------------------------------------------------


def _console() -> Console:
    return Console(highlight=False)


def _table(title: str, *headers: str) -> Table:
    """A table with its columns' headers; `>` at the end of one puts its column to the right."""
    table = Table(
        title=title, title_justify="left", title_style="bold", show_header=any(map(_plain, headers))
    )
    for header in headers:
        table.add_column(_plain(header), justify="right" if header.endswith(">") else "left")
    return table


def _plain(header: str) -> str:
    return header.removesuffix(">")


def _range_mm(limits: list[float | None]) -> str:
    low, high = (_f(value, 1e3) for value in limits)
    return "free" if limits == [None, None] else f"{low} to {high}"


def _f(value: float | None, scale: float = 1.0) -> str:
    """One decimal, as readings have."""
    return "none" if value is None else f"{scale * value:.1f}"


def _g(value: float | None, digits: int = 3) -> str:
    return "none" if value is None else f"{value:.{digits}g}"


def _print_json(data: Any) -> None:
    print(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False))


@contextmanager
def _working(text: str) -> Iterator[None]:
    """A sign of life on the terminal, on standard error."""
    console = Console(stderr=True)
    if console.is_terminal:
        with console.status(text):
            yield
    else:
        yield


@contextmanager
def _bar(text: str, total: int) -> Iterator[Callable[[float, float], None]]:
    """A progress bar on standard error, on a terminal only."""
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(text, total=total)

        def update(done: float, of: float) -> None:
            progress.update(task, completed=done, total=of)

        yield update


# --- commands with files of their own -----------------------------------------------------------------------

import polypod.cli_verify  # noqa: E402, F401 - adds its command to those above
