"""Text with columns, in the dialects that people and instruments write.

Separators (comma, semicolon, tab, bar, blanks), decimal commas, byte-order marks, comments, blocks
above the header, and a row of units are recognised. The numbers are read in one pass that holds no
text, so that ten million rows fit into memory.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TextIO

import numpy as np

from ocp.arrays import Array
from studies.check.reading.layout import Layout, layout_of, number_of
from studies.check.reading.table import RawTable, refuse
from studies.common.exit_codes import quoted

SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars", None: "blanks"}
HEAD = 65536  # bytes from which a layout is told

# where the lines of a file end, and nowhere else: U+2028 or a form feed ends none
_LINES = re.compile(r"\r\n|\n|\r")
_COMMENT = re.compile(r"\s*(?:#(?!N/A|[A-Z0-9/]+[!?])|%|//)")  # errors of spreadsheets are none
_WIDE_BLANKS = re.compile(r"\t|\s{2,}")


@dataclass(frozen=True)
class Text:
    """A text that holds a table.

    Attributes
    ----------
    path : of its file.
    content : its bytes; None for those of the file.
    """

    path: Path
    content: bytes | None = None

    def stream(self) -> BinaryIO:
        """Its bytes from the first one on."""
        return self.path.open("rb") if self.content is None else io.BytesIO(self.content)


@dataclass(frozen=True)
class TextLayout:
    """How a text writes its table.

    Attributes
    ----------
    encoding : of the file.
    separator : between cells; None stands for any blanks.
    decimal : sign of the decimals.
    table : where it stands among the lines.
    """

    encoding: str
    separator: str | None
    decimal: str
    table: Layout

    def __str__(self) -> str:
        decimal = "decimal commas" if self.decimal == "," else "decimal points"
        return f"text in {self.encoding}, {SEPARATORS[self.separator]}, {decimal}"


def read_delimited(path: Path, content: bytes | None = None) -> RawTable:
    """The table of a text: of a file, or of the bytes of a text that stands for it.

    Raises
    ------
    StudyError
        If it is binary or has no rows of numbers.
    """
    text = Text(path, content)
    layout = _layout(text)
    headers, places = layout.table.headers, layout.table.columns
    return RawTable(path, headers, lambda k: _columns(text, layout, k), str(layout), places)


def _layout(text: Text) -> TextLayout:
    path = text.path
    with text.stream() as file:
        head = file.read(HEAD)
    encoding = _encoding(path, head)
    lines = _LINES.split(head.decode(encoding, errors="replace"))
    if len(head) == HEAD:
        lines = lines[:-1]  # cut in the middle

    others = [_other_cells(line) for line in lines]
    tried = [(separator, decimal) for separator in SEPARATORS for decimal in ".,"]
    fits = (_fits(lines, others, *pair, encoding) for pair in tried if pair != (",", ","))
    found = [fit for fit in fits if fit is not None]
    if not found:
        refuse(
            path,
            "contains no consistent rows of numbers; give a first row like 'time [s],angle [rad]' "
            "and one number a cell, such as 1.5e-3",
        )
    _, layout = max(found, key=lambda item: item[0])
    if layout.table.unreadable:
        line = layout.table.unreadable[-1]
        refuse(
            path,
            f"cannot be understood in line {line + 1}, {quoted(lines[line])}, above its first "
            "numbers; correct or remove that row",
        )
    return layout


def _encoding(path: Path, head: bytes) -> str:
    if head.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    # text has no other control characters than those that end lines or stand between cells
    if sum(byte < 9 or 13 < byte < 32 for byte in head) > len(head) // 100:
        refuse(path, "is not text; give CSV, JSON, .xlsx, or .mat saved with -v7")
    try:
        # a character may be cut at the end
        head[:-4].decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        return "cp1252"


def cells_of(line: str, separator: str | None) -> list[str]:
    """The cells of a line, without the quotation marks around them."""
    if separator is None:
        return line.split()
    cells = next(csv.reader([line], delimiter=separator), [])
    return [cell.strip() for cell in cells]


def _fits(
    lines: list[str],
    others: list[list[list[str]]],
    separator: str | None,
    decimal: str,
    encoding: str,
) -> tuple[tuple[bool, int, int, int], TextLayout] | None:
    """How well a separator and a decimal sign fit a text: rows in order, columns, precedence.

    The others are what else the cells of each line may be, if it is a header.
    """
    rows = [[] if _COMMENT.match(line) else cells_of(line, separator) for line in lines]
    table = layout_of(rows, decimal, others)
    if table is None:
        return None

    # of two that fit, the one whose numbers have decimals, and a sign before blanks
    first = rows[table.first : table.first + 5]
    precise = sum(decimal in cell for row in first for cell in row)
    several = len(table.columns) > 1
    score = (several, table.fitting, len(table.columns), precise + (separator is not None))
    return score, TextLayout(encoding, separator, decimal, table)


def _other_cells(line: str) -> list[list[str]]:
    """What else may be the cells of a header: with other separators than its rows, or a comment."""
    plain = line.lstrip().lstrip("#%/ ")
    split = [cells_of(plain, separator) for separator in SEPARATORS]
    return [*split, [cell.strip() for cell in _WIDE_BLANKS.split(plain.strip())]]


def _columns(text: Text, layout: TextLayout, places: tuple[int, ...]) -> list[Array]:
    """The numbers of some columns, in one pass."""

    def read(converters: Any = None) -> Array:
        with io.TextIOWrapper(text.stream(), layout.encoding, "replace") as lines:
            return np.loadtxt(
                _rows(text.path, lines, layout, max(places)),
                delimiter=layout.separator,
                usecols=places,
                comments=None,
                quotechar='"',
                ndmin=2,
                converters=converters,
            )

    try:
        values = read()
    except ValueError:  # times of day, empty cells, texts; a cell at a time takes much longer
        values = read(number_of)
    return list(np.ascontiguousarray(values.T))


def _rows(path: Path, lines: TextIO, layout: TextLayout, last: int) -> Iterator[str]:
    """Lines of numbers with decimal points, each with the last column that is asked for."""
    for _ in range(layout.table.first):
        next(lines)
    comma, separator = layout.decimal == ",", layout.separator
    row, most = 0, None
    for line in lines:
        if _COMMENT.match(line) or not line.strip():
            continue
        row += 1
        # a cell too many shifts what stands behind it; one that is quoted may hold separators
        wide, filled = (_separators(text, separator) for text in (line, line.rstrip()))
        most = wide if most is None else most
        if wide < last or (filled > most and '"' not in line):
            refuse(
                path,
                f"is ragged: row {row} below the header has {wide + 1} cells; give as many cells "
                "in each row as in the header",
            )
        yield line.replace(",", ".") if comma else line


def _separators(line: str, separator: str | None) -> int:
    return len(line.split()) - 1 if separator is None else line.count(separator)
