"""Polypod analyses parallel manipulators on telescopic legs.

SI units and radians in every array; six-vectors are linear part first, at the platform's point o, in base
axes; poses are homogeneous matrices `(..., 4, 4)`; leading axes are a batch. Legs are numbered from 1 in
files and from 0 in arrays.
"""

from polypod import errors
from polypod._core import __version__
from polypod.errors import (
    CoordinateError,
    MechanismError,
    MotionError,
    PolypodError,
    ShapeError,
    UnknownNameError,
)
from polypod.mechanism import Mechanism, list_mechanisms, load
from polypod.motion import Motion, load_motion
from polypod.results import Solution, load_solution
from polypod.solution import solve
from polypod.status import Status

__all__ = [
    "CoordinateError",
    "Mechanism",
    "MechanismError",
    "Motion",
    "MotionError",
    "PolypodError",
    "ShapeError",
    "Solution",
    "Status",
    "UnknownNameError",
    "__version__",
    "errors",
    "list_mechanisms",
    "load",
    "load_motion",
    "load_solution",
    "solve",
]
