"""Words for what the prismatic joints of legs have: lengths, or places of carriages on rails."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from polypod.files.mechanism_schema import SLIDER_LINKS, TELESCOPE_LINKS
from polypod.mechanism import Mechanism

Array = NDArray[np.float64]


def slides(letters: str) -> bool:
    """Whether a leg with these joints, from the base on, is a slider: its prismatic joint comes first."""
    return letters.startswith("P")


def links_of_leg(letters: str) -> tuple[str, str]:
    """What the two links of a leg are called, from the base on."""
    return SLIDER_LINKS if slides(letters) else TELESCOPE_LINKS


def word(letters: Iterable[str]) -> str:
    """What legs with these joints have: "length", "place", or "length or place"."""
    kinds = {slides(each) for each in letters}
    return "length or place" if len(kinds) > 1 else "place" if True in kinds else "length"


def words(letters: Iterable[str]) -> str:
    """The same of several: "leg lengths", "places", or "lengths and places"."""
    of = {"length": "leg lengths", "place": "places", "length or place": "lengths and places"}
    return of[word(letters)]


def word_of(data: xr.Dataset) -> str:
    """`word` of a solution's dataset; "length" where it does not tell its mechanism."""
    text = data.attrs.get("mechanism_file")
    return word(Mechanism.from_toml(text).leg_letters) if text else "length"


def spans(mech: Mechanism) -> Array:
    """(n,): from base joint to platform joint at the centre pose, m: the lengths of legs and struts."""
    home = mech.inverse_kinematics(mech.home)
    return np.where(mech.sliders, np.linalg.norm(home.vectors, axis=-1), home.lengths)
