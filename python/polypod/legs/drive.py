"""What a drive is: the joint between the two links of a leg, or below them, that an actuator moves.

All that is said of a kind of drive outside its equations, which are the core's (`model/drive.rs`): keys of
the mechanism file, words, units, and the geometry that the multibody description builds on, which is apart
from the core on purpose. A leg is a table of `Mechanism.geometry`; lengths are in m, angles in rad.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Leg = Mapping[str, Any]
Kind = Literal["length", "angle", "force", "torque"]
"""A kind of quantity, as in the units of files."""
Parameter = Literal["direction", "length", "angle", "sign"]


class Drive(ABC):
    """A kind of drive; one is as good as another of the same kind."""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self))

    def __repr__(self) -> str:
        return f"<{self.name}>"

    # --- words and units ---------------------------------------------------------------------------------

    key: ClassVar[str]
    """Its table in a leg of a mechanism file; empty for legs without one."""
    name: ClassVar[str]
    """Of a leg that it drives."""
    links: ClassVar[tuple[str, str]]
    """The two links of the leg, from the base on: keys of the mechanism file and words."""
    letter: ClassVar[str]
    """Of its joint."""
    joint: ClassVar[Literal["prismatic", "revolute"]]
    """Its joint as an elementary joint."""
    moves_foot: ClassVar[bool]
    """Whether its joint lies between the base and the first link, which carries the base joint, and not
    between the two links."""
    coordinate: ClassVar[str]
    """A word for its coordinate,"""
    coordinates: ClassVar[str]
    """for several,"""
    coordinates_of_legs: ClassVar[str]
    """and for several where nothing says that they are those of legs."""
    least: ClassVar[float]
    """The coordinate's lower bound where the mechanism file gives no stroke."""
    coordinate_kind: ClassVar[Kind] = "length"
    force_kind: ClassVar[Kind] = "force"
    variables: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Symbol and long name of variables of datasets that are called otherwise with this drive."""

    # --- notes and tables --------------------------------------------------------------------------------

    signs: ClassVar[str] = ""
    """A sentence on the signs of forces and rates, where they are no pushes and lengthenings."""
    frames: ClassVar[str] = ""
    """A sentence on the axes of the links, where they are not (n, δ, n×δ) at B and at b."""
    assumed_inertia: ClassVar[str] = ""
    """What the multibody description assumes of the first link's inertia, if the file gives none."""
    parameters_title: ClassVar[str] = ""
    """Title of the table of its parameters."""
    parameters: ClassVar[Mapping[str, Parameter]] = {}
    """Keys of its table in the mechanism file, and what they hold."""

    # --- geometry ----------------------------------------------------------------------------------------

    @abstractmethod
    def foot(self, leg: Leg, end: Array) -> Array:
        """(3,): where the base joint is with the platform joint at `end` (3,), base axes; NaN for nowhere."""

    @abstractmethod
    def feet(self, leg: Leg, stroke: Array) -> Array:
        """(2, 3): opposite corners of a box, base axes, that holds the base joint over a stroke (2,)."""

    @abstractmethod
    def longest(self, leg: Leg, stroke: Array) -> float:
        """Greatest distance from base joint to platform joint over a stroke (2,)."""

    @abstractmethod
    def reach(self, leg: Leg) -> float:
        """From the second link's origin to the platform joint, along δ."""

    @abstractmethod
    def axis(self, leg: Leg) -> Array:
        """(3,): the axis of its joint, a unit vector in the axes of the link that it moves."""

    @abstractmethod
    def coordinate_at(self, leg: Leg, first: Array, second: Array) -> float:
        """The coordinate with the two links' frames (4, 4), base axes."""

    @abstractmethod
    def bodies(self, leg: Leg) -> tuple[Leg | None, Leg | None]:
        """The file's masses of the two links."""

    def solid_bodies(self, leg: Leg) -> tuple[Leg | None, Leg | None]:
        """The same with an inertia for each mass, and mass centres in the links' frames."""
        return self.bodies(leg)

    # Of a drive that moves the foot.

    def first_axes(self, leg: Leg, foot: Array) -> Array:
        """(3, 3): axes of the first link, which it moves, base axes, with the base joint at `foot` (3,)."""
        raise NotImplementedError

    def push(self, leg: Leg, foot: Array) -> Array:
        """(3,): the direction in which it moves the base joint at `foot` (3,), base axes."""
        raise NotImplementedError
