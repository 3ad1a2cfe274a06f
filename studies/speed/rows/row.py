"""What every contestant shares: the two problems, and how a row is asked and answered.

A row is a fresh process `python run_NAME.py PROBLEM SIZE FILE` that writes its control, as a
polynomial of time in each interval, and three instants of the system's monotonic clock to FILE.
Nothing heavy is imported here: the first instant counts imports.
"""

from __future__ import annotations

import json
import math
import resource
import sys
import time
from collections.abc import Iterable

START, END = math.radians(4.4), math.pi / 2  # angle at both ends [rad], where all rates are zero
DURATION = {"A": 140.0, "B": 5.0}  # T [s]
JERK_CAP = {"A": 124.2192 / 140.0**3, "B": 200.0 / 5.0**3}  # [rad/s^3]

now = time.monotonic


def asked() -> tuple[str, int]:
    """Name of the problem and size of the mesh (0: the tool's own) from the command line."""
    return sys.argv[1], int(sys.argv[2])


def memory() -> float:
    """Peak memory of this process [MiB].

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
    imported : instant when all imports were done.
    edges : (m + 1,) times [s] between which the jerk is a polynomial.
    nodes : (p,) places in [0, 1] of an interval, the same for all.
    jerk : (m, p) values there [rad/s^3].
    verification : seconds the tool itself spent to verify its answer, where it does.
    note : the tool's own words about its success.
    """
    solved = now()
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
