"""Slider legs: the core against independent twins, round trips, singular poses and poses out of reach."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from polypod import SingularityKind, Status
from polypod.multibody.placement import BASE, PLATFORM
from polypod.multibody.tree import describe
from polypod.verify import comparison, verify_states
from support import sliders
from support.sliders import COUNT, states
from support.verified import exceeding

NAMES = list(sliders.LEGS)
LOAD = np.array([300.0, -200.0, -500.0, 20.0, 40.0, -30.0])
ROUNDING = 1e-12


# --- twins --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("axes", ["base", "platform"])
def test_pinocchio_agrees(name, axes):
    """Places, rates, forces and constraint wrenches, to a part in 10⁹."""
    pytest.importorskip("pinocchio")
    found = verify_states(sliders.mechanism(name), *states(name), LOAD, axes)
    comparison = found.comparisons[0]
    assert found.tolerance == 1e-9
    assert (comparison.compared, comparison.without_answer) == (COUNT, {})
    assert found.agrees, {row.quantity: row.relative_max for row in comparison.rows}
    wanted = {"lengths", "rates", "accelerations", "cylinder_acceleration", "leg_eps", "forces"}
    wanted |= {"constraint_force", "constraint_torque"} if name in ("prs", "puu") else set()
    assert wanted <= {row.quantity for row in comparison.rows}


@pytest.mark.parametrize("name", NAMES)
def test_struts_without_mass_are_followed_at_their_platform_joints(name):
    """As links of telescopic legs are at their ends, by the core and by the twin."""
    pytest.importorskip("pinocchio")
    tables = sliders.tables(name)
    for leg in tables["legs"]:
        leg.pop("strut", None)
    found = verify_states(pp.Mechanism.from_dict(tables), *states(name), LOAD)
    assert found.comparisons[0].compared == COUNT
    assert not exceeding(found)


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
@pytest.mark.parametrize("name", NAMES)
def test_engines_that_are_given_forces_agree(name, engine):
    pytest.importorskip(engine)
    found = verify_states(sliders.mechanism(name), *states(name), LOAD, engines=(engine,))
    comparison = found.comparisons[0]
    assert comparison.compared == COUNT
    assert found.agrees, {row.quantity: row.relative_max for row in comparison.rows}


def lighter_carriage(tables):
    tables["legs"][1]["carriage"] = tables["legs"][1]["carriage"] | {"mass": 1.4}


def mirrored_strut(tables):
    strut = tables["legs"][1]["strut"]
    tables["legs"][1]["strut"] = strut | {"center": [-strut["center"][0], *strut["center"][1:]]}


def turned_inertia(tables):
    strut = tables["legs"][1]["strut"]
    tables["legs"][1]["strut"] = strut | {"inertia": strut["inertia"][::-1]}


def other_rail(tables):
    slider = tables["legs"][1]["slider"]
    tables["legs"][1]["slider"] = slider | {"axis": [1.0, 1e-6, 0.0]}


def longer_strut(tables):
    slider = tables["legs"][1]["slider"]
    tables["legs"][1]["slider"] = slider | {"strut": slider["strut"] * (1 + 1e-7)}


def other_branch(tables):
    slider = tables["legs"][1]["slider"]
    tables["legs"][1]["slider"] = slider | {"branch": -slider["branch"]}


FAULTS = {
    lighter_carriage: {"forces"},
    mirrored_strut: {"forces", "piston_velocity"},
    turned_inertia: {"forces"},
    other_rail: {"lengths", "rates", "forces", "cylinder_velocity"},
    longer_strut: {"lengths", "rates", "forces"},
    other_branch: {"lengths", "rates", "forces", "leg_omega"},
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_a_fault_is_found(monkeypatch, fault):
    """Polypod computes with other numbers than the twin."""
    pytest.importorskip("pinocchio")
    tables = sliders.tables("pus")
    for leg in tables["legs"]:
        del leg["stroke"]
    fault(tables)
    wrong, tree = pp.Mechanism.from_dict(tables), describe(sliders.mechanism("pus"))
    monkeypatch.setattr(comparison, "describe", lambda mech: tree)
    found = verify_states(wrong, *states("pus"), LOAD)
    assert not found.agrees
    assert FAULTS[fault] <= exceeding(found)


def test_the_motion_that_comes_out_of_the_forces():
    """In Exudyn, with steps that are halved: also the carriages' places."""
    pytest.importorskip("exudyn")
    from polypod.verify.integrate import integrate

    mech = sliders.mechanism("pus")
    time = np.linspace(0.0, 0.4, 41)
    swing = np.sin(2.0 * np.pi * time / 0.8)
    q = {"x": 0.06 * swing, "y": 0.04 * swing, "z": 0.4 + 0.03 * swing, "rx": 0.1 * swing, "ry": 0 * time}
    motion = pp.Motion.through(time, q | {"rz": -0.1 * swing}, set="pose")
    found = integrate(mech, motion)
    assert found.agrees, found.facts()


# --- reactions ----------------------------------------------------------------------------------------------


def twin_motions(name, k):
    """Frame, velocity and acceleration of all bodies' frames and centres at a state, from Pinocchio."""
    from polypod.verify.pinocchio import Tree

    tree = Tree(describe(sliders.mechanism(name)))
    pose, twist, acceleration = (array[k] for array in states(name))
    moved = tree.move(tree.start(tree.tree.start(pose)), pose, twist, acceleration)
    assert moved.status is Status.OK
    tree.set(moved)
    placed = tree.placements()
    found = {}
    for body in tree.tree.bodies:
        frame = tree.frames[body.name]
        spin, gain = tree.velocity(frame)[3:], tree.acceleration(frame)[3:]
        found[body.name] = (
            placed[body.name],
            body,
            spin,
            gain,
            tree.acceleration(tree.centers[body.name])[:3],
        )
    return found, twist


def required(motion, gravity):
    """Force and torque about the base's origin that a body's motion and weight need."""
    frame, body, spin, gain, acceleration = motion
    turn = frame[:3, :3]
    inertia = turn @ body.inertia @ turn.T
    force = body.mass * (acceleration - gravity)
    torque = inertia @ gain + np.cross(spin, inertia @ spin)
    return force, torque + np.cross(frame[:3, 3] + turn @ body.center, force)


@pytest.mark.parametrize("name", NAMES)
def test_reactions_balance_the_motion_of_every_link(name):
    """With what joints leave free they are all that balance and degrees of freedom allow: no others exist."""
    pytest.importorskip("pinocchio")
    mech = sliders.mechanism(name)
    spec, gravity = mech.geometry, np.array(mech.geometry["gravity"])
    answer = mech.joint_reactions(*states(name), LOAD)
    forces = mech.inverse_dynamics(*states(name), LOAD).forces
    for k in range(COUNT):
        motions, twist = twin_motions(name, k)
        size = np.abs(answer.reactions[k, :, :3]).max()
        left = {body.removeprefix("leg "): np.zeros(6) for body in motions}
        for body, motion in motions.items():
            left[body.removeprefix("leg ")] -= np.concatenate(required(motion, gravity))
        pose = states(name)[0][k]
        pull = LOAD - np.repeat([spec["linear_damping"], spec["angular_damping"]], 3) * twist
        own = left[PLATFORM] + np.concatenate([pull[:3], pull[3:] + np.cross(pose[:3, 3], pull[:3])])
        left[PLATFORM] = own / spec["efficiency"]
        for joint, point, wrench in zip(answer.joints, answer.points[k], answer.reactions[k], strict=True):
            at_origin = np.concatenate([wrench[:3], wrench[3:] + np.cross(point, wrench[:3])])
            for link, sign in zip(joint.links, (-1.0, 1.0), strict=True):
                if link != BASE:
                    kind, _, leg = link.partition(" ")
                    left[f"{leg} {kind}" if leg else link] += sign * at_origin
        for body, rest in left.items():
            assert np.abs(rest).max() < 1e-9 * size, body
        for i, leg in enumerate(spec["legs"]):
            ground, slide, above = (3 * i + j for j in range(3))
            carriage_or_strut = motions[f"leg {leg['name']} {'strut' if leg['slider'] else 'cylinder'}"][0]
            axes = {"base": (np.eye(3), ground), "platform": (pose[:3, :3], above)}
            for side, (turn, joint) in axes.items():
                torque = answer.reactions[k, joint, 3:]
                free = {"S": [*np.eye(3)], "R": [carriage_or_strut[:3, 0]]}.get(leg[side]["joint"])
                free = free or [turn @ leg[side]["axis"], carriage_or_strut[:3, 0]]
                assert np.abs(np.array(free) @ torque).max() < 1e-9 * size, (leg["name"], side)
            if leg["slider"] is not None:
                axis = np.array(leg["slider"]["axis"]) / np.linalg.norm(leg["slider"]["axis"])
                assert abs(answer.reactions[k, slide, :3] @ axis - forces[k, i]) < 1e-9 * size


def test_joints_of_sliders_are_named_from_the_base_on():
    joints = sliders.mechanism("mixed").joint_list
    assert [(j.name, j.kind, j.links) for j in joints[9:12]] == [
        ("base joint 4", "S", ("carriage 4", "strut 4")),
        ("prismatic 4", "P", ("base", "carriage 4")),
        ("platform joint 4", "S", ("strut 4", "platform")),
    ]


# --- kinematics ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_places_are_those_of_the_geometry(name):
    """The foot is on the rail, a strut's length from the platform joint, on the side that the branch says."""
    mech = sliders.mechanism(name)
    pose = states(name)[0]
    legs, angle = mech.inverse_kinematics(pose), mech.singularity(pose).transmission
    for i, leg in enumerate(mech.geometry["legs"]):
        end = pose[:, :3, :3] @ leg["platform"]["point"] + pose[:, :3, 3]
        if leg["slider"] is None:
            assert np.all(angle[:, i] == 1.0)
            continue
        axis = np.array(leg["slider"]["axis"]) / np.linalg.norm(leg["slider"]["axis"])
        strut = end - (leg["base"]["point"] + legs.lengths[:, i, None] * axis)
        np.testing.assert_allclose(np.linalg.norm(strut, axis=-1), leg["slider"]["strut"], rtol=ROUNDING)
        np.testing.assert_allclose(legs.vectors[:, i], strut, atol=ROUNDING)
        np.testing.assert_allclose(angle[:, i], strut @ axis / leg["slider"]["strut"], rtol=ROUNDING)
        assert np.all(angle[:, i] * leg["slider"]["branch"] > 0.0)


@pytest.mark.parametrize("name", NAMES)
def test_poses_come_back(name):
    mech, (pose, *_) = sliders.mechanism(name), states(name)
    lengths = mech.inverse_kinematics(pose).lengths
    found = mech.forward_kinematics(lengths, mech.home)
    assert set(found.status.tolist()) == {Status.OK}
    again = mech.inverse_kinematics(found.pose).lengths
    assert abs(again - lengths)[:, mech.actuated].max() < 1e-11
    modes = mech.assembly_modes(lengths[0])
    assert np.sum(abs(modes.pose - pose[0]).max(axis=(1, 2)) < 1e-8) == 1


def test_a_pose_of_the_other_branch_says_so():
    """All poses with the carriages at these places, also those from which another place would be found."""
    mech = sliders.mechanism("prs")
    lengths = mech.inverse_kinematics(states("prs")[0][0]).lengths
    modes = mech.assembly_modes(lengths)
    assert {Status.OK, Status.OTHER_BRANCH} <= {Status(int(s)) for s in modes.mode_status}
    assert Status.OTHER_BRANCH.has_answer
    for pose, status in zip(modes.pose, modes.mode_status, strict=True):
        back = mech.inverse_kinematics(pose).lengths
        same = np.abs(back - lengths).max() < 1e-9
        assert same == (Status(int(status)) is not Status.OTHER_BRANCH)


# --- singular poses and poses out of reach ------------------------------------------------------------------


def across():
    """A pose of "pus" with the strut of leg 6 perpendicular to its rail, to rounding, and others not."""
    mech = sliders.mechanism("pus")
    leg = mech.geometry["legs"][5]
    pose = np.array(mech.home)
    end = pose[:3, 3] + leg["platform"]["point"]
    offset = end - leg["base"]["point"]
    pose[2, 3] += np.sqrt(leg["slider"]["strut"] ** 2 - offset[1] ** 2) - offset[2]
    return mech, pose


def test_a_strut_across_its_rail_is_named():
    mech, pose = across()
    pose[2, 3] -= 1e-14
    found = mech.singularity(pose)
    assert SingularityKind(int(found.kind)) is SingularityKind.STRUT_ACROSS_RAIL
    assert int(found.leg) == 5
    assert "perpendicular to its rail" in SingularityKind.STRUT_ACROSS_RAIL.message
    assert abs(found.transmission[5]) < 1e-6
    pose[2, 3] -= 0.02
    assert mech.singularity(pose).kind == SingularityKind.NONE
    near = mech.singularity(pose, tolerance=0.3)
    assert SingularityKind(int(near.kind)) is SingularityKind.STRUT_ACROSS_RAIL


def test_beyond_that_the_strut_is_too_short():
    mech, pose = across()
    pose[2, 3] += 1e-3
    rest = np.zeros(6)
    for answer in (mech.inverse_kinematics(pose), mech.inverse_dynamics(pose, rest, rest)):
        assert Status(int(answer.status)) is Status.OUT_OF_REACH
    assert np.isnan(mech.inverse_kinematics(pose).lengths[5])
    assert "too short" in Status.OUT_OF_REACH.message


def test_a_motion_near_it_is_told():
    mech, pose = across()
    time = np.linspace(0.0, 1.0, 41)
    z = pose[2, 3] - 1e-5 - 0.05 * (time - 0.5) ** 2
    q = {"x": 0 * time, "y": 0 * time, "z": z, "rx": 0 * time, "ry": 0 * time, "rz": 0 * time}
    found = pp.solve(mech, pp.Motion.through(time, q, set="pose")).singularities
    near = [passage for passage in found["near"] if passage["kind"] == "STRUT_ACROSS_RAIL"]
    assert [passage["leg"] for passage in near] == ["6"]
    assert near[0]["minimum"] < found["threshold"]


def test_a_strut_without_length_is_one_fault() -> None:
    """Ranks of a machine that no strut holds would tell a second one, which is none."""
    data = pp.load("hexaglide").to_dict()
    data["legs"][0]["slider"]["strut"] = 0
    with pytest.raises(pp.MechanismError) as error:
        pp.Mechanism.from_dict(data)
    assert [fault.place for fault in error.value.faults] == ["legs.1.slider.strut"]
