"""One run at a time in a results folder: a lock of the system, which ends with its process."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import unwritable
from studies.common.headers import one_line
from studies.sweep.cases.store import AGAIN

# says who holds it; it is never removed, as a run that has just opened it would hold another file
FILE = "sweep.lock"
LONGEST = 200  # characters of it that are shown


@contextlib.contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold the lock of a results folder.

    Raises
    ------
    StudyError
        If another run holds it, or the folder cannot be written.
    """
    try:
        file = (folder / FILE).open("a+", encoding="utf-8", errors="replace")
    except OSError as error:
        raise unwritable(folder, error, AGAIN) from error
    with file:
        _take(file, folder)
        yield


def _take(file: TextIO, folder: Path) -> None:
    """Take the lock, or say who has it; the processes of the cases do not inherit it."""
    try:
        import fcntl
    except ImportError as error:
        raise StudyError(
            "a sweep needs locks of files that this system lacks; run it on Linux or macOS"
        ) from error
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        file.truncate(0)
        file.write(f"process {os.getpid()} on {socket.gethostname()}")
        file.flush()
    except BlockingIOError:
        file.seek(0)
        holder = one_line(file.read(LONGEST))
        raise StudyError(
            f"another run uses {folder} ({holder}); wait for it or stop it, or name another "
            "folder with --results",
            ExitCode.NO_RESULTS_FOLDER,
        ) from None
    except OSError as error:
        raise unwritable(folder, error, AGAIN) from error
