"""The show "truss-random": studies of random trusses, each run as a user would run it.

Every case draws a truss, an objective, a duration and a jerk cap, and calls `antenna-ocp truss` in
a process of its own with a results folder, figures included. What counts is how the command ends:
with which exit code, with which verdict, and whether it ever shows a traceback.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.records import ROOT
from benchmarks.shows.show import Question, Row
from models.errors import ModelError
from models.truss import TrussParameters
from studies.common.console import Table, number
from studies.common.exit_codes import ExitCode
from studies.truss.quantities import OBJECTIVES

LINE = "random studies of the truss by the command: exit codes, verdicts, tracebacks"
LIMIT = 1800.0  # [s]; a study from five starts takes about half a minute on an idle core

DURATIONS = (2.0, 600.0)  # T [s], log-uniform
FRICTION = (0.0, 0.05)  # mu [-]
MODULES = (6, 48)
LENGTHS = ("bar_length", "half_cross_bar", "crank", "link", "spring_free_length")  # [m]
SPREAD = 0.3  # of a length, relative
NO_JERK_CAP = 0.3  # share of the studies without one
JERK_CAPS = (40.0, 1000.0)  # times 1/T^3 [rad], log-uniform; below 46 no motion deploys in T
ACCELERATION_CAPS = (6.0, 40.0)  # times 1/T^2 [rad], where nothing else bounds the time from below
SHORTEST = 0.1  # of T, where the duration is free
WELL_ENDED = (ExitCode.OK, ExitCode.INFEASIBLE)

# What no user should ever see: a traceback, our own last resort, an error's or a warning's bare
# name at the start of a line or behind a place in a file.
TRACEBACK = re.compile(
    r"Traceback \(most recent call last\)|unforeseen|^\s+File \".*\", line"
    r"|(^|:\d+: )\w*(Error|Warning): ",
    re.MULTILINE,
)
VERDICT = re.compile(r"^verdict: (.*)$", re.MULTILINE)
MINIMISED = re.compile(r"^\* .*?\]\s+(\S+)|^\* .*?\s{2,}(\S+)", re.MULTILINE)  # row of the table
COMPLAINT = re.compile(r"^antenna-ocp: (.*)$", re.MULTILINE)


def question(seed: int, index: int) -> Question:
    """Draw a study; all objectives take turns.

    Returns
    -------
    mapping
        The numbers drawn, and `command`, the words after `antenna-ocp`.
    """
    rng = np.random.default_rng([seed, index])
    objective = tuple(OBJECTIVES)[index % len(OBJECTIVES)]
    duration = _rounded(_log_uniform(rng, *DURATIONS))
    friction = _rounded(rng.uniform(*FRICTION))
    modules = int(rng.integers(MODULES[0], MODULES[1] + 1))
    lengths = _lengths(rng)
    multiple = None if rng.random() < NO_JERK_CAP else _rounded(_log_uniform(rng, *JERK_CAPS))

    command = ["truss", "--objective", objective, "--friction", f"{friction:g}"]
    command += ["--modules", str(modules)]
    for name, length in lengths.items():
        command += ["--parameter", f"{name}={length:g}"]
    if objective != "time":
        command += ["--duration", f"{duration:g}"]
        command += [] if multiple is None else ["--jerk-cap", f"{multiple:g}/T^3"]
    else:
        command += ["--duration", f"{SHORTEST * duration:g}..{duration:g}"]
        command += _cap_of_the_fastest(rng, duration, multiple)
    return {
        "objective": objective,
        "duration": duration,
        "friction": friction,
        "modules": modules,
        "lengths": lengths,
        "jerk_multiple": multiple,
        "command": command,
    }


def _cap_of_the_fastest(
    rng: np.random.Generator, duration: float, jerk_multiple: float | None
) -> list[str]:
    """A cap for the least time: without any, the least time is the shortest duration allowed.

    With a free duration the command takes no multiple of 1/T^3, so the number is written out.
    """
    if jerk_multiple is not None:
        return ["--jerk-cap", f"{jerk_multiple / duration**3:.6g}"]
    multiple = _log_uniform(rng, *ACCELERATION_CAPS)
    return ["--acceleration-cap", f"{multiple / duration**2:.6g}"]


def _lengths(rng: np.random.Generator) -> dict[str, float]:
    """Lengths [m] of a truss that can be built: drawn until the model takes them."""
    paper = TrussParameters()
    while True:
        lengths: dict[str, Any] = {
            name: _rounded(getattr(paper, name) * rng.uniform(1 - SPREAD, 1 + SPREAD))
            for name in LENGTHS
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a spring that pulls while stowed is allowed
            try:
                TrussParameters(**lengths)
            except ModelError:
                continue
        return lengths


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _rounded(value: float) -> float:
    """Four digits, as a user would type them, and as the command line shows them."""
    return float(f"{value:.4g}")


def answer(question: Question, folder: Path) -> Row:
    """Run the command; what it printed is kept, and its results where it did not end well."""
    results = folder / "study"
    shutil.rmtree(results, ignore_errors=True)  # of an earlier try that was killed
    words = [sys.executable, "-m", "studies.cli", *question["command"]]
    ended = subprocess.run(
        [*words, "--results", str(results)],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    (folder / "printed.txt").write_text(ended.stdout, "utf-8")

    files = sum(1 for _ in results.iterdir()) if results.is_dir() else 0
    if ended.returncode in WELL_ENDED:
        shutil.rmtree(results, ignore_errors=True)
    return {"code": ended.returncode, "files": files, **read_output(ended.stdout)}


def read_output(text: str) -> dict[str, Any]:
    """Return value of the objective, verdict, complaint and whether there is a traceback.

    Parameters
    ----------
    text : str
        All that the command printed.
    """
    verdict, complaint = VERDICT.search(text), COMPLAINT.search(text)
    minimised = MINIMISED.search(text)
    return {
        "value": None if minimised is None else float(minimised[1] or minimised[2]),
        "verdict": "" if verdict is None else verdict[1],
        "complaint": "" if complaint is None else complaint[1],
        "traceback": TRACEBACK.search(text) is not None,
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each study in a row, and how many ended how."""
    head = (
        "case",
        "objective",
        "T [s]",
        "mu",
        "modules",
        "jerk T^3",
        "code",
        "value",
        "seconds",
        "traceback",
        "verdict or reason",
    )
    cells = [_cells(row) for row in rows]
    note = "value: of the objective, SI units; what each command printed is in its case's folder."
    studies = Table("Random studies of the truss", head, cells, (note,))
    return [studies, _totals(rows)]


def _cells(row: Row) -> tuple[str, ...]:
    failure = row["failure"]
    reason = failure or row["verdict"] or row["complaint"]
    return (
        str(row["index"]),
        row["objective"],
        number(row["duration"], 4),
        number(row["friction"], 3),
        str(row["modules"]),
        number(row["jerk_multiple"], 4),
        "-" if failure else str(row["code"]),
        number(None if failure else row["value"], 6),
        f"{row['seconds']:.1f}",
        "-" if failure else ("YES" if row["traceback"] else "no"),
        reason[:60],
    )


def _totals(rows: Sequence[Row]) -> Table:
    """How the studies of each objective ended."""
    endings = {_ending(row): None for row in rows}
    names = sorted(endings)
    head = ("objective", "studies", *names, "tracebacks", "longest [s]")
    body = []
    for objective in (*OBJECTIVES, "all"):
        chosen = [row for row in rows if objective in (row["objective"], "all")]
        counts = [str(sum(_ending(row) == name for row in chosen)) for name in names]
        tracebacks = sum(bool(row.get("traceback")) for row in chosen)
        longest = max((row["seconds"] for row in chosen), default=None)
        cells = (objective, str(len(chosen)), *counts, str(tracebacks), number(longest, 3))
        body.append(cells)
    return Table("How they ended", head, body)


def _ending(row: Row) -> str:
    """Name of the exit code, in small letters."""
    if row["failure"]:
        return "no answer"
    names = {int(code): code.name for code in ExitCode}
    name = names.get(row["code"], f"code {row['code']}")  # others: killed by a signal
    return name.lower().replace("_", " ")
