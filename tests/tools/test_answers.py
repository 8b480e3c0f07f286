"""The record of answers is the same every time, and the comparison sees the last bit."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from support import ROOT

FEW = 60


def tool(*arguments) -> tuple[int, str]:
    command = [sys.executable, ROOT / "tools" / "answers.py", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert not done.stderr, done.stderr
    return done.returncode, done.stdout


def made(path, **changed):
    """A small record of one mechanism and two states."""
    arrays = {
        "in/arm/pose": np.zeros((2, 4, 4)),
        "out/arm/inverse_dynamics/forces": np.array([[1.0, -2.0], [np.nan, 4.0]]),
        "out/arm/inverse_dynamics/status": np.array([0, 4], dtype=np.uint8),
        "out/arm/base_parameters/error": np.array("UnsupportedError"),
    }
    np.savez(path, **{key: changed.get(key.split("/")[-1], array) for key, array in arrays.items()})
    return path


def test_equal_records_are_equal(tmp_path):
    a, b = made(tmp_path / "a.npz"), made(tmp_path / "b.npz")
    assert tool("compare", a, b) == (0, "3 of 3 arrays of 1 mechanisms agree to the last bit\n")


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"forces": np.array([[1.0, -2.0], [np.nan, 4.0 + 2**-50]])}, "forces differs by 2.2e-16 (1 of 4)"),
        ({"forces": np.array([[1.0, -2.0], [3.0, 4.0]])}, "forces differs by inf (1 of 4)"),
        ({"forces": np.zeros((2, 3))}, "forces was float64 (2, 2), is float64 (2, 3)"),
        ({"status": np.array([0, 3], dtype=np.uint8)}, "status changed in 1 of 2: 1 times 4 → 3"),
        ({"error": np.array("ShapeError")}, "error changed in 1 of 1: 1 times UnsupportedError → ShapeError"),
        ({"pose": np.ones((2, 4, 4))}, "arm: inputs differ (pose)"),
    ],
)
def test_differences_are_told(tmp_path, changed, told):
    status, said = tool("compare", made(tmp_path / "a.npz"), made(tmp_path / "b.npz", **changed))
    assert status == 1
    assert told in said


@pytest.mark.parametrize(
    ("name", "status"),
    [
        ("arm=1e-15", 0),
        ("forces=1e-15", 0),
        ("inverse_dynamics=1e-15", 0),
        ("arm/inverse_*/forces=1e-15", 0),
        ("arm=1e-16", 1),
        ("leg=1e-15", 1),
    ],
)
def test_what_may_differ_is_named(tmp_path, name, status):
    other = made(tmp_path / "b.npz", forces=np.array([[1.0, -2.0], [np.nan, 4.0 + 2**-50]]))
    assert tool("compare", made(tmp_path / "a.npz"), other, "--allow", name)[0] == status


def test_a_status_may_never_differ(tmp_path):
    other = made(tmp_path / "b.npz", status=np.array([0, 3], dtype=np.uint8))
    assert tool("compare", made(tmp_path / "a.npz"), other, "--allow", "arm=1")[0] == 1


@pytest.mark.slow
def test_a_record_is_the_same_every_time(tmp_path):
    a, b, c = (tmp_path / f"{name}.npz" for name in "abc")
    tool("record", a, "--states", FEW)
    tool("record", b, "--states", FEW)
    tool("record", c, "--inputs", a)
    for other in (b, c):
        status, said = tool("compare", a, other)
        assert status == 0, said
