"""What a file of a profile holds: the texts of its headers, and numbers below them.

Nothing is known here of angles or ropes. Whatever cannot be read is answered with what to do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError

ROW_NUMBER = -1  # place of a column that counts the rows from 0
LISTED = 8  # headers that a sentence lists


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns as they stand in a file.

    Attributes
    ----------
    path : of the file.
    headers : the text above each column, in order; its unit with it where the file states one.
    stored : the numbers (m,) of the columns at the given places; nan where a cell holds none.
    dialect : what was recognised, in words.
    columns : places of the columns that hold numbers; None if all may.
    """

    path: Path
    headers: tuple[str, ...]
    stored: Callable[[tuple[int, ...]], list[Array]]
    dialect: str
    columns: tuple[int, ...] | None = None

    @property
    def numbered(self) -> tuple[int, ...]:
        """Places of the columns that may hold numbers."""
        return tuple(range(len(self.headers))) if self.columns is None else self.columns

    def column(self, places: Sequence[int]) -> list[Array]:
        """The numbers (m,) of the columns at the given places, `ROW_NUMBER` among them."""
        stored = tuple(k for k in places if k != ROW_NUMBER) or self.numbered[:1]
        found = dict(zip(stored, self.stored(stored), strict=True))
        count = np.arange(float(found[stored[0]].size))
        return [found.get(k, count) for k in places]

    def line_of(self, row: int) -> str:
        """The place of a number in its column, as a reader of the file counts."""
        return f"row {row + 1}" + " below the header" * (self.columns is not None)


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
