"""Fig. 2: what is drawn are the mechanism's answers, held against the paper's relations between them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.proj3d import proj_transform

import polypod as pp
from polypod.errors import PolypodError, ShapeError
from polypod.plots import plot_fig2, save_figure
from polypod.plots.view import Arrow
from support import DATA
from support.pictures import overlaps

NAME = "lu-3spu-2rpu-r"


class Drawn:
    """A panel as it was drawn: vectors by their names, divided by their scales."""

    def __init__(self, ax, scales):
        arrows = [artist for artist in ax.get_children() if isinstance(artist, Arrow)]
        self.tail, self.way = {}, {}
        for arrow in arrows:
            vector = arrow.vector
            start, end = vector.ends
            self.tail[vector.name] = start
            self.way[vector.name] = (end - start) / scales.get(vector.name.split()[0], 1.0)
            # On paper the arrow, or the longer of two, joins just these points.
            seen = np.array(proj_transform(*vector.ends.T, ax.get_proj()))[:2].T
            first, last = np.array(arrow._posA_posB)
            np.testing.assert_allclose(first, seen[0], atol=1e-12)
            assert np.linalg.norm(last - first) <= np.linalg.norm(seen[1] - seen[0]) + 1e-12
        self.double = {arrow.vector.name for arrow in arrows if arrow.vector.double}
        self.heads = {name: sum(a.vector.name == name for a in arrows) for name in self.tail}
        points = [np.array(line.get_data_3d())[:, 0] for line in ax.lines if line.get_linestyle() == "None"]
        self.mass_centres = points[::2]  # each is a light and a dark marker
        self.names = {text.get_text() for text in ax.texts}


def panels(figure):
    """The panels by their captions, and the scales of what is no length."""
    figure.draw_without_rendering()
    *captions, scale = (text.get_text() for text in figure.texts)
    found = {key: float(value) for key, value in re.findall(r"(vectors|omega|f_c|T_c)\$? ([\d.]+) mm", scale)}
    units = found["vectors"] / 1e3
    scales = dict.fromkeys(("delta", "R", "R_m", "L", "c"), units)
    scales["omega"] = found.get("omega", 0.0) / 1e3
    scales |= {key: found.get(key, 0.0) / 1e6 for key in ("f_c", "T_c")}  # mm per kN is 1e-6 m per N
    drawn = [Drawn(ax, scales) for ax in figure.axes]
    return dict(zip((caption[5:] for caption in captions), drawn, strict=True))


@pytest.fixture(scope="module")
def mech():
    return pp.load(NAME)


@pytest.fixture(scope="module")
def state(mech):
    motion = pp.load_motion(NAME, mech).sample([4.8])
    found = mech.state(motion.coordinates, motion.rates, motion.second_rates, branch=motion.branch)
    return found.pose[0], found.twist[0], found.acceleration[0]


@pytest.fixture(scope="module")
def drawn(mech, state):
    return panels(plot_fig2(mech, *state, Figure(figsize=(10.2, 4.6))))


def normal(u, delta):
    n = np.cross(u, delta)
    return n / np.linalg.norm(n)


def test_panels_are_the_kinds_of_legs_and_the_rod(drawn):
    assert [*drawn] == ["RPU leg 1", "SPU leg 2", "rod L"]


@pytest.mark.parametrize(("caption", "i"), [("RPU leg 1", 0), ("SPU leg 2", 1)])
def test_points_vectors_and_mass_centres_of_a_leg(mech, state, drawn, caption, i):
    panel, leg, pose = drawn[caption], str(i + 1), state[0]
    o, b = pose[:3, 3], pose[:3, :3] @ mech.geometry["legs"][i]["platform"]["point"] + pose[:3, 3]
    below = np.array(mech.geometry["legs"][i]["base"]["point"])
    answer = mech.inverse_kinematics(pose)
    np.testing.assert_allclose(panel.tail[f"r {leg}"], below, atol=1e-12)
    np.testing.assert_allclose(panel.way[f"r {leg}"], answer.vectors[i], atol=1e-12)
    np.testing.assert_allclose(panel.tail[f"e {leg}"], o, atol=1e-12)
    np.testing.assert_allclose(panel.way[f"e {leg}"], b - o, atol=1e-12)
    np.testing.assert_allclose(panel.way[f"delta {leg}"], answer.directions[i], atol=1e-12)
    cylinder, piston = panel.mass_centres
    l_p = 0.100 if i == 0 else 0.098  # Table II
    np.testing.assert_allclose(cylinder, below + 0.050 * answer.directions[i], atol=1e-12)
    np.testing.assert_allclose(piston, b - l_p * answer.directions[i], atol=1e-12)
    greek = (rf"$\delta_{{{leg}}}$", rf"$\omega_{{r{leg}}}$", r"$\omega$", f"$n_{{{leg}}}$")
    names = {f"${letter}_{{{leg}}}$" for letter in "Bbrepq"} | {*greek[:3], "$o$", "$O$"}
    assert names <= panel.names


def test_axes_of_an_rpu_leg(state, drawn):
    """R_i1 along L and R_i2 = n of Eq. 22 below; R_m1 along l and R_m2 along R_i2 above (Section 2)."""
    way, pose = drawn["RPU leg 1"].way, state[0]
    np.testing.assert_allclose(way["R 1 1"], [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(way["R 1 2"], normal(way["R 1 1"], way["delta 1"]), atol=1e-12)
    np.testing.assert_allclose(way["R_m 1 1"], pose[:3, 0], atol=1e-12)
    np.testing.assert_allclose(way["R_m 1 2"], way["R 1 2"], atol=1e-12)
    assert "$R_{12} = n_{1}$" in drawn["RPU leg 1"].names


def test_axes_of_an_spu_leg(drawn):
    """Both at b: R_i1 from b to o, and R_i2 = n (Section 5.2)."""
    panel = drawn["SPU leg 2"]
    e = panel.way["e 2"]
    np.testing.assert_allclose(panel.way["R 2 1"], -e / np.linalg.norm(e), atol=1e-12)
    np.testing.assert_allclose(
        panel.way["R 2 2"], normal(panel.way["R 2 1"], panel.way["delta 2"]), atol=1e-12
    )
    np.testing.assert_allclose(panel.tail["R 2 1"], panel.tail["e 2"] + e, atol=1e-12)
    assert not any(name.startswith("R_m") for name in panel.way)


def test_angular_velocities(mech, state, drawn):
    """Those of the answers, and made of the drawn axes by Eq. 22 and Eq. 29."""
    motion = mech.kinematics(*state)
    first, second = drawn["RPU leg 1"], drawn["SPU leg 2"]
    for panel, i in ((first, 0), (second, 1)):
        np.testing.assert_allclose(panel.way[f"omega {i + 1}"], motion.leg_omega[i], atol=1e-12)
        np.testing.assert_allclose(panel.way["omega"], state[1][3:], atol=1e-12)
        assert {f"omega {i + 1}", "omega"} == panel.double
        assert panel.heads["omega"] == 2 > panel.heads["r " + str(i + 1)]
    axes = np.stack([first.way["R 1 1"], first.way["R 1 2"]])
    np.testing.assert_allclose(first.way["omega 1"], motion.base_joint_rates[0] @ axes, atol=1e-12)
    axes = np.stack([second.way["R 2 1"], second.way["R 2 2"]])
    total = second.way["omega 2"] + motion.platform_joint_rates[1] @ axes
    np.testing.assert_allclose(total, second.way["omega"], atol=1e-12)


def test_forces_at_the_rod(mech, state, drawn):
    """They are the constraint's wrench on the platform, and their moments about L cancel (Eq. 7, 44)."""
    panel, (pose, twist, acceleration) = drawn["rod L"], state
    way, o = panel.way, pose[:3, 3]
    f_c = mech.inverse_dynamics(pose, twist, acceleration).constraint[0]
    wrench = f_c * mech.jacobian(pose)[-1]
    forces = {leg: way[f"f_c {leg}"] for leg in "13"}
    moment = sum(np.cross(panel.tail[f"f_c {leg}"] - o, force) for leg, force in forces.items())
    np.testing.assert_allclose(sum(forces.values()), wrench[:3], atol=1e-8)
    np.testing.assert_allclose(moment, wrench[3:], atol=1e-8)
    for leg, force in forces.items():
        torque = np.cross(way[f"r {leg}"], -force) @ way["L"]  # the platform pushes back on leg and rod
        np.testing.assert_allclose(way[f"T_c {leg}"], torque * way["L"], atol=1e-8)
        np.testing.assert_allclose(np.cross(way[f"c {leg}"], force), 0.0, atol=1e-8)
        assert way[f"c {leg}"] @ way[f"r {leg}"] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(way["c 3"], -way["c 1"], atol=1e-12)
    np.testing.assert_allclose(way["L"], [1.0, 0.0, 0.0])
    b = {leg: panel.tail[f"c {leg}"] for leg in "13"}
    np.testing.assert_allclose(way["l"], b["1"] - b["3"], atol=1e-12)
    assert panel.double == {"T_c 1", "T_c 3"}
    assert {"$f_{c1}$", "$f_{c3}$", "$T_{c1}$", "$c_{1}$", "$c_{3}$", "$L$", "$l$"} < panel.names


def test_at_rest_nothing_turns_but_forces_are_there(mech, state):
    found = panels(plot_fig2(mech, state[0], figure=Figure(figsize=(10.2, 4.6))))
    assert not any(name.startswith("omega") for panel in found.values() for name in panel.way)
    assert {"f_c 1", "f_c 3"} < {*found["rod L"].way}


@pytest.mark.parametrize("name", [*pp.list_mechanisms(), *sorted(str(path) for path in DATA.glob("*.toml"))])
def test_any_mechanism_is_drawn(name, tmp_path):
    mech = pp.load(name)
    figure = plot_fig2(mech, mech.home, figure=Figure(figsize=(10.2, 4.9)))
    found = panels(figure)
    kinds = len({*mech.leg_letters})
    assert len(found) >= kinds
    assert len([caption for caption in found if " leg " in caption]) == kinds
    assert overlaps(figure) == []
    for caption, panel in found.items():
        for i, leg in enumerate(mech.leg_names):
            if caption.endswith(f"leg {leg}"):
                delta = next(way for key, way in panel.way.items() if key.startswith("delta"))
                np.testing.assert_allclose(
                    delta, mech.inverse_kinematics(mech.home).directions[i], atol=1e-12
                )


def test_the_leg_of_a_slider():
    """The carriage's mass centre is at the base joint, which it moves; the strut's midway (hexaglide)."""
    mech = pp.load("hexaglide")
    panel = panels(plot_fig2(mech, mech.home, figure=Figure(figsize=(5.0, 4.0))))["PUS leg 1"]
    carriage, strut = panel.mass_centres
    foot = panel.tail["r 1"]
    np.testing.assert_allclose(carriage, foot, atol=1e-12)
    np.testing.assert_allclose(strut, foot + panel.way["r 1"] / 2, atol=1e-12)
    assert "$Q_{1}$" in panel.names


def test_no_names_overlap(mech, state, tmp_path):
    figure = plot_fig2(mech, *state, Figure(figsize=(10.2, 4.6)))
    assert overlaps(figure) == []
    save_figure(figure, tmp_path / "fig2.svg")


def test_what_cannot_be_drawn_is_told(mech):
    with pytest.raises(ShapeError, match="pose"):
        plot_fig2(mech, np.eye(3), figure=Figure())
    turned = mech.home.copy()  # about z, so that l leaves the plane of L and r_1
    turned[:2, :2] = [[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]]
    with pytest.raises(PolypodError, match=r"no vectors to draw there; .*constraint"):
        plot_fig2(mech, turned, figure=Figure())
    with pytest.raises(ShapeError, match="twist"):
        plot_fig2(mech, mech.home, np.zeros(5), figure=Figure())
