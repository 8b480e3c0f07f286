"""Build hook: the site's TeX formulas become MathML, so that reading them needs no script and no network."""

import re
from html import unescape
from typing import Any

from math_core import LatexToMathML

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
converter = LatexToMathML()


def mathml(formula: re.Match[str]) -> str:
    r"""One formula as MathML; a displayed one keeps its `\tag` as its number."""
    element, bracket, tex = formula[1], formula[2], unescape(formula[3]).strip()
    if r"\tag" in tex:
        tex = rf"\begin{{equation}}{tex}\end{{equation}}"
    text = converter.convert_with_local_state(tex, displaystyle=bracket == "[")
    return f'<{element} class="arithmatex">{text}</{element}>'


def on_page_content(html: str, **_: Any) -> str:
    """The page with its formulas as MathML; a formula that is not valid TeX stops the build."""
    return FORMULA.sub(mathml, html)
