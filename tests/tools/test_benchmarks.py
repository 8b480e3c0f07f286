"""Baselines of the benchmarks give the same answers, and one that does not is not timed."""

from __future__ import annotations

import json

import numpy as np
import pytest

from support import ROOT

FEW = 3


@pytest.fixture(scope="module", autouse=True)
def _from_the_root():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT)
        yield


@pytest.fixture(scope="module")
def given():
    from benchmarks.states import states

    return states()


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("numpy", 3000),
        pytest.param("numba", 3000, marks=pytest.mark.slow),
        ("Pinocchio", FEW),
        ("MuJoCo", FEW),
        ("Exudyn", FEW),
    ],
)
def test_alternatives_give_the_same_answers(given, name, count):
    from benchmarks.comparison import alternative, difference
    from benchmarks.operations import Polypod

    try:
        kind = alternative(name)
    except ImportError as error:
        pytest.skip(str(error))
    some = given.sized(count)
    candidate = kind(some)
    for task in kind.tasks:
        found = getattr(candidate, task)()
        expected = getattr(Polypod(some), task)()
        assert len(found[0]) == count
        assert difference(found, expected) <= kind.tolerance, task


def test_another_answer_is_not_timed(given, monkeypatch):
    from benchmarks import timing
    from benchmarks.comparison import compare
    from benchmarks.operations import Polypod

    class Off(Polypod):
        count, tolerance = FEW, 1e-9

        def jacobian(self):
            (right,) = super().jacobian()
            wrong = right.copy()
            wrong[-1, 5, 2] += 2e-9 * np.abs(right).max()
            return (wrong,)

    class Missing(Off):
        def jacobian(self):
            return (np.full_like(super().jacobian()[0], np.nan),)

    class Close(Off):
        tolerance = 1e-8

    monkeypatch.setattr(Polypod, "count", FEW)
    monkeypatch.setattr(timing, "LEAST", 1e-5)
    known = {"Polypod": Polypod, "off": Off, "missing": Missing, "close": Close}
    rows = {row["name"]: row for row in compare("jacobian", known, given)}
    for name in ("off", "missing"):
        assert rows[name]["refused"] == "its answer differs"
        assert "median" not in rows[name]
    for name in ("Polypod", "close"):
        assert rows[name]["low"] <= rows[name]["median"] <= rows[name]["high"]
    assert rows["Polypod"]["ratio"] == 1.0


def test_candidates_take_turns(monkeypatch):
    from benchmarks import timing

    monkeypatch.setattr(timing, "LEAST", 0.0)
    order = []
    calls = {name: lambda name=name: order.append(name) for name in "ab"}
    found = timing.rounds(calls, {"a": 1, "b": 2}, runs=3)
    assert "".join(order[2:]) == "ababab"  # the first are for the number of repeats
    assert {name: len(times) for name, times in found.items()} == {"a": 3, "b": 3}


def test_the_page_is_that_of_the_results():
    from benchmarks import page

    results = json.loads((ROOT / "benchmarks/results.json").read_text(encoding="utf-8"))
    text = (ROOT / "docs/performance.md").read_text(encoding="utf-8")
    assert page.filled(text, results) == text
    assert text.count("<!-- measured:") == len(page.TABLES)


@pytest.mark.parametrize(
    ("nanoseconds", "text"),
    [
        (0.5, "0.5 ns"),
        (99.96, "100 ns"),
        (999.4, "999 ns"),
        (999.6, "1 µs"),
        (12345.0, "12.3 µs"),
        (2.5e9, "2.5 s"),
    ],
)
def test_times_have_three_digits(nanoseconds, text):
    from benchmarks import page

    assert page.time(nanoseconds) == text
