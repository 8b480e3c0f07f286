"""A verification in words, and as a table in Markdown."""

from __future__ import annotations

from typing import Any


def verdict(facts: dict[str, Any], engine: dict[str, Any]) -> str:
    """One line on one engine of `Verification.facts`."""
    tolerances = sorted({row["tolerance"] for row in engine["quantities"]}) or [facts["tolerance"]]
    tolerance = f"{max(tolerances):.1g}"
    words = f"{engine['engine']}: {engine['compared']} of {engine['states']} states compared"
    over = [row["title"] for row in engine["quantities"] if not row["agrees"]]
    if over:
        words += f"; beyond {tolerance}: {', '.join(over)}"
    elif engine["compared"]:
        words += f"; all errors within {tolerance}"
    if any(row["approximate"] for row in engine["quantities"]):
        words += f" (≈ approximate engine, tolerance {tolerance} of its own)"
    if engine["without_answer"]:
        reasons = (f"{count} of {who}" for who, count in engine["without_answer"].items())
        words += f"; without answer: {', '.join(reasons)}"
    return words + "."


def as_markdown(facts: dict[str, Any]) -> str:
    """The tables of `Verification.facts`, one for each engine."""
    parts = []
    for engine in facts["engines"]:
        rows = "\n".join(
            f"| {'≈ ' * row['approximate']}{row['title']} / {row['unit']} "
            f"| {_number(row['max'])} | {_number(row['rms'])} "
            f"| {_number(row['relative_max'])} | {_number(row['relative_rms'])} | {_worst(row['worst'])} |"
            for row in engine["quantities"]
        )
        parts.append(
            f"""| against {engine["engine"]} {engine["version"]} | max | rms | relative max | rms | worst at |
|---|---|---|---|---|---|
{rows}

{" ".join([verdict(facts, engine), *engine["notes"]])}"""
        )
    return "\n\n".join([*parts, f"Relative errors are relative to {facts['relative_to']}."])


def integration_verdict(facts: dict[str, Any]) -> str:
    """One line on `Integration.facts`."""
    words = f"Exudyn: {facts['completed']} of {facts['pieces']} pieces of {facts['piece']:.3g} s integrated"
    if facts["rest"] is None:
        return words + "."
    rest = facts["rest"]
    left = f"{rest['position']:.1e} m, {rest['rotation']:.1e} rad, legs {rest['lengths']:.1e} m"
    words += f"; left at step zero, extrapolated: {left}"
    if not facts["agrees"]:
        words += (
            f"; the motion does not come out (limit {facts['limit']:.1g} of lengths and radians, order 2)"
        )
    return words + "."


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.1e}"


def _worst(worst: dict[str, Any]) -> str:
    """Time, or number of the state, and leg or rod."""
    at = f"state {worst['state']}" if worst["time"] is None else f"{worst['time']:g} s"
    return f"{at}, {worst['part']}" if worst["part"] else at
