"""Loads mutated files one by one and writes what became of each.

From the folder of the tests: `python -m support.fuzz_worker FIRST COUNT RESULTS`. With one number it
prints that file and what becomes of it.

A process of its own, so that a hang or a crash takes nothing else with it: a file that takes longer than the
deadline ends the process, wherever it hangs. The results say how far it came.
"""

from __future__ import annotations

import faulthandler
import json
import sys
import tempfile
import time
import tomllib
import warnings
from pathlib import Path
from typing import Any

import polypod as pp
from support.mutations import Case, mutated
from support.sane import nonsense, text_of, vague

DEADLINE = 30.0
"""Seconds for one file: to load it, and for all checks of what came of it. It takes some hundredths."""


def judged(case: Case, path: Path) -> dict[str, Any]:
    """Outcome of a file, and its faults."""
    content, start = case.content, time.perf_counter()
    try:
        if isinstance(content, bytes):
            path.write_bytes(content)
            mech = pp.load(path)
        elif isinstance(content, str):
            mech = pp.Mechanism.from_toml(content)
        else:
            mech = pp.Mechanism.from_dict(content)
    except pp.MechanismError as error:
        seconds = time.perf_counter() - start
        return {"became": "refused", "seconds": seconds, "wrong": vague(error, content)}
    except BaseException as error:  # a panic of the core is no Exception
        return {"became": "failed", "seconds": 0.0, "wrong": [f"{type(error).__name__}: {error}"[:300]]}
    seconds = time.perf_counter() - start
    data = (
        content
        if isinstance(content, dict)
        else tomllib.loads(content if isinstance(content, str) else text_of(content))
    )
    try:
        wrong = nonsense(mech, data)
    except Exception as error:
        wrong = [f"{type(error).__name__} of a loaded mechanism: {error}"[:300]]
    return {"became": "loaded", "seconds": seconds, "wrong": wrong}


def main(first: int, count: int, results: Path) -> None:
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory() as folder, results.open("a", encoding="utf-8") as out:
        for number in range(first, first + count):
            faulthandler.dump_traceback_later(DEADLINE, exit=True)
            case = mutated(number)
            row = {"number": number, "source": case.source, "changes": case.changes}
            row |= {"level": type(case.content).__name__} | judged(case, Path(folder) / "mutated.toml")
            faulthandler.cancel_dump_traceback_later()
            out.write(json.dumps(row) + "\n")
            out.flush()


if __name__ == "__main__":
    if len(sys.argv) == 2:
        case = mutated(int(sys.argv[1]))
        with tempfile.TemporaryDirectory() as folder:
            outcome = judged(case, Path(folder) / "mutated.toml")
        print(case.source, *case.changes, case.content, outcome, sep="\n")
    else:
        main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
