"""The compiled core: flat arrays in, a dictionary of arrays out. Use `polypod.Mechanism` instead."""

from collections.abc import Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
_Table = dict[str, NDArray[Any]]

__all__ = [
    "Axes",
    "Chart",
    "Faults",
    "Flood",
    "Lattice",
    "Mechanism",
    "__version__",
    "base_parameters",
    "fit_poses",
    "geometry_parameters",
    "inertial_parameters",
    "instruction_sets",
    "inverse_dynamics_derivatives",
    "regressor",
    "set_threads",
    "singularity_kinds",
    "statuses",
    "unsettled_zeros",
    "use_instructions",
    "zeros",
]

__version__: str

class Faults(Exception):
    """All faults of a mechanism as (place, message)."""

@final
class Axes:
    def __new__(cls, axes: list[tuple[int, ...]]) -> Axes: ...
    def fit(self, arguments: tuple[Any, ...]) -> bool: ...

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
        batch: Sequence[int],
        branch: float,
        guess: _Array | None,
        continued: bool,
    ) -> _Table: ...
    def coordinates(self, set: str, poses: _Array) -> _Table: ...
    def inverse_kinematics(self, poses: _Array) -> _Table: ...
    def jacobian(self, poses: _Array) -> _Table: ...
    def hessian(self, poses: _Array) -> _Table: ...
    def conditioning(self, poses: _Array, length: float) -> _Table: ...
    def determinant(self, poses: _Array, twists: _Array, length: float) -> _Table: ...
    def singularity(self, poses: _Array, length: float, tolerance: float) -> _Table: ...
    def nearest_singular(
        self, poses: _Array, set: str, names: list[str] | None, length: float, reach: float
    ) -> tuple[list[str], _Table]: ...
    def forward_kinematics(self, lengths: _Array, guess: _Array | None, continued: bool) -> _Table: ...
    def assembly_modes(self, lengths: _Array) -> tuple[_Table, list[int], NDArray[np.uint8]] | None: ...
    def complex_modes(self) -> int | None: ...
    def kinematics(self, poses: _Array, twists: _Array, accelerations: _Array) -> _Table: ...
    def inverse_dynamics(
        self,
        poses: _Array,
        twists: _Array,
        accelerations: _Array,
        wrenches: _Array | None,
        platform_axes: bool,
    ) -> _Table: ...
    def forward_dynamics(
        self,
        poses: _Array,
        twists: _Array,
        forces: _Array,
        wrenches: _Array | None,
        platform_axes: bool,
    ) -> _Table: ...
    def equations_of_motion(
        self, poses: _Array, twists: _Array, set: str | None, names: list[str] | None
    ) -> tuple[list[str], _Table]: ...
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
    def joint_reactions(
        self,
        poses: _Array,
        twists: _Array,
        accelerations: _Array,
        wrenches: _Array | None,
        platform_axes: bool,
        length: float,
    ) -> _Table: ...
    def joint_list(self) -> list[tuple[str, str, list[str]]]: ...
    def limit_list(self) -> list[tuple[str, str, list[int], str, float, float, float]]: ...
    def platform_twist(self, poses: _Array, rates: _Array) -> _Table: ...
    def platform_acceleration(self, poses: _Array, twists: _Array, accelerations: _Array) -> _Table: ...
    def coupled_forces(
        self, poses: _Array, multipliers: _Array, as_printed: bool
    ) -> tuple[list[int], _Table] | None: ...

def zeros(time: _Array, values: _Array, rates: _Array, resolution: float) -> list[tuple[float, bool]]: ...
def unsettled_zeros(
    time: _Array, values: _Array, rates: _Array, precision: tuple[float, float, float]
) -> list[float]: ...
def set_threads(count: int) -> None: ...
def instruction_sets() -> list[str]: ...
def use_instructions(name: str) -> bool: ...
def singularity_kinds() -> list[tuple[int, str, str]]: ...
def statuses() -> list[tuple[int, str, str]]: ...
def fit_poses(mech: Mechanism, poses: _Array) -> _Array: ...
def inverse_dynamics_derivatives(
    mech: Mechanism,
    poses: _Array,
    twists: _Array,
    accelerations: _Array,
    wrenches: _Array | None,
    platform_axes: bool,
    set: str,
    names: list[str] | None,
) -> tuple[list[str], _Table]: ...
def regressor(
    mech: Mechanism,
    poses: _Array,
    twists: _Array,
    accelerations: _Array,
    wrenches: _Array | None,
    platform_axes: bool,
) -> _Table: ...
def geometry_parameters(mech: Mechanism) -> list[str]: ...
def inertial_parameters(mech: Mechanism) -> tuple[list[str], list[str], _Array]: ...
def base_parameters(mech: Mechanism) -> tuple[list[int], _Array, _Array] | None: ...

@final
class Chart:
    @staticmethod
    def at(mech: Mechanism, pose: _Array) -> Chart | None: ...
    def start(self, twist: _Array) -> _Array: ...
    def state(self, y: _Array) -> tuple[_Array, _Array]: ...
    def rates(self, y: _Array, forces: _Array, wrench: _Array | None, platform_axes: bool) -> _Array: ...

@final
class Flood:
    @staticmethod
    def begin(
        mech: Mechanism,
        origin: Sequence[float],
        step: float,
        counts: Sequence[int],
        start: _Array,
        keep_aspect: bool,
        threads: int,
    ) -> Flood | None: ...
    def wave(self) -> int: ...
    def retry(self) -> int: ...
    def mask(self) -> NDArray[np.bool_]: ...
    def edges(self) -> _Table: ...

@final
class Lattice:
    @staticmethod
    def begin(
        mech: Mechanism, start: _Array, bounds: list[list[float]], step: float, layer: float, threads: int
    ) -> Lattice | None: ...
    @property
    def nodes(self) -> int: ...
    @property
    def inside(self) -> int: ...
    def wave(self) -> int: ...
    def reached(self) -> dict[str, Any]: ...
