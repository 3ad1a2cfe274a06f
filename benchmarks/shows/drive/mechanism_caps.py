"""The show "mechanism-caps": caps on rope, motor and arm at multiples of the least possible.

For four durations and four quantities the cap is 0.9, 1.05, 1.3 and 2 times the least that any
motion has, by proof. Below that the command has to end with exit code 3. Above it, the peak between
the points of the mesh has to keep the cap, or the sentence has to name the cap that prevents it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.shows.show import Question, Row
from benchmarks.shows.truss_random import read_output, run_command
from studies.common.console import Table, number
from studies.common.exit_codes import ExitCode
from studies.common.result import Result
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.caps import CAPPED
from studies.truss.limits.tolerances import CAPS
from studies.truss.quantities import QUANTITIES

LINE = "caps on rope, motor and arm at 0.9 to 2 times the least possible: 64 cases"
LIMIT = 600.0  # [s]; a case takes up to a minute

OBJECTIVE = "peak-acceleration"
DURATIONS = (4.0, 10.0, 25.0, 140.0)  # [s]
CAPPED_HERE = ("peak-rope-speed", "peak-rope-acceleration", "peak-power", "peak-reaction")
MULTIPLES = (0.9, 1.05, 1.3, 2.0)
ACTIVE = 1e-4  # of the cap, below which the peak is on it


def question(seed: int, index: int) -> Question:
    """Duration, capped quantity and multiple of a case; nothing is drawn, whatever the seed."""
    rest, place = divmod(index, len(MULTIPLES))
    rest, quantity = divmod(rest, len(CAPPED_HERE))
    return {
        "duration": DURATIONS[rest % len(DURATIONS)],
        "quantity": CAPPED_HERE[quantity],
        "multiple": MULTIPLES[place],
    }


def answer(question: Question, folder: Path) -> Row:
    """What the command ends with, and the peak it reports, which is taken between the points."""
    duration, key = question["duration"], question["quantity"]
    bound = lower_bounds(TrussStudy(minimise=OBJECTIVE, duration=duration), None)[key]
    cap = question["multiple"] * bound
    flag = f"--{CAPPED[key].replace('_', '-')}-cap"
    command = ["truss", "--objective", OBJECTIVE, "--duration", f"{duration:g}", flag, repr(cap)]
    command += ["--results", str(folder / "results"), "--overwrite", "--no-figures"]
    code, printed = run_command(command, folder / "printed.txt")

    row = {"code": code, "cap": cap, "bound": bound, **read_output(printed), "peak": None}
    if code == ExitCode.OK:
        result = Result.load(folder / "results")
        (values,) = (entry.values for entry in result.table if entry.key == key)
        row["peak"] = values[result.laws[0]]
    return row


def verdict_on(row: Row) -> str:
    """How a case ended, in a word."""
    if row["multiple"] < 1.0:
        proven = row["code"] == ExitCode.INFEASIBLE and "the least possible" in row["complaint"]
        return "proven" if proven else "NOT PROVEN"
    if row["code"] == ExitCode.OK:
        excess = row["peak"] / row["cap"] - 1.0
        if excess > CAPS:
            return "BROKEN"
        return "active" if excess > -ACTIVE else "kept"
    # the last sentence names what prevents a motion
    named = QUANTITIES[row["quantity"]].title in row["complaint"]
    return "prevented, named" if named else "FAILED"


def tables(rows: Sequence[Row]) -> list[Table]:
    """Each case in a line, and how many ended how."""
    answered = [row for row in rows if not row["failure"]]
    return [_cases(answered), _totals(answered, len(rows) - len(answered))]


def _cases(rows: Sequence[Row]) -> Table:
    """Cap, exit code, distance of the peak from the cap, and what was said."""
    cells = [
        (
            number(row["duration"], 4),
            f"{QUANTITIES[row['quantity']].title} [{QUANTITIES[row['quantity']].unit}]",
            number(row["multiple"], 3),
            number(row["cap"], 6),
            str(row["code"]),
            "-" if row["peak"] is None else f"{row['peak'] / row['cap'] - 1.0:+.1e}",
            verdict_on(row),
            row["complaint"] if row["peak"] is None else row["verdict"],
        )
        for row in rows
    ]

    head = ("T [s]", "capped", "times the least", "cap", "code", "peak over cap", "outcome", "said")
    notes = [f"on the cap: within {ACTIVE:g} of it", f"kept: at most {CAPS:g} beyond it"]
    return Table(f"least {OBJECTIVE} under a cap", head, cells, notes)


def _totals(rows: Sequence[Row], unanswered: int) -> Table:
    """Outcomes by the multiple of the least possible; the last four must not occur."""
    words = ["proven", "active", "kept", "prevented, named", "NOT PROVEN", "BROKEN", "FAILED"]
    total = [
        (word, *(str(sum(_is(row, word, m) for row in rows)) for m in MULTIPLES)) for word in words
    ]
    counted = [("failed to answer", str(unanswered), "", "", "")]
    columns = ("outcome", *(f"{m:g} times" for m in MULTIPLES))
    return Table("in total", columns, [*total, *counted])


def _is(row: Row, word: str, multiple: float) -> bool:
    return bool(row["multiple"] == multiple and verdict_on(row) == word)
