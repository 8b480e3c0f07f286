"""Exceptions for wrong calls and files. Numerical outcomes never raise: see `Status`."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_LONGEST_SHOWN = 80
"""Characters of a value in a message."""
_LONGEST_PATH = 1000
"""Of a name that may be a path."""


class PolypodError(Exception):
    """The root of everything that Polypod raises on purpose."""


@dataclass(frozen=True)
class Fault:
    """One thing wrong in a file: where (`legs.3.stroke`, `line 17`; counted from 1) and what."""

    place: str
    message: str
    line: int | None = None
    """Of the file's text, where there is one and the place is in it."""

    def __str__(self) -> str:
        line = "" if self.line is None else f" (line {self.line})"
        return f"{self.place}{line}: {self.message}"


class _FaultyInputError(PolypodError):
    """An input with faults: all of them, each once, in `faults`."""

    def __init__(self, faults: Iterable[Fault], source: str) -> None:
        self.faults = tuple(dict.fromkeys(faults))
        self.source = source
        super().__init__(self.faults, source)

    def __str__(self) -> str:
        count = "1 fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        return "\n  ".join([f"{self.source} has {count}:", *map(str, self.faults)])


class MechanismError(_FaultyInputError):
    """A mechanism that cannot be made: `faults` holds everything wrong with it."""

    def __init__(self, faults: Iterable[Fault], source: str = "the mechanism") -> None:
        super().__init__(faults, source)


class MotionError(_FaultyInputError):
    """A motion that cannot be used: `faults` holds everything wrong with it."""

    def __init__(self, faults: Iterable[Fault], source: str = "the motion") -> None:
        super().__init__(faults, source)


class LengthsError(_FaultyInputError):
    """Leg lengths that cannot be used: `faults` holds everything wrong with their file."""

    def __init__(self, faults: Iterable[Fault], source: str = "the leg lengths") -> None:
        super().__init__(faults, source)


class SolutionError(PolypodError):
    """A file of results that cannot be read or written."""


class WorkspaceError(PolypodError):
    """A workspace that cannot be made, read or written."""


class ExportError(PolypodError):
    """A file in another tool's format that cannot be made."""


class CoordinateError(PolypodError):
    """Coordinates that make up no coordinate set of the mechanism."""


class UnsupportedError(PolypodError):
    """A question that has no answer for this kind of mechanism."""


class MissingEngineError(PolypodError):
    """An engine of `polypod.verify` that is not installed."""

    def __init__(self, engine: str, package: str) -> None:
        self.engine, self.package = engine, package
        super().__init__(engine, package)

    def __str__(self) -> str:
        return (
            f"{self.engine} is not installed; install it with: pip install {self.package}, "
            "or all engines with: pip install polypod[verify]"
        )


class ShapeError(PolypodError):
    """An array whose shape does not fit."""


class UnknownNameError(PolypodError):
    """A name that stands for nothing here; the message lists those that do."""

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind, self.name, self.valid = kind, name, tuple(valid)
        super().__init__(kind, name, self.valid)

    def __str__(self) -> str:
        name = shown(self.name, _LONGEST_PATH)
        return f"there is no {self.kind} {name}; {alternatives(self.name, self.valid)}"


def alternatives(name: str, valid: Iterable[str]) -> str:
    """The end of a message about an unknown name: the likeliest valid one, then all of them."""
    names = list(valid)
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {shown(near[0])}? " if near else ""
    return f"{hint}valid: {', '.join(names) or 'none'}"


def shown(value: object, longest: int = _LONGEST_SHOWN) -> str:
    """A value as a file writes it, the beginning of a long one; a table is only called one."""
    if isinstance(value, dict):
        return "a table"
    try:
        text = json.dumps(value, ensure_ascii=False, default=str)
    except (RecursionError, ValueError):  # too deep, or with too many digits
        return "a value that is too long to be shown"
    text = text if text.isprintable() else json.dumps(value, default=str)
    return text if len(text) <= longest else f"{text[: longest - 4]} ..."


def place_of(*parts: str | int) -> str:
    """A dotted place from its keys; those that are not bare words in quotes, as in TOML."""
    return ".".join(
        str(part)
        if isinstance(part, int) or _BARE.fullmatch(part)
        else json.dumps(part, ensure_ascii=not part.isprintable())
        for part in parts
    )
