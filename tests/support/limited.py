"""Mechanism files with limits."""

from __future__ import annotations

from typing import Any

import polypod as pp
from support import DATA

Tables = dict[str, Any]


def tables(name: str) -> Tables:
    return pp.load(name if name.startswith("lu") else DATA / f"{name}.toml").to_dict()


def paper() -> Tables:
    return tables("lu-3spu-2rpu-r")


def free() -> Tables:
    """The paper's mechanism without strokes."""
    content = paper()
    for leg in content["legs"]:
        del leg["stroke"]
    return content
