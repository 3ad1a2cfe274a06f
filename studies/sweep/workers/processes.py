"""Processes of this machine that solve cases, and how a case is put to one of them.

A thread of the caller waits for each process. So it notices immediately if the process
hangs or dies, and a Dask worker can solve cases in its own process in the same way. An executor of
processes is no help here: it is lost as a whole if one of its processes is ended.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

from studies.common.processes.child import environment

SERVE = "from studies.sweep.workers.worker import serve; serve()"
CASES_A_PROCESS = 200
LINES = 5  # of what it writes to standard error that are kept
LAST_WORDS = 300  # characters that are kept of what a process said before it died


@dataclass
class CaseProcess:
    """One process that solves cases, started when there is one, and again after its death."""

    _process: subprocess.Popen[str] | None = None
    _said: deque[str] = field(default_factory=lambda: deque(maxlen=LINES))
    _listener: threading.Thread | None = None
    _answered: int = 0

    def answer(self, task: Mapping[str, Any], seconds: float | None) -> dict[str, Any]:
        """What came of a case; a process that hangs or dies is an outcome, too.

        Parameters
        ----------
        task : mapping
            As `studies.sweep.workers.worker.outcome` takes it.
        seconds : float or None
            After which the process is ended.
        """
        process = self._started()
        if process is None:
            return {"record": {"status": "killed", "reason": "the run ended before the case began"}}
        assert process.stdin is not None
        assert process.stdout is not None
        late = threading.Event()

        def end() -> None:
            late.set()
            _kill(process)

        timer = threading.Timer(seconds, end) if seconds is not None else None
        try:
            if timer is not None:
                timer.start()
            with contextlib.suppress(OSError):  # dead already: no answer comes
                process.stdin.write(json.dumps(task) + "\n")
                process.stdin.flush()
            line = process.stdout.readline()
        finally:
            if timer is not None:
                timer.cancel()
        if line.endswith("\n"):
            self._answered += 1
            if self._answered == CASES_A_PROCESS:
                self.close()  # a new one has none of the memory that the solvers have kept
            return dict(json.loads(line))

        self.close()
        if late.is_set():
            reason = f"stopped after {seconds:g} s (--case-seconds)"
            return {"record": {"status": "hung", "reason": reason, "seconds": seconds}}
        return {"record": {"status": "killed", "reason": self._last_words(process.wait())}}

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            process, self._process = self._process, None
            _kill(process)
            process.wait()
            if self._listener is not None:
                self._listener.join(timeout=1.0)
            for pipe in (process.stdin, process.stdout, process.stderr):
                with contextlib.suppress(OSError, ValueError):
                    if pipe is not None:
                        pipe.close()

    def _started(self) -> subprocess.Popen[str] | None:
        """The process, begun where there is none; None where all of them have been ended."""
        with _STARTING:
            if _ENDED.is_set():
                return None
            if self._process is None or self._process.poll() is not None:
                self._process = self._begun()
            return self._process

    def _begun(self) -> subprocess.Popen[str]:
        self._answered = 0
        self._said.clear()
        process = subprocess.Popen(
            [sys.executable, "-c", SERVE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=environment(),
            start_new_session=True,
        )
        # a pipe that nobody reads would stop the process when it is full
        listener = threading.Thread(target=self._said.extend, args=(process.stderr,), daemon=True)
        listener.start()
        self._listener = listener
        return process

    def _last_words(self, code: int) -> str:
        """Why a process died, as far as it or the system says."""
        text = self._said[-1].strip()[-LAST_WORDS:] if self._said else ""
        with contextlib.suppress(ValueError):
            how = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
            return f"its process ended {how}" + (f": {text}" if text else "")
        return f"its process ended with {code}"


class LocalProcesses:
    """Processes of this machine, each of which solves one case at a time."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._threads = ThreadPoolExecutor(count, thread_name_prefix="case")

    def slots(self) -> int:
        """How many cases may be in flight."""
        return self.count

    def submit(self, task: Mapping[str, Any], seconds: float | None) -> Future[dict[str, Any]]:
        """Have a case solved."""
        return self._threads.submit(answer_here, task, seconds)

    def close(self) -> None:
        """End all processes, whatever they are at."""
        with _STARTING:  # one that is just being started is there then
            _ENDED.set()
        for process in list(_EVERY):
            process.close()
        self._threads.shutdown(wait=True, cancel_futures=True)
        _EVERY.clear()
        _ENDED.clear()

    def __str__(self) -> str:
        return f"{self.count} processes" if self.count > 1 else "one process"


_OF_THE_THREAD = threading.local()
_EVERY: list[CaseProcess] = []
_STARTING = threading.Lock()
_ENDED = threading.Event()  # no process is started while it is set


def answer_here(task: Mapping[str, Any], seconds: float | None) -> dict[str, Any]:
    """Have a case solved by the process of the thread that calls; a Dask worker calls it, too."""
    process = getattr(_OF_THE_THREAD, "process", None)
    if process is None:
        process = CaseProcess()
        _OF_THE_THREAD.process = process
        _EVERY.append(process)
    return dict(process.answer(task, seconds))


def _kill(process: subprocess.Popen[str]) -> None:
    """End a process and those that it started."""
    with contextlib.suppress(OSError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
