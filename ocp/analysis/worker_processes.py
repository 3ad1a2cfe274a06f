"""Problems solved side by side, each in a process of its own.

Processes are forked where that is safe, which is faster, and spawned elsewhere.  Either way one is
sent the problem and its guess, and sends back its solution, in the form in which solutions are
stored (`ocp.solution.storage`).
"""

from __future__ import annotations

import multiprocessing
import time as clock
import warnings
from collections.abc import Generator, Sequence, Set
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache

from ocp.errors import OcpError, SolveFailed, StatementError, Unverified
from ocp.mesh.trajectory import Trajectory
from ocp.problem.problem import Problem
from ocp.process_pool import ProcessPool
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solution.storage import packed, unpacked
from ocp.solve import solve

Guess = Solution | Trajectory | None
Answer = tuple[Solution | None, Exception | None, float]  # with the seconds it took

# Exit code of a process that met the audit again while it imported the user's script; any number
# that Python itself does not use
_UNGUARDED = 76


def solved_in_processes(
    jobs: Sequence[tuple[Problem, Guess]], settings: Settings, bound: float | None, workers: int
) -> Generator[Answer]:
    """Solve problems from their guesses in up to `workers` processes.

    Yields
    ------
    tuple
        Solution, error (either may be None) and seconds of each job, in the order of the jobs.

    Raises
    ------
    StatementError
        When the script that started the processes cannot be imported by them.
    SolveFailed
        When a process ended without an answer.
    """
    pool = ProcessPool(workers, multiprocessing.get_context(_start_method()))
    calls = [(_solved_here, (*_sent(problem, guess), settings, bound)) for problem, guess in jobs]
    try:
        with pool:
            with warnings.catch_warnings():
                # Python 3.12 and later warn of threads around a fork; those of linear algebra idle
                warnings.simplefilter("ignore", DeprecationWarning)
                futures = pool.submit(calls)
            for (problem, _), future in zip(jobs, futures, strict=True):
                data, error, seconds = future.result()
                solution = None if data is None else unpacked(data, known=problem)
                yield solution, error, seconds
    except BrokenProcessPool as broken:
        raise _ended_early(pool.exit_codes()) from broken


def leave_if_imported_again() -> None:
    """End a process that meets the audit while it imports the script that started it.

    A spawned process imports the user's script first. Without a guard the script starts the audit
    once more there, which would start processes without end. The first process says so.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(_UNGUARDED)


def unverified_answer(error: Unverified) -> tuple[Solution | None, Exception]:
    """The answer that did not pass, and the error."""
    return (error.iterate if isinstance(error.iterate, Solution) else None), error


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


def _sent(problem: Problem, guess: Guess) -> tuple[bytes, bytes]:
    """A problem and a guess on the way to another process."""
    return packed(problem), packed(guess, known=problem)


@lru_cache(maxsize=8)
def _received(problem: bytes) -> Problem:
    """The problem of several starts in a row, built once in a process."""
    received = unpacked(problem)
    assert isinstance(received, Problem)
    return received


def _solved_here(
    statement: bytes, guess: bytes, settings: Settings, bound: float | None
) -> tuple[bytes | None, Exception | None, float]:
    """Run in the other process: a solution for the way back, or the error without its iterate."""
    begin = clock.perf_counter()
    problem = _received(statement)
    solution: Solution | None = None
    error: Exception | None = None
    try:
        start = unpacked(guess, known=problem)
        solution = solve(problem, settings=settings, guess=start, bound=bound)
    except Unverified as unverified:
        solution, error = unverified_answer(unverified)
    except OcpError as failure:
        error = failure
    if error is not None:
        error = type(error)(str(error))
    data = None if solution is None else packed(solution, known=problem)
    return data, error, clock.perf_counter() - begin
