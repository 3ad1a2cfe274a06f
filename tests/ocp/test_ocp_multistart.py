"""Audits of several starts: what they find, one by one or side by side, and how they stop."""

import dataclasses
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ocp import (
    Accuracy,
    Between,
    Control,
    Infeasible,
    Interrupted,
    Phase,
    Problem,
    Settings,
    SolveFailed,
    State,
    StatementError,
    Unknown,
    audit,
    noted_interrupts,
    solve,
)
from ocp.analysis import multistart
from tests.ocp.problems import cubic_oscillator, least_effort, rest_to_rest

FEW = Settings(intervals=5)


def valley(guess=0.9):
    """Two valleys of k at -1 and 1, the left one deeper by 0.4, beside least effort of 12.

    A motion is guessed, so that a solve stays in the valley of the guessed k.
    """
    x, _, u, phase = rest_to_rest()
    k = Unknown("k", lower=-2, upper=2, guess=guess)
    phase = dataclasses.replace(phase, guess={x: (0, 1)})
    return Problem("valley", [phase], minimise=phase.integral(u**2) + beside(k))


def beside(k):
    """What the objective has beside the effort."""
    return (k**2 - 1) ** 2 + 0.2 * k


# stationary points that are minima
LEFT, RIGHT = sorted(k for k in np.roots([4, 0, -4, 0.2]).real if 12 * k**2 - 4 > 0)
SIDES = {"right": valley(0.9), "left": valley(-0.9)}
ONE = {"processes": 1, "settings": FEW}


@pytest.mark.parametrize("processes", [1, 2])
def test_both_valleys_are_found(processes):
    problem = valley()
    found = audit(problem, starts=5, seed=1, processes=processes, settings=FEW)
    for optimum, value in zip(found.optima, (LEFT, RIGHT), strict=True):
        assert optimum.solution.value("k") == pytest.approx(value, abs=1e-6)
        assert optimum.objective == pytest.approx(12 + beside(value), rel=1e-8)
    assert "stated guess" in found.optima[1].starts
    agreed = len(found.optima[0].starts)
    assert (
        found.verdict == f"local: best of 5 starts ({agreed} agree, {5 - agreed} ended elsewhere)"
    )
    assert found.best.verdict == found.verdict
    # what comes back from another process speaks of the caller's symbols
    assert found.best.problem is problem
    assert found.best.sample("x", 0.5) == pytest.approx(0.5, rel=1e-6)
    assert set(found.best.sensitivities()) == set(solve(problem, settings=FEW).sensitivities())
    assert f"{found.optima[1].objective:.10g} from" in str(found)


def test_starts_are_repeated_by_their_seed():
    one, two = (audit(valley(), starts=3, seed=4, **ONE) for _ in range(2))
    assert [o.starts for o in one.optima] == [o.starts for o in two.optima]
    assert one.best.value("k") == two.best.value("k")


def test_an_audit_ends_where_its_starts_are_enough():
    found = audit(valley(), starts=5, enough=lambda trials: len(trials) == 2, **ONE)
    assert len(found.trials) == 2


def test_guesses_of_ones_own_come_after_the_stated_one():
    found = audit(valley(), starts=1, **ONE)
    assert found.verdict == "local: best of 1 starts (1 agree)"
    again = audit(found.best.problem, starts=2, guesses=[found.best], **ONE)
    assert again.optima[0].starts == ("stated guess", "guess 1")
    assert again.optima[0].distance == 0.0


def test_a_bound_that_a_value_lies_beyond_is_refuted():
    found = audit(valley(), starts=2, seed=1, bound=1000.0, **ONE)
    assert found.verdict.startswith("local")
    assert "the bound of 1000 is refuted by" in found.verdict


@pytest.mark.slow
def test_when_all_fail_the_stated_guess_tells_why():
    x, u = State("x", "m"), Control("u", "m/s", upper=1)
    phase = Phase("far", {x: u}, {x: 0}, {x: 2}, end=Between(0.5, 1))
    problem = Problem("far", [phase], minimise=phase.end_time)
    with pytest.raises(Infeasible, match=r"'far'.*; largest violations: dynamics of 'x'"):
        audit(problem, starts=2, processes=2, settings=FEW)
    with pytest.raises(StatementError, match="0 starts"):
        audit(problem, starts=0)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_stopped_audit_hands_back_the_best_until_then(processes):
    def stop(trial):
        raise KeyboardInterrupt

    others = set(multiprocessing.active_children())
    found = audit(valley(), starts=3, processes=processes, settings=FEW, finished=stop)
    assert found.interrupted
    assert [trial.name for trial in found.trials] == ["stated guess"]
    assert found.best.verification.passed
    assert found.verdict == "local: best of 1 starts (1 agree); stopped by the user"
    assert not set(multiprocessing.active_children()) - others


@pytest.mark.parametrize("method", [None, "spawn"])
def test_each_start_may_be_a_problem_a_guess_or_a_function(method, monkeypatch):
    if method:
        monkeypatch.setattr(multiprocessing, "get_start_method", lambda **_: method)
    problem = valley()
    right = solve(problem, settings=FEW)
    starts = {
        "problem": valley(-0.9),
        "solution": right,
        "function": lambda: right.trajectory,
        "function of a problem": lambda: valley(0.8),
    }
    processes = 2 if method else 1
    found = audit(problem, starts=starts, processes=processes, settings=FEW)
    assert [trial.name for trial in found.trials] == list(starts)
    assert [optimum.starts for optimum in found.optima] == [
        ("problem",),
        ("solution", "function", "function of a problem"),
    ]
    assert found.best.value("k") == pytest.approx(LEFT, abs=1e-6)
    # what comes back refers to the problem that was given
    assert found.trials[0].solution.problem is starts["problem"]
    assert found.trials[1].solution.problem is problem


UNGUARDED = """
import multiprocessing, sys
from ocp import Control, Phase, Problem, State, StatementError, audit
multiprocessing.set_start_method("spawn", force=True)
x, u = State("x"), Control("u")
phase = Phase("p", {x: u}, {x: 0}, {x: 1}, end=1.0)
try:
    audit(Problem("least effort", phase, minimise=phase.integral(u**2)), starts=3, processes=2)
except StatementError as error:
    sys.exit(str(error))
"""


def test_a_script_without_a_guard_is_told_so_where_processes_are_spawned(tmp_path):
    script = tmp_path / "unguarded.py"
    script.write_text(UNGUARDED)
    done = subprocess.run((sys.executable, script), capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (1, "")
    # nothing but the sentence: no traceback of a process that was started
    (sentence,) = done.stderr.splitlines()
    assert "below if __name__ == '__main__':" in sentence
    assert "processes=1" in sentence


def test_a_process_that_ends_early_is_told_in_a_sentence(monkeypatch):
    # forked processes have the module as it is here
    monkeypatch.setattr(multiprocessing, "get_start_method", lambda **_: "fork")
    monkeypatch.setattr("ocp.analysis.worker_processes.solve", lambda *_, **__: os._exit(9))
    with pytest.raises(SolveFailed, match=r"ended without a result.*processes=1"):
        audit(valley(), starts=2, processes=2, settings=FEW)


def test_a_bound_that_is_met_ends_the_audit():
    asked = []

    def bound():
        asked.append("bound")
        return 12 + beside(LEFT)

    def unneeded():
        raise AssertionError

    starts = {
        "right": valley(),
        "left": lambda: asked.append("left") or valley(-0.9),
        "more": unneeded,
    }
    found = audit(starts=starts, settings=FEW, bound=bound, bound_gap=1e-6)
    assert asked == ["bound", "left"]  # the bound once, after the first start
    assert [trial.name for trial in found.trials] == ["right", "left"]
    assert found.verdict.startswith("global: bound met (gap ")


def test_values_of_ones_own_are_compared():
    found = audit(starts=SIDES, settings=FEW, value=lambda problem, solution: -solution.objective)
    assert [optimum.starts for optimum in found.optima] == [("right",), ("left",)]
    assert found.optima[0].value == -found.optima[0].objective
    alike = audit(starts=SIDES, settings=FEW, same=0.1)
    assert [optimum.starts for optimum in alike.optima] == [("right", "left")]


def test_a_start_that_fails_is_one_failure():
    class Trouble(Exception):
        """Of a function that gives a start."""

    def trouble():
        raise Trouble("no such start")

    starts = {"bad": trouble, "good": valley()}
    found = audit(starts=starts, settings=FEW, failures=(Trouble,))
    assert found.failures == (("bad", "Trouble: no such start"),)
    assert found.verdict == "local: best of 2 starts (1 agree, 1 failed)"
    with pytest.raises(Trouble):
        audit(starts=starts, settings=FEW)
    with pytest.raises(StatementError, match="the start 'bad' is of type int; give a Problem"):
        audit(valley(), starts={"bad": 3}, settings=FEW)
    with pytest.raises(StatementError, match="'bad' is a guess without a problem"):
        audit(starts={"bad": solve(valley(), settings=FEW)}, settings=FEW)


def test_an_unverified_answer_counts_only_if_there_is_no_other():
    # a replay is never as good as 1e-300, so that no answer passes
    strict = dataclasses.replace(FEW, accuracy=Accuracy(replay=1e-300))
    found = audit(starts={"right": valley()}, settings=strict)
    assert found.verdict.startswith("unverified: ")
    assert found.best.objective == pytest.approx(12.2, abs=0.1)
    assert found.trials[0].error is not None


def test_a_stopped_start_hands_over_what_it_has_and_later_ones_are_left_out():
    # the signal comes in the second mesh iteration of the second start
    def interrupting(line):
        if "start 2 of 3" in line and "mesh iteration 2" in line:
            os.kill(os.getpid(), signal.SIGINT)

    starts = {"one": Between(1, 9, 3), "two": Between(1, 9, 4), "three": Between(1, 9, 5)}
    named = {name: cubic_oscillator(end) for name, end in starts.items()}
    found = audit(starts=named, processes=1, settings=FEW, progress=interrupting)
    assert found.interrupted
    assert [trial.name for trial in found.trials] == ["one", "two"]
    assert found.trials[1].solution is not None
    assert found.verdict.endswith("; stopped by the user")


def test_an_audit_that_is_stopped_before_anything_is_found_says_so():
    with pytest.raises(Interrupted, match="'valley' was stopped before it found a solution"):
        audit(valley(), starts=2, progress=lambda _: os.kill(os.getpid(), signal.SIGINT), **ONE)


def test_starts_of_an_earlier_run_are_not_solved_again():
    problem = valley()
    first = audit(problem, starts=3, seed=1, **ONE)
    told = []
    known = {trial.name: trial for trial in first.trials[:2]}
    known["random 2"] = lambda: None  # damaged: it has to be solved
    again = audit(problem, starts=3, seed=1, known=known, progress=told.append, **ONE)
    assert [trial.solution for trial in again.trials[:2]] == [t.solution for t in first.trials[:2]]
    assert again.trials[2].value == pytest.approx(first.trials[2].value, rel=1e-9)
    assert not any("stated guess" in line for line in told)
    assert any("random 2" in line for line in told)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_budget_of_all_starts_leaves_the_late_ones_out(processes, monkeypatch):
    problem, skipped = valley(), []  # [s]
    ahead = SimpleNamespace(perf_counter=lambda: time.perf_counter() + sum(skipped))
    monkeypatch.setattr(multistart, "clock", ahead)

    def slow():
        skipped.append(601.0)  # longer than the budget
        return problem

    starts = {"first": problem, "slow": slow, "late": problem, "later": problem}
    found = audit(starts=starts, processes=processes, settings=FEW, seconds=600.0)
    assert [trial.name for trial in found.trials] == ["first"]
    with pytest.raises(StatementError, match="'seconds' is 0"):
        audit(problem, starts=2, seconds=0)


ROOT = Path(__file__).parent.parent.parent


def effort(name):
    """Least effort of 12 from rest to rest, under a name."""
    return dataclasses.replace(least_effort(), name=name)


@pytest.fixture
def interruptible():
    """Ctrl-C raises an error, as it does at a prompt."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


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
@pytest.mark.usefixtures("interruptible")
def test_what_has_ended_is_kept_when_the_user_stops(forked, name):
    interrupts = []

    def interrupt(line):
        # the third start begins when the second has ended
        if "start 3" in line and ("stubborn" in line or not interrupts):
            interrupts.append(line)
            os.kill(os.getpid(), signal.SIGINT)

    starts = {"first": effort(name), "second": effort("quick"), "third": effort(name)}
    found = audit(starts=starts, processes=2, settings=FEW, progress=interrupt)
    assert found.interrupted
    assert found.verdict.endswith("; stopped by the user")
    assert found.best.objective == pytest.approx(12, rel=1e-6)
    verified = [trial.name for trial in found.trials if trial.error is None]
    assert verified == ["second"]
    # one that stops at the first Ctrl-C says so; at the second one it is ended
    others = {} if "stubborn" in name else dict.fromkeys(("first", "third"))
    assert {name for name, why in found.failures} == set(others)
    assert all("'slow' was stopped" in why for _, why in found.failures)


@pytest.mark.usefixtures("interruptible")
def test_a_stop_after_the_last_start_was_solved_is_handed_on(monkeypatch):
    """It comes too late for the solver, as during the verification, yet it stops what follows."""

    def late(problem, **given):
        found = solve(problem, **given)
        os.kill(os.getpid(), signal.SIGINT)
        return found

    monkeypatch.setattr("ocp.analysis.worker_processes.solve", late)
    found = audit(starts={"only": effort("only")}, processes=1, settings=FEW)
    assert found.interrupted
    assert found.best.objective == pytest.approx(12, rel=1e-6)


@pytest.mark.usefixtures("interruptible")
def test_what_a_stopped_start_had_reached_is_kept():
    interrupts = []

    def interrupt(line):
        if "mesh iteration 2" in line and not interrupts:
            interrupts.append(line)
            os.kill(os.getpid(), signal.SIGINT)

    starts = {f"start {k}": cubic_oscillator(2.0 + k, effort=True) for k in range(6)}
    found = audit(starts=starts, processes=2, settings=FEW, progress=interrupt)
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
