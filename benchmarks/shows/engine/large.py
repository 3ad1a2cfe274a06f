"""The show "engine-large": twelve larger problems beside the plain collocation of an expert.

Case i is problem i of `problems/large.toml` and of `repeated.py`. Seed 0 takes the numbers of the
files; another seed draws those that have a range, case by case, so that further cases are further
draws. Single runs say little of the seconds, because last digits decide over rounds. Each is solved
from its crude guess by `ocp.solve` with default settings, within 300 s, and by the plain
collocation (`plain.py`) on as many intervals as an expert would take. That one shares no code with
the engine. It starts from the same guess, and once more where the engine ended, which tells another
optimum from a wrong answer. An optimum that the source states is one more reference.

right           as good as the best of these values
looser          the same, and the verdict says which tolerance is not met
other optimum   the plain collocation stays there, but a better one is known
failure         an error that says so, or not done in time
wrong           an answer that was verified, and with which none of these values agrees

Seconds are those of the processor: of the expert for the making of the program and one run from
the crude guess, of the engine for all of `solve`.
"""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.shows.engine.comparison import Reference, compared
from benchmarks.shows.engine.repeated import REPEATED
from benchmarks.shows.engine.variant import Variant, catalogue
from benchmarks.shows.show import Columns, Question, Row, listed
from studies.common.console import Table, number

LINE = "larger problems from the literature beside an expert's plain collocation"
LIMIT = 1200.0  # [s]
EXPERT = 120.0  # of the processor, for a run of the plain collocation
KINDS = ("right", "looser", "other optimum", "failure", "not compared", "wrong")
MOST, MEDIAN = 10.0, 3.0  # times the expert's seconds that are wanted at most
# what the verdict of an answer to a looser tolerance says, see `ocp.solve`
_LOOSER = "asked for were"


def variants() -> dict[str, Variant]:
    """The problems with their own numbers by name, in the order of the cases."""
    stated = {**catalogue("large"), **{name: make() for name, make in REPEATED.items()}}
    made = {}
    for name, entry in stated.items():
        numbers = {key: float(values[0]) for key, values in entry.get("vary", {}).items()}
        made[name] = Variant(name, entry, numbers, entry.get("samples", {}))
    return made


def question(seed: int, index: int) -> Question:
    """Name a problem, its numbers and where it comes from."""
    known = variants()
    name = list(known)[index % len(known)]
    numbers = dict(known[name].numbers)
    if seed:
        random = np.random.default_rng([seed, index])
        for key, (_, *ends) in known[name].stated.get("vary", {}).items():
            if ends:
                numbers[key] = float(f"{random.uniform(*ends):.6g}")
    return {"problem": name, "numbers": numbers, "source": known[name].stated["source"]}


def answer(question: Question, folder: Path) -> Row:
    """Solve it by both and compare."""
    del folder
    variant = replace(variants()[question["problem"]], numbers=question["numbers"])
    intervals, optimum = variant.stated["intervals"], variant.stated.get("optimum")
    known = {} if optimum is None else {"stated": optimum}
    found = compared(
        variant,
        Reference(
            intervals,
            random_starts=0,
            audits=False,
            guesses=("crude",),
            seconds=EXPERT,
            known=known,
        ),
    )
    own = found.pop("answers")["crude"]
    if own["value"] is None:
        own["kind"] = "failure"
    elif own["kind"] == "right" and _LOOSER in own["words"]:
        own["kind"] = "looser"
    return {**found, "engine": own, "optimum": optimum, "intervals": intervals}


def tables(rows: Sequence[Row]) -> list[Table]:
    """Each problem in a row, and how many are of each kind."""
    columns: Columns = {
        "problem": "problem",
        "kind": lambda row: row["engine"]["kind"].replace("wrong", "WRONG"),
        "value": lambda row: number(row["engine"]["value"], 9),
        "plain": lambda row: number(row["best"], 9),
        "stated": lambda row: number(row["optimum"], 9),
        "same to": lambda row: f"{row['same'] / abs(row['best']):.0e}" if row["best"] else "-",
        "rounds": lambda row: row["engine"]["rounds"],
        "its": lambda row: row["engine"]["iterations"],
        "CPU [s]": lambda row: f"{row['engine']['processor']:.1f}",
        "expert [s]": lambda row: f"{row['expert']['seconds']:.1f}",
        "expert its": lambda row: row["expert"]["iterations"],
        "ratio": lambda row: number(_ratio(row), 2),
        "words": _words,
    }
    ratios = [ratio for row in rows if (ratio := _ratio(row)) is not None]
    kinds = Counter(row["engine"]["kind"] for row in rows if not row["failure"])
    totals = [(*(str(kinds[kind]) for kind in KINDS), str(len(rows)))]
    notes: tuple[str, ...] = ()
    if ratios:
        notes = (
            f"the engine's seconds over the expert's: median {statistics.median(ratios):.1f} "
            f"(wanted: at most {MEDIAN:g}), most {max(ratios):.1f} (wanted: at most {MOST:g})",
        )
    return [listed(LINE, rows, columns), Table("In total", (*KINDS, "cases"), totals, notes)]


def _words(row: Row) -> str:
    if row["failure"]:
        return str(row["failure"][:60])
    own = row["engine"]
    return own["words"][:90] + (f" [not certified: {own['open']}]" if own["open"] else "")


def _ratio(row: Row) -> float | None:
    """The engine's seconds over the expert's, where that one found a motion."""
    if row["failure"] or not math.isfinite(row["plain"].get("crude") or math.nan):
        return None
    return float(row["engine"]["processor"] / row["expert"]["seconds"])
