"""What a file of a profile holds: the texts of its headers, and numbers below them.

Nothing is known here of angles or ropes. Whatever cannot be read is answered with what to do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from ocp.arrays import Array
from studies.common.exit_codes import StudyError

LISTED = 8  # headers that a sentence lists


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns as they stand in a file.

    Attributes
    ----------
    path : of the file.
    headers : the text above each column, in order; its unit with it where the file states one.
    column : the numbers (m,) of the columns at the given places; nan where a cell is empty.
    dialect : what was recognised, in words.
    line_of : the line, row or place of a number in its column, as a reader of the file counts.
    columns : places of the columns that hold numbers; None if all may.
    period : time from row to row that the file states above its table, with a unit; empty for none.
    """

    path: Path
    headers: tuple[str, ...]
    column: Callable[[tuple[int, ...]], list[Array]]
    dialect: str
    line_of: Callable[[int], str] = field(default=lambda row: f"row {row + 1}")
    columns: tuple[int, ...] | None = None
    period: str = ""


def below_the_header(row: int) -> str:
    """Where a number stands in a table of rows, as a reader counts them."""
    return f"row {row + 1} below the header"


def refusal(path: Path, reason: str) -> StudyError:
    """The error that names the file."""
    return StudyError(f"the profile {path} {reason}")


def refuse(path: Path, reason: str) -> NoReturn:
    """Raise StudyError that names the file."""
    raise refusal(path, reason)


def listed(headers: tuple[str, ...]) -> str:
    """The headers of a table for a sentence."""
    shown = ", ".join(f"'{header}'" for header in headers[:LISTED])
    return shown + (f" and {len(headers) - LISTED} more" if len(headers) > LISTED else "")
