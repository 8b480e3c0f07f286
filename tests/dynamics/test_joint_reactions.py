"""Joint reactions against the balance of every single link, with motions from the oracle.

The links' accelerations, frames and joint axes are the oracle's: rates of positions, nothing of the product.
The system of all balances is written here once more, with all components of all reactions as unknowns.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from support import DATA
from support import oracle as o
from support.cases import ALL, FORCES, SEED, Case, agree, any_case, case, per_pose
from support.reactions import CLOSED, REDUNDANT, SAME, named, reactions, scale_of

REST = np.zeros(6)

each = pytest.mark.parametrize("name", ALL)


# ------------------------------------------------------------------------------------------------------------
# Joints and links once more
# ------------------------------------------------------------------------------------------------------------


@dataclass
class Joint:
    """Names of two links; point, axes of free turns and of a free slide (N, 3) in base axes."""

    inner: str
    outer: str
    point: np.ndarray
    turns: list
    slides: list


def joints_of(c: Case) -> list[Joint]:
    n = len(c.twist)
    spread = functools.partial(np.broadcast_to, shape=(n, 3))
    rods = [
        Joint("base", f"rod {rod['name']}", spread(rod["point"]), [spread(rod["axis"])], [])
        for rod in c.spec["rods"]
    ]
    joints = []
    for leg, at in zip(c.spec["legs"], c.legs, strict=True):
        base, platform = leg["base"], leg["platform"]
        rod = None if base["rod"] is None else f"rod {c.spec['rods'][base['rod']]['name']}"
        cylinder, piston = f"cylinder {leg['name']}", f"piston {leg['name']}"
        below = (
            np.eye(3)
            if base["joint"] == "S"
            else [at.n.x]
            if rod
            else {"U": [at.base_axis, at.n.x]}.get(
                base["joint"], [at.base_axis] if base["joint"] == "R" else []
            )
        )
        above = {"S": np.eye(3), "F": []}.get(platform["joint"])
        if above is None:
            axis = at.platform_axis.x
            above = [axis, at.n.x] if platform["joint"] == "U" else [axis]
        end = at.b.x
        joints += [
            Joint(rod or "base", cylinder, spread(base["point"]), [spread(a) for a in below], []),
            Joint(cylinder, piston, end, [], [] if leg["actuated"] else [at.delta.x]),
            Joint(piston, "platform", end, [spread(a) for a in above], []),
        ]
    return rods + joints


def given_wrenches(c: Case, wrench=None, axes="base") -> dict:
    """Weight, inertia and load (N, 6) of every link with its point (N, 3), that of the platform over η."""
    moving, n = c.jets, len(c.twist)
    spec = c.spec
    of = {}

    def put(name, body, frame, center):
        if body is None:
            of[name] = np.zeros((n, 6)), np.zeros((n, 3))
            return
        force, torque = o.link_wrench(o.Link(name, body, center, frame), spec["gravity"])
        of[name] = np.concatenate([force, torque], axis=-1), center.x

    R, pos = (o.jet(x) for x in moving)
    for k, rod in enumerate(spec["rods"]):
        frame = o.rod_frame(spec, k, c.legs)
        body = rod["body"]
        put(f"rod {rod['name']}", body, frame, body and o.apply(frame, body["center"]) + rod["point"])
    for leg, at in zip(spec["legs"], c.legs, strict=True):
        for part, point in (("cylinder", leg["base"]["point"]), ("piston", at.b)):
            body = leg[part]
            center = body and o.apply(at.frame, body["center"]) + point
            put(f"{part} {leg['name']}", body, at.frame, center)
    body = spec["platform"] or {"mass": 0.0, "center": np.zeros(3), "inertia": np.zeros((3, 3))}
    put("platform", body, R, o.apply(R, body["center"]) + pos)
    load = o.load_at(spec, c.pose, wrench, axes) - np.concatenate(
        [spec["linear_damping"] * c.twist[:, :3], spec["angular_damping"] * c.twist[:, 3:]], axis=-1
    )
    own, center = of["platform"]
    load[:, 3:] += np.cross(pos.x - center, load[:, :3])
    of["platform"] = (own + load) / spec["efficiency"], center
    return of


def left_over(c: Case, joints, found, given):
    """Residual of the balance of each link, (links, N, 6), forces and torques about its mass centre."""
    rest = {name: w.copy() for name, (w, _) in given.items()}
    for k, joint in enumerate(joints):
        for link, sign in ((joint.outer, 1), (joint.inner, -1)):
            if link != "base":
                force, torque = found[:, k, :3], found[:, k, 3:]
                rest[link][:, :3] += sign * force
                rest[link][:, 3:] += sign * (torque + np.cross(joint.point - given[link][1], force))
    return np.array([*rest.values()])


# ------------------------------------------------------------------------------------------------------------
# Balance, degrees of freedom, active forces
# ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*ALL, *REDUNDANT])
@pytest.mark.parametrize("load", ["file", "base", "platform"])
def test_every_link_is_balanced(name, load):
    c = named(name)
    given, options = {}, {}
    if load != "file":
        wrench = np.random.default_rng(SEED + 3).normal(size=(len(c.twist), 6)) * 100
        given, options = {"wrench": wrench, "axes": load}, {"wrench": wrench, "wrench_axes": load}
    answer = reactions(c, **options)
    joints, wrenches = joints_of(c), given_wrenches(c, **given)
    assert np.all([Status(s).has_answer for s in answer.status])
    for found in (answer.reactions, answer.least):
        size = scale_of(c, found) * CLOSED
        rest = np.abs(left_over(c, joints, found, wrenches))
        assert np.all(rest[..., :3] <= size[:, None])
        assert np.all(rest[..., 3:] <= size[:, None] * c.mech.characteristic_length)


@pytest.mark.parametrize("name", [*ALL, *REDUNDANT])
def test_joints_stand_where_they_are_and_carry_nothing_that_they_leave_free(name):
    c = named(name)
    answer, joints = reactions(c), joints_of(c)
    assert [joint.links for joint in answer.joints] == [(j.inner, j.outer) for j in joints]
    for found in (answer.reactions, answer.least):
        size = scale_of(c, found) * CLOSED
        for k, joint in enumerate(joints):
            agree(answer.points[:, k], joint.point, 1e-13)
            for axis in joint.turns:
                assert np.all(
                    np.abs(np.sum(found[:, k, 3:] * axis, -1)) <= size * c.mech.characteristic_length
                )
            for axis in joint.slides:
                assert np.all(np.abs(np.sum(found[:, k, :3] * axis, -1)) <= size)


@each
def test_joint_axes_are_those_of_the_joints(name):
    """Orthonormal, right-handed; free rotations about the first axes; δ second in a prismatic joint."""
    c = any_case(name)
    answer, joints = reactions(c), joints_of(c)
    axes = answer.axes
    agree(np.swapaxes(axes, -1, -2) @ axes, np.broadcast_to(np.eye(3), axes.shape), 1e-13)
    assert np.all(np.linalg.det(axes) > 0)
    for pair in (("reactions", "reactions_in_joint"), ("least", "least_in_joint")):
        base, joint = (getattr(answer, part) for part in pair)
        turned = [np.einsum("njab,nja->njb", axes, base[..., s]) for s in (slice(0, 3), slice(3, 6))]
        size = per_pose(scale_of(c, base))[..., None]
        assert np.all(np.abs(np.concatenate(turned, axis=-1) - joint) <= 1e-12 * size)
    for k, (joint, told) in enumerate(zip(joints, answer.joints, strict=True)):
        if told.kind == "P":
            leg = c.legs[(k - len(c.spec["rods"])) // 3]
            agree(axes[:, k, :, 1], leg.delta.x, 1e-12)
        elif told.kind in "RU":
            for column, axis in enumerate(joint.turns):
                along = np.sum(axes[:, k, :, column] * axis, axis=-1)
                agree(np.abs(along), np.ones(len(along)), 1e-9)


@each
def test_prismatic_joints_carry_the_active_forces(name):
    c = any_case(name)
    answer = reactions(c)
    axial = answer.reactions_in_joint[:, [k for k, joint in enumerate(answer.joints) if joint.kind == "P"], 1]
    active = o.actuated(c.spec)
    agree(
        axial[:, active],
        o.active_forces(c.spec, c.pose, c.twist, c.acceleration),
        FORCES * per_pose(c.condition),
    )
    dynamics = c.mech.inverse_dynamics(c.T, c.twist, c.acceleration)
    size = np.max(np.abs(dynamics.forces), axis=1, keepdims=True)
    assert np.all(np.abs(axial - dynamics.forces) <= FORCES * size * per_pose(c.condition))
    assert np.array_equal(answer.status, dynamics.status)


# ------------------------------------------------------------------------------------------------------------
# What redundant constraints leave open
# ------------------------------------------------------------------------------------------------------------


def system(c: Case, k: int):
    """Balances of all links and degrees of freedom of all joints at state k, for all reactions (F, T/Λ).

    Matrix and right-hand side; pure numbers and N.
    """
    joints, given = joints_of(c), given_wrenches(c)
    size, center = c.mech.characteristic_length, c.pose[1][k]
    links = [*given]
    rows = np.zeros((6 * len(links), 6 * len(joints)))
    rhs = np.zeros(6 * len(links))
    for i, (w, point) in enumerate(given.values()):
        rhs[6 * i : 6 * i + 3] = -w[k, :3]
        rhs[6 * i + 3 : 6 * i + 6] = -(w[k, 3:] + np.cross(point[k] - center, w[k, :3])) / size
    free = []
    for j, joint in enumerate(joints):
        block = np.eye(6)
        block[3:, :3] = o.skew((joint.point[k] - center) / size)
        for link, sign in ((joint.outer, 1), (joint.inner, -1)):
            if link != "base":
                i = links.index(link)
                rows[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] = sign * block
        for axes, start in ((joint.slides, 0), (joint.turns, 3)):
            for axis in axes:
                row = np.zeros(6 * len(joints))
                row[6 * j + start : 6 * j + start + 3] = axis[k]
                free.append(row)
    free = np.reshape(free, (-1, 6 * len(joints)))
    return np.concatenate([rows, free]), np.concatenate([rhs, np.zeros(len(free))])


def null_space(matrix):
    """Orthonormal columns that the matrix takes to zero."""
    _, s, Vt = np.linalg.svd(matrix)
    s = np.concatenate([s, np.zeros(len(Vt) - len(s))])
    return Vt[s <= 1e-11 * s[0]].T


def regular(c: Case):
    """Some states that are not near a singular pose."""
    s = o.conditioning(c.spec, c.pose)
    return np.flatnonzero(s[:, 0] < 1e5 * s[:, -1])[:8]


@pytest.mark.parametrize("name", [*ALL, *REDUNDANT])
def test_what_is_open_and_the_least_reactions(name):
    """From the null space of the whole system, and its solution of least size."""
    c = named(name)
    answer = reactions(c)
    size = np.array([1.0] * 3 + [c.mech.characteristic_length] * 3)
    for k in regular(c):
        matrix, rhs = system(c, k)
        open_ = null_space(matrix)
        assert open_.shape[1] == c.mech.mobility().redundant
        moved = np.linalg.norm(open_, axis=1).reshape(-1, 6)
        assert np.array_equal(answer.determinate[k], moved < 1e-9)
        axes = answer.axes[k]
        parts = [moved_part(open_, axes, s) for s in (0, 3)]
        assert np.array_equal(answer.determinate_in_joint[k], np.concatenate(parts, axis=1) < 1e-9)

        least = np.linalg.lstsq(matrix, rhs, rcond=1e-11)[0].reshape(-1, 6)
        largest = np.max(np.abs(least))
        assert np.all(np.abs(answer.least[k] / size - least) <= SAME * largest)
        # Determinate components are the same in both.
        assumed = answer.reactions[k] / size
        same = answer.determinate[k]
        difference = np.abs(assumed - answer.least[k] / size)
        assert np.all(difference[same] <= CLOSED * np.max(np.abs(assumed)))
        # No couple in U joints could be less: their sum of squares is stationary along every self-stress.
        universal = [j for j, joint in enumerate(answer.joints) if joint.kind == "U"]
        couples, number = assumed[universal][:, 3:].ravel(), open_.shape[1]
        by = open_.reshape(len(axes), 6, number)[universal][:, 3:].reshape(len(couples), number)
        assert np.all(np.abs(couples @ by) <= SAME * largest)
        # And what that leaves open is chosen by size: the rest is stationary where no couple changes.
        silent = open_ @ null_space(by) if by.size else open_
        assert np.all(np.abs(assumed.ravel() @ silent) <= SAME * largest)


def moved_part(open_, axes, start):
    """How much self-stresses change components in joint axes (joints, 3): of forces (0) or torques (3)."""
    part = open_.reshape(len(axes), 6, open_.shape[1])[:, start : start + 3]
    return np.linalg.norm(np.einsum("jab,jac->jbc", axes, part), axis=-1)


def test_the_open_components_of_the_paper():
    """Its two redundant constraints: forces along n and couples of legs 1 and 3; all else is determined."""
    c = any_case("lu")
    answer, generic = reactions(c), 2
    by_name = {j.name: answer.determinate_in_joint[generic, k] for k, j in enumerate(answer.joints)}
    assert by_name.pop("rod L").all()
    for leg in "13":
        assert [*by_name.pop(f"base joint {leg}")] == [False, True, True, True, False, False]
        assert [*by_name.pop(f"prismatic {leg}")] == [False, True, True, True, False, False]
        assert [*by_name.pop(f"platform joint {leg}")] == [True, False, True, True, True, False]
    assert np.all([*by_name.values()])


def test_length_weighs_couples_and_touches_nothing_determinate():
    c = any_case("lu")
    light, heavy = reactions(c, length=0.01), reactions(c, length=100.0)
    k = 2
    assert np.array_equal(light.reactions, heavy.reactions)
    assert not np.allclose(light.least[k], heavy.least[k], rtol=1e-3)

    def sizes(answer, part):
        return np.linalg.norm(answer.least[k][:, part])

    assert sizes(heavy, slice(0, 3)) < sizes(light, slice(0, 3))
    assert sizes(light, slice(3, 6)) < sizes(heavy, slice(3, 6))
    same = light.determinate[k]
    agree(light.least[k][same], heavy.least[k][same], CLOSED)


# ------------------------------------------------------------------------------------------------------------
# Outcomes and shapes
# ------------------------------------------------------------------------------------------------------------


def no_answer(answer, k=()):
    return (
        np.isnan(answer.reactions[k]).all()
        and np.isnan(answer.least[k]).all()
        and np.isnan(answer.constraint_wrench[k]).all()
        and not answer.determinate[k].any()
        and not answer.determinate_in_joint[k].any()
    )


def test_each_state_has_its_status():
    mech = pp.load("lu-3spu-2rpu-r")
    good = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.62, "beta": 0.7, "gamma": 0.6})
    long = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.9, "beta": 0.7, "gamma": 0.6})
    off = good.copy()
    off[1, 3] += 1e-3
    answer = mech.joint_reactions(np.stack([good, long, off, np.full((4, 4), np.nan)]), REST, REST)
    assert [Status(s).name for s in answer.status] == [
        "OK",
        "OUT_OF_STROKE",
        "OFF_CONSTRAINT",
        "INVALID_INPUT",
    ]
    assert np.isfinite(answer.reactions[:2]).all()
    assert no_answer(answer, 2)
    assert no_answer(answer, 3)
    assert mech.joint_reactions(good, REST, REST, [np.inf, 0, 0, 0, 0, 0]).status == Status.INVALID_INPUT


def test_a_leg_along_its_axis_has_no_answer():
    mech = pp.load(DATA / "stewart-gough.toml")
    leg = mech.geometry["legs"][0]
    axis = np.array(leg["base"]["axis"]) / np.linalg.norm(leg["base"]["axis"])
    pose = mech.home
    pose[:3, 3] = leg["base"]["point"] + axis - pose[:3, :3] @ leg["platform"]["point"]
    answer = mech.joint_reactions(pose, REST, REST)
    assert answer.status == Status.SINGULAR
    assert no_answer(answer)


def test_a_design_that_is_singular_everywhere_has_no_answer():
    """Similar hexagons with S joints below: the platform keeps a degree of freedom that no actuator holds."""
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    for leg, angle in zip(data["legs"], (10, 50, 130, 170, 250, 290), strict=True):
        leg["base"] = {"joint": "S", "point": {"radius": 500.0, "angle": angle}}
        leg["platform"] = {"joint": "U", "point": {"radius": 300.0, "angle": angle}, "axis": [1.0, 0.3, 0.0]}
    mech = pp.Mechanism.from_dict(data)
    pose = mech.pose({"x": 0.05, "y": 0.02, "z": 0.7, "rx": 0.1, "ry": -0.2, "rz": 0.3})
    answer = mech.joint_reactions(pose, REST, REST)
    assert answer.status == Status.SINGULAR
    assert no_answer(answer)


def test_a_singular_pose_has_no_answer_and_its_neighbours_have():
    """Legs, platform and base in one plane; above it reactions grow as one over the height."""
    data = pp.load(DATA / "stewart-gough.toml").to_dict()
    mech = pp.Mechanism.from_dict(data | {"load": {"force": [0.0, 0.0, 0.0]}})
    flat = mech.home
    heights = np.array([0.0, 1e-13, 1e-4, 2e-4])
    base = np.mean([leg["base"]["point"] for leg in mech.geometry["legs"]], axis=0)
    ends = np.mean([leg["platform"]["point"] for leg in mech.geometry["legs"]], axis=0)
    poses = np.broadcast_to(flat, (4, 4, 4)).copy()
    poses[:, 2, 3] = base[2] - ends[2] + heights
    answer = mech.joint_reactions(poses, REST, REST)
    dynamics = mech.inverse_dynamics(poses, REST, REST)
    assert np.array_equal(answer.status == Status.SINGULAR, dynamics.status == Status.SINGULAR)
    assert [s == Status.SINGULAR for s in answer.status] == [True, True, False, False]
    assert no_answer(answer, 0)
    ratio = np.abs(answer.reactions[2]).max() / np.abs(answer.reactions[3]).max()
    assert ratio == pytest.approx(2.0, rel=1e-3)


def test_a_pose_that_misses_its_constraints_by_rounding_has_nearly_the_same_reactions():
    """Redundant constraints then disagree; that must not be taken for a force."""
    c = any_case("lu")
    k = 2
    exact = c.mech.joint_reactions(c.T[k], REST, REST)
    for off in (1e-12, 1e-10, 1e-8, 1e-7):
        T = c.T[k].copy()
        T[:3, 3] += off * np.array([0.3, 1.0, -0.5])
        found = c.mech.joint_reactions(T, REST, REST)
        assert Status(found.status).has_answer
        for a, b in ((found.reactions, exact.reactions), (found.least, exact.least)):
            assert np.max(np.abs(a - b)) <= 1e3 * off * np.max(np.abs(b))
        assert np.array_equal(found.determinate_in_joint, exact.determinate_in_joint)


def test_batches_and_broadcasting():
    c = any_case("lu")
    whole = reactions(c)
    n, j = len(c.twist), 3 * c.mech.n_legs + len(c.mech.rod_names)
    assert whole.reactions.shape == (n, j, 6)
    assert whole.axes.shape == (n, j, 3, 3)
    for k in (0, 5, n - 1):
        one = c.mech.joint_reactions(c.T[k], c.twist[k], c.acceleration[k])
        for name in one.arrays:
            assert np.array_equal(getattr(one, name), getattr(whole, name)[k], equal_nan=True), name
    grid = c.mech.joint_reactions(c.T[2], REST, REST, np.zeros((2, 1, 6)) + np.eye(6)[:3])
    assert grid.reactions.shape == (2, 3, j, 6)
    assert grid.status.shape == (2, 3)
    assert c.mech.joint_list == whole.joints
    with pytest.raises(pp.PolypodError, match="length is"):
        c.mech.joint_reactions(c.T[2], REST, REST, length=-1.0)


def test_reactions_are_linear_in_the_load():
    """At rest and without weight, twice the load gives twice the reactions, of either rule."""
    c = case("rod-lined")
    tables = c.mech.to_dict()
    tables["dynamics"] |= {"gravity": [0.0, 0.0, 0.0]}
    mech = pp.Mechanism.from_dict(tables)
    load = np.array([3.0, -20.0, 7.0, 0.5, 2.0, -1.0])
    one, two = (mech.joint_reactions(c.T[1], REST, REST, k * load) for k in (1, 2))
    agree(two.reactions, 2 * one.reactions, CLOSED)
    agree(two.least, 2 * one.least, CLOSED)


# ------------------------------------------------------------------------------------------------------------
# Along a motion
# ------------------------------------------------------------------------------------------------------------


def test_solutions_hold_reactions_if_asked(tmp_path, monkeypatch):
    mech = pp.load("lu-3spu-2rpu-r")
    motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample(np.linspace(0.0, 1.0, 7))
    monkeypatch.setattr("polypod.solution.solve.CHUNK", 4)
    plain_dataset = pp.solve(mech, motion).dataset
    solution = pp.solve(mech, motion, reactions=True)
    dataset = solution.dataset
    assert {*dataset.data_vars} - {*plain_dataset.data_vars} == {
        "reaction",
        "reaction_in_joint",
        "least_reaction",
        "least_reaction_in_joint",
        "reaction_determinate",
        "constraint_wrench",
    }
    assert "joint" not in plain_dataset.coords
    states = (dataset[name].values for name in ("pose", "twist", "acceleration"))
    answer = mech.joint_reactions(*states)
    assert dataset["joint"].values.tolist() == [joint.name for joint in answer.joints]
    assert np.array_equal(dataset["reaction"], answer.reactions)
    assert np.array_equal(dataset["reaction_in_joint"], answer.reactions_in_joint)
    assert np.array_equal(dataset["least_reaction"], answer.least)
    assert np.array_equal(dataset["least_reaction_in_joint"], answer.least_in_joint)
    assert np.array_equal(dataset["reaction_determinate"], answer.determinate_in_joint)
    assert np.array_equal(dataset["constraint_wrench"], answer.constraint_wrench)
    axial = dataset["reaction_in_joint"].sel(joint="prismatic 3", joint_component="force 2")
    agree(axial.values, dataset["force"].sel(leg="3").values, CLOSED)
    for suffix in (".nc", ".csv"):
        solution.save(tmp_path / f"result{suffix}")
        assert pp.load_solution(tmp_path / f"result{suffix}") == solution


def test_the_load_of_a_motion_is_that_of_its_reactions():
    mech = pp.load("lu-3spu-2rpu-r")
    motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample(np.linspace(0.0, 1.0, 3))
    loaded = replace(motion, wrench=np.full((3, 6), 50.0), wrench_axes="platform")
    dataset = pp.solve(mech, loaded, reactions=True).dataset
    axial = dataset["reaction_in_joint"].sel(joint="prismatic 2", joint_component="force 2")
    agree(axial.values, dataset["force"].sel(leg="2").values, CLOSED)


def test_the_command_saves_reactions(run, tmp_path):
    result = tmp_path / "result.nc"
    command = ("solve", "lu-3spu-2rpu-r", "lu-3spu-2rpu-r", "--samples", "5", "-o", result)
    assert run(*command)[0] == 0
    assert "reaction" not in pp.load_solution(result).dataset
    assert run(*command, "--reactions")[0] == 0
    assert pp.load_solution(result).dataset["reaction"].sizes == {"time": 5, "joint": 16, "component": 6}
