"""Mutated mechanism files: an error with a place, or a sound mechanism; never a crash, a hang or nonsense.

What happens to a file of a number is told by `support.fuzz_worker`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

import polypod as pp
from support import fuzz_worker
from support.fuzz_worker import DEADLINE, judged
from support.mutations import BYTES, DATA, TEXT, Case, mutated, sources

TESTS = Path(fuzz_worker.__file__).parents[1]
"""The folder whose `support.fuzz_worker` is run."""
FEW = 1500
MANY = 100_000
BATCHES = 40


def run(first: int, count: int, folder: Path) -> list[dict[str, Any]]:
    """Outcomes of `count` files; a crash or a hang of one is a result too."""
    results, rows = folder / f"{first}.jsonl", []
    results.touch()
    while len(rows) < count:
        left = count - len(rows)
        worker = [sys.executable, "-m", "support.fuzz_worker", *map(str, (first + len(rows), left, results))]
        done = subprocess.run(
            worker, cwd=TESTS, capture_output=True, text=True, timeout=left * DEADLINE, check=False
        )
        rows = [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()]
        if len(rows) < count:
            number = first + len(rows)
            row = {
                "number": number,
                "became": "died",
                "seconds": DEADLINE,
                "wrong": [done.stderr[-600:] or "died"],
            }
            rows.append(row)
            with results.open("a", encoding="utf-8") as out:
                out.write(json.dumps(row) + "\n")
    return rows


def check(rows: list[dict[str, Any]]) -> None:
    wrong = [row for row in rows if row["wrong"]]
    assert not wrong, json.dumps(wrong[:20], indent=1)


def test_a_few_files(tmp_path: Path) -> None:
    rows = run(0, FEW, tmp_path)
    check(rows)
    # They are neither all sound nor all broken, whatever they are made from.
    became = Counter((row["level"], row["became"]) for row in rows)
    assert all(became[level, "refused"] > 50 for level in ("bytes", "str", "dict")), became
    assert all(became[level, "loaded"] > 20 for level in ("bytes", "str", "dict")), became
    assert {row["source"] for row in rows} == set(sources())
    used = {change for row in rows for change in row["changes"]}
    assert used == {change.__name__ for change in (*BYTES, *TEXT, *DATA)}


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(BATCHES))
def test_many_files(batch: int, tmp_path: Path) -> None:
    count = MANY // BATCHES
    check(run(batch * count, count, tmp_path))


# --- the test itself ----------------------------------------------------------------------------------------


def test_files_are_the_same_every_time() -> None:
    numbers = range(60)
    assert [repr(mutated(n)) for n in numbers] == [repr(mutated(n)) for n in numbers]


def test_a_crash_and_a_hang_are_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a worker that never gets beyond the second file."""
    (tmp_path / "support").mkdir()
    (tmp_path / "support" / "fuzz_worker.py").write_text(
        "import sys, json, os\n"
        "first, count, results = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]\n"
        "for n in range(first, first + count):\n"
        "    if n == 1: os.abort()\n"
        "    open(results, 'a').write(json.dumps({'number': n, 'wrong': []}) + '\\n')\n",
        encoding="utf-8",
    )
    monkeypatch.setattr(sys.modules[__name__], "TESTS", tmp_path)
    rows = run(0, 3, tmp_path)
    assert [(row["number"], bool(row["wrong"])) for row in rows] == [(0, False), (1, True), (2, False)]


@pytest.mark.parametrize("name", sorted(sources()))
def test_sound_files_pass_all_checks(name: str, tmp_path: Path) -> None:
    found = judged(Case(name, (), sources()[name]), tmp_path / "file.toml")
    assert (found["became"], found["wrong"]) == ("loaded", [])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mass = 6", "mass = 7"),
        ("position = [0, 0, 500]", "position = [0, 0, 501]"),
        (
            'joint = "R", point = { radius = 250, angle = 0 }',
            'joint = "R", point = { radius = 251, angle = 0 }',
        ),
        ("max = 640", "max = 641"),
        ("center = 140", "center = 141"),
        ("[load]", "[lod]"),
    ],
)
def test_the_checks_see_a_difference(old: str, new: str) -> None:
    """A mechanism beside the content of another file."""
    import tomllib

    from support.sane import nonsense

    text = sources()["polypod/template.toml"]
    assert old in text
    assert nonsense(pp.Mechanism.from_toml(text), tomllib.loads(text.replace(old, new)))
