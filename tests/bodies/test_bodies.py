"""The links as solids, and where they are."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh

import polypod as pp
from polypod.bodies import solids
from polypod.bodies.links import link_frames, links_of
from support import DATA

NAME = "lu-3spu-2rpu-r"
FILES = [NAME, *sorted(str(path) for path in DATA.glob("*.toml"))]


@pytest.fixture(params=FILES, ids=lambda file: Path(file).stem)
def mech(request):
    return pp.load(request.param)


def piece(link, name):
    return next(piece.mesh for piece in link.pieces if piece.name == name)


def some_poses(mech):
    """Home and poses near it on the constraints, by forward kinematics."""
    home = mech.inverse_kinematics(mech.home).lengths
    rng = np.random.default_rng(7)
    lengths = home * (1.0 + 0.02 * rng.uniform(-1.0, 1.0, (6, mech.n_legs)))
    poses = mech.forward_kinematics(lengths, mech.home).pose
    return np.concatenate([mech.home[None], poses[np.isfinite(poses).all(axis=(1, 2))]])


def test_every_piece_and_every_link_is_a_closed_surface(mech):
    for link in links_of(mech):
        for part in link.pieces:
            assert part.mesh.is_watertight, (link.name, part.name)
            assert part.mesh.is_winding_consistent, (link.name, part.name)
            assert part.mesh.volume > 0.0, (link.name, part.name)
            # A doubled corner would make slivers of no area.
            assert part.mesh.area_faces.min() > 0.0, (link.name, part.name)
        mesh = link.mesh()
        assert mesh.is_watertight
        assert mesh.visual.kind == "face"
        text = mesh.export(file_type="stl")  # merges equal corners when it is read
        assert trimesh.load(io.BytesIO(text), file_type="stl").is_watertight, link.name


def test_names_and_order(mech):
    links, legs = links_of(mech), mech.leg_names
    names = ["base", *(f"rod {name}" for name in mech.rod_names)]
    names += [f"{part} {name}" for name in legs for part in ("cylinder", "piston")]
    assert [link.name for link in links] == [*names, "platform"]
    graph = {link.name for link in mech.mobility().graph_links}
    assert graph <= {link.name for link in links}


def test_joints_look_like_what_they_are(mech):
    links = {link.name: {part.name.split()[0] for part in link.pieces} for link in links_of(mech)}
    for leg, name in zip(mech.geometry["legs"], mech.leg_names, strict=True):
        for side, link in (("base", f"cylinder {name}"), ("platform", f"piston {name}")):
            on_leg = {"S": {"ball"}, "U": {"pin"}, "R": {"pin"}, "F": set()}[leg[side]["joint"]]
            assert links[link] & {"ball", "pin", "block"} == on_leg


def test_a_fixed_joint_is_a_block_and_a_universal_one_has_a_pin_on_its_body(tricept):
    mech = tricept()
    base, *_, platform = links_of(mech)
    assert [part.name for part in base.pieces if part.name.startswith("pin")] == [
        f"pin {name}" for name in mech.leg_names
    ]
    assert [part.name for part in platform.pieces if part.name.startswith("block")] == ["block post"]


def test_the_piston_slides_in_its_cylinder_over_the_stroke(mech):
    links = {link.name: link for link in links_of(mech)}
    for name, (shortest, longest) in zip(mech.leg_names, mech.stroke, strict=True):
        barrel = piece(links[f"cylinder {name}"], "barrel").bounds
        shaft = piece(links[f"piston {name}"], "shaft").bounds
        for length in (shortest, longest):
            foot = length + shaft[0, 1]
            assert barrel[0, 1] < foot < barrel[1, 1]
            assert length + shaft[1, 1] > barrel[1, 1]
        assert shaft[1, 0] < barrel[1, 0]
        assert 0.8 * shortest <= barrel[1, 1] <= 0.9 * shortest


def test_frames_are_those_of_the_legs(mech):
    poses = some_poses(mech)
    assert len(poses) > 1
    found = link_frames(mech, poses)
    legs = mech.inverse_kinematics(poses)
    names = [link.name for link in links_of(mech)]
    assert found.frames.shape == (len(poses), len(names), 4, 4)
    assert found.turn_known.all()
    np.testing.assert_allclose(
        found.frames[..., :3, :3] @ np.swapaxes(found.frames[..., :3, :3], -1, -2),
        np.broadcast_to(np.eye(3), (*found.frames.shape[:2], 3, 3)),
        atol=1e-12,
    )
    assert (np.linalg.det(found.frames[..., :3, :3]) > 0.0).all()
    np.testing.assert_array_equal(found.frames[:, -1], poses)
    np.testing.assert_array_equal(found.frames[:, 0], np.broadcast_to(np.eye(4), (len(poses), 4, 4)))
    for i, (name, leg) in enumerate(zip(mech.leg_names, mech.geometry["legs"], strict=True)):
        cylinder = found.frames[:, names.index(f"cylinder {name}")]
        piston = found.frames[:, names.index(f"piston {name}")]
        np.testing.assert_allclose(cylinder[:, :3, 1], legs.directions[:, i], atol=1e-12)
        np.testing.assert_array_equal(cylinder[:, :3, :3], piston[:, :3, :3])
        np.testing.assert_allclose(cylinder[:, :3, 3], np.tile(leg["base"]["point"], (len(poses), 1)))
        np.testing.assert_allclose(piston[:, :3, 3] - cylinder[:, :3, 3], legs.vectors[:, i], atol=1e-12)
        # n is perpendicular to the axis that a universal joint has in its body.
        for side, body in (("base", np.eye(4)), ("platform", poses)):
            if leg[side]["joint"] == "U":
                axis = body[..., :3, :3] @ leg[side]["axis"]
                np.testing.assert_allclose(np.sum(cylinder[:, :3, 0] * axis, axis=-1), 0.0, atol=1e-9)
    for i, rod in enumerate(mech.geometry["rods"]):
        frame = found.frames[:, 1 + i]
        np.testing.assert_allclose(frame[:, :3, 0], np.tile(rod["axis"], (len(poses), 1)), atol=1e-12)


def test_what_has_no_place_has_no_numbers():
    """Poses that are none, break a constraint, or leave a leg without length."""
    mech = pp.load(NAME)
    turned, lost = mech.home.copy(), np.full((4, 4), np.nan)
    turned[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    found = link_frames(mech, np.stack([mech.home, lost, turned]))
    assert [pp.Status(code).name for code in found.status] == ["OK", "INVALID_INPUT", "OFF_CONSTRAINT"]
    assert np.isfinite(found.frames[0]).all()
    assert found.turn_known[0].all()
    assert np.isnan(found.frames[1:, 2:-1]).all()
    assert not found.turn_known[1:, 2:-1].any()
    hexapod = pp.load(DATA / "stewart-gough.toml")
    leg, pose = hexapod.geometry["legs"][0], np.eye(4)
    pose[:3, 3] = np.subtract(leg["base"]["point"], leg["platform"]["point"])
    found = link_frames(hexapod, pose)
    assert pp.Status(int(found.status)) is pp.Status.SINGULAR
    assert np.isnan(found.frames[1:3]).all()


def test_a_leg_whose_turn_the_core_does_not_tell_stands_somehow():
    """Similar base and platform: balance determines nothing anywhere, but legs have their lines."""
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    for i, leg in enumerate(data["legs"]):
        leg["base"]["point"] = {"radius": 500, "angle": 60 * i}
        leg["base"]["axis"] = {"angle": 60 * i + 90}
        leg["platform"]["point"] = {"radius": 200, "angle": 60 * i}
    mech = pp.Mechanism.from_dict(data)
    found = link_frames(mech, mech.home)
    assert found.turn_known.tolist() == [True] + [False] * 12 + [True]
    rotations = found.frames[:, :3, :3]
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0)
    legs = mech.inverse_kinematics(mech.home)
    np.testing.assert_allclose(rotations[1:-1:2, :, 1], legs.directions)
    np.testing.assert_allclose(found.frames[2:-1:2, :3, 3] - found.frames[1:-1:2, :3, 3], legs.vectors)


@pytest.mark.parametrize("normal", [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
def test_plates_reach_as_far_as_their_margin(normal):
    """Round one joint and round joints on a line."""
    normal = np.array(normal)
    side = np.cross(normal, [0.0, 1.0, 0.0])
    for spots in ([0.0], [0.0, 1.0], [0.0, 1.0, 3.0]):
        points = np.array([spot * side for spot in spots])
        corners = solids.plate(points, normal, thickness=0.1, margin=0.5).vertices
        nearest = np.clip(corners @ side, 0.0, max(spots))[:, None] * side
        distance = np.linalg.norm(corners - nearest, axis=-1)
        assert distance.max() < np.hypot(0.5, 0.1) + 1e-9
        assert (corners @ side).max() == pytest.approx(max(spots) + 0.5, abs=2e-3)
        assert np.ptp(corners @ normal) == pytest.approx(0.1)


def test_volumes_of_simple_bodies():
    polygon = solids.SIDES / (2.0 * np.pi) * np.sin(2.0 * np.pi / solids.SIDES)  # by the circle's area
    bar = solids.tube((1.0, 0.0, 0.0), (1.0, 2.0, 2.0), 0.1)
    assert bar.volume == pytest.approx(polygon * np.pi * 0.01 * np.sqrt(8.0))
    cone = solids.tube((0.0, 0.0, 0.0), (0.0, 0.0, 3.0), 0.1, end_radius=0.0)
    assert cone.volume == pytest.approx(polygon * np.pi * 0.01)
    assert solids.block((1.0, 2.0, 3.0), (0.0, 0.0, 5.0), 0.2).volume == pytest.approx(0.008)
    assert 0.95 < solids.ball((1.0, 2.0, 3.0), 0.5).volume / (4.0 / 3.0 * np.pi * 0.125) < 1.0
    ring = solids.lathe([(0.9, 0.0), (1.0, 0.0), (1.0, 0.5), (0.9, 0.5)], closed=True)
    assert ring.is_watertight
    assert ring.volume == pytest.approx(polygon * np.pi * 0.19 * 0.5)


def test_halves_of_four_sided_faces_are_drawn_as_one():
    bar = solids.tube((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.2)
    corners, normals = solids.four_sided(bar)
    pieces = -(-len(bar.faces) // solids.SIDES) - 2  # halves along the bar, next to one fan at each end
    assert len(corners) == solids.SIDES * (2 + pieces // 2)
    flat = np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=-1) / 2
    assert flat.sum() == pytest.approx(bar.area)
    np.testing.assert_allclose(np.sum(normals * (corners[:, 1] - corners[:, 0]), axis=-1), 0.0, atol=1e-12)
