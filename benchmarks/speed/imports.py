"""The part "imports": what loads, and the processor time of it, of the command and before a solve.

Modules come from bytecode, as they do for a user.
"""

from __future__ import annotations

import os
import re
import resource
import statistics
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from benchmarks.parts import Measured, Setup
from benchmarks.processes import BYTECODE
from benchmarks.records import ROOT
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError

STARTS = {
    "antenna-ocp --help": ("-m", "antenna_ocp", "--help"),
    "antenna-ocp truss --help": ("-m", "antenna_ocp", "truss", "--help"),
    "import ocp": ("-c", "import ocp"),
    "truss study, before its solve": ("-c", "import studies.truss.search.motion_search"),
    "from ocp import solve": ("-c", "from ocp import solve"),
    "import casadi, numpy": ("-c", "import casadi, numpy"),
    "python alone": ("-c", "pass"),
}
RATIO = "import ocp", "import casadi, numpy", 1.6  # of the first to the second, that is asked for
HEAVY = ("casadi", "numpy", "scipy", "matplotlib")
OURS = ("ocp", "models", "studies")
LINE = re.compile(r"import time:\s*(\d+) \|\s*(\d+) \|\s*(\S+)")  # of `python -X importtime`


def measure(setup: Setup) -> Iterator[Measured]:
    """Time each start, and take its imports apart; see `BenchmarkPart`."""
    starts: dict[str, dict[str, Any]] = {name: {"seconds": []} for name in STARTS}
    for _ in range(setup.repeats):
        for name, words in STARTS.items():
            begin = _spent()
            started(words)
            starts[name]["seconds"].append(_spent() - begin)

    # Once more with Python's own clock of imports, which slows a start down.
    for name, words in STARTS.items():
        starts[name]["packages"] = packages(started(("-X", "importtime", *words)))
        setup.console.progress(f"{name}: {statistics.median(starts[name]['seconds']):.2f} s")
        yield {"starts": {n: start for n, start in starts.items() if "packages" in start}}


def _spent() -> float:
    """Processor time of all processes that were started and have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def started(words: tuple[str, ...]) -> str:
    """What a start prints as errors, where Python's clock of imports prints too."""
    command = (sys.executable, *words)
    env = {name: value for name, value in os.environ.items() if name != BYTECODE}
    ended = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        last = (ended.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise StudyError(f"'python {' '.join(words)}' failed: {last}")
    return ended.stderr


def packages(said: str) -> dict[str, float]:
    """Return the seconds of import by top package: each module's own time, summed."""
    seconds: dict[str, float] = {}
    for microseconds, _, module in LINE.findall(said):
        package = module.split(".")[0]
        seconds[package] = seconds.get(package, 0.0) + 1e-6 * int(microseconds)
    return seconds


def tables(record: Measured) -> list[Table]:
    """Return the seconds in all, and of the heavy packages."""
    head = ("start", "process [s]", "imports [s]", *(f"{name} [s]" for name in HEAVY), "ours [s]")
    rows = []
    for name, start in record["starts"].items():
        each = start["packages"]
        heavy = (number(each[p], 3) if p in each else "not loaded" for p in HEAVY)
        process, imports = statistics.median(start["seconds"]), sum(each.values())
        ours = sum(each.get(package, 0.0) for package in OURS)
        rows.append((name, number(process, 3), number(imports, 3), *heavy, number(ours, 2)))
    notes = (
        "process: processor time, median, without -X importtime; imports: one run with it",
        f"'{RATIO[0]}' takes {ratio(record):.2f} times '{RATIO[1]}'; the target is {RATIO[2]:g} at "
        "most",
    )
    return [Table("What loads", head, rows, notes)]


def ratio(record: Measured) -> float:
    """Of the medians of the two starts in `RATIO`."""
    ours, base = (statistics.median(record["starts"][name]["seconds"]) for name in RATIO[:2])
    return float(ours / base)
