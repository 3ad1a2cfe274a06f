"""Formulas as MathML, which browsers draw themselves: no script and no font is fetched."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

# TeX takes one digit each; docutils takes the whole number, and puts an index below a dot
MISREAD = re.compile(r"\\[dt]?frac\s*\d\d|\\d*dot(\\\w+|\{\\?\w+\})_")


def _mathml(node: nodes.math | nodes.math_block, as_block: bool) -> str:
    """A formula as MathML; one that docutils reads otherwise than TeX is refused."""
    tex = node.astext()
    if found := MISREAD.search(tex):
        raise ExtensionError(f"{tex}: {found[0]} needs braces: \\frac{{1}}{{2}}, \\dot{{x_0}}")
    return str(tex2mathml(tex, as_block=as_block))


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_mathml(node, as_block=False))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    formula = _mathml(node, as_block=True)
    translator.body.append(f'<div class="math">{formula}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer under the name `mathml`."""
    app.add_html_math_renderer(
        "mathml",
        inline_renderers=(_inline, None),
        block_renderers=(_display, None),
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}
