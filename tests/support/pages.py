"""The texts as tests see them: their fenced blocks, their prose, and running a page from top to bottom.

A Python block runs in the order of its page, with the names of the blocks before it, in an empty folder; with
`>>>` its output must be as shown. A block with `title="name"` is a file there. On the pages that a reader
follows from top to bottom (`followed`) the commands run, too: a `text` block right after commands is what
they print, in a terminal of 100 columns; `...` stands for anything. A comment `exit status N` after a command
says that it ends so.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import pytest

from polypod import cli
from support import ROOT

DOCS = ROOT / "docs"
GLOSSARY = ROOT / "python/polypod/summary/glossary.md"
PAGES = [ROOT / "README.md", GLOSSARY, *sorted(DOCS.rglob("*.md"))]
DOCTEST_FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
SHELLS = ("sh", "bash", "shell", "console")
COLUMNS = "100"


def read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def short(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    title: str | None
    text: str
    line: int  # of its first line in the page, from 1

    @property
    def included(self) -> bool:
        """Its lines come from a file while the site is built."""
        return self.text.startswith("--8<--")


def blocks(page: Path) -> list[Block]:
    found, open_block = [], None
    for number, line in enumerate(read(page).split("\n"), 1):
        fence = re.match(r" *```+ *(.*)", line)
        if fence and open_block is None:
            title = re.search(r'title="([^"]+)"', fence[1])
            language = fence[1].split()[0] if fence[1] else ""
            open_block = (language, title and title[1], number + 1, [])
        elif fence and open_block is not None:
            language, title, start, lines = open_block
            found.append(Block(language, title, "\n".join(lines) + "\n", start))
            open_block = None
        elif open_block is not None:
            open_block[3].append(line)
    assert open_block is None, f"{short(page)}: a fence is not closed"
    return found


def prose(page: Path) -> str:
    """The page without its fenced blocks and formulas."""
    text = re.sub(r"^ *```.*?^ *```", "", read(page), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"\$\$.*?\$\$|\$[^$\n]+\$", "", text, flags=re.DOTALL)


def pages_with(*languages: str) -> list[Path]:
    return [page for page in PAGES if any(block.language in languages for block in blocks(page))]


def followed(page: Path) -> bool:
    """Whether a reader is to type all of it."""
    return page == DOCS / "tutorial.md" or page.parent == DOCS / "how-to"


# --- running ------------------------------------------------------------------------------------------------


def run_page(page: Path, folder: Path) -> None:
    """Runs a page's code, and if it is one to be followed its commands, in the current folder."""
    names: dict[str, object] = {"__name__": "__main__"}
    found = blocks(page)
    for block, after in zip(found, [*found[1:], None], strict=True):
        if block.title:
            (folder / block.title).write_text(block.text, encoding="utf-8")
        if block.language == "python" and not block.included:
            _run_python(page, block, names)
        if block.language in SHELLS and followed(page):
            printed = _run_commands(page, block)
            if after is not None and after.language == "text":
                _compare(page, after, printed)


def run_doctest(test: doctest.DocTest) -> None:
    report: list[str] = []
    doctest.DocTestRunner(optionflags=DOCTEST_FLAGS).run(test, out=report.append, clear_globs=False)
    assert not report, "".join(report)


def _run_python(page: Path, block: Block, names: dict[str, object]) -> None:
    if ">>>" in block.text:
        test = doctest.DocTestParser().get_doctest(block.text, {}, short(page), str(page), block.line - 1)
        test.globs = names
        run_doctest(test)
    else:
        # Line numbers as in the page.
        exec(compile("\n" * (block.line - 1) + block.text, str(page), "exec"), names)


def command_lines(block: Block) -> Iterator[tuple[list[str], int]]:
    """The words of each command of a block of commands, and the exit status that its comment announces."""
    for line in block.text.replace("\\\n", " ").split("\n"):
        wanted = re.search(r"# exit status (\d+)", line)
        for part in re.split(r"&&|\||;", line.removeprefix("$ ")):
            if words := shlex.split(part, comments=True):
                yield words, int(wanted[1]) if wanted else 0


def _run_commands(page: Path, block: Block) -> str:
    """Output of the commands of a block."""
    printed = ""
    for words, wanted in command_lines(block):
        where = f"{short(page)}, line {block.line}: {' '.join(words)}"
        if words[0] == "pip" or words[:3] == ["python", "-m", "pip"]:
            continue  # the package is there
        assert words[0] in ("polypod", "python"), f"{where}: tests do not run {words[0]}"
        status, text = (_polypod if words[0] == "polypod" else _python)(words[1:])
        assert status == wanted, f"{where}: exit status {status}\n{text}"
        printed += text
    return printed


def _polypod(arguments: list[str]) -> tuple[int, str]:
    """Exit status and output of the command line, in this process."""
    terminal = {"COLUMNS": COLUMNS, "NO_COLOR": "1", "TERM": "dumb"}
    with (
        mock.patch.dict(os.environ, terminal),
        mock.patch.object(sys, "argv", ["polypod", *arguments]),
        contextlib.redirect_stdout(io.StringIO()) as out,
        contextlib.redirect_stderr(out),
        pytest.raises(SystemExit) as end,
    ):
        cli.main()
    return int(end.value.code or 0), out.getvalue()


def _python(arguments: list[str]) -> tuple[int, str]:
    result = subprocess.run([sys.executable, *arguments], capture_output=True, text=True)
    return result.returncode, result.stdout + result.stderr


def _compare(page: Path, shown: Block, printed: str) -> None:
    """The output on the page must be what came out."""
    want, got = (
        "".join(f"{line.rstrip()}\n" for line in text.strip("\n").split("\n"))
        for text in (shown.text, printed)
    )
    example = doctest.Example("", want)
    checker = doctest.OutputChecker()
    if not checker.check_output(want, got, doctest.ELLIPSIS):
        difference = checker.output_difference(example, got, doctest.ELLIPSIS)
        raise AssertionError(f"{short(page)}, line {shown.line}: the output is another\n{difference}")
