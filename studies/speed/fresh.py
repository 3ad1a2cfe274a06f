"""A measurement in a process of its own: started, timed, ended at a limit, answer read from a file.

Processes are timed one after the other, each with one thread for linear algebra, and with
bytecode kept from start to start, as Python does by itself.
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
class Finished:
    """What became of a process.

    Attributes
    ----------
    seconds : from its start to its end.
    processor : seconds of processor time, of its children too; a busy machine changes it less.
    started : instant of its start, on the clock `time.monotonic` of the system.
    answer : what it wrote, or None.
    failure : why there is no answer; empty if there is.
    """

    seconds: float
    started: float
    processor: float = 0.0
    answer: Mapping[str, Any] | None = None
    failure: str = ""


@dataclass(frozen=True)
class Program:
    """A command that writes its answer as JSON to a file named by its last argument.

    Attributes
    ----------
    environment : variables to set; None takes one away.
    """

    command: Sequence[str]
    environment: Mapping[str, str | None] = field(default_factory=dict)

    def run(self, *arguments: object, limit: float) -> Finished:
        """Run to the end, or to `limit` seconds; nothing is left running, whatever happens."""
        with tempfile.TemporaryDirectory(prefix="antenna-ocp-") as scratch:
            path = Path(scratch) / "answer.json"
            words = [*self.command, *(str(a) for a in arguments), str(path)]
            with (Path(scratch) / "said").open("w+", encoding="utf-8", errors="replace") as said:
                used, started = _processor(), time.monotonic()
                code = _ended(words, self._variables(), scratch, said, limit)
                seconds, used = time.monotonic() - started, _processor() - used
                if code is None:
                    return Finished(seconds, started, used, None, f"not done after {limit:g} s")
                if not path.is_file():
                    said.seek(0)
                    return Finished(seconds, started, used, None, _last_word(said.read(), code))
            return Finished(seconds, started, used, json.loads(path.read_text("utf-8")))

    def _variables(self) -> dict[str, str]:
        merged: dict[str, str | None] = {**os.environ, **dict.fromkeys(THREADS, "1")}
        merged[BYTECODE] = None
        merged |= self.environment
        return {name: value for name, value in merged.items() if value is not None}


def _processor() -> float:
    """Processor time of all processes that this one has started and seen end [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _ended(
    words: Sequence[str], variables: dict[str, str], folder: str, said: Any, limit: float
) -> int | None:
    """Exit code, or None where the limit ended it. The process and its children are ended.

    A wait with a timeout would look only every 50 ms; here the end is seen as it happens.
    """
    process = subprocess.Popen(
        words, env=variables, cwd=folder, stdin=subprocess.DEVNULL, stdout=said,
        stderr=subprocess.STDOUT, start_new_session=True,
    )  # fmt: skip
    late = threading.Event()

    def end() -> None:
        late.set()
        with contextlib.suppress(ProcessLookupError):  # it ended at this very instant
            os.killpg(process.pid, signal.SIGKILL)

    timer = threading.Timer(limit, end)
    timer.start()
    try:
        code = process.wait()
        return None if late.is_set() else code
    finally:
        timer.cancel()
        timer.join()
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _last_word(said: str, code: int) -> str:
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    return (lines[-1] if lines else f"ended with code {code}")[:LONGEST]
