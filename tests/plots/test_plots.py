"""Figures: what is on them, and that they leave everything else alone."""

from __future__ import annotations

import matplotlib as mpl

mpl.use("Agg")


import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import polypod as pp
from polypod import plots
from polypod.bodies.palette import PALETTE
from polypod.errors import PolypodError, ShapeError, WorkspaceError
from polypod.plots.scene import Scene
from polypod.workspaces.cut import above
from support import DATA

NAME = "lu-3spu-2rpu-r"
FILES = [NAME, *sorted(str(path) for path in DATA.glob("*.toml"))]


@pytest.fixture(autouse=True)
def nothing_else_changes():
    """Matplotlib's settings stay, and no figure stays open."""
    before = dict(mpl.rcParams)
    yield
    assert dict(mpl.rcParams) == before
    plt.close("all")


@pytest.fixture(scope="module")
def mech():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def solution(mech):
    return pp.solve(mech, pp.load_motion(NAME, mech))


def solve_some(mech, **coordinates):
    """A short motion in the set `pose`."""
    time = np.linspace(0.0, 1.0, 11)
    given = {name: value + 0.02 * np.sin(time) for name, value in coordinates.items()}
    return pp.solve(mech, pp.Motion.through(time, given, set="pose", name="short"))


def labels_of(ax):
    return [line.get_label() for line in ax.lines if not line.get_label().startswith("_")]


# --- Fig. 4 -------------------------------------------------------------------------------------------------


def test_fig4_has_the_twelve_panels_of_the_paper(solution):
    figure = Figure(figsize=(10, 10.5))
    assert plots.plot_fig4(solution, figure) is figure
    assert [labels_of(ax) for ax in figure.axes] == [
        ["$X_o$", "$Y_o$", "$Z_o$"],
        ["$v_x$", "$v_y$", "$v_z$"],
        ["$a_x$", "$a_y$", "$a_z$"],
        [r"$\omega_x$", r"$\omega_y$", r"$\omega_z$"],
        [r"$\varepsilon_x$", r"$\varepsilon_y$", r"$\varepsilon_z$"],
        [r"$\alpha$", r"$\beta$", r"$\gamma$"],
        [f"$r_{{{i}}}$" for i in range(1, 6)],
        [f"$v_{{r{i}}}$" for i in range(1, 6)],
        [f"$a_{{r{i}}}$" for i in range(1, 6)],
        [f"$f_{{a{i}}}$" for i in range(1, 6)],
        ["$f_{c1}$", "$f_{c3}$"],
        ["$T_c$"],
    ]
    letters = [text.get_text() for ax in figure.axes for text in ax.texts]
    assert letters == [f"({letter})" for letter in "abcdefghijkl"]
    for ax in figure.axes:
        assert " / " in ax.get_ylabel()


def test_fig4_shows_the_solution(solution):
    data = solution.dataset
    axes = plots.plot_fig4(solution).axes
    time, x = axes[0].lines[0].get_data()
    np.testing.assert_array_equal(time, data["time"])
    np.testing.assert_allclose(x, 1e3 * data["pose"][:, 0, 3], rtol=1e-15)
    np.testing.assert_allclose(axes[5].lines[2].get_ydata(), np.degrees(data["coordinate_gamma"]), rtol=1e-15)
    assert axes[9].get_ylabel().endswith("/ kN")
    np.testing.assert_allclose(axes[9].lines[4].get_ydata(), 1e-3 * data["force"][:, 4], rtol=1e-15)
    np.testing.assert_allclose(axes[11].lines[0].get_ydata(), data["coupled_torque"], rtol=1e-15)
    limits = [line.get_ydata()[0] for line in axes[6].lines if line.get_label().startswith("_")]
    assert limits == pytest.approx([650.0, 850.0])


def test_fig4_of_a_mechanism_without_rod_shows_its_constraints():
    mech = pp.load(FILES[1])
    axes = plots.plot_fig4(solve_some(mech, z=0.5, rx=0.0, ry=0.0)).axes
    assert len(axes) == 12
    assert labels_of(axes[10]) == ["$f_{c,1}$", "$f_{c,2}$", "$f_{c,3}$"]
    assert axes[10].get_ylabel() == "constraint $f_c$ / N"
    assert labels_of(axes[11]) == [r"$\sigma_\mathrm{min}$"]


@pytest.mark.parametrize(("kinds", "unit"), [("BBE", "N"), ("DDD", "N m"), ("ADE", "N or N m")])
def test_multipliers_have_the_unit_of_their_kind(kinds, unit):
    """All but those of kind D are those of a length: forces."""
    mech = pp.load(FILES[1])
    data = solve_some(mech, z=0.5, rx=0.0, ry=0.0).dataset
    rows = [f"{kind} of leg {i + 1}" for i, kind in enumerate(kinds)]
    assert plots.fig4_panels(data.assign_coords(constraint_row=rows))[10].unit == unit


def test_fig4_of_a_mechanism_without_constraints_shows_power():
    mech = pp.load(FILES[2])
    axes = plots.plot_fig4(solve_some(mech, x=0.0, y=0.0, z=0.6, rx=0.0, ry=0.0, rz=0.0)).axes
    assert labels_of(axes[10]) == ["$P$"]
    assert labels_of(axes[5]) == ["$r_x$", "$r_y$", "$r_z$"]


def test_fig4_marks_states_without_answer(mech, tmp_path):
    time = np.linspace(0.0, 1.0, 11)
    given = {"x": 0 * time, "y": 0.04 + 0.5 * time**9, "z": 0.7 + 0 * time}
    given |= {"alpha": 0 * time, "beta": 0.3 + 0 * time}
    solution = pp.solve(mech, pp.Motion.through(time, given, set="paper", name="lost"))
    assert (solution.dataset["status"] == pp.Status.NO_BRANCH).any()
    figure = plots.plot_fig4(solution)
    assert all(ax.patches for ax in figure.axes)
    assert "no branch" in figure.get_supxlabel()
    plots.save_figure(figure, tmp_path / "lost.png")


def test_fig4_without_any_answer(mech, tmp_path):
    time = np.linspace(0.0, 1.0, 5)
    given = dict.fromkeys(("x", "alpha", "beta"), 0 * time) | {"y": 0.5 + 0 * time, "z": 0.7 + 0 * time}
    figure = plots.plot_fig4(pp.solve(mech, pp.Motion.through(time, given, set="paper", name="none")))
    plots.save_figure(figure, tmp_path / "none.png")


# --- the mechanism in space ---------------------------------------------------------------------------------


@pytest.mark.parametrize("file", FILES)
def test_mechanism_fits_its_axes_at_one_scale(file, tmp_path):
    mech = pp.load(file)
    ax = plots.plot_mechanism(mech)
    plots.save_figure(ax.figure, tmp_path / "m.png")  # draws
    spans = np.array([np.ptp(limits) for limits in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())])
    np.testing.assert_allclose(spans / ax._box_aspect, spans[0] / ax._box_aspect[0])
    legend = [text.get_text()[0] for text in ax.get_legend().get_texts()]
    assert set(legend) == {joint for letters in mech.leg_letters for joint in letters.replace("P", "", 1)}
    texts = [text.get_text() for text in ax.texts]
    assert len(texts) == len(set(texts)) == 2 * mech.n_legs + 8 + len(mech.rod_names)


def test_mechanism_on_given_axes(mech):
    figure = Figure()
    ax = figure.add_subplot(projection="3d")
    assert plots.plot_mechanism(mech, mech.home, ax, labels=False) is ax
    assert not ax.texts
    assert ax.get_legend() is None
    with pytest.raises(PolypodError, match="3d"):
        plots.plot_mechanism(mech, mech.home, figure.add_subplot())


@pytest.mark.parametrize("pose", [np.eye(3), np.zeros((2, 4, 4)), np.full((4, 4), np.nan)])
def test_what_is_no_pose_is_told(mech, pose):
    with pytest.raises(ShapeError, match="pose"):
        plots.plot_mechanism(mech, pose)


def test_poses_side_by_side(mech, solution, tmp_path):
    poses = solution.dataset["pose"].to_numpy()
    figure = plots.plot_poses(mech, {"home": mech.home, "start": poses[0], "middle": poses[400]}, columns=2)
    assert len(figure.axes) == 3
    captions = [text.get_text() for text in figure.texts]
    assert captions == ["(a)  home", "(b)  start", "(c)  middle"]
    scales = {tuple(np.round(ax._box_aspect, 9)) for ax in figure.axes}
    assert len(scales) == 1
    plots.save_figure(figure, tmp_path / "poses.svg")
    assert len(plots.plot_poses(mech, iter(poses[:2])).axes) == 2
    with pytest.raises(ShapeError, match="empty"):
        plots.plot_poses(mech, [])


def test_leg_names_of_any_kind_are_drawn(tmp_path):
    data = pp.load(FILES[1]).to_dict()
    for leg, name in zip(data["legs"], ("front_left", "$x^2$ {", "größe 7"), strict=True):
        leg["name"] = name
    mech = pp.Mechanism.from_dict(data)
    plots.save_figure(plots.plot_mechanism(mech).figure, tmp_path / "m.png")
    plots.save_figure(plots.plot_topology(mech.mobility()).figure, tmp_path / "t.png")
    plots.save_figure(plots.plot_fig4(solve_some(mech, z=0.5, rx=0.0, ry=0.0)), tmp_path / "f.png")


def test_passive_leg_with_a_fixed_joint(tricept, tmp_path):
    mech = tricept()
    plots.save_figure(plots.plot_mechanism(mech).figure, tmp_path / "m.png")
    ax = plots.plot_topology(mech.mobility())
    assert "piston post" not in [text.get_text() for text in ax.texts]


@pytest.mark.parametrize("file", FILES)
def test_faces_of_a_scene_have_colours_and_look_at_the_viewer(file):
    mech = pp.load(file)
    scene = Scene(mech, mech.home)
    corners, colors = scene.faces.seen(np.array([0.0, 0.0, 1.0]))
    assert len(corners) == len(colors) < len(scene.faces.corners())
    assert ((colors >= 0.0) & (colors <= 1.0)).all()


# --- topology -----------------------------------------------------------------------------------------------


def test_topology_of_the_paper(mech):
    ax = plots.plot_topology(mech.mobility())
    texts = [text.get_text() for text in ax.texts]
    for link in ("base  (quaternary)", "platform  (pentagonal)", "rod L  (ternary)", "piston 3"):
        assert link in texts
    joints = [text for text in texts if len(text) == 1]
    assert {kind: joints.count(kind) for kind in "RSUP"} == {"R": 3, "S": 3, "U": 5, "P": 5}
    height = {text.get_text(): text.get_position()[1] for text in ax.texts}
    chain = ("base  (quaternary)", "rod L  (ternary)", "cylinder 1", "piston 1", "platform  (pentagonal)")
    assert [height[link] for link in chain] == sorted(height[link] for link in chain)
    x = {text.get_text(): text.get_position()[0] for text in ax.texts}
    assert abs(x["cylinder 1"] - x["cylinder 3"]) == 1  # legs of one rod stand side by side


@pytest.mark.parametrize("file", FILES)
def test_topology_of_any_mechanism(file):
    mobility = pp.load(file).mobility()
    figure = Figure()
    ax = figure.add_subplot()
    assert plots.plot_topology(mobility, ax) is ax
    assert len(ax.patches) == mobility.links
    assert len(ax.texts) == mobility.links + mobility.joints


# --- files --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".svg", ".png"])
def test_saved_figures_are_the_same_bytes_each_time(mech, tmp_path, suffix):
    files = []
    for name in ("first", "second"):
        path = tmp_path / (name + suffix)
        plots.save_figure(plots.plot_mechanism(mech).figure, path)
        files.append(path.read_bytes())
    assert files[0] == files[1]
    assert len(files[0]) > 20_000


def test_unknown_suffix(tmp_path):
    with pytest.raises(PolypodError, match=r"\.svg or \.png"):
        plots.save_figure(Figure(), tmp_path / "figure.gif")


def test_palette_is_distinct():
    assert len(set(PALETTE)) == len(PALETTE) == 7


# --- workspaces ---------------------------------------------------------------------------------------------


def test_four_views_of_a_workspace_and_an_outline(tmp_path):
    mech = pp.load("lu-3spu-2rpu-r")
    solid = plots.plot_workspace(pp.workspace(mech, step=0.08), Figure(figsize=(8.0, 7.4)))
    titles = [ax.get_title(loc="left") for ax in solid.axes]
    assert titles == ["(a)  top view", "(b)  side view", "(c)  front view", "(d)  isometric view"]
    top, side, front, _ = solid.axes
    assert top.get_xlabel() == "$X_o$ / mm"
    assert side.get_xlabel() == "$Y_o$ / mm"
    assert front.get_ylabel() == "$Z_o$ / mm"
    names = [text.get_text() for text in solid.legends[0].get_texts()]
    assert {f"stroke {end} of leg {leg}" for end in ("min", "max") for leg in range(1, 6)} <= {*names}
    outline = pp.workspace(mech, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7}, step=0.1)
    flat = plots.plot_workspace(outline, Figure(figsize=(5.6, 5.2)))
    assert flat.axes[0].get_ylabel() == "tilt / deg"
    assert flat.axes[0].get_ylim()[1] == pytest.approx(55.7, abs=5.0)
    for i, figure in enumerate((solid, flat)):
        plots.save_figure(figure, tmp_path / f"{i}.svg")


def test_the_part_of_a_workspace_above_a_height(tmp_path):
    found = pp.workspace(pp.load("lu-3spu-2rpu-r"), step=0.06)
    z = float(found.vertices[:, 2].max()) - 0.511
    figure = plots.plot_workspace(found, Figure(figsize=(8.0, 6.6)), above=z)
    whole = plots.plot_workspace(found, Figure(figsize=(8.0, 7.4)))
    plots.save_figure(figure, tmp_path / "cut.svg")

    def drawn(figure, view):
        """All corners of the faces in a view, mm."""
        [faces] = figure.axes[["top", "side", "front"].index(view)].collections
        return np.concatenate([path.vertices for path in faces.get_paths()])

    for view, axis in (("side", 1), ("front", 0)):
        across, up = drawn(figure, view).T
        assert up.min() == pytest.approx(1e3 * z, abs=1e-9)
        assert np.ptp(up) == pytest.approx(511.0, abs=1e-9)
        # As wide as the mesh above the height; the lower edge is straight from end to end.
        assert np.ptp(across) == pytest.approx(
            1e3 * np.ptp(above(found.vertices, found.faces, 2, z).vertices[:, axis]), abs=1e-9
        )
        edge = across[up < up.min() + 1e-6]
        assert np.ptp(edge) > 0.95 * np.ptp(across)
        assert drawn(whole, view)[:, 1].min() < 1.0
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert legend < {text.get_text() for text in whole.legends[0].get_texts()}
    assert "edge of grid" not in legend


def test_a_part_that_is_not_there_is_told():
    mech = pp.load("lu-3spu-2rpu-r")
    with pytest.raises(WorkspaceError, match=r"above is 0\.9; the greatest z .* is 0\.8"):
        plots.plot_workspace(pp.workspace(mech, step=0.12), Figure(), above=0.9)
    flat = pp.workspace(mech, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7}, step=0.2)
    with pytest.raises(WorkspaceError, match="two coordinates"):
        plots.plot_workspace(flat, Figure(), above=0.1)


# --- parts of figures ---------------------------------------------------------------------------------------

SIZE, DPI = (8, 6), 50


def drawing(what, mech, solution):
    """A function that draws on a figure or on a part of one."""
    if what == "workspace":
        found = pp.workspace(mech, step=0.12)
        return lambda canvas: plots.plot_workspace(found, canvas)
    if what == "outline":
        flat = pp.workspace(mech, ["azimuth", "tilt"], {"x": 0.0, "y": 0.1, "z": 0.7}, step=0.2)
        return lambda canvas: plots.plot_workspace(flat, canvas)
    if what == "mechanism":
        return lambda canvas: plots.plot_mechanism(mech, ax=canvas.add_axes((0, 0, 1, 1), projection="3d"))
    if what == "poses":
        poses = {"centre": mech.home, "moved": solution.dataset["pose"].to_numpy()[50]}
        return lambda canvas: plots.plot_poses(mech, poses, canvas)
    return lambda canvas: plots.plot_fig4(solution, canvas)


def pixels(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


@pytest.mark.parametrize("what", ["workspace", "outline", "mechanism", "poses", "fig4"])
def test_a_part_of_a_figure_looks_like_a_figure(what, mech, solution):
    draw = drawing(what, mech, solution)
    alone, both = Figure(SIZE, dpi=DPI), Figure((2 * SIZE[0], SIZE[1]), dpi=DPI)
    draw(alone)
    part, beside = both.subfigures(1, 2)
    draw(part)
    beside.subplots().plot([0, 1])
    assert np.array_equal(pixels(both)[:, : SIZE[0] * DPI], pixels(alone))


@pytest.mark.parametrize("what", ["workspace", "outline", "poses", "fig4"])
def test_layout_engines_leave_panels_where_they_are(what, mech, solution):
    """Of the figure that is given none remains; of a part's the other parts keep it."""
    draw = drawing(what, mech, solution)
    plain, given, both = (Figure(SIZE, layout=layout) for layout in (None, "constrained", "constrained"))
    part, beside = both.subfigures(2, 1)
    beside.subplots().plot([0, 1])
    places = []
    for canvas, whole in ((plain, plain), (given, given), (part, both)):
        draw(canvas)
        before = [ax.get_position(original=True).bounds for ax in canvas.axes]
        pixels(whole)
        places.append([ax.get_position(original=True).bounds for ax in canvas.axes])
        assert before == places[-1]
    assert places[0] == places[1]
    assert type(both.get_layout_engine()).__name__ == "ConstrainedLayoutEngine"


def test_a_part_of_a_figure_is_saved_with_the_whole(tmp_path):
    figure = Figure()
    part, _ = figure.subfigures(1, 2)
    plots.save_figure(figure, tmp_path / "whole.png")
    plots.save_figure(part, tmp_path / "part.png")
    assert (tmp_path / "whole.png").read_bytes() == (tmp_path / "part.png").read_bytes()
