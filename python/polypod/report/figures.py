"""The figures of a report that do not move, in the house style, as pictures inside the page."""

from __future__ import annotations

import base64
import io
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from polypod.mechanism import Mechanism
from polypod.plots import plot_mechanism, plot_poses, plot_topology, plot_workspace
from polypod.plots.style import house_style
from polypod.solution.solution import Solution
from polypod.workspaces.workspace import Workspace

Array = NDArray[np.float64]

POSES = 4
"""Poses of the motion that are drawn."""


class Picture(NamedTuple):
    """A figure as it stands in the page."""

    address: str
    """data:image/svg+xml;base64,…"""
    text: str
    """Alternative text."""


def mechanism_picture(mech: Mechanism) -> Picture:
    """The mechanism at its centre pose."""
    figure = Figure(figsize=(5.2, 5.4))
    plot_mechanism(mech, ax=figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d"))
    return Picture(_address(figure), f"The mechanism {mech.name} at its centre pose, to scale")


def topology_picture(mech: Mechanism) -> Picture:
    """Links and joints as a graph."""
    figure = Figure(figsize=(max(4.6, 1.15 * mech.n_legs + 1.2), 4.4), layout="constrained")
    plot_topology(mech.mobility(), figure.add_subplot())
    return Picture(_address(figure), "Topology graph: links and the joints between them")


def poses_picture(mech: Mechanism, solution: Solution) -> Picture | None:
    """The mechanism at instants spread over its motion, those with a pose; None where there are none."""
    poses, time = solution.dataset["pose"].to_numpy(), solution.dataset["time"].to_numpy()
    known = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
    if not known.size:
        return None
    # From the first to the last but one of evenly spread instants: a closed motion ends where it began.
    at = np.unique(known[np.linspace(0, known.size - 1, POSES + 1).astype(int)[:POSES]])
    captions = {f"$t$ = {time[i]:g} s": poses[i] for i in at}
    figure = Figure(figsize=(3.1 * len(captions), 3.4))
    plot_poses(mech, captions, figure)
    return Picture(_address(figure), f"The mechanism at {len(captions)} instants of its motion")


def workspace_picture(workspace: Workspace) -> Picture:
    """Views of a workspace along the axes, or its outline."""
    figure = Figure(figsize=(8.0, 7.4))
    plot_workspace(workspace, figure)
    return Picture(_address(figure), f"The workspace in {', '.join(workspace.names)}")


def _address(figure: Figure) -> str:
    """The figure as an SVG; apart from the page, so that names inside it cannot clash."""
    file = io.BytesIO()
    with house_style():
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": "Polypod"}, dpi=200)
    return f"data:image/svg+xml;base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
