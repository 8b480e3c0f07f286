"""Exported files, loaded by the tools that they are for."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from scipy.io import loadmat

import polypod as pp
from polypod.bodies.links import link_frames, links_of
from polypod.export import FORMATS, export
from polypod.export.model import LIGHT, THIN, Model
from polypod.export.names import Names, legal
from polypod.files.glb import Y_UP
from polypod.solution.solve import states_along
from support.exported import LU, mechanism, nasty, regular_pose

SINGLE = 1e-6
"""Of lengths of about a metre in single precision."""


# --- what all formats share ---------------------------------------------------------------------------------


def test_names_are_legal_unique_and_kept():
    names = Names()
    given = [
        names("link", name) for name in ("leg a/b", "leg a b", "leg a_b", "leg ü", "7", "", "world", "λ")
    ]
    assert given[:5] == ["leg_a_b", "leg_a_b_2", "leg_a_b_3", "leg_u", "x_7"]
    assert len({*given}) == len(given)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) for name in given)
    assert "world" not in given
    assert names("link", "leg a b") == "leg_a_b_2"
    assert names("joint", "leg a b") == "leg_a_b_4"
    assert names.changed("link")["leg_a_b_2"] == "leg a b"
    assert "leg_a_b" in names.changed("link")


def test_names_keep_their_longest():
    names = Names(longest=31)
    given = {names("field", "x" * 40 + end) for end in "abc"}
    assert {len(name) for name in given} == {31}
    assert len(given) == 3
    assert legal("__") == "x"


@pytest.mark.parametrize("name", ["mjcf", "sdf", "urdf"])
def test_what_is_left_out_is_said_and_written(name, tmp_path):
    tables = mechanism("3-rps").to_dict()
    tables["dynamics"] = {"efficiency": 0.9, "linear_damping": 3.0, "gravity": [0.0, 1.0, -2.0]}
    tables["units"] |= {"acceleration": "m/s^2", "force": "N", "torque": "N m"}
    tables["load"] = {"force": [1.0, 2.0, 3.0], "torque": [0.0, 0.0, 4.5]}
    tables["legs"][0]["force"] = {"min": -10.0, "max": 30.0}
    path = tmp_path / f"m{FORMATS[name].suffixes[0]}"
    found = export(pp.Mechanism.from_dict(tables), path, look="none")
    said = " ".join(found.notes)
    for words in (
        "efficiency 0.9",
        "3 N s/m",
        "[1, 2, 3] N",
        "[0, 0, 4.5] N m",
        "platform cone (legs 1, 2, 3)",
    ):
        assert words in said
    assert ("gravity is not in this file; it is [0, 1, -2]" in said) == (name != "mjcf")
    assert ("differ for push and pull" in said) == (name != "mjcf")
    text = path.read_text(encoding="utf-8")
    for note in found.notes:
        assert f"Note: {note}" in text
    if name == "urdf":
        assert all(f"# Note: {note}\n" in (tmp_path / "m.yaml").read_text() for note in found.notes)


def test_nothing_left_out_is_not_said(tmp_path):
    tables = pp.load("ups-hexapod").to_dict()
    for key in ("load", "dynamics", "limits"):
        tables.pop(key, None)
    for leg in tables["legs"]:
        for joint in (leg["base"], leg["platform"]):
            joint.pop("cone", None)
    mech = pp.Mechanism.from_dict(tables)
    assert export(mech, tmp_path / "m.xml", look="none").notes == ()


@pytest.mark.parametrize("name", ["mjcf", "sdf", "urdf"])
def test_nasty_names_make_sound_files(name, tmp_path):
    path = tmp_path / f"m{FORMATS[name].suffixes[0]}"
    mech = nasty()
    export(mech, path, look="simple")
    root = ElementTree.parse(path).getroot()
    named = [node.get("name") for node in root.iter() if node.get("name") and node.tag in ("body", "link")]
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", found) for found in named)
    assert len({*named}) == len(named)
    assert len(named) >= 11
    assert "leg_a_b_cylinder_3 is leg a b cylinder" in path.read_text(encoding="utf-8")


def test_light_masses_are_those_of_nothing_else():
    model = Model(mechanism("massless"))
    heaviest = model.mech.geometry["platform"]["mass"]
    assert (model.light[0], model.thin[0]) == (LIGHT * heaviest, THIN * heaviest)
    assert len(model.massless) == 12
    tables = model.mech.to_dict()
    tables.pop("platform")
    assert Model(pp.Mechanism.from_dict(tables)).light[0] == LIGHT


# --- STL and GLB --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [LU, "3-rps", "passive", "fpf"])
def test_stl_is_closed_and_has_the_volume(name, tmp_path):
    mech = mechanism(name)
    pose = regular_pose(mech)
    export(mech, tmp_path / "m.stl", pose=pose)
    mesh = trimesh.load(tmp_path / "m.stl")
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(
        sum(p.mesh.volume for l in links_of(mech) for p in l.pieces), rel=1e-4
    )
    frames = link_frames(mech, pose).frames
    points = np.concatenate(
        [
            trimesh.transform_points(piece.mesh.vertices, frame)
            for link, frame in zip(links_of(mech), frames, strict=True)
            for piece in link.pieces
        ]
    )
    assert np.allclose(mesh.bounds, [points.min(axis=0), points.max(axis=0)], atol=SINGLE)


def linear(color):
    """Light from a display's steps, from 0 to 1."""
    part = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("name", [LU, "rod-lined", "fpf", "passive"])
def test_glb_has_links_pieces_and_colours(name, tmp_path):
    mech = mechanism(name)
    pose = regular_pose(mech)
    export(mech, tmp_path / "m.glb", pose=pose)
    scene = trimesh.load(tmp_path / "m.glb", force="scene")
    frames = link_frames(mech, pose).frames
    for link, frame in zip(links_of(mech), frames, strict=True):
        placed, _ = scene.graph.get(link.name)
        assert np.allclose(placed, Y_UP @ frame, atol=SINGLE)
        for piece in link.pieces:
            placed, geometry = scene.graph.get(f"{link.name}/{piece.name}")
            assert np.allclose(placed, Y_UP @ frame, atol=SINGLE)
            mesh = scene.geometry[geometry]
            assert mesh.visual.material.baseColorFactor[:3] / 255.0 == pytest.approx(
                linear(piece.color), abs=0.5 / 255.0
            )
            mesh.merge_vertices(merge_norm=True, merge_tex=True)
            assert mesh.is_watertight, (link.name, piece.name)
            assert mesh.volume == pytest.approx(piece.mesh.volume, rel=1e-4)
    tree = scene.graph.transforms.parents
    assert tree["piston " + mech.leg_names[0]] == "cylinder " + mech.leg_names[0]
    assert tree["platform"] == tree["base"] == mech.name
    for leg in mech.geometry["legs"]:
        on = leg["base"]["rod"]
        assert tree[f"cylinder {leg['name']}"] == ("base" if on is None else f"rod {mech.rod_names[on]}")


def read_glb(path):
    """Tables and data of a GLB file."""
    data = path.read_bytes()
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON"
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def accessor(tables, data, index):
    entry = tables["accessors"][index]
    view = tables["bufferViews"][entry["bufferView"]]
    assert entry["componentType"] == 5126
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[entry["type"]]
    values = np.frombuffer(data, "<f4", entry["count"] * width, view["byteOffset"]).reshape(-1, width)
    assert np.array_equal(values.min(axis=0), np.float32(entry["min"]))
    assert np.array_equal(values.max(axis=0), np.float32(entry["max"]))
    return values.astype(float)


def turned(quaternion):
    """(3, 3) from x, y, z, w."""
    x, y, z, w = quaternion
    hat = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * hat + 2 * hat @ hat


def test_the_animation_moves_every_link(tmp_path):
    mech = pp.load(LU)
    motion = pp.load_motion(LU, mech)
    found = export(mech, tmp_path / "m.glb", motion=motion)
    assert "481 frames" in found.notes[0]
    tables, data = read_glb(tmp_path / "m.glb")
    (animation,) = tables["animations"]
    nodes = {node["name"]: i for i, node in enumerate(tables["nodes"])}
    parents = {child: i for i, node in enumerate(tables["nodes"]) for child in node.get("children", ())}
    moved = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        clock = accessor(tables, data, sampler["input"])[:, 0]
        key = (channel["target"]["node"], channel["target"]["path"])
        moved[key] = accessor(tables, data, sampler["output"])
        assert np.allclose(clock, np.linspace(0.0, 8.0, 481), atol=SINGLE)

    def place(node, k):
        """World matrix of a node at a frame."""
        entry, local = tables["nodes"][node], np.eye(4)
        if "matrix" in entry:
            assert not {(node, "translation"), (node, "rotation")} & moved.keys()
            local = np.reshape(entry["matrix"], (4, 4)).T
        else:
            path = [
                moved[node, key][k] if (node, key) in moved else entry.get(key)
                for key in ("translation", "rotation")
            ]
            local[:3, 3] = path[0] if path[0] is not None else 0.0
            local[:3, :3] = turned(path[1]) if path[1] is not None else np.eye(3)
        return local if node not in parents else place(parents[node], k) @ local

    even = motion.sample(np.linspace(0.0, 8.0, 481))
    frames = link_frames(mech, states_along(mech, even).pose).frames
    for k in (0, 100, 333, 480):
        for link, frame in zip(links_of(mech), frames[k], strict=True):
            assert np.allclose(place(nodes[link.name], k), Y_UP @ frame, atol=SINGLE)
    for (_, path), values in moved.items():
        if path == "rotation":  # the shorter way between frames, not through the other side
            assert np.sum(values[1:] * values[:-1], axis=1).min() > 0.99
    assert {nodes["base"]}.isdisjoint(node for node, _ in moved)


def test_poses_without_a_place_are_left_out(tmp_path):
    from polypod.export.gltf import glb

    mech = pp.load(LU)
    poses = np.stack([mech.home, np.full((4, 4), np.nan), regular_pose(mech)])
    data, notes = glb(mech, poses, np.array([0.0, 1.0, 2.0]))
    assert notes[0].startswith("1 instant")
    (tmp_path / "m.glb").write_bytes(data)
    tables, _ = read_glb(tmp_path / "m.glb")
    clock = tables["accessors"][tables["animations"][0]["samplers"][0]["input"]]
    assert (clock["count"], clock["max"]) == (2, [2.0])
    for refused in (poses[1], poses[1:2]):
        with pytest.raises(pp.ExportError, match="no pose"):
            glb(mech, refused)
    with pytest.raises(pp.ExportError, match="has no place at this pose"):
        export(mech, tmp_path / "m.stl", pose=poses[1])


# --- results ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def solution():
    mech = pp.load(LU)
    return pp.solve(mech, pp.load_motion(LU, mech).sample(np.linspace(0.0, 8.0, 7)), reactions=True)


def test_mat_has_the_same_numbers(solution, tmp_path):
    export(pp.load(LU), tmp_path / "m.mat", motion=solution)
    back = loadmat(tmp_path / "m.mat", squeeze_me=False, simplify_cells=False)
    about = back["polypod"][0, 0]
    for key in solution.dataset.variables:
        of, name = solution.dataset[key], str(key)
        assert re.fullmatch(r"[A-Za-z]\w{0,30}", name)
        told = {key: about[key][0, 0] for key in ("dimensions", "units", "descriptions", "labels")}
        assert [cell[0] for cell in told["dimensions"][name][:, 0]] == [str(dim) for dim in of.dims]
        assert "".join(told["units"][name]) == of.attrs.get("units", "")
        assert "".join(told["descriptions"][name]) == of.attrs.get("long_name", "")
        if of.dtype.kind == "U":
            assert [cell[0] for cell in told["labels"][name][:, 0]] == of.values.tolist()
        else:
            expected = of.values[:, None] if of.ndim == 1 else of.values
            assert back[name].dtype.kind == of.dtype.kind
            assert np.array_equal(back[name], expected, equal_nan=of.dtype.kind == "f")
    assert about["mechanism_file"][0] == solution.dataset.attrs["mechanism_file"]


def test_csv_and_netcdf_are_solutions(solution, tmp_path):
    for suffix in (".csv", ".nc"):
        path = tmp_path / f"m{suffix}"
        assert export(pp.load(LU), path, motion=solution).files == (path,)
        assert pp.load_solution(path) == solution
    motion = pp.load_motion(LU, pp.load(LU)).sample([0.0, 1.0])
    export(pp.load(LU), tmp_path / "n.nc", motion=motion)
    assert pp.load_solution(tmp_path / "n.nc") == pp.solve(pp.load(LU), motion)


# --- what cannot be ----------------------------------------------------------------------------------------


def test_what_a_format_cannot_hold_is_refused(solution, tmp_path):
    mech = pp.load(LU)
    motion = pp.load_motion(LU, mech)
    for name, message, arguments in (
        ("m.obj", r"no format's suffix: \.xml", {}),
        ("m.sdf", "sdf holds no motion", {"motion": motion}),
        ("m.mat", "none is given", {}),
        ("m.urdf", "no pose but home", {"pose": mech.home}),
        ("m.glb", "its own poses", {"pose": mech.home, "motion": motion}),
        ("m.glb", "needs a motion", {"motion": solution}),
        ("m.stl", r"needs \(4, 4\)", {"pose": mech.home[None]}),
    ):
        with pytest.raises(pp.ExportError, match=message):
            export(mech, tmp_path / name, **arguments)
    with pytest.raises(pp.UnknownNameError, match="did you mean"):
        export(mech, tmp_path / "m", "mjfc")
    with pytest.raises(pp.UnknownNameError, match="meshes, simple, none"):
        export(mech, tmp_path / "m.xml", look="pretty")
    assert list(tmp_path.iterdir()) == []


def test_help_comes_without_what_is_heavy():
    code = "import sys; from polypod.cli import app; print('trimesh' in sys.modules, 'scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


# --- command line -------------------------------------------------------------------------------------------


def test_command_writes_files_and_says_what_is_lost(run, tmp_path):
    code, out, err = run("export", LU, "-o", tmp_path / "lu.urdf")
    assert (code, err) == (0, "")
    assert "Note: Gravity is not in this file" in out
    assert f"Written: {tmp_path / 'lu.urdf'}" in out
    meshes = list((tmp_path / "lu_meshes").glob("*.stl"))
    assert f"{len(meshes)} files in {tmp_path / 'lu_meshes'}" in out
    assert str(tmp_path / "lu.yaml") in out
    code, out, _ = run("export", LU, "-o", tmp_path / "lu.bin", "--to", "mjcf", "--no-meshes", "--json")
    facts = json.loads(out)
    assert facts["files"] == [str(tmp_path / "lu.bin")]
    assert facts["format"] == "mjcf"
    assert any("load on the platform" in note for note in facts["notes"])
    at = [
        part
        for name, value in {
            "alpha": "6deg",
            "p": "-300mm",
            "h": "0.62",
            "beta": "0.7",
            "gamma": "0.6",
        }.items()
        for part in ("--at", f"{name}={value}")
    ]
    assert run("export", LU, "-o", tmp_path / "lu.stl", *at)[0] == 0
    assert run("export", LU, LU, "-o", tmp_path / "lu.mat")[0] == 0
    assert (tmp_path / "lu.stl").is_file()


def test_command_refuses(run, tmp_path):
    (tmp_path / "m.toml").write_text(pp.load(LU).to_toml())
    for arguments, message in (
        ((LU, "-o", tmp_path / "m.obj"), "no format's suffix"),
        ((LU, "-o", tmp_path / "none" / "m.xml"), "is no directory"),
        ((LU, LU, "-o", tmp_path / "m.sdf"), "holds no motion"),
        ((tmp_path / "m.toml", "--to", "sdf", "-o", tmp_path / "m.toml"), "is an input"),
        ((LU, "-o", tmp_path / "m.xml", "--bare", "--no-meshes"), "--bare"),
        (
            (
                LU,
                "-o",
                tmp_path / "m.stl",
                "--at",
                "x=0",
                "--at",
                "y=0.4",
                "--at",
                "z=0.7",
                "--at",
                "alpha=0",
                "--at",
                "beta=0.3",
            ),
            "--at:",
        ),
    ):
        code, _, err = run("export", *arguments)
        assert code == 2
        assert message in err
    assert [path.name for path in tmp_path.iterdir()] == ["m.toml"]
