"""Times and peak memory of workspaces: the paper's lattice of lengths, a million voxels, assembly modes.

Each runs in a process of its own, so that its peak memory is its own. Prints a line of JSON; run by
`python -m benchmarks`.
"""

import json
import resource
import sys
from time import perf_counter

import numpy as np

import polypod as pp
from benchmarks import timing
from benchmarks.states import NAME, states
from polypod import _core

STEP = 0.0131
COUNTS = (115, 115, 77)


def lattice():
    """The paper's Section 4: steps of 10 mm, 21^5 combinations."""
    found = pp.length_lattice(pp.load(NAME), step=0.01)
    return {f"lattice of {found.nodes:,} lengths": None}


def voxels():
    """The flood of a grid and the exact boundary, apart."""
    mech = pp.load(NAME)
    origin = [-0.5 * STEP * (COUNTS[0] - 1), -0.5 * STEP * (COUNTS[1] - 1), 0.5 * STEP]
    start = perf_counter()
    flood = _core.Flood.begin(mech._core, origin, STEP, COUNTS, mech.home.ravel(), False, 0)
    while flood.wave() or flood.retry():
        pass
    flooded = perf_counter() - start
    edges = len(flood.edges()["node"])
    return {
        f"flood of {np.prod(COUNTS):,} voxels": flooded,
        f"its boundary, {edges:,} edges": perf_counter() - start - flooded,
    }


def meshed():
    """Workspace search from Python with mesh, volume and error."""
    found = pp.workspace(pp.load(NAME), step=STEP)
    return {f"workspace of {found.mask.size:,} voxels with mesh": None}


def scan():
    """All limits of a million poses, once warm."""
    poses = states().sized(10**6).pose
    mech, times = pp.load(NAME), []
    for _ in range(5):
        start = perf_counter()
        mech.limits(poses)
        times.append(perf_counter() - start)
    return {f"limits of {len(poses):,} poses": float(np.median(times))}


def modes():
    """Assembly modes for some sets of lengths."""
    mech = pp.load(NAME)
    lengths = np.random.default_rng(0).uniform(0.65, 0.85, (20, 5))
    mech.assembly_modes(lengths[0])
    start = perf_counter()
    for row in lengths:
        mech.assembly_modes(row)
    return {"assembly modes, one set of lengths": (perf_counter() - start) / len(lengths)}


RUNS = {"scan": scan, "lattice": lattice, "voxels": voxels, "meshed": meshed, "modes": modes}


def main(name, threads):
    timing.pin(int(threads))
    start = perf_counter()
    rows = RUNS[name]()
    whole = perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024  # kB on Linux
    print(
        json.dumps(
            [
                {"what": text, "seconds": whole if seconds is None else seconds, "peak": peak}
                for text, seconds in rows.items()
            ]
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
