"""Where a table stands among rows of cells: its numbers, the header above them, and their units.

Instruments and simulations write blocks of their own above a table, each in another way. None of
these is known here. The numbers are those of the rows that are most alike, and the header is the
row above them that says most: names and units that are understood, else texts in most columns.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from studies.check.reading.headers import is_unit, says_something

RUN = 5  # rows of numbers, one after the other, with which a table begins
SHORT = 8  # characters of a unit that nobody knows

_NUMBER = {
    ".": re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|nan|[-+]?inf", re.IGNORECASE),
    ",": re.compile(r"[-+]?(\d+,?\d*|,\d+)([eE][-+]?\d+)?"),
}
_CLOCK = re.compile(r"(?:[\d./-]+[T ])?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)Z?")
_LABEL = re.compile(r"(?!(?:n/?a|null|none)$)[^\W\d_]", re.IGNORECASE)
_UNIT_LABEL = re.compile(r"^(y |vertical )?(units?|einheit)( label)?\s*([:=]|$)", re.IGNORECASE)

Row = Sequence[str]


@dataclass(frozen=True)
class Layout:
    """Where a table stands.

    Attributes
    ----------
    first : row of its first numbers.
    columns : that hold numbers.
    headers : text of each column with its unit; "column 3" where none stands above it.
    fitting : rows that look like the first one.
    unreadable : rows between header and numbers that hold numbers, and other cells that are none.
    """

    first: int
    columns: tuple[int, ...]
    headers: tuple[str, ...]
    fitting: int
    unreadable: tuple[int, ...]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number, or a time of day."""
    return _NUMBER[decimal].fullmatch(cell) is not None or _CLOCK.fullmatch(cell) is not None


def number_of(cell: Any) -> float:
    """The number in a cell: of a time of day its seconds since midnight, nan if there is none."""
    found = _CLOCK.fullmatch(cell.strip().strip('"')) if isinstance(cell, str) else None
    if found is not None:
        hours, minutes, seconds = found.groups()
        return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds.replace(",", "."))
    try:
        return float(cell)
    except (TypeError, ValueError):
        return math.nan


def layout_of(rows: Sequence[Row], decimal: str, others: Sequence[Sequence[Row]]) -> Layout | None:
    """The table among rows of cells; None where there is none.

    Parameters
    ----------
    rows : the cells of each row; none of what is blank or a comment.
    decimal : sign of the decimals.
    others : for each row what else may be its cells, such as of a header with other separators.
    """
    masks = [tuple(k for k, cell in enumerate(row) if is_number(cell, decimal)) for row in rows]
    alike = Counter(
        (len(row), mask)
        for row, mask in zip(rows, masks, strict=True)
        if len(mask) > 1 or len(row) == len(mask) == 1
    )
    if not alike:
        return None
    (width, columns), _ = alike.most_common(1)[0]

    fits = [
        len(row) == width
        and any(k in mask for k in columns)
        and all(k in mask or not row[k] for k in columns)
        for row, mask in zip(rows, masks, strict=True)
    ]
    filled = [place for place, row in enumerate(rows) if any(row)]
    runs = (
        place
        for start, place in enumerate(filled)
        if all(fits[other] for other in filled[start : start + RUN])
    )
    first = next(runs, None)
    if first is None:
        return None

    above = [_candidates(rows[k], others[k], width) for k in range(first)]
    header, cells = _header(above, columns, decimal, width)
    units = _units(above, columns, header, width)
    unreadable = (k for k in range(header + 1, first) if masks[k] and not _has_label(rows[k]))
    headers = (_joined(*pair, k) for k, pair in enumerate(zip(cells, units, strict=True)))
    return Layout(first, columns, tuple(headers), sum(fits), tuple(unreadable))


def _candidates(row: Row, others: Sequence[Row], width: int) -> list[Row]:
    """What may be the cells of a row above the numbers, each as wide as these."""
    exact = [other for other in others if len(other) == width]
    # a header may name columns that are empty everywhere, and leave some at its end without a name
    return [(*row, *[""] * width)[:width], *exact]


def _header(
    above: Sequence[Sequence[Row]], columns: Sequence[int], decimal: str, width: int
) -> tuple[int, Row]:
    """The row of names; -1 and empty cells where there is none."""
    best: tuple[bool, int, int] = (False, 0, -1)
    found: tuple[int, Row] = (-1, [""] * width)
    for place, candidates in enumerate(above):
        for cells in candidates:
            texts = sum(bool(cells[k]) and not is_number(cells[k], decimal) for k in columns)
            if 2 * texts <= len(columns) or _are_units(cells, columns):
                continue
            said = any(says_something(cells[k]) for k in columns)
            if (said, texts, place) > best:
                best, found = (said, texts, place), (place, cells)
    return found


def _units(above: Sequence[Sequence[Row]], columns: Sequence[int], header: int, width: int) -> Row:
    """The row of units that is nearest to the numbers; empty cells where there is none."""
    for place in reversed(range(len(above))):
        for cells in above[place]:
            if place != header and _are_units(cells, columns):
                return [_unit(cell) for cell in cells]
    return [""] * width


def _are_units(cells: Row, columns: Sequence[int]) -> bool:
    stated = [_unit(cells[k]) for k in columns]
    known = [text for text in stated if is_unit(text)]
    return bool(known) and all(
        not text or text in known or (len(text) <= SHORT and not says_something(text))
        for text in stated
    )


def _unit(cell: str) -> str:
    """The unit of a cell in a row of units; empty for what names that row."""
    text = _UNIT_LABEL.sub("", cell.replace("_", " "))
    return text.strip("[]() ")


def _joined(name: str, unit: str, place: int) -> str:
    if not name:
        name = f"column {place + 1}"
    return f"{name} [{unit}]" if unit.strip(" -") else name


def _has_label(row: Row) -> bool:
    """Whether a row begins with a word, as a setting above a table does."""
    return _LABEL.match(next((cell for cell in row if cell), "")) is not None
