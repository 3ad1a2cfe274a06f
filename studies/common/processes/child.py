"""What the processes that this program starts do first: environment, and when they end.

It imports nothing that brings a library for linear algebra, which would read the environment
before it is set.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from multiprocessing.queues import SimpleQueue
from pathlib import Path
from typing import Any

import studies
from studies.common.console import Console, silent

MOST_PROCESSES = "ANTENNA_OCP_PROCESSES"  # variable of the environment with a limit of the user's
# a process has none of its own, and one thread for linear algebra: more would compete with others
OF_A_PART = {
    MOST_PROCESSES: "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}
LIVE = 0.1  # [s] between two live lines of a process
Lines = SimpleQueue[tuple[str, str]]  # lines of progress, each with the method that prints it

_DEATH_OF_PARENT = 1  # PR_SET_PDEATHSIG of Linux


def environment() -> dict[str, str]:
    """Of a process that does a part of the work and is started as a program of its own."""
    # where this package is, the process has to find it, too
    root = str(Path(next(iter(studies.__path__))).parent)
    paths = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
    return {**os.environ, **OF_A_PART, "PYTHONPATH": paths}


def ends_with_parent() -> bool:
    """Have this process killed together with who waits for it; False if that one has gone.

    An orphan would work for nobody. Elsewhere than on Linux it has to notice that by itself.
    """
    parent = os.getppid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_OF_PARENT, signal.SIGKILL)
        if os.getppid() != parent:
            return False
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the run, which then ends this
    return True


def prepare(lines: Lines) -> None:
    """Begin a process of a pool of `side_by_side`, whose lines of progress go to a queue."""
    global _console
    parent = multiprocessing.parent_process()
    if parent is None or not ends_with_parent() or not parent.is_alive():
        os._exit(1)
    if sys.platform != "linux":
        threading.Thread(target=_end_after, args=(parent,), daemon=True).start()

    os.environ.update(OF_A_PART)
    os.dup2(2, 1)  # what a library prints is no result of the run
    _console = _SentLines(lines=lines)


def done_here(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """What comes of a part, in the process of a pool."""
    return function(*arguments, _console)


def _end_after(parent: BaseProcess) -> None:
    """End this process as soon as its parent has ended, and its solver lets this thread run."""
    wait([parent.sentinel])
    os._exit(1)


@dataclass(eq=False)
class _SentLines(Console):
    """A console whose lines of progress are sent to the process that prints them."""

    lines: Lines | None = None

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Repeat nothing: the process that prints does."""
        yield

    def progress(self, text: str) -> None:
        """Send a line of progress."""
        self._send("progress", text)

    def live(self, text: str) -> None:
        """Send where long work stands, now and then."""
        now = time.monotonic()
        if now - self._shown > LIVE:
            self._shown = now
            self._send("live", text)

    def _send(self, method: str, text: str) -> None:
        assert self.lines is not None
        self.lines.put((method, text))


_console = silent()  # of this process
