"""Polypod beside other ways to the same answers, which each has to give before it is timed.

Prints a line of JSON; run by `python -m benchmarks`.
"""

import importlib
import json

import numpy as np

from benchmarks import timing
from benchmarks.operations import Polypod
from benchmarks.states import states

ALTERNATIVES = {
    "numba": "in_numba.Numba",
    "numpy": "in_numpy.Numpy",
    "Pinocchio": "in_pinocchio.Pinocchio",
    "MuJoCo": "in_mujoco.MuJoCo",
    "Exudyn": "in_exudyn.Exudyn",
}
"""Classes with `version`, the `tasks` that they have methods for, how many states they are timed at (`count`)
and the `tolerance` of their answers; some with `parts`, which do a part of a task, and a `note`."""


def alternative(name):
    """The class of an alternative; ImportError where its package is missing."""
    module, kind = ALTERNATIVES[name].split(".")
    return getattr(importlib.import_module(f"benchmarks.alternatives.{module}"), kind)


def difference(found, expected):
    """Largest difference of two answers, each array relative to its greatest entry; NaN if there is one."""
    pairs = list(zip(found, expected, strict=False))
    return max(float(np.max(np.abs(a - b)) / np.max(np.abs(b))) for a, b in pairs)


def compare(task, known, given):
    """Rows of one task: what can be timed is timed in turns."""
    rows, calls, counts = [], {}, {}
    for name, kind in known.items():
        if task not in kind.tasks:
            continue
        candidate = kind(given.sized(kind.count))
        row = {"task": task, "name": name, "version": kind.version, "states": kind.count}
        rows.append(row)
        if name != "Polypod":
            answer = getattr(candidate, task)()
            expected = getattr(Polypod(candidate.states), task)()
            row |= {"difference": difference(answer, expected), "tolerance": kind.tolerance}
            if not row["difference"] <= kind.tolerance:
                row["refused"] = "its answer differs"
                continue
        calls[name], counts[name] = getattr(candidate, task), kind.count
        if hasattr(candidate, "note"):
            row["note"] = candidate.note()
        for part in getattr(kind, "parts", ()):
            title = f"{name}, {part.replace('_', ' ')} alone"
            rows.append({"task": task, "name": title, "version": kind.version, "states": kind.count})
            calls[title], counts[title] = getattr(candidate, part), kind.count
    times = timing.rounds(calls, counts)
    for row in rows:
        if (name := row["name"]) in times:
            ratios = np.divide(times[name], times["Polypod"])
            row |= timing.summary(times[name]) | {"ratio": float(np.median(ratios))}
    return rows


def main():
    timing.pin(1)
    known, rows = {"Polypod": Polypod}, []
    for name in ALTERNATIVES:
        try:
            known[name] = alternative(name)
        except ImportError as error:
            rows.append({"task": None, "name": name, "refused": f"not installed: {error}"})
    given = states()
    tasks = [task for task in Polypod.tasks if sum(task in kind.tasks for kind in known.values()) > 1]
    for task in tasks:
        rows += compare(task, known, given)
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
