"""Ctrl-C during a solve, noted and acted on between two iterations of the solver.

CasADi takes an interrupt that arrives in its own code for a failure of the solver. Here the signal
only leaves a note, so that it is neither lost nor mistaken.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any


class SecondInterrupt(KeyboardInterrupt):
    """Ctrl-C for the second time: whatever is lost by that, all ends at once."""


@dataclass
class Interrupts:
    """Whether the user has asked to stop. A second time stops at once, whatever is lost.

    Attributes
    ----------
    before : object
        The handler of the signal that was there before.
    """

    before: Any = None
    _asked: bool = False

    @property
    def asked(self) -> bool:
        """Whether the signal has come, here or in a block around this one."""
        around = getattr(self.before, "__self__", None)
        return self._asked or (isinstance(around, Interrupts) and around.asked)

    def ask(self) -> None:
        """Ask to stop without a signal, as for another process that the user has interrupted."""
        self._asked = True

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise SecondInterrupt
        self.ask()
        if callable(self.before) and self.before is not signal.default_int_handler:
            self.before(number, frame)


@contextmanager
def noted_interrupts() -> Iterator[Interrupts]:
    """Note Ctrl-C instead of raising KeyboardInterrupt anywhere inside the block.

    A handler that is not Python's own is told as well, so that blocks can be nested.
    """
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        # signals reach the main thread only
        yield interrupts
        return

    interrupts.before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, interrupts._note)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, interrupts.before)
