"""What a show is: a question drawn at random, its answer, and the tables of all rows."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, cast

from studies.common.configuration import closest
from studies.common.console import Table
from studies.common.exit_codes import StudyError

Question = Mapping[str, Any]  # as JSON holds it
Row = Mapping[str, Any]
Column = str | Callable[[Row], object]  # of a table: a key of the rows, or a function of one
Columns = Mapping[str, Column]  # by their headings

# One line a show: its name, and the module that has what a `Show` has.
SHOWS = {
    "truss-random": "benchmarks.shows.truss_random",
    "fuzz-commands": "benchmarks.shows.fuzz.commands",
    "interrupts": "benchmarks.shows.fuzz.interrupts",
    "continued": "benchmarks.shows.fuzz.continued",
    "engine-families": "benchmarks.shows.engine.families",
    "engine-swings": "benchmarks.shows.engine.swings",
}


class Show(Protocol):
    """What the module of a show defines.

    Attributes
    ----------
    LINE : str
        A line of help.
    LIMIT : float
        That a case may last [s], unless the user says otherwise.
    """

    LINE: str
    LIMIT: float

    def question(self, seed: int, index: int) -> Question:
        """Return what a case asks: a pure function, so that a case can be asked again."""

    def answer(self, question: Question, folder: Path) -> Row:
        """Return what came of it; `folder` is the case's own, and kept."""

    def tables(self, rows: Sequence[Row]) -> list[Table]:
        """Return what is printed: of each row, and in total.

        A row is the question, the answer, and `index`, `seconds` and `failure`. Where `failure`
        is not empty there is no answer.
        """


def listed(
    title: str,
    rows: Sequence[Row],
    columns: Columns,
    notes: Sequence[str] = (),
) -> Table:
    """Return a table of a line for each row.

    Parameters
    ----------
    columns : mapping
        A row without an answer has a dash in those that need one.
    """

    def cell(row: Row, column: Column) -> str:
        try:
            return str(column(row) if callable(column) else row[column])
        except (KeyError, TypeError):
            if not row["failure"]:
                raise
            return "-"

    lines = [[cell(row, column) for column in columns.values()] for row in rows]
    return Table(title, tuple(columns), lines, notes)


def show(name: str) -> Show:
    """Return the module of a show.

    Raises
    ------
    StudyError
        If there is none of that name.
    """
    if name not in SHOWS:
        raise StudyError(f"there is no show {name!r}; {closest(name, SHOWS)}")
    return cast(Show, importlib.import_module(SHOWS[name]))
