"""Computed torque: errors decay as the theory says, and what wrong masses leave."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp
from support import DATA


def scaled(mech, factor):
    """The mechanism with all masses and inertias times a factor."""
    content = mech.to_dict()
    bodies = [content["platform"], *content.get("rods", ())]
    bodies += [leg[part] for leg in content["legs"] for part in ("cylinder", "piston") if part in leg]
    for body in bodies:
        body["mass"] *= factor
        body["inertia"] = (factor * np.array(body["inertia"])).tolist()
    return pp.Mechanism.from_dict(content)


@pytest.fixture(scope="module")
def published():
    mech = pp.load("lu-3spu-2rpu-r")
    motion = pp.load_motion("lu-3spu-2rpu-r", mech)
    first = mech.pose({name: values[0] for name, values in motion.coordinates.items()}, branch=motion.branch)
    beside = mech.coordinates(first, "natural")
    start = mech.pose({**beside, "p": beside["p"] + 0.01, "alpha": beside["alpha"] + np.radians(1)})
    return mech, motion, start


def errors(law, run):
    """Lengths wanted less lengths, (time, n)."""
    data = run.dataset
    return np.stack([law.desired(time).lengths for time in data.time.values]) - data.length.values


@pytest.mark.parametrize("damping", [1.0, 0.5])
def test_with_true_masses_errors_are_damped_oscillations(published, damping):
    mech, motion, start = published
    law = pp.ComputedTorque(mech, motion, frequency=20.0, damping=damping)
    run = pp.simulate(mech, start, forces=law, until=0.3, step=0.02)
    found, time = errors(law, run), run.dataset.time.values
    rate = -law.damping * 20.0
    # From the error at the start, at rest but for the motion's own first rates, which are zero.
    if damping == 1.0:
        decay = np.exp(rate * time) * (1 - rate * time)
    else:
        w = 20.0 * np.sqrt(1 - damping**2)
        decay = np.exp(rate * time) * (np.cos(w * time) - rate / w * np.sin(w * time))
    assert np.allclose(found, decay[:, None] * found[0], atol=1e-9)
    assert np.abs(found[0]).max() > 5e-3


def test_what_wrong_masses_leave_shrinks_with_the_gain(published):
    mech, motion, start = published
    left = []
    for frequency in (20.0, 40.0):
        law = pp.ComputedTorque(scaled(mech, 1.2), motion, frequency=frequency)
        run = pp.simulate(mech, start, forces=law, until=0.8, step=0.2, tolerance=1e-7)
        assert run.end["kind"] == "until"
        left.append(np.abs(errors(law, run)[-1]).max())
    assert 1e-4 < left[0] < 1e-2
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.2)


def test_before_and_after_the_motion_it_holds_still():
    mech = pp.load(DATA / "3-rps.toml")
    time = np.linspace(1.0, 2.0, 11)
    q = {"z": 0.5 + 0.01 * time, "rx": 0.1 * time, "ry": 0.0 * time}
    load = np.tile([0.0, 0.0, -30.0, 0.0, 0.0, 0.0], (11, 1))
    motion = pp.Motion.through(time, q, set="pose", wrench=load, wrench_axes="platform")
    law = pp.ComputedTorque(mech, motion, frequency=10.0)
    for at, k in ((0.0, 0), (3.0, -1)):
        wanted = law.desired(at)
        pose = mech.pose({name: values[k] for name, values in q.items()})
        assert np.allclose(wanted.lengths, mech.inverse_kinematics(pose).lengths)
        assert np.array_equal(wanted.rates, np.zeros(3))
        still = mech.inverse_dynamics(pose, np.zeros(6), np.zeros(6), load[0], "platform").forces
        assert np.allclose(law(at, pose, np.zeros(6)), still)
    assert np.abs(law.desired(1.5).rates).max() > 0


def test_passive_legs_are_left_alone():
    content = pp.load(DATA / "stewart-gough.toml").to_dict()
    first, second = content["legs"][:2]
    content["legs"].append(first | {"base": second["base"], "actuated": False, "name": "guide"})
    mech = pp.Mechanism.from_dict(content)
    time = np.linspace(0.0, 1.0, 11)
    x, y, z, rx, ry, rz = mech.coordinates(mech.home, "pose").values()
    still = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz}
    motion = pp.Motion.through(time, {k: v + 0.0 * time for k, v in still.items()}, set="pose")
    law = pp.ComputedTorque(mech, motion, frequency=20.0)
    assert law(0.5, mech.home, np.zeros(6))[6] == 0.0
    beside = mech.pose(still | {"z": z + 0.005})
    run = pp.simulate(mech, beside, forces=law, until=0.5, step=0.1, tolerance=1e-6)
    assert np.abs(errors(law, run)[-1]).max() < 2e-3 * np.abs(errors(law, run)[0]).max()


def test_gains_must_be_positive(published):
    mech, motion, _ = published
    with pytest.raises(pp.PolypodError, match=r"frequency is 0\.0"):
        pp.ComputedTorque(mech, motion, frequency=0.0)
    with pytest.raises(pp.PolypodError, match="damping is nan"):
        pp.ComputedTorque(mech, motion, frequency=1.0, damping=np.nan)
