"""The show "fuzz-commands": command lines and study files that are spoilt end as they should.

Each case is one line, carried out in a process of its own. No unforeseen error may come of it, and
no message with a long first line. A line that is still at work after a while is stopped as SIGTERM
does, and has to end soon then.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import signal
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shows.fuzz.grammar import KINDS, draw
from benchmarks.shows.fuzz.said import faults_of
from benchmarks.shows.show import Columns, Question, Row, listed
from benchmarks.shows.truss_random import run_command
from studies.cli import main
from studies.common.console import Table

LINE = "command lines and study files spoilt at random, over all sub-commands"
LIMIT = 120.0  # [s]; the first case makes the folder of all
BUDGET = 20.0  # [s] after which a line is stopped
SHOWN = 160  # characters of a line in the table
MADE = ("truss", "--objective", "peak-acceleration", "--duration", "5", "--intervals", "8")


def question(seed: int, index: int) -> Question:
    """Draw a line; all sub-commands take turns."""
    rng = np.random.default_rng([seed, index])
    name = list(KINDS)[index % len(KINDS)]
    line = draw(rng, name)
    files = {name: data.decode("latin-1") for name, data in line.files.items()}
    return {"name": name, "words": line.words, "files": files}


def answer(question: Question, folder: Path) -> Row:
    """Carry the line out."""
    words = _with_files(question, folder)
    out, said = io.StringIO(), io.StringIO()
    stop = threading.Timer(BUDGET, os.kill, (os.getpid(), signal.SIGTERM))
    stop.start()
    os.chdir(folder)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        try:
            code = main([*question["name"].split(), *words])
        except SystemExit as leaving:  # of --help
            code = int(leaving.code or 0)
    stop.cancel()
    return {
        "code": code,
        "said": said.getvalue()[-800:],
        "faults": faults_of(code, said.getvalue()),
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
    }
    totals = Table("In total", ("", ""), [(name, str(value)) for name, value in total.items()])
    return [listed("Lines with a fault", wrong, columns), totals]


def _line(row: Row) -> str:
    line = " ".join([row["name"], *(repr(word)[1:-1] for word in row["words"])])
    return line if len(line) <= SHOWN else f"{line[:SHOWN]} ..."
