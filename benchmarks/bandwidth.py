"""How fast a core copies arrays that are too large for its own caches: bytes read and written a second.

Prints a line of JSON; run by `python -m benchmarks`.
"""

import json

import numpy as np

from benchmarks import timing

SIZE = 1 << 23
"""Numbers, 64 MiB."""
RUNS = 25
"""Short ones, of which the fastest counts, as for the peak of arithmetic."""


def main():
    timing.pin(1)
    source, target = np.ones(SIZE), np.zeros(SIZE)
    moved = 2 * source.nbytes
    times = timing.rounds({"copy": lambda: np.copyto(target, source)}, {"copy": moved}, runs=RUNS)["copy"]
    print(json.dumps({"bytes_per_second": 1e9 / min(times)}))


if __name__ == "__main__":
    main()
