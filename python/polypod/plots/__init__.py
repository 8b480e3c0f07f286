"""Figures: the mechanism in space, its links as a graph, workspaces, curves, and those of the paper.

Each function draws on the axes or figure that it is given, or makes them with pyplot; none shows or saves.
"""

from polypod.plots.canvas import save_figure
from polypod.plots.fig1 import plot_fig1
from polypod.plots.fig2 import plot_fig2
from polypod.plots.fig4 import fig4_panels, plot_fig4
from polypod.plots.mechanism import plot_mechanism, plot_poses
from polypod.plots.series import plot_series
from polypod.plots.topology import plot_topology
from polypod.plots.workspace import plot_workspace, plot_workspace_view

__all__ = [
    "fig4_panels",
    "plot_fig1",
    "plot_fig2",
    "plot_fig4",
    "plot_mechanism",
    "plot_poses",
    "plot_series",
    "plot_topology",
    "plot_workspace",
    "plot_workspace_view",
    "save_figure",
]
