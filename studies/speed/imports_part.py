"""What loads, and how long it takes: `python -X importtime` of the command and of a solve."""

from __future__ import annotations

import re
import statistics
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import studies
from studies.common.console import Table, number
from studies.speed.setup import Record, Setup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STARTS = {
    "antenna-ocp --help": ("-m", "studies.cli", "--help"),
    "antenna-ocp truss --help": ("-m", "studies.cli", "truss", "--help"),
    "import ocp": ("-c", "import ocp"),
    "truss study, before its solve": ("-c", "import studies.truss.solve"),
    "import casadi": ("-c", "import casadi"),
    "python alone": ("-c", "pass"),
}
HEAVY = ("casadi", "numpy", "scipy", "matplotlib")
LINE = re.compile(r"import time:\s*(\d+) \|\s*(\d+) \|\s*(\S+)")


def measure(setup: Setup) -> Iterator[Record]:
    """Time each start, and take its imports apart; see `Part`."""
    found: dict[str, dict[str, Any]] = {name: {"seconds": []} for name in STARTS}
    for _ in range(setup.repeats):
        for name, words in STARTS.items():
            begin = perf_counter()
            _run(words)
            found[name]["seconds"].append(perf_counter() - begin)
    for name, words in STARTS.items():
        found[name]["packages"] = packages(_run(("-X", "importtime", *words)))
        setup.console.progress(f"{name}: {statistics.median(found[name]['seconds']):.2f} s")
        yield {"starts": {n: f for n, f in found.items() if "packages" in f}}


def _run(words: tuple[str, ...]) -> str:
    root = str(Path(studies.__file__).parents[1])
    return subprocess.run(
        (sys.executable, *words), cwd=root, capture_output=True, text=True, check=True
    ).stderr


def packages(said: str) -> dict[str, float]:
    """Seconds of import by top package: each module's own time, summed."""
    found: dict[str, float] = {}
    for own, _, name in LINE.findall(said):
        top = name.split(".")[0]
        found[top] = found.get(top, 0.0) + 1e-6 * int(own)
    return found


def tables(record: Record) -> list[Table]:
    """Seconds in all, and of the heavy packages."""
    head = ("start", "process [s]", "imports [s]", *(f"{name} [s]" for name in HEAVY), "ours [s]")
    rows = []
    for name, found in record["starts"].items():
        each = found["packages"]
        ours = sum(each.get(package, 0.0) for package in ("ocp", "models", "studies"))
        rows.append((
            name, number(statistics.median(found["seconds"]), 3), number(sum(each.values()), 3),
            *(number(each[package], 3) if package in each else "not loaded" for package in HEAVY),
            number(ours, 2),
        ))  # fmt: skip
    note = "process: median, without -X importtime; imports: one run with it."
    return [Table("What loads", head, rows, (note,))]


def draw(record: Record) -> Figure:
    """A bar for each start."""
    from studies.speed.plots import labelled_bars

    names = list(record["starts"])
    seconds = [statistics.median(record["starts"][name]["seconds"]) for name in names]
    return labelled_bars("Time to start", names, seconds, "whole process [s], median")
