"""Problems solved from their starts: here, or side by side in processes of their own.

Each start has a process. It is forked where that is safe, which is faster and leaves nothing to be
sent, and spawned elsewhere. A solution comes back in the form in which solutions are stored
(`ocp.solution.storage`), and the lines of progress before it, through a pipe.
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
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import connection
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from typing import Any

from ocp.algorithm import solve
from ocp.analysis.optima import Trial
from ocp.errors import BudgetSpent, Interrupted, OcpError, SolveFailed, StatementError
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.interrupts import noted_interrupts
from ocp.problem.problem import Problem
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solution.storage import packed, unpacked

Guess = Solution | Trajectory | None

# Exit code of a process that met the audit again while it imported the user's script; any number
# that Python itself does not use
_UNGUARDED = 76
_PAUSE = 0.05  # [s] between two looks at what the processes have sent


@dataclass(frozen=True, eq=False, repr=False)
class StartJob:
    """A start that is to be solved.

    Attributes
    ----------
    name : str
    problem, guess, settings, bound
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
    bound: float | None
    seconds: float
    prefix: str

    def __reduce__(self) -> tuple[Any, ...]:
        sent = packed(self.problem), packed(self.guess, known=self.problem)
        return _received, (self.name, *sent, self.settings, self.bound, self.seconds, self.prefix)


def _received(name: str, problem: bytes, guess: bytes, *others: Any) -> StartJob:
    """A job in the process that it was sent to."""
    known = unpacked(problem)
    return StartJob(name, known, unpacked(guess, known=known), *others)


def solved_here(
    job: StartJob, say: Progress | None, asked: Callable[[], bool] | None = None
) -> tuple[Trial, bool]:
    """Solve from a start; where it is stopped or its seconds are over, keep what it had reached.

    Parameters
    ----------
    say : function of a line of text, optional
        Called with the lines of progress.
    asked : function, optional
        Whether another process asks this one to stop; called with each line of progress.

    Returns
    -------
    trial : Trial
        Without the value that is compared.
    stopped : bool
        Whether the user asked to stop meanwhile.
    """
    begin = clock.perf_counter()
    solution: Solution | None = None
    error: Exception | None = None
    with noted_interrupts() as interrupts:

        def report(line: str) -> None:
            if say:
                say(job.prefix + line)
            if asked and asked():
                interrupts.ask()

        try:
            solution = solve(
                job.problem,
                settings=_within(job.settings, job.seconds),
                guess=job.guess,
                bound=job.bound,
                progress=report if say or asked else None,
            )
            # what was cut short counts only if it is as accurate as asked for
            must_pass = job.settings.verify and job.settings.refinement.adapts
            if must_pass and not solution.verification.passed:
                kind = Interrupted if solution.interrupted else BudgetSpent
                error = kind(solution.verdict)
        except OcpError as failure:
            # what did not pass is there to look at
            reached = getattr(failure, "iterate", None)
            solution = reached if isinstance(reached, Solution) else None
            error = failure
    stopped = interrupts.asked or isinstance(error, Interrupted)
    return Trial(job.name, solution, error, math.nan, clock.perf_counter() - begin), stopped


def _within(settings: Settings, seconds: float) -> Settings:
    """The settings of a solve that may take so long, and no longer than they say."""
    least = min(seconds, settings.seconds or math.inf)
    return settings if math.isinf(least) else replace(settings, seconds=least)


def solved_side_by_side(
    jobs: Iterator[StartJob | Trial],
    workers: int,
    say: Progress | None,
    asked: Callable[[], bool],
) -> Generator[Trial]:
    """What comes of starts, in their order, solved in up to `workers` processes at once.

    A job is taken when there is room for its process. When the user asks to stop, none is taken any
    more: those at work are stopped, and what they had reached still comes. At the second time the
    processes are ended, and only what they had sent still comes.

    Parameters
    ----------
    jobs : iterator
        A trial among them comes back as it is, in its turn.
    say : function of a line of text, optional
        Called here with the lines of progress of all processes.
    asked : function
        Whether the user asks to stop.

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
    stop = context.RawValue(ctypes.c_bool, False)
    waiting: deque[_StartProcess] = deque()
    try:
        while True:
            # a job is taken late: what is left of the seconds is known then
            at_work = [run for run in waiting if run.trial is None]
            if not asked() and len(at_work) < workers and (job := next(jobs, None)):
                waiting.append(_begun(context, job, stop, tells=say is not None))
                continue
            if not waiting:
                return

            # never for long, so that the user sees lines and may ask to stop
            stop.value = asked()
            ready = connection.wait([run.pipe for run in at_work], _PAUSE) if at_work else []
            for run in at_work:
                if run.pipe in ready:
                    run.receive(say)
            while waiting and (trial := waiting[0].trial) is not None:
                waiting.popleft()
                yield trial
    except KeyboardInterrupt:
        yield from (run.trial for run in waiting if run.trial is not None)
        raise
    finally:
        for run in waiting:
            run.end()


@dataclass(eq=False)
class _StartProcess:
    """A start in a process of its own; without one it has come already.

    Attributes
    ----------
    pipe : what the process sends.
    trial : what came of it, None as long as it is at work.
    """

    job: StartJob | None = None
    process: BaseProcess | None = None
    pipe: Any = None
    trial: Trial | None = None

    def receive(self, say: Progress | None) -> None:
        """Take one message of the process: a line of progress, the answer, or an error."""
        assert self.job is not None
        assert self.process is not None
        try:
            message = self.pipe.recv()
        except EOFError:
            self.process.join()
            raise _ended_early(self.process.exitcode) from None
        if isinstance(message, Exception):
            raise message
        if not isinstance(message, str):
            data, error, seconds = message
            solution = None if data is None else unpacked(data, known=self.job.problem)
            self.trial = Trial(self.job.name, solution, error, math.nan, seconds)
            self.end()
        elif say:
            say(message)

    def end(self) -> None:
        """End the process, whatever it is at."""
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.pipe.close()


def _begun(context: BaseContext, job: StartJob | Trial, stop: Any, *, tells: bool) -> _StartProcess:
    """The run of a job, whose process has started."""
    if isinstance(job, Trial):
        return _StartProcess(trial=job)
    ours, theirs = context.Pipe(duplex=False)
    make: Any = context
    process = make.Process(target=_run, args=(job, theirs, stop, tells), daemon=True)
    with _interrupts_wait(), warnings.catch_warnings():
        # Python 3.12 and later warn of threads around a fork; those of linear algebra idle
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    theirs.close()
    return _StartProcess(job, process, ours)


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Let Ctrl-C wait meanwhile, and for ever in a process that starts: it is for this one alone.

    A process begins with the signals that its parent lets wait.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield  # Windows has none
        return
    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)


def _run(job: StartJob, pipe: Any, stop: Any, tells: bool) -> None:
    """Solve a job in this process and send what comes of it, the error without its iterate."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it cannot wait (Windows)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # that of the parent would raise an error
    threading.Thread(target=_end_after_parent, daemon=True).start()
    try:
        trial, _ = solved_here(job, pipe.send if tells else None, lambda: bool(stop.value))
        error = trial.error and type(trial.error)(str(trial.error))
        data = None if trial.solution is None else packed(trial.solution, known=job.problem)
        pipe.send((data, error, trial.seconds))
    except Exception as error:  # one of the program's own: it belongs to who called the audit
        pipe.send(error)


def _end_after_parent() -> None:
    """End this process as soon as its parent has ended: nobody waits for it any more."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)


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
    methods = multiprocessing.get_all_start_methods()
    forks = chosen == "fork" if chosen else "fork" in methods and methods[0] != "spawn"
    return "fork" if forks else "spawn"


def _ended_early(exit_code: int | None) -> OcpError:
    """What to say when a process ended before it sent its solution."""
    # 1 is what Python itself ends with where the script cannot be imported a second time
    if exit_code in (_UNGUARDED, 1):
        return StatementError(
            "the processes of the audit import the script that starts it, and would run it again; "
            "put its code below if __name__ == '__main__': or write audit(..., processes=1)"
        )
    return SolveFailed(
        "a process of the audit ended without a result, possibly because it ran out of memory; "
        "write audit(..., processes=1) to solve the starts one after the other"
    )
