"""Common parts of the commands: arguments, console, tables, number formats, JSON, progress."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from polypod.mechanism import Mechanism

from polypod.summary.tables import Table as Words
from polypod.summary.tables import fixed as fixed
from polypod.summary.tables import significant as significant

MechanismArgument = Annotated[
    str, typer.Argument(metavar="MECHANISM", help="A mechanism file (.toml) or a built-in mechanism's name.")
]
MotionArgument = Annotated[
    str, typer.Argument(metavar="MOTION", help="A motion file (.csv or .toml) or a built-in motion's name.")
]
ResultOption = Annotated[
    Path,
    typer.Option(
        "-o", "--output", metavar="RESULT", help="File for the results: .nc or .csv; it is overwritten."
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables: SI units, radians.")]

RESULT_SUFFIXES = (".nc", ".csv")


def check_result_path(path: Path, *inputs: str, suffixes: tuple[str, ...] = RESULT_SUFFIXES) -> None:
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


def pose_at(mech: Mechanism, coordinates: dict[str, float], branch: int) -> Any:
    """The pose with the coordinates of `--at`; wrong input where there is none."""
    from polypod.answers.status import Status
    from polypod.errors import PolypodError

    state = mech.state(coordinates, branch=branch)
    status = Status(int(state.status))
    if not status.has_answer:
        raise PolypodError(f"--at: {status.message}")
    return state.pose


# --- printing -----------------------------------------------------------------------------------------------


def console() -> Console:
    """Standard output, without colours that rich would guess."""
    return Console(highlight=False)


def new_table(title: str, *headers: str) -> Table:
    """A table with its columns' headers; `>` at the end of one puts its column to the right."""
    # A title may be wider than its table.
    text = Text(title, style="bold", no_wrap=True, overflow="ignore")
    table = Table(title=text, title_justify="left", show_header=any(map(_plain, headers)))
    for header in headers:
        table.add_column(_plain(header), justify="right" if header.endswith(">") else "left")
    return table


def _plain(header: str) -> str:
    return header.removesuffix(">")


def print_words(out: Console, words: Words) -> None:
    """A table of texts, and the sentence below it."""
    table = new_table(escape(words.title), *words.headers)
    for row in words.rows:
        table.add_row(*map(escape, row))
    out.print(table)
    if words.note:
        out.print(escape(words.note))


def print_json(data: Any) -> None:
    """Facts as JSON on standard output; they hold no NaN."""
    print(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False))


def print_written(path: Path) -> None:
    """The last line of a command: the file that it wrote."""
    console().print(f"Written: {escape(str(path))}", soft_wrap=True)


@contextmanager
def working(text: str) -> Iterator[None]:
    """A sign of life on the terminal, on standard error."""
    console = Console(stderr=True)
    if console.is_terminal:
        with console.status(text):
            yield
    else:
        yield


@contextmanager
def progress_bar(text: str, total: int) -> Iterator[Callable[[float, float], None]]:
    """A progress bar on standard error, on a terminal only."""
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(text, total=total)

        def update(done: float, of: float) -> None:
            progress.update(task, completed=done, total=of)

        yield update
