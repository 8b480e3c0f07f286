"""Reading TOML texts, and in which line of one a place such as `legs.3.stroke` stands."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any

from polypod.errors import Fault

_KEY = r"""(?:"(?:\\.|[^"\\\n])*"|'[^'\n]*'|[\w-]+)"""
_DOTTED = rf"{_KEY}(?:\s*\.\s*{_KEY})*"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]")
_ENTRY = re.compile(rf"\s*({_DOTTED})\s*=")
_TEXTS = re.compile(
    r'"""(?:\\.|[^\\])*?"""|' r"'''.*?'''" r'|"(?:\\.|[^"\\\n])*"' r"|'[^'\n]*'" r"|\#[^\n]*", re.DOTALL
)
_WHERE = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)
_TWICE = re.compile(r"Cannot declare \((.*)\) twice")
_LONGEST_INTEGER = 4300
"""Digits: more of them Python does not read."""

Path = tuple[str, ...]


def read_toml(text: str) -> dict[str, Any] | Fault:
    """The content of a TOML text, or what keeps it from being read."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        where = _WHERE.fullmatch(str(error))
        if where is None:
            return Fault("toml", str(error))
        if where[2] and (twice := _TWICE.fullmatch(where[1])):
            name = ".".join(part.strip("' ") for part in twice[1].split(",") if part.strip())
            message = f"[{name}] stands there twice; a list of tables has two brackets, [[{name}]]"
            return Fault("toml", message, int(where[2]))
        if where[2] is None:
            return Fault("toml", f"{where[1]}, at the end of the text", text.rstrip("\n").count("\n") + 1)
        return Fault("toml", f"{where[1]}, at column {where[3]}", int(where[2]))
    except ValueError:
        digits = re.compile(rf"\d{{{_LONGEST_INTEGER}}}")
        found = (i for i, line in enumerate(text.split("\n"), 1) if digits.search(line.replace("_", "")))
        return Fault("toml", f"holds an integer of more than {_LONGEST_INTEGER} digits", next(found, None))
    except RecursionError:
        lines = text.split("\n")
        deepest = max(range(len(lines)), key=lambda i: lines[i].count("[") + lines[i].count("{"))
        return Fault("toml", "nests arrays or tables too deeply to be read", deepest + 1)


def line_of(text: str, place: str) -> int | None:
    """The line, from 1, of the entry or table at a place, or of the nearest one that holds it.

    None where no part of the place is written down. Entries of inline tables stand in the line of the first,
    arrays of tables in that of their first table.
    """
    lines = _lines(text)
    path = _parts(place)
    if path[1:2] == ("1",) and path[:2] not in lines:
        path = path[:1] + path[2:]  # one table in place of an array of them
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def with_lines(faults: Iterable[Fault], text: str | None) -> list[Fault]:
    """The faults with their lines in the text; as they are without one."""
    return [fault if text is None else replace(fault, line=line_of(text, fault.place)) for fault in faults]


@lru_cache(maxsize=1)
def _lines(text: str) -> dict[Path, int]:
    """The line in which each table and each entry begins, by path; tables of an array count from 1."""
    found: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    depth = 0  # of arrays and inline tables that go over several lines
    for number, line in enumerate(_TEXTS.sub(_one_line, text).split("\n"), 1):
        if depth == 0 and (header := _HEADER.match(line)):
            names = _parts(header[2])
            table = _numbered(names, counts, new=header[1] == "[[")
            written = table
        elif depth == 0 and (entry := _ENTRY.match(line)):
            written = table + _parts(entry[1])
        else:
            written = ()
        for length in range(1, len(written) + 1):  # what holds it may be written nowhere else
            found.setdefault(written[:length], number)
        bare = _TEXTS.sub("", line)
        depth += sum(bare.count(b) for b in "[{") - sum(bare.count(b) for b in "]}")
    return found


def _one_line(match: re.Match[str]) -> str:
    """A text as it is, if it stands in one line; of others and of comments the breaks of the lines."""
    return (
        match[0] if match[0][:3] not in ('"""', "'''") and match[0][0] != "#" else "\n" * match[0].count("\n")
    )


def _numbered(names: Path, counts: dict[Path, int], *, new: bool) -> Path:
    """The path of a header, with the number of the table in each array on the way."""
    path: Path = ()
    for i, name in enumerate(names):
        path += (name,)
        if new and i == len(names) - 1:
            counts[path] = counts.get(path, 0) + 1
        if path in counts:
            path += (str(counts[path]),)
    return path


def _parts(dotted: str) -> Path:
    return tuple(part.strip("\"'") for part in re.findall(_KEY, dotted))
