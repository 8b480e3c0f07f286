"""A home at which the constraints are singular: coordinates are chosen where the mechanism is generic.

Two rods cross under the platform, each with two RPU legs. At home, level, their couples leave more freedom
than the four degrees that the mechanism has elsewhere.
"""

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from support.mechanism_files import SI_UNITS

REST = np.zeros(6)


def _rod(axis: list[int]) -> dict[str, object]:
    return {
        "name": "LM"[axis[1]],
        "point": [0, 0, 0],
        "axis": axis,
        "mass": 2.0,
        "center": [0.01, 0.02, -0.015],
        "inertia": [0.01, 0.06, 0.055],
    }


def _leg(
    base: list[float], platform: list[float], axis: list[int], rod: str | None = None
) -> dict[str, object]:
    foot = {"joint": "R", "rod": rod} if rod else {"joint": "S"}
    return {
        "base": {**foot, "point": base},
        "platform": {"joint": "U", "point": platform, "axis": axis},
        "stroke": {"min": 0.4, "max": 1.2},
        "cylinder": {"mass": 2.0, "center": [0.003, 0.2, -0.004], "inertia": [0.04, 0.003, 0.038]},
        "piston": {"mass": 3.0, "center": [-0.002, -0.15, 0.003], "inertia": [0.03, 0.002, 0.031]},
    }


X, Y = [1, 0, 0], [0, 1, 0]
CROSSING = pp.Mechanism.from_dict(
    {
        "name": "crossing rods",
        "units": SI_UNITS,
        "home": {"position": [0, 0, 0.74]},
        "dynamics": {"gravity": [0.7, -0.4, -9.6]},
        "load": {"force": [10, 10, 500], "torque": [2, -3, 20]},
        "platform": {
            "mass": 3.0,
            "center": [0.005, -0.008, 0.012],
            "inertia": np.diag([0.06, 0.05, 0.09]).tolist(),
        },
        "rods": [_rod(X), _rod(Y)],
        "legs": [
            _leg([0.27, 0, 0], [0.15, 0, 0], X, "L"),
            _leg([0, 0.27, 0], [0, 0.15, 0], Y, "M"),
            _leg([-0.27, 0, 0], [-0.15, 0, 0], X, "L"),
            _leg([0, -0.27, 0], [0, -0.15, 0], Y, "M"),
            _leg([0.19, 0.19, 0], [-0.106, 0.06, 0], X),
        ],
    }
)
TILTED = CROSSING.state({"x": 0.03, "y": 0.05, "z": 0.75, "rz": 0.1}).pose
CHOICES = [None, ["x", "y", "z", "rz"]]


def test_as_many_coordinates_are_chosen_as_there_are_degrees_of_freedom():
    assert CROSSING.dof == 4
    motion = CROSSING.equations_of_motion(TILTED, REST, "pose")
    assert len(motion.coordinates) == 4
    assert motion.mass.shape == (4, 4)
    assert motion.status == Status.OK


def test_at_home_no_coordinates_determine_the_rates():
    motion = CROSSING.equations_of_motion(CROSSING.home, REST, "pose")
    assert motion.status == Status.FOLD
    assert np.isnan(motion.mass).all()
    assert CROSSING.singularity_distance(CROSSING.home).status == Status.FOLD


@pytest.mark.parametrize("names", CHOICES, ids=["chosen", "named"])
def test_derivatives_are_those_of_differences(names):
    found = CROSSING.inverse_dynamics_derivatives(TILTED, REST, REST, coordinates=names)
    here = CROSSING.coordinates(TILTED, "pose")
    h = 1e-5
    for k, name in enumerate(found.coordinates):
        forces = []
        for step in (h, -h):
            values = {n: float(here[n]) + step * (n == name) for n in found.coordinates}
            pose = CROSSING.state(values, guess=TILTED).pose
            forces.append(CROSSING.inverse_dynamics(pose, REST, REST).forces)
        expected = (forces[0] - forces[1]) / (2 * h)
        np.testing.assert_allclose(found.forces_by_coordinates[..., k], expected, rtol=1e-6, atol=1e-4)


def test_a_tilted_pose_has_singular_poses_near_it():
    found = CROSSING.singularity_distance(TILTED)
    assert found.status == Status.OK
    assert len(found.coordinates) == 4
    nearest = np.nanmin(found.distance)
    assert 0.0 < nearest < 0.2
