"""The show "truss-random": studies of random trusses, each run as a user would run it.

Every case draws a truss, an objective, a duration, a jerk cap and in half of the cases another cap,
and calls `antenna-ocp truss` in a process of its own with a results folder. The other cap is a
multiple of the value that the optimum has without it. What counts is how the command ends: with
which exit code and verdict, whether it ever shows a traceback, whether `antenna-ocp check` passes
the profile that it wrote, whether a baseline within the caps is better, and what an exit code 3
rests on.
"""

from __future__ import annotations

import math
import re
import resource
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.records import ROOT
from benchmarks.shows.show import Columns, Question, Row, listed
from models.errors import ModelError
from models.truss import TrussParameters
from studies.common.console import Table, number
from studies.common.exit_codes import ExitCode
from studies.common.result import Result

# without those of the rope's speed and jerk, which need caps of their own, and those of a drive
ASKED = (
    "peak-acceleration",
    "peak-rope-acceleration",
    "peak-force",
    "peak-reaction",
    "peak-power",
    "energy",
    "time",
)
LINE = "random studies of the truss by the command: exit codes, verdicts, tracebacks"
LIMIT = 1200.0  # [s]; a study from five starts takes about half a minute on an idle core

DURATIONS = (2.0, 600.0)  # T [s], log-uniform
FRICTION = (0.0, 0.05)  # mu [-]
MODULES = (6, 48)
LENGTHS = ("bar_length", "half_cross_bar", "crank", "link", "spring_free_length")  # [m]
SPREAD = 0.3  # of a length, relative
NO_JERK_CAP = 0.3  # share of the studies without one
JERK_CAPS = (40.0, 1000.0)  # times 1/T^3 [rad], log-uniform; below 46 no motion deploys in T
ACCELERATION_CAPS = (6.0, 40.0)  # times 1/T^2 [rad], where nothing else bounds the time from below
SHORTEST = 0.1  # of T, where the duration is free
OTHER_CAPS = {"speed": "peak-speed", "acceleration": "peak-acceleration", "force": "peak-force"}
OTHER_CAP = 0.5  # share of the studies that have one
FACTORS = (0.8, 3.0)  # of the value without it, log-uniform
NO_WORSE = 1e-4  # relative to a baseline within the caps: two values of one optimum
WELL_ENDED = (ExitCode.OK, ExitCode.INFEASIBLE)

# What an exit code 3 may rest on: the words of a proof, and its name.
PROOFS = {
    "no minimum exists": "a limit that no motion attains",
    "(phase plane, global)": "phase plane",
    "with a jerk cap of": "closed form of the least jerk",
    "they need at least": "closed form of the least time",
    "ropes cannot brake": "what a rope that only pulls leaves",
    "ropes only pull": "what a rope that only pulls leaves",
    "under the caps on its rates": "what a rope that only pulls leaves",
    "at rest at the": "equilibrium at rest",
    "the springs pull": "equilibrium at rest",
    "cap needs at least": "the ridge under capped rates",
    "a minimum tension of": "equilibrium at rest",
}

# What no user should ever see: a traceback, our own last resort, an error's or a warning's bare
# name at the start of a line or behind a place in a file.
TRACEBACK = re.compile(
    r"Traceback \(most recent call last\)|unforeseen|^\s+File \".*\", line"
    r"|(^|:\d+: )\w*(Error|Warning): ",
    re.MULTILINE,
)
VERDICT = re.compile(r"^verdict: (.*)$", re.MULTILINE)
MINIMISED = re.compile(r"^\* .*?\]\s+(\S+)|^\* .*?\s{2,}(\S+)", re.MULTILINE)  # row of the table
COMPLAINT = re.compile(r"^antenna-ocp: (.*(?:\n  .*)*)$", re.MULTILINE)


def question(seed: int, index: int) -> Question:
    """Draw a study; all objectives take turns.

    Returns
    -------
    mapping
        The numbers drawn, and `command`, the words after `antenna-ocp`.
    """
    rng = np.random.default_rng([seed, index])
    objective = ASKED[index % len(ASKED)]
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

    # drawn last, so that it changes nothing of what is drawn before
    drawn = rng.random() < OTHER_CAP
    free = [name for name in OTHER_CAPS if f"--{name}-cap" not in command]
    cap = str(rng.choice([name for name in free if OTHER_CAPS[name] != objective]))
    factor = _rounded(_log_uniform(rng, *FACTORS))
    return {
        "objective": objective,
        "duration": duration,
        "friction": friction,
        "modules": modules,
        "lengths": lengths,
        "jerk_multiple": multiple,
        "other_cap": cap if drawn else None,
        "factor": factor if drawn else None,
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
    """Run the command, figures included; its results are kept where it did not end well.

    A study with another cap is run without it first: the cap is a multiple of what came out.
    """
    command, cap = list(question["command"]), question.get("other_cap")
    limit, uncapped = None, None
    if cap is not None:
        first = folder / "without the cap"
        alone = [*command, "--starts", "bezier", "--no-figures"]
        uncapped = _run(alone, first, folder / "printed_without.txt")[0]
        if uncapped == ExitCode.OK:
            value = Result.load(first).value(OTHER_CAPS[cap])
            limit = _rounded(question["factor"] * value)
            command += [f"--{cap}-cap", f"{limit:g}"]

    results, begin = folder / "study", resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    code, printed = _run(command, results, folder / "printed.txt")
    processor = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begin

    row = {
        "code": code,
        "processor": processor,
        "cap_value": limit,
        "code_without_cap": uncapped,
        "files": sum(1 for _ in results.iterdir()) if results.is_dir() else 0,
        **read_output(printed),
        **_held_against(results, folder / "printed_check.txt", code, printed),
    }
    if code in WELL_ENDED:
        for place in (results, folder / "without the cap"):
            shutil.rmtree(place, ignore_errors=True)
    return row


def _run(command: Sequence[str], results: Path, printed: Path) -> tuple[int, str]:
    """Run a study in a process of its own; its exit code and all that it printed."""
    shutil.rmtree(results, ignore_errors=True)  # of an earlier try that was killed
    return run_command([*command, "--results", str(results)], printed)


def run_command(command: Sequence[str], printed: Path) -> tuple[int, str]:
    """Run the command in a process of its own; its exit code and all that it printed."""
    ended = subprocess.run(
        [sys.executable, "-m", "antenna_ocp", *command],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    printed.write_text(ended.stdout, "utf-8")
    return ended.returncode, ended.stdout


def _held_against(results: Path, file: Path, code: int, printed: str) -> dict[str, Any]:
    """What an ending has to stand: the check of its own profile, the baselines, its proof."""
    held: dict[str, Any] = {"check": None, "beaten_by": "", "proof": ""}
    if code == ExitCode.INFEASIBLE:
        held["proof"] = next((name for words, name in PROOFS.items() if words in printed), "")
    if code != ExitCode.OK:
        return held
    profile, study = results / "profile.csv", results / "input.toml"
    held["check"] = run_command(["check", str(profile), str(study), "--no-optimum"], file)[0]
    held["beaten_by"] = ", ".join(beaten_by(Result.load(results)))
    return held


def beaten_by(result: Result) -> list[str]:
    """Names of the baselines that keep all caps and are better in what is minimised."""
    own, *others = result.laws
    breaking = {law for row in result.table for law in row.broken_by}
    return [
        law
        for row in result.table
        for law in others
        if row.minimised
        and law not in breaking
        and row.values[law] < row.values[own] * (1 - NO_WORSE)
    ]


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
        "complaint": "" if complaint is None else complaint[1].replace("\n  ", " "),
        "traceback": TRACEBACK.search(text) is not None,
    }


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each study in a row, and what holds for all, with how long they took."""
    columns: Columns = {
        "case": "index",
        "objective": "objective",
        "T [s]": lambda row: number(row["duration"], 4),
        "mu": lambda row: number(row["friction"], 3),
        "modules": "modules",
        "jerk T^3": lambda row: number(row["jerk_multiple"], 4),
        "other cap": lambda row: (
            f"{row['other_cap']} x {row['factor']:g}" if row.get("other_cap") else "-"
        ),
        "code": "code",
        "value": lambda row: number(row["value"], 6),
        "CPU [s]": lambda row: number(row.get("processor"), 3),
        "check": lambda row: number(row.get("check")),
        "beaten by": lambda row: row.get("beaten_by") or "-",
        "traceback": lambda row: "YES" if row["traceback"] else "no",
        "verdict, proof or reason": _reason,
    }
    note = "value: of the objective, SI units; what each command printed is in its case's folder."
    studies = listed("Random studies of the truss", rows, columns, (note,))
    return [studies, _held_by(rows)]


def _reason(row: Row) -> str:
    words = row["failure"] or row["verdict"] or row.get("proof") or row["complaint"]
    return str(words[:60])


def _held_by(rows: Sequence[Row]) -> Table:
    """What must hold for all studies, and for how many it does."""
    done = [row for row in rows if not row["failure"]]
    solved = [row for row in done if row["code"] == ExitCode.OK]
    refused = [row for row in done if row["code"] == ExitCode.INFEASIBLE]
    seconds = [row["processor"] for row in done if row.get("processor") is not None]
    middle, most, worst = np.percentile(seconds, (50, 95, 100)) if seconds else [math.nan] * 3
    unsure = (ExitCode.NOT_SOLVED, ExitCode.NOT_VERIFIED)

    def share(whole: Sequence[Row], counts: Callable[[Row], object]) -> str:
        return f"{sum(bool(counts(row)) for row in whole)} of {len(whole)}"

    def broke(row: Row) -> bool:
        return row["traceback"] or row["code"] == ExitCode.INTERNAL

    cells = [
        ("no answer within the limit", share(rows, lambda row: row["failure"])),
        ("exit 70 or a traceback", share(done, broke)),
        ("exit 0, and its profile passes", share(solved, lambda row: row.get("check") == 0)),
        ("exit 0, and a baseline is better", share(solved, lambda row: row.get("beaten_by"))),
        ("exit 3, and its proof is named", share(refused, lambda row: row.get("proof"))),
        ("exits 4 and 5", share(done, lambda row: row["code"] in unsure)),
        ("CPU seconds: median", f"{middle:.3g}"),
        ("CPU seconds: 95 %", f"{most:.3g}"),
        ("CPU seconds: worst", f"{worst:.3g}"),
    ]
    return Table("Must hold", ("", "found"), cells)
