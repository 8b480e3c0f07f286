"""What `solve` says about a motion that its user may not have meant."""

from __future__ import annotations

import math

import numpy as np
import pytest

import polypod as pp
from polypod.motion.motion import Motion

HEXAPOD = pp.load("ups-hexapod")


def massless() -> pp.Mechanism:
    """The hexapod without masses."""
    data = HEXAPOD.to_dict()
    del data["platform"]
    for leg in data["legs"]:
        del leg["cylinder"], leg["piston"]
    return pp.Mechanism.from_dict(data)


def motion(z: float, **more: object) -> Motion:
    time = np.linspace(0.0, 2.0, 41)
    zero = np.zeros_like(time)
    q = dict.fromkeys(("x", "y", "rx", "ry", "rz"), zero)
    return Motion.through(time, q | {"z": z + 0.05 * np.sin(math.pi * time)}, set="pose", **more)


def test_a_motion_at_home_is_not_doubted():
    assert pp.solve(HEXAPOD, motion(2.0)).warnings == []


def test_differences_from_home_are_told():
    (warning,) = pp.solve(HEXAPOD, motion(0.02)).warnings
    assert "no nearer to home, o = (0, 0, 2000) mm" in warning
    assert "not differences from home" in warning


@pytest.mark.parametrize(
    ("mech", "load", "told"),
    [(massless(), None, True), (massless(), [0, 0, -9.0, 0, 0, 0], False), (HEXAPOD, None, False)],
    ids=["nothing", "load", "masses"],
)
def test_forces_that_cannot_differ_from_zero_are_told(mech, load, told: bool):
    wrench = None if load is None else np.tile(load, (41, 1)).astype(float)
    solution = pp.solve(mech, motion(2.0, wrench=wrench))
    assert any("all forces are zero" in warning for warning in solution.warnings) == told
    assert (np.abs(solution.dataset["force"]).max() == 0.0) == told


def test_warnings_survive_files(tmp_path):
    solution = pp.solve(massless(), motion(0.02))
    assert len(solution.warnings) == 2
    for name in ("a.nc", "a.csv"):
        solution.save(tmp_path / name)
        assert pp.load_solution(tmp_path / name).warnings == solution.warnings
