"""The glossary: terms, and the literature's words for them."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from polypod.answers.singularity_kind import SingularityKind
from polypod.answers.status import Status
from polypod.errors import PolypodError, shown

_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_NEAR = 5
"""Names that the message about an unknown one lists."""


@dataclass(frozen=True)
class Entry:
    """A term with its meaning, in Markdown without links, and the part of the glossary that it stands in."""

    term: str
    part: str
    meaning: str


@cache
def entries() -> tuple[Entry, ...]:
    """All terms, in the order of the glossary."""
    found = []
    for part in _text().split("\n## ")[1:]:
        title, _, rest = part.partition("\n")
        for entry in rest.split("\n### ")[1:]:
            term, _, meaning = entry.partition("\n")
            found.append(Entry(term.strip(), title.strip(), _LINK.sub(r"\1", meaning).strip()))
    return tuple(found)


@cache
def synonyms() -> dict[str, str]:
    """The literature's words, and the terms that they stand for."""
    words = _text().partition("## From the literature's words\n")[2].partition("\n## ")[0]
    pairs = (pair.partition(": [") for pair in words.replace("\n\n", " · ").split("·"))
    return {
        " ".join(word.split()): " ".join(term.partition("]")[0].split()) for word, _, term in pairs if term
    }


def explain(name: str) -> tuple[str, tuple[Entry, ...]]:
    """What a word means: of a status or a kind of singularity its message, and the entries for it.

    Args:
        name: A term, one of the literature's words for one, or the name of a `Status` or a `SingularityKind`;
            in capitals or not.

    Returns:
        The message, empty where there is none, and the entries, none where no term is named after it.

    Raises:
        PolypodError: If it is none of these; the message lists the nearest.
    """
    wanted = _plain(name)
    for flags, text in ((Status, "Status.{}"), (SingularityKind, "{}")):
        for flag in flags:
            if _plain(flag.name) == wanted and flag not in (Status.OK, SingularityKind.UNKNOWN):
                mark = f"`{text.format(flag.name)}`"
                named = tuple(e for e in entries() if mark in e.meaning or _plain(e.term) == wanted)
                return f"{flag.name}: {flag.message}.", named
    terms = {_plain(entry.term): entry for entry in entries()}
    term = {_plain(word): _plain(term) for word, term in synonyms().items()}.get(wanted, wanted)
    if term in terms:
        return "", (terms[term],)
    near = ", ".join(_nearest(name))
    hint = f"; near to it: {near}" if near else ""
    raise PolypodError(f"the glossary has no term {shown(name)}{hint}; `polypod explain` lists all terms")


def terms_in(text: str) -> tuple[str, ...]:
    """Terms of more than one word that a text has, singular or plural, in the text's order."""
    places = []
    for entry in entries():
        words = entry.term.split()
        pattern = r"\s+".join(rf"{re.escape(word)}s?" for word in words)
        if len(words) > 1 and (match := re.search(rf"\b{pattern}\b", text, re.IGNORECASE)):
            places.append((match.start(), entry.term))
    return tuple(term for _, term in sorted(places))


def _nearest(name: str) -> list[str]:
    names = [entry.term for entry in entries()] + list(synonyms())
    names += [flag.name for flags in (Status, SingularityKind) for flag in flags]
    plain = {_plain(known): known for known in names}
    return [plain[near] for near in difflib.get_close_matches(_plain(name), plain, n=_NEAR, cutoff=0.4)]


def _plain(name: str) -> str:
    return " ".join(name.replace("_", " ").casefold().split())


@cache
def _text() -> str:
    return (files("polypod.summary") / "glossary.md").read_text(encoding="utf-8")
