"""`polypod explain`: what a word of the output means."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.markdown import Markdown
from rich.markup import escape

from polypod.cli.shared import JsonOption, console, print_json

app = typer.Typer()


@app.command(epilog='Example: [bold]polypod explain "assembly mode"[/bold]')
def explain(
    term: Annotated[
        str | None,
        typer.Argument(
            metavar="TERM",
            help="A term, the literature's word for it, or a status. Without one all terms are listed.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Say what a term or a status means, and what the literature calls it."""
    from polypod.summary import glossary

    message, entries = ("", glossary.entries()) if term is None else glossary.explain(term)
    if as_json:
        print_json({"message": message, "entries": [asdict(entry) for entry in entries]})
        return
    out = console()
    if term is None:
        for part in dict.fromkeys(entry.part for entry in entries):
            terms = ", ".join(entry.term for entry in entries if entry.part == part)
            out.print(f"[bold]{escape(part)}[/bold]: {escape(terms)}", highlight=False)
        return
    if message:
        out.print(message, markup=False, highlight=False)
    for entry in entries:
        out.print(f"[bold]{escape(entry.term)}[/bold]", highlight=False)
        out.print(Markdown(entry.meaning))
