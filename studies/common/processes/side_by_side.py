"""Independent parts of a study, side by side in processes of their own.

A part is a function at the top of a module and its arguments, which go to the process and come back
as Python stores objects. What comes of the parts does not depend on how many processes there are:
with one they are done here, one after the other, by the same functions.

The processes are spawned, and not forked: a forked one would share the state of the solvers'
libraries and their threads. They do not import the script that runs: so it need not guard itself.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent import futures
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from ocp.processors import processors
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.processes.child import LIVE, MOST_PROCESSES, Lines, done_here, prepare
from studies.common.processes.pool import ProcessPool


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a study.

    Attributes
    ----------
    function : at the top of a module; called with the arguments and a console for its lines of
        progress.
    arguments : that can be pickled.
    """

    function: Callable[..., Any]
    arguments: tuple[Any, ...]


Further = Callable[[int, Any], Sequence[Part]]
"""From the place of a part and what came of it to parts that follow from it."""


def side_by_side(
    parts: Sequence[Part],
    console: Console,
    processes: int | None = None,
    further: Further | None = None,
) -> Generator[Any]:
    """What comes of each part, in their order, and then of the further parts, in the same order.

    Parameters
    ----------
    parts : sequence of Part
    console : Console
        Where lines of progress of all parts go.
    processes : int, optional
        At once; by default as many as there are processors, and no more than the user allows.
    further : callable, optional
        Called here as soon as one of the parts is done; what it gives is done behind them.

    Raises
    ------
    StudyError
        If a process ends without an answer.
    Exception
        That of the first part that fails, in their order.
    """
    workers = min(processes or allowed_processes(), len(parts))
    if workers <= 1:
        yield from _one_by_one(parts, console, further)
        return

    context = multiprocessing.get_context("spawn")
    lines: Lines = context.SimpleQueue()
    pool = ProcessPool(workers, context, prepare, (lines,))
    try:
        with pool:
            first = _begun(pool, parts)
            waiting, followers = dict(enumerate(first)), dict[int, list[futures.Future[Any]]]()

            def follow() -> None:
                """Begin what follows from the parts that are done by now."""
                for k in [k for k, answer in waiting.items() if answer.done()]:
                    done = waiting.pop(k)
                    if further is not None and done.exception() is None:
                        followers[k] = _begun(pool, further(k, done.result()))

            for answer in first:
                yield from _awaited(answer, lines, console, follow)
            for k in sorted(followers):
                for answer in followers[k]:
                    yield from _awaited(answer, lines, console, follow)
    except BrokenProcessPool as broken:
        if broken.__cause__ is not None:  # none has died: what one has sent cannot be read
            raise
        raise _ended(pool.exit_codes()) from broken
    finally:
        lines.close()


def _one_by_one(parts: Sequence[Part], console: Console, further: Further | None) -> Generator[Any]:
    """What comes of the parts and of the further ones, done here."""
    followers: list[Part] = []
    for k, part in enumerate(parts):
        answer = part.function(*part.arguments, console)
        if further is not None:
            followers += further(k, answer)
        yield answer
    for part in followers:
        yield part.function(*part.arguments, console)


def _begun(pool: ProcessPool, parts: Sequence[Part]) -> list[futures.Future[Any]]:
    """The parts, handed to the processes."""
    with script_left_out():
        return pool.submit((done_here, (p.function, p.arguments)) for p in parts)


def _awaited(
    answer: futures.Future[Any], lines: Lines, console: Console, meanwhile: Callable[[], None]
) -> Generator[Any]:
    """What comes of one part; lines of progress of all are shown until then."""
    while not futures.wait([answer], timeout=LIVE).done:
        _show(lines, console)
        meanwhile()
    _show(lines, console)  # a part has sent all its lines before its answer
    meanwhile()
    yield answer.result()


def allowed_processes() -> int:
    """As many as there are processors, unless the user allows fewer.

    Raises
    ------
    StudyError
        If the limit in the environment is no whole number from 1 on.
    """
    stated = os.environ.get(MOST_PROCESSES, "").strip()
    if not stated:
        return processors()
    if not stated.isdecimal() or int(stated) < 1:
        raise StudyError(
            f"the variable {MOST_PROCESSES} is {stated!r}; give a whole number, 1 or more"
        )
    return min(int(stated), processors())


@contextlib.contextmanager
def script_left_out() -> Iterator[None]:
    """Let processes that are spawned meanwhile not import the script that runs.

    `multiprocessing` has them import what stands as `__main__` if that comes from a file. A script
    without a guard would start the study once more there. An empty module comes from none.
    """
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def _show(lines: Lines, console: Console) -> None:
    """Print the lines of progress that have come."""
    while not lines.empty():
        method, text = lines.get()
        getattr(console, method)(text)


def _ended(exit_codes: set[int]) -> StudyError:
    """What to say where a process ended without an answer."""
    of_others = {0, -signal.SIGTERM}  # the pool has terminated them
    code = min(exit_codes - of_others, default=-signal.SIGTERM)
    how = f"with exit code {code}"
    with contextlib.suppress(ValueError):
        how = f"by {signal.Signals(-code).name}" if code < 0 else how
    return StudyError(
        f"a process of the study ended {how} and without an answer, as where memory runs out; "
        f"with {MOST_PROCESSES}=1 in the environment all is done in one",
        ExitCode.NOT_SOLVED,
    )
