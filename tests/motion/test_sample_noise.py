"""Samples whose second derivatives are in doubt: held, nearly repeated, rounded and noisy ones."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from polypod.files.units import instant
from polypod.motion.motion import Motion

Array = NDArray[np.float64]

STEP, N = 0.02, 101
TIME = STEP * np.arange(N)
PEAK = 0.02 * (2 * math.pi) ** 2


def height(time: Array) -> Array:
    """An oscillation of 20 mm a second long: accelerations up to PEAK."""
    return 0.5 + 0.02 * np.sin(2 * math.pi * time)


def through(time: Array, z: Array) -> Motion:
    zero = np.zeros_like(time)
    q = dict.fromkeys(("x", "y", "rx", "ry", "rz"), zero) | {"z": z}
    return Motion.through(time, q, set="pose", places=[f"line {i}" for i in range(2, len(time) + 2)])


def peak(motion: Motion) -> float:
    return float(np.max(np.abs(motion.second_rates["z"])))


def test_sound_samples_are_not_doubted():
    motion = through(TIME, np.round(height(TIME), 9))
    assert peak(motion) == pytest.approx(PEAK, rel=2e-3)
    assert motion.warnings == ()


@pytest.mark.parametrize("seed", range(5))
def test_irregular_steps_alone_are_no_reason(seed: int):
    time = np.cumsum(np.random.default_rng(seed).uniform(0.5, 1.5, N)) * STEP
    assert through(time, height(time)).warnings == ()


def test_two_samples_at_almost_the_same_time():
    """A value that is repeated a moment later stands still there, for the spline."""
    time = np.insert(TIME, 50, TIME[49] + 1e-5)
    motion = through(time, np.insert(height(TIME), 50, height(TIME)[49]))
    assert peak(motion) > 5 * PEAK
    (warning,) = motion.warnings
    assert "because line 51 and line 52 are 0.01 ms apart, with steps of 20 ms elsewhere" in warning
    assert "near line 5" in warning


def test_a_resolution_that_steps_make_into_accelerations():
    motion = through(TIME, np.round(height(TIME), 4))
    assert peak(motion) > 2 * PEAK
    (warning,) = motion.warnings
    assert "values have a resolution of 0.1 mm at steps of 20 ms" in warning
    assert "accelerations of z" in warning


def test_noise():
    noise = 1e-4 * np.random.default_rng(3).normal(size=N)
    (warning,) = through(TIME, height(TIME) + noise).warnings
    assert "values scatter by 0.1 mm" in warning or "values scatter by 0.09" in warning


@pytest.mark.parametrize("times", [2, 3, 5])
def test_held_values(times: int):
    z = np.repeat(height(TIME), times)[:N]
    (warning,) = through(TIME, z).warnings
    assert "samples repeat the one before, the first of them line 3" in warning


def test_a_dwell_is_not_held():
    z = np.concatenate([np.full(30, 0.5), height(TIME), np.full(30, height(TIME)[-1])])
    smooth = 0.5 + 0.01 * (1 - np.cos(np.clip(STEP * np.arange(len(z)) - 0.6, 0, 1) * 2 * math.pi))
    assert not any("repeat" in warning for warning in through(STEP * np.arange(len(z)), smooth).warnings)


def test_gaps():
    keep = np.r_[0:40, 60:N]
    (warning,) = through(TIME[keep], np.round(height(TIME), 4)[keep]).warnings
    assert (
        "samples are missing there: a step takes 420 ms, the others 20 ms" in warning
        or "resolution" in warning
    )


def test_few_samples_are_waypoints():
    assert through(TIME[:20], np.round(height(TIME[:20]), 3)).warnings == ()


def test_warnings_stay_with_the_motion():
    motion = through(TIME, np.round(height(TIME), 4))
    assert motion.sample(np.linspace(0.1, 1.9, 50)).warnings == motion.warnings


def test_unix_times_are_dates():
    assert instant(1761444699.35) == "2025-10-26 02:11:39.350 UTC"
    assert instant(1.5) == "1.5 s"
    assert instant(1.23456789, 9) == "1.23456789 s"
    assert "2025-10-26 02:11:39.350 UTC to 2025-10-26" in repr(through(1761444699.35 + TIME, height(TIME)))
