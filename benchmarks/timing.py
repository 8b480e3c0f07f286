"""How all is timed: on one core, in rounds that run every candidate once; medians and quartiles."""

import gc
import os
from time import perf_counter

import numpy as np

RUNS = 7
"""Rounds; odd, so that the median is one of them."""
LEAST = 0.01
"""s: shorter calls are repeated within a run."""

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""For libraries that would start threads of their own."""


def pin(cores):
    """Keeps this process on the last of the processors that it may use; False where the system cannot."""
    if not hasattr(os, "sched_setaffinity"):
        return False
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-cores:])
    return True


def rounds(calls, states, runs=RUNS):
    """Nanoseconds per state (runs,) of each call, by the same names.

    Candidates take turns, so that a machine that changes its speed changes it for all of them.

    Args:
        calls: functions without arguments.
        states: how many states each of them does.
        runs: of each.
    """
    repeats = {name: max(1, round(LEAST / max(_seconds(call, 1), 1e-7))) for name, call in calls.items()}
    found = {name: [] for name in calls}
    gc.collect()
    gc.disable()
    try:
        for _ in range(runs):
            for name, call in calls.items():
                found[name].append(_seconds(call, repeats[name]) / states[name] * 1e9)
    finally:
        gc.enable()
    return found


def _seconds(call, repeat):
    start = perf_counter()
    for _ in range(repeat):
        call()
    return (perf_counter() - start) / repeat


def summary(times):
    """Median and quartiles of runs."""
    low, median, high = np.percentile(times, [25, 50, 75])
    return {"median": median, "low": low, "high": high, "runs": len(times)}
