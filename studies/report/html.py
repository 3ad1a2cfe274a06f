"""Elements of a page. All text is escaped when the tree is written: nothing is glued together."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from xml.etree import ElementTree

Element = ElementTree.Element
Content = str | Element | None | Iterable["Content"]

SVG = "{http://www.w3.org/2000/svg}"
_AS_IT_IS = ("pre", "script", "style")
_SENTENCES = ("h1", "p", "li")
_NO_BREAK = "\u00a0"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([-+]?\d+)\b")
# a number with its unit, such as "12 N m s" or "0.5 rad/s²"
_UNIT = r"(?:%|(?:mm|m|s|N|J|W|kg|g|rad|deg|Hz|Pa|MPa|GPa)[²³]?(?:/\w+[²³]?)?(?![\w²³]))"
_QUANTITY = re.compile(rf"\d(?: {_UNIT})+")
XLINK = "{http://www.w3.org/1999/xlink}"


def element(tag: str, *content: Content, **attributes: str | bool | None) -> Element:
    """An element with text and elements in it.

    Attributes that are None or False are left out; `class_` and the like lose their underscore,
    and others become hyphens.
    """
    made = Element(tag)
    for name, value in attributes.items():
        if value is not None and value is not False:
            made.set(name.rstrip("_").replace("_", "-"), "" if value is True else str(value))
    _fill(made, content)
    return made


def _fill(parent: Element, content: Content) -> None:
    if content is None:
        return
    if isinstance(content, str):
        if len(parent):
            parent[-1].tail = (parent[-1].tail or "") + content
        else:
            parent.text = (parent.text or "") + content
    elif isinstance(content, Element):
        parent.append(content)
    else:
        for part in content:
            _fill(parent, part)


def typeset(tree: Element) -> None:
    """Write squares and cubes of units as such, but in what is to be copied as it is.

    In sentences powers of ten are written as such too, and a number keeps its unit on its line.
    """
    for node in tree.iter():
        if node.tag in _AS_IT_IS:
            continue
        change = _sentence if node.tag in _SENTENCES else _superscripts
        if node.text:
            node.text = change(node.text)
        for child in node:
            if child.tail:
                child.tail = change(child.tail)


def _superscripts(text: str) -> str:
    return re.sub(r"(?<=[A-Za-z])\^([23])(?!\d)", lambda found: "²³"[int(found[1]) - 2], text)


def _sentence(text: str) -> str:
    text = _QUANTITY.sub(lambda found: found[0].replace(" ", _NO_BREAK), _superscripts(text))
    return _POWER.sub(_power_of_ten, text)


def _power_of_ten(found: re.Match[str]) -> str:
    power = str(int(found[2])).translate(_RAISED)
    return f"{found[1]}{_NO_BREAK}×{_NO_BREAK}10{power}"


def written(tree: Element) -> str:
    """A tree as HTML."""
    return ElementTree.tostring(tree, encoding="unicode", method="html")


def table(
    caption: str,
    head: Sequence[str],
    rows: Sequence[Sequence[Content]],
    *,
    key: str,
    notes: Sequence[str] = (),
    classes: Sequence[str] = (),
) -> Element:
    """A table whose first column names its rows, with room for the buttons of the page's script.

    Parameters
    ----------
    key : name of the file that its CSV button saves.
    classes : of the rows, where they have any.
    """
    classes = classes or [""] * len(rows)
    body = [
        element(
            "tr",
            element("th", cells[0], scope="row"),
            [element("td", cell) for cell in cells[1:]],
            class_=row_class or None,
        )
        for cells, row_class in zip(rows, classes, strict=True)
    ]
    made = element(
        "table",
        element("caption", caption),
        element("thead", element("tr", [element("th", title, scope="col") for title in head])),
        element("tbody", body),
        id=key,
    )
    return element(
        "div",
        element("div", made, class_="scroll", tabindex="0", role="region", aria_label=caption),
        [element("p", note, class_="note") for note in notes],
        class_="table",
        data_file=key,
    )


def from_svg(text: str) -> Element:
    """An SVG document as an element of a page: without its namespaces and its metadata."""
    root = ElementTree.fromstring(text)
    for node in root.iter():
        node.tag = node.tag.removeprefix(SVG)
        for name in list(node.attrib):
            if name.startswith(XLINK):
                node.set(name.removeprefix(XLINK), node.attrib.pop(name))
    for node in root.findall("metadata"):
        root.remove(node)
    return root


def identifier(text: str) -> str:
    """A text as an identifier of a page."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "part"
