"""A verification in words, and as a table in Markdown."""

from __future__ import annotations

from typing import Any


def verdict(facts: dict[str, Any], engine: dict[str, Any]) -> str:
    """One line on one engine of `Verification.facts`."""
    tolerance = f"{facts['tolerance']:.1g}"
    words = f"{engine['engine']}: {engine['compared']} of {engine['states']} states compared"
    over = [row["title"] for row in engine["quantities"] if not row["agrees"]]
    if over:
        words += f"; beyond {tolerance}: {', '.join(over)}"
    elif engine["compared"]:
        words += f"; all errors within {tolerance}"
    if engine["without_answer"]:
        reasons = (f"{count} of {who}" for who, count in engine["without_answer"].items())
        words += f"; without answer: {', '.join(reasons)}"
    return words + "."


def as_markdown(facts: dict[str, Any]) -> str:
    """The tables of `Verification.facts`, one for each engine."""
    parts = []
    for engine in facts["engines"]:
        rows = "\n".join(
            f"| {row['title']} / {row['unit']} | {_number(row['max'])} | {_number(row['rms'])} "
            f"| {_number(row['relative_max'])} | {_number(row['relative_rms'])} | {_worst(row['worst'])} |"
            for row in engine["quantities"]
        )
        parts.append(
            f"""| against {engine["engine"]} {engine["version"]} | max | rms | relative max | rms | worst at |
|---|---|---|---|---|---|
{rows}

{verdict(facts, engine)}"""
        )
    return "\n\n".join([*parts, f"Relative errors are relative to {facts['relative_to']}."])


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.1e}"


def _worst(worst: dict[str, Any]) -> str:
    """Time, or number of the state, and leg or rod."""
    at = f"state {worst['state']}" if worst["time"] is None else f"{worst['time']:g} s"
    return f"{at}, {worst['part']}" if worst["part"] else at
