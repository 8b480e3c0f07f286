"""The compiled core: flat arrays in, a dictionary of arrays out. Use `polypod.Mechanism` instead."""

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
_Table = dict[str, NDArray[Any]]

__all__ = ["Faults", "Mechanism", "__version__", "statuses"]

__version__: str

class Faults(Exception):
    """All faults of a mechanism as (place, message)."""

@final
class Mechanism:
    def __new__(cls, spec: str) -> Mechanism: ...
    @property
    def dof(self) -> int: ...
    @property
    def characteristic_length(self) -> float: ...
    @property
    def home(self) -> _Array: ...
    @property
    def leg_letters(self) -> list[str]: ...
    def coordinate_sets(self) -> list[tuple[str, list[str], list[bool] | None]]: ...
    def mobility(self) -> str: ...
    def states(
        self,
        set: str,
        given: list[list[_Array] | None],
        count: int,
        branch: float,
        guess: _Array | None,
        continued: bool,
    ) -> _Table: ...
    def coordinates(self, set: str, poses: _Array) -> _Table: ...
    def inverse_kinematics(self, poses: _Array) -> _Table: ...
    def jacobian(self, poses: _Array) -> _Table: ...
    def hessian(self, poses: _Array) -> _Table: ...
    def conditioning(self, poses: _Array) -> _Table: ...
    def kinematics(self, poses: _Array, twists: _Array, accelerations: _Array) -> _Table: ...
    def inverse_dynamics(
        self,
        poses: _Array,
        twists: _Array,
        accelerations: _Array,
        wrenches: _Array | None,
        platform_axes: bool,
    ) -> _Table: ...
    def power(
        self,
        poses: _Array,
        twists: _Array,
        accelerations: _Array,
        wrenches: _Array | None,
        platform_axes: bool,
    ) -> _Table: ...
    def limits(
        self,
        poses: _Array,
        twists: _Array,
        accelerations: _Array,
        wrenches: _Array | None,
        platform_axes: bool,
    ) -> _Table: ...
    def limit_list(self) -> list[tuple[str, str, list[int], str, float, float, float]]: ...
    def platform_twist(self, poses: _Array, rates: _Array) -> _Table: ...
    def platform_acceleration(self, poses: _Array, twists: _Array, accelerations: _Array) -> _Table: ...
    def coupled_forces(
        self, poses: _Array, multipliers: _Array, as_printed: bool
    ) -> tuple[list[int], _Table] | None: ...

def statuses() -> list[tuple[int, str, str]]: ...
