"""How long it takes to begin: the import, the list of built-in mechanisms, and the build of the extension."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
RUNS = 9

COMMANDS = {
    "Python alone": "pass",
    "numpy": "import numpy",
    "import polypod": "import polypod",
    "polypod list": "import sys; from polypod.cli import main; sys.argv = ['polypod', 'list']; main()",
}


def measured():
    """All of it."""
    return {"commands": commands(), "build": build()}


def commands():
    """Seconds of whole processes, in turns."""
    found = {name: [] for name in COMMANDS}
    for _ in range(1 + RUNS):
        for name, code in COMMANDS.items():
            found[name].append(_seconds([sys.executable, "-c", code], _as_users_have_it()))
    rows = []
    for name, times in found.items():
        low, median, high = np.percentile(times[1:], [25, 50, 75])  # the first fills the system's caches
        rows.append({"what": name, "median": median, "low": low, "high": high})
    return rows


def _as_users_have_it():
    """The environment, with the compiled modules of earlier runs used."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def build():
    """Seconds of the extension's build from nothing, with all that it depends on but downloads."""
    subprocess.run(["cargo", "fetch", "--locked"], cwd=ROOT, check=True)
    with tempfile.TemporaryDirectory() as target:
        command = [
            "cargo",
            "build",
            "--release",
            "--locked",
            "--package",
            "polypod-py",
            "--target-dir",
            target,
        ]
        seconds = _seconds(command, os.environ | {"PYO3_PYTHON": sys.executable})
    return {"what": "build of the extension", "seconds": seconds, "cores": os.cpu_count()}


def _seconds(command, environment=None):
    start = time.perf_counter()
    subprocess.run(command, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start
