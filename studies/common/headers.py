"""Texts above an exported table: the one place where they are written, for every format.

A title or a question may come from a file of somebody else. Wherever it ends up, it stays one line,
ends no comment, and begins no cell of a spreadsheet that would be worked out as a formula.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

# of C, structured text and nested comments of both
_ENDS_OF_COMMENTS = re.compile(r"/(?=\*)|\*(?=[/)])|\((?=\*)")
SEPARATORS = (
    ",;|\t"  # at which a spreadsheet may begin a cell, whatever separates those of the rows
)
_CELL = re.compile(rf"(^|[{SEPARATORS}])(\s*)(?=[=+\-@])")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*($|[,;|\t])")


def one_line(text: Any) -> str:
    """A text without line breaks, other control characters and ends of comments."""
    printable = "".join(sign if sign.isprintable() else " " for sign in str(text))
    words = " ".join(printable.split())
    return _ENDS_OF_COMMENTS.sub(lambda found: found[0] + " ", words)


def cell(text: Any) -> str:
    """The same, with an apostrophe before each place where a spreadsheet would read a formula."""
    line = one_line(text)

    def quoted(found: re.Match[str]) -> str:
        number = _NUMBER.match(line, found.end())
        return found[0] if number else f"{found[1]}{found[2]}'"

    return _CELL.sub(quoted, line)


def comments(about: Mapping[str, Any], opening: str = "# ") -> list[str]:
    """A line `name = text` for each, behind the sign that opens a comment."""
    return [f"{opening}{cell(name)} = {cell(text)}" for name, text in about.items()]
