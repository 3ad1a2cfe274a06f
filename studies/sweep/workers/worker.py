"""The process that solves cases: it reads a task a line, and writes what came of it.

It stands alone: a solver that crashes or hangs takes nothing else with it. It ends when the process
that started it does.
"""

from __future__ import annotations

import io
import json
import os
import sys
import time
from collections.abc import Mapping
from typing import Any, TextIO

import numpy as np

from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import plain
from studies.common.processes.child import ends_with_parent
from studies.common.result import Result, Series, Verdict
from studies.sweep.subjects import solved, subject

# what a case that ended with one of these codes is called in the table
STATUS = {
    ExitCode.INFEASIBLE: "infeasible",
    ExitCode.NOT_SOLVED: "not solved",
    ExitCode.BAD_INPUT: "refused",
}


def outcome(task: Mapping[str, Any]) -> dict[str, Any]:
    """Solve a case; whatever goes wrong is an outcome, too.

    Parameters
    ----------
    task : mapping
        `subject` and `configuration`; `motion` to start from, or None; `keep_motion`, whether
        another case may start from this one.

    Returns
    -------
    dict
        `record`, with status, reason and values, and `motion`, which may be None.
    """
    begin = time.perf_counter()
    motion = None
    try:
        neighbour = None if task["motion"] is None else _unpacked(task["motion"])
        result = solved(subject(task["subject"])[0], task["configuration"], neighbour)
        record = _told(result)
        motion = _packed(result) if task["keep_motion"] and result.passed else None
    except StudyError as error:
        status = STATUS.get(error.exit_code, "not solved")
        record = {"status": status, "reason": str(error)}
    except MemoryError:
        record = {"status": "not solved", "reason": "memory ran out"}
    except Exception as error:
        record = {"status": "defect", "reason": f"unexpected {type(error).__name__}: {error}"}
    record["seconds"] = time.perf_counter() - begin
    return {"record": plain(record), "motion": motion}


def _told(result: Result) -> dict[str, Any]:
    """What a case keeps of its result."""
    law = next(iter(result.laws), "")
    rows = [row for row in result.table if law in row.values]
    failed = [check.sentence for check in result.checks if not check.passed]
    return {
        "status": "solved" if result.passed else "not verified",
        "reason": "" if result.passed else "; ".join(failed) or result.verdict.sentence,
        "verdict": result.verdict.kind,
        "values": {row.key: row.values[law] for row in rows},
        "titles": {row.key: [row.title, row.unit] for row in rows},
        "minimised": [row.key for row in rows if row.minimised],
        **({"front": _front(result)} if "axes" in result.details else {}),
    }


def _front(result: Result) -> dict[str, Any]:
    """The points of a front: both objectives, and the price of the limit."""
    x, y = result.details["axes"]
    price = {
        "key": "price",
        "title": f"shadow price of {x['title']}",
        "unit": result.arrays["price"].unit,
    }
    return {
        "axes": [x, y, price],
        "points": {axis["key"]: result.arrays[axis["key"]].values for axis in (x, y, price)},
    }


def _packed(result: Result) -> dict[str, Any]:
    """A motion as JSON: its result without table and search."""
    return {
        "kind": result.kind,
        "question": result.question,
        "configuration": plain(result.configuration),
        "arrays": {
            name: [series.unit, series.axis, series.values.tolist()]
            for name, series in result.arrays.items()
        },
    }


def _unpacked(motion: Mapping[str, Any]) -> Result:
    arrays = {
        name: Series(unit, axis, np.array(values, dtype=float))  # null becomes nan
        for name, (unit, axis, values) in motion["arrays"].items()
    }
    return Result(
        kind=motion["kind"],
        question=motion["question"],
        configuration=motion["configuration"],
        arrays=arrays,
        verdict=Verdict("local", "a neighbouring case"),
    )


def serve() -> None:
    """Answer tasks from standard input until it ends."""
    if not ends_with_parent():
        return

    # what solvers print must not come between the answers
    answers = _apart_from_prints()
    for line in sys.stdin:
        answers.write(json.dumps(outcome(json.loads(line))) + "\n")
        answers.flush()


def _apart_from_prints() -> TextIO:
    """Standard output for the answers alone; all else that is printed goes nowhere."""
    answers = io.TextIOWrapper(os.fdopen(os.dup(1), "wb"), encoding="utf-8")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    return answers
