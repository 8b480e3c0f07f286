"""The table of all kinds of drives, and what is asked of it."""

from __future__ import annotations

from collections.abc import Iterable

from polypod.legs.drive import Drive, Leg
from polypod.legs.slider import Slider
from polypod.legs.telescope import Telescope

TELESCOPE, SLIDER = Telescope(), Slider()

DRIVES: tuple[Drive, ...] = (TELESCOPE, SLIDER)
"""All kinds; that of legs without a table for one comes first."""

KEYED = {drive.key: drive for drive in DRIVES if drive.key}
"""Those with a table in the legs of a mechanism file, by its key."""

LINK_PLACE = {link: place for drive in DRIVES for place, link in enumerate(drive.links)}
"""Of the links of legs, by their words: 0 for the first from the base on, 1 for the second."""


def drive_of(leg: Leg) -> Drive:
    """The drive of a leg of `Mechanism.geometry`."""
    return next((drive for key, drive in KEYED.items() if leg[key] is not None), TELESCOPE)


def drive_of_letters(letters: str) -> Drive:
    """The drive of a leg with these joints, from the base on: its joint is the first, or the second."""
    return next(drive for drive in DRIVES if letters[0 if drive.moves_foot else 1] == drive.letter)


def kinds_among(drives: Iterable[Drive]) -> tuple[Drive, ...]:
    """The kinds that occur, each once, in the order of the table."""
    found = {*drives}
    return tuple(drive for drive in DRIVES if drive in found)
