"""Docstrings for autodoc: links in single backticks, fields with their meaning, short signatures.

A name in single backticks becomes a link if `ocp` exports it, else it is set as code.
"""

import re
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

import ocp

FIELD = re.compile(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*) : (\S.*)$")
ARRAY = re.compile(
    r"(?:numpy\.)?ndarray\[tuple\[(?:typing\.)?Any, (?:\.\.\.|…)\], "
    r"(?:numpy\.)?dtype\[(?:numpy\.)?float64\]\]"
)


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
        arguments = _without_long_defaults(ARRAY.sub("Array", arguments))
    if result:
        result = ARRAY.sub("Array", result)
    return arguments, result


def _without_long_defaults(arguments: str) -> str:
    """Dots in place of a default that is an object written out: its class says enough."""
    start = re.search(r" = (?=[A-Z]\w*\()", arguments)
    if start is None:
        return arguments
    depth, end = 0, start.end()
    while depth or arguments[end] != ")":
        depth += {"(": 1, ")": -1}.get(arguments[end], 0)
        end += 1
        if depth == 0 and arguments[end - 1] == ")":
            break
    return arguments[: start.end()] + "..." + _without_long_defaults(arguments[end:])


def _meanings(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Turn this project's "name : meaning." into numpydoc's name with the meaning below it.

    "name : type" with the meaning already below it stays: a type ends without a full stop, and
    what stands below it starts a sentence of its own.
    """
    done: list[str] = []
    position = 0
    while position < len(lines):
        line = lines[position]
        position += 1
        field = FIELD.match(line)
        if field is None:
            done.append(line)
            continue

        below = []
        while position < len(lines) and lines[position].startswith(" "):
            below.append(lines[position].strip())
            position += 1
        names, first = field.groups()
        if first.endswith(".") or (below and not below[0][0].isupper()):
            done += [names, "    " + " ".join([first, *below])]
        else:
            done += [line, *("    " + text for text in below)]
    lines[:] = done


def _readable(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Short types, and |x| as it is written: it is no substitution of reStructuredText."""
    short = [ARRAY.sub("Array", line) for line in lines]
    lines[:] = [line if "`" in line else line.replace("|", "\\|") for line in short]


def _skip(app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: Any) -> bool | None:
    """Leave out fields of named tuples, whose docstring says their number only."""
    return True if str(thing.__doc__).startswith("Alias for field number") else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the role `name`, to be used as the default role, and mend docstrings."""
    app.add_role("name", _name)
    app.connect("autodoc-process-signature", _short)
    app.connect("autodoc-process-docstring", _meanings, priority=400)  # before Napoleon
    app.connect("autodoc-process-docstring", _readable, priority=900)  # after it
    app.connect("autodoc-skip-member", _skip)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
