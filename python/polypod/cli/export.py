"""`polypod export`: a mechanism or the results of a motion in the formats of other tools."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from polypod.cli.shared import (
    JsonOption,
    MechanismArgument,
    check_result_path,
    console,
    pose_at,
    print_json,
    print_written,
    working,
)
from polypod.errors import ExportError

if TYPE_CHECKING:
    from polypod.export.formats import Look

app = typer.Typer()


class To(StrEnum):
    """A format."""

    MJCF = "mjcf"
    SDF = "sdf"
    URDF = "urdf"
    GLB = "glb"
    STL = "stl"
    CSV = "csv"
    NETCDF = "netcdf"
    MAT = "mat"


@app.command(
    epilog="Example: [bold]polypod export lu-3spu-2rpu-r -o lu.xml[/bold]\n\n"
    "An animation: [bold]polypod export lu-3spu-2rpu-r lu-3spu-2rpu-r -o lu.glb[/bold]"
)
def export(
    mechanism: MechanismArgument,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="The file; it is overwritten. Its suffix determines the format: .xml (MJCF), .sdf, .urdf, "
            ".glb, .stl, .csv, .nc, .mat. Meshes and the loop closures of a URDF are written beside it.",
        ),
    ],
    motion: Annotated[
        str | None,
        typer.Argument(
            metavar="[MOTION]",
            help="A motion file or a built-in motion: animated in .glb; .csv, .nc and .mat hold its results.",
        ),
    ] = None,
    to: Annotated[To | None, typer.Option(help="The format, whatever the suffix.")] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Coordinate of the pose in .glb and .stl, and of a keyframe in MJCF, such as alpha=10deg; "
            "repeatable. By default the centre pose.",
        ),
    ] = None,
    branch: Annotated[int, typer.Option(help="Of that pose: +1 or -1, the sign of sin γ.")] = 1,
    meshes: Annotated[
        bool, typer.Option("--meshes/--no-meshes", help="Meshes in model files, or simple shapes.")
    ] = True,
    bare: Annotated[bool, typer.Option("--bare", help="Model files without anything to look at.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a mechanism, or what it does along a motion, for another tool: physics engines, viewers, MATLAB.

    What a format leaves out is printed, and stands in the file if it can hold comments.
    """
    from polypod.cli.quantities import named
    from polypod.export.formats import FORMATS, format_of
    from polypod.export.formats import export as write
    from polypod.mechanism import load
    from polypod.motion.motion_file import load_motion

    name = format_of(output, None if to is None else to.value)
    suffixes = FORMATS[name].suffixes if to is None else (output.suffix,)
    check_result_path(output, mechanism, *([motion] if motion else []), suffixes=suffixes)
    if bare and not meshes:
        raise ExportError("--bare leaves out all shapes; --no-meshes asks for simple ones")
    mech = load(mechanism)
    pose = pose_at(mech, dict(named("--at", text) for text in at), branch) if at else None
    path = None if motion is None else load_motion(motion, mech)
    with working("writing"):
        look: Look = "none" if bare else "meshes" if meshes else "simple"
        done = write(mech, output, name, motion=path, pose=pose, look=look)
    if as_json:
        files = [str(file) for file in done.files]
        print_json({"mechanism": mech.name, "format": name, "files": files, "notes": done.notes})
        return
    for note in done.notes:
        text = f"[bold yellow]Note:[/bold yellow] {escape(note[0].upper() + note[1:])}"
        console().print(text, highlight=False)
    print_written(output)
    if beside := done.files[1:]:
        console().print(f"Beside it: {escape(', '.join(_short(beside)))}", soft_wrap=True)


def _short(files: tuple[Path, ...]) -> list[str]:
    """Single files by name, those of a folder as a number."""
    folders: dict[Path, int] = {}
    for file in files:
        folders[file.parent] = folders.get(file.parent, 0) + 1
    return [
        f"{count} files in {folder}" if count > 1 else str(next(f for f in files if f.parent == folder))
        for folder, count in folders.items()
    ]
