"""The part "instructions": how many the processor executes for A and B, by who executes them.

Callgrind counts them, of the process alone: the same on an idle machine and a busy one. They are
counted by library. The C library's belong to whoever called it, and stand apart. Modules come from
bytecode, as they do for a user: to compile them takes as long as a small solve.
"""

from __future__ import annotations

import collections
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.parts import Measured, Setup
from benchmarks.processes import BYTECODE, THREADS
from benchmarks.race.contestants import PROBLEMS, ROWS
from benchmarks.records import ROOT
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError

TOOL = "valgrind"
IMPORTS = "imports alone"
SLOWER = 30.0  # a program under Callgrind, so much the limit of a run grows
# who executes, by a part of the file name of its library; the first that fits
OWNERS = {
    "MUMPS": ("coinmumps", "coinmetis", "openblas", "gfortran"),
    "IPOPT": ("libipopt", "nlpsol_ipopt"),
    "CasADi": ("casadi",),
    "C library": ("libc.so", "libm.so", "libc-", "libm-", "ld-linux", "libstdc++"),
}
REST = "Python, NumPy, SciPy"
_OBJECT = re.compile(r"c?ob=\((\d+)\)(?: (.*))?$")
_COST = re.compile(r"[+*-]?\d*(?: [+*-]?\d+)? (\d+)$")


def measure(setup: Setup) -> Iterator[Measured]:
    """Count for each problem, and for the imports; see `BenchmarkPart`."""
    if shutil.which(TOOL) is None:
        setup.console.progress(f"there is no {TOOL} here: instructions are not counted")
        yield {"counts": {}, "rounds": {}}
        return

    script = ROWS / "run_ours.py"
    words: dict[str, tuple[str, ...]] = {IMPORTS: ("-c", "import run_ours")}
    words |= {name: (str(script), name, "0", "answer.json") for name in PROBLEMS}
    counts: dict[str, dict[str, int]] = {}
    rounds: dict[str, int] = {}
    for name, arguments in words.items():
        with tempfile.TemporaryDirectory() as folder:
            counts[name] = counted(arguments, Path(folder), SLOWER * setup.limit)
            if name != IMPORTS:
                note = json.loads((Path(folder) / "answer.json").read_text("utf-8"))["note"]
                rounds[name] = int(note.split()[0])
        total = sum(counts[name].values())
        setup.console.progress(f"{name}: {total / 1e9:.3f} thousand million instructions")
        yield {"counts": counts, "rounds": rounds}


def counted(arguments: Iterable[str], folder: Path, limit: float) -> dict[str, int]:
    """Instructions of a Python process by owner.

    Raises
    ------
    StudyError
        If the process fails or takes longer than the limit [s].
    """
    profile = folder / "callgrind.out"
    program = [sys.executable, *arguments]
    counting = [TOOL, "--tool=callgrind", f"--callgrind-out-file={profile}", *program]
    # hashes and threads would make two runs differ, and bytecode that is not there yet
    fixed = {"PYTHONHASHSEED": "0", "PYTHONPATH": f"{ROWS}{os.pathsep}{ROOT}"}
    fixed |= dict.fromkeys(THREADS, "1")
    env = {name: value for name, value in os.environ.items() if name != BYTECODE}
    try:
        for command in (program, counting):
            subprocess.run(
                command,
                cwd=folder,
                env=env | fixed,
                capture_output=True,
                text=True,
                check=True,
                timeout=limit,
            )
    except subprocess.TimeoutExpired as error:
        raise StudyError(f"{TOOL} took longer than {limit:g} s; raise --limit") from error
    except subprocess.CalledProcessError as error:
        last = (error.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise StudyError(f"{TOOL} failed: {last}") from error
    with profile.open(encoding="utf-8") as lines:
        return by_owner(by_library(lines))


def by_library(lines: Iterable[str]) -> dict[str, int]:
    """Instructions of each library itself, of a profile in Callgrind's format.

    A line of cost belongs to the library that was named last. One that follows a call is the
    callee's, which has its own lines.
    """
    names: dict[str, str] = {}
    counts: collections.Counter[str] = collections.Counter()
    here, called = "", False
    for line in lines:
        text = line.rstrip("\n")
        if match := _OBJECT.match(text):
            key, name = match.groups()
            if name is not None:
                names[key] = name
            if not text.startswith("c"):
                here = names[key]
        elif text.startswith("calls="):
            called = True
        elif match := _COST.match(text):
            if not called:
                counts[here] += int(match.group(1))
            called = False
    return dict(counts)


def by_owner(libraries: Mapping[str, int]) -> dict[str, int]:
    """The same by who stands behind a library."""
    counts = dict.fromkeys((*OWNERS, REST), 0)
    for path, count in libraries.items():
        # NumPy and SciPy bring an OpenBLAS of their own, which is not MUMPS's
        file = "" if ".libs" in path else Path(path).name
        owners = (owner for owner, parts in OWNERS.items() if any(p in file for p in parts))
        counts[next(owners, REST)] += count
    return counts


def tables(record: Measured) -> list[Table]:
    """Return the counts, and those of a mesh round without the imports."""
    owners = (*OWNERS, REST)
    head = ("", *owners, "all")
    notes = ["thousand million instructions of one process"]
    if not record["counts"]:
        return [Table("Instructions", head, [], (f"not counted: there is no {TOOL} here",))]

    counts: Mapping[str, Mapping[str, int]] = record["counts"]
    rows = [_row(name, [each[owner] for owner in owners]) for name, each in counts.items()]
    for name, rounds in record["rounds"].items():
        solved = [counts[name][owner] - counts[IMPORTS][owner] for owner in owners]
        rows.append(_row(f"{name}, a round of {rounds}", [count / rounds for count in solved]))
        notes.append(f"a round of {name}: without the imports, over its {rounds} rounds")
    return [Table("Instructions", head, rows, tuple(notes))]


def _row(name: str, counts: list[Any]) -> tuple[str, ...]:
    return (name, *(number(count / 1e9, 3) for count in (*counts, sum(counts))))
