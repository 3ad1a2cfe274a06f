"""How a run is stopped: by Ctrl-C or SIGTERM, with what was found kept, and at once by a second."""

from __future__ import annotations

import dataclasses
import os
import select
import signal
import socket
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING

from studies.common.console import Console
from studies.common.exit_codes import ExitCode

if TYPE_CHECKING:
    from studies.common.result import Result

_TO_ANSWER = 1.0  # [s] in which a run may end by itself before the signal is answered for it

_LATER = 0.01  # [s] until an interrupt is tried again


def kept_anyway(result: Callable[[bool], Result], stopped: bool = False) -> Result:
    """The result of what a search has found, which no first Ctrl-C takes away any more.

    Parameters
    ----------
    result : callable
        Makes the result: with True the whole, with False without whatever takes longer than a
        user who has stopped it would wait.
    stopped : bool
        Whether the user has stopped the search.
    """
    from ocp import Interrupted
    from ocp.nlp.interrupts import noted_interrupts

    if not stopped:
        try:
            return result(True)
        except (KeyboardInterrupt, Interrupted):
            pass  # made anew, and shorter
    with noted_interrupts():
        return dataclasses.replace(result(False), interrupted=True)


def interrupt(number: int, frame: FrameType | None) -> None:
    """A handler of Ctrl-C that raises KeyboardInterrupt, but never inside CasADi.

    There it would be lost, or come out as a result that is None. It is tried again a little later.
    """
    if signal.getsignal(signal.SIGINT) is not interrupt:
        return  # who has taken its place tells it, and acts itself
    while frame is not None and not frame.f_globals.get("__name__", "").startswith("casadi"):
        frame = frame.f_back
    if frame is None or not hasattr(signal, "setitimer"):  # Windows has no such timer
        raise KeyboardInterrupt
    signal.signal(signal.SIGALRM, _again)
    signal.setitimer(signal.ITIMER_REAL, _LATER)


def _again(number: int, frame: FrameType | None) -> None:
    handler = signal.getsignal(signal.SIGINT)
    if callable(handler):
        handler(signal.SIGINT, frame)


@contextmanager
def stops_heard(console: Console) -> Iterator[None]:
    """Let SIGTERM end a run as Ctrl-C does, and let a second signal end the process.

    Python acts on a signal between two steps of its own, and one step of a solver may be long. A
    thread hears of the signal meanwhile.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are the main thread's
        return

    def as_ctrl_c(number: int, frame: FrameType | None) -> None:
        # a shell lets what runs in its background ignore Ctrl-C, but this was meant
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, interrupt)
        signal.raise_signal(signal.SIGINT)

    former_interrupt = signal.getsignal(signal.SIGINT)
    if former_interrupt is signal.default_int_handler:  # Python's own raises within CasADi, too
        signal.signal(signal.SIGINT, interrupt)
    former = signal.signal(signal.SIGTERM, as_ctrl_c)
    heard, told = socket.socketpair()
    told.setblocking(False)  # as Python asks of it
    former_told = signal.set_wakeup_fd(told.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_answer, args=(heard, console), daemon=True).start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(former_told)
        signal.signal(signal.SIGTERM, former)
        signal.signal(signal.SIGINT, former_interrupt)
        told.close()  # which ends the thread


def _answer(heard: socket.socket, console: Console) -> None:
    """Say that a signal has come, and end the process at the second one, if the run goes on."""
    counts = Counter[int]()
    with heard:
        while numbers := heard.recv(16):
            counts.update(numbers)
            # SIGTERM is handed on as Ctrl-C: each counts by itself
            asked = max(counts[signal.SIGINT], counts[signal.SIGTERM])
            if not asked or select.select([heard], [], [], _TO_ANSWER)[0]:
                continue
            if asked > 1:
                console.complain("interrupted twice; the files written so far are kept")
                os._exit(ExitCode.INTERRUPTED)
            console.progress(
                "stopping after the current step; press Ctrl-C again to stop immediately"
            )
