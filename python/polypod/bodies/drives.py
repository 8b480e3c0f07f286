"""The table of drawings, by the kind of drive."""

from __future__ import annotations

from collections.abc import Mapping

from polypod.bodies import slider, telescope
from polypod.bodies.drawing import Drawing
from polypod.legs.drive import Drive
from polypod.legs.drives import SLIDER, TELESCOPE

DRAWINGS: Mapping[Drive, Drawing] = {TELESCOPE: telescope, SLIDER: slider}
