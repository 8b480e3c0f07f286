"""Filter of a page's messages: values of its own controls, and nothing else; and their origin."""

from __future__ import annotations

import math
from collections.abc import Mapping
from urllib.parse import urlsplit

LONGEST_TEXT = 200
"""Characters of a text that a control may have; names of sets and modes are shorter."""

LARGEST = 1e9
"""Size of a number that a control may have."""


def is_value(value: object, current: object) -> bool:
    """Whether a control that has the value `current` may get this one: same type, finite, of sane size."""
    if isinstance(current, bool) or isinstance(value, bool):
        return isinstance(current, bool) and isinstance(value, bool)
    if isinstance(current, int | float):
        return isinstance(value, int | float) and math.isfinite(value) and abs(value) < LARGEST
    if isinstance(current, str):
        return isinstance(value, str) and len(value) <= LONGEST_TEXT
    return False


def is_update(updates: object, current: object) -> bool:
    """Whether a message about a control changes its value only, to one that it may have."""
    return isinstance(updates, Mapping) and {*updates} == {"value"} and is_value(updates["value"], current)


def is_own_page(headers: Mapping[str, str], *, local: bool) -> bool:
    """Whether a connection comes from the page of this server, not from that of another site.

    A browser tells the origin of the page; other programs need not. With `local` the server listens on this
    machine only, and is known by the names of this machine only, so that no other name can be led to it.
    """
    host, origin = headers.get("Host", ""), headers.get("Origin")
    if local and urlsplit(f"//{host}").hostname not in ("127.0.0.1", "localhost", "::1"):
        return False
    return origin is None or urlsplit(origin).netloc == host
