"""The show "fuzz-commands": command lines and study files that are spoilt end as they should.

Each case is one line, carried out in a process of its own. No unforeseen error may come of it, no
silence, no work long after its budget or its stop, and no message with a long first line. Silence
is what a user sees: it counts as wall time. Work after the end counts as this process's processor
time, because a loaded machine stretches its wall time. The rows hold both times of both.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import os
import shutil
import signal
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.shows.fuzz.grammar import KINDS, draw
from benchmarks.shows.fuzz.said import faults_of
from benchmarks.shows.show import Columns, Question, Row, listed
from benchmarks.shows.truss_random import run_command
from studies.cli import main
from studies.common.console import Table

LINE = "command lines and study files spoilt at random, over all sub-commands"
LIMIT = 240.0  # [s]
BUDGET = 20.0  # [s] of lines that state none: they are stopped then, as by Ctrl-C
QUIET = 5.0  # [s] of wall time without a line
MORE = 2.0  # [s] of processor time after the budget or the stop
LOOK = 0.1  # [s] between two looks at the time
SHOWN = 160  # characters of a line in the table
MADE = ("truss", "--objective", "peak-acceleration", "--duration", "5", "--intervals", "8")


def question(seed: int, index: int) -> Question:
    """Draw a line; all sub-commands take turns."""
    rng = np.random.default_rng([seed, index])
    name = list(KINDS)[index % len(KINDS)]
    line = draw(rng, name)
    files = {name: data.decode("latin-1") for name, data in line.files.items()}
    return {"name": name, "words": line.words, "files": files}


class Times(NamedTuple):
    """An instant, or what passed between two [s]."""

    wall: float
    processor: float

    @classmethod
    def now(cls) -> Times:
        """Of this process."""
        return cls(time.monotonic(), time.process_time())

    def since(self, before: Times) -> Times:
        """What passed since an instant."""
        return Times(self.wall - before.wall, self.processor - before.processor)


class Listened(io.StringIO):
    """Standard error or output that notes how long nothing was written to it."""

    def __init__(self, watch: Silence) -> None:
        super().__init__()
        self.watch = watch

    def write(self, text: str) -> int:
        """Note that something is written."""
        self.watch.heard()
        return super().write(text)


class Silence:
    """The longest time without a line."""

    def __init__(self) -> None:
        self.last, self.longest = Times.now(), Times(0.0, 0.0)

    def heard(self) -> None:
        """Note a line."""
        now = Times.now()
        self.longest, self.last = max(self.longest, now.since(self.last)), now


class Deadline(threading.Thread):
    """Notes when a line's budget is used up, or stops a line without one as SIGTERM does.

    A budget counts as processor time, so that a loaded machine changes no verdict.
    """

    def __init__(self, budget: float) -> None:
        super().__init__(daemon=True)
        self.budget, self.answered = budget, threading.Event()
        self.reached: Times | None = None

    def run(self) -> None:
        """Wait for it."""
        begun = Times.now()
        while not self.answered.wait(LOOK):
            used = Times.now().since(begun)
            if (used.processor if self.budget else used.wall) < (self.budget or BUDGET):
                continue
            self.reached = Times.now()
            if not self.budget:
                os.kill(os.getpid(), signal.SIGTERM)
            return

    def after(self) -> Times:
        """What has passed since then; nothing if it is still to come."""
        self.answered.set()
        return Times.now().since(self.reached) if self.reached else Times(0.0, 0.0)


def answer(question: Question, folder: Path) -> Row:
    """Carry the line out."""
    kind, words = KINDS[question["name"]], _with_files(question, folder)
    watch = Silence()
    out, said = Listened(watch), Listened(watch)
    deadline = Deadline(_budget(words) if kind.budget else 0.0)
    deadline.start()
    os.chdir(folder)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        try:
            code = main([*question["name"].split(), *words])
        except SystemExit as leaving:  # of --help
            code = int(leaving.code or 0)
    watch.heard()
    silent, late = watch.longest, deadline.after()

    faults = faults_of(code, said.getvalue())
    if silent.wall > QUIET:
        faults.append(f"{silent.wall:.1f} s without a line")
    if late.processor > MORE:
        faults.append(f"{late.processor:.1f} s of work after its end ({late.wall:.1f} s of wall)")
    return {
        "code": code,
        "said": said.getvalue()[-800:],
        "silent": silent,
        "late": late,
        "faults": faults,
    }


def _budget(words: Sequence[str]) -> float:
    """The seconds that a line states, or 0 if it states none, or more than it is given here."""
    stated = [
        after if word == "--seconds" else word.partition("=")[2]
        for word, after in itertools.pairwise([*words, ""])
        if word.partition("=")[0] == "--seconds"
    ]
    with contextlib.suppress(ValueError):
        return seconds if stated and 0.0 < (seconds := float(stated[-1])) <= BUDGET else 0.0
    return 0.0


def _with_files(question: Question, folder: Path) -> list[str]:
    """The words of a line, with files of this case in the place of capital words."""
    for name, text in question["files"].items():
        (folder / name).write_bytes(text.encode("latin-1"))
    (folder / "FOLDER").mkdir(exist_ok=True)
    (folder / "BINARY").write_bytes(bytes(range(256)) * 40)
    (folder / "EMPTY").write_bytes(b"")
    (folder / "LARGE").write_bytes(b"a = 1\n" * 200_000)
    for name in ("STUDY", "DRIVE"):
        if name not in question["files"]:
            (folder / name).write_text("x = 1\n")
    shutil.copytree(made_folder(folder.parent), folder / "RESULTS", dirs_exist_ok=True)
    (folder / "PROFILE").write_bytes((folder / "RESULTS" / "profile.csv").read_bytes())
    return list(question["words"])


def made_folder(cases: Path) -> Path:
    """A results folder for reports, exports and checks, made if need be."""
    place = cases.parent / "made"
    if not place.exists():
        draft = cases.parent / "made.draft"
        shutil.rmtree(draft, ignore_errors=True)
        words = [*MADE, "--starts", "straight", "--no-figures", "--results", str(draft)]
        code, said = run_command(words, cases.parent / "made.txt")
        if code:
            raise RuntimeError(f"no folder was made: {said[-300:]}")
        draft.rename(place)
    return place


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return each case with a fault in a row, and how many ended how."""
    wrong = [row for row in rows if row["failure"] or row["faults"]]
    columns: Columns = {
        "case": "index",
        "line": _line,
        "code": "code",
        "faults": lambda row: row["failure"] or "; ".join(row["faults"]),
    }
    codes = [row["code"] for row in rows if not row["failure"]]
    total: dict[str, Any] = {
        "lines": len(rows),
        "without a fault": len(rows) - len(wrong),
        **{f"exit code {code}": codes.count(code) for code in sorted(set(codes))},
        "longest silence [s of wall time]": _most(rows, "silent", 0),
        "longest silence [s of processor time]": _most(rows, "silent", 1),
        "longest work after the end [s of wall time]": _most(rows, "late", 0),
        "longest work after the end [s of processor time]": _most(rows, "late", 1),
    }
    totals = Table("In total", ("", ""), [(name, str(value)) for name, value in total.items()])
    return [listed("Lines with a fault", wrong, columns), totals]


def _most(rows: Sequence[Row], name: str, place: int) -> str:
    """The most of one of the two times of any row."""
    return f"{max(row.get(name, (0.0, 0.0))[place] for row in rows):.1f}"


def _line(row: Row) -> str:
    line = " ".join([row["name"], *(repr(word)[1:-1] for word in row["words"])])
    return line if len(line) <= SHOWN else f"{line[:SHOWN]} ..."
