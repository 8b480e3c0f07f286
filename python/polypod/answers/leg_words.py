"""Words for what the prismatic joints of legs have: lengths, or places of carriages on rails."""

from __future__ import annotations

from collections.abc import Iterable


def slides(letters: str) -> bool:
    """Whether a leg with these joints, from the base on, is a slider: its prismatic joint comes first."""
    return letters.startswith("P")


def word(letters: Iterable[str]) -> str:
    """Word for the coordinate of legs with these joints: "length", "place", or "length or place"."""
    kinds = {slides(each) for each in letters}
    return "length or place" if len(kinds) > 1 else "place" if True in kinds else "length"


def words(letters: Iterable[str]) -> str:
    """Plural of `word`: "leg lengths", "places", or "lengths and places"."""
    of = {"length": "leg lengths", "place": "places", "length or place": "lengths and places"}
    return of[word(letters)]
