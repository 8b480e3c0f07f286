"""The glossary: what it explains, by which words, and where messages point into it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import tomli_w

import polypod as pp
from polypod.errors import PolypodError
from polypod.summary import glossary

DOCS = Path(__file__).parents[2] / "docs"


def test_every_synonym_stands_for_a_term() -> None:
    terms = {entry.term.casefold() for entry in glossary.entries()}
    assert len(terms) == len(glossary.entries()) > 90
    strays = {word: term for word, term in glossary.synonyms().items() if term.casefold() not in terms}
    assert strays == {}
    assert len(glossary.synonyms()) > 150


def test_every_term_has_a_meaning_without_links() -> None:
    for entry in glossary.entries():
        assert len(entry.meaning) > 20, entry
        assert "](" not in entry.meaning, entry


@pytest.mark.parametrize(
    ("said", "term"),
    [
        ("Assembly mode", "Assembly mode"),
        ("assembly  MODE", "Assembly mode"),
        ("type 2", "Direct singularity"),
        ("Gimbal lock", "Passive-leg singularity"),
        ("preload", "Preferred forces"),
    ],
)
def test_terms_are_found_by_the_words_of_the_literature(said: str, term: str) -> None:
    message, entries = glossary.explain(said)
    assert message == ""
    assert [entry.term for entry in entries] == [term]


@pytest.mark.parametrize("flag", [*pp.Status, *pp.SingularityKind])
def test_every_status_and_kind_is_explained(flag: pp.Status | pp.SingularityKind) -> None:
    if flag in (pp.Status.OK, pp.SingularityKind.UNKNOWN, pp.SingularityKind.NONE):
        return
    message, _ = glossary.explain(flag.name)
    assert message == f"{flag.name}: {flag.message}."


def test_a_status_names_its_terms() -> None:
    named = {
        status.name: [e.term for e in glossary.explain(status.name)[1]] for status in pp.Status if status
    }
    assert "Fold" in named["FOLD"]
    assert named["OUT_OF_STROKE"] == ["Stroke"]
    assert "Assembly mode" in named["MODE_JUMP"]


def test_unknown_terms_are_refused_with_the_nearest() -> None:
    with pytest.raises(PolypodError, match=r'no term "assembly moed"; near to it: Assembly mode.*lists all'):
        glossary.explain("assembly moed")
    with pytest.raises(PolypodError, match=r'no term "qqqq"; `polypod explain`'):
        glossary.explain("qqqq")


def test_terms_in_a_text_are_those_of_several_words() -> None:
    text = "5 actuated legs for 6 degrees of freedom; the home pose is a base"
    assert glossary.terms_in(text) == ("Actuated leg", "Degree of freedom", "Home pose")
    assert glossary.terms_in("no such file") == ()


def test_the_docs_name_only_terms_that_there_are() -> None:
    anchors = {re.sub(r"[^\w\- ]", "", e.term.casefold()).replace(" ", "-") for e in glossary.entries()}
    asked = {
        anchor
        for page in DOCS.glob("**/*.md")
        for anchor in re.findall(r"glossary\.md#([\w-]+)", page.read_text(encoding="utf-8"))
    }
    assert asked
    assert asked <= anchors


def test_the_command_explains_and_lists(run) -> None:
    status, out, err = run("explain", "fold")
    assert (status, err) == (0, "")
    assert out.startswith("FOLD: the coordinates do not determine")
    assert "turning point" in out.replace("\n", " ")
    status, out, err = run("explain")
    assert (status, err) == (0, "")
    assert "Assembly mode" in out
    status, out, err = run("explain", "--json", "stroke")
    assert json.loads(out)["entries"][0]["term"] == "Stroke"
    status, out, err = run("explain", "foldd")
    assert (status, out) == (2, "")
    assert "near to it: FOLD" in err


def test_a_fault_says_where_its_terms_are_explained(run, tmp_path: Path) -> None:
    data = pp.load("ups-hexapod").to_dict()
    data["legs"][0]["actuated"] = False
    (tmp_path / "five.toml").write_text(tomli_w.dumps(data), encoding="utf-8")
    status, _, err = run("info", str(tmp_path / "five.toml"))
    assert status == 2
    assert re.search(r'\nTerms: polypod explain "\w', err)


def test_outcomes_say_where_they_are_explained(run, tmp_path: Path) -> None:
    mech = pp.load("lu-3spu-2rpu-r")
    home = mech.coordinates(mech.home, "paper")
    at = [home[name] for name in ("x", "y", "z", "alpha", "beta")]
    rows = [("time [s]", "x [m]", "y [m]", "z [m]", "alpha [rad]", "beta [rad]"), (0.0, *at)]
    rows.append((1.0, *at[:2], at[2] + 10.0, *at[3:]))
    (tmp_path / "far.csv").write_text("\n".join(",".join(map(str, row)) for row in rows), encoding="utf-8")
    _, out, err = run("solve", "lu-3spu-2rpu-r", tmp_path / "far.csv", "-o", tmp_path / "r.csv")
    assert err == ""
    assert re.search(r"What they mean: polypod explain [A-Z_]+\n", out)
