"""The application: its commands, and what becomes of wrong input."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from polypod.cli import demo, explain, export, fk, info, new, report, simulate, solve, verify, view, workspace
from polypod.cli import list as list_
from polypod.errors import PolypodError

# In the order of the help. A command imports what is heavy where it needs it, so that help comes at once.
COMMANDS = (demo, list_, info, new, solve, simulate, fk, workspace, verify, view, export, report, explain)

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    epilog="Start with: [bold]polypod demo[/bold]",
)
for command in COMMANDS:
    app.add_typer(command.app)


def main() -> None:
    """Runs the command line; whatever is wrong with the input becomes one message and exit status 2."""
    try:
        app()
    except (PolypodError, OSError) as error:
        print(f"polypod: {_readable(error)}{_terms_of(error)}", file=sys.stderr)
        sys.exit(2)


def _readable(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def _terms_of(error: Exception) -> str:
    """Where its terms are explained: a line for the first of them, if there is one."""
    if not isinstance(error, PolypodError):
        return ""
    from polypod.summary.glossary import terms_in

    return "".join(f'\nTerms: polypod explain "{term}"' for term in terms_in(str(error))[:1])


def _print_version(wanted: bool) -> None:
    if wanted:
        from polypod._core import __version__

        print(f"polypod {__version__}")
        raise typer.Exit


@app.callback()
def _polypod(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Kinematics and dynamics of parallel manipulators on telescopic legs."""
