"""The core's peak rate of floating-point operations, from products of matrices, which fuse multiply and add.

Prints a line of JSON; run by `python -m benchmarks`.
"""

import json

import numpy as np

from benchmarks import timing

SIZE = 512
RUNS = 50
"""Short ones, of which the fastest counts: a peak is what nothing else has slowed down."""


def main():
    timing.pin(1)
    a, b = np.random.default_rng(0).uniform(size=(2, SIZE, SIZE))
    times = timing.rounds({"product": lambda: a @ b}, {"product": 2 * SIZE**3}, runs=RUNS)["product"]
    print(json.dumps({"fused_flops_per_second": 1e9 / min(times)}))


if __name__ == "__main__":
    main()
