"""Polypod's own operations: time over the number of states, and memory.

One process for each number of threads and instruction set, which are set by the environment. Prints a
line of JSON; run by `python -m benchmarks`.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np

import polypod as pp
from benchmarks import timing
from benchmarks.states import states

LONGEST = 2.0
"""s: batches larger than those that are compared are left out once a call would take longer."""
MEMORY = 0.5
"""Part of the machine's memory that a batch of states and its output may take."""


INPUTS = {
    "inverse_kinematics": ("pose",),
    "jacobian": ("pose",),
    "kinematics": ("pose", "twist", "acceleration"),
    "inverse_dynamics": ("pose", "twist", "acceleration"),
    "inverse_dynamics_from_coordinates": ("coordinates", "rates", "second_rates"),
    "forward_kinematics": ("lengths", "guess"),
    "forward_dynamics": ("pose", "twist", "forces"),
    "limits": ("pose",),
}
"""The arrays of the states that each operation reads."""


class Polypod:
    """The operations at given states, each with all its checks and its status."""

    version = pp.__version__
    count = 100_000
    tasks = tuple(INPUTS)

    def __init__(self, states):
        self.mech, self.states = states.mech, states

    def inverse_kinematics(self):
        return self.mech.inverse_kinematics(self.states.pose)

    def jacobian(self):
        return (self.mech.jacobian(self.states.pose),)

    def kinematics(self):
        s = self.states
        return self.mech.kinematics(s.pose, s.twist, s.acceleration)

    def inverse_dynamics(self):
        s = self.states
        return self.mech.inverse_dynamics(s.pose, s.twist, s.acceleration)

    def inverse_dynamics_from_coordinates(self):
        s = self.states
        state = self.mech.state(s.coordinates, s.rates, s.second_rates)
        return self.mech.inverse_dynamics(state.pose, state.twist, state.acceleration)

    def forward_kinematics(self):
        return self.mech.forward_kinematics(self.states.lengths, self.states.guess)

    def forward_dynamics(self):
        s = self.states
        return self.mech.forward_dynamics(s.pose, s.twist, s.forces)

    def limits(self):
        return self.mech.limits(self.states.pose)


def curve(task, given, sizes):
    """Times of batches of growing size, the first a call for a single state."""
    rows, last = [], 0.0
    few = given.sized(100)
    answer = getattr(Polypod(few), task)()
    moved = _bytes_per_state([*(getattr(few, name) for name in INPUTS[task]), *answer])
    available = MEMORY * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    most = available / _bytes_per_state([*vars(few).values(), *answer])
    for size in sizes:
        too_much = size * last > LONGEST * 1e9 or size > most
        if size > Polypod.count and too_much:
            break
        call = getattr(Polypod(given.single() if size == 1 else given.sized(size)), task)
        times = timing.rounds({task: call}, {task: size})[task]
        rows.append({"operation": task, "states": size, "bytes": moved, **timing.summary(times)})
        last = rows[-1]["median"]
    return rows


def _bytes_per_state(arrays):
    """Of arrays of a hundred states."""
    return sum(map(_size, arrays)) / 100


def _size(given):
    if isinstance(given, dict):
        return sum(map(_size, given.values()))
    return given.nbytes if isinstance(given, np.ndarray) else 0


def memory(task, given):
    """Bytes at the peak of the first large call beside its input, and those of its output; None: unknown."""
    getattr(Polypod(given.sized(100)), task)()  # what is made once
    call = getattr(Polypod(given), task)
    status, reset = Path("/proc/self/status"), Path("/proc/self/clear_refs")
    if not status.exists():
        return None
    reset.write_text("5")  # from now on the peak is a new one
    before = _peak(status)
    output = sum(map(_size, call()))
    return {
        "operation": task,
        "states": len(given.pose),
        "peak": _peak(status) - before,
        "output": output,
    }


def _peak(status):
    line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024


def main(what, threads, *sizes):
    timing.pin(int(threads))
    given, sizes = states(), [int(size) for size in sizes]
    if what.startswith("memory "):
        # A process for each: memory that an operation has had stays for the next one.
        rows = [memory(what.removeprefix("memory "), given.sized(size)) for size in sizes]
    else:
        rows = [row for task in Polypod.tasks for row in curve(task, given, sizes)]
    print(json.dumps([row | {"threads": int(threads)} for row in rows if row]))


if __name__ == "__main__":
    main(*sys.argv[1:])
