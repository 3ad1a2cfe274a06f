"""What a spent budget and Ctrl-C hand over, what it says of itself, and what counts as spent."""

import signal
import time
from dataclasses import replace

import casadi as ca
import pytest

from ocp import (
    TIME,
    Between,
    BudgetSpent,
    Control,
    Interrupted,
    Ipopt,
    IterationLimit,
    Phase,
    Problem,
    Settings,
    State,
    load,
    save,
    solve,
)
from ocp.refinement import mesh_solver
from ocp.transcription.kernels import Program


def following():
    """A signal that few intervals do not follow."""
    x, u = State("x"), Control("u")
    phase = Phase("follow", {x: u - x**3}, {x: 0}, end=20.0)
    return Problem("follow", [phase], minimise=phase.integral((x - ca.sin(TIME**2)) ** 2 + u**2))


def swing():
    """An oscillator that stops in least time; its switches lie between the points."""
    x, v, u = State("x"), State("v"), Control("u", lower=-1, upper=1)
    ends = {x: 1, v: 0}, {x: 0, v: 0}
    phase = Phase("swing", {x: v, v: u - x**3}, *ends, end=Between(1, 9, 3), guess={u: 0})
    return Problem("swing", [phase], minimise=phase.end_time)


OPTIMUM = 1.7630295896  # on meshes of 4 to 13 intervals, all the same
FEW = Settings(intervals=4)


def stopped_in(mesh_iteration, **how):
    """The answer to Ctrl-C in a mesh iteration."""

    def stop(line):
        if f"mesh iteration {mesh_iteration} " in line:
            signal.raise_signal(signal.SIGINT)

    return solve(swing(), settings=FEW, progress=stop, **how)


def test_ctrl_c_hands_over_the_best_motion_and_what_it_is_accurate_to():
    found = stopped_in(2)
    assert found.interrupted
    assert len(found.mesh_iterations) == 2
    error = abs(found.objective - OPTIMUM) / OPTIMUM
    assert 1e-6 < error < found.accuracy <= 1e-2
    assert f"accurate to {found.accuracy:.1e}; you stopped the refinement" in found.verdict
    assert not found.verification.passed  # not to what was asked for


def test_a_finished_solution_says_what_it_is_accurate_to():
    found = solve(swing())
    assert not found.interrupted
    assert found.verification.passed
    assert 0 < found.accuracy < 1e-5


def test_a_stopped_solution_is_kept_in_a_file_as_such(tmp_path):
    found = stopped_in(2)
    save(found, tmp_path / "stopped")
    again = load(tmp_path / "stopped")
    assert again.interrupted
    assert (again.accuracy, again.verdict) == (found.accuracy, found.verdict)


def test_who_asks_for_it_gets_an_error_with_what_was_reached():
    with pytest.raises(Interrupted, match="'swing' was stopped in mesh iteration 2") as caught:
        stopped_in(2, partial=False)
    assert caught.value.finished is not None


def test_a_second_ctrl_c_ends_at_once():
    def stop(line):
        if "mesh iteration 2 " in line:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        solve(swing(), settings=FEW, progress=stop)


def test_a_spent_budget_hands_over_the_best_motion():
    first = solve(swing(), settings=FEW).mesh_iterations[0].iterations
    found = solve(swing(), settings=replace(FEW, iterations=first + 1))
    assert not found.interrupted
    assert abs(found.objective - OPTIMUM) / OPTIMUM < found.accuracy <= 1e-2
    assert f"the budget of {first + 1} iterations ended the refinement" in found.verdict


def test_what_nobody_can_trust_is_no_solution():
    with pytest.raises(BudgetSpent, match="errors between the points were still") as caught:
        solve(following(), settings=Settings(intervals=2, iterations=20))
    assert caught.value.finished is not None


def test_the_functions_of_a_program_are_built_within_the_seconds(monkeypatch):
    prepare = Program.prepare

    def slowly(program):
        time.sleep(0.3)
        prepare(program)

    monkeypatch.setattr(Program, "prepare", slowly)
    assert solve(following(), settings=Settings(solver=Ipopt(seconds=30)))
    with pytest.raises(IterationLimit):
        solve(following(), settings=Settings(solver=Ipopt(seconds=0.25)))


def test_no_mesh_is_begun_that_cannot_be_examined_in_time(monkeypatch):
    estimate_errors = mesh_solver.estimate_errors

    def slowly(*arguments):
        time.sleep(1.2)
        return estimate_errors(*arguments)

    monkeypatch.setattr(mesh_solver, "estimate_errors", slowly)
    with pytest.raises(BudgetSpent, match="ended in mesh iteration 1 "):
        solve(following(), settings=Settings(seconds=2))
