"""`export`: a mechanism, or what it does along a motion, as a file for another tool."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polypod.errors import ExportError, UnknownNameError
from polypod.export.gltf import glb
from polypod.export.mat import write_mat
from polypod.export.mjcf import mjcf
from polypod.export.model import Model
from polypod.export.sdf import sdf
from polypod.export.shapes import Shape, meshes, simple
from polypod.export.stl import write_stl
from polypod.export.urdf import urdf
from polypod.export.xml_common import save_meshes
from polypod.files.text import replacing
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.solution.solution import Solution
from polypod.solution.solve import solve, states_along

Array = NDArray[np.float64]
Look = Literal["meshes", "simple", "none"]

RATE = 60
"""Frames of an animation for each second."""


@dataclass(frozen=True)
class Format:
    """Capabilities of an export format."""

    suffixes: tuple[str, ...]
    motion: Literal["none", "optional", "required"]
    pose: bool
    """Whether it can hold a pose other than home."""


FORMATS: Mapping[str, Format] = {
    "mjcf": Format((".xml", ".mjcf"), "none", True),
    "sdf": Format((".sdf",), "none", False),
    "urdf": Format((".urdf",), "none", False),
    "glb": Format((".glb",), "optional", True),
    "stl": Format((".stl",), "none", True),
    "csv": Format((".csv",), "required", False),
    "netcdf": Format((".nc",), "required", False),
    "mat": Format((".mat",), "required", False),
}


@dataclass(frozen=True)
class Exported:
    """Result of `export`."""

    files: tuple[Path, ...]
    """The file asked for first, then those beside it."""
    notes: tuple[str, ...]
    """Sentences about what the format leaves out or the reader must know; they stand in the file, too, if it
    has comments."""


def export(
    mech: Mechanism,
    path: str | PathLike[str],
    to: str | None = None,
    *,
    motion: Motion | Solution | None = None,
    pose: ArrayLike | None = None,
    look: Look = "meshes",
) -> Exported:
    """Writes a mechanism, or what it does along a motion, in the format of another tool.

    Files that are there already are overwritten, as results are; each appears whole or not at all.

    Args:
        mech: the mechanism.
        path: the file; its suffix determines the format.
        to: a format of `FORMATS`, whatever the suffix.
        motion: what `glb` animates, 60 frames for each second, and what `csv`, `netcdf` and `mat` are the
            results of: a motion, or a solution for the last three.
        pose: (4, 4); that of `glb` and `stl`, home by default; for `mjcf` a keyframe beside home.
        look: of links in model files: `meshes`, `simple` shapes or `none`.

    Raises:
        ExportError: a format that cannot hold what is asked for.
        UnknownNameError: no such format.

    >>> import polypod as pp
    >>> from polypod.export import export
    >>> found = export(pp.load("lu-3spu-2rpu-r"), "lu.urdf", look="simple")
    >>> [file.name for file in found.files]
    ['lu.urdf', 'lu.yaml']
    """
    path = Path(path)
    name = format_of(path, to)
    _check(name, motion is not None, pose is not None)
    at = None if pose is None else np.asarray(pose, np.float64)
    if at is not None and at.shape != (4, 4):
        raise ExportError(f"pose has the shape {at.shape}; needs (4, 4)")
    if name in ("csv", "netcdf", "mat"):
        assert motion is not None
        return _results(motion if isinstance(motion, Solution) else solve(mech, motion), path, name)
    if isinstance(motion, Solution):
        raise ExportError(f"{name} needs a motion, not its results")
    match name:
        case "stl":
            with replacing(path) as temporary:
                notes = write_stl(mech, mech.home if at is None else at, temporary)
            return Exported((path,), tuple(notes))
        case "glb":
            data, notes = _scene(mech, motion, at)
            with replacing(path) as temporary:
                temporary.write_bytes(data)
            return Exported((path,), tuple(notes))
    return _model(mech, path, name, at, look)


def format_of(path: Path, to: str | None = None) -> str:
    """The format asked for, or that of a suffix.

    Raises ExportError for an unknown suffix, UnknownNameError for an unknown format.
    """
    if to is not None:
        if to not in FORMATS:
            raise UnknownNameError("format", to, FORMATS)
        return to
    for name, format in FORMATS.items():
        if path.suffix in format.suffixes:
            return name
    known = ", ".join(suffix for format in FORMATS.values() for suffix in format.suffixes)
    raise ExportError(f"{path} ends in {path.suffix!r}, no format's suffix: {known}; or name the format")


def _check(name: str, motion: bool, pose: bool) -> None:
    format = FORMATS[name]
    if motion and format.motion == "none":
        taking = ", ".join(name for name, other in FORMATS.items() if other.motion != "none")
        raise ExportError(f"{name} holds no motion; formats that do: {taking}")
    if not motion and format.motion == "required":
        raise ExportError(f"{name} holds the results of a motion; none is given")
    if pose and not format.pose:
        taking = ", ".join(name for name, other in FORMATS.items() if other.pose)
        raise ExportError(f"{name} holds no pose but home; formats that do: {taking}")
    if pose and motion:
        raise ExportError("a motion has its own poses; give none beside it")


def _results(solution: Solution, path: Path, name: str) -> Exported:
    if name == "mat":
        with replacing(path) as temporary:
            write_mat(solution, temporary)
    else:
        if path.suffix not in FORMATS[name].suffixes:
            raise ExportError(f"{path}: a file of {name} ends in {FORMATS[name].suffixes[0]}")
        solution.save(path)
    return Exported((path,), ())


def _scene(mech: Mechanism, motion: Motion | None, pose: Array | None) -> tuple[bytes, list[str]]:
    if motion is None:
        return glb(mech, mech.home if pose is None else pose)
    start, end = motion.time[0], motion.time[-1]
    time = np.linspace(start, end, max(2, math.ceil(RATE * (end - start)) + 1))
    even = motion.sample(time)
    return glb(mech, states_along(mech, even).pose, time)


def _model(mech: Mechanism, path: Path, name: str, pose: Array | None, look: Look) -> Exported:
    """A model file, its side-car and its meshes."""
    shapes = _shapes(mech, look)
    model = Model(mech)
    if name == "mjcf":
        text, notes = mjcf(model, shapes, pose)
        return Exported((_write(path, text),), tuple(notes))
    folder = path.with_name(f"{path.stem}_meshes")
    saved = save_meshes(model, shapes, folder)
    uris = {shape: f"{folder.name}/{file.name}" for shape, file in saved.items()}
    if name == "sdf":
        text, notes = sdf(model, shapes, uris)
        return Exported((_write(path, text), *saved.values()), tuple(notes))
    packaged = {shape: f"package://{uri}" for shape, uri in uris.items()}
    sidecar = path.with_suffix(".yaml")
    text, loops, notes = urdf(model, shapes, packaged, sidecar.name)
    return Exported((_write(path, text), _write(sidecar, loops), *saved.values()), tuple(notes))


def _shapes(mech: Mechanism, look: str) -> dict[str, list[Shape]]:
    match look:
        case "meshes":
            return meshes(mech)
        case "simple":
            return simple(mech)
        case "none":
            return {}
    raise UnknownNameError("look", look, ("meshes", "simple", "none"))


def _write(path: Path, text: str) -> Path:
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path
