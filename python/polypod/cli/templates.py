"""Mechanism files to start from."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from polypod.errors import PolypodError, UnknownNameError
from polypod.mechanism import list_mechanisms, load

TEMPLATE = "template.toml"


def starting_text(path: Path, like: str | None = None) -> str:
    """The text of a new mechanism file: the template or a built-in one, under the name of the file.

    Raises:
        UnknownNameError: no such built-in mechanism.
        PolypodError: a path that is there already, or is no name for a mechanism file.
    """
    if path.suffix != ".toml":
        raise PolypodError(f"{path} ends in {path.suffix!r}; a mechanism file ends in .toml")
    if path.exists():
        raise PolypodError(f"{path} is there already; choose another name")
    if like is None:
        text = (files("polypod") / TEMPLATE).read_text(encoding="utf-8")
    elif like in list_mechanisms():
        text = load(like).to_toml()
    else:
        raise UnknownNameError("built-in mechanism", like, list_mechanisms())
    name = re.sub(r"[^\w .+-]", "-", path.stem)
    return re.sub(r'^name = ".*"$', lambda _: f'name = "{name}"', text, count=1, flags=re.MULTILINE)
