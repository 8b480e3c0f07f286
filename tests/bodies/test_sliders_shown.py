"""Rails, carriages and struts as they are drawn, and the words for them."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod.answers import leg_words
from polypod.bodies.links import link_frames, links_of
from polypod.legs.drives import drive_of_letters
from polypod.plots import fig4_panels
from polypod.plots.scene import Scene
from polypod.plots.topology import _topology_places
from polypod.report.data import data_tables
from polypod.report.words import actuators_table
from polypod.summary.mechanism_facts import describe
from polypod.summary.solution_facts import summarise
from polypod.summary.tables import legs_table, motion_table
from support import sliders
from support.sliders import states

BUILT_IN = ("hexaglide", "linapod", "3-prs", "3-puu", "4pss-upu")


@pytest.fixture(params=[*sliders.LEGS, *BUILT_IN])
def mech(request):
    return pp.load(request.param) if request.param in BUILT_IN else sliders.mechanism(request.param)


def test_links_are_closed_surfaces_with_names_of_the_graph(mech):
    links = links_of(mech)
    for link in links:
        for part in link.pieces:
            assert part.mesh.is_watertight, (link.name, part.name)
            assert part.mesh.is_winding_consistent, (link.name, part.name)
            assert part.mesh.area_faces.min() > 0.0, (link.name, part.name)
    assert {link.name for link in mech.mobility().graph_links} == {link.name for link in links}


def test_rails_reach_from_end_to_end_of_the_stroke(mech):
    base = {part.name: part.mesh for part in links_of(mech)[0].pieces}
    for leg, stroke in zip(mech.geometry["legs"], mech.stroke, strict=True):
        if leg["slider"] is None:
            assert f"rail {leg['name']}" not in base
            continue
        axis = np.array(leg["slider"]["axis"]) / np.linalg.norm(leg["slider"]["axis"])
        along = (base[f"rail {leg['name']}"].vertices - leg["base"]["point"]) @ axis
        home = float(mech.inverse_kinematics(mech.home).lengths[mech.leg_names.index(leg["name"])])
        low, high = stroke if np.isfinite(stroke).all() else (home, home)
        assert along.min() < low <= high < along.max()


@pytest.mark.parametrize("name", sliders.LEGS)
def test_frames_are_at_the_foot(name):
    """The carriage does not rotate; the strut goes from it to its joint on the platform."""
    mech, poses = sliders.mechanism(name), states(name)[0]
    names, found = [link.name for link in links_of(mech)], link_frames(mech, poses)
    legs = mech.inverse_kinematics(poses)
    for i in np.flatnonzero(mech.moves_feet):
        leg = mech.geometry["legs"][i]
        carriage, strut = (
            found.frames[:, names.index(f"{part} {leg['name']}")] for part in ("carriage", "strut")
        )
        np.testing.assert_allclose(carriage[:, :3, :3], np.broadcast_to(np.eye(3), (len(poses), 3, 3)))
        axis = np.array(leg["slider"]["axis"]) / np.linalg.norm(leg["slider"]["axis"])
        foot = leg["base"]["point"] + legs.lengths[:, i, None] * axis
        np.testing.assert_allclose(carriage[:, :3, 3], foot, atol=1e-12)
        np.testing.assert_array_equal(strut[:, :3, 3], carriage[:, :3, 3])
        end = poses[:, :3, :3] @ leg["platform"]["point"] + poses[:, :3, 3]
        tip = strut[:, :3, :3] @ [0.0, leg["slider"]["strut"], 0.0] + strut[:, :3, 3]
        np.testing.assert_allclose(tip, end, atol=1e-12)
        np.testing.assert_allclose(np.linalg.det(strut[:, :3, :3]), 1.0)
        for side, turn in (("base", np.eye(3)), ("platform", poses[:, :3, :3])):
            axis = leg[side]["axis"]
            if leg[side]["joint"] == "U":
                np.testing.assert_allclose(np.sum(strut[:, :3, 0] * (turn @ axis), -1), 0.0, atol=1e-9)
            elif leg[side]["joint"] == "R":
                np.testing.assert_allclose(np.abs(strut[:, :3, 0] @ axis), 1.0)
        # Joints are drawn where they are: the strut has balls or pins at its ends only.
        pieces = {part.name: part.mesh for part in links_of(mech)[names.index(f"strut {leg['name']}")].pieces}
        assert pieces["neck 1"].bounds[0, 1] == pytest.approx(0.0, abs=1e-12)
        assert pieces["neck 2"].bounds[1, 1] == pytest.approx(leg["slider"]["strut"])


def test_carriages_are_drawn_on_their_rails(mech):
    """In the middle of their blocks, and no face of a rail is left in these."""
    links, frames = links_of(mech), link_frames(mech, mech.home).frames
    whole = sum(len(part.mesh.faces) for link in links for part in link.pieces)
    assert 0 < len(Scene(mech, mech.home).faces.corners()) < whole
    base = {part.name: part.mesh for part in links[0].pieces}
    for link, frame in zip(links, frames, strict=True):
        if link.kind == "carriage":
            shoe = link.pieces[0].mesh.vertices + frame[:3, 3]
            rail = base[f"rail {link.name.removeprefix('carriage ')}"].vertices
            axis = mech.geometry["legs"][link.index]["slider"]["axis"]
            off = np.cross(shoe.mean(axis=0) - rail.mean(axis=0), axis / np.linalg.norm(axis))
            assert np.linalg.norm(off) < 1e-9


def test_the_topology_has_a_column_for_each_leg(mech):
    mobility = mech.mobility()
    place, order = _topology_places(mobility)
    assert sorted(order) == list(range(mech.n_legs))
    assert len(set(place.values())) == mobility.links
    for joint in mobility.graph_joints:
        low, high = sorted(place[link][1] for link in joint.links)
        assert high - low > 0.5


# --- words --------------------------------------------------------------------------------------------------


def test_words():
    assert leg_words.word(map(drive_of_letters, ["UPS", "SPS"])) == "length"
    assert leg_words.word(map(drive_of_letters, ["PUS"])) == "place"
    assert leg_words.words(map(drive_of_letters, ["PUS", "UPU"])) == "lengths and places"


def test_tables_say_place():
    mech = sliders.mechanism("prs")
    legs = legs_table(describe(mech))
    assert legs.headers[3] == "place at home / mm>"
    assert [row[4] for row in legs.rows] == ["-50.0 to 500.0"] * 3
    assert legs_table(describe(sliders.mechanism("mixed"))).headers[3] == "length or place at home / mm>"
    assert legs_table(describe(pp.load("3-rps"))).headers[3] == "length at home / mm>"
    bodies = next(table for table in data_tables(mech) if table.title.startswith("Links"))
    assert [row[0] for row in bodies.rows[1:3]] == ["carriage 1", "strut 1"]
    rails = next(table for table in data_tables(mech) if table.title.startswith("Rails"))
    assert [row[2:] for row in rails.rows] == [("500.00", "+1")] * 3
    assert "rail" in actuators_table([], mech).note
    assert "rail" not in actuators_table([], pp.load("3-rps")).note


def test_a_stroke_that_begins_at_the_point_of_the_rail_is_a_limit():
    """A length of zero is none, a place is one as any other."""
    mech = pp.load("3-puu")
    assert describe(mech)["legs"][0]["stroke"] == [0.0, 0.45]
    free = sliders.tables("puu")
    assert describe(pp.Mechanism.from_dict(free))["legs"][0]["stroke"] == [None, None]


def test_curves_say_place():
    mech = sliders.mechanism("prs")
    time = np.linspace(0.0, 1.0, 5)
    q = {"z": 0.65 + 0.05 * time, "rx": 0.1 * time, "ry": 0 * time}
    solution = pp.solve(mech, pp.Motion.through(time, q, set="pose"))
    labels = [panel.label for panel in fig4_panels(solution.dataset)]
    assert "place $q$" in labels
    assert "leg length $r$" not in labels
    assert motion_table(summarise(mech, solution)).headers[1] == "place / mm>"


def test_the_page_moves_carriages():
    pytest.importorskip("viser")
    from polypod.viewer.model import Model

    mech = pp.load("hexaglide")
    model = Model(mech)
    low, high = model.length_range(0)
    assert low < -1.0 < 1.0 < high
    before = model.view()
    assert model.set_length(0, float(before.lengths[0]) - 0.02)
    view = model.view()
    assert view.lengths[0] == pytest.approx(before.lengths[0] - 0.02)
    np.testing.assert_allclose(view.joints[0] - before.joints[0], [-0.02, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(view.directions[0], [1.0, 0.0, 0.0])
    assert not model.set_length(0, 5.0)
    assert "The place of leg 1 cannot be" in model.refusal
    assert "Leg 7 is passive: its place" in refusal_of_a_passive_leg()


def refusal_of_a_passive_leg():
    from polypod.viewer.model import Model

    model = Model(sliders.mechanism("mixed"))
    model.set_length(6, 0.7)
    return model.refusal


def test_the_workspace_of_a_slider_is_bounded_by_its_rail():
    from polypod.workspaces.search_region import position_bounds

    mech = pp.load("3-prs")
    box = position_bounds(mech)
    assert np.isfinite(box).all()
    leg = mech.geometry["legs"][0]
    assert box[2, 1] == pytest.approx(0.4 + leg["slider"]["strut"] + 0.18)
    box = position_bounds(pp.load("hexaglide"))
    assert np.isfinite(box).all()
    # The rails lie in a plane, and home is above it.
    assert box[2, 0] == 0.0
    found = pp.workspace(pp.load("hexaglide"), step=0.15)
    assert found.volume > 0.0
    inside = found.vertices
    assert np.all((inside > box[:, 0] - 0.15) & (inside < box[:, 1] + 0.15))


def test_a_lattice_of_lengths_is_of_telescopic_legs():
    with pytest.raises(pp.UnsupportedError, match="legs 1, 2, 3 are sliders"):
        pp.length_lattice(pp.load("3-prs"), step=0.04)


def test_datasets_say_what_they_hold():
    """In whatever file they go: places, struts and carriages."""
    for name, said in (("prs", "place of the carriage"), ("mixed", "leg length, or place of the carriage")):
        mech = sliders.mechanism(name)
        assert mech.inverse_kinematics(mech.home).to_xarray().lengths.attrs["long_name"] == said
    mech = sliders.mechanism("prs")
    time = np.linspace(0.0, 1.0, 3)
    motion = pp.Motion.through(time, {"z": 0.65 + 0 * time, "rx": 0 * time, "ry": 0 * time}, set="pose")
    data = pp.solve(mech, motion).dataset
    assert data.length.attrs["symbol"] == "q"
    assert data.piston_velocity.attrs["long_name"] == "velocity of the strut's mass centre"
    assert data.force.attrs["long_name"] == "active force along the rail"
    hexapod = pp.load("ups-hexapod")
    assert hexapod.inverse_kinematics(hexapod.home).to_xarray().lengths.attrs["long_name"] == "leg length"
