"""Formulas as MathML, which browsers draw by themselves: LaTeX between dollars in a line, or in a block `math`."""

import html as markup
import re

from math_core import LatexToMathML

FORMULA = re.compile(r'<(div|span) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(html: str, **_: object) -> str:
    """The page with each formula drawn; `math_core.LatexError` where one is not LaTeX."""
    converter = LatexToMathML()

    def drawn(formula: re.Match[str]) -> str:
        element, latex = formula[1], markup.unescape(formula[2])
        # What the search shows of a page has no place for fractions and the like.
        mark, displayed = (" data-search-exclude", True) if element == "div" else ("", False)
        mathml = converter.convert_with_local_state(latex, displaystyle=displayed)
        return f'<{element} class="arithmatex"{mark}>{mathml}</{element}>'

    return FORMULA.sub(drawn, html)
