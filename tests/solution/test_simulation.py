"""Simulations against what is known: straight lines, given motions, energy, events at known times."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from support import cases as t
from support import oracle as o

ON = 1e-10  # how well constraints are kept, m or 1
FOLLOWED = 1e-8  # a given motion over half a second, m and rad
TIMED = 1e-9  # events, s

REST = np.zeros(6)


def bare(name):
    """A mechanism with massless legs, without weight, load and damping: its platform moves as a free body."""
    content = pp.load(t.DATA / f"{name}.toml").to_dict()
    for leg in content["legs"]:
        leg.pop("piston", None), leg.pop("cylinder", None)
    for key in ("load", "dynamics"):
        content.pop(key, None)
    content["platform"] |= {"center": [0, 0, 0]}
    content["units"] |= {"acceleration": "m/s^2"}
    return pp.Mechanism.from_dict(content | {"dynamics": {"gravity": [0, 0, 0]}})


def sprung(mech, pose, stiffness):
    """Forces of springs that balance the weight at a pose, and the energy in them for given lengths."""
    free = mech.inverse_kinematics(pose).lengths
    hold = mech.inverse_dynamics(pose, REST, REST).forces

    def forces(time, pose, twist):
        return hold - stiffness * (mech.inverse_kinematics(pose).lengths - free)

    def energy(lengths):
        return np.sum(0.5 * stiffness * (lengths - free) ** 2 - hold * lengths, axis=-1)

    return forces, energy


def conservative(mech):
    """The mechanism without load, damping and efficiency."""
    content = mech.to_dict()
    for key in ("load", "dynamics"):
        content.pop(key, None)
    return pp.Mechanism.from_dict(content)


def total_energy(data, of_springs):
    return data.kinetic_energy.values + data.potential_energy.values + of_springs(data.length.values)


def constraint_errors(mech, spec, poses):
    """The oracle's closure equations of the joints, over the states."""
    return np.abs(o.residuals(spec, t.pair(poses)).x)


def swinging():
    """The 3-RPS on springs, in motion."""
    mech = conservative(pp.load(t.DATA / "3-rps.toml"))
    start = mech.state({"z": 0.5, "rx": 0.2, "ry": 0.0}, {"z": 0.1, "rx": 0.3, "ry": 1.0})
    return mech, start, *sprung(mech, mech.home, 2000.0)


# --- motions ------------------------------------------------------------------------------------------------


def test_a_free_platform_goes_straight_and_turns_evenly():
    mech = bare("stewart-gough")
    V = np.array([0.02, -0.03, 0.05, 0.0, 0.0, 0.4])
    data = pp.simulate(mech, mech.home, V, until=0.5, step=0.05, stop=()).dataset
    time = data.time.values
    assert np.allclose(data.pose.values[:, :3, 3], mech.home[:3, 3] + np.outer(time, V[:3]), atol=1e-12)
    turned = np.stack([o.turn(np.array([0.0, 0.0, 0.4 * s])) for s in time]) @ mech.home[:3, :3]
    assert np.allclose(data.pose.values[:, :3, :3], turned, atol=1e-12)
    assert np.allclose(data.twist.values, V, atol=1e-12)


@pytest.mark.parametrize("name", ["lu", "stewart-gough", "3-rps"])
def test_the_forces_of_a_motion_give_the_motion(name):
    mech = t.any_case(name).mech
    q, rates, second = t.motion_coordinates(name, n=1)
    small = {k: 0.3 * v for k, v in rates.items()}

    def state(time):
        return mech.state(*t.at_time(q, small, second, time))

    def forces(time, pose, twist):
        s = state(time)
        return mech.inverse_dynamics(s.pose, s.twist, s.acceleration).forces[0]

    start = state(0.0)
    found = pp.simulate(mech, start.pose[0], start.twist[0], forces=forces, until=0.25, step=0.05, stop=())
    data = found.dataset
    assert found.end["kind"] == "until"
    for k, time in enumerate(data.time.values):
        known = state(time)
        assert np.allclose(data.pose.values[k], known.pose[0], atol=FOLLOWED)
        assert np.allclose(data.twist.values[k], known.twist[0], atol=10 * FOLLOWED)
        assert np.allclose(data.acceleration.values[k], known.acceleration[0], atol=1e-4)


@pytest.mark.parametrize(
    "name", ["lu", "3-rps", "rod-lined", "rps-spr-upu", "passive", "rpr", "fpu", "3-upu"]
)
def test_motions_stay_on_the_constraints(name):
    c = t.any_case(name)
    springs, _ = sprung(c.mech, c.T[0], 3000.0)
    forces = springs if np.isfinite(springs(0, c.T[0], REST)).all() else None
    found = pp.simulate(c.mech, c.T[0], 0.3 * c.twist[0], forces=forces, until=0.3, step=0.02, stop=())
    data = found.dataset
    assert len(data.time) > 3
    assert constraint_errors(c.mech, c.spec, data.pose.values).max() < ON
    R = data.pose.values[:, :3, :3]
    assert np.allclose(R.swapaxes(1, 2) @ R, np.eye(3), atol=1e-13)
    rows = c.mech.jacobian(data.pose.values)[:, c.mech.dof :]
    assert np.abs(np.einsum("nij,nj->ni", rows, data.twist.values)).max(initial=0.0) < ON


def test_energy_drifts_at_the_order_of_the_integrator():
    """Fixed steps: the tolerance is too loose to matter."""
    mech, start, forces, of_springs = swinging()
    drifts = []
    steps = (0.04, 0.02, 0.01)
    for step in steps:
        data = pp.simulate(
            mech, start.pose, start.twist, forces=forces, until=4.0, step=step, tolerance=1.0, stop=()
        ).dataset
        energy = total_energy(data, of_springs)
        drifts.append(np.abs(energy - energy[0]).max())
        assert len(data.time) == round(4.0 / step) + 1
    slopes = np.diff(np.log(drifts)) / np.diff(np.log(steps))
    assert (slopes > 8.0).all(), slopes
    assert (slopes < 10.0).all(), slopes
    close = pp.simulate(mech, start.pose, start.twist, forces=forces, until=4.0, step=0.04, stop=()).dataset
    assert np.ptp(total_energy(close, of_springs)) < 1e-8


@pytest.mark.slow
def test_no_drift_over_a_hundred_thousand_steps():
    mech, start, forces, of_springs = swinging()
    steps, step = 100_000, 0.01
    spec = o.read(pp.load(t.DATA / "3-rps.toml").to_dict())
    found = pp.simulate(
        mech, start.pose, start.twist, forces=forces, until=steps * step, step=step, tolerance=1.0, stop=()
    )
    data = found.dataset
    assert (found.end["kind"], len(data.time)) == ("until", steps + 1)
    errors = constraint_errors(mech, spec, data.pose.values).max(axis=1)
    assert errors.max() < ON
    assert errors[-1000:].max() < 10 * max(errors[:1000].max(), 1e-15)
    energy = total_energy(data, of_springs)
    assert np.abs(energy - energy[0]).max() < 1e-7


# --- what drives them ---------------------------------------------------------------------------------------


def test_forces_and_loads_in_all_forms():
    mech, start, _, _ = swinging()
    hold = mech.inverse_dynamics(mech.home, REST, REST).forces
    load = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])

    def last(forces, wrench):
        found = pp.simulate(
            mech, start.pose, start.twist, forces=forces, wrench=wrench, until=0.1, step=0.05, stop=()
        )
        return found.dataset.isel(time=-1)

    constant = last(hold, load)
    table = last(([-1.0, 1.0], [hold, hold]), ([0.0, 1.0], [load, load]))
    law = last(lambda time, pose, twist: hold, lambda time, pose, twist: load)
    for other in (table, law):
        assert np.allclose(other.pose, constant.pose, atol=1e-14)
        assert np.array_equal(other.force, constant.force)
        assert np.array_equal(other.wrench, load)
    ramp = last(([0.0, 0.1], [0 * hold, 2 * hold]), load)
    rising = last(lambda time, pose, twist: 20 * time * hold, load)
    assert np.allclose(ramp.pose, rising.pose, atol=1e-12)
    assert np.allclose(ramp.force, 2 * hold)
    turned = pp.simulate(
        mech, start.pose, start.twist, wrench=load, wrench_axes="platform", until=0.1, step=0.1, stop=()
    ).dataset
    R = start.pose[:3, :3]
    same = mech.forward_dynamics(start.pose, start.twist, [0, 0, 0], [*(R @ load[:3]), *(R @ load[3:])])
    assert np.allclose(turned.acceleration[0], same.acceleration, atol=1e-12)


def test_the_result_is_a_solution(tmp_path):
    mech, start, forces, _ = swinging()
    seen = []
    found = pp.simulate(
        mech,
        start.pose,
        start.twist,
        forces=forces,
        until=0.1,
        step=0.03,
        progress=lambda *at: seen.append(at),
    )
    assert found.dataset.time.values.tolist() == [0.0, 0.03, 0.06, 0.09, 0.1]
    assert found.end == {"time": 0.1, "kind": "until", "reason": "the time is over"}
    assert seen[-1] == (0.1, 0.1)
    d = found.dataset
    again = mech.inverse_dynamics(d.pose.values, d.twist.values, d.acceleration.values)
    assert np.allclose(again.forces, d.force, rtol=1e-9, atol=1e-9)
    assert np.allclose(again.constraint, d.constraint, rtol=1e-9, atol=1e-9)
    assert (d.status == pp.Status.OK).all()
    for suffix in ("nc", "csv"):
        found.save(tmp_path / f"result.{suffix}")
        assert pp.load_solution(tmp_path / f"result.{suffix}") == found
    motion = pp.load_motion("lu-3spu-2rpu-r", pp.load("lu-3spu-2rpu-r")).sample([0.0, 0.1])
    assert pp.solve(pp.load("lu-3spu-2rpu-r"), motion).end is None


# --- what ends them -----------------------------------------------------------------------------------------


def test_the_end_of_a_stroke_at_its_time():
    mech = bare("stewart-gough")
    speed = 0.25
    found = pp.simulate(mech, mech.home, [0, 0, speed, 0, 0, 0], until=10.0, step=0.1)
    leg = mech.inverse_kinematics(mech.home).vectors[0]
    most = mech.stroke[0, 1]
    time = (np.sqrt(most**2 - leg[0] ** 2 - leg[1] ** 2) - leg[2]) / speed
    assert found.end["kind"] == "limit"
    assert found.end["reason"].startswith("stroke max of leg")
    assert found.end["time"] == pytest.approx(time, abs=TIMED)
    data = found.dataset
    assert data.time[-1] == found.end["time"]
    assert data.length[-1].max() == pytest.approx(most, abs=1e-9)
    assert len(data.time) == int(time / 0.1) + 2
    # From there it may go back, but no farther.
    at = data.isel(time=-1)
    assert pp.simulate(mech, at.pose, -at.twist, until=0.1, step=0.1).end["kind"] == "until"
    beyond = pp.simulate(mech, at.pose, at.twist, until=0.1, step=0.01).end
    assert (beyond["kind"], beyond["time"] < 1e-6) == ("limit", True)


def test_a_limit_passed_at_the_start():
    mech = bare("stewart-gough")
    high = mech.pose({"x": 0, "y": 0, "z": 1.4, "rx": 0, "ry": 0, "rz": 0})
    found = pp.simulate(mech, high, until=1.0, step=0.1)
    assert (found.end["time"], found.end["kind"], len(found.dataset.time)) == (0.0, "limit", 1)
    assert "at the start" in found.end["reason"]


def singular_turn(mech, V):
    """The time at which det J vanishes on the way with a constant twist of turning about z, by bisection."""

    def det(time):
        pose = mech.home.copy()
        pose[:3, :3] = o.turn(np.array([0.0, 0.0, V * time])) @ pose[:3, :3]
        return float(mech.determinant(pose).determinant)

    low, high = 0.0, 3.0 / V
    assert det(low) * det(high) < 0
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if det(middle) * det(0.0) > 0 else (low, middle)
    return low, det


def test_a_singular_pose_at_its_time():
    mech = bare("stewart-gough")
    time, _ = singular_turn(mech, 2.0)
    V = [0, 0, 0, 0, 0, 2.0]
    found = pp.simulate(mech, mech.home, V, until=3.0, step=0.1, stop=["singularity"])
    assert found.end["kind"] == "singularity"
    assert found.end["time"] == pytest.approx(time, abs=TIMED)
    assert found.dataset.sigma_min[-1] < 1e-8
    passing = pp.simulate(mech, mech.home, V, until=time + 0.2, step=0.1, stop=())
    assert passing.end["kind"] == "until"
    assert np.allclose(passing.dataset.twist, V, atol=1e-9)
    assert passing.singularities["crossings"][0]["time"] == pytest.approx(time, abs=1e-3)


def test_a_floor_of_conditioning():
    mech = bare("stewart-gough")
    floor = 0.5 * float(mech.conditioning(mech.home).sigma_min)
    found = pp.simulate(mech, mech.home, [0, 0, 0, 0, 0, 2.0], until=3.0, step=0.1, stop=(), sigma_min=floor)
    assert found.end["kind"] == "conditioning"
    assert found.dataset.sigma_min[-1] == pytest.approx(floor, abs=1e-10)
    assert (found.dataset.sigma_min[:-1] > floor).all()


def test_a_limit_of_forces():
    """The force that drives it counts, also where it jumps."""
    content = bare("stewart-gough").to_dict()
    for leg in content["legs"]:
        leg["force"] = {"min": -50, "max": 50}
    mech = pp.Mechanism.from_dict(content)

    def forces(time, pose, twist):
        return np.full(6, 20.0 if time < 0.0123 else 60.0)

    end = pp.simulate(mech, mech.home, forces=forces, until=1.0, step=0.01).end
    assert end["kind"] == "limit"
    assert end["reason"].startswith("force max of leg")
    assert end["time"] == pytest.approx(0.0123, abs=1e-6)


def test_a_law_without_answer_ends_it():
    mech, start, forces, _ = swinging()

    def broken(time, pose, twist):
        return forces(time, pose, twist) if time < 0.05 else np.full(3, np.nan)

    found = pp.simulate(mech, start.pose, start.twist, forces=broken, until=1.0, step=0.01)
    assert found.end["kind"] == "no answer"
    assert found.end["time"] == pytest.approx(0.05, abs=1e-6)


def test_wrong_calls():
    mech, start, _, _ = swinging()
    more = {"until": 1.0, "step": 0.1}
    off = start.pose.copy()
    off[0, 3] += 0.01
    with pytest.raises(pp.PolypodError, match="breaks a constraint"):
        pp.simulate(mech, off, **more)
    with pytest.raises(pp.ShapeError, match=r"forces has the shape \(2,\); needs \(3,\)"):
        pp.simulate(mech, start.pose, forces=[1, 2], **more)
    with pytest.raises(pp.ShapeError, match=r"forces at 0 s has the shape \(\); needs \(3,\)"):
        pp.simulate(mech, start.pose, forces=lambda time, pose, twist: 0.0, **more)
    with pytest.raises(pp.ShapeError, match=r"pose has the shape \(1, 4, 4\)"):
        pp.simulate(mech, start.pose[None], **more)
    with pytest.raises(pp.PolypodError, match="times must increase"):
        pp.simulate(mech, start.pose, forces=([0.0, 0.0], np.zeros((2, 3))), **more)
    with pytest.raises(pp.PolypodError, match="step is 0"):
        pp.simulate(mech, start.pose, until=1.0, step=0)
    with pytest.raises(pp.UnknownNameError, match="limits"):
        pp.simulate(mech, start.pose, stop=["limit"], **more)
    with pytest.raises(pp.UnknownNameError, match="platform"):
        pp.simulate(mech, start.pose, wrench_axes="tool", **more)
