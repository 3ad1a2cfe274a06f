"""Objectives in order of importance: concessions, terms beside, and nothing that is lost."""

import os
import signal

import pytest

from ocp import (
    Control,
    Phase,
    Problem,
    Settings,
    SolveFailed,
    State,
    StatementError,
    solve,
    solve_lexicographic,
    with_objective,
)

FEW = Settings(intervals=6)


def push():
    """From rest with |u| <= 1: at most 1/2 m in 1 s."""
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-1, upper=1)
    phase = Phase("push", {x: v, v: u}, {x: 0, v: 0}, end=1.0)
    return Problem("push", phase, maximise=phase.at_end(x)), phase, x, u


def test_each_objective_has_its_own_concession():
    problem, phase, x, u = push()
    end, effort = phase.at_end(x), phase.integral(u**2)
    found = solve_lexicographic(
        problem, [-end, effort, -phase.at_start(u)], slack=[1e-2, 1e-1, 0.0], settings=FEW
    )
    first, second, third = found.levels
    assert first.value == pytest.approx(-0.5, rel=1e-6)
    assert first.held == pytest.approx(-0.5 * (1 - 1e-2), rel=1e-6)
    assert second.held == pytest.approx(1.1 * second.value)
    assert third.held is None
    assert found.solution is third.solution
    assert found.solution.value(end) >= 0.495 * (1 - 1e-6)
    assert found.solution.value(effort) <= second.held * (1 + 1e-6)


def test_a_solution_of_the_first_objective_is_not_solved_again():
    problem, phase, x, u = push()
    first = solve(with_objective(problem, -phase.at_end(x)), settings=FEW)
    found = solve_lexicographic(
        problem, [-phase.at_end(x), phase.integral(u**2)], slack=1e-2, first=first, settings=FEW
    )
    assert found.levels[0].solution is first
    assert found.solution.value(phase.at_end(x)) == pytest.approx(0.495, rel=1e-5)


def test_terms_beside_are_not_held():
    # a heavy price of effort shortens the way, and only the way that is left is held
    problem, phase, x, u = push()
    effort = phase.integral(u**2)
    found = solve_lexicographic(
        problem, [-phase.at_end(x), effort], beside=[effort, 0], slack=1e-6, settings=FEW
    )
    # u = (1 - t) / 2 costs 1/12 and goes 1/6 m
    assert found.levels[0].value == pytest.approx(-1 / 6, rel=1e-6)
    assert found.solution.value(phase.at_end(x)) == pytest.approx(1 / 6, rel=1e-5)


def test_a_later_objective_that_fails_keeps_what_was_found():
    problem, phase, x, u = push()
    few = Settings(intervals=6, iterations=1)
    objectives = [-phase.at_end(x), phase.integral(u**2)]
    found = solve_lexicographic(problem, objectives, slack=1e-2, settings=[FEW, few])
    assert found.solution is found.levels[0].solution
    assert isinstance(found.levels[1].error, SolveFailed)
    assert not found.interrupted
    assert "failed" in repr(found)
    with pytest.raises(SolveFailed):
        solve_lexicographic(problem, objectives, settings=few)


def test_an_interruption_keeps_what_was_found():
    problem, phase, x, u = push()

    def interrupting(line):
        if line.startswith("objective 2 of 3"):
            os.kill(os.getpid(), signal.SIGINT)

    objectives = [-phase.at_end(x), phase.integral(u**2), phase.at_end(x)]
    found = solve_lexicographic(problem, objectives, settings=FEW, progress=interrupting)
    assert found.interrupted
    assert len(found.levels) == 2
    assert found.solution.value(phase.at_end(x)) == pytest.approx(0.5, rel=1e-6)


def test_as_many_of_everything_as_objectives():
    problem, phase, x, _ = push()
    for wrong in ({"slack": [0.1]}, {"settings": [FEW]}, {"beside": [0.0]}):
        with pytest.raises(StatementError, match="has 1 entries for 2 objectives; give one for"):
            solve_lexicographic(problem, [-phase.at_end(x), phase.at_end(x)], **wrong)
    with pytest.raises(StatementError, match="no keyword 'slak'; did you mean 'slack'"):
        solve_lexicographic(problem, [-phase.at_end(x)], slak=0.1)


@pytest.mark.parametrize("slack", [1e-1, 1e-3])
def test_exchanged_roles_give_the_same_motion(monkeypatch, slack):
    # a solver that has one iteration under the limit goes astray at once
    problem, phase, x, u = push()
    objectives = [-phase.at_end(x), phase.integral(u**2)]
    direct = solve_lexicographic(problem, objectives, slack=slack, settings=FEW)
    monkeypatch.setattr("ocp.analysis.lexicographic._PATIENCE", 1)
    exchanged = solve_lexicographic(problem, objectives, slack=slack, settings=FEW)

    level = exchanged.levels[1]
    assert exchanged.solution.verification.passed
    assert exchanged.solution.value(objectives[0]) <= exchanged.levels[0].held * (1 + 1e-6)
    # at most a twentieth of the concession is unused; the effort falls with its square root
    assert level.value == pytest.approx(direct.levels[1].value, rel=0.05)
    assert level.value >= direct.levels[1].value * (1 - 1e-5)
    assert 0.0 < level.gap < 1.0


def test_objectives_that_do_not_contend_leave_no_room(monkeypatch):
    problem, phase, x, _ = push()
    v = problem.phases[0].states[1]
    monkeypatch.setattr("ocp.analysis.lexicographic._PATIENCE", 1)
    objectives = [-phase.at_end(x), -phase.at_end(v)]
    found = solve_lexicographic(problem, objectives, slack=1e-3, settings=FEW)
    assert found.solution.value(phase.at_end(v)) == pytest.approx(1.0, rel=1e-6)
    assert found.levels[1].gap == 0.0
