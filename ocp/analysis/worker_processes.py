"""Problems solved side by side, each in a process of its own.

Processes are forked where that is safe, which is faster, and spawned elsewhere.  Either way one is
sent the problem and its guess, and sends back its solution, in the form in which solutions are
stored (`ocp.solution.storage`).  The lines of progress of all come through one queue.
"""

from __future__ import annotations

import ctypes
import math
import multiprocessing
import os
import signal
import threading
import time as clock
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator, Set
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from multiprocessing import connection
from multiprocessing.process import BaseProcess
from multiprocessing.queues import SimpleQueue
from typing import Any, TypeVar

from ocp.algorithm import solve
from ocp.errors import BudgetSpent, Interrupted, OcpError, SolveFailed, StatementError
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.interrupts import noted_interrupts
from ocp.problem.problem import Problem
from ocp.process_pool import ProcessPool
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solution.storage import packed, unpacked

Guess = Solution | Trajectory | None


@dataclass(frozen=True, eq=False, repr=False)
class StartAnswer:
    """What came of a start.

    Attributes
    ----------
    solution : Solution or None
    error : Exception or None
        Why the solution does not count, or why there is none.
    seconds : float
        That it took [s].
    stopped : bool
        Whether the user asked to stop meanwhile.
    """

    solution: Solution | None
    error: Exception | None
    seconds: float
    stopped: bool = False


def answered(
    start: Callable[[], tuple[Problem, Guess]],
    settings: Settings,
    bound: float | None,
    seconds: float,
    *,
    failures: tuple[type[Exception], ...] = (OcpError,),
    progress: Progress | None = None,
    asked: Callable[[], bool] | None = None,
) -> StartAnswer:
    """Solve from a start; where it is stopped or its seconds are over, keep what it had reached.

    Parameters
    ----------
    start : function
        Gives the problem and its guess.
    settings, bound, progress : optional
        As of `ocp.solve`.
    seconds : float
        That are left for it, infinite for no budget but that of the settings [s].
    failures : tuple of exception classes
        Errors that end the start and nothing more.
    asked : function, optional
        Whether another process asks this one to stop; called with each line of progress.
    """
    begin = clock.perf_counter()
    problem: Problem | None = None
    solution: Solution | None = None
    error: Exception | None = None
    with noted_interrupts() as interrupts:

        def told(line: str) -> None:
            if progress:
                progress(line)
            if asked and asked():
                interrupts.ask()

        try:
            problem, guess = start()
            solution = solve(
                problem,
                settings=_within(settings, seconds),
                guess=guess,
                bound=bound,
                progress=told if progress or asked else None,
            )
            # what was cut short counts only if it is as accurate as asked for
            if settings.verify and settings.refinement.adapts and not solution.verification.passed:
                kind = Interrupted if solution.interrupted else BudgetSpent
                error = kind(solution.verdict)
        except failures as failure:
            # what did not pass is there to look at
            reached = getattr(failure, "iterate", None)
            solution = reached if isinstance(reached, Solution) else None
            error = failure
    return StartAnswer(solution, error, clock.perf_counter() - begin, interrupts.asked)


def _within(settings: Settings, seconds: float) -> Settings:
    """The settings of a solve that may take so long, and no longer than they say."""
    own = math.inf if settings.seconds is None else settings.seconds
    least = min(own, seconds)
    return settings if math.isinf(least) else replace(settings, seconds=least)


Ready = TypeVar("Ready")

# Exit code of a process that met the audit again while it imported the user's script; any number
# that Python itself does not use
_UNGUARDED = 76
_PAUSE = 0.05  # [s] between two looks at what the processes have sent


@dataclass(frozen=True, eq=False, repr=False)
class StartJob:
    """A start for a process.

    Attributes
    ----------
    name : str
    problem, guess, settings
        As of `ocp.solve`.
    seconds : float
        That are left for it, infinite for no budget but that of the settings [s].
    prefix : str
        Of its lines of progress.
    """

    name: str
    problem: Problem
    guess: Guess
    settings: Settings
    seconds: float
    prefix: str


def solved_in_processes(
    jobs: Iterator[StartJob | Ready],
    bound: float | None,
    workers: int,
    say: Progress | None,
    asked: Callable[[], bool],
) -> Generator[tuple[StartJob, StartAnswer] | Ready]:
    """Solve problems from their guesses in up to `workers` processes.

    A job is taken when a process is free for it.  When the user asks to stop, none is taken any
    more: those at work are stopped, and what they had reached still comes.  At the second time the
    processes are ended, and only what they had sent still comes.

    Parameters
    ----------
    jobs : iterator
        What it gives besides jobs comes back as it is, in its turn.
    bound : float, optional
        As of `ocp.solve`.
    say : function of a line of text, optional
        Called here with the lines of progress of all processes.
    asked : function
        Whether the user asks to stop.

    Yields
    ------
    tuple of StartJob and StartAnswer
        In the order of the jobs.

    Raises
    ------
    StatementError
        When the script that started the processes cannot be imported by them.
    SolveFailed
        When a process ended without an answer.
    KeyboardInterrupt
        When the user has asked to stop again, after all that the processes had sent.
    """
    context = multiprocessing.get_context(_start_method())
    lines: SimpleQueue[str] = context.SimpleQueue()
    stop = context.RawValue(ctypes.c_bool, False)
    pool = ProcessPool(workers, context, _begin, (lines, stop))
    waiting: deque[tuple[StartJob | None, Future[Any]]] = deque()

    try:
        with pool:
            while True:
                # a job is taken late: what is left of the seconds is known then
                while (
                    not asked() and len(_at_work(waiting)) < workers and (job := next(jobs, None))
                ):
                    waiting.append(_begun(pool, job, bound, tells=say is not None))
                if not waiting:
                    break

                # never for long, so that the user sees lines and may ask to stop
                if not waiting[0][1].done():
                    wait(_at_work(waiting), timeout=_PAUSE, return_when=FIRST_COMPLETED)
                    stop.value = asked()
                _tell(lines, say)

                # in the order of the jobs: one that is done waits for those before it
                while waiting and waiting[0][1].done():
                    yield _received_answer(*waiting.popleft())
    except BrokenProcessPool as broken:
        raise _ended_early(pool.exit_codes()) from broken
    except KeyboardInterrupt:
        for job, answer in waiting:
            if answer.done() and answer.exception() is None:
                yield _received_answer(job, answer)
        raise
    finally:
        lines.close()


def leave_if_imported_again() -> None:
    """End a process that meets the audit while it imports the script that started it.

    A spawned process imports the user's script first. Without a guard the script starts the audit
    once more there, which would start processes without end. The first process says so.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(_UNGUARDED)


def _start_method() -> str:
    """How processes start: as the user has set it, or by a fork where the platform has a safe one.

    `multiprocessing` lists the platform's own choice first. On macOS that is to spawn, although
    it can fork: its system libraries do not always survive a fork.
    """
    chosen = multiprocessing.get_start_method(allow_none=True)
    if chosen:
        return "fork" if chosen == "fork" else "spawn"
    methods = multiprocessing.get_all_start_methods()
    return "fork" if "fork" in methods and methods[0] != "spawn" else "spawn"


def _ended_early(exit_codes: Set[int]) -> OcpError:
    """What to say when processes ended before they sent their solutions."""
    # 1 is what Python itself ends with where the script cannot be imported a second time
    if exit_codes & {_UNGUARDED, 1}:
        return StatementError(
            "the processes of the audit import the script that starts it, and would run it once "
            "more; put what it runs below if __name__ == '__main__': or write "
            "audit(..., processes=1)"
        )
    return SolveFailed(
        "a process of the audit ended without an answer, as when memory runs out; with "
        "audit(..., processes=1) the starts are solved one after the other"
    )


@dataclass(frozen=True, eq=False)
class _Ties:
    """What ties a process to the one that waits for its answers.

    Attributes
    ----------
    lines : of progress.
    stop : a number in memory of both, other than zero when the user asks to stop.
    """

    lines: SimpleQueue[str]
    stop: Any


_ties: _Ties | None = None  # of this process


def _begin(lines: SimpleQueue[str], stop: Any) -> None:
    """Begin a process of the pool; run there."""
    global _ties
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where a pool cannot have it wait (Windows)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()
    _ties = _Ties(lines, stop)


def _end_after(parent: BaseProcess) -> None:
    """End this process as soon as its parent has ended: nobody waits for it any more."""
    connection.wait([parent.sentinel])
    os._exit(1)


def _begun(
    pool: ProcessPool, job: Any, bound: float | None, *, tells: bool
) -> tuple[StartJob | None, Future[Any]]:
    """A job that was handed to the processes, or what is none and has come already."""
    if not isinstance(job, StartJob):
        ready: Future[Any] = Future()
        ready.set_result(job)
        return None, ready
    sent = packed(job.problem), packed(job.guess, known=job.problem)
    prefix = job.prefix if tells else None
    call = _solved_here, (*sent, job.settings, bound, job.seconds, prefix)
    with warnings.catch_warnings():
        # Python 3.12 and later warn of threads around a fork; those of linear algebra idle
        warnings.simplefilter("ignore", DeprecationWarning)
        (future,) = pool.submit([call])
    return job, future


def _at_work(waiting: deque[tuple[StartJob | None, Future[Any]]]) -> list[Future[Any]]:
    """Those that are not done."""
    return [future for _, future in waiting if not future.done()]


def _tell(lines: SimpleQueue[str], say: Progress | None) -> None:
    """Hand on the lines of progress that have come."""
    while not lines.empty():
        line = lines.get()
        if say:
            say(line)


def _received_answer(job: StartJob | None, future: Future[Any]) -> Any:
    """A job with its answer, or what was none."""
    if job is None:
        return future.result()
    data, error, seconds, stopped = future.result()
    solution = None if data is None else unpacked(data, known=job.problem)
    return job, StartAnswer(solution, error, seconds, stopped)


@lru_cache(maxsize=8)
def _received(problem: bytes) -> Problem:
    """The problem of several starts in a row, built once in a process."""
    received = unpacked(problem)
    assert isinstance(received, Problem)
    return received


def _solved_here(
    statement: bytes,
    guess: bytes,
    settings: Settings,
    bound: float | None,
    seconds: float,
    prefix: str | None,
) -> tuple[bytes | None, Exception | None, float, bool]:
    """Run in the other process: a solution for the way back, or the error without its iterate."""
    ties = _ties
    assert ties is not None

    def start() -> tuple[Problem, Guess]:
        problem = _received(statement)
        return problem, unpacked(guess, known=problem)

    answer = answered(
        start,
        settings,
        bound,
        seconds,
        progress=None if prefix is None else partial(_send, ties.lines, prefix),
        asked=lambda: bool(ties.stop.value),
    )
    error = answer.error and type(answer.error)(str(answer.error))
    data = None
    if answer.solution is not None:
        data = packed(answer.solution, known=_received(statement))
    return data, error, answer.seconds, answer.stopped


def _send(lines: SimpleQueue[str], prefix: str, line: str) -> None:
    lines.put(prefix + line)
