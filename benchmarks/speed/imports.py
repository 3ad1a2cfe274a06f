"""The part "imports": the processor time of a start, of the command and before a solve.

Modules come from bytecode, as they do for a user.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
from collections.abc import Iterator, Sequence

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


def measure(setup: Setup) -> Iterator[Measured]:
    """Time each start, all in turn; see `BenchmarkPart`."""
    seconds: dict[str, list[float]] = {name: [] for name in STARTS}
    for turn in range(setup.repeats):
        for name, words in STARTS.items():
            begin = _spent()
            start(words)
            seconds[name].append(_spent() - begin)
        setup.console.progress(f"run {turn + 1} of {setup.repeats}")
        yield {"seconds": seconds}


def _spent() -> float:
    """Processor time of all processes that were started and have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def start(words: Sequence[str]) -> None:
    """Start Python with some words.

    Raises
    ------
    StudyError
        If it fails.
    """
    env = {name: value for name, value in os.environ.items() if name != BYTECODE}
    command = (sys.executable, *words)
    ended = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        last = (ended.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise StudyError(f"'python {' '.join(words)}' failed: {last}")


def tables(record: Measured) -> list[Table]:
    """Return the processor time of each start, and the ratio that is asked for."""
    medians = {name: statistics.median(each) for name, each in record["seconds"].items()}
    rows = [(name, number(seconds, 3)) for name, seconds in medians.items()]
    ours, base, most = RATIO
    note = (
        f"'{ours}' takes {medians[ours] / medians[base]:.2f} times '{base}'; the target is "
        f"{most:g} at most"
    )
    return [Table("What a start takes, medians", ("start", "processor time [s]"), rows, (note,))]
