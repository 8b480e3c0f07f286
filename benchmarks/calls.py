"""What the calls cost from Python: one state, and a state of a batch."""

from statistics import median
from time import perf_counter

import numpy as np

import polypod as pp

BATCH = 20_000
RUNS = 7


def seconds(call, repeat):
    """Median time of one call over some runs of `repeat` calls."""
    times = []
    for _ in range(RUNS):
        start = perf_counter()
        for _ in range(repeat):
            call()
        times.append((perf_counter() - start) / repeat)
    return median(times)


def main():
    mech = pp.load("lu-3spu-2rpu-r")
    motion = pp.load_motion("lu-3spu-2rpu-r", mech).sample(np.linspace(0, 8, BATCH))
    inputs = (motion.coordinates, motion.rates, motion.second_rates)
    state = mech.state(*inputs)
    many = (state.pose, state.twist, state.acceleration)
    one = tuple(a[BATCH // 3] for a in many)
    calls = {
        "state from coordinates": (
            lambda: mech.state(*({k: v[0] for k, v in series.items()} for series in inputs)),
            lambda: mech.state(*inputs),
        ),
        "inverse_kinematics": (
            lambda: mech.inverse_kinematics(one[0]),
            lambda: mech.inverse_kinematics(many[0]),
        ),
        "jacobian": (lambda: mech.jacobian(one[0]), lambda: mech.jacobian(many[0])),
        "kinematics": (lambda: mech.kinematics(*one), lambda: mech.kinematics(*many)),
        "inverse_dynamics": (lambda: mech.inverse_dynamics(*one), lambda: mech.inverse_dynamics(*many)),
    }
    print(f"{'':24}{'one state':>14}{f'of {BATCH}':>14}{'ratio':>8}")
    for name, (single, batch) in calls.items():
        alone, shared = seconds(single, 200), seconds(batch, 1) / BATCH
        print(f"{name:24}{alone * 1e6:11.1f} µs{shared * 1e9:11.0f} ns{alone / shared:8.0f}")


if __name__ == "__main__":
    main()
