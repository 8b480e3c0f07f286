"""Redundant actuation: least forces, legs that must agree, against numpy's own solutions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import null_space

import polypod as pp
from polypod import SingularityKind, Status
from polypod.errors import UnsupportedError

Array = NDArray[np.float64]

ROUNDING = 1e-11
"""Relative, of forces at well-conditioned poses."""
DIFFERENCE = 1e-6
"""Relative, of central differences."""
STEP = 1e-5
STATES = 5
WRENCH = np.array([80.0, -60.0, -150.0, 6.0, -4.0, 5.0])


def seven_legs() -> pp.Mechanism:
    """A hexapod with a seventh leg to the middle of its platform, and a passive leg with mass."""
    data = pp.load("ups-hexapod").to_dict()
    extra = {
        "base": {"joint": "U", "point": [0.2, -0.4, 0.1], "axis": [1.0, 0.4, 0.0]},
        "platform": {"joint": "S", "point": [0.1, 0.2, -0.1]},
        "cylinder": data["legs"][0]["cylinder"],
        "piston": data["legs"][0]["piston"],
    }
    passive = extra | {"actuated": False, "platform": {"joint": "S", "point": [-0.3, 0.1, 0.2]}}
    legs = [*data["legs"][:3], passive, *data["legs"][3:], extra]
    data["name"], data["legs"] = "7-ups", legs
    data["dynamics"] = {"efficiency": 0.8, "linear_damping": 40.0, "angular_damping": 3.0}
    return pp.Mechanism.from_dict(data)


def six_on_a_rod() -> pp.Mechanism:
    """Redundant in five degrees of freedom, and idle in the sixth."""
    data = pp.load("pentapod-5-ups").to_dict()
    leg = dict(data["legs"][0])
    leg["base"] = {"joint": "U", "point": {"radius": 300, "angle": 50, "z": -80}, "axis": {"angle": 140}}
    leg["platform"] = {"joint": "S", "point": [0, 0, 90]}
    data["name"], data["legs"] = "6-ups on a rod", [*data["legs"], leg]
    return pp.Mechanism.from_dict(data)


MECHANISMS = {
    "4-rpr": pp.load("4-rpr"),
    "4ups-up": pp.load("4ups-up"),
    "7-ups": seven_legs(),
    "6-on-rod": six_on_a_rod(),
}
each = pytest.mark.parametrize("name", MECHANISMS)


def motions(mech: pp.Mechanism, count: int = STATES, seed: int = 7) -> tuple[Array, Array, Array]:
    """Random motions about home that keep the constraints, at well-conditioned poses."""
    rng = np.random.default_rng([seed, *mech.name.encode()])
    names = mech.equations_of_motion(mech.home, np.zeros(6), "pose").coordinates
    home = mech.coordinates(mech.home, "pose")
    size = {n: mech.characteristic_length if n in "xyz" else 1.0 for n in names}

    def draw(spread: float) -> dict[str, Array]:
        return {n: spread * size[n] * rng.uniform(-1, 1, 20 * count) for n in names}

    off, rates, second = draw(0.2), draw(1.0), draw(5.0)
    state = mech.state({n: home[n] + off[n] for n in names}, rates, second)
    usable = (state.status == Status.OK) & (mech.conditioning(state.pose).sigma_min > 0.05)
    usable &= mech.limits(state.pose).within
    chosen = np.flatnonzero(usable)[:count]
    assert len(chosen) == count
    return state.pose[chosen], state.twist[chosen], state.acceleration[chosen]


def rows(mech: pp.Mechanism, pose: Array) -> tuple[Array, Array]:
    """Rows of legs and the others, for twists with rotations counted as arcs."""
    J, k = mech.jacobian(pose).copy(), int(mech.actuated.sum())
    J[..., 3:] /= mech.characteristic_length
    return J[:k], J[k:]


def asked(mech: pp.Mechanism, pose: Array, twist: Array, acceleration: Array, wrench: Array) -> Array:
    """The wrench (6,) that J^T must give, torques by the characteristic length: of the equation of motion."""
    terms = mech.equations_of_motion(pose, twist)
    load = terms.mass @ acceleration + (terms.coriolis + terms.damping) @ twist + terms.gravity
    load -= wrench / mech.geometry["efficiency"]
    return load / np.repeat([1.0, mech.characteristic_length], 3)


def least(A: Array, C: Array, w: Array, near: Array) -> tuple[Array, Array]:
    """Forces nearest to `near` and multipliers with A^T f + C^T m = w, by pseudo-inverses of numpy."""
    free = null_space(C) if len(C) else np.eye(6)
    on_free = A @ free
    f = near + np.linalg.pinv(on_free.T) @ (free.T @ w - on_free.T @ near)
    return f, np.linalg.lstsq(C.T, w - A.T @ f, rcond=None)[0] if len(C) else np.zeros(0)


# --- J and forces -------------------------------------------------------------------------------------------


@each
def test_jacobian_and_hessian_have_a_row_for_every_leg(name: str) -> None:
    mech = MECHANISMS[name]
    pose, twist, acceleration = motions(mech)
    k, constraints, idle = int(mech.actuated.sum()), 6 - mech.dof, len(mech.mobility().idle)
    assert mech.redundantly_actuated
    assert mech.n_rows == k + idle + constraints > 6
    J, H = mech.jacobian(pose), mech.hessian(pose)
    assert (J.shape, H.shape) == ((STATES, mech.n_rows, 6), (STATES, mech.n_rows, 6, 6))
    motion = mech.kinematics(pose, twist, acceleration)
    rates = np.einsum("nij,nj->ni", J, twist)
    second = np.einsum("nij,nj->ni", J, acceleration) + np.einsum("nijk,nj,nk->ni", H, twist, twist)
    assert rates[:, :k] == pytest.approx(motion.rates[:, mech.actuated], rel=1e-11, abs=1e-12)
    assert second[:, :k] == pytest.approx(motion.accelerations[:, mech.actuated], rel=1e-11, abs=1e-11)
    assert abs(rates[:, k + idle :]).max(initial=0.0) < 1e-11
    assert abs(second[:, k + idle :]).max(initial=0.0) < 1e-10


@each
@pytest.mark.parametrize("tightened", [False, True])
def test_forces_are_the_least_or_nearest_that_balance(name: str, tightened: bool) -> None:
    mech, rng = MECHANISMS[name], np.random.default_rng(3)
    motion = motions(mech)
    near = rng.normal(size=mech.n_legs) * 200.0 if tightened else np.zeros(mech.n_legs)
    found = mech.inverse_dynamics(*motion, WRENCH, preferred=near if tightened else None)
    assert set(found.status.tolist()) == {Status.OK}
    idle = len(mech.mobility().idle)
    scale = np.concatenate([np.full(idle, mech.characteristic_length), np.ones(6 - mech.dof)])
    for i in range(STATES):
        A, C = rows(mech, motion[0][i])
        w = asked(mech, *(part[i] for part in motion), WRENCH)
        f, m = least(A, C * scale[:, None], w, near[mech.actuated])
        size = abs(f).max()
        assert abs(found.forces[i, mech.actuated] - f).max() < 1e-9 * size
        assert (found.forces[i, ~mech.actuated] == 0.0).all()
        others = np.concatenate([found.idle_torques[i], found.constraint[i]])
        assert abs(others - m * scale).max(initial=0.0) < 1e-8 * size
        # It is no compromise: all of the wrench is balanced.
        assert abs(A.T @ found.forces[i, mech.actuated] + C.T @ others - w).max() < ROUNDING * size * 10


@each
def test_preferred_forces_that_balance_come_back(name: str) -> None:
    mech, rng = MECHANISMS[name], np.random.default_rng(5)
    motion = motions(mech)
    least = mech.inverse_dynamics(*motion, WRENCH).forces
    A = [null_space(rows(mech, pose)[0].T) for pose in motion[0]]
    tight = least.copy()
    for i, stress in enumerate(A):
        tight[i, mech.actuated] += stress @ rng.normal(size=stress.shape[1]) * 500.0
    found = mech.inverse_dynamics(*motion, WRENCH, preferred=tight)
    assert abs(found.forces - tight).max() < ROUNDING * abs(tight).max() * 10
    assert (np.linalg.norm(least, axis=1) <= np.linalg.norm(tight, axis=1)).all()


def test_preferred_forces_do_nothing_where_forces_are_determined() -> None:
    mech = pp.load("tricept")
    motion = (mech.home, np.zeros(6), np.zeros(6))
    plain = mech.inverse_dynamics(*motion)
    assert (mech.inverse_dynamics(*motion, preferred=np.full(4, 1e3)).forces == plain.forces).all()


def test_preferred_forces_broadcast_and_are_checked() -> None:
    mech = MECHANISMS["4-rpr"]
    pose, twist, acceleration = motions(mech)
    near = np.array([10.0, -20.0, 30.0, 5.0])
    many = mech.inverse_dynamics(pose, twist, acceleration, preferred=near).forces
    one = mech.inverse_dynamics(pose[1], twist[1], acceleration[1], preferred=near).forces
    assert (many[1] == one).all()
    with pytest.raises(pp.ShapeError, match="preferred"):
        mech.inverse_dynamics(pose, twist, acceleration, preferred=near[:3])
    bad = mech.inverse_dynamics(mech.home, np.zeros(6), np.zeros(6), preferred=[np.nan] * 4)
    assert Status(int(bad.status)) is Status.INVALID_INPUT


@each
def test_forward_dynamics_returns(name: str) -> None:
    mech = MECHANISMS[name]
    if mech.mobility().idle:
        pytest.skip("the torque of a local degree of freedom is none of a leg: see test_idle")
    pose, twist, acceleration = motions(mech)
    near = np.linspace(-100.0, 100.0, mech.n_legs)
    for preferred in (None, near):
        forces = mech.inverse_dynamics(pose, twist, acceleration, WRENCH, preferred=preferred).forces
        found = mech.forward_dynamics(pose, twist, forces, WRENCH)
        assert set(found.status.tolist()) == {Status.OK}
        assert abs(found.acceleration - acceleration).max() < 1e-9 * abs(acceleration).max()


@each
def test_power_balances(name: str) -> None:
    mech = MECHANISMS[name]
    motion = motions(mech)
    power = mech.power(*motion, WRENCH)
    dynamics = mech.inverse_dynamics(*motion, WRENCH)
    rates = mech.kinematics(*motion).rates
    size = abs(power.actuators).max()
    assert abs(power.residual).max() < 1e-10 * max(size, abs(power.load).max())
    if not mech.mobility().idle:
        assert power.actuators == pytest.approx((dynamics.forces * rates).sum(axis=1), rel=1e-10)


# --- motion from legs ---------------------------------------------------------------------------------------


@each
def test_legs_that_agree_give_the_motion(name: str) -> None:
    mech = MECHANISMS[name]
    pose, twist, acceleration = motions(mech)
    if idle := mech.mobility().idle:
        # No leg tells of the spin, and none is taken.
        along = np.einsum("nij,j->ni", pose[:, :3, :3], idle[0].axis)
        spin = np.concatenate([np.zeros_like(along), along], axis=1)  # the line goes through o
        twist = twist - spin * (twist[:, 3:] * along).sum(axis=1)[:, None]
        acceleration = acceleration - spin * (acceleration[:, 3:] * along).sum(axis=1)[:, None]
    motion = mech.kinematics(pose, twist, acceleration)
    found = mech.platform_twist(pose, motion.rates)
    second = mech.platform_acceleration(pose, twist, motion.accelerations)
    assert set(found.status.tolist()) == set(second.status.tolist()) == {Status.OK}
    assert abs(found.twist - twist).max() < 1e-10 * abs(twist).max()
    assert abs(second.acceleration - acceleration).max() < 1e-10 * abs(acceleration).max()


@each
def test_legs_that_contradict_one_another_give_none(name: str) -> None:
    mech = MECHANISMS[name]
    pose, twist, acceleration = motions(mech)
    motion = mech.kinematics(pose, twist, acceleration)
    first = int(np.flatnonzero(mech.actuated)[0])
    rates, second = motion.rates.copy(), motion.accelerations.copy()
    rates[:, first] += 1e-3 * abs(rates).max()
    second[:, first] += 1e-2 * abs(second).max()
    for found, numbers in (
        (mech.platform_twist(pose, rates), "twist"),
        (mech.platform_acceleration(pose, twist, second), "acceleration"),
    ):
        assert set(found.status.tolist()) == {Status.INCONSISTENT}
        assert np.isnan(getattr(found, numbers)).all()


# --- forward kinematics -------------------------------------------------------------------------------------


@each
def test_forward_kinematics_meets_all_lengths_or_says_so(name: str) -> None:
    mech = MECHANISMS[name]
    pose, *_ = motions(mech)
    lengths = mech.inverse_kinematics(pose).lengths
    found = mech.forward_kinematics(lengths)
    assert set(found.status.tolist()) == {Status.OK}
    back = mech.inverse_kinematics(found.pose).lengths
    assert abs(back - lengths)[:, mech.actuated].max() < 1e-12 * lengths.max()
    if not mech.mobility().idle:
        assert abs(found.pose - pose).max() < 1e-9 * max(1.0, mech.characteristic_length)
    wrong = lengths.copy()
    wrong[:, np.flatnonzero(mech.actuated)[0]] += 0.01 * mech.characteristic_length
    lost = mech.forward_kinematics(wrong)
    assert set(lost.status.tolist()) == {Status.INCONSISTENT}
    assert np.isnan(lost.pose).all()
    assert (lost.residual > 1e-5 * mech.characteristic_length).all()
    along = mech.forward_kinematics(lengths, continued=True)
    assert set(along.status.tolist()) == {Status.OK}
    assert Status(int(mech.forward_kinematics(-lengths[0]).status)) is Status.INVALID_INPUT


def test_lengths_that_agree_to_a_micrometre_have_a_pose() -> None:
    mech = MECHANISMS["7-ups"]
    pose, *_ = motions(mech)
    lengths = mech.inverse_kinematics(pose).lengths
    near = lengths + 2e-7 * mech.characteristic_length * np.array([1, -1, 1, 0, 1, -1, 1, -1])
    found = mech.forward_kinematics(near)
    assert set(found.status.tolist()) == {Status.OK}
    assert (found.residual < 1e-6 * mech.characteristic_length).all()
    # The nearest pose in the sense of least squares: what is missed is perpendicular to every motion.
    for i in range(STATES):
        A, _ = rows(mech, found.pose[i])
        missed = (mech.inverse_kinematics(found.pose[i]).lengths - near[i])[mech.actuated]
        assert abs(A.T @ missed).max() < 1e-3 * abs(missed).max()


@pytest.mark.parametrize("name", ["4-rpr", "4ups-up", "7-ups"])
def test_assembly_modes_meet_all_lengths(name: str) -> None:
    mech = MECHANISMS[name]
    pose, *_ = motions(mech)
    lengths = mech.inverse_kinematics(pose[0]).lengths
    modes = mech.assembly_modes(lengths)
    assert Status(int(modes.status)) is Status.OK
    assert np.sum(abs(modes.pose - pose[0]).max(axis=(1, 2)) < 1e-9) == 1
    meant = modes.pose[modes.mode_status != Status.BACKWARDS]
    back = mech.inverse_kinematics(meant).lengths
    assert abs(back - lengths)[:, mech.actuated].max() < 1e-11 * lengths.max()
    lengths[np.flatnonzero(mech.actuated)[-1]] += 0.02 * mech.characteristic_length
    none = mech.assembly_modes(lengths)
    assert (int(none.number), Status(int(none.status))) == (0, Status.INCONSISTENT)


# --- singularities ------------------------------------------------------------------------------------------


def test_singular_poses_of_a_subset_are_passed() -> None:
    """Where three legs alone lose control, the fourth holds the platform."""
    mech = MECHANISMS["4-rpr"]
    data = mech.to_dict()
    data["legs"][3]["actuated"] = False
    three = pp.Mechanism.from_dict(data)
    turn = np.linspace(-1.2, 1.2, 2001)
    poses = mech.pose({"x": 0.02, "y": 0.01, "rz": turn})
    det = three.determinant(poses).determinant
    k = int(np.flatnonzero(np.diff(np.sign(det)))[0])
    low, high = turn[k], turn[k + 1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        at = float(three.determinant(mech.pose({"x": 0.02, "y": 0.01, "rz": middle})).determinant)
        low, high = (middle, high) if at * det[k] > 0 else (low, middle)
    pose = mech.pose({"x": 0.02, "y": 0.01, "rz": low})
    still = (pose, np.zeros(6), np.zeros(6), WRENCH)
    assert SingularityKind(int(three.singularity(pose).kind)) is SingularityKind.ACTUATION
    assert SingularityKind(int(mech.singularity(pose).kind)) is SingularityKind.NONE
    assert Status(int(mech.inverse_dynamics(*still).status)) is Status.OK
    assert abs(mech.inverse_dynamics(*still).forces).max() < 1e4
    assert float(mech.conditioning(pose).sigma_min) > 0.02
    assert float(mech.determinant(pose).determinant) > 0.0


def test_singular_where_the_whole_loses_its_rank() -> None:
    """All four legs through one point: nothing holds the rotation about it."""
    data = MECHANISMS["4-rpr"].to_dict()
    for leg in data["legs"]:
        leg["platform"]["point"]["angle"] = leg["base"]["point"]["angle"]
    mech = pp.Mechanism.from_dict(data)
    assert mech.mobility().uncontrolled == 0
    still = (mech.home, np.zeros(6), np.zeros(6))
    found = mech.singularity(mech.home)
    assert SingularityKind(int(found.kind)) is SingularityKind.ACTUATION
    assert int(found.uncontrolled) == 1
    assert found.twist[5] != 0.0
    dynamics = mech.inverse_dynamics(*still)
    assert Status(int(dynamics.status)) is Status.SINGULAR
    assert np.isnan(dynamics.forces).all()
    assert Status(int(mech.platform_twist(mech.home, np.zeros(4)).status)) is Status.SINGULAR
    assert Status(int(mech.joint_reactions(*still).status)) is Status.SINGULAR
    det = mech.determinant(mech.pose({"x": 0.0, "y": 0.0, "rz": [-0.1, 0.0, 0.1]}))
    assert det.determinant[1] == 0.0
    assert (det.determinant[[0, 2]] > 0.0).all()
    lengths = mech.inverse_kinematics(mech.home).lengths
    assert Status(int(mech.forward_kinematics(lengths).status)) is Status.SINGULAR


@each
def test_determinant_is_that_of_the_square(name: str) -> None:
    mech = MECHANISMS[name]
    pose, twist, _ = motions(mech)
    found = mech.determinant(pose, twist)
    scale, length = mech.characteristic_length, np.repeat([1.0, mech.characteristic_length], 3)
    kinds = [
        kind
        for i, (_, kind) in enumerate(mech.mobility().constraint_rows)
        if i in mech.mobility().independent_rows
    ]
    idle = len(mech.mobility().idle)
    unit = np.array(
        [1.0] * int(mech.actuated.sum()) + [scale] * idle + [scale if k == "D" else 1.0 for k in kinds]
    )
    J = mech.jacobian(pose) / length * unit[:, None]
    expected = np.linalg.det(np.swapaxes(J, 1, 2) @ J)
    assert found.determinant == pytest.approx(expected, rel=1e-10)
    step = 1e-6
    ahead = np.array(
        [mech.determinant(_moved(p, v * step)).determinant for p, v in zip(pose, twist, strict=True)]
    )
    behind = np.array(
        [mech.determinant(_moved(p, -v * step)).determinant for p, v in zip(pose, twist, strict=True)]
    )
    assert found.rate == pytest.approx(
        (ahead - behind) / (2 * step), rel=1e-5, abs=1e-6 * abs(found.rate).max()
    )


def _moved(pose: Array, step: Array) -> Array:
    from scipy.spatial.transform import Rotation

    moved = pose.copy()
    moved[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ pose[:3, :3]
    moved[:3, 3] += step[:3]
    return moved


# --- derivatives, regressor, reactions, limits --------------------------------------------------------------


@each
def test_derivatives_are_those_of_differences(name: str) -> None:
    mech = MECHANISMS[name]
    names = mech.equations_of_motion(mech.home, np.zeros(6), "pose").coordinates
    pose, twist, acceleration = (part[0] for part in motions(mech))
    by = mech.inverse_dynamics_derivatives(pose, twist, acceleration, WRENCH, coordinates=names)
    assert Status(int(by.status)) is Status.OK
    q = mech.coordinates(pose, "pose")
    base = {n: float(q[n]) for n in names}
    rng = np.random.default_rng(11)
    rates, second = (
        {n: float(x) for n, x in zip(names, rng.normal(size=len(names)), strict=True)} for _ in range(2)
    )

    def forces(order: int, name: str, step: float) -> Array:
        parts = [dict(base), dict(rates), dict(second)]
        parts[order][name] += step
        state = mech.state(*parts, guess=pose)
        found = mech.inverse_dynamics(state.pose, state.twist, state.acceleration, WRENCH)
        return found.forces

    state = mech.state(base, rates, second, guess=pose)
    by = mech.inverse_dynamics_derivatives(
        state.pose, state.twist, state.acceleration, WRENCH, coordinates=names
    )
    for order, part in enumerate(("coordinates", "rates", "second_rates")):
        exact = getattr(by, f"forces_by_{part}")
        for k, n in enumerate(names):
            difference = (forces(order, n, STEP) - forces(order, n, -STEP)) / (2 * STEP)
            assert abs(exact[:, k] - difference).max() < DIFFERENCE * max(abs(exact).max(), 1.0)


@pytest.mark.parametrize("name", ["4ups-up", "7-ups", "6-on-rod"])
def test_derivatives_by_geometry_are_those_of_differences(name: str) -> None:
    """Of numbers that may change alone: base joints of legs without constraints, and bodies."""
    mech = MECHANISMS[name]
    pose, twist, acceleration = (part[0] for part in motions(mech))
    by = mech.inverse_dynamics_derivatives(pose, twist, acceleration, WRENCH)
    data = mech.geometry
    leg = 1
    file = mech.to_dict()
    unit = 1e-3 if file["units"]["length"] == "mm" else 1.0
    point = np.array(data["legs"][leg]["base"]["point"])

    def forces(component: int, step: float) -> Array:
        changed = mech.to_dict()
        moved = point.copy()
        moved[component] += step
        changed["legs"][leg]["base"]["point"] = (moved / unit).tolist()
        other = pp.Mechanism.from_dict(changed)
        return other.inverse_dynamics(pose, twist, acceleration, WRENCH).forces

    for component, axis in enumerate("xyz"):
        [k] = [
            k
            for k, n in enumerate(by.geometry)
            if n == f"leg {file['legs'][leg].get('name', leg + 1)} base point_{axis}"
        ]
        difference = (forces(component, STEP) - forces(component, -STEP)) / (2 * STEP)
        exact = by.forces_by_geometry[:, k]
        assert abs(exact - difference).max() < 1e-5 * max(abs(exact).max(), 1.0)


@each
def test_regressor_gives_the_least_forces(name: str) -> None:
    mech = MECHANISMS[name]
    motion = motions(mech)
    y = mech.regressor(*motion, WRENCH)
    found = mech.inverse_dynamics(*motion, WRENCH)
    assert abs(y.forces @ y.values + y.forces_offset - found.forces).max() < 1e-9 * abs(found.forces).max()
    assert y.constraint @ y.values + y.constraint_offset == pytest.approx(
        found.constraint, abs=1e-8 * abs(found.forces).max()
    )


def test_base_parameters_of_redundant_ones() -> None:
    mech = MECHANISMS["4-rpr"]
    base = mech.base_parameters()
    motion = motions(mech)
    y = mech.regressor(*motion)
    forces = y.forces[..., base.columns] @ base.values + y.forces_offset
    assert abs(forces - mech.inverse_dynamics(*motion).forces).max() < 1e-8 * abs(forces).max()


@each
def test_reactions_balance_and_carry_the_least_forces(name: str) -> None:
    mech = MECHANISMS[name]
    motion = motions(mech)
    found = mech.joint_reactions(*motion, WRENCH)
    assert set(found.status.tolist()) == {Status.OK}
    dynamics = mech.inverse_dynamics(*motion, WRENCH)
    directions = mech.inverse_kinematics(motion[0]).directions
    rods = len(mech.rod_names)
    slides = found.reactions[:, rods + 1 :: 3, :3]
    along = (slides * directions).sum(axis=-1)
    assert abs(along - dynamics.forces).max() < 1e-9 * abs(dynamics.forces).max()
    # On the platform: all platform joints, the load, weight and inertia.
    points, above = found.points[:, rods + 2 :: 3], found.reactions[:, rods + 2 :: 3]
    sum_ = above.sum(axis=1)
    sum_[:, 3:] += np.cross(points - motion[0][:, None, :3, 3], above[..., :3]).sum(axis=1)
    for i in range(STATES):
        own = _platform_wrench(mech, *(part[i] for part in motion)) + WRENCH
        left = sum_[i] + own / mech.geometry["efficiency"]
        if idle := mech.mobility().idle:
            left[3:] += motion[0][i, :3, :3] @ idle[0].axis * dynamics.idle_torques[i, 0]
        assert abs(left).max() < 1e-8 * abs(dynamics.forces).max()


def _platform_wrench(mech: pp.Mechanism, pose: Array, twist: Array, acceleration: Array) -> Array:
    """Weight, inertia and damping of the platform at o, written anew."""
    facts = mech.geometry
    body, R = facts["platform"], pose[:3, :3]
    c, inertia = R @ body["center"], R @ np.array(body["inertia"]) @ R.T
    w, eps = twist[3:], acceleration[3:]
    a = acceleration[:3] + np.cross(eps, c) + np.cross(w, np.cross(w, c))
    force = body["mass"] * (np.array(facts["gravity"]) - a)
    torque = np.cross(c, force) - inertia @ eps - np.cross(w, inertia @ w)
    force = force - facts["linear_damping"] * twist[:3]
    return np.concatenate([force, torque - facts["angular_damping"] * w])


def test_limits_of_forces_hold_for_the_least_ones() -> None:
    data = MECHANISMS["4ups-up"].to_dict()
    for leg in data["legs"][:4]:
        leg["force"] = {"min": -100, "max": 400}
    mech = pp.Mechanism.from_dict(data)
    pose = motions(MECHANISMS["4ups-up"])[0]
    forces = mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6)).forces[:, :4]
    margins = mech.limits(pose).margins
    of_force = [k for k, limit in enumerate(mech.limit_list) if limit.unit == "N"]
    slack = np.stack([forces + 100.0, 400.0 - forces], axis=-1).reshape(STATES, -1)
    assert margins[:, of_force] == pytest.approx(slack, abs=1e-8)


# --- what cannot be, and what can ---------------------------------------------------------------------------


def test_a_lattice_of_lengths_is_refused() -> None:
    with pytest.raises(UnsupportedError, match="contradict one another"):
        pp.length_lattice(MECHANISMS["4ups-up"], step=0.1)


def test_computed_torque_is_refused() -> None:
    mech = MECHANISMS["4-rpr"]
    from polypod.solution.computed_torque import ComputedTorque

    with pytest.raises(UnsupportedError, match="redundant legs"):
        ComputedTorque(mech, None, frequency=10.0)  # type: ignore[arg-type]


def test_workspaces_of_poses_work() -> None:
    mech = MECHANISMS["4-rpr"]
    found = pp.workspace(mech, ["x", "y"], {"rz": 0.0}, step=0.01, keep_aspect=True)
    assert found.mask.any()
    reach = pp.workspace(MECHANISMS["4ups-up"], step=0.08)
    assert reach.volume > 0.0


def test_simulation_and_solution_run() -> None:
    mech = MECHANISMS["4ups-up"]
    hold = mech.inverse_dynamics(mech.home, np.zeros(6), np.zeros(6)).forces
    rest = pp.simulate(mech, mech.home, forces=hold, until=0.05, step=0.01)
    assert abs(rest.dataset["twist"].to_numpy()).max() < 1e-6
    assert rest.end["kind"] == "until"


def test_info_of_redundant_ones(run) -> None:
    status, out, err = run("info", "4ups-up")
    assert (status, err) == (0, "")
    assert "more actuators than it takes" in " ".join(out.replace("│", " ").split())
