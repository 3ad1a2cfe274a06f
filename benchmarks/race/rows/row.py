"""How a row of the race is asked and how it answers.

A row is a fresh process `python run_NAME.py PROBLEM SIZE FILE` that writes its control, as a
polynomial of time in each interval, and three instants of the system's monotonic clock to FILE.
Nothing heavy is imported here: the first instant counts imports.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Iterable

now = time.monotonic


def asked() -> tuple[str, int]:
    """Return problem and size of the mesh (0: the tool's own) from the command line."""
    return sys.argv[1], int(sys.argv[2])


def memory() -> float:
    """Return the peak memory of this process [MiB].

    The kernel's own mark where there is one: `getrusage` also counts the process that started it.
    """
    try:
        with open("/proc/self/status", encoding="utf-8") as file:  # noqa: PTH123 - as below
            marks = [line for line in file if line.startswith("VmHWM")]
        return int(marks[0].split()[1]) / 1024
    except (OSError, IndexError):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def answer(
    imported: float,
    edges: Iterable[float],
    nodes: Iterable[float],
    jerk: Iterable[Iterable[float]],
    *,
    verification: float | None = None,
    note: object = "",
) -> None:
    """Write the answer.

    Parameters
    ----------
    imported : float
        Instant when all imports were done.
    edges : (m + 1,) times [s]
        Between two of them the jerk is a polynomial.
    nodes : (p,) places in [0, 1] of an interval
        The same for all intervals.
    jerk : (m, p) values there [rad/s^3]
    verification : float or None
        Seconds the tool itself spent to verify its answer, where it does.
    note : object
        The tool's own words about its success.
    """
    solved = now()  # before the answer is put together, which is no part of the solve
    record = {
        "imported": imported,
        "solved": solved - (verification or 0.0),
        "verification": verification,
        "edges": [float(t) for t in edges],
        "nodes": [float(t) for t in nodes],
        "jerk": [[float(u) for u in row] for row in jerk],
        "memory": memory(),
        "note": str(note),
    }
    with open(sys.argv[3], "w", encoding="utf-8") as file:  # noqa: PTH123 - pathlib costs 10 ms
        json.dump(record, file)
