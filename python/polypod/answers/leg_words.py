"""Words and units for the coordinates of legs: lengths, or places of carriages on rails."""

from __future__ import annotations

from collections.abc import Iterable

from polypod.files.units import SHOWN, readable, si_unit
from polypod.legs.drive import Drive
from polypod.legs.drives import kinds_among


def word(drives: Iterable[Drive]) -> str:
    """What legs with these drives have: "length", "place", or "length or place"."""
    return " or ".join(drive.coordinate for drive in kinds_among(drives))


def words(drives: Iterable[Drive]) -> str:
    """Plural of `word`: "leg lengths", "places", or "lengths and places"."""
    kinds = kinds_among(drives)
    return (
        kinds[0].coordinates_of_legs if len(kinds) == 1 else " and ".join(each.coordinates for each in kinds)
    )


def unit(drives: Iterable[Drive], per: str = "") -> str:
    """The unit that people read these coordinates in, such as "mm", or their rates with `per` "/s"."""
    units = (SHOWN[drive.coordinate_kind][1] + per for drive in kinds_among(drives))
    return " or ".join(dict.fromkeys(units))


def force_unit(drives: Iterable[Drive]) -> str:
    """The unit that people read active forces in."""
    units = (SHOWN[drive.force_kind][1] for drive in kinds_among(drives))
    return " or ".join(dict.fromkeys(units))


def factor(drive: Drive) -> float:
    """From the coordinate in SI to the unit that people read."""
    return SHOWN[drive.coordinate_kind][0]


def readable_coordinate(drive: Drive, value: float) -> str:
    """A coordinate with its unit, as people read it."""
    return readable(value, si_unit(drive.coordinate_kind))
