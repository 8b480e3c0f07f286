"""Quantities as people type them: `20mm`, `alpha=10deg`, `z=0.2:900mm`; m and rad where there is no unit."""

from __future__ import annotations

import math
import re

from polypod.errors import WorkspaceError, alternatives
from polypod.units import UNITS, to_si

_KIND_OF = {unit: kind for kind in ("length", "angle") for unit in UNITS[kind]}


def quantity(place: str, text: str) -> float:
    """A number with or without a unit in SI. Raises WorkspaceError, naming the place."""
    found = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*)\s*", text)
    try:
        if found is None:
            raise ValueError
        number = float(found[1])
    except ValueError:
        raise WorkspaceError(f"{place} is {text!r}; must be a number such as 20mm, 10deg or 0.3") from None
    if not found[2]:
        return number
    if found[2] not in _KIND_OF:
        raise WorkspaceError(f"{place}: {found[2]!r} is no unit; {alternatives(found[2], _KIND_OF)}")
    value = to_si(number, _KIND_OF[found[2]], found[2])
    return value if math.isfinite(value) else number


def named(option: str, text: str) -> tuple[str, float]:
    """`name=value`."""
    name, mark, value = text.partition("=")
    if not mark or not name.strip():
        raise WorkspaceError(f"{option} is {text!r}; must be name=value, such as alpha=10deg")
    return name.strip(), quantity(f"{option} {name.strip()}", value)


def interval(option: str, text: str) -> tuple[str, tuple[float, float]]:
    """`name=from:to`."""
    name, mark, values = text.partition("=")
    low, colon, high = values.partition(":")
    if not (mark and colon and name.strip()):
        raise WorkspaceError(f"{option} is {text!r}; must be name=from:to, such as z=200mm:900mm")
    place = f"{option} {name.strip()}"
    return name.strip(), (quantity(place, low), quantity(place, high))


def names_of(text: str) -> list[str]:
    """Names between commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def steps_of(texts: list[str]) -> float | dict[str, float] | None:
    """One step for all, or one for each name. Raises WorkspaceError for a mixture."""
    if not texts:
        return None
    if len(texts) == 1 and "=" not in texts[0]:
        return quantity("--step", texts[0])
    return dict(named("--step", text) for text in texts)
