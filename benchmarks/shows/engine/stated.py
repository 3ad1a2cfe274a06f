"""Shows over the problems of one file each, with the numbers as they stand there.

headings        unbounded angles of steering, thrust or heading
singular        singular and chattering controls, also with stricter accuracies
swings          four systems swung up in least time, with least effort and least peak
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.shows.engine.comparison import HEAD, Reference, by_engine, cells, compared
from benchmarks.shows.engine.families import counts
from benchmarks.shows.engine.variant import Variant, catalogue
from benchmarks.shows.show import Question, Row
from ocp import Accuracy, Settings
from studies.common.console import Table, number


@dataclass(frozen=True)
class Stated:
    """A show: case i is problem i of a file, and the seed changes nothing.

    Attributes
    ----------
    file : without its ending.
    LINE, LIMIT : as of a show.
    reference : what answers are held against.
    strict : tolerances on the objective that are asked for beside the default.
    """

    file: str
    LINE: str
    LIMIT: float = 1800.0  # [s]
    reference: Reference = field(default_factory=Reference)
    strict: tuple[float, ...] = ()

    def question(self, seed: int, index: int) -> Question:
        """Name a problem and where it comes from."""
        del seed
        problems = catalogue(self.file)
        name = list(problems)[index % len(problems)]
        return {"problem": name, "source": problems[name]["source"]}

    def answer(self, question: Question, folder: Path) -> Row:
        """Solve it both ways and compare."""
        del folder
        variant = Variant.nominal(question["problem"], self.file)
        row = compared(variant, self.reference)
        if "optimum" in variant.stated:
            row["optimum"] = variant.value(variant.stated["optimum"])
            row["known to"] = variant.stated.get("optimum_known_to", 0.0)
        row["strict"] = [self._strict(variant, tolerance) for tolerance in self.strict]
        return row

    def _strict(self, variant: Variant, tolerance: float) -> dict[str, Any]:
        """An answer from the crude guess where a stricter accuracy is asked for."""
        accuracy = Accuracy(objective=tolerance)
        row, _ = by_engine(variant, "crude", Settings(seconds=300.0, accuracy=accuracy))
        return {**row, "tolerance": tolerance}

    def tables(self, rows: Sequence[Row]) -> list[Table]:
        """Each answer in a row, how many are of each kind, and what stricter accuracies give."""
        lines = [(row["problem"], *line) for row in rows for line in cells(row)]
        made = [Table(self.LINE, ("problem", *HEAD), lines), counts(rows)]
        if self.strict:
            made.append(_errors(rows))
        return made


def _errors(rows: Sequence[Row]) -> Table:
    """Relative distance from the best value known, by the accuracy that was asked for."""
    head = ("problem", "best known", "known to", "by default", "asked for", "reached", "words")
    lines = []
    for row in (row for row in rows if not row["failure"]):
        best = row.get("optimum", row["best"])
        known = row.get("known to", row["change"] / abs(best))
        default = row["answers"]["crude"]["value"]
        for strict in row["strict"]:
            lines.append(
                (
                    row["problem"],
                    number(best, 10),
                    f"{known:.0e}",
                    _off(default, best),
                    f"{strict['tolerance']:.0e}",
                    _off(strict["value"], best),
                    strict["words"][:110],
                )
            )
    return Table("Relative distance from the best value known", head, lines)


def _off(value: float | None, best: float) -> str:
    return "-" if value is None else f"{(value - best) / max(abs(best), math.ulp(1.0)):.1e}"


HEADINGS = Stated("headings", "unbounded angles of steering, thrust or heading")
SINGULAR = Stated(
    "singular",
    "singular and chattering controls",
    reference=Reference(intervals=600, random_starts=0),
    strict=(1e-8,),
)
SWINGS = Stated(
    "swings",
    "swing-ups in least time, with least effort and least peak",
    LIMIT=3600.0,
    reference=Reference(intervals=120, random_starts=20),
)
