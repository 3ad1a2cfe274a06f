"""A pool of processes that end at once when nobody waits for them any more."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any

Call = tuple[Callable[..., Any], Sequence[Any]]  # a function and its arguments


class ProcessPool:
    """A `ProcessPoolExecutor` whose calls are given up where its `with` block is left by an error.

    The executor alone would let its processes finish every call that it was given. They end without
    a word, and Ctrl-C, which a terminal sends to all of them, is for the process that waits alone.

    Parameters
    ----------
    workers : int
        Processes at once.
    context : multiprocessing context
        How they are started.
    initializer, arguments : function and sequence, optional
        Called in each process before its first call.
    """

    def __init__(
        self,
        workers: int,
        context: BaseContext,
        initializer: Callable[..., object] | None = None,
        arguments: Sequence[Any] = (),
    ) -> None:
        self._others = set(multiprocessing.active_children())
        self._executor = ProcessPoolExecutor(workers, context, initializer, tuple(arguments))
        self._processes: set[BaseProcess] = set()

    def submit(self, calls: Iterable[Call]) -> list[Future[Any]]:
        """Have functions called with their arguments; it starts the processes."""
        futures = []
        for function, given in calls:
            with interrupts_wait():
                futures.append(self._executor.submit(function, *given))
            self._processes |= self._started()  # now, as one may die before the next call
        return futures

    def exit_codes(self) -> set[int]:
        """Those of the processes that have ended; all have after the `with` block."""
        codes = (process.exitcode for process in self._processes)
        return {code for code in codes if code is not None}

    def __enter__(self) -> ProcessPool:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        # where one process has died, the executor ends the others itself
        if kind is not None and not issubclass(kind, BrokenProcessPool):
            for process in self._started():
                process.terminate()
        self._executor.shutdown()

    def _started(self) -> set[BaseProcess]:
        return set(multiprocessing.active_children()) - self._others


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Let Ctrl-C wait meanwhile, and for ever in all that starts: it is for this process alone.

    A process begins with the signals that its parent lets wait. No code of its own is needed, so
    that it may load its libraries later.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield  # Windows has none
        return
    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)
