"""Curves over time and views of workspaces on given axes; no plotting function shows anything."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import polypod as pp
from polypod import plots
from polypod.bodies.palette import PALETTE
from polypod.errors import PolypodError, UnknownNameError, WorkspaceError
from polypod.plots.series import math_symbols, math_unit

NAME = "lu-3spu-2rpu-r"


@pytest.fixture(autouse=True)
def nothing_is_shown(monkeypatch):
    """Matplotlib's settings stay, no figure stays open, and none is shown."""

    def show(*args, **kwargs):
        pytest.fail("a plotting function shows its figure")

    monkeypatch.setattr(plt, "show", show)
    monkeypatch.setattr(Figure, "show", show)
    before = dict(mpl.rcParams)
    yield
    assert dict(mpl.rcParams) == before
    plt.close("all")


@pytest.fixture(scope="module")
def mech():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def solution(mech):
    return pp.solve(mech, pp.load_motion(NAME, mech), reactions=True)


@pytest.fixture(scope="module")
def reach(mech):
    return pp.workspace(mech, step=0.1)


@pytest.fixture(scope="module")
def tilts(mech):
    return pp.workspace(mech, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7}, step=0.2)


def curves(ax):
    return [line for line in ax.lines if not line.get_label().startswith("_child")]


def test_no_source_shows():
    for path in Path(pp.__file__).parent.rglob("*.py"):
        assert not re.search(r"\bshow\(\)|\.ion\(", path.read_text(encoding="utf-8")), path


def test_every_plot_takes_axes_or_a_figure_and_returns_it(mech, solution, reach):
    """All that `polypod.plots` offers; what has several panels takes a figure."""
    calls = {
        "plot_mechanism": lambda on: plots.plot_mechanism(mech, ax=on),
        "plot_topology": lambda on: plots.plot_topology(mech.mobility(), on),
        "plot_series": lambda on: plots.plot_series(solution, "force", on),
        "plot_workspace_view": lambda on: plots.plot_workspace_view(reach, on),
        "plot_poses": lambda on: plots.plot_poses(mech, [mech.home], on),
        "plot_fig1": lambda on: plots.plot_fig1(mech, {"home": mech.home}, on),
        "plot_fig2": lambda on: plots.plot_fig2(mech, mech.home, figure=on),
        "plot_fig4": lambda on: plots.plot_fig4(solution, on),
        "plot_workspace": lambda on: plots.plot_workspace(reach, on),
    }
    offered = {name for name, _ in inspect.getmembers(plots, inspect.isfunction) if name.startswith("plot_")}
    assert offered == {*calls}
    for name, call in calls.items():
        figure = Figure(figsize=(7, 7))
        parameters = inspect.signature(getattr(plots, name)).parameters
        kind = {"projection": "3d"} if name == "plot_mechanism" else {}
        on = figure.add_subplot(**kind) if "ax" in parameters else figure
        assert call(on) is on, name
        assert plt.get_fignums() == [], f"{name} makes a figure beside the one given"


@pytest.mark.parametrize(
    ("name", "where", "expected", "label", "names"),
    [
        ("force", {}, lambda d: d.force / 1e3, "active force of the leg $f_{a}$ / kN", 5),
        ("length", {}, lambda d: 1e3 * d.length, "leg length $r$ / mm", 5),
        ("length", {"leg": "2"}, lambda d: 1e3 * d.length[:, [1]], "leg length $r$ / mm", 0),
        ("rate", {"leg": ["3", "1"]}, lambda d: 1e3 * d.rate[:, [2, 0]], "leg rate $v_{r}$ / mm s$^{-1}$", 2),
        ("sigma_min", {}, lambda d: d.sigma_min, r"$\sigma$", 0),
        ("coordinate_alpha", {}, lambda d: np.degrees(d.coordinate_alpha), "coordinate alpha $α$ / deg", 0),
        ("rod_omega", {"rod": "L"}, lambda d: d.rod_omega[:, 0], "rad s$^{-1}$", 3),
        ("limit_margin", {}, lambda d: 1e3 * d.limit_margin, "/ mm", 10),
        ("coupled_force", {}, lambda d: d.coupled_force, r"$f_{\mathrm{c1}}$, $f_{\mathrm{c3}}$ / N", 2),
        (
            "twist",
            {"component": ["angular x", "angular z"]},
            lambda d: d.twist[:, [3, 5]],
            "rad s$^{-1}$",
            2,
        ),
        ("twist", {"component": "linear y"}, lambda d: 1e3 * d.twist[:, 1], "mm s$^{-1}$", 0),
        (
            "reaction",
            {"joint": "rod L", "component": ["linear x"]},
            lambda d: d.reaction.sel(joint="rod L")[:, [0]] / 1e3,
            " / kN",
            1,
        ),
    ],
)
def test_a_series_shows_the_solution(solution, name, where, expected, label, names):
    ax = plots.plot_series(solution, name, Figure().subplots(), **where)
    values = np.asarray(expected(solution.dataset)).reshape(801, -1)
    assert ax.get_xlabel() == "time $t$ / s"
    if name != "sigma_min":
        assert label in ax.get_ylabel().replace("\n", " ")
    drawn = [line for line in ax.lines if len(line.get_xdata()) == 801]
    assert len(drawn) == values.shape[1]
    for line, column in zip(drawn, values.T, strict=True):
        assert np.array_equal(line.get_xdata(), solution.dataset.time)
        assert np.allclose(line.get_ydata(), column, rtol=1e-12)
    legend = ax.get_legend()
    assert (len(legend.get_texts()) if legend else 0) == names
    if names and names <= len(PALETTE):
        assert [to_hex(line.get_color()).upper() for line in drawn] == list(PALETTE[:names])


def test_strokes_are_marked(solution):
    ax = plots.plot_series(solution, "length", Figure().subplots())
    assert {line.get_ydata()[0] for line in ax.lines if len(line.get_xdata()) == 2} == {650.0, 850.0}


def test_states_without_answer_are_grey(mech):
    time = np.linspace(0.0, 1.0, 21)
    height = {"alpha": 0.1 + 0 * time, "p": -0.3 + 0 * time, "h": 0.6 + 0.5 * time}
    motion = pp.Motion.through(
        time, {**height, "beta": 0.7 + 0 * time, "gamma": 0.6 + 0 * time}, set="natural"
    )
    solved = pp.solve(mech, motion)
    assert (solved.dataset.status != 0).any()
    ax = plots.plot_series(solved, "force", Figure().subplots())
    assert len(ax.patches) >= 1
    held = pp.Solution(solved.dataset.isel(time=np.flatnonzero(solved.dataset.status == 0)))
    assert len(plots.plot_series(held, "force", Figure().subplots()).patches) == 0


@pytest.mark.parametrize(
    ("name", "where", "error", "message"),
    [
        ("forces", {}, UnknownNameError, "force"),
        ("force", {"log": "1"}, UnknownNameError, "leg"),
        ("force", {"leg": "6"}, UnknownNameError, "6"),
        ("force", {"leg": ["1", "6"]}, UnknownNameError, "6"),
        ("twist", {}, PolypodError, r"twist is in m/s, rad/s; choose one, such as component=\['linear x', "),
        ("piston_velocity", {}, PolypodError, "a curve for each leg and axis; choose, such as leg='1'"),
        ("reaction", {"joint": "rod L"}, PolypodError, "reaction is in N, N m"),
        ("pose", {}, PolypodError, "a curve for each row and column"),
    ],
)
def test_what_is_no_series_is_told(solution, name, where, error, message):
    with pytest.raises(error, match=message):
        plots.plot_series(solution, name, Figure().subplots(), **where)


def test_limits_in_several_units_are_chosen(mech):
    content = mech.to_dict()
    content.setdefault("limits", {})["sigma_min"] = 0.01
    limited = pp.Mechanism.from_dict(content)
    solved = pp.solve(limited, pp.load_motion(NAME, limited).sample([0.0, 0.5, 1.0]))
    with pytest.raises(
        PolypodError, match=r"limit_margin is in m, 1; choose one, such as limit=\['stroke min"
    ):
        plots.plot_series(solved, "limit_margin", Figure().subplots())
    ax = plots.plot_series(solved, "limit_margin", Figure().subplots(), limit="stroke min of leg 2")
    assert ax.get_ylabel().endswith("/ mm")


@pytest.mark.parametrize(
    ("view", "labels"),
    [
        ("top", ("$X_o$ / mm", "$Y_o$ / mm")),
        ("side", ("$Y_o$ / mm", "$Z_o$ / mm")),
        ("front", ("$X_o$ / mm", "$Z_o$ / mm")),
    ],
)
def test_a_view_is_as_large_as_the_workspace(reach, view, labels):
    ax = plots.plot_workspace_view(reach, Figure().subplots(), view=view)
    assert (ax.get_xlabel(), ax.get_ylabel()) == labels
    for (low, high), label in zip((ax.dataLim.intervalx, ax.dataLim.intervaly), labels, strict=True):
        axis = "XYZ".index(label[1])
        extent = 1e3 * reach.extents[axis]
        assert extent[0] - 1e-3 <= low <= high <= extent[1] + 1e-3
        assert high - low > 0.9e3 * np.ptp(reach.vertices[:, axis])
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert {*told} == {*reach.shares}


def test_views_that_do_not_exist(reach, tilts):
    with pytest.raises(UnknownNameError, match="isometric"):
        plots.plot_workspace_view(reach, Figure().subplots(), view="bottom")
    with pytest.raises(WorkspaceError, match="outline and no views"):
        plots.plot_workspace_view(tilts, Figure().subplots(), view="top")
    ax = plots.plot_workspace_view(tilts, Figure().subplots(), legend=False)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("azimuth / deg", "tilt / deg")
    assert ax.get_legend() is None


def test_symbols_and_units_as_formulas():
    assert math_symbols("σ_min") == r"$σ_{\mathrm{min}}$"
    assert math_symbols("f_a") == "$f_{a}$"
    assert math_symbols("α''") == "$α''$"
    assert math_symbols("det J") == "det $J$"
    assert math_symbols("") == ""
    assert math_unit("mm/s^2") == "mm s$^{-2}$"
    assert math_unit("N m") == "N m"
    assert math_unit("m/s and rad/s") == "m/s and rad/s"


def test_colours_are_told_apart_by_colour_blind_readers():
    """Any two neighbours of the palette differ in lightness or for both common kinds of colour blindness."""
    # Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB: protanopia and deuteranopia.
    blind = np.array(
        [
            [
                [0.152286, 1.052583, -0.204868],
                [0.114503, 0.786281, 0.099216],
                [-0.003882, -0.048116, 1.051998],
            ],
            [
                [0.367322, 0.860646, -0.227968],
                [0.280085, 0.672501, 0.047413],
                [-0.011820, 0.042940, 0.968881],
            ],
        ]
    )
    rgb = np.array([[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in PALETTE])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    for matrix in (np.eye(3), *blind):
        seen = np.clip(linear @ matrix.T, 0.0, 1.0) ** (1 / 2.2)
        apart = np.linalg.norm(seen[:, None] - seen, axis=-1)[~np.eye(len(seen), dtype=bool)]
        assert apart.min() > 0.12
