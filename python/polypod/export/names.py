"""Names that a format takes, and words that it takes in comments."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from xml.etree import ElementTree

RESERVED = {"world"}
"""Names that mean something else to some reader."""


class Names:
    """Legal and unique names for what a model consists of: ASCII letters, digits and `_`, a letter first."""

    def __init__(self, labels: Mapping[tuple[str, str], str] | None = None, longest: int = 255) -> None:
        self._labels, self._longest = labels or {}, longest
        self._given: dict[tuple[str, str], str] = {}
        self._taken = set(RESERVED)

    def __call__(self, kind: str, name: str) -> str:
        """The legal name for a thing of a kind: the same whenever it is asked for, and no other's."""
        key = (kind, name)
        if key not in self._given:
            wanted = legal(self._labels.get(key, name))
            found, number = wanted[: self._longest], 2
            while found in self._taken:
                end = f"_{number}"
                found, number = wanted[: self._longest - len(end)] + end, number + 1
            self._taken.add(found)
            self._given[key] = found
        return self._given[key]

    def changed(self, kind: str) -> dict[str, str]:
        """Names of a kind by the legal ones, where more changed than spaces that became `_`."""
        of = {given: self._labels.get(key, key[1]) for key, given in self._given.items() if key[0] == kind}
        return {given: name for given, name in of.items() if given != name.replace(" ", "_")}


def legal(name: str) -> str:
    """A name of ASCII letters, digits and `_`, as like the given one as can be."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")
    return plain if plain[:1].isalpha() else f"x_{plain}".rstrip("_")


def add_comment(root: ElementTree.Element, text: str) -> None:
    """A comment as the first thing in an element; two hyphens, which XML forbids in it, are set apart."""
    while "--" in text:
        text = text.replace("--", "- -")
    root.insert(0, ElementTree.Comment(f"\n{text}\n"))


def printable(text: str) -> str:
    """One line of text without characters that XML or YAML forbid."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def xml(root: ElementTree.Element) -> str:
    """The text of an XML file, indented."""
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'
