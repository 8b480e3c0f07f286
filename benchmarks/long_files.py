"""Commands on long files, from a table to a table, beside the least that they need.

Pairs are measured in turns, so that the ratio stands whatever else the machine does.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

import polypod as pp

NAME = "lu-3spu-2rpu-r"
HEXAPOD = "ups-hexapod"
ROWS = 360_000
"""A motion of an hour at 100 Hz."""
LENGTHS = 8000
RUNS = 3


def motion_table(path):
    """A gentle motion of an hour in natural coordinates, as CSV."""
    mech = pp.load(NAME)
    time = np.linspace(0.0, 3600.0, ROWS)
    height = 1e3 * float(mech.coordinates(mech.home, "natural")["h"])
    columns = {
        "time [s]": time,
        "alpha [deg]": 2.0 * np.sin(0.10 * time),
        "p [mm]": 50.0 * np.sin(0.13 * time),
        "h [mm]": height + 20.0 * np.sin(0.07 * time),
        "beta [deg]": 15.0 + 5.0 * np.sin(0.11 * time),
        "gamma [deg]": 10.0 + 3.0 * np.cos(0.10 * time),
    }
    _save(path, columns)


def lengths_table(path):
    """Leg lengths of poses about home, as CSV."""
    mech = pp.load(HEXAPOD)
    rng = np.random.default_rng(0)
    names = ("x", "y", "z", "rx", "ry", "rz")
    home = mech.coordinates(mech.home, "pose")
    near = {name: float(home[name]) + 0.05 * rng.normal(size=LENGTHS) for name in names}
    lengths = mech.inverse_kinematics(mech.pose(near)).lengths
    _save(path, dict(zip((f"{name} [m]" for name in mech.leg_names), lengths.T, strict=True)))


def _save(path, columns):
    rows = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.12g")


def command(*arguments):
    """Seconds and peak memory of a command."""
    code = (
        "import resource, sys; from polypod.cli import main\n"
        "try:\n    main()\nfinally:\n"
        "    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024, file=sys.stderr)"
    )
    start = perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], check=True, capture_output=True, text=True
    )
    return perf_counter() - start, int(done.stderr.split()[-1])


def least_of_solve(path):
    """Seconds to read the numbers and to evaluate what `solve` tells of each state, with nothing kept."""
    mech = pp.load(NAME)
    start = perf_counter()
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    names = ("alpha", "p", "h", "beta", "gamma")
    scale = np.radians(1.0), 1e-3, 1e-3, np.radians(1.0), np.radians(1.0)
    time = table[:, 0]
    q = {name: factor * table[:, k + 1] for k, (name, factor) in enumerate(zip(names, scale, strict=True))}
    rates = {name: np.gradient(values, time) for name, values in q.items()}
    state = mech.state(q, rates, {name: np.gradient(values, time) for name, values in rates.items()})
    for first in range(0, len(time), 20_000):
        pose, twist, acceleration = (
            values[first : first + 20_000] for values in (state.pose, state.twist, state.acceleration)
        )
        mech.kinematics(pose, twist, acceleration)
        mech.inverse_dynamics(pose, twist, acceleration)
        mech.power(pose, twist, acceleration)
        mech.limits(pose, twist=twist, acceleration=acceleration)
        mech.singularity(pose)
    return perf_counter() - start


def least_of_modes(path):
    """Seconds to read the lengths and to find all poses with them, nothing written."""
    mech = pp.load(HEXAPOD)
    start = perf_counter()
    mech.assembly_modes(np.loadtxt(path, delimiter=",", skiprows=1))
    return perf_counter() - start


def measured():
    """Both pairs."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        motion, lengths = Path(folder) / "motion.csv", Path(folder) / "lengths.csv"
        motion_table(motion)
        lengths_table(lengths)
        for what, count, arguments, least in (
            (
                "solve",
                ROWS,
                ("solve", NAME, motion, "-o", Path(folder) / "r.nc"),
                lambda: least_of_solve(motion),
            ),
            (
                "fk",
                LENGTHS,
                ("fk", HEXAPOD, lengths, "-o", Path(folder) / "p.csv"),
                lambda: least_of_modes(lengths),
            ),
        ):
            pairs = [(command(*arguments), least()) for _ in range(RUNS)]
            ratios = [seconds / alone for (seconds, _), alone in pairs]
            middle = int(np.argsort(ratios)[RUNS // 2])
            (seconds, peak), alone = pairs[middle]
            rows.append(
                {
                    "what": what,
                    "rows": count,
                    "seconds": seconds,
                    "least": alone,
                    "ratio": ratios[middle],
                    "peak": peak,
                }
            )
    return rows


if __name__ == "__main__":
    print(json.dumps(measured()))
