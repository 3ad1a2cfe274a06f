"""What answers took, and how that compares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

from benchmarks.large.problems import PROBLEMS
from studies.common.console import Table

ACCURACIES = (1e-3, 1e-4)
# what the engine is asked for, and the accuracy that a fixed mesh beside it has to have
ASKED = {**{f"accuracy={a:g}": a for a in ACCURACIES}, "defaults": min(ACCURACIES)}

By = Literal["fixed", "yapss", "engine"]


class Work(NamedTuple):
    """What an answer took.

    Attributes
    ----------
    by : str
        The engine on a fixed mesh, the peer on one, or the engine.
    how : str
        The mesh, or what was asked for.
    seconds : float
        Of the processor, imports not counted.
    error : float
        Of the objective, relative to the best one known, and of the replay of a fixed mesh; nan
        without an answer.
    stated : float
        What it says that it is accurate to; nan if it says nothing.
    meshes : str
        Intervals and iterations of each: the first starts cold, the others from the one before.
    words : str
        Of the verdict or the error.
    cold : str
        Iterations of the last mesh from the guess, where they are asked for.
    """

    by: By
    how: str
    seconds: float
    error: float
    stated: float = math.nan
    meshes: str = ""
    words: str = ""
    cold: str = ""


def understated(rows: Sequence[Work]) -> int:
    """How many answers are further from the best value than they say."""
    return sum(row.error > row.stated for row in rows)


def cheapest(rows: Sequence[Work], accuracy: float, by: By) -> Work | None:
    """The least work of a kind that is right to an accuracy."""
    right = [row for row in rows if row.by == by and row.error <= accuracy]
    return min(right, key=lambda row: row.seconds, default=None)


def ratio(rows: Sequence[Work], how: str) -> str:
    """Time of the engine by that of the cheapest fixed mesh that is as right."""
    least = cheapest(rows, ASKED[how], "fixed")
    (taken,) = (row.seconds for row in rows if row.how == how)
    return f"{taken / least.seconds:.1f}" if least else "-"


def answers_table(name: str, rows: Sequence[Work]) -> Table:
    """All answers to a problem; those that say to be better than they are count."""
    lines = [
        (
            row.by,
            row.how,
            f"{row.seconds:.1f}",
            f"{row.error:.0e}",
            f"{row.stated:.0e}",
            row.meshes,
            row.cold,
            row.words[:90],
        )
        for row in rows
    ]
    head = ("by", "how", "processor s", "error", "says", "intervals: iterations", "cold", "words")
    return Table(name, head, lines, (f"errors that are larger than stated: {understated(rows)}",))


def ratios_table(problems: Mapping[str, Sequence[Work]]) -> Table:
    """Times of the engine by those of fixed meshes, a problem in a row."""
    lines = [(name, *(ratio(rows, how) for how in ASKED)) for name, rows in problems.items()]
    title = "Time by that of the cheapest fixed mesh that is as right (defaults: right to 1e-4)"
    return Table(title, ("problem", *ASKED), lines)


def markdown(problems: Mapping[str, Sequence[Work]]) -> str:
    """Rows of the documents' table."""
    return "\n".join(_markdown_row(name, rows) for name, rows in problems.items())


def _markdown_row(name: str, rows: Sequence[Work]) -> str:
    engine = [row for row in rows if row.by == "engine"]
    meshes = [cheapest(rows, min(ACCURACIES), by) for by in ("fixed", "yapss")]
    # an error that is not known is none
    worst = max(engine, key=lambda row: row.error if row.error >= 0 else -1.0)
    cells = (
        PROBLEMS[name].title,
        *(f"{one.how}, {_seconds(one)}" if one else "none" for one in meshes),
        *(_seconds(row) for row in engine),
        f"{worst.error:.0e}, {worst.stated:.0e}",
    )
    return f"| {' | '.join(cells)} |"


def _seconds(row: Work) -> str:
    return f"{row.seconds:.0f} s" if row.seconds >= 10 else f"{row.seconds:.1f} s"
