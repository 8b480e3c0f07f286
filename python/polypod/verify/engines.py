"""The other engines, and what drives them."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from polypod.answers.status import Status
from polypod.errors import MissingEngineError, UnknownNameError
from polypod.multibody.tree import Multibody

Array = NDArray[np.float64]


class Twin(Protocol):
    """Driver of an engine: made from a `Multibody`, it answers for one state."""

    version: str

    def __init__(self, tree: Multibody) -> None: ...

    def answer(
        self, pose: Array, twist: Array, acceleration: Array, wrench: Array
    ) -> tuple[dict[str, Any], Status]:
        """Quantities by name, as `QUANTITIES`, and whatever the engine can tell of its own accuracy."""


class Driven(Protocol):
    """Driver of an engine that is given forces, those of `Engine.approximate`."""

    version: str

    def __init__(self, tree: Multibody) -> None: ...

    def notes(self) -> list[str]:
        """Notes on the engine's answers so far, in sentences."""

    def answer(
        self, pose: Array, twist: Array, wrench: Array, forces: Array
    ) -> tuple[dict[str, Any], Status]:
        """Quantities by name, as `QUANTITIES`, under a load and Polypod's forces."""


class Engine(NamedTuple):
    """Another engine."""

    title: str
    package: str
    """To install, from PyPI."""
    module: str
    """That it comes in."""
    twin: Callable[[], type[Twin] | type[Driven]]
    """Brings the class that drives it, once the engine is known to be installed."""
    approximate: float | None = None
    """Tolerance of an engine that is given Polypod's forces and answers with accelerations, all but exact.
    None for one that is given the motion and answers exactly."""


def _pinocchio() -> type[Twin]:
    from polypod.verify import pinocchio

    return pinocchio.Twin


def _exudyn() -> type[Driven]:
    from polypod.verify import exudyn

    return exudyn.Twin


def _mujoco() -> type[Driven]:
    from polypod.verify import mujoco

    return mujoco.Twin


ENGINES = {
    "pinocchio": Engine("Pinocchio", "pin", "pinocchio", _pinocchio),
    # Both give links without mass some. Exudyn's initial accelerations come from numerical differences.
    "exudyn": Engine("Exudyn", "exudyn", "exudyn", _exudyn, approximate=1e-6),
    "mujoco": Engine("MuJoCo", "mujoco", "mujoco", _mujoco, approximate=1e-6),
}
"""The engines by the names that `verify` takes."""


def engine_class(name: str) -> type[Twin] | type[Driven]:
    """The class that drives an engine.

    Raises:
        UnknownNameError: no such engine.
        MissingEngineError: it is not installed.
    """
    if name not in ENGINES:
        raise UnknownNameError("engine", name, ENGINES)
    engine = ENGINES[name]
    if find_spec(engine.module) is None:
        raise MissingEngineError(engine.title, engine.package)
    return engine.twin()
