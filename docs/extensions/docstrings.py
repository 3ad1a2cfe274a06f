"""Docstrings of the engine: links in single backticks, signatures that can be read.

A name in single backticks becomes a link if `ocp` exports it, else it is set as code.
"""

import re
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

import ocp


def _name(
    role: str, raw: str, text: str, line: int, inliner: Any, *_: Any
) -> tuple[list[nodes.Node], list[nodes.system_message]]:
    """Role of single backticks in docstrings."""
    name, _, rest = text.removeprefix("ocp.").partition("(")
    literal = nodes.literal(text, text)
    if rest or name.partition(".")[0] not in ocp.__all__:
        return [literal], []
    reference = addnodes.pending_xref(
        text,
        literal,
        refdomain="py",
        reftype="obj",
        reftarget=f"ocp.{name}",
        refexplicit=True,
        refwarn="." not in name,
        refdoc=inliner.document.settings.env.current_document.docname,
    )
    return [reference], []


def _short(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, arguments: str, result: str
) -> tuple[str | None, str | None]:
    """Class names without their modules, where a default keeps autodoc from parsing them."""
    if arguments:
        arguments = re.sub(r"~[\w.]*\.(\w+)", r"\1", arguments).replace("<factory>", "...")
    return arguments, result


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the role `name`, to be used as the default role."""
    app.add_role("name", _name)
    app.connect("autodoc-process-signature", _short)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
