"""The show "continued": each long command, killed at random moments and continued, ends the same.

A case starts one command, and ends it when its processes have used so many seconds of processor
time: half of the times by Ctrl-C, half by SIGKILL. Then it gives the command that the former one
has said to go on by, and ends that, too. The last one is left alone. The moments cut the time of a
run that nobody ended at random. Its numbers are compared with those of the last one, and no
finished step may have been taken again: its file is the one from before. Processor time is read
from Linux's /proc.
"""

from __future__ import annotations

import random
import re
import shutil
import signal
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.shows.fuzz.interrupts import FRONT, STUDY, ended_at
from benchmarks.shows.fuzz.said import faults_of
from benchmarks.shows.show import Columns, Question, Row, listed
from ocp.arrays import Array
from studies.common.console import Table
from studies.common.exit_codes import ExitCode
from studies.common.result import Result

LINE = "each long command killed at random moments and continued, beside a run that nobody ended"
LIMIT = 3600.0  # [s]
KILLS = 10  # of a case
BEGIN = 2.0  # [s of processor time] in which a command reads its modules
SAME = 1e-9  # relative: a stored number is the number itself
GO_ON = re.compile(r"to resume(?: after an interruption)?:\s+antenna-ocp (.+)")

# coarse forms of all commands that may take longer than 10 s; STUDY stands for the file
WORDS: Mapping[str, Sequence[str]] = {
    "truss": ("--objective", "energy", "--friction", "0.01", "--starts", "bezier,step5"),
    "codesign": (
        *("--objective", "peak-force", "--duration", "140", "--jerk-cap", "bezier"),
        *("--intervals", "24", "--starts", "bezier", "--designs", "2"),
    ),
    "robust truss": ("STUDY", "--coarse"),
    "pareto truss": (*FRONT, "--points", "3", "--coarse"),
    "mission": ("--total", "38", "--no-refine", "--residual-energy", "0.01", "--intervals", "80"),
    "turn": (),
    "paper": (),
    "arm solve": ("--stage", "small", "--objective", "energy"),
    "arm baselines": ("--stage", "small"),
    "arm least-duration": ("--stage", "small"),
    "arm sequence": (),
    "pareto arm": ("--range", "8.6..8.7"),
    "flex": ("--preset", "big-arm"),
    "robust arm": ("--stage", "big", "--drive", "angle", "--points", "4", "--draws", "0"),
}


def question(seed: int, index: int) -> Question:
    """The command of a case, and when each of its runs ends: parts of one that nobody ends."""
    name, rng = list(WORDS)[index % len(WORDS)], random.Random(f"{seed} {index}")
    first = index // len(WORDS) % 2
    numbers = [(signal.SIGINT, signal.SIGKILL)[(first + k) % 2] for k in range(KILLS)]
    moments = sorted(rng.uniform(0, 1) for _ in numbers)
    parts = np.diff([0.0, *moments])
    ends = [{"signal": int(n), "at": float(part)} for n, part in zip(numbers, parts, strict=True)]
    return {"name": name, "ends": ends}


def answer(question: Question, folder: Path) -> Row:
    """End the command at its moments, go on, and compare the results."""
    name = question["name"]
    (folder / "study.toml").write_text(STUDY)
    words = [*name.split(), *(w.replace("STUDY", "study.toml") for w in WORDS[name])]
    words = [*words, "--no-figures", "--results"]
    whole = folder / "whole"
    alone = _ended([*words, str(whole)], None, 0, folder / "alone.txt")

    kept, faults = folder / "kept", []
    legs: list[Row] = []
    go_on = anew = [*words, str(kept)]
    for end in [*question["ends"], None]:
        before = _files(kept)
        at = None if end is None else BEGIN + end["at"] * alone["in all"]
        # a file of its own: what has served a killed run may still write a last line
        number, said = 0 if end is None else end["signal"], folder / f"run_{len(legs)}.txt"
        leg = _ended(go_on, at, number, said)
        legs.append(leg)
        now = _files(kept)
        # a verified result of an arm keeps none
        again = sorted(file for file, when in before.items() if now.get(file, when) != when)
        faults += [f"taken again: {', '.join(again)}"] if again else []
        faults += [] if leg["code"] == -signal.SIGKILL else faults_of(leg["code"], leg["said"])
        if not leg["stopped"]:
            break
        if found := GO_ON.search(leg["said"]):
            go_on = [*found[1].split(), "--no-figures"]
        else:  # killed before it said anything
            faults += ["says no command to resume"] if "results go to" in leg["said"] else []
            if go_on == anew:
                shutil.rmtree(kept, ignore_errors=True)

    if legs[-1]["code"] != alone["code"]:
        faults.append(f"exit code {legs[-1]['code']}, and {alone['code']} of the other run")
    off = _apart(whole, kept)
    faults += [f"off by {off:.1e}"] if not off <= SAME else []
    return {
        "seconds alone": alone["in all"],
        "seconds of all": [leg["in all"] for leg in legs],
        "codes": [leg["code"] for leg in legs],
        "steps": len(before | now),
        "off": off,
        "faults": faults,
    }


def _ended(words: Sequence[str], at: float | None, number: int, file: Path) -> Row:
    """A command that is ended at a moment [s of processor time], or left alone.

    Parameters
    ----------
    file : for what it says, in the folder in which it works.
    """
    with file.open("w+", encoding="utf-8") as said:
        at = float("inf") if at is None else at
        row = ended_at(words, at, file.parent, said.fileno(), number)
        said.seek(0)
        return {**row, "said": said.read()}


def _files(folder: Path) -> dict[str, int]:
    """The finished steps of a study, and when each was written [ns]."""
    return {
        str(file.relative_to(folder)): file.stat().st_mtime_ns
        for file in folder.glob("steps/**/*.step")
    }


def _apart(whole: Path, kept: Path) -> float:
    """Largest relative difference of two results' numbers; infinite where they have others."""
    first, second = (_numbers(Result.load(folder)) for folder in (whole, kept))
    if list(first) != list(second):
        return float("inf")
    largest = 0.0
    for name, one in first.items():
        other = second[name]
        if one.shape != other.shape or (np.isnan(one) != np.isnan(other)).any():
            return float("inf")
        size = np.nanmax(np.abs(one), initial=0.0) or 1.0
        largest = max(largest, float(np.nanmax(np.abs(one - other), initial=0.0) / size))
    return largest


def _numbers(result: Result) -> dict[str, Array]:
    """All numbers of a result, by what they are, but the seconds that its solves took."""
    rows = {f"{row.key}, {law}": x for row in result.table for law, x in row.values.items()}
    arrays = {name: series.values for name, series in result.arrays.items()}
    arrays.pop("seconds", None)
    return {name: np.asarray(x, dtype=float) for name, x in {**rows, **arrays}.items()}


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each case in a row, and the totals."""
    columns: Columns = {
        "command": "name",
        "ends": lambda row: ", ".join(
            f"{signal.Signals(end['signal']).name} {end['at']:.2f}" for end in row["ends"]
        ),
        "alone [s]": lambda row: f"{row['seconds alone']:.1f}",
        "in all [s]": lambda row: f"{sum(row['seconds of all']):.1f}",
        "codes": lambda row: " ".join(map(str, row["codes"])),
        "steps": "steps",
        "off": lambda row: f"{row['off']:.1e}",
        "faults": lambda row: row["failure"] or "; ".join(row["faults"]),
    }
    answered = [row for row in rows if not row["failure"]]
    total = {
        "cases": len(rows),
        "with a fault": sum(bool(row["failure"] or row["faults"]) for row in rows),
        "ends before their own": sum(
            code in (ExitCode.INTERRUPTED, -signal.SIGKILL)
            for row in answered
            for code in row["codes"]
        ),
        "largest difference": f"{max((row['off'] for row in answered), default=0.0):.1e}",
    }
    totals = Table("In total", ("", ""), [(name, str(value)) for name, value in total.items()])
    return [listed("Ended and continued", rows, columns), totals]
