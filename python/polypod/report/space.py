"""The workspace in space, as Plotly draws it: its boundary, the mechanism at home, the path of o."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from polypod.bodies.palette import GREY, color_of
from polypod.mechanism import Mechanism
from polypod.plots.workspace import face_labels
from polypod.report.decimate import kept
from polypod.report.formulas import to_html
from polypod.workspaces.workspace import Workspace

Array = NDArray[np.float64]

_MM = 1e3
_CAMERA = {"eye": {"x": 1.05, "y": -1.55, "z": 0.75}, "center": {"x": 0, "y": 0, "z": -0.14}}
_LIGHTING = {"ambient": 0.55, "diffuse": 0.6, "specular": 0.08, "roughness": 0.9, "fresnel": 0.0}
_AXES = {"x": "$X_o$ / mm", "y": "$Y_o$ / mm", "z": "$Z_o$ / mm"}


def workspace_figure(workspace: Workspace, path: Array | None) -> str:
    """The figure as JSON. `path`, (N, 3) in m, is that of o along a motion."""
    mech = workspace.mechanism
    figure = go.Figure([*_boundary(workspace), *_mechanism(mech)])
    if path is not None and np.isfinite(path).any():
        at = kept(path)
        figure.add_trace(_line(path[at], "path of o", "#000000", width=5))
    axes = {
        f"{name}axis": {"title": {"text": str(to_html(text))}, "showbackground": False}
        for name, text in _AXES.items()
    }
    figure.update_layout(
        scene={
            **axes,
            "aspectmode": "data",
            "camera": _CAMERA,
        },
        legend={"itemsizing": "constant", "font": {"size": 12}},
        margin={"l": 0, "r": 0, "t": 8, "b": 0},
        template="none",
    )
    text: str = figure.to_json()
    return text


def _boundary(workspace: Workspace) -> list[go.Mesh3d]:
    """One mesh for each thing that ends the workspace, in its colour."""
    labels = face_labels(workspace)
    vertices = (_MM * workspace.vertices).astype(np.float32)
    traces = []
    for name in workspace.shares:
        label = workspace.label_names.index(name)
        faces = workspace.faces[labels == label]
        if not len(faces):
            continue
        used, corners = np.unique(faces, return_inverse=True)
        x, y, z = vertices[used].T
        i, j, k = corners.reshape(-1, 3).astype(np.int32).T
        traces.append(
            go.Mesh3d(
                x=x, y=y, z=z, i=i, j=j, k=k,
                color=workspace.colors[label],
                name=_escaped(name),
                showlegend=True,
                flatshading=False,
                lighting=_LIGHTING,
                lightposition={"x": -4000, "y": -6000, "z": 9000},
                hovertemplate="%{x:.0f}, %{y:.0f}, %{z:.0f} mm<extra>" + _escaped(name) + "</extra>",
            )
        )  # fmt: skip
    return traces


def _mechanism(mech: Mechanism) -> list[go.Scatter3d]:
    """Base, legs and platform at the centre pose as lines."""
    base = np.array([leg["base"]["point"] for leg in mech.geometry["legs"]])
    ends = base + mech.inverse_kinematics(mech.home).vectors
    gap = np.full(3, np.nan)
    legs = np.concatenate([np.stack([start, end, gap]) for start, end in zip(base, ends, strict=True)])
    return [
        _line(legs, "legs at the centre pose", GREY, width=4),
        _line(np.vstack([base, base[:1]]), "base joints", GREY, width=3, markers=True),
        _line(np.vstack([ends, ends[:1]]), "platform joints", color_of(0), width=3, markers=True),
    ]


def _line(points: Array, name: str, color: str, *, width: float, markers: bool = False) -> go.Scatter3d:
    x, y, z = (_MM * points).astype(np.float32).T
    style: dict[str, Any] = {"mode": "lines+markers", "marker": {"size": 3}} if markers else {"mode": "lines"}
    return go.Scatter3d(
        x=x, y=y, z=z, name=name, line={"color": color, "width": width}, hoverinfo="skip", **style
    )  # fmt: skip


def _escaped(name: str) -> str:
    """A name that holds no tags and no templates of Plotly."""
    return str(to_html(name.replace("$", ""))).replace("%{", "% {")
