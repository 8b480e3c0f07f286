"""Quantities as people type them: `20mm`, `alpha=10deg`, `z=2mm:9mm`; m and rad where there is no unit."""

from __future__ import annotations

import re
from collections.abc import Sequence

from polypod.errors import WorkspaceError, alternatives
from polypod.files.units import KIND_OF_COORDINATE, UNITS, to_si, valid_units

_KINDS = {**KIND_OF_COORDINATE, **dict.fromkeys(("azimuth", "tilt", "torsion"), "angle")}
_EXAMPLES = {"length": "20mm", "angle": "10deg", None: "0.3"}


def quantity(place: str, text: str, kind: str | None) -> float:
    """A number with or without a unit in SI.

    Args:
        place: such as `--step`, for messages.
        text: what was typed.
        kind: "length", "angle", or None for a pure number.

    Raises:
        WorkspaceError: no such thing, or a unit of another kind; it names the place.
    """
    number, unit = _parted(place, text, _EXAMPLES[kind])
    if not unit:
        return number
    if kind is None:
        raise WorkspaceError(f"{place} is {text!r}; must be a number without a unit")
    if unit not in UNITS[kind]:
        raise WorkspaceError(f"{place}: {unit!r} is no unit of {kind}; {valid_units(unit, kind)}")
    return to_si(number, kind, unit)


def _parted(place: str, text: str, example: str) -> tuple[float, str]:
    """The number, and its unit or nothing."""
    found = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*)\s*", text)
    try:
        if found is None:
            raise ValueError
        return float(found[1]), found[2]
    except ValueError:
        raise WorkspaceError(f"{place} is {text!r}; must be a number such as {example}") from None


def kind_of(option: str, name: str) -> str | None:
    """Kind of a coordinate: "length", "angle", or None for a pure number.

    Raises WorkspaceError for a name that is no coordinate of any mechanism.
    """
    if name not in _KINDS:
        raise WorkspaceError(f"{option}: {name!r} is no coordinate; {alternatives(name, _KINDS)}")
    return _KINDS[name]


def named(option: str, text: str) -> tuple[str, float]:
    """`name=value` of a coordinate."""
    name, mark, value = text.partition("=")
    name = name.strip()
    if not mark or not name:
        raise WorkspaceError(f"{option} is {text!r}; must be name=value, such as alpha=10deg")
    return name, quantity(f"{option} {name}", value, kind_of(option, name))


def interval(option: str, text: str) -> tuple[str, tuple[float, float]]:
    """`name=from:to` of a coordinate."""
    name, mark, values = text.partition("=")
    name = name.strip()
    low, colon, high = values.partition(":")
    if not (mark and colon and name):
        raise WorkspaceError(f"{option} is {text!r}; must be name=from:to, such as z=200mm:900mm")
    place, kind = f"{option} {name}", kind_of(option, name)
    ends = [_parted(place, value, _EXAMPLES[kind]) for value in (low, high)]
    units = sorted({unit for _, unit in ends})
    if len(units) == 2 and not units[0]:
        # One unit is easily meant for both, and the other number a thousand times off.
        meant = ":".join(f"{number:g}{units[1]}" for number, _ in ends)
        raise WorkspaceError(f"{place} is {values!r}; both numbers need a unit, such as {meant}")
    return name, (quantity(place, low, kind), quantity(place, high, kind))


def names_of(text: str) -> list[str]:
    """Names between commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def steps_of(texts: Sequence[str], names: Sequence[str]) -> float | dict[str, float] | None:
    """One step for all coordinates of these names, or one for each that is named.

    Raises WorkspaceError for a mixture, and for one step where the coordinates differ in kind.
    """
    if not texts:
        return None
    if len(texts) > 1 or "=" in texts[0]:
        return dict(named("--step", text) for text in texts)
    text, kinds = texts[0], {name: kind_of("--vary", name) for name in names}
    first, *others = {*kinds.values()}
    if not others:
        return quantity("--step", text, first)
    _, unit = _parted("--step", text, "20mm or 10deg")
    meant = [name for name, kind in kinds.items() if kind is not None and unit in UNITS[kind]]
    raise WorkspaceError(
        f"--step is {text!r}, but {', '.join(names)} differ in kind: name the coordinate, such as "
        + " ".join(f"--step {name}={text if meant else _EXAMPLES[kinds[name]]}" for name in meant or names)
    )
