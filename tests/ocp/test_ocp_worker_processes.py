"""Starts of an audit side by side: their lines of progress, and how they are stopped."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ocp import (
    Control,
    Interrupted,
    Phase,
    Problem,
    Settings,
    State,
    audit,
    noted_interrupts,
    solve,
)

FEW = Settings(intervals=5)
ROOT = Path(__file__).parent.parent.parent


def effort(name):
    """Least effort of 12 from rest to rest, under a name."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    return Problem(name, phase, minimise=phase.integral(u**2))


@pytest.fixture
def forked(monkeypatch):
    """Processes that have the functions of this one, where those named "slow" do not end."""
    monkeypatch.setattr(multiprocessing, "get_start_method", lambda **_: "fork")

    def waiting(problem, **given):
        if "slow" not in problem.name:
            return solve(problem, **given)
        with noted_interrupts() as interrupts:
            for _ in range(6000):
                time.sleep(0.01)
                given["progress"](f"{problem.name} in {os.getpid()}")
                if interrupts.asked and problem.name == "slow":
                    raise Interrupted("'slow' was stopped")
        raise AssertionError

    monkeypatch.setattr("ocp.analysis.worker_processes.solve", waiting)


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_lines_of_progress_come_from_the_processes(method, monkeypatch):
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip("the platform cannot fork")
    monkeypatch.setattr(multiprocessing, "get_start_method", lambda **_: method)
    told = []
    audit(
        starts={name: effort(f"effort {name}") for name in ("a", "b", "c")},
        processes=2,
        settings=FEW,
        progress=told.append,
    )
    for number, name in enumerate("abc", start=1):
        begin = f"start {number} of 3 ({name}): effort {name}: mesh iteration 1 (5 intervals), "
        lines = [k for k, line in enumerate(told) if line.startswith(begin)]
        assert max(lines) < told.index(f"{name} done, {number} of 3 starts")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the platform cannot fork")
def test_processes_that_are_not_waited_for_end_without_a_word(forked, capfd):
    def stop(number, frame):
        raise KeyboardInterrupt

    former = signal.signal(signal.SIGTERM, stop)  # as the command has it
    try:
        begin = time.monotonic()
        found = audit(
            starts={"quick": effort("quick"), "other": effort("slow")},
            processes=2,
            settings=FEW,
            progress=lambda line: None,
            # what a terminal sends to all is for this process
            finished=lambda _: [
                os.kill(p.pid, signal.SIGINT) for p in multiprocessing.active_children()
            ],
            enough=lambda _: time.sleep(0.2) is None,
        )
        assert time.monotonic() - begin < 30  # the other one would take 60 s
        assert [trial.name for trial in found.trials] == ["quick"]
    finally:
        signal.signal(signal.SIGTERM, former)
    assert capfd.readouterr().err == ""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the platform cannot fork")
@pytest.mark.parametrize("name", ["slow", "slow and stubborn"])
def test_what_has_ended_is_kept_when_the_user_stops(forked, name):
    interrupts = []

    def interrupt(line):
        # the third start begins when the second has ended
        if "start 3" in line and ("stubborn" in line or not interrupts):
            interrupts.append(line)
            os.kill(os.getpid(), signal.SIGINT)

    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        found = audit(
            starts={"first": effort(name), "second": effort("quick"), "third": effort(name)},
            processes=2,
            settings=FEW,
            progress=interrupt,
        )
    finally:
        signal.signal(signal.SIGINT, former)
    assert found.interrupted
    assert found.verdict.endswith("; stopped by the user")
    assert found.best.objective == pytest.approx(12, rel=1e-6)
    verified = [trial.name for trial in found.trials if trial.error is None]
    assert verified == ["second"]
    # one that stops at the first Ctrl-C says so; at the second one it is ended
    others = {} if "stubborn" in name else dict.fromkeys(("first", "third"))
    assert {name for name, why in found.failures} == set(others)
    assert all("'slow' was stopped" in why for _, why in found.failures)


def test_a_stop_after_the_last_start_was_solved_is_handed_on(monkeypatch):
    """It comes too late for the solver, as during the verification, yet it stops what follows."""

    def late(problem, **given):
        found = solve(problem, **given)
        os.kill(os.getpid(), signal.SIGINT)
        return found

    monkeypatch.setattr("ocp.analysis.worker_processes.solve", late)
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        found = audit(starts={"only": effort("only")}, processes=1, settings=FEW)
    finally:
        signal.signal(signal.SIGINT, former)
    assert found.interrupted
    assert found.best.objective == pytest.approx(12, rel=1e-6)


def test_what_a_stopped_start_had_reached_is_kept():
    interrupts = []

    def interrupt(line):
        if "mesh iteration 2" in line and not interrupts:
            interrupts.append(line)
            os.kill(os.getpid(), signal.SIGINT)

    def oscillator(start):
        x, v, u = State("x"), State("v"), Control("u", lower=-1, upper=1)
        phase = Phase("swing", {x: v, v: u - x**3}, {x: 1, v: 0}, {x: 0, v: 0}, end=start)
        return Problem("swing", phase, minimise=phase.integral(u**2))

    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        found = audit(
            starts={f"start {k}": oscillator(2.0 + k) for k in range(6)},
            processes=2,
            settings=FEW,
            progress=interrupt,
        )
    finally:
        signal.signal(signal.SIGINT, former)
    assert found.interrupted
    # which mesh it had reached is chance, and the first one holds between its points to 1e-5
    assert found.best.verification.miss < 1e-4


SCRIPT = """
import multiprocessing, os, sys, time
import ocp.analysis.worker_processes
from ocp import Control, Phase, Problem, State, audit

def endless(problem, **given):
    print(os.getpid(), flush=True)
    time.sleep(60)

multiprocessing.set_start_method("fork")
ocp.analysis.worker_processes.solve = endless
x, u = State("x"), Control("u")
phase = Phase("p", {x: u}, {x: 0}, {x: 1}, end=1.0)
audit(Problem("least effort", phase, minimise=phase.integral(u**2)), starts=2, processes=2)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="what they are is read in /proc")
def test_processes_end_when_who_waits_for_them_is_killed():
    running = subprocess.Popen(
        (sys.executable, "-c", SCRIPT),
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    processes = [int(running.stdout.readline()) for _ in range(2)]
    running.kill()
    running.communicate(timeout=30)  # which ends when nobody can write any more
    for process in processes:
        assert ended(process)


def ended(process):
    """Whether a process has ended, or does so soon; nobody may have asked yet what became of it."""
    for _ in range(1000):
        try:
            status = Path(f"/proc/{process}/status").read_text()
        except (FileNotFoundError, ProcessLookupError):
            return True
        if "\nState:\tZ" in status:
            return True
        time.sleep(0.01)
    return False
