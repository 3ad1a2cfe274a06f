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

from ocp.process_pool import ProcessPool, processors
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.processes.child import LIVE, MOST_PROCESSES, Lines, done_here, prepare


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


def side_by_side(
    parts: Sequence[Part], console: Console, processes: int | None = None
) -> Generator[Any]:
    """What comes of each part, in their order.

    Parameters
    ----------
    parts : sequence of Part
    console : Console
        Where lines of progress of all parts go.
    processes : int, optional
        At once; by default as many as there are processors, and no more than the user allows.

    Raises
    ------
    StudyError
        If a process ends without an answer.
    Exception
        That of the first part that fails, in their order.
    """
    workers = min(processes or allowed_processes(), len(parts))
    if workers <= 1:
        for part in parts:
            yield part.function(*part.arguments, console)
        return

    context = multiprocessing.get_context("spawn")
    lines: Lines = context.SimpleQueue()
    pool = ProcessPool(workers, context, prepare, (lines,))
    try:
        with pool:
            with _script_left_out():
                answers = pool.submit((done_here, (p.function, p.arguments)) for p in parts)
            for answer in answers:
                while not futures.wait([answer], timeout=LIVE).done:
                    _show(lines, console)
                _show(lines, console)  # a part has sent all its lines before its answer
                yield answer.result()
    except BrokenProcessPool as broken:
        if broken.__cause__ is not None:  # none has died: what one has sent cannot be read
            raise
        raise _ended(pool.exit_codes()) from broken
    finally:
        lines.close()


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
def _script_left_out() -> Iterator[None]:
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
