"""Motions that stay at a constraint singularity: one judgement along all of them, whatever rounding does."""

from __future__ import annotations

import numpy as np
import pytest

import polypod as pp

NAME = "3-upu-snu"
"""Its centre line is singular: the couples of all three legs are upright there, so that two are lost."""


def turned(angle: float) -> pp.Mechanism:
    """The mechanism rotated about Z, degrees: the same machine, with other rounding."""
    data = pp.load(NAME).to_dict()
    for leg in data["legs"]:
        for side in ("base", "platform"):
            leg[side]["point"]["angle"] += angle
            leg[side]["axis"]["angle"] += angle
    return pp.Mechanism.from_dict(data)


def lifted(mech: pp.Mechanism, count: int, x: float = 0.0) -> pp.Solution:
    """A motion straight upwards at a distance from the centre line, m."""
    time = np.linspace(0.0, 2.0, count)
    height = mech.home[2, 3] + 0.05 * np.sin(time)
    path = {"x": np.full(count, x), "y": np.zeros(count), "z": height}
    return pp.solve(mech, pp.Motion.through(time, path, set="pose"))


@pytest.mark.parametrize("angle", [0.0, 17.3, 41.0, 77.7, 123.4])
@pytest.mark.parametrize("count", [11, 40])
def test_all_states_of_a_singular_lift_are_judged_alike(angle, count):
    solution = lifted(turned(angle), count)
    assert (solution.dataset["status"] == pp.Status.FOLD).all()
    assert solution.singularities["crossings"] == []
    (passage,) = solution.singularities["near"]
    assert (passage["kind"], passage["stays"], passage["freedoms"]) == ("CONSTRAINT", True, 2)
    assert (passage["start"], passage["end"]) == (0.0, 2.0)


def test_it_is_said_once_with_the_number_of_freedoms():
    from polypod.solution.singularity_crossings import warnings_of

    (said,) = warnings_of(lifted(turned(17.3), 21).singularities)
    assert "stays at singular poses from 0 s to 2 s" in said
    assert "degrees of freedom that no actuator controls, 2 here" in said
    assert any("2 here" in warning for warning in turned(17.3).warnings)


@pytest.mark.parametrize("x", [0.03, 0.002])
def test_beside_the_singular_line_all_states_have_answers(x):
    """Near is told as near: no freedom is gained."""
    solution = lifted(turned(17.3), 21, x)
    assert (solution.dataset["status"] == pp.Status.OK).all()
    assert solution.singularities["crossings"] == []
    for passage in solution.singularities["near"]:
        assert (passage["stays"], passage["freedoms"]) == (False, 0)


def test_a_motion_across_the_singular_line_touches_it_at_one_instant():
    mech = turned(17.3)
    time = np.linspace(0.0, 2.0, 21)
    path = {"x": 0.03 * (time - 0.97), "y": np.zeros(21), "z": np.full(21, mech.home[2, 3])}
    solution = pp.solve(mech, pp.Motion.through(time, path, set="pose"))
    assert (solution.dataset["status"] == pp.Status.OK).all()
    assert not any(passage["stays"] for passage in solution.singularities["near"])
    times = [crossing["time"] for crossing in solution.singularities["crossings"]]
    nearest = [passage["time"] for passage in solution.singularities["near"]]
    assert times == pytest.approx([0.97], abs=1e-5)
    assert nearest == pytest.approx([0.97], abs=1e-5)
    assert solution.singularities["crossings"][0]["freedoms"] == 2
