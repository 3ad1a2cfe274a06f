"""Pages from templates of Jinja2: what is put into them is escaped, and typeset as text."""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from markupsafe import Markup

from studies.report import assets

if TYPE_CHECKING:
    import jinja2

TEMPLATES = Path(__file__).parent / "templates"
MARK = "antenna-ocp report"  # by which a page is known as ours
SVG, XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
_NO_BREAK = "\u00a0"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([-+]?\d+)\b")
# a number with its unit, such as "12 N m s" or "0.5 rad/s²"
_UNIT = r"(?:%|(?:mm|m|s|N|J|W|kg|g|rad|deg|Hz|Pa|MPa|GPa)[²³]?(?:/\w+[²³]?)?(?![\w²³]))"
_QUANTITY = re.compile(rf"\d(?: {_UNIT})+")


def document(template: str, title: str, data: Mapping[str, Any] | None, **values: Any) -> str:
    """A whole document with styles, scripts and the policy that forbids anything else.

    Parameters
    ----------
    template : its file in `templates`.
    data : what its script reads; without any it has none.
    values : what the template takes.
    """
    script = assets.scripts() if data is not None else ""
    # a data block is no script; "<" could still end it
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return (
        _environment()
        .get_template(template)
        .render(
            title=title,
            policy=assets.policy(script),
            mark=MARK,
            styles=assets.styles(),
            script=script,
            data=text if data is not None else "",
            **values,
        )
    )


@functools.cache
def _environment() -> jinja2.Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    from studies.report import words
    from studies.report.still import chart_picture

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        finalize=_typeset,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"sentence": sentence, "identifier": identifier}
    environment.globals |= {
        "chart_picture": chart_picture,
        "first_upper": first_upper,
        "words": words,
    }
    return environment


def _typeset(value: Any) -> Any:
    """Squares and cubes of units in a text; what is escaped already is to be copied as it is."""
    return superscripts(value) if isinstance(value, str) and type(value) is not Markup else value


def superscripts(text: str) -> str:
    """Squares and cubes of units as such."""
    return re.sub(r"(?<=[A-Za-z])\^([23])(?!\d)", lambda found: "²³"[int(found[1]) - 2], text)


def sentence(text: str) -> str:
    """The same; powers of ten are written as such too, and a number keeps its unit on its line."""
    text = _QUANTITY.sub(lambda found: found[0].replace(" ", _NO_BREAK), superscripts(text))
    return _POWER.sub(_power_of_ten, text)


def _power_of_ten(found: re.Match[str]) -> str:
    power = str(int(found[2])).translate(_RAISED)
    return f"{found[1]}{_NO_BREAK}×{_NO_BREAK}10{power}"


def first_upper(text: str) -> str:
    """A text whose first letter is a capital one; the others stay."""
    return f"{text[:1].upper()}{text[1:]}"


def from_svg(text: str, title: str) -> Markup:
    """An SVG document as a part of a page: without its namespaces, metadata and size."""
    root = ElementTree.fromstring(text)
    for node in root.iter():
        node.tag = node.tag.removeprefix(SVG)
        for name in list(node.attrib):
            if name.startswith(XLINK):
                node.set(name.removeprefix(XLINK), node.attrib.pop(name))
        if node.text and node.tag != "style":
            node.text = superscripts(node.text)
    for found in root.findall("metadata"):
        root.remove(found)
    for name in ("width", "height"):
        root.attrib.pop(name, None)
    root.attrib |= {"role": "img", "aria-label": title}
    return Markup(ElementTree.tostring(root, encoding="unicode", method="html"))


def identifier(text: str) -> str:
    """A text as an identifier of a page."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "part"
