"""Ctrl-C during a solve, noted and acted on between two iterations of the solver.

CasADi takes an interrupt that arrives in its own code for a failure of the solver; here the signal
only leaves a note, so that it ends neither lost nor mistaken.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass
class Interrupts:
    """Whether the user has asked to stop."""

    asked: bool = False

    def check(self) -> None:
        """Raise KeyboardInterrupt if the user has asked to stop; call it between iterations."""
        if self.asked:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.asked:  # the second time at once, whatever is lost
            raise KeyboardInterrupt
        self.asked = True


@contextmanager
def noted_interrupts() -> Iterator[Interrupts]:
    """Note Ctrl-C instead of raising KeyboardInterrupt anywhere inside the block."""
    found = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield found  # signals reach the main thread only
        return
    before = signal.signal(signal.SIGINT, found._note)
    try:
        yield found
    finally:
        signal.signal(signal.SIGINT, before)
