"""How results show themselves: a card of tables in a notebook, a few lines elsewhere."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable, Sequence
from enum import IntEnum
from functools import cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_ROWS = 16
"""Of a table; more are counted."""

MOST_NUMBERS = 6
"""That are shown one by one; of more the range."""

_CARD = """\
<div class="polypod" style="max-width: 75em; overflow-x: auto">
<div><b>{{ title }}</b>{% if subtitle %} &ensp;{{ subtitle }}{% endif %}</div>
{% for note in notes %}<div style="opacity: .75; font-size: 90%">{{ note }}</div>
{% endfor %}{% if picture %}<img alt="{{ title }}" style="max-width: 22em" \
src="data:image/png;base64,{{ picture }}">
{% endif %}{% for table in tables %}<table style="margin: .5em 0; font-variant-numeric: tabular-nums">
<thead><tr>{% for header in table.headers %}<th style="padding: .2em .6em; text-align: \
{{ 'left' if loop.index <= table.texts else 'right' }}">{{ header }}</th>{% endfor %}</tr></thead>
<tbody>
{% for row in table.rows %}<tr>{% for cell in row %}<td style="padding: .2em .6em; \
{{ 'text-align: left' if loop.index <= table.texts else 'text-align: right; white-space: nowrap' }}">\
{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</tbody></table>
{% if table.left_out %}<div style="opacity: .75; font-size: 90%">… and {{ table.left_out }} more</div>
{% endif %}{% endfor %}</div>"""


Shown = TypeVar("Shown")

_DRAWN_BY: dict[type, Callable[[Any], bytes]] = {}
"""Functions that draw the picture of a card, by the type of its content."""


def draw_with(kind: type[Shown], draw: Callable[[Shown], bytes]) -> None:
    """Cards of such things get a picture, which `draw` makes as a PNG file when a card is shown.

    So the rooms of figures, which know mechanisms, need not be known to mechanisms.
    """
    _DRAWN_BY[kind] = draw


def picture_of(thing: object) -> bytes | None:
    """The picture for the card of a thing, or None where nothing draws such things."""
    draw = _DRAWN_BY.get(type(thing))
    return None if draw is None else draw(thing)


class Rows(NamedTuple):
    """A table."""

    headers: Sequence[str]
    rows: Sequence[Sequence[str]]
    texts: int = 1
    """Columns that hold texts and stand to the left; the others are numbers."""
    left_out: int = 0
    """Rows that are not shown."""


def rows_of(headers: Sequence[str], rows: Iterable[Sequence[str]], texts: int = 1) -> Rows:
    """A table with its first rows and the number of the others."""
    every = [*rows]
    return Rows(headers, every[:MOST_ROWS], texts, max(len(every) - MOST_ROWS, 0))


@cache
def _template() -> Any:
    from jinja2 import Environment

    return Environment(autoescape=True).from_string(_CARD)


def card(
    title: str,
    subtitle: str,
    tables: Iterable[Rows],
    *,
    notes: Iterable[str] = (),
    picture: bytes | None = None,
) -> str:
    """HTML of a heading, notes, a PNG picture and tables. All texts are escaped here."""
    shown = base64.b64encode(picture).decode() if picture else ""
    filled = [table for table in tables if table.rows]
    html: str = _template().render(
        title=title, subtitle=subtitle, notes=[*notes], tables=filled, picture=shown
    )
    return html


def counted(states: int) -> str:
    """Such as 801 states."""
    return f"{states} state{'' if states == 1 else 's'}"


def number(value: float) -> str:
    """A number to five digits; NaN is shown as such."""
    return f"{value + 0.0:.5g}".replace("-", "−").replace("nan", "NaN")


def numbers(values: ArrayLike, unit: str = "1") -> str:
    """A few numbers one by one; of many the least and the greatest, and how many are NaN."""
    array: NDArray[Any] = np.asarray(values)
    unit = "" if unit == "1" else f" {unit}"
    if array.size == 0:
        return "none"
    if array.size <= MOST_NUMBERS:
        return ", ".join(number(value) for value in array.ravel().tolist()) + unit
    missing = int(np.count_nonzero(np.isnan(array))) if array.dtype.kind == "f" else 0
    if missing == array.size:
        return "all NaN"
    low, high = number(float(np.nanmin(array))), number(float(np.nanmax(array)))
    span = low + unit if low == high else f"{low} … {high}{unit}"
    return f"{span}; {missing} NaN" if missing else span


def outcomes(values: ArrayLike, flags: type[IntEnum]) -> str:
    """How many states have which outcome: "20 OK, 5 OUT_OF_STROKE"; of one state its outcome alone."""
    codes = np.asarray(values)
    if codes.ndim == 0:
        return flags(int(codes)).name
    found, counts = np.unique(codes, return_counts=True)
    return ", ".join(f"{n} {flags(int(code)).name}" for code, n in zip(found, counts, strict=True)) or "none"
