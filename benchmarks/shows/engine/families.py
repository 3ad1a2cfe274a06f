"""The show "families": random variants of the fifteen benchmarks beside a plain collocation.

Case `15 k + i` is draw k of problem i of `problems/families.toml`. The engine solves it with its
defaults, from a crude guess and from none. How it is judged is in `comparison.py`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.shows.engine.comparison import (
    AUDITED,
    GUESSES,
    HEAD,
    KINDS,
    Reference,
    cells,
    compared,
)
from benchmarks.shows.engine.variant import Variant, catalogue
from benchmarks.shows.show import Question, Row
from studies.common.console import Table

LINE = "random variants of the fifteen benchmarks beside a plain collocation"
LIMIT = 900.0  # [s]


def question(seed: int, index: int) -> Question:
    """Draw the numbers of a variant."""
    names = list(catalogue())
    name, draw = names[index % len(names)], index // len(names)
    variant = Variant.drawn(name, np.random.default_rng([seed, index]))
    return {"problem": name, "draw": draw, "numbers": dict(variant.numbers), "drawn": [seed, index]}


def answer(question: Question, folder: Path) -> Row:
    """Solve it both ways and compare."""
    del folder
    random = np.random.default_rng(question["drawn"])
    return compared(Variant.drawn(question["problem"], random), Reference())


def tables(rows: Sequence[Row]) -> list[Table]:
    """Each answer in a row, and how many are of each kind."""
    lines = [(str(r["index"]), r["problem"], *line) for r in rows for line in cells(r)]
    return [Table("Variants of the benchmarks", ("case", "problem", *HEAD), lines), counts(rows)]


def counts(rows: Sequence[Row]) -> Table:
    """How many answers are of each kind."""
    answered = [row for row in rows if not row["failure"]]
    lines, notes = [], []
    for guess in GUESSES:
        own = [row["answers"][guess] for row in answered]
        kinds = Counter(entry["kind"] for entry in own)
        right = [entry for entry in own if entry["kind"] == "right"]
        certified = sum(not entry["open"] for entry in right)
        lines.append((guess, *(str(kinds[kind]) for kind in KINDS), str(len(rows))))
        notes.append(
            f"guess {guess}: {certified} of {len(right)} right answers certified; an audit of "
            f"{AUDITED} starts finds the better optimum of "
            f"{sum(bool(e['audited']) for e in own)} of {kinds['other optimum']} others"
        )
    return Table("What the answers are", ("guess", *KINDS, "cases"), lines, tuple(notes))
