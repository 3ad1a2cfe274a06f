"""What a solve says while it runs: to a function of the user, or as one live line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TextIO

from ocp.errors import StatementError

Progress = Callable[[str], None]


@dataclass(eq=False)
class LiveLine:
    """One line that is written over and over on a terminal.

    Where the stream is no terminal (a file, a notebook) it writes one line a mesh iteration, of
    each of the solves that run side by side.
    """

    stream: TextIO = field(default_factory=lambda: sys.stderr)
    _width: int = 0
    _mesh_iterations: dict[str, str] = field(default_factory=dict)

    def __call__(self, text: str) -> None:
        """Show a line of text in the place of the one before."""
        if self.stream.isatty():
            self.stream.write(f"\r{text:<{self._width}}")
            self._width = len(text)
        else:
            mesh_iteration = text.partition(", iteration")[0]
            solve = mesh_iteration.rpartition("mesh iteration")[0]
            if self._mesh_iterations.get(solve) != mesh_iteration:
                self.stream.write(f"{mesh_iteration}\n")
                if not solve:  # another line: what comes next may be another solve
                    self._mesh_iterations.clear()
                self._mesh_iterations[solve] = mesh_iteration
        self.stream.flush()

    def close(self) -> None:
        """Leave the last line behind."""
        if self._width:
            self.stream.write("\n")
            self.stream.flush()


@contextmanager
def shown(progress: Progress | bool | None) -> Iterator[Progress | None]:
    """Who receives the lines of progress: the callable given, a live line for True, else nobody.

    Raises
    ------
    StatementError
        For anything else.
    """
    if progress is None or progress is False:
        yield None
    elif progress is True:
        line = LiveLine()
        try:
            yield line
        finally:
            line.close()
    elif callable(progress):
        yield progress
    else:
        raise StatementError(
            f"progress is {progress!r}; give True for a live line, or a function that takes a line "
            "of text"
        )
