"""`polypod view`: a live page of a mechanism, or one that plays a motion without a server."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from polypod.cli.shared import MechanismArgument, console, print_written, working

app = typer.Typer()


@app.command(
    epilog="Example: [bold]polypod view lu-3spu-2rpu-r lu-3spu-2rpu-r[/bold]\n\n"
    "A page for others: [bold]polypod view lu-3spu-2rpu-r lu-3spu-2rpu-r --static scene.html[/bold]"
)
def view(
    mechanism: MechanismArgument,
    motion: Annotated[
        str | None,
        typer.Argument(metavar="[MOTION]", help="A motion file (.csv or .toml) or a built-in motion's name."),
    ] = None,
    static: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write a page (.html) that plays by itself, and end; it is overwritten.",
        ),
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")] = 8080,
) -> None:
    """Show a mechanism in the browser: move it by its coordinates or its legs, play a motion.

    The page is there until Ctrl-C. It needs the optional package viser.
    """
    from polypod.mechanism import load
    from polypod.motion.motion_file import load_motion
    from polypod.viewer.server import LOCAL, Viewer
    from polypod.viewer.static import check_static_path, write_static
    from polypod.viewer.viser_access import require_viser

    require_viser()
    if static is not None:
        check_static_path(static)
    mech = load(mechanism)
    moved = None if motion is None else load_motion(motion, mech)
    if static is not None:
        with working("writing the page"):
            write_static(mech, moved, static)
        print_written(static)
        return
    viewer = Viewer(mech, moved, host=host, port=port)
    out = console()
    out.print(f"{escape(mech.name)} is at {viewer.url} until Ctrl-C.", soft_wrap=True)
    if host not in LOCAL:
        out.print("Everybody who reaches this address can move the picture.", soft_wrap=True)
    try:
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        pass
    finally:
        viewer.stop()
