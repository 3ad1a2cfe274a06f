"""The show "fuzz-commands": command lines and study files that are spoilt end as they should.

Each case is one line, carried out in a process of its own. No unforeseen error may come of it, no
work without a line of progress, none beyond its budget, and no message with a long first line. Time
counts as this process's processor time, so that a loaded machine changes no verdict.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import signal
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.fuzz.grammar import KINDS, draw
from benchmarks.shows.fuzz.said import faults_of
from benchmarks.shows.show import Question, Row
from benchmarks.shows.truss_random import run_command
from studies.cli import main
from studies.common.console import Table

LINE = "command lines and study files spoilt at random, over all sub-commands"
LIMIT = 240.0  # [s]
BUDGET = 20.0  # [s] of lines that state none: they are stopped then, as by Ctrl-C
QUIET = 5.0  # [s] that a command may work without a line
MORE = 5.0  # [s] that a command may work beyond its budget
SHOWN = 160  # characters of a line in the table
MADE = ("truss", "--objective", "peak-acceleration", "--duration", "5", "--intervals", "8")


def question(seed: int, index: int) -> Question:
    """Draw a line; all sub-commands take turns."""
    rng = np.random.default_rng([seed, index])
    name = list(KINDS)[index % len(KINDS)]
    line = draw(rng, name)
    files = {name: data.decode("latin-1") for name, data in line.files.items()}
    return {"name": name, "words": line.words, "files": files}


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
    """The longest time without a line, of this process's processor time."""

    def __init__(self) -> None:
        self.last = time.process_time()
        self.longest = 0.0

    def heard(self) -> None:
        """Note a line."""
        now = time.process_time()
        self.longest, self.last = max(self.longest, now - self.last), now


def answer(question: Question, folder: Path) -> Row:
    """Carry the line out."""
    kind, words = KINDS[question["name"]], _with_files(question, folder)
    began, watch = time.process_time(), Silence()
    out, said = Listened(watch), Listened(watch)
    budget = kind.budget if "--seconds" in question["words"] else 0.0
    stop = threading.Timer(BUDGET, os.kill, (os.getpid(), signal.SIGTERM))
    stop.daemon = True
    if not budget:
        stop.start()
    os.chdir(folder)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        try:
            code = main([*question["name"].split(), *words])
        except SystemExit as leaving:  # of --help
            code = int(leaving.code or 0)
    stop.cancel()
    watch.heard()
    used = time.process_time() - began

    faults = faults_of(code, said.getvalue())
    if watch.longest > QUIET:
        faults.append(f"{watch.longest:.1f} s without a line")
    if used > (budget or BUDGET) + MORE:
        faults.append(f"{used:.0f} s for a budget of {budget or BUDGET:g} s")
    return {
        "code": code,
        "said": said.getvalue()[-800:],
        "used": used,
        "silent": watch.longest,
        "faults": faults,
    }


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
    shutil.copytree(_made(folder.parent), folder / "RESULTS", dirs_exist_ok=True)
    (folder / "PROFILE").write_bytes((folder / "RESULTS" / "profile.csv").read_bytes())
    return list(question["words"])


def _made(cases: Path) -> Path:
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
    head = ("case", "line", "code", "faults")
    cells = [_cells(row) for row in wrong]
    codes = [row["code"] for row in rows if not row["failure"]]
    total: dict[str, Any] = {
        "lines": len(rows),
        "without a fault": len(rows) - len(wrong),
        **{f"exit code {code}": codes.count(code) for code in sorted(set(codes))},
        "longest silence [s]": f"{max(row.get('silent', 0.0) for row in rows):.1f}",
    }
    totals = Table("In total", ("", ""), [(name, str(value)) for name, value in total.items()])
    return [Table("Lines with a fault", head, cells), totals]


def _cells(row: Row) -> tuple[str, ...]:
    line = " ".join([row["name"], *(repr(word)[1:-1] for word in row["words"])])
    shown = line if len(line) <= SHOWN else f"{line[:SHOWN]} ..."
    faults = row["failure"] or "; ".join(row["faults"])
    return (str(row["index"]), shown, str(row.get("code", "-")), faults)
