"""A sentence of the paper with its measures and verdict, and how numbers are written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from polypod.answers.answer import Array
from polypod.paper.sentences.poses import Quantile, quantile

_ROUNDING = 1e-9
"""Below it a pure number is written as 0."""


class Verdict(StrEnum):
    """What the measures say of a sentence."""

    TRUE = "true"
    PARTLY = "true in part"
    FALSE = "false in general"
    OPEN = "cannot be judged"


@dataclass(frozen=True)
class Sentence:
    """A statement of the paper and what was measured of it."""

    place: str
    """Sections of the paper."""
    words: str
    """A few of its words."""
    findings: tuple[tuple[str, str], ...]
    """Measures, each with its number and unit; none where there is nothing to measure."""
    verdict: Verdict
    reason: str


def as_markdown(sentences: Iterable[Sentence]) -> str:
    """The sentences as a table: a row for each measure, the verdict in the first of a sentence."""
    lines = ["| sentence | measure | number | verdict |", "|---|---|---|---|"]
    for sentence in sentences:
        first = f"{sentence.place}: “{sentence.words}”"
        last = f"**{sentence.verdict}**: {sentence.reason}"
        for measure, number in sentence.findings or (("none", ""),):
            lines.append(f"| {first} | {measure} | {number} | {last} |")
            first = last = ""
    return "\n".join(lines)


def known(values: Array) -> Array:
    """Those that are numbers."""
    return values[np.isfinite(values)]


def spread(values: Array) -> str:
    """The least, the greatest and the median of pure numbers."""
    return f"{values.min():.2f} to {values.max():.2f}, median {np.median(values):.2f}"


def with_error(of: Quantile, spec: str = ".2f") -> str:
    """A quantile with its interval."""
    return f"{of.value:{spec}} ({of.low:{spec}} to {of.high:{spec}})"


def median_and_tail(values: Array) -> str:
    """Median, the value that 95 % stay below, and the greatest of the samples."""
    middle, high = (quantile(values, share) for share in (0.5, 0.95))
    told = (with_error(of, ".3f") for of in (middle, high))
    return "median {}, 95 % below {}".format(*told) + f", greatest {values.max():.2g}"


def percent(share: float, count: int) -> str:
    """A share of independent samples with twice its standard error."""
    return f"{100 * share:.1f} ± {200 * np.sqrt(share * (1 - share) / count):.1f} %"


def span(values: Array, spec: str = ".0f") -> str:
    """From the least to the greatest."""
    return f"{values.min():{spec}} to {values.max():{spec}}"


def tens(metres: float) -> str:
    """Of mm, for what a grid of 20 mm resolves."""
    return f"{10 * round(1e2 * metres)}"


def kilo(value: float) -> str:
    """In kN or kN m."""
    return f"{value / 1e3:.1f}"


def size(value: float) -> str:
    """Of a pure number that should vanish."""
    return "0" if value < _ROUNDING else f"{value:.1g}"
