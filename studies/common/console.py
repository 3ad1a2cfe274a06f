"""All that is printed: progress lines, plain lines and tables. Nothing else prints."""

import io
import shutil
import sys
import textwrap
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TextIO

LONGEST_LINE = 198  # characters of a line of a message, before a semicolon or behind its indent
PLAIN_TIMES = 10.0  # times a limit: beyond it a percentage says less than the ratio
QUIET = 4.0  # [s] without a line, after which the last one is repeated: one comes every 5 s
_TERMINAL_QUIET = 1.0  # [s] the same on a terminal
_LOOK = 0.5  # [s] between two looks at whether it is quiet


@dataclass(frozen=True)
class Table:
    """A titled table of text cells; the first column is left-aligned, the others right-aligned."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()

    def __str__(self) -> str:
        """Return the table as it is printed."""
        widths = [max(map(len, column)) for column in zip(self.head, *self.rows, strict=True)]
        rule = "  ".join("-" * width for width in widths)
        lines = [self.title, "", _row(self.head, widths), rule]
        lines += [_row(row, widths) for row in self.rows]
        return "\n".join([*lines, *([""] if self.notes else []), *self.notes])


def _row(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *others = [
        cell.ljust(width) if column == 0 else cell.rjust(width)
        for column, (cell, width) in enumerate(zip(cells, widths, strict=True))
    ]
    return "  ".join([first, *others]).rstrip()


def number(value: float | None, digits: int = 5) -> str:
    """Return a number with `digits` significant digits, or a dash where there is none."""
    return "-" if value is None or value != value else f"{value:.{digits}g}"


def in_lines(message: str) -> str:
    """A message whose long lines are parted: the fact stands first, its remedy in the next line.

    A line is parted behind a semicolon, which stands between them, or else at a space.
    """
    return "\n".join("\n  ".join(_parted(line)) for line in message.split("\n"))


def _parted(line: str) -> list[str]:
    found = [""]
    for part in line.split("; "):
        longer = f"{found[-1]}; {part}" if found[-1] else part
        if len(longer) <= LONGEST_LINE:
            found[-1] = longer
            continue
        before = [f"{found[-1]};"] if found[-1] else []
        wrapped = textwrap.wrap(part, LONGEST_LINE, break_long_words=False, break_on_hyphens=False)
        found[-1:] = before + wrapped
    return found


def above(excess: float) -> str:
    """How a value lies to its limit, by its relative excess: "82 % above", or "4100 times"."""
    ratio = 1.0 + excess
    if ratio < PLAIN_TIMES:
        return f"{float(f'{100 * excess:.2g}'):g} % above"
    return f"{float(f'{ratio:.2g}'):.0f} times" if ratio < 1e6 else f"{ratio:.1e} times"


@dataclass(eq=False)
class Console:
    """Prints results to standard output and progress to standard error.

    While it is `at_work`, a thread repeats the last line where no other comes for a while. CasADi
    and NumPy let it run during long work of theirs.
    """

    out: TextIO = field(default_factory=lambda: sys.stdout)
    progress_to: TextIO = field(default_factory=lambda: sys.stderr)
    started: float = field(default_factory=time.monotonic)
    _shown: float = field(default_factory=time.monotonic)  # when a line was shown
    _stage: str = "loading"  # where the work stands
    _since: float = field(default_factory=time.monotonic)  # when it came there
    _live: int = 0  # length of the live line on the terminal
    _beating: bool = False
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Say inside the block, every few seconds at least, where the work stands."""
        if self._beating:
            yield
            return
        self._beating, ended = True, threading.Event()
        self._shown = self._since = time.monotonic()
        beat = threading.Thread(target=self._beat, args=(ended,), daemon=True)
        beat.start()
        try:
            yield
        finally:
            self._beating = False
            ended.set()
            beat.join()

    def _beat(self, ended: threading.Event) -> None:
        while not ended.wait(_LOOK):
            quiet = _TERMINAL_QUIET if self.progress_to.isatty() else QUIET
            with self._lock:
                now = time.monotonic()
                if now - self._shown < quiet:
                    continue
                ago = now - self._since
                self._show(
                    self._stage
                    if ago < quiet
                    else f"still working, {ago:.0f} s after: {self._stage}"
                )

    def say(self, text: object = "") -> None:
        """Print a result."""
        with self._lock:
            self._clear()
            print(text, file=self.out, flush=True)
            self._shown = time.monotonic()

    def progress(self, text: str) -> None:
        """Print a line of progress with the seconds since the start."""
        with self._lock:
            self._reach(text)
            self._print(text)

    def live(self, text: str) -> None:
        """Show where long work stands: in one line on a terminal, else now and then."""
        with self._lock:
            self._reach(text)
            if self._since - self._shown >= (0.1 if self.progress_to.isatty() else QUIET):
                self._show(text)

    def _reach(self, text: str) -> None:
        self._stage, self._since = text, time.monotonic()

    def _show(self, text: str) -> None:
        """Show a line that the next one replaces on a terminal."""
        if not self.progress_to.isatty():
            self._print(text)
            return
        self._clear()
        line = fitted(f"{self._clock()} {text}", shutil.get_terminal_size().columns - 1)
        print(line, end="", file=self.progress_to, flush=True)
        self._live, self._shown = len(line), time.monotonic()

    def _print(self, text: str) -> None:
        self._clear()
        print(in_lines(f"{self._clock()} {text}"), file=self.progress_to, flush=True)
        self._shown = time.monotonic()

    def _clear(self) -> None:
        if self._live:
            print("\r" + " " * self._live + "\r", end="", file=self.progress_to)
            self._live = 0

    def _clock(self) -> str:
        return f"[{time.monotonic() - self.started:6.1f} s]"

    def complain(self, sentence: str) -> None:
        """Print an error."""
        with self._lock:
            self._clear()
            print(in_lines(f"antenna-ocp: {sentence}"), file=self.progress_to, flush=True)


def fitted(line: str, width: int) -> str:
    """A line in a width: the label before its last colon is shortened, and not the numbers."""
    label, colon, numbers = line.rpartition(": ")
    room = width - len(colon) - len(numbers) - len("...")
    if len(line) <= width or room < 0:
        return line[:width]
    return f"{label[:room]}...{colon}{numbers}"


@contextmanager
def at_work(console: Console | None) -> Iterator[Console]:
    """A console for a study that is run from Python: standard error's, unless one is given."""
    told = console or Console()
    with told.at_work():
        yield told


def silent() -> Console:
    """A console that keeps everything to itself."""
    return Console(io.StringIO(), io.StringIO())
