"""The show "mission": no time is better moved from one stage to another.

A case is a mission. Then a part of its moving time is taken from each stage and given to each
other one, and what the stages use of their caps is found again, by motions of their own. Where a
stage has just as much time as its caps allow, a little less breaks one of them. What the ring does
to the arm stands beside, by its best motion and by the paper's laws.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.show import Question, Row
from studies.common.console import Table, number, silent
from studies.common.drawing import save
from studies.common.folder import ResultsFolder
from studies.common.result import Result
from studies.mission.config import MissionStudy, study_from
from studies.mission.figures import draw
from studies.mission.split import EQUAL
from studies.mission.stages import STAGES, move
from studies.mission.study import run

LINE = "missions beside splits with 1 % of the time moved, and the arm under three laws: 4 cases"
LIMIT = 3600.0  # [s]

CASES: tuple[dict[str, Any], ...] = (
    {},
    {"total": 60.0},
    {"total": 40.0, "small_torque": 5.0, "truss": {"pulley_friction": 0.01}},
    {"least": "time"},
)
MOVED = 0.01  # part of the moving time
LAWS = ("optimal", "Bezier", "Step5")


def question(seed: int, index: int) -> Question:
    """The mission of a case; nothing is drawn, whatever the seed."""
    return {"mission": CASES[index % len(CASES)]}


def answer(question: Question, folder: Path) -> Row:
    """The mission, and what moved time makes of it."""
    study = study_from(question["mission"])
    result = run(study, silent())
    result.save(folder)
    save(draw(result), ResultsFolder(folder), silent())

    stages = {stage["stage"]: stage for stage in result.details["stages"]}
    durations = {name: float(stages[name]["duration"]) for name in STAGES}
    used = {name: float(stages[name]["utilisation"]) for name in STAGES}
    return {
        "question": result.question,
        "passed": all(check.passed for check in result.checks),
        "durations": durations,
        "used": used,
        "remark": result.remarks[0],
        "moved": moved_time(study, durations, used),
        "arm": {law: _arm(result, law) for law in LAWS},
    }


def moved_time(
    study: MissionStudy, durations: Mapping[str, float], used: Mapping[str, float]
) -> dict[str, float]:
    """Largest utilisation after time was moved, over that of the mission, by "giver to taker"."""
    step = MOVED * sum(durations.values())
    less, more = (
        {name: move(study, name, durations[name] + by, silent()).utilisation for name in STAGES}
        for by in (-step, step)
    )
    largest = max(used.values())
    return {
        f"{giver} to {taker}": max({**used, giver: less[giver], taker: more[taker]}.values())
        / largest
        for giver, taker in itertools.permutations(STAGES, 2)
    }


def _arm(result: Result, law: str) -> dict[str, float]:
    """Largest deflection of the arm's tip [m], its amplitude afterwards [m], and the energy [J]."""
    keys = ("arm-peak", "arm-amplitude", "arm-energy")
    return {key: result.value(key, f"ring by {law}") for key in keys}


def tables(rows: Sequence[Row]) -> list[Table]:
    """The missions, and what the ring does to the arm."""
    answered = [row for row in rows if not row["failure"]]
    return [_missions(answered), _arms(answered)]


def _missions(rows: Sequence[Row]) -> Table:
    cells = [
        (
            row["question"],
            *(f"{row['durations'][name]:.4f}" for name in STAGES),
            *(f"{100 * row['used'][name]:.3f}" for name in STAGES),
            "yes" if _alike(row) else row["remark"],
            f"{min(row['moved'].values()):.4f} to {max(row['moved'].values()):.4f}",
            _verdict(row),
        )
        for row in rows
    ]
    head = (
        *("mission", *(f"{name} [s]" for name in STAGES), *(f"{name} [%]" for name in STAGES)),
        *("alike", "moved time: largest use over the mission's", "outcome"),
    )
    notes = [
        f"alike: what the stages use of their caps differs by {EQUAL:g} of it at most",
        f"moved time: {100 * MOVED:g} % of the moving time, from each stage to each other one; "
        f"less than {EQUAL:g} of a utilisation is nothing",
    ]
    return Table("missions", head, cells, notes)


def _alike(row: Row) -> bool:
    used = np.array(list(row["used"].values()))
    return bool(used.max() <= used.min() * (1 + EQUAL))


def _verdict(row: Row) -> str:
    """What to read at a glance: whether a split with moved time is better."""
    if not row["passed"]:
        return "CHECKS FAILED"
    least = min(row["moved"].values())
    if least > 1.0:
        return "moving time loses"
    return "moving time gains nothing" if least > 1.0 - EQUAL else "BETTER"


def _arms(rows: Sequence[Row]) -> Table:
    cells = [
        (row["question"], law, *(number(row["arm"][law][key], 4) for key in row["arm"][law]))
        for row in rows
        for law in LAWS
    ]
    head = ("mission", "ring by", "tip, largest [m]", "tip, afterwards [m]", "energy left [J]")
    return Table("what the ring does to the arm", head, cells, [])
