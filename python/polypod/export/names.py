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

    def __init__(self, labels: Mapping[str, str] | None = None) -> None:
        self._labels = labels or {}
        self._given: dict[str, str] = {}
        self._taken = set(RESERVED)

    def __call__(self, name: str) -> str:
        """The legal name for a name: the same whenever it is asked for, and no other's."""
        if name not in self._given:
            wanted = legal(self._labels.get(name, name))
            found, number = wanted, 2
            while found in self._taken:
                found, number = f"{wanted}_{number}", number + 1
            self._taken.add(found)
            self._given[name] = found
        return self._given[name]

    def changed(self) -> dict[str, str]:
        """What is not only spaces that became `_`: names of the mechanism file by the new ones."""
        labels = {given: self._labels.get(name, name) for name, given in self._given.items()}
        return {given: label for given, label in labels.items() if given != label.replace(" ", "_")}


def legal(name: str) -> str:
    """A name of ASCII letters, digits and `_`, as like the given one as can be."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")
    return plain if plain[:1].isalpha() else f"x_{plain}".rstrip("_")


def add_comment(root: ElementTree.Element, text: str) -> None:
    """A comment as the first thing in an element; what XML forbids in comments is written otherwise."""
    safe = "".join(c if c == "\n" or c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    while "--" in safe:
        safe = safe.replace("--", "- -")
    root.insert(0, ElementTree.Comment(f"\n{safe}\n"))


def xml(root: ElementTree.Element) -> str:
    """The text of an XML file, indented."""
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'
