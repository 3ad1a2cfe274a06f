"""Independent parts of a study, side by side in processes of their own.

A part is a function at the top of a module and its arguments, which go to the process and come back
as Python stores objects. What comes of the parts does not depend on how many processes there are:
with one they are done here, one after the other, by the same functions.

The processes are started anew, and not forked: so a user's script need not guard itself, and all
platforms do the same. Each ends with the process that started it.
"""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO

from ocp.analysis.worker_processes import processors
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.processes.child import MOST_PROCESSES, ends_with_parent, environment

_SERVE = "from studies.common.processes.side_by_side import serve; serve()"
_LIVE = 0.1  # [s] between two live lines of a process
_LOOK = 0.5  # [s] within which Ctrl-C is noticed on platforms where waiting hides it


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
        At once; as many as there are processors by default, and no more than the user allows.

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

    todo: queue.SimpleQueue[tuple[int, Part]] = queue.SimpleQueue()
    for numbered in enumerate(parts):
        todo.put(numbered)
    told: queue.Queue[tuple[int, str, Any]] = queue.Queue()
    running = [_Worker(todo, told) for _ in range(workers)]
    answers: dict[int, tuple[str, Any]] = {}
    try:
        for worker in running:
            worker.start()
        for number in range(len(parts)):
            while number not in answers:
                _take(told, answers, console)
            kind, answer = answers.pop(number)
            if kind == "error":
                raise answer
            yield answer
    finally:
        with contextlib.suppress(queue.Empty):
            while True:
                todo.get_nowait()  # no thread begins another one
        for worker in running:
            worker.end()


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


def _take(
    told: queue.Queue[tuple[int, str, Any]], answers: dict[int, tuple[str, Any]], console: Console
) -> None:
    """Wait for something that a process tells, and print or keep it."""
    try:
        number, kind, what = told.get(timeout=_LOOK)
    except queue.Empty:
        return
    if kind == "say":
        console.progress(what)
    elif kind == "live":
        console.live(what)
    else:
        answers[number] = kind, what


@dataclass(eq=False)
class _Worker:
    """A process that does parts as long as there are any, and the thread that listens to it."""

    todo: queue.SimpleQueue[tuple[int, Part]]
    told: queue.Queue[tuple[int, str, Any]]
    _process: subprocess.Popen[bytes] | None = None
    _thread: threading.Thread = field(init=False)

    def start(self) -> None:
        """Start the process and listen."""
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SERVE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment(),
            start_new_session=True,  # Ctrl-C is for the one that waits, which ends the others
        )
        self._thread = threading.Thread(target=self._listen, args=(self._process,), daemon=True)
        self._thread.start()

    def end(self) -> None:
        """End the process, whatever it does."""
        if self._process is None:
            return
        self._process.kill()
        self._process.wait()
        self._thread.join(timeout=1.0)
        for pipe in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError, ValueError):
                if pipe is not None:
                    pipe.close()

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        while True:
            try:
                number, part = self.todo.get_nowait()
            except queue.Empty:
                return
            try:
                self._do(process, number, part)
            except (EOFError, OSError, pickle.UnpicklingError):
                self.told.put((number, "error", _ended(process.wait())))
                return
            except Exception as error:  # of what cannot be sent or read
                self.told.put((number, "error", error))
                return

    def _do(self, process: subprocess.Popen[bytes], number: int, part: Part) -> None:
        """Put one part to the process, and tell what it says until its answer."""
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(pickle.dumps((part.function, part.arguments)))
        process.stdin.flush()
        while True:
            kind, what = pickle.load(process.stdout)
            self.told.put((number, kind, what))
            if kind in ("answer", "error"):
                return


def _ended(code: int) -> StudyError:
    """What to say where a process ended without an answer."""
    how = f"with exit code {code}"
    with contextlib.suppress(ValueError):
        how = f"by {signal.Signals(-code).name}" if code < 0 else how
    return StudyError(
        f"a process of the study ended {how} and without an answer, as where memory runs out; "
        f"with {MOST_PROCESSES}=1 in the environment all is done in one",
        ExitCode.NOT_SOLVED,
    )


def serve() -> None:
    """Do the parts that come by standard input, and send what comes of them by standard output."""
    if not ends_with_parent():
        return
    sent = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    console = _SentLines(to=sent)
    while True:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            told = "answer", function(*arguments, console)
        except Exception as error:  # raised again where the parts are waited for
            told = "error", error
        _send(sent, *told)


@dataclass
class _SentLines(Console):
    """A console whose lines of progress are sent to the process that prints them."""

    to: BinaryIO = field(default_factory=io.BytesIO)

    def progress(self, text: str) -> None:
        """Send a line of progress."""
        _send(self.to, "say", text)

    def live(self, text: str) -> None:
        """Send where long work stands, now and then."""
        now = time.monotonic()
        if now - self._shown > _LIVE:
            self._shown = now
            _send(self.to, "live", text)


def _send(to: BinaryIO, kind: str, what: Any) -> None:
    try:
        data = pickle.dumps((kind, what))
    except Exception as error:  # an answer that cannot be sent is a defect of the part
        data = pickle.dumps(("error", TypeError(f"{type(what).__name__} cannot be sent: {error}")))
    to.write(data)
    to.flush()
