"""Limits along a motion: in solutions, summaries, files, and on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import polypod as pp
from polypod import Status
from polypod.summary.solution_facts import summarise
from support.limited import free, paper


@pytest.fixture(scope="module")
def limited() -> tuple[pp.Mechanism, pp.Motion]:
    """The published example, with a force that it exceeds and a rod that rotates too far."""
    content = paper()
    content["legs"][3]["force"] = {"min": -25000.0, "max": 25000.0}
    content["rods"][0]["range"] = {"min": -20.0, "max": 20.0}
    mech = pp.Mechanism.from_dict(content)
    return mech, pp.load_motion("lu-3spu-2rpu-r", mech)


def test_margins_along_a_motion(limited: tuple[pp.Mechanism, pp.Motion]):
    mech, motion = limited
    data = pp.solve(mech, motion).dataset
    assert data["limit"].values.tolist() == [limit.name for limit in mech.limit_list]
    assert data["limit_unit"].values.tolist() == [limit.unit for limit in mech.limit_list]
    at = data["limit_margin"].sel(limit="force min of leg 4")
    assert at.values == pytest.approx(data["force"].sel(leg="4").values + 25000.0, abs=1e-8)
    turn = data["limit_margin"].sel(limit="angle of rod L")
    assert turn.values == pytest.approx(np.radians(20) - np.abs(data["rod_angle"].values[:, 0]), abs=1e-14)
    assert np.array_equal(data["binding_limit"].values, data["limit_relative"].values.argmin(axis=1))
    assert np.array_equal(data["status"] == Status.OUT_OF_ANGLE, turn < 0)
    assert 0 < (data["status"] == Status.OUT_OF_ANGLE).sum() < 801


def test_a_summary_names_the_least_slack_and_what_is_passed(limited: tuple[pp.Mechanism, pp.Motion]):
    mech, motion = limited
    solution = pp.solve(mech, motion)
    data, facts = solution.dataset, summarise(mech, solution)["limits"]
    relative = data["limit_relative"].values
    state, limit = np.unravel_index(relative.argmin(), relative.shape)
    assert facts["least"] == {
        "limit": data["limit"].values[limit],
        "time": data["time"].values[state],
        "margin": data["limit_margin"].values[state, limit],
        "relative": relative.min(),
        "unit": data["limit_unit"].values[limit],
    }
    assert [row["limit"] for row in facts["passed"]] == ["angle of rod L", "force min of leg 4"]
    beyond = data["limit_margin"].sel(limit="force min of leg 4").values
    assert facts["passed"][1]["states"] == (beyond < 0).sum()
    assert facts["passed"][1]["first_time"] == data["time"].values[np.argmax(beyond < 0)]
    assert facts["passed"][1]["margin"] == beyond.min()
    assert facts["not_determined"] == 0


def test_without_limits_a_solution_has_none():
    mech = pp.Mechanism.from_dict(free())
    solution = pp.solve(mech, pp.load_motion("lu-3spu-2rpu-r", mech))
    assert not {"limit_margin", "limit_relative", "binding_limit", "limit", "limit_unit"} & {
        *map(str, solution.dataset.variables)
    }
    assert summarise(mech, solution)["limits"] is None


def test_limits_survive_files(limited: tuple[pp.Mechanism, pp.Motion], tmp_path: Path):
    solution = pp.solve(limited[0], limited[1].sample(np.linspace(0, 8, 20)))
    for suffix in ("nc", "csv"):
        solution.save(tmp_path / f"limits.{suffix}")
        assert pp.load_solution(tmp_path / f"limits.{suffix}") == solution


def test_warnings_name_the_limits_passed_at_home():
    content = paper() | {"limits": {"sigma_min": 0.01}}
    content["legs"][1]["stroke"]["min"] = 760.0
    content["rods"][0]["range"] = {"min": 10.0, "max": 40.0}
    notes = [note for note in pp.Mechanism.from_dict(content).warnings if "limit" in note]
    assert notes == [
        "beyond a limit at its centre pose: stroke min of leg 2, by 15.9 mm.",
        "beyond a limit at its centre pose: angle of rod L, by 10.0 deg.",
        "beyond a limit at its centre pose: conditioning, by 0.00791.",
    ]
    assert not [note for note in pp.load("lu-3spu-2rpu-r").warnings if "limit" in note]


@pytest.fixture
def words(run: Callable[..., tuple[int, str, str]]) -> Callable[..., str]:
    """Runs the command line: its standard output, words apart by one space."""
    return lambda *args: " ".join(run(*args)[1].replace("│", " ").split())


def test_info_lists_limits_and_what_binds(words: Callable[..., str], tmp_path: Path):
    content = paper()
    content["rods"][0]["range"] = {"min": -20.0, "max": 30.0}
    pp.Mechanism.from_dict(content).save(tmp_path / "m.toml")
    text = words("info", tmp_path / "m.toml")
    assert "stroke max of leg 5 at most 850.0 mm 95.6 mm 0.478 stroke" not in text  # binds no more
    assert "angle of rod L -20.0 deg to 30.0 deg 20.0 deg 0.4 binds" in text
    facts = json.loads(words("info", tmp_path / "m.toml", "--json"), parse_constant=pytest.fail)
    assert [row["name"] for row in facts["limits"] if row["binds"]] == ["angle of rod L"]
    assert facts["limits"][0]["allowed"] == [0.65, None]


def test_solve_tells_the_least_slack_and_limits_passed(
    words: Callable[..., str], limited: tuple[pp.Mechanism, pp.Motion], tmp_path: Path
):
    mech, motion = limited
    mech.save(tmp_path / "m.toml")
    facts = summarise(mech, pp.solve(mech, motion))["limits"]
    text = words("solve", tmp_path / "m.toml", "lu-3spu-2rpu-r", "-o", tmp_path / "r.nc")
    assert f"least slack: limit {facts['least']['limit']}" in text
    assert f"... time / s {facts['least']['time']:g}" in text
    row = facts["passed"][1]
    passed = (
        f"force min of leg 4 {row['states']} {row['first_time']:g} {-row['margin']:.1f} N {row['time']:g}"
    )
    assert passed in text
    mech = pp.Mechanism.from_dict(free())
    mech.save(tmp_path / "m.toml")
    assert "sets no limits" in words("solve", tmp_path / "m.toml", "lu-3spu-2rpu-r", "-o", tmp_path / "r.nc")
    text = words("solve", "lu-3spu-2rpu-r", "lu-3spu-2rpu-r", "-o", tmp_path / "r.nc")
    assert "All states have an answer, within all limits." in text
