"""Inputs of a report: texts of the files, versions, command line."""

from __future__ import annotations

import hashlib
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from os import PathLike
from pathlib import Path

import numpy as np

from polypod import _core
from polypod.files.units import coordinate_unit, si_unit
from polypod.mechanism import Mechanism
from polypod.motion.motion import Motion
from polypod.motion.motion_file import KIND_OF_WRENCH, load_motion, motion_text
from polypod.solution.solution import Solution

CHARACTERS = 200_000
"""A longer text is shown with its first and last lines only."""

ROWS = 2000
"""Likewise of the samples of a motion that has no file."""

PACKAGES = ("numpy", "scipy", "xarray", "matplotlib", "plotly", "jinja2", "scikit-image")
"""Those whose version may matter to a number or a figure."""

MotionSource = Motion | Solution | str | PathLike[str]


@dataclass(frozen=True)
class Source:
    """A text that went into a report."""

    title: str
    text: str
    note: str = ""


def versions() -> list[tuple[str, str]]:
    """Polypod, Python and the packages that it leans on."""
    found = [("polypod", _core.__version__), ("Python", platform.python_version())]
    for package in PACKAGES:
        try:
            found.append((package, version(package)))
        except PackageNotFoundError:
            found.append((package, "not installed"))
    return [*found, ("system", f"{platform.system()} {platform.machine()}")]


def mechanism_source(mech: Mechanism) -> Source:
    """The mechanism file."""
    return _cut(Source("Mechanism file", mech.to_toml()))


def read_motion(given: MotionSource, mech: Mechanism) -> tuple[Motion | Solution, Source]:
    """The motion, or its solution, and the text that it came from.

    Raises MotionError and UnknownNameError as `load_motion` does.
    """
    if isinstance(given, Solution):
        name = given.dataset.attrs["motion"]
        note = "A solution was given; its motion is not among its data."
        return given, Source(f"Motion {name}", "", note)
    if isinstance(given, Motion):
        return given, _samples(given)
    motion = load_motion(given, mech)
    return motion, _cut(Source(f"Motion file {Path(given).name}", motion_text(given)))


def _samples(motion: Motion) -> Source:
    """A motion that has no file as a CSV file with its samples."""
    names = [*motion.coordinates]
    columns = [motion.time, *motion.coordinates.values()]
    header = ["time [s]", *(f"{name} [{coordinate_unit(name)}]" for name in names)]
    if motion.wrench is not None:
        columns += [*motion.wrench.T]
        header += [f"{name} [{si_unit(kind or '')}]" for name, kind in KIND_OF_WRENCH.items()]
    count = len(motion.time)
    shown = np.arange(count) if count <= ROWS else np.r_[: ROWS // 2, count - ROWS // 2 : count]
    lines = [", ".join(header)]
    for i in shown.tolist():
        if count > ROWS and i == count - ROWS // 2:
            lines.append(f"# ... {count - ROWS} rows are left out here ...")
        lines.append(", ".join(repr(float(column[i])) for column in columns))
    note = "It was made in Python. These are its samples; rates and all between come from its own curve."
    return Source(f"Motion {motion.name}", "\n".join(lines) + "\n", note)


def _cut(source: Source) -> Source:
    """The text, or its beginning and end with a digest of the whole."""
    text = source.text
    if len(text) <= CHARACTERS:
        return source
    half = CHARACTERS // 2
    head = text[: text.rfind("\n", 0, half) + 1]
    tail = text[len(text) - half :].partition("\n")[2]
    left_out = text.count("\n") - head.count("\n") - tail.count("\n")
    digest = hashlib.sha256(text.encode("utf-8")).hexdigest()
    note = f"{left_out} lines in the middle are left out. SHA-256 of the whole text: {digest}"
    return Source(source.title, f"{head}# ... {left_out} lines are left out here ...\n{tail}", note)
