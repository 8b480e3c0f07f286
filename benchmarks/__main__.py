"""Measures everything, one process after the other, and writes results.json and docs/performance.md.

`python -m benchmarks` takes some minutes on a machine that does nothing else; with `--page` it only
writes the page anew, from the results there are.
"""

import json
import os
import platform
import subprocess
import sys
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks import page, start, timing, workspace
from benchmarks.operations import Polypod
from polypod import compute

ROOT = Path(__file__).parent.parent
RESULTS = Path(__file__).parent / "results.json"

SIZES = [10**k for k in range(8)]
COMPARED = 10**5
"""States of the batches that threads and instruction sets are compared by."""
MEASURED = 10**6
"""States of the batches whose memory is measured."""
LIMIT = 60
"""s: a workspace that takes longer is not waited for."""


def child(module, *arguments, timeout=600, **environment):
    """Output of a module of this folder, run in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{module}", *map(str, arguments)],
        cwd=ROOT,
        env=os.environ | timing.ONE_THREAD | environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=timeout,
    )
    return json.loads(done.stdout.splitlines()[-1])


def operations(what, threads, sizes, **environment):
    return child("operations", what, threads, *sizes, POLYPOD_THREADS=str(threads), **environment)


def instruction_sets():
    """Times of the operations with each instruction set that the product can use."""
    rows = []
    for name in compute.instruction_sets():
        measured = operations("curve", 1, [COMPARED], POLYPOD_INSTRUCTIONS=name)
        rows += [row | {"instructions": name} for row in measured]
    return rows


def workspaces(threads):
    rows = []
    for name in workspace.RUNS:
        try:
            rows += child("workspace", name, threads, timeout=LIMIT, POLYPOD_THREADS=str(threads))
        except subprocess.TimeoutExpired:
            rows.append({"what": name, "seconds": None, "peak": None})
    return rows


def cargo(*command, then=()):
    """Output of a cargo command that first builds on all cores, then runs on one."""
    build = ["cargo", "bench", "--no-run"] if command[0] == "bench" else ["cargo", "build"]
    target = ["--package", "polypod-bench", *command[1:]]
    subprocess.run([*build, *target], cwd=ROOT, check=True)
    run = ["cargo", command[0], *target, "--", *then]
    done = subprocess.run(
        run, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True, preexec_fn=lambda: timing.pin(1)
    )
    return done.stdout


def rust():
    """Times of single calls from Rust, from the samples that Criterion leaves in files."""
    cargo("bench", "--bench", "kernels", then=("--warm-up-time", "0.5", "--measurement-time", "1"))
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    rows = []
    for path in sorted(target.glob("criterion/*/*/new/benchmark.json")):
        sample = json.loads((path.parent / "sample.json").read_text())
        times = [time / n for time, n in zip(sample["times"], sample["iters"], strict=True)]
        name = json.loads(path.read_text())["function_id"]
        rows.append({"operation": name, **timing.summary(times)})
    return rows


def machine():
    """Machine on which it was measured."""

    def line(path, key):
        text = Path(path).read_text() if Path(path).exists() else ""
        found = (row.split(":", 1)[1].strip() for row in text.splitlines() if row.startswith(key))
        return next(found, "")

    def installed(package):
        try:
            return version(package)
        except PackageNotFoundError:
            return None

    flags = line("/proc/cpuinfo", "flags").split()
    packages = ("polypod", "numpy", "numba", "pin", "mujoco", "exudyn")
    return {
        "date": date.today().isoformat(),
        "processor": line("/proc/cpuinfo", "model name") or platform.processor(),
        "architecture": platform.machine(),
        "instructions": [name for name in ("sse2", "avx2", "fma", "avx512f", "asimd") if name in flags],
        "cores": os.cpu_count(),
        "cache": line("/proc/cpuinfo", "cache size"),
        "memory": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        "load": os.getloadavg()[0],
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
        "rust": subprocess.run(["rustc", "--version"], capture_output=True, text=True).stdout.strip(),
        "packages": {name: installed(name) for name in packages},
    }


def measure():
    """Everything."""

    def say(what):
        print(f"{what} ...", file=sys.stderr, flush=True)

    results = {"machine": machine()}
    say("alternatives")
    results["comparison"] = child("comparison")
    threads = [n for n in (1, 2) if n <= os.cpu_count()]
    for n in threads:
        say(f"operations, threads: {n}")
        results.setdefault("curves", []).extend(operations("curve", n, SIZES))
    say("instruction sets")
    results["instruction_sets"] = instruction_sets()
    say("memory")
    # Without memory that earlier results have left.
    results["memory"] = [
        row
        for task in Polypod.tasks
        for row in operations(f"memory {task}", threads[-1], [MEASURED], MIMALLOC_PURGE_DELAY="0")
    ]
    say("redundant actuators")
    results["actuation"] = child("actuation", timeout=1800)
    say("import, list and build")
    results["start"] = start.measured()
    say("long files")
    results["long_files"] = child("long_files")
    say("workspaces")
    results["workspaces"] = workspaces(threads[-1])
    say("Rust")
    results["rust"] = rust()
    results["bandwidth"] = child("bandwidth")
    results["flops"] = json.loads(cargo("run", "--release"))
    return results


def main(arguments):
    if arguments != ["--page"]:
        RESULTS.write_text(json.dumps(measure(), indent=1, sort_keys=True) + "\n", encoding="utf-8")
    page.write(json.loads(RESULTS.read_text(encoding="utf-8")), ROOT / "docs")


if __name__ == "__main__":
    main(sys.argv[1:])
