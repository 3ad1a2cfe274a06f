"""The show "engine-swings": four systems swung up in least time, with least effort and least peak.

Case i is problem i of `problems/swings.toml`, and the seed changes nothing. None of the optima is
known, and each problem has many local ones. So the plain collocation starts from 20 random motions.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.shows.engine.comparison import Reference, compared
from benchmarks.shows.engine.families import tables as tables
from benchmarks.shows.engine.variant import Variant, catalogue
from benchmarks.shows.show import Question, Row

FILE = "swings"
LINE = "swing-ups in least time, with least effort and least peak"
LIMIT = 3600.0  # [s]


def question(seed: int, index: int) -> Question:
    """Name a problem and where it comes from."""
    del seed
    problems = catalogue(FILE)
    name = list(problems)[index % len(problems)]
    return {"problem": name, "source": problems[name]["source"]}


def answer(question: Question, folder: Path) -> Row:
    """Solve it both ways and compare."""
    del folder
    variant = Variant.nominal(question["problem"], FILE)
    return compared(variant, Reference(intervals=120, random_starts=20))
