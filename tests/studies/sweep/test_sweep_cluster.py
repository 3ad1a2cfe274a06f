"""Sweeps on a Dask cluster: its workers in other processes, one lost and one added on the way."""

import contextlib
import csv
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from studies.cli import main
from studies.common.configuration import toml_text
from studies.common.exit_codes import ExitCode
from studies.sweep.workers import cluster as cluster_module

ROOT = Path(__file__).parents[3]
FALL = {
    "duration": 0.4,
    "gravity": [0.0, -9.81],
    "elements": 2,
    "samples": 11,
    "frequencies": 0,
    "mesh_check": False,
    "link": [
        {"length": 1.2, "area": 1.8e-3, "second_moment": 1e-8, "modulus": 2e9, "density": 5e3}
    ],
    "joint": [{"kind": "free", "start_deg": 0.0}],
}
AXES = {
    "joint.0.start_deg": {"low": -60.0, "high": 60.0, "count": 6},
    "link.0.length": [1.0, 1.1, 1.2, 1.3],
}


def stated(folder: Path) -> Path:
    path = folder / "sweep.toml"
    path.write_text(toml_text({"subject": "flex", "parameters": AXES, "base": FALL}), "utf-8")
    return path


def refused(folder: Path, address: str, capsys: pytest.CaptureFixture[str]) -> tuple[str, float]:
    """What a sweep says that has no scheduler, and after how long [s]."""
    pytest.importorskip("distributed")
    out, begin = folder / "out", time.monotonic()
    flags = ("--results", str(out), "--scheduler", address)
    assert main(["sweep", str(stated(folder)), *flags]) == ExitCode.BAD_INPUT
    assert not out.exists()
    return capsys.readouterr().err, time.monotonic() - begin


def test_a_scheduler_that_does_not_answer_is_said_within_ten_seconds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said, seconds = refused(tmp_path, "tcp://127.0.0.1:1", capsys)
    assert seconds < 10.0
    assert "no Dask scheduler answers at tcp://127.0.0.1:1 (" in said
    assert "Connection refused" in said


@pytest.mark.parametrize("address", ["nonsense", "", "host:port", "tcp://host:99999"])
def test_an_address_without_host_and_port_is_refused(
    address: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said, _ = refused(tmp_path, address, capsys)
    assert f"--scheduler is '{address}'; give its address, as tcp://host:8786, or 'local'" in said


@pytest.mark.parametrize(
    ("greeting", "words"),
    [
        (b"", "no answer within 1 s"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "does not use the protocol of Dask"),
    ],
)
def test_who_listens_and_is_no_scheduler_is_told_within_ten_seconds(
    greeting: bytes,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # half of it for the first knock, then the greeting, and the client after it
    assert 2.5 * cluster_module.PATIENCE <= 10.0
    monkeypatch.setattr(cluster_module, "PATIENCE", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        kept = []  # else each connection would end, which says more than silence

        def answer() -> None:
            with contextlib.suppress(OSError):
                while True:
                    kept.append(listener.accept()[0])
                    kept[-1].sendall(greeting)

        threading.Thread(target=answer, daemon=True).start()
        address = f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        said, seconds = refused(tmp_path, address, capsys)
        for connection in kept:
            connection.close()
    assert seconds < 10.0
    assert f"no Dask scheduler answers at {address}" in said
    assert words in said


def dask(kind: str, *words: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", kind, *words],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def worker(address: str) -> subprocess.Popen[bytes]:
    return dask("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")


@pytest.fixture
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers in processes of their own."""
    pytest.importorskip("distributed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    processes = [dask("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")]
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
            break
        except OSError:
            time.sleep(0.2)
    workers = [worker(address) for _ in range(2)]
    try:
        yield address, workers
    finally:
        for process in (*workers, *processes):
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_worker_that_is_lost_and_one_that_comes_change_no_number(
    tmp_path: Path, cluster: tuple[str, list[subprocess.Popen[bytes]]]
) -> None:
    (address, workers), study = cluster, stated(tmp_path)
    out, whole = tmp_path / "dask", tmp_path / "whole"
    command = [sys.executable, "-m", "antenna_ocp", "sweep", str(study), "--no-figures"]
    run = subprocess.Popen(
        [*command, "--results", str(out), "--scheduler", address],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )

    def wait_for(count: int) -> None:
        until = time.monotonic() + 200.0
        while len(list(out.glob("cases/*/*.jsonl"))) < count and run.poll() is None:
            assert time.monotonic() < until
            time.sleep(0.02)

    wait_for(4)
    workers[0].kill()
    workers.append(worker(address))
    _, said = run.communicate(timeout=300.0)
    assert run.returncode == ExitCode.OK, said

    assert main(["sweep", str(study), "--no-figures", "--results", str(whole)]) == ExitCode.OK

    def rows(folder: Path) -> list[dict[str, str]]:
        with (folder / "cases.csv").open(encoding="utf-8", newline="") as file:
            return [
                {name: cell for name, cell in row.items() if name != "seconds [s]"}
                for row in csv.DictReader(file)
            ]

    assert len(rows(out)) == 24
    assert rows(out) == rows(whole)  # the same code on the same machine: to the last digit
