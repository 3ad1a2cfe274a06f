"""A measurement in a process of its own: started, timed, ended at a limit, answer read from a file.

Each process has one thread for linear algebra, and keeps bytecode from start to start, as Python
does by itself.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

BYTECODE = "PYTHONDONTWRITEBYTECODE"  # set, it makes our modules be compiled at every start
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
LONGEST = 120  # characters of an error that are kept


@dataclass(frozen=True)
class Answered:
    """How a measuring process ended, and what it answered.

    Attributes
    ----------
    seconds : float
        From its start to its end.
    started : float
        Instant of its start, on the system's clock `time.monotonic`.
    processor : float
        Seconds of processor time, of its children too; a busy machine changes it less.
    answer : mapping or None
        What it wrote.
    failure : str
        Why there is no answer; empty if there is.
    """

    seconds: float
    started: float
    processor: float
    answer: Mapping[str, Any] | None
    failure: str = ""


@dataclass(frozen=True)
class FreshProcess:
    """A command that writes its answer as JSON to a file named by its last argument.

    Attributes
    ----------
    command : sequence of str
    environment : mapping
        Variables to set; None takes one away.
    """

    command: Sequence[str]
    environment: Mapping[str, str | None] = field(default_factory=dict)

    def run(self, *arguments: object, limit: float) -> Answered:
        """Run to the end, or to `limit` seconds; nothing is left running, whatever happens."""
        with tempfile.TemporaryDirectory(prefix="antenna-ocp-") as scratch:
            answer_file, said = Path(scratch) / "answer.json", Path(scratch) / "said"
            words = [*self.command, *(str(a) for a in arguments), str(answer_file)]

            processor, started = _processor_of_children(), time.monotonic()
            with said.open("w", encoding="utf-8") as output:
                process = subprocess.Popen(
                    words,
                    env=self._variables(),
                    cwd=scratch,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=output,
                    start_new_session=True,  # its children are ended with it, as one group
                )
            late = _waited_for(process, limit)
            seconds = time.monotonic() - started
            processor = _processor_of_children() - processor

            # Without an answer, the last line that it printed is the best reason there is.
            answer, failure = None, ""
            if late:
                failure = f"not done after {limit:g} s"
            elif answer_file.is_file():
                answer = json.loads(answer_file.read_text("utf-8"))
            else:
                failure = _last_line(said.read_text("utf-8", "replace"), process.returncode)
            return Answered(seconds, started, processor, answer, failure)

    def _variables(self) -> dict[str, str]:
        """Our environment, one thread, bytecode kept, and the changes."""
        merged: dict[str, str | None] = {**os.environ, **dict.fromkeys(THREADS, "1")}
        merged |= {BYTECODE: None, **self.environment}
        return {name: value for name, value in merged.items() if value is not None}


def _waited_for(process: subprocess.Popen[bytes], limit: float) -> bool:
    """Wait for the end; whether the limit [s] has ended the process and its children."""
    late = threading.Event()

    def kill() -> None:
        late.set()
        with contextlib.suppress(ProcessLookupError):  # it ended at this very instant
            os.killpg(process.pid, signal.SIGKILL)

    # A wait with a timeout looks only every 50 ms, which counts for the shortest processes.
    # A plain wait sees the end as it happens, and the timer keeps the limit.
    timer = threading.Timer(limit, kill)
    timer.start()
    try:
        process.wait()
    finally:
        timer.cancel()
        timer.join()
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    return late.is_set()


def _processor_of_children() -> float:
    """Processor time of all processes that this one has started and seen end [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _last_line(said: str, code: int) -> str:
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    return (lines[-1] if lines else f"ended with code {code}")[:LONGEST]
