"""Leases: who works on what in a results folder, so that nothing is computed twice.

A lease is a small file with host and process. Its time of change is the heartbeat. A lease whose
heart stands still for three beats, and whose process is gone, belongs to nobody: it is taken over.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import unwritable
from studies.common.foreign_text import parsed_json
from studies.sweep.cases.store import AGAIN

FOLDER, ENDING = "leases", ".lease"
HEARTBEAT = 2.0  # [s]
BEATS = 3.0  # without one of which a lease counts as left
RUN = "run"  # the lease of the whole folder


@dataclass(frozen=True)
class Lease:
    """A lease as its file states it.

    Attributes
    ----------
    host, process : of its holder.
    born : when that process began, as far as the system tells; two processes may share a number.
    age : since its last heartbeat [s].
    """

    host: str
    process: int
    born: str
    age: float

    @property
    def left(self) -> bool:
        """Whether its holder is gone; of another host only the heartbeat is known."""
        gone = self.host != socket.gethostname() or _born(self.process) != self.born
        return gone and self.age > BEATS * HEARTBEAT

    @property
    def holder(self) -> str:
        """Who it is, in words."""
        return f"process {self.process} on {self.host}"


@dataclass
class Leases:
    """The leases of one run in a results folder.

    Attributes
    ----------
    folder : the results folder.
    held : files of the leases that are held.
    """

    folder: Path
    held: dict[str, Path] = field(default_factory=dict)
    _beaten: float = 0.0

    def enter(self, say: Callable[[str], None]) -> None:
        """Take the lease of the whole folder; a run that has just been killed is waited for.

        Raises
        ------
        StudyError
            If another run is at work there, or the folder cannot be written.
        """
        try:
            (self.folder / FOLDER).mkdir(exist_ok=True)
        except OSError as error:
            raise unwritable(self.folder, error, AGAIN) from error
        told = False
        while not self.take(RUN):
            lease = self.read(RUN)
            if lease is None:
                continue  # given back meanwhile
            if lease.host != socket.gethostname() or _born(lease.process) == lease.born:
                raise StudyError(
                    f"another run works in {self.folder} ({lease.holder}, heard of "
                    f"{lease.age:.0f} s ago); wait for it or stop it, or name another folder with "
                    "--results",
                    ExitCode.NO_RESULTS_FOLDER,
                )
            if not told:
                say(f"{lease.holder} is gone; its lease runs out in {BEATS * HEARTBEAT:.0f} s")
                told = True
            time.sleep(HEARTBEAT / 8)

    def abandoned(self) -> list[str]:
        """Names of the leases that a run left when it was killed; they end with this call.

        To be called by who holds the lease of the folder: then nobody else is at work there.
        """
        left = sorted((self.folder / FOLDER).glob(f"*{ENDING}"))
        names = [path.name.removesuffix(ENDING) for path in left if path not in self.held.values()]
        for name in names:
            (self.folder / FOLDER / f"{name}{ENDING}").unlink(missing_ok=True)
        return names

    def take(self, name: str) -> bool:
        """Take a lease, if nobody has it or its holder is gone; return whether that was so.

        Raises
        ------
        StudyError
            If the folder cannot be written.
        """
        path = self.folder / FOLDER / f"{name}{ENDING}"
        lease = self.read(name)
        if lease is not None and lease.left:
            self._clear(path, lease)
        about = {
            "host": socket.gethostname(),
            "process": os.getpid(),
            "born": _born(os.getpid()),
        }
        try:
            # the system lets only one process make the file
            with path.open("x", encoding="utf-8") as file:
                file.write(json.dumps(about))
        except FileExistsError:
            return False
        except OSError as error:
            with contextlib.suppress(OSError):
                path.unlink()  # made and not filled, on a full disk: the next run would wait for it
            raise unwritable(self.folder, error, AGAIN) from error
        self.held[name] = path
        return True

    def _clear(self, path: Path, lease: Lease) -> None:
        """Remove a lease that was left, unless somebody has just taken it over."""
        aside = path.with_name(f"{path.name}.{os.getpid()}")
        with contextlib.suppress(OSError):
            path.rename(aside)
            taken = _read(aside)
            if taken is not None and (taken.process, taken.born) != (lease.process, lease.born):
                os.link(aside, path)
            aside.unlink()

    def read(self, name: str) -> Lease | None:
        """A lease; None if there is none."""
        return _read(self.folder / FOLDER / f"{name}{ENDING}")

    def beat(self) -> None:
        """Show that the held leases are alive, when it is time for that."""
        now = time.monotonic()
        if now - self._beaten < HEARTBEAT / 2:
            return
        self._beaten = now
        for path in self.held.values():
            with contextlib.suppress(OSError):
                os.utime(path)

    def give_back(self, name: str) -> None:
        """End a lease."""
        path = self.held.pop(name, None)
        if path is not None:
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)

    def leave(self) -> None:
        """End all leases of this run."""
        for name in list(self.held):
            self.give_back(name)


def _read(path: Path) -> Lease | None:
    try:
        age = time.time() - path.stat().st_mtime
        about: Mapping[str, Any] = parsed_json(path.read_text("utf-8"))
        return Lease(str(about["host"]), int(about["process"]), str(about["born"]), age)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError):  # killed while it was written
        return Lease(socket.gethostname(), 0, "nobody", age)


def _born(process: int) -> str:
    """When a process began, as the system counts; empty if it is gone."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text("utf-8", errors="replace")
        after = stat.rpartition(")")[2].split()
        return "" if after[0] == "Z" else after[19]
    except (OSError, IndexError):
        pass
    if Path("/proc/self/stat").exists() or process <= 0:
        return ""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return ""
    except OSError:
        return "alive"
    return "alive"
