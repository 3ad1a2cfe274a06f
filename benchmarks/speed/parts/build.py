"""The part "build": seconds to build the force problem's nonlinear program, of small and large."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from time import process_time
from typing import TYPE_CHECKING, Any

from benchmarks.parts import Measured, Setup
from studies.common.console import Table

if TYPE_CHECKING:
    from studies.truss.config import TrussStudy

INTERVALS = 100
MODULES = (24, 1000)
TARGET = 0.1  # [s], of one build


def measure(setup: Setup) -> Iterator[Measured]:
    """Build repeatedly in this process, after one build that loads everything; see `BenchmarkPart`.

    Each row has the modules of the truss, the size of the program, and the medians of `statement`,
    processor time to state the problem, model expressions included [s], and of `transcription`,
    from statement and mesh to functions with derivatives [s].
    """
    rows: list[dict[str, Any]] = []
    for modules in MODULES:
        study = _study(modules)
        _build(study)
        builds = [_build(study) for _ in range(setup.repeats)]
        medians = {
            key: statistics.median(build[key] for build in builds)
            for key in ("statement", "transcription")
        }
        rows.append({"modules": modules, **builds[0], **medians})
        setup.console.progress(f"build, {modules} modules: {sum(medians.values()):.3f} s")
        yield {"intervals": INTERVALS, "repeats": setup.repeats, "rows": rows}


def _study(modules: int) -> TrussStudy:
    """Least peak force in 5 s."""
    from studies.truss.config import study_from

    return study_from(
        {
            "minimise": "peak-force",
            "duration": 5.0,
            "caps": {"jerk": "200/T^3"},
            "truss": {"pulley_friction": 0.01, "modules": modules},
        }
    )


def _build(study: TrussStudy) -> dict[str, Any]:
    """Unknowns, rows, and the processor time of statement and transcription [s]."""
    from benchmarks.speed.process.program import build
    from studies.truss.motions.starts import bezier_start
    from studies.truss.problem import state
    from studies.truss.quantities import OBJECTIVES

    start = bezier_start(study)
    begin = process_time()
    statement = state(study, start, dict.fromkeys(OBJECTIVES, 1.0), with_forces=True)
    problem = statement.problem()
    stated = process_time()
    transcription = build(problem, INTERVALS)
    return {
        "unknowns": transcription.columns.count,
        "rows": transcription.program.rows,
        "statement": stated - begin,
        "transcription": process_time() - stated,
    }


def tables(record: Measured) -> list[Table]:
    """Return seconds and sizes."""
    rows = []
    for row in record["rows"]:
        seconds = (row["statement"], row["transcription"])
        rows.append(
            (
                *(str(row[key]) for key in ("modules", "unknowns", "rows")),
                *(f"{s:.4f}" for s in (*seconds, sum(seconds))),
            )
        )
    return [
        Table(
            f"Least peak force with capped jerk, {record['intervals']} intervals",
            ("modules", "unknowns", "rows", "statement [s]", "transcription [s]", "total [s]"),
            rows,
            (
                f"seconds of processor time, median of {record['repeats']} builds after a first "
                f"one; the target is {TARGET:g} s in all.",
            ),
        )
    ]


def draw(record: Measured) -> None:
    """Draw nothing: two rows of numbers."""
