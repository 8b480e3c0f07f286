"""`polypod simulate`: falling, following a motion, how it ends, and wrong input."""

from __future__ import annotations

import json

import numpy as np
import pytest

import polypod as pp
from support import DATA

NAME = "lu-3spu-2rpu-r"
RPS = DATA / "3-rps.toml"
AT = ("--at", "alpha=0.1", "--at", "p=-300mm", "--at", "h=0.7", "--at", "beta=0.7", "--at", "gamma=0.5")


def test_a_fall_ends_at_a_limit(run, tmp_path):
    file = tmp_path / "fall.nc"
    status, out, err = run("simulate", NAME, *AT, "--until", 1, "-o", file)
    assert (status, err) == (0, "")
    assert "Ended at 0.0831" in out
    assert "stroke max of leg 3." in out
    assert "natural coordinates" in out
    mech = pp.load(NAME)
    pose = mech.pose({"alpha": 0.1, "p": -0.3, "h": 0.7, "beta": 0.7, "gamma": 0.5})
    found = pp.simulate(mech, pose, until=1.0, step=0.01, tolerance=1e-8)
    assert pp.load_solution(file) == found


def test_following_a_motion(run, tmp_path):
    file = tmp_path / "run.csv"
    more = ("--follow", NAME, "--until", 0.1, "--step", 0.05, "--tolerance", 1e-6, "--json", "-o", file)
    status, out, err = run("simulate", NAME, *more)
    assert (status, err) == (0, "")
    facts = json.loads(out)
    assert facts["ended"] == {"time": 0.1, "kind": "until", "reason": "the time is over"}
    assert (facts["states"], facts["without_answer"]) == (3, 0)
    mech = pp.load(NAME)
    motion = pp.load_motion(NAME, mech).sample([0.0, 0.05, 0.1])
    wanted = mech.inverse_kinematics(mech.pose(motion.coordinates, branch=motion.branch)).lengths
    assert np.allclose(pp.load_solution(file).dataset.length, wanted, atol=1e-6)


def test_past_a_limit(run, tmp_path):
    """The 3-RPS sinks below its strokes; if it is told to it goes on as far as there is an answer."""
    plain = ("simulate", RPS, "--until", 0.2, "-o", tmp_path / "fall.nc", "--json")
    first = json.loads(run(*plain)[1])["ended"]
    assert first["kind"] == "limit"
    assert first["time"] < 0.2
    status, out, _ = run(*plain, "--go-on")
    further = json.loads(out)["ended"]
    assert further["time"] > first["time"]
    assert (status, further["kind"]) in ((0, "until"), (1, "no answer"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--at", "alpha=0.1"), "no coordinate set"),
        (("--at", "x=9", "--at", "y=9", "--at", "z=9", "--at", "alpha=1", "--at", "beta=0"), "--at: no pose"),
        (("--at", "alpha"), "must be name=value"),
        (("--step", "0"), "step is 0.0"),
        (("--follow", "nothing"), "nothing"),
        (("--follow", NAME, "--frequency", "-1"), "frequency is -1.0"),
    ],
)
def test_wrong_input(run, tmp_path, options, message):
    status, _, err = run("simulate", NAME, "--until", 1, "-o", tmp_path / "x.nc", *options)
    assert status == 2
    assert message in err
    assert not (tmp_path / "x.nc").exists()


def test_a_result_of_another_kind_is_refused(run, tmp_path):
    status, _, err = run("simulate", NAME, "--until", 1, "-o", tmp_path / "x.txt")
    assert status == 2
    assert ".nc or .csv" in err
