"""Mechanism files as tables, and changes to them."""

import copy
import tomllib
from typing import Any

from support import DATA, ROOT

BUILT_IN = "lu-3spu-2rpu-r"
FILES = {
    BUILT_IN: ROOT / f"python/polypod/mechanisms/{BUILT_IN}.toml",
    **{name: DATA / f"{name}.toml" for name in ("stewart-gough", "3-rps")},
}
TABLES = {name: tomllib.loads(path.read_text(encoding="utf-8")) for name, path in FILES.items()}
PAPER, GOUGH, RPS = FILES

SI_UNITS = {
    "length": "m",
    "angle": "rad",
    "mass": "kg",
    "inertia": "kg m^2",
    "force": "N",
    "torque": "N m",
    "acceleration": "m/s^2",
}

DELETED = object()


def changed(name: str, **changes: Any) -> dict[str, Any]:
    """A file's tables with other values at places such as legs__3__stroke, counted from 1."""
    tables = copy.deepcopy(TABLES[name])
    for place, value in changes.items():
        target: Any = tables
        *parents, last = [int(key) - 1 if key.isdigit() else key for key in place.split("__")]
        for key in parents:
            target = target[key]
        if value is DELETED:
            del target[last]
        elif isinstance(target, list) and last == len(target):  # one past the end
            target.append(value)
        else:
            target[last] = value
    return tables


MIDDLE = [0.0, 0.0, 0.0]
UP = {"joint": "U", "point": MIDDLE, "axis": [0, 0, 1]}
