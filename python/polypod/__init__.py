"""Polypod analyses parallel manipulators on telescopic legs or on struts that slide on rails.

SI units and radians in every array; six-vectors are linear part first, at the platform's point o, in base
axes; poses are homogeneous matrices `(..., 4, 4)`; leading axes are a batch. Legs are numbered from 1 in
files and from 0 in arrays.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from polypod import compute, errors
from polypod._core import __version__
from polypod.answers.singularity import SingularityKind
from polypod.answers.status import Status
from polypod.errors import (
    CoordinateError,
    ExportError,
    LengthsError,
    MechanismError,
    MissingEngineError,
    MotionError,
    PolypodError,
    ShapeError,
    SolutionError,
    UnknownNameError,
    UnsupportedError,
    WorkspaceError,
)
from polypod.mechanism import Mechanism, list_mechanisms, load

if TYPE_CHECKING:
    from polypod.motion.motion import Motion, load_motion
    from polypod.report import report_html, write_report
    from polypod.solution.computed_torque import ComputedTorque
    from polypod.solution.solution import Solution, load_solution
    from polypod.solution.solve import solve
    from polypod.workspaces.workspace import Workspace, load_workspace

compute.configure()

# Motions and results need scipy and xarray, which take their time to load: only who uses them waits for them.
_LATER = {
    "ComputedTorque": "solution.computed_torque",
    "Motion": "motion.motion",
    "load_motion": "motion.motion",
    "Solution": "solution.solution",
    "load_solution": "solution.solution",
    "solve": "solution.solve",
    "Workspace": "workspaces.workspace",
    "load_workspace": "workspaces.workspace",
    "plots": "plots",
    "report_html": "report",
    "write_report": "report",
}

__all__ = [
    "ComputedTorque",
    "CoordinateError",
    "ExportError",
    "LengthsError",
    "Mechanism",
    "MechanismError",
    "MissingEngineError",
    "Motion",
    "MotionError",
    "PolypodError",
    "ShapeError",
    "SingularityKind",
    "Solution",
    "SolutionError",
    "Status",
    "UnknownNameError",
    "UnsupportedError",
    "Workspace",
    "WorkspaceError",
    "__version__",
    "errors",
    "list_mechanisms",
    "load",
    "load_motion",
    "load_solution",
    "load_workspace",
    "report_html",
    "solve",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = import_module(f"{__name__}.{_LATER[name]}")
    return module if name == _LATER[name] else getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})
