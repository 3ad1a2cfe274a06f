"""Diagnostics of an answer: a second solve, what an excess is worth, and one that a user writes."""

import dataclasses
from functools import partial
from typing import Any

import numpy as np
import pytest

from ocp import (
    STANDARD,
    Bound,
    Control,
    FixedMesh,
    Gauss,
    HermiteSimpson,
    Ipopt,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    StatementError,
    certify,
    confirm,
    solve,
)
from tests.ocp.problems import (
    certified,
    check_of,
    dash,
    double_integrator,
    least_effort,
    solved_on,
)


def told(solution, **options):
    (finding,) = certify(solution, diagnostics=[partial(confirm, **options)]).checks
    return finding


@pytest.mark.parametrize("scheme", [Radau(), Gauss(), HermiteSimpson()])
def test_a_right_answer_is_confirmed_whatever_its_scheme(scheme):
    x, v, u, rates = double_integrator()
    speed = Bound("speed", v, upper=1.3)
    move = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0, bounds=[speed])
    problem = Problem("slow", move, minimise=move.integral(u**2))
    certificate = certify(solve(problem, settings=Settings(scheme=scheme)))
    assert certificate.confirmed, certificate
    assert certificate.start is None


def test_a_coarse_answer_is_refused_with_a_better_start():
    problem = least_effort(piecewise="constant")
    coarse = solved_on(5, problem)
    lost = coarse.objective / 12.0 - 1
    certificate = certify(coarse, diagnostics=[confirm])
    assert not certificate.passed
    assert certificate.checks[0].value == pytest.approx(lost, rel=0.5)
    # what it found is on its own mesh
    fixed = Settings(intervals=5, refinement=FixedMesh())
    again = solve(problem, settings=fixed, guess=certificate.start)
    assert again.objective == pytest.approx(coarse.objective, rel=1e-6)
    assert solve(problem, guess=certificate.start).objective < coarse.objective * (1 - 0.9 * lost)


def test_a_maximum_that_is_stationary_is_left_to_both_sides():
    """A motion that rests on a ridge, and gains by leaving it to either side."""
    y, a = State("y"), Control("a", lower=-3, upper=3)
    guess = {y: 0, a: 0}
    phase = Phase("ridge", {y: a}, {y: 0}, {y: 0}, end=2.0, guess=guess)
    problem = Problem("ridge", phase, minimise=phase.integral(0.1 * a**2 - y**2 + 0.2 * y**4))
    found = solve(problem, settings=Settings(refinement=FixedMesh()))
    certificate = certify(found, diagnostics=[confirm])
    assert certificate.confirmed == (found.objective < -1.0)  # and 0 on the ridge
    assert (certificate.start is None) == certificate.confirmed


@dataclasses.dataclass(frozen=True)
class Recording:
    """A solver of a user, which tells how it was started, and may change what came of it."""

    inner: Ipopt
    starts: list
    changes: Any

    def solve(self, program, start, limits, parameters, listener=None):
        self.starts.append((program, start))
        result = self.inner.solve(program, start, limits, parameters, listener)
        changes = self.changes(result) if callable(self.changes) else self.changes
        return dataclasses.replace(result, **changes)

    def within(self, iterations, seconds):
        return dataclasses.replace(self, inner=self.inner.within(iterations, seconds))

    def loosened(self, tolerance):
        return self

    def within_gap(self, gap):
        return self

    def alternatives(self, *, warm):
        return ()


def test_nothing_is_taken_over_but_the_motion():
    found = solve(dash())
    solver = Recording(Ipopt(), [], {})
    assert told(found, solver=solver).passed
    own = found.kept_iterate
    assert any(phase.movable for phase in own.mesh.phases)
    points = [start.x for _, start in solver.starts]
    assert all(start.multipliers is None for _, start in solver.starts)
    assert all(program.variables > 1.5 * own.x.size for program, _ in solver.starts)
    # beside the motion, to both sides
    assert len(points) == 2
    assert np.abs(points[0] - points[1]).max() > 1e-2


@pytest.mark.parametrize(
    ("outcome", "state"),
    [("failed", "open"), ("budget", "open"), ("infeasible", "failed"), ("unbounded", "failed")],
)
def test_what_comes_to_no_end_is_open_and_no_motion_beside_an_answer_refuses_it(outcome, state):
    finding = told(solve(least_effort()), solver=Recording(Ipopt(), [], {"outcome": outcome}))
    states = {"open": finding.open, "passed": finding.passed, "failed": finding.failed}
    assert [name for name, holds in states.items() if holds] == [state]
    assert state == "failed" or outcome in finding.sentence


def test_worse_motions_say_nothing():
    def worse(result):
        return {"x": 1.5 * result.x, "row_multipliers": 0.0 * result.row_multipliers}

    finding = told(solve(least_effort()), solver=Recording(Ipopt(), [], worse))
    assert finding.open
    assert "worse" in finding.sentence


def test_a_budget_leaves_it_open_and_the_certificate_unconfirmed():
    asked = [partial(confirm, seconds=1e-9) if one is confirm else one for one in STANDARD]
    certificate = certify(solve(least_effort()), diagnostics=asked)
    assert certificate.passed
    assert not certificate.confirmed
    assert "open  a second solve: no run from beside this motion" in str(certificate)
    assert [check.name for check in certificate.checks if check.open] == ["a second solve"]


def test_a_stop_of_the_user_stops_it():
    with pytest.raises(KeyboardInterrupt):
        told(solve(least_effort()), solver=Recording(Ipopt(), [], {"outcome": "interrupted"}))


def test_progress_is_told():
    lines = []
    told(solve(least_effort()), progress=lines.append)
    assert lines[0] == "least effort: a second solve, run 1"


@pytest.mark.parametrize(
    ("diagnostics", "words"),
    [
        (confirm, "diagnostics is one function; write a list"),
        ("confirm", "diagnostics is 'confirm'; give a list of functions"),
        ([1.0], r"diagnostics is \[1.0\]; give a list of functions"),
        ([lambda answer: None], "'<lambda>' gave None; let it yield Finding"),
        ([lambda answer: [0.5]], r"'<lambda>' gave \[0.5\]; let it yield Finding"),
    ],
)
def test_what_is_no_diagnostic_is_told(diagnostics, words):
    with pytest.raises(StatementError, match=words):
        certify(solve(least_effort()), diagnostics=diagnostics)


def landing(height, duration):
    """A mass that falls at 1 m/s from 0, and has to turn before a floor; then it is free to rise.

    The least effort is 4 / (9 height), with the jerk constant until the floor is touched at rest:
    A. E. Bryson and Y.-C. Ho, "Applied Optimal Control", sec. 3.11, one half of the symmetric
    motion, in which the integrand has a factor of one half.
    """
    x, v, u = State("x", "m", lower=-height), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("land", {x: v, v: u}, {x: 0, v: -1}, end=duration)
    return Problem("landing", phase, minimise=phase.integral(u**2))


@pytest.mark.parametrize("height", [1e-2, 1e-3, 1e-4])
def test_a_floor_far_smaller_than_the_motion_is_kept(height):
    found = certified(landing(height, 10.0), 4 / (9 * height))
    times = np.concatenate([np.linspace(0, 20 * height, 20_001), np.linspace(0, 10, 20_001)])
    # the worth of this excess is the same part of the effort
    assert -found.sample("x", times).min() == pytest.approx(height, rel=1e-5)


def test_the_worth_is_what_the_effort_changes_with_the_floor():
    """The effort is as one over the height, so that their changes are the same parts."""
    found = solved_on(10, landing(0.1, 2.0))
    deepest = -found.sample("x", np.linspace(0, 2, 20_001)).min()
    worth = check_of(found, "effect of the excess").value
    assert worth == pytest.approx(deepest / 0.1 - 1, rel=0.1)


def test_a_small_excess_of_much_worth_is_not_certified():
    found = solved_on(40, landing(1e-2, 10.0))
    assert check_of(found, "path constraints").value < 1e-5
    worth = check_of(found, "effect of the excess")
    assert worth.value > 1e-3
    assert not worth.passed
