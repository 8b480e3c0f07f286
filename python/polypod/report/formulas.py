"""The formulas of the figures' texts as HTML: what `polypod.plots` writes for matplotlib, and no more."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

_SYMBOLS = {
    "alpha": "α",
    "beta": "β",
    "gamma": "γ",
    "delta": "δ",
    "varepsilon": "ε",
    "omega": "ω",
    "phi": "φ",
    "psi": "ψ",
    "sigma": "σ",
}
_TOKEN = re.compile(r"\\mathrm\{|\\[a-zA-Z]+|\\.|[_^]|[{}]|[^\\_^{}]")


def to_html(text: str) -> Markup:
    """Text with formulas between $ as HTML: letters of formulas in italics, indices and powers as such."""
    parts = text.split("$")
    return Markup("").join(escape(part) if i % 2 == 0 else _formula(part) for i, part in enumerate(parts))


def _formula(text: str) -> Markup:
    tokens = _TOKEN.findall(text)
    html = Markup("")
    while tokens:
        html += _next(tokens, upright=False)
    return html


def _next(tokens: list[str], upright: bool) -> Markup:
    """The HTML of the next token, or of the group that it begins; takes them away."""
    token = tokens.pop(0)
    if token in ("_", "^") and tokens:
        tag = "sub" if token == "_" else "sup"
        return Markup("<{0}>{1}</{0}>").format(tag, _next(tokens, upright))
    if token in ("{", "\\mathrm{"):
        group = Markup("")
        while tokens and tokens[0] != "}":
            group += _next(tokens, upright or token != "{")
        if tokens:
            tokens.pop(0)
        return group
    if token.startswith("\\"):
        name = token[1:]
        token = _SYMBOLS.get(name, name)
    if token == "-":
        token = "−"
    return Markup("<i>{}</i>").format(token) if token.isalpha() and not upright else escape(token)
