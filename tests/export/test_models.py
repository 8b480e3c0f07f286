"""Exported models in MuJoCo, Pinocchio and libsdformat: masses, places, joints, closed loops, and rest."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

import polypod as pp
from polypod.bodies.links import links_of
from polypod.export import export
from polypod.export.mjcf import STEP, holding_forces
from polypod.export.model import Model
from polypod.export.shapes import body_name
from support.exported import LU, MECHANISMS, bodies, mechanism, nasty, nearby_poses, places, regular_pose

each = pytest.mark.parametrize("name", MECHANISMS)

ROUNDING = 1e-12
"""Of places, m, and of masses and inertias as a part of their greatest: sums of a few such numbers."""


def legal(mech):
    """Names in a file by those of the multibody description."""
    names = Model(mech).names
    return {name: names("link", name) for name in ("base", *bodies(mech))}


def assert_inertial(given, thin, mass, center, inertia):
    """A link has the mechanism's mass, centre and inertia, or a small mass at its origin."""
    if given is None:
        assert mass == pytest.approx(thin[0], rel=ROUNDING)
        assert np.allclose(center, 0.0)
        return
    assert mass == pytest.approx(given["mass"], rel=ROUNDING)
    assert np.allclose(center, given["center"], rtol=0.0, atol=ROUNDING)
    expected = np.array(given["inertia"])
    assert np.allclose(inertia, expected, rtol=0.0, atol=ROUNDING * np.abs(expected).max())


def assert_placed(mech, pose, found, atol=ROUNDING):
    """Links are where the core has them, but for rotations about their own line that it does not know."""
    expected, turn_known = places(mech, pose)
    for body, frame in found.items():
        assert np.allclose(frame[:3, 3], expected[body][:3, 3], rtol=0.0, atol=atol), body
        if turn_known[body]:
            assert np.allclose(frame, expected[body], rtol=0.0, atol=atol), body
        else:
            assert np.allclose(frame[:3, 1], expected[body][:3, 1], rtol=0.0, atol=atol), body


# --- MuJoCo -------------------------------------------------------------------------------------------------

SETTLED = 10.0
"""How far the platform may be from the pose of the keyframe. The loops are springs, which give way under the
weight; the platform moves by that over the smallest singular value, and rotations by that over the
characteristic length. Several loops add up."""
STILL = 1e-3
"""m/s and rad/s, of any joint in the end."""
LOOP, THIN_LOOP = 1e-6, 1e-5
"""m, that any loop gives way by; the second where links have no mass but the least that they need."""
HELD = 1e-3
"""Of the greatest active force: what the servo adds because the pose is not quite the same."""


def in_mujoco(mech, path, **options):
    """The model of an exported file, and its data."""
    mujoco = pytest.importorskip("mujoco")
    found = export(mech, path, **options)
    model = mujoco.MjModel.from_xml_path(str(path))
    return mujoco, model, mujoco.MjData(model), found


def frame_in_mujoco(data, body):
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = data.body(body).xmat.reshape(3, 3), data.body(body).xpos
    return frame


@each
def test_mujoco_has_masses_and_places(name, tmp_path):
    mech = mechanism(name)
    pose = nearby_poses(mech, 1)[0]
    mujoco, model, data, _ = in_mujoco(mech, tmp_path / "m.xml", look="simple", pose=pose)
    names, light, thin = legal(mech), Model(mech).light, Model(mech).thin
    for body, given in bodies(mech).items():
        at = model.body(names[body])
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, at.iquat)
        axes = axes.reshape(3, 3)
        assert_inertial(given, thin, at.mass[0], at.ipos, axes @ np.diag(at.inertia) @ axes.T)
    crosses = sum(joint["platform"]["joint"] == "U" for joint in mech.geometry["legs"])
    without = sum(given is None for given in bodies(mech).values())
    total = sum(given["mass"] for given in bodies(mech).values() if given)
    assert model.body_mass.sum() == pytest.approx(
        total + crosses * light[0] + without * thin[0], rel=ROUNDING
    )
    for key, at in (("home", mech.home), ("pose", pose)):
        mujoco.mj_resetDataKeyframe(model, data, model.key(key).id)
        mujoco.mj_forward(model, data)
        found = {body: frame_in_mujoco(data, names[body]) for body in bodies(mech)}
        assert_placed(mech, at, found)
        assert np.abs(data.efc_pos[: data.ne]).max() < ROUNDING
    # Not how the loops are made but what is left of the degrees of freedom: of the platform, and of what
    # spins.
    free = model.nv - np.linalg.matrix_rank(data.efc_J.reshape(-1, model.nv)[: data.ne], 1e-8)
    assert free == mech.dof + mech.mobility().passive
    assert model.opt.gravity == pytest.approx(mech.geometry["gravity"])


@pytest.mark.parametrize("name", ["rpr", "3-rps", "slider prs"])
def test_mujoco_has_limits_and_motors(name, tmp_path):
    tables = mechanism(name).to_dict()
    unit = {"deg": 1.0, "rad": np.pi / 180.0}[tables["units"].setdefault("angle", "deg")]
    tables["units"]["force"] = "N"
    tables["legs"][0]["force"] = {"min": -100.0, "max": 250.0}
    revolute = next(i for i, leg in enumerate(tables["legs"]) if leg["base"]["joint"] == "R")
    tables["legs"][revolute]["base"]["range"] = {"min": -20.0 * unit, "max": 30.0 * unit}
    mech = pp.Mechanism.from_dict(tables)
    _, model, _, _ = in_mujoco(mech, tmp_path / "m.xml", look="none")
    home = mech.inverse_kinematics(mech.home).lengths
    for leg, stroke, length in zip(mech.leg_names, mech.stroke, home, strict=True):
        joint = model.joint(f"leg_{leg}_slide")
        assert bool(joint.limited[0]) == bool(stroke[0] > 0.0 or np.isfinite(stroke).all())
        if joint.limited[0]:
            assert np.allclose(joint.range + length, stroke, rtol=0.0, atol=ROUNDING)
    turn = model.joint(f"leg_{mech.leg_names[revolute]}_base_joint_1")
    assert np.degrees(turn.range) == pytest.approx([-20.0, 30.0])
    assert model.actuator("leg_1").ctrlrange == pytest.approx([-100.0, 250.0])
    assert model.nu == mech.actuated.sum()


@pytest.mark.parametrize("name", [LU, "fpu"])
def test_mujoco_has_the_meshes_in_place(name, tmp_path):
    mech = mechanism(name)
    mujoco, model, data, _ = in_mujoco(mech, tmp_path / "m.xml")
    mujoco.mj_forward(model, data)
    frames, _ = places(mech, mech.home)
    for link in links_of(mech):
        body = body_name(mech, link)
        pieces = [trimesh.transform_points(piece.mesh.vertices, frames[body]) for piece in link.pieces]
        number = 0 if body == "base" else model.body(legal(mech)[body]).id
        seen = []
        for geom in np.flatnonzero(model.geom_bodyid == number):
            mesh = model.mesh(model.geom_dataid[geom])
            vertices = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]]
            seen.append(vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
        for end in (np.min, np.max):
            expected = end(np.concatenate(pieces), axis=0)
            assert np.allclose(end(np.concatenate(seen), axis=0), expected, rtol=0.0, atol=1e-6), body


@pytest.mark.parametrize("look", ["meshes", "simple"])
def test_mujoco_shows_links_without_weighing_them(look, tmp_path):
    mech = mechanism(LU)
    _, model, _, _ = in_mujoco(mech, tmp_path / "m.xml", look=look)
    seen = {model.body(body).name for body in model.geom_bodyid}
    assert seen == {"world" if name == "base" else name for name in legal(mech).values()}
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert model.body("platform").mass[0] == 3.0


@each
def test_mujoco_settles_at_the_same_pose(name, tmp_path):
    """Held by the forces of the inverse dynamics and, against drift, by a servo in each leg."""
    mech = mechanism(name)
    pose = regular_pose(mech)
    mujoco, model, data, _ = in_mujoco(mech, tmp_path / "m.xml", look="none", pose=pose)
    mujoco.mj_resetDataKeyframe(model, data, model.key("pose").id)
    mujoco.mj_forward(model, data)
    forces = data.ctrl.copy()
    assert np.allclose(forces, holding_forces(mech, pose)[mech.actuated])
    at = frame_in_mujoco(data, "platform")
    joints = [model.joint(model.actuator(i).trnid[0]) for i in range(model.nu)]
    slides, rates = (np.array([int(getattr(j, key)[0]) for j in joints]) for key in ("qposadr", "dofadr"))
    start, mass = data.qpos[slides].copy(), sum(given["mass"] for given in bodies(mech).values() if given)
    for _ in range(round(2.0 / STEP)):
        # Equilibria of constant forces need not be stable: a servo of 200 rad/s, critically damped.
        servo = 200.0**2 * (start - data.qpos[slides]) - 2.0 * 200.0 * data.qvel[rates]
        data.ctrl[:] = forces + mass / model.nu * servo
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    gap = np.abs(data.efc_pos[: data.ne]).max()
    assert gap < (THIN_LOOP if Model(mech).massless else LOOP)
    moved = np.abs(frame_in_mujoco(data, "platform") - at)
    room = SETTLED * gap / mech.conditioning(pose).sigma_min
    assert moved[:3, 3].max() < room
    assert moved[:3, :3].max() < room / mech.characteristic_length
    assert np.abs(data.qvel).max() < STILL
    if not Model(mech).massless:
        # The servo does next to nothing: the forces of the inverse dynamics hold the machine.
        assert np.abs(data.ctrl - forces).max() < HELD * np.abs(forces).max()


# --- Pinocchio ----------------------------------------------------------------------------------------------


class Tree:
    """An exported URDF in Pinocchio, with its side-car."""

    def __init__(self, mech, folder):
        self.pin = pytest.importorskip("pinocchio")
        self.found = export(mech, folder / "robot.urdf", look="none")
        self.model = self.pin.buildModelFromUrdf(str(folder / "robot.urdf"))
        self.data = self.model.createData()
        self.loops = yaml.safe_load((folder / "robot.yaml").read_text(encoding="utf-8"))
        self.q = self.pin.neutral(self.model)
        self.move(self.q)

    def move(self, q):
        self.q = q
        self.pin.computeJointJacobians(self.model, self.data, q)
        self.pin.updateFramePlacements(self.model, self.data)

    def frame(self, name):
        assert self.model.existFrame(name), name
        return self.model.getFrameId(name)

    def place(self, name):
        return np.array(self.data.oMf[self.frame(name)].homogeneous)

    def carries_platform(self, link):
        """Whether a link is one with the platform."""
        ends = (self.model.frames[self.frame(name)].parentJoint for name in (link, "platform"))
        return len({*ends}) == 1

    def closures(self):
        """Errors of the loops, m and rad, and their rates by the velocities."""
        errors, rows = [np.zeros(0)], [np.zeros((0, self.model.nv))]
        for names, kind in zip(self.loops["closed_loop"], self.loops["type"], strict=True):
            size = {"3d": 3, "6d": 6}[kind]
            a, b = (self.frame(name) for name in names)
            there = self.data.oMf[a].inverse() * self.data.oMf[b]
            turn = self.pin.log3(there.rotation) if size == 6 else np.zeros(0)
            errors.append(np.concatenate([there.translation, turn]))
            first, second = (
                self.pin.getFrameJacobian(self.model, self.data, f, self.pin.LOCAL) for f in (a, b)
            )
            first = there.toActionMatrixInverse() @ first
            back = np.kron(np.eye(2), there.rotation)
            rows.append((back @ (second - first))[:size])
        return np.concatenate(errors), np.concatenate(rows)


@each
def test_pinocchio_has_masses_and_places(name, tmp_path):
    mech = mechanism(name)
    tree, names = Tree(mech, tmp_path), legal(mech)
    pin, scale = tree.pin, mech.characteristic_length

    def small(mass):
        return pin.Inertia(mass, np.zeros(3), mass * scale**2 * np.eye(3))

    expected = {
        names[body]: small(Model(mech).thin[0])
        if given is None
        else pin.Inertia(given["mass"], np.array(given["center"]), np.array(given["inertia"]))
        for body, given in bodies(mech).items()
    }
    said = re.findall(r"(\d+) links of", " ".join(tree.found.notes))
    between = [
        f.name for f in tree.model.frames if re.search(r"_(part_\d|end)$", f.name) and f.type == pin.BODY
    ]
    carried = [f for f in between if f.endswith("_end") and tree.carries_platform(f)]
    between = sorted({*between} - {*carried})
    assert sum(map(int, said)) == len(between)
    expected |= dict.fromkeys(between, small(Model(mech).light[0]))
    # Pinocchio adds up what moves with a joint.
    found = [pin.Inertia.Zero() for _ in tree.model.inertias]
    for link, inertia in expected.items():
        frame = tree.model.frames[tree.frame(link)]
        found[frame.parentJoint] += frame.placement.act(inertia)
    for mine, theirs in list(zip(found, tree.model.inertias, strict=True))[1:]:
        assert theirs.mass == pytest.approx(mine.mass, rel=ROUNDING)
        assert np.allclose(theirs.lever, mine.lever, rtol=0.0, atol=ROUNDING)
        assert np.allclose(theirs.inertia, mine.inertia, rtol=0.0, atol=ROUNDING * np.abs(mine.inertia).max())
    moving = sum(inertia.mass for inertia in expected.values()) - found[0].mass
    assert pin.computeTotalMass(tree.model) == pytest.approx(moving, rel=ROUNDING)
    assert_placed(mech, mech.home, {body: tree.place(names[body]) for body in bodies(mech)})


@each
def test_sidecar_is_as_documented(name, tmp_path):
    """The form that the parallel-robot tools read: lists by key, names that exist, a type for each loop."""
    mech = mechanism(name)
    tree = Tree(mech, tmp_path)
    assert list(tree.loops) == ["closed_loop", "type", "name_mot"]
    assert len(tree.loops["closed_loop"]) == len(tree.loops["type"]) == mech.n_legs - 1
    flat = [frame for pair in tree.loops["closed_loop"] for frame in pair]
    assert len({*flat}) == len(flat) == 2 * (mech.n_legs - 1)
    assert all(len(pair) == 2 for pair in tree.loops["closed_loop"])
    joints = [tree.model.names[i] for i in range(1, tree.model.njoints)]
    expected = [f"leg_{leg}_slide" for leg, on in zip(mech.leg_names, mech.actuated, strict=True) if on]
    assert tree.loops["name_mot"] == expected
    assert {*expected} <= {*joints}
    errors, rows = tree.closures()
    assert np.abs(errors).max(initial=0.0) < ROUNDING
    free = tree.model.nv - (np.linalg.matrix_rank(rows, 1e-8) if len(rows) else 0)
    assert free == mech.dof + mech.mobility().passive


@each
def test_loops_close_at_other_poses_with_the_same_leg_lengths(name, tmp_path):
    mech = mechanism(name)
    tree, names = Tree(mech, tmp_path), legal(mech)
    slides = [tree.model.joints[tree.model.getJointId(f"leg_{leg}_slide")].idx_q for leg in mech.leg_names]
    home = mech.inverse_kinematics(mech.home).lengths
    platform = tree.frame("platform")
    for pose in nearby_poses(mech):
        q = tree.pin.neutral(tree.model)
        for _ in range(40):
            tree.move(q)
            errors, rows = tree.closures()
            away = tree.data.oMf[platform].inverse() * tree.pin.SE3(pose)
            move = tree.pin.getFrameJacobian(tree.model, tree.data, platform, tree.pin.LOCAL).reshape(6, -1)
            right = np.concatenate([-errors, tree.pin.log6(away).vector])
            step = np.linalg.lstsq(np.concatenate([rows, move]), right, rcond=1e-10)[0]
            q = tree.pin.integrate(tree.model, q, step * min(1.0, 0.5 / np.abs(step).max(initial=0.5)))
        assert np.abs(errors).max(initial=0.0) < ROUNDING
        assert_placed(mech, pose, {body: tree.place(names[body]) for body in bodies(mech)}, 1e-10)
        assert np.allclose(q[slides] + home, mech.inverse_kinematics(pose).lengths, rtol=0.0, atol=1e-10)


def test_pinocchio_shows_the_meshes(tmp_path):
    pin = pytest.importorskip("pinocchio")
    mech = mechanism(LU)
    found = export(mech, tmp_path / "robot.urdf")
    path = str(tmp_path / "robot.urdf")
    model = pin.buildModelFromUrdf(path)
    seen = pin.buildGeomFromUrdf(model, path, pin.GeometryType.VISUAL, package_dirs=[str(tmp_path)])
    assert seen.ngeoms == len(found.files) - 2
    at_home = {model.frames[entry.parentFrame].name for entry in seen.geometryObjects}
    assert at_home == {*legal(mech).values()}
    for link in links_of(mech):
        name = legal(mech)[body_name(mech, link)]
        files = [trimesh.load(file) for file in found.files if file.name.startswith(f"{name}_mesh_")]
        assert all(mesh.is_watertight for mesh in files)
        volume = sum(piece.mesh.volume for piece in link.pieces)
        assert sum(mesh.volume for mesh in files) == pytest.approx(volume, rel=1e-4)
        assert len({piece.color for piece in link.pieces}) == len(files)


def test_pinocchio_takes_nasty_names(tmp_path):
    tree = Tree(nasty(), tmp_path)
    assert len(tree.loops["name_mot"]) == 5
    assert all(tree.model.existJointName(name) for name in tree.loops["name_mot"])
    assert np.abs(tree.closures()[0]).max() < ROUNDING


# --- libsdformat --------------------------------------------------------------------------------------------

NEEDED = "libsdformat's checker needs a C++ compiler, pkg-config and, on Debian, the package libsdformat-dev"
TYPES = {"S": 1, "F": 3, "P": 5, "R": 6, "U": 9}
"""Numbers of the kinds of joints in libsdformat: ball, fixed, prismatic, revolute, universal."""


@pytest.fixture(scope="module")
def sdformat(tmp_path_factory, without_tool):
    """Loads a file with libsdformat: all that it found, or a failure with its messages."""
    missing = None
    if not (shutil.which("c++") and shutil.which("pkg-config")):
        missing = NEEDED
    else:
        modules = subprocess.run(
            ["pkg-config", "--list-all"], capture_output=True, text=True, check=True
        ).stdout
        versions = re.findall(r"^sdformat\d+", modules, re.MULTILINE)
        if not versions:
            missing = NEEDED
    if missing is not None:
        without_tool(missing)
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", versions[0]], capture_output=True, text=True, check=True
    ).stdout.split()
    program = tmp_path_factory.mktemp("sdformat") / "sdf_check"
    source = Path(__file__).parent / "sdf_check.cpp"
    subprocess.run(["c++", "-std=c++17", source, "-o", program, *flags], check=True)

    def load(path):
        done = subprocess.run([program, path], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""
        return json.loads(re.sub(r"\binf\b", "Infinity", done.stdout))

    return load


def frame_of(numbers):
    x, y, z, w = numbers[3:]
    hat = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = np.eye(3) + 2 * w * hat + 2 * hat @ hat, numbers[:3]
    return frame


@each
def test_sdformat_finds_links(name, sdformat, tmp_path):
    mech = mechanism(name)
    export(mech, tmp_path / "m.sdf", look="simple")
    found = sdformat(tmp_path / "m.sdf")
    names, thin = legal(mech), Model(mech).thin
    assert found["links"].keys() == {*names.values()}
    for body, given in bodies(mech).items():
        link = found["links"][names[body]]
        inertia = np.reshape(link["inertia"], (3, 3))
        assert_inertial(given, thin, link["mass"], link["inertial_pose"][:3], inertia)
        assert link["visuals"] > 0
    assert_placed(
        mech, mech.home, {body: frame_of(found["links"][names[body]]["pose"]) for body in bodies(mech)}
    )


@each
def test_sdformat_finds_joints(name, sdformat, tmp_path):
    mech = mechanism(name)
    export(mech, tmp_path / "m.sdf", look="none")
    joints, names = sdformat(tmp_path / "m.sdf")["joints"], legal(mech)
    home, spec = mech.inverse_kinematics(mech.home), mech.geometry
    assert len(joints) == 1 + len(mech.rod_names) + 3 * mech.n_legs
    assert joints["base_on_the_world"]["parent"] == "world"
    for i, leg in enumerate(spec["legs"]):
        base, slide, top = (
            joints[f"leg_{leg['name']}_{part}"] for part in ("base_joint", "slide", "platform_joint")
        )
        rod = leg["base"]["rod"]
        below = "base" if rod is None else names[f"rod {mech.rod_names[rod]}"]
        parts = ("cylinder", "piston") if leg["slider"] is None else ("carriage", "strut")
        first, second = (names[f"leg {leg['name']} {part}"] for part in parts)
        pairs = [(below, first), (first, second), (second, "platform")]
        if leg["slider"] is not None:
            pairs[:2] = [(first, second), ("base", first)]
        assert [(j["parent"], j["child"]) for j in (base, slide, top)] == pairs
        kinds = (leg["base"]["joint"], "P", leg["platform"]["joint"])
        assert [joint["type"] for joint in (base, slide, top)] == [TYPES[kind] for kind in kinds]
        B, way = np.array(leg["base"]["point"]), home.directions[i]
        at = B + home.vectors[i]
        if leg["slider"] is not None:
            way = np.array(leg["slider"]["axis"]) / np.linalg.norm(leg["slider"]["axis"])
            B = at = B + home.lengths[i] * way
        for joint, point in ((base, B), (slide, at), (top, B + home.vectors[i])):
            assert np.allclose(joint["pose"][:3], point, rtol=0.0, atol=1e-9)
        (along,) = slide["axes"]
        assert np.allclose(along["xyz"], way, rtol=0.0, atol=1e-9)
        assert (along["effort"] == 0.0) == (not leg["actuated"])
        if np.isfinite(mech.stroke[i]).all():
            ends = np.array([along["lower"], along["upper"]]) + home.lengths[i]
            assert np.allclose(ends, mech.stroke[i], rtol=0.0, atol=ROUNDING)
        for joint, given, turn, which in (
            (base, leg["base"], np.eye(3), 0),
            (top, leg["platform"], mech.home[:3, :3], -1),
        ):
            if given["axis"] is not None and given["joint"] in "RU":
                axis = turn @ np.array(given["axis"]) / np.linalg.norm(given["axis"])
                assert abs(np.dot(joint["axes"][which]["xyz"], axis)) == pytest.approx(1.0, abs=ROUNDING)
            if given["joint"] == "U":
                first, second = (np.array(a["xyz"]) for a in joint["axes"])
                assert abs(first @ second) < 1e-9
                n = second if which == 0 else first
                assert abs(n @ home.directions[i]) < 1e-9


def test_sdformat_refuses_what_is_wrong(sdformat, tmp_path):
    export(mechanism("3-rps"), tmp_path / "m.sdf", look="none")
    text = (tmp_path / "m.sdf").read_text(encoding="utf-8")
    for right, wrong in (
        ("<child>platform</child>", "<child>none</child>"),
        ("leg_2_piston", "leg_1_piston"),
    ):
        (tmp_path / "wrong.sdf").write_text(text.replace(right, wrong), encoding="utf-8")
        with pytest.raises(AssertionError):
            sdformat(tmp_path / "wrong.sdf")


def test_sdformat_takes_nasty_names(sdformat, tmp_path):
    export(nasty(), tmp_path / "m.sdf")
    assert len(sdformat(tmp_path / "m.sdf")["links"]) == 13
