"""Text with columns, in the dialects that people and instruments write.

Separators (comma, semicolon, tab, bar, blanks), decimal commas, byte-order marks, comments, lines
above the header, and a row of units below it are recognised. The numbers are read in one pass
that holds no text, so that ten million rows fit into memory.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocp.arrays import Array
from studies.check.reading.raw_table import RawTable, refuse
from studies.common.exit_codes import quoted

SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars", None: "blanks"}
COMMENTS = ("#", "%", "//")
HEAD = 65536  # bytes from which a layout is told
SEEN = 40  # lines of numbers by which a separator is judged

_POINT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?|nan|[-+]?inf", re.IGNORECASE)
_COMMA = re.compile(r"[-+]?(\d+,?\d*|,\d+)([eEdD][-+]?\d+)?")
_FORTRAN = re.compile(r"(?<=[\d.,])[dD](?=[-+]?\d)")  # the D of 1.0D-03
_PLACE = re.compile(r"string '(?P<cell>.*)' to float64 at row (?P<row>\d+)")
_RAGGED = re.compile(r"at row (?P<row>\d+)")


@dataclass(frozen=True)
class TextLayout:
    """How a text writes its table.

    Attributes
    ----------
    encoding : of the file.
    separator : between cells; None stands for any blanks.
    decimal : sign of the decimals.
    headers : texts of the header row, with the units of a row below it.
    skipped : lines above the first numbers.
    """

    encoding: str
    separator: str | None
    decimal: str
    headers: tuple[str, ...]
    skipped: int

    def __str__(self) -> str:
        decimal = "decimal commas" if self.decimal == "," else "decimal points"
        return f"text in {self.encoding}, {SEPARATORS[self.separator]}, {decimal}"


def read_delimited(path: Path) -> RawTable:
    """The table of a text.

    Raises
    ------
    StudyError
        If it is binary, has no header or no rows, or a cell is no number.
    """
    layout = _layout(path)

    def column(places: tuple[int, ...]) -> list[Array]:
        return _columns(path, layout, places)

    def line_of(row: int) -> str:
        return f"row {row + 1} below the header"

    return RawTable(path, layout.headers, column, str(layout), line_of)


def _layout(path: Path) -> TextLayout:
    with path.open("rb") as file:
        head = file.read(HEAD)
    encoding = _encoding(path, head)
    text = head.decode(encoding, errors="replace")
    lines = text.splitlines()
    if len(head) == HEAD:
        lines = lines[:-1]  # cut in the middle

    tried = [(separator, decimal) for separator in SEPARATORS for decimal in ".,"]
    found = [f for f in (_fits(lines, *pair, encoding) for pair in tried) if f is not None]
    if _is_ambiguous(lines):
        refuse(path, "has commas both between cells and as decimal sign; separate by semicolons")
    if not found:
        refuse(
            path,
            "cannot be understood: no header stands above columns of numbers; give a first row "
            "like 'time [s],angle [rad]' and one number a cell",
        )
    _, layout = max(found, key=lambda item: item[0])
    return layout


def _encoding(path: Path, head: bytes) -> str:
    if head.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in head:
        refuse(path, "is not text; give CSV, JSON, .xlsx, or .mat saved with -v7")
    try:
        # a character may be cut at the end
        head[:-4].decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        pass
    control = sum(byte < 9 or 13 < byte < 32 for byte in head)
    if control > len(head) // 100:
        refuse(path, "is not text; give CSV, JSON, .xlsx, or .mat saved with -v7")
    return "cp1252"


def cells_of(line: str, separator: str | None) -> list[str]:
    """The cells of a line, without the quotation marks around them."""
    if separator is None:
        return line.split()
    cells = next(csv.reader([line], delimiter=separator), [])
    return [cell.strip() for cell in cells]


def _is_number(cell: str, decimal: str) -> bool:
    pattern = _COMMA if decimal == "," else _POINT
    return pattern.fullmatch(cell) is not None


def _fits(
    lines: list[str], separator: str | None, decimal: str, encoding: str
) -> tuple[tuple[int, int, int], TextLayout] | None:
    """How well a separator and a decimal sign fit a text: rows in order, columns, precedence."""
    if separator == "," and decimal == ",":
        return None
    first, width = _first_numbers(lines, separator, decimal)
    if first is None:
        return None

    rows = [line for line in lines[first:] if line.strip()][:SEEN]
    fitting = sum(len(cells_of(line, separator)) == width for line in rows)
    header, units = _headers(lines[:first], separator, width)
    if not header:
        return None
    joined = tuple(
        f"{name} [{unit.strip('[]()')}]" if unit.strip("[]() -") else name
        for name, unit in zip(header, units or [""] * width, strict=True)
    )

    # of two that fit, the one whose numbers have decimals, and a sign before blanks
    precise = sum(decimal in cell for line in rows[:5] for cell in cells_of(line, separator))
    score = (fitting, width, precise + (separator is not None))
    return score, TextLayout(encoding, separator, decimal, joined, first)


def _first_numbers(lines: list[str], separator: str | None, decimal: str) -> tuple[int | None, int]:
    """Place and width of the first row with at least two numbers and nothing but numbers."""
    for place, line in enumerate(lines):
        if line.lstrip().startswith(COMMENTS):
            continue
        cells = cells_of(line, separator)
        numbers = [_is_number(cell, decimal) for cell in cells if cell]
        # a column of words, such as a state, may stand beside the numbers
        if len(numbers) >= 2 and sum(numbers) >= 2 and numbers[0]:
            return place, len(cells)
    return None, 0


def _headers(
    above: list[str], separator: str | None, width: int
) -> tuple[list[str], list[str] | None]:
    """The header row, and the row of units below it where there is one."""
    # instruments write the header as a comment, too
    plain = [line for line in above if not line.lstrip().startswith(COMMENTS)]
    commented = [line.lstrip().lstrip("#%/ ") for line in above]
    for candidates in (plain, commented):
        rows = [cells_of(line, separator) for line in candidates]
        rows = [row for row in rows if len(row) == width and any(row)]
        if len(rows) > 1 and _are_units(rows[-1]):
            return rows[-2], rows[-1]
        if rows:
            return rows[-1], None
    return [], None


def _are_units(cells: list[str]) -> bool:
    from studies.check.reading.headers import is_unit

    stated = [cell.strip("[]() ") for cell in cells]
    return any(map(is_unit, stated)) and all(not cell or is_unit(cell) for cell in stated)


def _is_ambiguous(lines: list[str]) -> bool:
    """Whether commas separate and stand in numbers as well: '0,5,0,0768' below 'time,angle'."""
    first, width = _first_numbers(lines, ",", ".")
    head = next((line for line in lines[: first or 0][::-1] if line.strip()), "")
    return first is not None and width > 2 and 2 * len(cells_of(head, ",")) == width


def _columns(path: Path, layout: TextLayout, places: tuple[int, ...]) -> list[Array]:
    """The numbers of some columns, in one pass."""
    with path.open(encoding=layout.encoding, errors="replace", newline=None) as file:
        try:
            values = np.loadtxt(
                _rows(path, file, layout),
                delimiter=layout.separator,
                usecols=places,
                comments=None,
                quotechar='"',
                ndmin=2,
            )
        except ValueError as error:
            refuse(path, _what_is_wrong(str(error)))
    return list(np.ascontiguousarray(values.T))


def _rows(path: Path, file: io.TextIOWrapper, layout: TextLayout) -> Iterator[str]:
    """Lines of numbers with decimal points, and exponents behind an e."""
    for _ in range(layout.skipped):
        next(file)
    comma, separator = layout.decimal == ",", layout.separator
    row, most = 0, None
    for line in file:
        if line.lstrip().startswith(COMMENTS) or not line.strip():
            continue
        row += 1
        # a cell too many shifts what stands behind it; one that is quoted may hold separators
        wide = len(line.split()) if separator is None else line.rstrip().count(separator)
        if most is None:
            most = wide
        elif wide > most and '"' not in line:
            refuse(
                path,
                f"is ragged: row {row} below the header has more cells than the first one; give as "
                "many cells in each row as in the header",
            )
        if "D" in line or "d" in line:
            line = _FORTRAN.sub("e", line)
        yield line.replace(",", ".") if comma else line


def _what_is_wrong(error: str) -> str:
    """The reader's complaint in our words."""
    place = _PLACE.search(error)
    if place is not None:
        cell, row = place["cell"], int(place["row"]) + 1
        if not cell.strip():
            return f"has an empty cell in row {row} below the header; give a number in each cell"
        return (
            f"cannot be understood: {quoted(cell)} in row {row} below the header is no number; "
            "give one number a cell"
        )
    ragged = _RAGGED.search(error)
    where = f" in row {int(ragged['row'])} below the header" if ragged else ""
    return f"is ragged: cells are missing{where}; give as many cells in each row as in the header"
