"""Contents of a report, computed: each part once, by the functions that the commands use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from polypod.errors import PolypodError
from polypod.mechanism import Mechanism, load
from polypod.motion.motion import Motion
from polypod.paper.table_i import MECHANISM
from polypod.paper.tables import TABLE_II, table_i_markdown, table_iii_markdown
from polypod.report.inputs import MotionSource, Source, mechanism_source, read_motion
from polypod.report.reactions import Reactions, reactions_along
from polypod.solution.actuator_sizing import requirements
from polypod.solution.solution import Solution
from polypod.solution.solve import solve
from polypod.summary.mechanism_facts import describe
from polypod.summary.solution_facts import summarise
from polypod.workspaces.search import workspace as find_workspace
from polypod.workspaces.search_region import own_coordinates
from polypod.workspaces.workspace import Workspace

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Along:
    """Contents of a report on a motion."""

    solution: Solution
    facts: dict[str, Any]
    """As `polypod solve --json`."""
    actuators: list[dict[str, Any]]
    reactions: Reactions
    source: Source


@dataclass(frozen=True)
class Content:
    """Contents of a report."""

    mech: Mechanism
    facts: dict[str, Any]
    """As `polypod info --json`."""
    mechanism_source: Source
    along: Along | None
    workspace: Workspace | None
    no_workspace: str
    """Why there is none."""
    paper: list[tuple[str, str]]
    """Heading and Markdown of the paper's tables; empty for other mechanisms."""


def gather(
    mech: Mechanism,
    motion: MotionSource | None,
    *,
    samples: int | None = None,
    workspace: Workspace | bool = True,
    step: float | None = None,
    paper: list[tuple[str, str]] | None = None,
    progress: Progress | None = None,
) -> Content:
    """Solves what a report needs; `paper` and a `workspace` are taken as they are where given."""
    along, path = None, None
    if motion is not None:
        read, source = read_motion(motion, mech)
        if isinstance(read, Motion):
            path = read if samples is None else _sampled(read, samples)
            read = solve(mech, path, progress=progress)
        along = along_of(mech, read, source)
    found, why = workspace_of(mech, workspace, step)
    tables = paper_tables(mech, path) if paper is None else paper
    return Content(mech, describe(mech), mechanism_source(mech), along, found, why, tables)


def _sampled(motion: Motion, samples: int) -> Motion:
    return motion.sample(np.linspace(motion.time[0], motion.time[-1], samples))


def along_of(mech: Mechanism, solution: Solution, source: Source) -> Along:
    """Contents of a report on a solved motion."""
    return Along(
        solution,
        summarise(mech, solution),
        requirements(mech, solution),
        reactions_along(mech, solution),
        source,
    )


def workspace_of(
    mech: Mechanism, wanted: Workspace | bool, step: float | None
) -> tuple[Workspace | None, str]:
    """The reachable workspace, or why there is none.

    Where o does not move freely in space, as that of a 3-RPS, no grid of its positions can be followed. Two
    or three degrees of freedom then have a slice over their own coordinates, which leaves nothing out.
    """
    if isinstance(wanted, Workspace):
        return wanted, ""
    if not wanted:
        return None, "It was left out."
    try:
        return find_workspace(mech, step=step), ""
    except PolypodError as error:
        if step is not None:
            raise
        why = f"None was found: {error}."
    try:
        return (find_workspace(mech, own_coordinates(mech)), "") if mech.dof in (2, 3) else (None, why)
    except PolypodError:
        return None, why


def paper_tables(mech: Mechanism, motion: Motion | None) -> list[tuple[str, str]]:
    """Tables I-III for the paper's manipulator; nothing for another one."""
    if mech != load(MECHANISM):
        return []
    tables = [("Table I", table_i_markdown(mech)), ("Table II", TABLE_II)]
    if motion is not None and len(motion.time) > 1:
        tables.append(("Table III", table_iii_markdown(mech, motion, motion.name)))
    return tables


def path_of_o(solution: Solution) -> Any:
    """(N, 3): positions of o, m."""
    return np.asarray(solution.dataset["pose"].to_numpy()[:, :3, 3])
