"""What the processes that this program starts have in common: environment, and when they end."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from pathlib import Path

import studies

MOST_PROCESSES = "ANTENNA_OCP_PROCESSES"  # variable of the environment with a limit of the user's
# each has one thread for linear algebra: more of them would compete with the other processes
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)
_DEATH_OF_PARENT = 1  # PR_SET_PDEATHSIG of Linux


def environment() -> dict[str, str]:
    """Of a process that does a part of the work, with one thread and no processes of its own."""
    # where this package is, the process has to find it, too
    root = str(Path(next(iter(studies.__path__))).parent)
    paths = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
    return {**os.environ, **ONE_THREAD, MOST_PROCESSES: "1", "PYTHONPATH": paths}


def ends_with_parent() -> bool:
    """Have this process killed together with who waits for it; False if that one has gone.

    An orphan would work for nobody. Elsewhere than on Linux it ends when it next says something.
    """
    parent = os.getppid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_OF_PARENT, signal.SIGKILL)
        if os.getppid() != parent:
            return False
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the run, which then ends this
    return True
