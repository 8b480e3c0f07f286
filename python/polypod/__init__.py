"""Polypod analyses parallel manipulators on telescopic legs or on struts that slide on rails.

SI units and radians in every array; six-vectors are linear part first, at the platform's point o, in base
axes; poses are homogeneous matrices `(..., 4, 4)`; leading axes are a batch. Legs are numbered from 1 in
files and from 0 in arrays.

The rooms of the package, from the ground up; each imports only those above it in this list:

- `errors`, `arrays`, `vectors`, `compute`: exceptions, arguments as arrays, vectors of space, threads.
- `legs`: kinds of joints and of drives: words, units, geometry.
- `files`: texts, TOML, CSV, units, and the tables of a mechanism file.
- `answers`: what a mechanism answers, named arrays with units, as datasets and as cards.
- `mechanism`: `Mechanism`, which is asked, and `load`.
- `motion`: `Motion`, coordinates over time, and its files.
- `bodies`: the links as solids, and the colours of all figures.
- `multibody`: a mechanism as links, elementary joints and loop closures, apart from the core's equations.
- `solution`: `solve`, `simulate`, and what follows from a `Solution`.
- `workspaces`: `workspace`, `length_lattice`, and their boundaries and files.
- `summary`: mechanisms and solutions as plain data, and as tables of words.
- `plots`: figures.
- `export`: mechanisms and results in the formats of other tools.
- `verify`: answers held against other engines.
- `paper`: the tables and the workspace of the publication that Polypod began with.
- `report`: all that is known of a mechanism and a motion as one page.
- `viewer`: a mechanism in the browser.
- `cli`: the command `polypod`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from polypod import compute, errors
from polypod._core import __version__
from polypod.answers.notebook import draw_with
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
    from polypod.motion.motion import Motion
    from polypod.motion.motion_file import load_motion
    from polypod.report import report_html, write_report
    from polypod.solution.computed_torque import ComputedTorque
    from polypod.solution.simulate import simulate
    from polypod.solution.solution import Solution, load_solution
    from polypod.solution.solve import solve
    from polypod.workspaces.length_lattice import length_lattice
    from polypod.workspaces.search import workspace
    from polypod.workspaces.workspace import Workspace, load_workspace

compute.configure()

# Motions and results need scipy and xarray, which take their time to load: only who uses them waits for them.
_LATER = {
    "ComputedTorque": "solution.computed_torque",
    "Motion": "motion.motion",
    "Solution": "solution.solution",
    "Workspace": "workspaces.workspace",
    "length_lattice": "workspaces.length_lattice",
    "load_motion": "motion.motion_file",
    "load_solution": "solution.solution",
    "load_workspace": "workspaces.workspace",
    "plots": "plots",
    "report_html": "report",
    "simulate": "solution.simulate",
    "solve": "solution.solve",
    "workspace": "workspaces.search",
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
    "length_lattice",
    "list_mechanisms",
    "load",
    "load_motion",
    "load_solution",
    "load_workspace",
    "report_html",
    "simulate",
    "solve",
    "workspace",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = import_module(f"{__name__}.{_LATER[name]}")
    return module if name == _LATER[name] else getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})


def _picture(mech: Mechanism) -> bytes:
    from polypod.plots.mechanism import small_picture

    return small_picture(mech)


draw_with(Mechanism, _picture)
