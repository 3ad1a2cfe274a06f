"""The show "sweep": sweeps that are killed, spread, counted, and over every kind of study.

Its cases are parts: kills of a run, a Dask cluster that loses a worker, one worker beside two, the
memory of ten thousand cases, and sweeps over an arm, a chain and a margin.
"""

from __future__ import annotations

import contextlib
import csv
import json
import os
import random
import signal
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.records import ROOT
from benchmarks.shows.show import Question, Row
from studies.common.configuration import read_toml, toml_text
from studies.common.console import Table, silent
from studies.sweep.cases.leases import Leases
from studies.sweep.cases.plan import plan
from studies.sweep.cases.store import CaseStore
from studies.sweep.config import study_from
from studies.sweep.driver import Driver
from studies.sweep.table import tabulate
from studies.sweep.workers.processes import LocalProcesses

LINE = "sweeps: kill -9, a Dask cluster that loses a worker, two workers, memory, all subjects"
LIMIT = 5400.0  # [s]
KILLS = 3
LONGEST = 3000.0  # [s] of one sweep

# 200 cases of the truss, each but the first also from its neighbour's motion
TRUSS: Mapping[str, Any] = {
    "warm": True,
    "coarse": True,
    "parameters": {
        "minimise": ["peak-acceleration", "energy"],
        "duration": {"low": 5.0, "high": 8.0, "count": 20},
        "truss.pulley_friction": [0.0, 0.01, 0.02, 0.03, 0.05],
    },
    "base": {"caps": {"jerk": "500/T^3"}},
}
PENDULUM: Mapping[str, Any] = {
    "duration": 0.05,
    "gravity": [0.0, -9.81],
    "elements": 1,
    "samples": 11,
    "frequencies": 0,
    "mesh_check": False,
    "link": [
        {
            "length": 1.2,
            "area": 0.0018,
            "second_moment": 1.215e-8,
            "modulus": 2e9,
            "density": 5540.0,
        }
    ],
    "joint": [{"kind": "free", "start_deg": 0.0}],
}


def question(seed: int, index: int) -> Question:
    """Return a part; the seed chooses the moments of the kills."""
    names = tuple(PARTS)
    return {"part": names[index % len(names)], "seed": seed}


def answer(question: Question, folder: Path) -> Row:
    """Do a part."""
    return dict(PARTS[question["part"]](question["seed"], folder))


def tables(rows: Sequence[Row]) -> list[Table]:
    """Return what each part found."""
    cells = [(row["part"], row["failure"] or row["words"]) for row in rows]
    return [Table("Sweeps", ("part", "found"), cells)]


def _kills(seed: int, folder: Path) -> Row:
    """200 cases, killed three times at random moments, beside an undisturbed run."""
    study, out = _written(TRUSS, folder), folder / "killed"
    moments = sorted(random.Random(seed).sample(range(5, 190), KILLS))
    kept: dict[str, Any] = {}
    again = 0
    for moment in moments:
        with _started(study, out, "--workers", "2") as run:
            _wait(run, lambda moment=moment: len(_files(out)) >= moment)
            run.send_signal(signal.SIGKILL)
            run.wait()
        found = _files(out)
        again += sum(found[name] != mark for name, mark in kept.items())
        kept = found
    _finished(study, out, "--workers", "2")
    again += sum(_files(out)[name] != mark for name, mark in kept.items())

    whole = folder / "whole"
    _finished(study, whole, "--workers", "2")
    difference, words = _compared(out, whole)
    return {
        "killed_at": moments,
        "computed_twice": again,
        "largest_difference": difference,
        "words": f"killed at {moments} cases, {again} finished ones computed again; {words}",
    }


def _dask(seed: int, folder: Path) -> Row:
    """200 cases on two Dask workers in processes of their own; one dies, another comes."""
    study, out, whole = _written(TRUSS, folder), folder / "dask", folder / "whole"
    kept: dict[str, Any] = {}  # each case's file, as it was when it was first seen

    def reached(count: int) -> bool:
        found = _files(out)
        for name, mark in found.items():
            kept.setdefault(name, mark)
        return len(found) >= count

    with _cluster() as (address, workers), _started(study, out, "--scheduler", address) as run:
        _wait(run, lambda: reached(50))
        _end(workers[0])
        _wait(run, lambda: reached(100))
        workers.append(_dask_process("worker", address))
        _wait(run, lambda: reached(1000))
    again = sum(mark != kept.get(name, mark) for name, mark in _files(out).items())
    _finished(study, whole, "--workers", "2")
    difference, words = _compared(out, whole)
    return {
        "computed_twice": again,
        "largest_difference": difference,
        "words": f"a worker killed after 50 cases, one added after 100, {again} finished cases "
        f"computed again; {words}",
    }


def _workers(seed: int, folder: Path) -> Row:
    """100 cases on one worker and on two, three times in turn."""
    content = {**TRUSS, "warm": False, "parameters": {**TRUSS["parameters"]}}
    content["parameters"]["minimise"] = ["peak-acceleration"]
    study = _written(content, folder)
    seconds: dict[int, list[float]] = {1: [], 2: []}
    for turn in range(3):
        for count in (1, 2):
            begin = time.monotonic()
            _finished(study, folder / f"{count}-{turn}", "--workers", str(count))
            seconds[count].append(time.monotonic() - begin)
    count = len(_rows(folder / "1-0"))
    ratios = [one / two for one, two in zip(seconds[1], seconds[2], strict=True)]
    return {
        "seconds": seconds,
        "load": os.getloadavg()[0],
        "words": f"two workers are {statistics.median(ratios):.2f} times faster than one "
        f"({', '.join(f'{ratio:.2f}' for ratio in ratios)}) on {count} cases",
    }


def _memory(seed: int, folder: Path) -> Row:
    """10,000 cases planned, 500 run; then listing, resuming and tabulating."""
    axes = {
        "joint.0.start_deg": {"low": -60.0, "high": 60.0},
        "link.0.length": {"low": 0.8, "high": 1.6},
    }
    content = {
        "subject": "flex",
        "sampling": "sobol",
        "samples": 10_000,
        "seed": seed,
        "parameters": axes,
        "base": PENDULUM,
    }
    study, out = _written(content, folder), folder / "out"
    peak, wanted = 0, 500
    with _started(study, out, "--workers", "2") as run:

        def reached() -> bool:
            nonlocal peak
            peak = max(peak, _peak_memory(run.pid))
            return len(_files(out)) >= wanted

        _wait(run, reached)
        run.send_signal(signal.SIGTERM)
        wanted = 10_000  # the same process makes the table, which counts, too
        _wait(run, reached)

    begin = time.process_time()
    planned = plan(study_from(read_toml(study)))
    listing = time.process_time() - begin
    store = CaseStore(out, planned.version)
    driver = Driver(planned, store, Leases(out), LocalProcesses(1), None, silent())
    begin = time.process_time()
    driver._sort()
    resuming = time.process_time() - begin
    begin = time.process_time()
    tabulate(planned, store)
    tabulating = time.process_time() - begin
    done = len(driver.done)
    total = listing / 10 + (resuming + tabulating) * 1000 / done
    return {
        "peak_megabytes": peak / 1024,
        "seconds_for_1000": total,
        "words": f"driver {peak / 1024:.0f} MB at most with {done} of 10000 cases; for 1000 cases "
        f"{listing / 10:.2f} s listing, {resuming * 1000 / done:.2f} s resuming, "
        f"{tabulating * 1000 / done:.2f} s tabulating (processor)",
    }


def _subjects(seed: int, folder: Path) -> Row:
    """Sweeps over an arm stage, a chain and a margin."""
    margin = {"preset": "aiaa-s-114"}
    studies: Mapping[str, Mapping[str, Any]] = {
        "arm": {
            "subject": "arm solve",
            "coarse": True,
            "show": ["peak_root_torque", "work"],
            "parameters": {"arm.tip_mass": [20.0, 30.0, 40.0]},
            "base": {"stage": "big"},
        },
        "flex": {
            "subject": "flex",
            "parameters": {"link.0.length": [1.0, 1.2, 1.4]},
            "base": {**PENDULUM, "duration": 1.0, "elements": 4, "samples": 101},
        },
        "margin": {
            "coarse": True,
            "parameters": {"margin.factors.net": [1.0, 1.5, 2.0]},
            "base": {
                "minimise": "peak-factored-force",
                "duration": 6.0,
                "caps": {"jerk": "500/T^3", "force": 200.0},
                "truss": {"pulley_friction": 0.01},
                "margin": margin,
            },
        },
    }

    found = []
    for name, content in studies.items():
        study = _written(content, folder, name)
        _finished(study, folder / f"out-{name}", "--workers", "2")
        rows = _rows(folder / f"out-{name}")
        solved = sum(row["status"] == "solved" for row in rows)
        found.append(f"{name}: {solved} of {len(rows)} solved")
    return {"words": "; ".join(found)}


PARTS = {
    "kills": _kills,
    "dask": _dask,
    "workers": _workers,
    "memory": _memory,
    "subjects": _subjects,
}


def _written(content: Mapping[str, Any], folder: Path, name: str = "study") -> Path:
    path = folder / f"{name}.toml"
    path.write_text(toml_text(content), "utf-8")
    return path


@contextlib.contextmanager
def _started(study: Path, out: Path, *flags: str) -> Iterator[subprocess.Popen[bytes]]:
    """A sweep in a process of its own, whose words go into a file beside its folder."""
    command = [sys.executable, "-m", "studies.cli", "sweep", str(study), "--results", str(out)]
    with out.with_suffix(".txt").open("ab") as words:
        run = subprocess.Popen(
            [*command, *flags],
            cwd=ROOT,
            stdout=words,
            stderr=words,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        try:
            yield run
        finally:
            if run.poll() is None:
                run.kill()
            run.wait()


def _finished(study: Path, out: Path, *flags: str) -> None:
    with _started(study, out, *flags) as run:
        _wait(run, lambda: False)


def _wait(run: subprocess.Popen[bytes], until: Any) -> None:
    """Wait until something is so, or the run has ended."""
    end = time.monotonic() + LONGEST
    while run.poll() is None and not until():
        if time.monotonic() > end:
            raise TimeoutError(f"a sweep lasted longer than {LONGEST:g} s")
        time.sleep(0.05)


def _files(out: Path) -> dict[str, tuple[int, int]]:
    """Each case's file, by what changes when it is written again."""
    found = (out / "cases").glob("*/*.jsonl")
    return {file.name: (file.stat().st_ino, file.stat().st_mtime_ns) for file in found}


def _rows(out: Path) -> list[dict[str, str]]:
    with (out / "cases.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _compared(out: Path, whole: Path) -> tuple[float, str]:
    """The largest relative difference of two tables, and what there is to say of it."""
    version = next(iter((whole / "cases").iterdir())).name
    largest, other = 0.0, 0
    first, second = _rows(out), _rows(whole)
    for one, two in zip(first, second, strict=True):
        same = ("status", "verdict", "file", "reason")
        other += any(one[name] != two[name] for name in same)
        other += _basin(out, version, one["file"]) != _basin(whole, version, two["file"])
        for name in one:
            if "[" in name and name != "seconds [s]" and one[name] and two[name]:
                a, b = float(one[name]), float(two[name])
                largest = max(largest, abs(a - b) / max(abs(a), abs(b), 1e-30))
    solved = sum(row["status"] == "solved" for row in first)
    return largest, (
        f"{solved} of {len(first)} solved; beside an undisturbed run {other} rows differ in "
        f"status or basin, numbers by {largest:.1e} at most"
    )


def _basin(out: Path, version: str, key: str) -> Any:
    with (out / "cases" / version / f"{key}.jsonl").open(encoding="utf-8") as file:
        return json.loads(file.readline()).get("basin")


def _peak_memory(process: int) -> int:
    """The most memory that a process has had [kB]; 0 where the system does not tell."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{process}/status").read_text("utf-8").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1])
    return 0


@contextlib.contextmanager
def _cluster() -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A Dask scheduler and two workers, each a process of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    scheduler = _dask_process("scheduler", "--host", "127.0.0.1", "--port", str(port))
    workers = [_dask_process("worker", address) for _ in range(2)]
    try:
        time.sleep(8.0)  # until they have found each other
        yield address, workers
    finally:
        for process in (*workers, scheduler):
            _end(process)


def _dask_process(kind: str, *words: str) -> subprocess.Popen[bytes]:
    alone = ["--nthreads", "1", "--no-nanny", "--no-dashboard"] if kind == "worker" else []
    return subprocess.Popen(
        [sys.executable, "-m", "dask", kind, *words, *alone],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
