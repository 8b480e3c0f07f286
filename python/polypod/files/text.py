"""Text files: read with one policy, and written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from polypod.errors import Fault

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

PLACE = "file"
"""The place of faults that concern a file as a whole."""


def read_text(file: Path | Traversable) -> str | Fault:
    """The text of a UTF-8 file, or what keeps it from being read.

    A byte order mark is left out; ends of lines become newlines.
    """
    try:
        return file.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        return Fault(PLACE, "does not exist")
    except UnicodeDecodeError as error:
        return Fault(PLACE, f"is not UTF-8 text: {error}")
    except OSError as error:
        return Fault(PLACE, f"cannot be read: {error.strerror or error}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to, which takes its place once all is written."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
