"""The show "arm-random": random stages of the arm, each run by `antenna-ocp arm solve`.

Every case draws an arm, a stage, an objective and a duration. What counts is how the command ends,
whether the full model is left with no more than was allowed, whether the exported profile passes
its own check, and what it takes.
"""

from __future__ import annotations

import math
import resource
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.show import Columns, Question, Row, listed
from benchmarks.shows.truss_random import read_output, run_command
from studies.arm.config import DURATIONS
from studies.arm.optimal.objectives import OBJECTIVES
from studies.common.console import Table, number
from studies.common.exit_codes import ExitCode
from studies.common.result import Result

LINE = "random stages of the arm by the command: exit codes, residual energies, seconds"
LIMIT = 1800.0  # [s]
ASKED = tuple(name for name in OBJECTIVES if name != "time")  # least time needs caps of its own
STAGES = ("big", "small")
PACES = (0.9, 3.0)  # times the stage's own duration, log-uniform
SPREAD = 0.3  # of lengths and of the tip's mass, relative
SIZES = {"big-length": 3.0, "small-length": 2.0, "tip-mass": 30.0}  # [m], [m], [kg]


def question(seed: int, index: int) -> Question:
    """Draw a stage; objectives and stages take turns."""
    rng = np.random.default_rng([seed, index])
    objective, stage = ASKED[index % len(ASKED)], STAGES[(index // len(ASKED)) % len(STAGES)]
    pace = math.exp(rng.uniform(math.log(PACES[0]), math.log(PACES[1])))
    duration = float(f"{DURATIONS[stage] * pace:.4g}")
    command = ["arm", "solve", "--stage", stage, "--objective", objective]
    command += ["--duration", f"{duration:g}"]
    for name, size in SIZES.items():
        command += [f"--{name}", f"{size * rng.uniform(1 - SPREAD, 1 + SPREAD):.4g}"]
    return {"stage": stage, "objective": objective, "duration": duration, "command": command}


def answer(question: Question, folder: Path) -> Row:
    """Run the command, figures included; what it printed is kept."""
    results, before = folder / "study", resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    shutil.rmtree(results, ignore_errors=True)  # of an earlier try that was killed
    words = [*question["command"], "--results", str(results)]
    code, printed = run_command(words, folder / "printed.txt")
    processor = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before

    row: dict[str, Any] = {
        "code": code,
        "processor": processor,
        "left": None,
        "failed": "",
        "check": None,
    }
    if code in (ExitCode.OK, ExitCode.NOT_VERIFIED):
        result = Result.load(results)
        row["left"] = result.value("residual_energy")
        row["failed"] = "; ".join(check.name for check in result.checks if not check.passed)
    if code == ExitCode.OK:
        words = ["check", str(results / "profile.csv"), str(results / "input.toml")]
        row["check"] = run_command([*words, "--no-optimum"], folder / "printed_check.txt")[0]
        shutil.rmtree(results)  # some megabytes each
    return row | read_output(printed)


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each stage in a row, and how many ended how."""
    columns: Columns = {
        "case": "index",
        "stage": "stage",
        "objective": "objective",
        "T [s]": lambda row: number(row["duration"], 4),
        "code": "code",
        "left [J]": lambda row: number(row["left"], 3),
        "check": lambda row: number(row["check"]),
        "CPU [s]": lambda row: f"{row['processor']:.1f}",
        "failed": lambda row: (row["failure"] or row["failed"] or row["complaint"])[:60],
    }
    stages = listed("Random stages of the arm", rows, columns)

    answered = [row for row in rows if not row["failure"]]
    codes = sorted({row["code"] for row in answered})
    counts = [(str(code), str(sum(row["code"] == code for row in answered))) for code in codes]
    seconds = [row["processor"] for row in answered] or [math.nan]
    middle, most, worst = np.percentile(seconds, (50, 95, 100))
    times = f"processor seconds: median {middle:.1f}, 95 % {most:.1f}, worst {worst:.1f}"
    traces = f"tracebacks: {sum(bool(row['traceback']) for row in answered)}"
    solved = [row for row in answered if row["code"] == ExitCode.OK]
    passed = sum(row["check"] == ExitCode.OK for row in solved)
    checks = f"exit 0, and its exported profile passes: {passed} of {len(solved)}"
    return [stages, Table("How they ended", ("code", "stages"), counts, (times, traces, checks))]
