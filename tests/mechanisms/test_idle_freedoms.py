"""Local degrees of freedom: the spin of a rod on which all legs end, or rotation about a line below."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import polypod as pp
from polypod import SingularityKind, Status
from polypod.errors import UnsupportedError

Array = NDArray[np.float64]

STATES = 5
WRENCH = np.array([80.0, -60.0, -150.0, 6.0, -4.0, 5.0])


def tilted_rod() -> pp.Mechanism:
    """A pentapod whose rod is oblique in its platform and passes o by, with a body that is not round."""
    data = pp.load("pentapod-5-ups").to_dict()
    axis, off = np.array([0.3, -0.2, 0.9]), np.array([25.0, -10.0, 5.0])
    axis /= np.linalg.norm(axis)
    for leg in data["legs"]:
        leg["platform"]["point"] = (off + axis * leg["platform"]["point"][2]).tolist()
        leg["stroke"] = {"min": 300, "max": 1000}
    data["platform"] |= {"center": [30, 10, 20], "inertia": [0.05, 0.04, 0.01]}
    data["dynamics"] = {"efficiency": 0.8, "linear_damping": 40.0, "angular_damping": 3.0}
    data["name"] = "tilted rod"
    return pp.Mechanism.from_dict(data)


def turned_over() -> pp.Mechanism:
    """Base joints on a line, platform joints about."""
    data = pp.load("pentapod-5-spu").to_dict()
    places = zip((-120, 0, -240, 120, 240), (0, 60, -60, 60, -60), data["legs"], strict=True)
    for x, height, leg in places:
        ring = {"radius": 200, "angle": leg["base"]["point"]["angle"], "z": height}
        leg["base"] = {"joint": "U", "point": [x, 40, 15], "axis": [1, 0, 0]}
        leg["platform"] = {"joint": "S", "point": ring}
        leg["stroke"] = {"min": 200, "max": 1000}
    data["home"] = {"position": [20, 0, 520]}
    data["platform"] |= {"center": [30, 10, 20], "inertia": [0.05, 0.04, 0.03]}
    data["name"] = "rotated over"
    return pp.Mechanism.from_dict(data)


MECHANISMS = {
    "pentapod-5-ups": pp.load("pentapod-5-ups"),
    "pentapod-5-spu": pp.load("pentapod-5-spu"),
    "linuxcnc-pentakins": pp.load("linuxcnc-pentakins"),
    "tilted rod": tilted_rod(),
    "rotated over": turned_over(),
}
each = pytest.mark.parametrize("name", MECHANISMS)


def motions(mech: pp.Mechanism, seed: int = 7) -> tuple[Array, Array, Array]:
    """Random motions about home."""
    rng = np.random.default_rng([seed, *mech.name.encode()])
    pose = np.tile(mech.home, (STATES, 1, 1))
    turn = Rotation.from_rotvec(0.2 * rng.uniform(-1, 1, (STATES, 3))).as_matrix()
    pose[:, :3, :3] = turn @ pose[:, :3, :3]
    pose[:, :3, 3] += 0.15 * mech.characteristic_length * rng.uniform(-1, 1, (STATES, 3))
    size = np.repeat([mech.characteristic_length, 1.0], 3)
    return pose, size * rng.normal(size=(STATES, 6)), 5.0 * size * rng.normal(size=(STATES, 6))


def line(mech: pp.Mechanism, pose: Array) -> tuple[Array, Array]:
    """A point of the idle line and its direction (..., 3), base axes."""
    [idle] = mech.mobility().idle
    point, axis = np.array(idle.point), np.array(idle.axis)
    if idle.body == "base":
        return np.broadcast_to(point, (*pose.shape[:-2], 3)), np.broadcast_to(axis, (*pose.shape[:-2], 3))
    return pose[..., :3, 3] + pose[..., :3, :3] @ point, pose[..., :3, :3] @ axis


def spun(mech: pp.Mechanism, pose: Array, angle: float) -> Array:
    """The pose after a rotation about the idle line."""
    point, axis = line(mech, pose)
    turn, moved = Rotation.from_rotvec(angle * axis).as_matrix(), pose.copy()
    moved[:3, :3] = turn @ pose[:3, :3]
    moved[:3, 3] = point + turn @ (pose[:3, 3] - point)
    return moved


def spin(mech: pp.Mechanism, pose: Array) -> Array:
    """(..., 6): the twist of a rotation by one radian per second about the line."""
    point, axis = line(mech, pose)
    return np.concatenate([np.cross(axis, pose[..., :3, 3] - point), axis], axis=-1)


# --- which they are -----------------------------------------------------------------------------------------


@each
def test_the_line_is_that_of_the_joints(name: str) -> None:
    mech = MECHANISMS[name]
    mobility = mech.mobility()
    assert (mech.dof, mobility.uncontrolled, len(mobility.idle), mech.n_rows) == (6, 0, 1, 6)
    [idle] = mobility.idle
    assert idle.body == ("base" if name == "rotated over" else "platform")
    joints = np.array([leg[idle.body]["point"] for leg in mech.geometry["legs"]])
    along = np.array(idle.axis)
    assert abs(np.linalg.norm(along) - 1.0) < 1e-12
    assert abs(np.cross(joints - idle.point, along)).max() < 1e-9
    assert "moves no leg" in str(idle)


@each
def test_no_leg_feels_the_spin(name: str) -> None:
    mech = MECHANISMS[name]
    pose, *_ = motions(mech)
    twist = spin(mech, pose)
    assert abs(mech.kinematics(pose, twist, np.zeros(6)).rates).max() < 1e-12
    rows = np.einsum("nij,nj->ni", mech.jacobian(pose), twist)
    assert abs(rows - [0, 0, 0, 0, 0, 1]).max() < 1e-12
    assert (mech.hessian(pose)[:, 5] == 0.0).all()
    lengths = mech.inverse_kinematics(pose[0]).lengths
    assert abs(mech.inverse_kinematics(spun(mech, pose[0], 1.1)).lengths - lengths).max() < 1e-12


def test_two_and_three_idle_freedoms() -> None:
    """Legs that end in one point hold none of the rotations about it."""
    data = pp.load("pentapod-5-ups").to_dict()
    data["legs"] = data["legs"][:3]
    for leg in data["legs"]:
        leg["platform"]["point"] = [10, 5, 20]
    mech = pp.Mechanism.from_dict(data)
    idle = mech.mobility().idle
    assert [freedom.body for freedom in idle] == ["platform"] * 3
    axes = np.array([freedom.axis for freedom in idle])
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-9)
    assert [
        freedom.point
        for freedom in idle
        if np.linalg.norm(np.cross(np.array(freedom.point) - [0.01, 0.005, 0.02], freedom.axis)) > 1e-9
    ] == []
    with pytest.raises(UnsupportedError, match="one local degree of freedom"):
        mech.assembly_modes([0.5] * 3)
    # Base joints on a line as well: the machine swings about that, too.
    data = pp.load("pentapod-5-spu").to_dict()
    data["legs"] = data["legs"][:4]
    for x, leg in zip((-300, -50, 120, 260), data["legs"], strict=True):
        leg["base"] = {"joint": "U", "point": [x, 0, 0], "axis": [1, 0, 0]}
        leg["platform"]["joint"] = "S"
        del leg["platform"]["axis"]
    data["home"] = {"position": [0, 30, 500], "rotation_vector": [20, 40, 0]}
    for leg in data["legs"]:
        leg["stroke"] = {"min": 100, "max": 2000}
    both = pp.Mechanism.from_dict(data).mobility().idle
    assert [freedom.body for freedom in both] == ["platform", "base"]


def test_a_leg_that_is_missing_is_no_idle_freedom() -> None:
    data = pp.load("ups-hexapod").to_dict()
    data["legs"] = data["legs"][:5]
    with pytest.raises(
        pp.MechanismError, match="5 actuated legs for 6 degrees of freedom; at least 6 legs must be actuated"
    ):
        pp.Mechanism.from_dict(data)
    # A passive leg beside the rod feels the spin, which an actuator should then hold.
    data = pp.load("pentapod-5-ups").to_dict()
    passive = {
        "actuated": False,
        "base": {"joint": "U", "point": [100, 100, 0], "axis": [1, 0, 0]},
        "platform": {"joint": "S", "point": [60, 0, 0]},
    }
    data["legs"].append(passive)
    with pytest.raises(pp.MechanismError, match="at least 6 legs must be actuated"):
        pp.Mechanism.from_dict(data)


def test_nearly_a_rod_is_none() -> None:
    data = pp.load("pentapod-5-ups").to_dict()
    data["legs"][2]["platform"]["point"][0] = 0.01
    with pytest.raises(pp.MechanismError, match="at least 6 legs must be actuated"):
        pp.Mechanism.from_dict(data)


def test_info_names_the_line(run) -> None:
    status, out, err = run("info", "pentapod-5-ups")
    assert (status, err) == (0, "")
    words = " ".join(out.replace("│", " ").split())
    for said in ("one of them idle", "spin about the line", "which move no leg"):
        assert said in words


# --- kinematics and singularities ---------------------------------------------------------------------------


@each
def test_forward_kinematics_keeps_the_spin_of_the_guess(name: str) -> None:
    mech = MECHANISMS[name]
    pose, *_ = motions(mech)
    lengths = mech.inverse_kinematics(pose).lengths
    found = mech.forward_kinematics(lengths)
    assert set(found.status.tolist()) == {Status.OK}
    assert abs(mech.inverse_kinematics(found.pose).lengths - lengths).max() < 1e-12
    # The line is where it was, and the pose only spun about it.
    for mine, given in zip(found.pose, pose, strict=True):
        if mech.mobility().idle[0].body == "platform":
            for a, b in zip(line(mech, mine), line(mech, given), strict=True):
                assert abs(a - b).max() < 1e-9
    # From a guess that is spun by a little, the pose is spun by as much.
    for angle in (0.0, 0.3, 2.0):
        there = spun(mech, pose[0], angle)
        same = mech.forward_kinematics(lengths[0], there)
        assert abs(same.pose - there).max() < 1e-9
    # All states in one call, and each alone, are the same.
    alone = np.array([mech.forward_kinematics(row).pose for row in lengths])
    assert (alone == found.pose).all()


@each
def test_rates_give_a_twist_without_spin(name: str) -> None:
    mech = MECHANISMS[name]
    pose, twist, acceleration = motions(mech)
    motion = mech.kinematics(pose, twist, acceleration)
    found = mech.platform_twist(pose, motion.rates)
    assert set(found.status.tolist()) == {Status.OK}
    _, axis = line(mech, pose)
    off = twist - found.twist
    assert abs((found.twist[:, 3:] * axis).sum(axis=1)).max() < 1e-10
    spins = (twist[:, 3:] * axis).sum(axis=1)
    assert abs(off - spins[:, None] * spin(mech, pose)).max() < 1e-9


@each
def test_idle_is_not_singular(name: str) -> None:
    mech = MECHANISMS[name]
    pose, *_ = motions(mech)
    found = mech.singularity(pose)
    assert set(found.kind.tolist()) == {SingularityKind.NONE}
    assert set(found.uncontrolled.tolist()) == {0}
    # Singular values of five rows on the twists that are perpendicular to the spin: those of the rows
    # themselves.
    J = mech.jacobian(pose)[:, :5].copy()
    J[..., 3:] /= mech.characteristic_length
    values = np.linalg.svd(J, compute_uv=False)
    assert found.sigma_min == pytest.approx(values[:, 4], rel=1e-9)
    assert found.sigma_max == pytest.approx(values[:, 0], rel=1e-9)
    assert mech.conditioning(pose).sigma_min == pytest.approx(values[:, 4], rel=1e-9)
    assert not any("singular" in note for note in mech.warnings)


def test_legs_in_a_plane_with_the_rod_are_singular() -> None:
    data = pp.load("pentapod-5-spu").to_dict()
    mech = pp.Mechanism.from_dict(data)
    # All base joints are in the plane z = 0: with the rod in it all legs are.
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    pose[:3, 3] = [30.0e-3, 20.0e-3, 0.0]
    found = mech.singularity(pose)
    assert SingularityKind(int(found.kind)) is SingularityKind.ACTUATION
    assert int(found.uncontrolled) >= 1
    rates = mech.kinematics(pose, found.twist, np.zeros(6)).rates
    assert abs(rates).max() < 1e-9
    # The twist that is left is none of the spin.
    assert abs(found.twist - spin(mech, pose)).max() > 0.1
    assert Status(int(mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6)).status)) is Status.SINGULAR


@pytest.mark.parametrize("name", ["pentapod-5-ups", "tilted rod", "rotated over"])
def test_assembly_modes_up_to_the_spin(name: str) -> None:
    """All lines that a search from random poses finds, by other equations and another method."""
    mech = MECHANISMS[name]
    pose, *_ = motions(mech)
    lengths = mech.inverse_kinematics(pose[0]).lengths
    modes = mech.assembly_modes(lengths)
    assert Status(int(modes.status)) is Status.OK
    assert abs(mech.inverse_kinematics(modes.pose).lengths - lengths).max() < 1e-11

    legs = mech.geometry["legs"]
    base, platform = (np.array([leg[side]["point"] for leg in legs]) for side in ("base", "platform"))

    def off(x: Array) -> Array:
        turn = Rotation.from_quat(x[3:] / np.linalg.norm(x[3:])).as_matrix()
        return np.linalg.norm(x[:3] + platform @ turn.T - base, axis=1) - lengths

    def key(pose: Array) -> Array:
        """Invariants of a spin: distances of the line, or seen from the platform, in base axes."""
        if mech.mobility().idle[0].body == "platform":
            return np.concatenate(line(mech, pose))
        point, axis = line(mech, pose)
        R = pose[:3, :3]
        return np.concatenate([R.T @ (point - pose[:3, 3]), R.T @ axis])

    rng, found = np.random.default_rng(5), []
    for _ in range(150):
        start = np.concatenate(
            [mech.home[:3, 3] * rng.choice([-1, 1]) + 0.3 * rng.normal(size=3), rng.normal(size=4)]
        )
        fit = least_squares(off, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        if abs(fit.fun).max() < 1e-10:
            at = np.eye(4)
            at[:3, :3] = Rotation.from_quat(fit.x[3:] / np.linalg.norm(fit.x[3:])).as_matrix()
            at[:3, 3] = fit.x[:3]
            if all(abs(key(at) - other).max() > 1e-5 for other in found):
                found.append(key(at))
    mine = [key(mode) for mode in modes.pose]
    assert len(found) >= 2
    for one in found:
        assert sum(abs(one - other).max() < 1e-5 for other in mine) == 1
    assert len(found) == len(mine)
    assert sum(abs(key(pose[0]) - other).max() < 1e-9 for other in mine) == 1


# --- dynamics -----------------------------------------------------------------------------------------------


def asked(mech: pp.Mechanism, pose: Array, twist: Array, acceleration: Array) -> Array:
    terms = mech.equations_of_motion(pose, twist)
    load = terms.mass @ acceleration + (terms.coriolis + terms.damping) @ twist + terms.gravity
    return load - WRENCH / mech.geometry["efficiency"]


@each
def test_the_torque_that_no_leg_gives(name: str) -> None:
    """Six equations written anew: forces along the legs, and a couple along the line."""
    mech = MECHANISMS[name]
    motion = motions(mech)
    found = mech.inverse_dynamics(*motion, WRENCH)
    assert set(found.status.tolist()) == {Status.OK}
    assert found.idle_torques.shape == (STATES, 1)
    along = mech.inverse_kinematics(motion[0])
    for i in range(STATES):
        d, R = along.directions[i], motion[0][i, :3, :3]
        e = np.array([leg["platform"]["point"] for leg in mech.geometry["legs"]]) @ R.T
        _, axis = line(mech, motion[0][i])
        columns = np.column_stack([np.hstack([d, np.cross(e, d)]).T, [0, 0, 0, *axis]])
        x = np.linalg.solve(columns, asked(mech, *(part[i] for part in motion)))
        assert abs(found.forces[i] - x[:5]).max() < 1e-9 * abs(x[:5]).max()
        assert abs(found.idle_torques[i, 0] - x[5]) < 1e-9 * abs(x[:5]).max()
    power = mech.power(*motion, WRENCH)
    assert abs(power.residual).max() < 1e-10 * abs(power.actuators).max()


@each
def test_forward_dynamics_lets_it_spin(name: str) -> None:
    """Without the torque the platform does not keep up the motion, but spins as it likes; legs do as told."""
    mech = MECHANISMS[name]
    pose, twist, acceleration = motions(mech)
    forces = mech.inverse_dynamics(pose, twist, acceleration, WRENCH).forces
    free = mech.forward_dynamics(pose, twist, forces, WRENCH)
    assert set(free.status.tolist()) == {Status.OK}
    again = mech.inverse_dynamics(pose, twist, free.acceleration, WRENCH)
    assert abs(again.idle_torques).max() < 1e-8 * mech.characteristic_length * abs(forces).max()
    assert abs(again.forces - forces).max() < 1e-8 * abs(forces).max()


@each
def test_reactions_hold_with_the_torque(name: str) -> None:
    mech = MECHANISMS[name]
    motion = motions(mech)
    found, dynamics = mech.joint_reactions(*motion, WRENCH), mech.inverse_dynamics(*motion, WRENCH)
    assert set(found.status.tolist()) == {Status.OK}
    along = (found.reactions[:, 1::3, :3] * mech.inverse_kinematics(motion[0]).directions).sum(axis=-1)
    assert abs(along - dynamics.forces).max() < 1e-9 * abs(dynamics.forces).max()
    assert found.determinate.all()


@each
def test_derivatives_are_those_of_differences(name: str) -> None:
    mech = MECHANISMS[name]
    pose = motions(mech)[0][0]
    names = mech.coordinate_sets["pose"]
    base = {n: float(x) for n, x in mech.coordinates(pose, "pose").items()}
    rng = np.random.default_rng(11)
    rates, second = ({n: float(x) for n, x in zip(names, rng.normal(size=6), strict=True)} for _ in range(2))

    def forces(order: int, name: str, step: float) -> Array:
        parts = [dict(base), dict(rates), dict(second)]
        parts[order][name] += step
        state = mech.state(*parts, guess=pose)
        return mech.inverse_dynamics(state.pose, state.twist, state.acceleration, WRENCH).forces

    state = mech.state(base, rates, second, guess=pose)
    by = mech.inverse_dynamics_derivatives(state.pose, state.twist, state.acceleration, WRENCH, set="pose")
    assert Status(int(by.status)) is Status.OK
    for order, part in enumerate(("coordinates", "rates", "second_rates")):
        exact = getattr(by, f"forces_by_{part}")
        for k, n in enumerate(names):
            difference = (forces(order, n, 1e-5) - forces(order, n, -1e-5)) / 2e-5
            assert abs(exact[:, k] - difference).max() < 1e-6 * max(abs(exact).max(), 1.0)


def test_derivatives_by_geometry_follow_the_line() -> None:
    """All joints of the rod moved so that they stay on a line: the sum of the columns has a meaning."""
    mech = MECHANISMS["tilted rod"]
    pose, twist, acceleration = (part[0] for part in motions(mech))
    by = mech.inverse_dynamics_derivatives(pose, twist, acceleration, WRENCH)
    points = np.array([leg["platform"]["point"] for leg in mech.geometry["legs"]])
    [idle] = mech.mobility().idle
    # The line turns: each joint moves by as much as it is far from a point of the line.
    move = np.outer((points - idle.point) @ idle.axis, [1.0, 0.4, -0.2])

    def at(step: float) -> Array:
        data = mech.to_dict()
        for leg, point in zip(data["legs"], points + step * move, strict=True):
            leg["platform"]["point"] = (1e3 * point).tolist()
        other = pp.Mechanism.from_dict(data)
        found = other.inverse_dynamics(pose, twist, acceleration, WRENCH)
        return found.forces

    columns = {n: k for k, n in enumerate(by.geometry)}
    exact = np.zeros(5)
    for i, row in enumerate(move):
        for axis, share in zip("xyz", row, strict=True):
            [k] = [k for n, k in columns.items() if n == f"leg {i + 1} platform point_{axis}"]
            exact += by.forces_by_geometry[:, k] * share
    difference = (at(1e-5) - at(-1e-5)) / 2e-5
    assert abs(mech.inverse_dynamics(pose, twist, acceleration, WRENCH).idle_torques[0]) > 0.1
    assert abs(exact - difference).max() < 1e-5 * abs(exact).max()


@each
def test_regressor_and_base_parameters(name: str) -> None:
    mech = MECHANISMS[name]
    motion = motions(mech)
    y, found = mech.regressor(*motion, WRENCH), mech.inverse_dynamics(*motion, WRENCH)
    assert abs(y.forces @ y.values + y.forces_offset - found.forces).max() < 1e-9 * abs(found.forces).max()
    base = mech.base_parameters()
    forces = y.forces[..., base.columns] @ base.values + y.forces_offset
    assert abs(forces - found.forces).max() < 1e-7 * abs(found.forces).max()


def test_lattices_and_computed_torque_are_refused() -> None:
    from polypod.solution.computed_torque import ComputedTorque

    mech = MECHANISMS["pentapod-5-ups"]
    with pytest.raises(UnsupportedError, match="spin"):
        pp.length_lattice(mech, step=0.1)
    with pytest.raises(UnsupportedError, match="local degree of freedom"):
        ComputedTorque(mech, None, frequency=10.0)  # type: ignore[arg-type]


def test_workspace_and_simulation_work() -> None:
    mech = MECHANISMS["pentapod-5-ups"]
    found = pp.workspace(mech, ["x", "y"], {"z": 0.52, "rx": 0.0, "ry": 0.0, "rz": 0.0}, step=0.04)
    assert found.mask.any()
    # A rod that spins goes on spinning: nothing brakes it.
    hold = mech.inverse_dynamics(mech.home, np.zeros(6), np.zeros(6)).forces
    twist = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 30.0])
    run = pp.simulate(mech, mech.home, twist, forces=hold, until=0.05, step=0.01)
    turned = run.dataset["twist"].to_numpy()
    assert abs(turned[:, 5] - 30.0).max() < 1e-6
    assert abs(turned[:, :3]).max() < 1e-6


@each
def test_the_twin_agrees(name: str) -> None:
    pytest.importorskip("pinocchio")
    from polypod.verify import verify_states

    mech = MECHANISMS[name]
    found = verify_states(mech, *motions(mech), WRENCH)
    comparison = found.comparisons[0]
    assert (comparison.compared, comparison.without_answer) == (STATES, {})
    assert found.agrees, {row.quantity: row.relative_max for row in comparison.rows}
    assert {"forces", "idle_torques"} <= {row.quantity for row in comparison.rows}
