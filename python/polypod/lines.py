"""In which line of a sound TOML text a place such as `legs.3.stroke` stands."""

from __future__ import annotations

import re

_KEY = r"""(?:"[^"\n]*"|'[^'\n]*'|[\w-]+)"""
_DOTTED = rf"{_KEY}(?:\s*\.\s*{_KEY})*"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]")
_ENTRY = re.compile(rf"\s*({_DOTTED})\s*=")

Path = tuple[str, ...]


def line_of(text: str, place: str) -> int | None:
    """The line, from 1, of the entry or table at a place, or of the nearest one that holds it.

    None where no part of the place is written down. Entries of inline tables stand in the line of the first.
    """
    lines = _lines(text)
    path = tuple(place.split("."))
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def _lines(text: str) -> dict[Path, int]:
    """The line in which each table and each entry begins, by path; tables of an array count from 1."""
    found: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            table = _numbered(_parts(header[2]), counts, new=header[1] == "[[")
            found.setdefault(table, number)
        elif entry := _ENTRY.match(line):
            found.setdefault(table + _parts(entry[1]), number)
    return found


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
