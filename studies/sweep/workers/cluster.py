"""A Dask cluster that solves cases: one of this machine, or one whose scheduler has an address.

A Dask worker does not solve a case itself. It puts it to a process of its own, exactly as the
threads of `processes` do, so that a solver that hangs or dies costs a case and no worker.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Mapping
from concurrent.futures import Future
from typing import Any
from urllib.parse import urlsplit

from studies.common.exit_codes import ExitCode, StudyError, quoted
from studies.sweep.workers.processes import answer_here

LOCAL = "local"
PATIENCE = 4.0  # [s] for a scheduler to answer: the user hears of it within 2.5 times that, 10 s
AHEAD = 2  # cases in flight for each thread of the cluster, so that none waits for the next


def _host_and_port(address: str) -> tuple[str, int]:
    """What an address names.

    Raises
    ------
    StudyError
        If it names no host and port.
    """
    with contextlib.suppress(ValueError):  # a port that is no number, or none that there is
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        if parts.hostname is not None and parts.port is not None:
            return parts.hostname, parts.port
    raise StudyError(
        f"--scheduler is {quoted(address)}; give its address, as tcp://host:8786, or '{LOCAL}' "
        "for a cluster of this machine"
    )


async def _asked_who_it_is(address: str) -> None:
    """Raise OSError unless a Dask scheduler answers at an address.

    A Dask client would wait long for a program that does not answer or uses another protocol.
    """
    from distributed.comm import connect
    from distributed.security import Security

    secured = Security().get_connection_args("client")
    comm = await connect(address, timeout=PATIENCE, **secured)
    try:
        await comm.write({"op": "identity", "reply": True})
        if (await comm.read()).get("type") != "Scheduler":
            raise OSError("the program at this address is not a scheduler")
    finally:
        comm.abort()


def _knock(address: str) -> None:
    """Raise an error within PATIENCE if no scheduler answers, immediately if the port is closed."""
    socket.create_connection(_host_and_port(address), timeout=PATIENCE / 2).close()
    try:
        asyncio.run(asyncio.wait_for(_asked_who_it_is(address), PATIENCE))
    except MemoryError:
        # the first bytes of another protocol, read as the size of a message
        raise OSError("the program at this address does not use the protocol of Dask") from None
    except TimeoutError:
        raise OSError(f"no answer within {PATIENCE:g} s") from None


class DaskCluster:
    """A cluster on which cases are solved.

    Parameters
    ----------
    address : str
        Of its scheduler, or "local" for a cluster that this process makes.
    workers : int
        Processes of a local one.

    Raises
    ------
    StudyError
        If Dask is not installed, the address is none, or no scheduler answers.
    """

    def __init__(self, address: str, workers: int) -> None:
        try:
            from distributed import Client, LocalCluster
        except ImportError as error:
            raise StudyError(
                "--scheduler needs Dask, which is not installed; install it with: "
                "pip install 'antenna-ocp[scale]'"
            ) from error

        class QuietClient(Client):
            """One that is closed by `close` alone: the class's own end complains of a lost peer."""

            def __del__(self) -> None:
                pass

        # our own sentences tell the user what happened, without the tracebacks of Dask
        for name in list(logging.root.manager.loggerDict):
            if not name.startswith("distributed"):
                continue
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        self.address = address
        self._local = None
        try:
            if address == LOCAL:
                # one thread each: solvers in threads of one process would crash
                self._local = LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None
                )
            else:
                _knock(address)
            self._client = QuietClient(
                self._local or address, timeout=PATIENCE, set_as_default=False
            )
        except StudyError:
            raise
        except Exception as error:  # whatever answers there need not be a scheduler
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise StudyError(
                f"no Dask scheduler answers at {address} ({reason}); start one with: dask "
                "scheduler, or leave --scheduler out to use this machine"
            ) from error

    def slots(self) -> int:
        """How many cases may be in flight, with the workers that there are now."""
        threads: Mapping[str, int] = {}
        with contextlib.suppress(OSError, TimeoutError):  # lost: the cases in flight say so
            if self._client.status == "running":
                threads = self._client.nthreads()
        return max(1, AHEAD * sum(threads.values()))

    def submit(self, task: Mapping[str, Any], seconds: float | None) -> Future[dict[str, Any]]:
        """Have a case solved; a worker that is lost meanwhile gives it to another one."""
        answer: Future[dict[str, Any]] = Future()
        answer.set_running_or_notify_cancel()
        remote = self._client.submit(answer_here, dict(task), seconds, pure=False)

        def ended(done: Any) -> None:
            if done.status == "finished":
                answer.set_result(done.result())
            elif done.status == "error":
                # the scheduler has given up a case whose workers died again and again
                reason = f"its Dask workers died: {done.exception()}"
                answer.set_result({"record": {"status": "killed", "reason": reason}})
            else:
                answer.set_exception(
                    StudyError(
                        f"the connection to the Dask scheduler at {self.address} was lost; "
                        "finished cases are kept: give the same command again",
                        ExitCode.INTERRUPTED,
                    )
                )

        remote.add_done_callback(ended)
        return answer

    def close(self) -> None:
        """Leave the cluster; one of our own ends."""
        with contextlib.suppress(OSError, TimeoutError):
            self._client.close()
        if self._local is not None:
            self._local.close()

    def __str__(self) -> str:
        workers, address = len(self._client.nthreads()), self._client.scheduler.address
        if workers == 0:
            return f"a Dask cluster that waits for a worker (start one: dask worker {address})"
        return f"a Dask cluster of {workers} worker{'s' if workers > 1 else ''} at {address}"
