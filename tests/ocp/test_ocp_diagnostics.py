"""Diagnostics of an answer: a second solve, and one that a user writes."""

import dataclasses
import math
from functools import partial
from typing import Any

import numpy as np
import pytest

from ocp import (
    STANDARD,
    Between,
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

x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")


def move(shape=None, limit=math.inf):
    """The least effort of a move from rest to rest: 12, and with a limit on the speed more."""
    push = u if shape is None else Control("push", "m/s^2", piecewise=shape)
    bounds = [Bound("speed", v, upper=limit)] if math.isfinite(limit) else []
    ends = {x: 0, v: 0}, {x: 1, v: 0}
    phase = Phase("move", {x: v, v: push}, *ends, end=1.0, bounds=bounds)
    return Problem("least effort", phase, minimise=phase.integral(push**2))


def told(solution, **options):
    (finding,) = certify(solution, diagnostics=[partial(confirm, **options)]).checks
    return finding


@pytest.mark.parametrize("scheme", [Radau(), Gauss(), HermiteSimpson()])
def test_a_right_answer_is_confirmed_whatever_its_scheme(scheme):
    certificate = certify(solve(move(limit=1.3), settings=Settings(scheme=scheme)))
    assert certificate.confirmed, certificate
    assert certificate.start is None


def test_a_coarse_answer_is_refused_with_a_better_start():
    settings = Settings(intervals=5, refinement=FixedMesh())
    problem = move("constant")
    coarse = solve(problem, settings=settings)
    lost = coarse.objective / 12.0 - 1
    certificate = certify(coarse, diagnostics=[confirm])
    assert not certificate.passed
    assert certificate.checks[0].value == pytest.approx(lost, rel=0.5)
    # what it found is on its own mesh
    again = solve(problem, settings=settings, guess=certificate.start)
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
    push = Control("push", "m/s^2", lower=-2, upper=1)
    ends = {x: 0, v: 0}, {x: 1, v: 0}
    dash = Phase("dash", {x: v, v: push}, *ends, end=Between(0.5, 5))
    found = solve(Problem("least time", dash, minimise=dash.duration))
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


@pytest.mark.parametrize("outcome", ["failed", "budget"])
def test_what_comes_to_no_end_is_open(outcome):
    found = solve(move())
    finding = told(found, solver=Recording(Ipopt(), [], {"outcome": outcome}))
    assert finding.open
    assert not finding.passed
    assert not finding.failed
    assert outcome in finding.sentence


@pytest.mark.parametrize("outcome", ["infeasible", "unbounded"])
def test_an_answer_without_a_motion_beside_it_is_refused(outcome):
    finding = told(solve(move()), solver=Recording(Ipopt(), [], {"outcome": outcome}))
    assert finding.failed


def test_worse_motions_say_nothing():
    def worse(result):
        return {"x": 1.5 * result.x, "row_multipliers": 0.0 * result.row_multipliers}

    finding = told(solve(move()), solver=Recording(Ipopt(), [], worse))
    assert finding.open
    assert "worse" in finding.sentence


def test_a_budget_leaves_it_open_and_the_certificate_unconfirmed():
    asked = [partial(confirm, seconds=1e-9) if one is confirm else one for one in STANDARD]
    certificate = certify(solve(move()), diagnostics=asked)
    assert certificate.passed
    assert not certificate.confirmed
    assert "open  a second solve: no run from beside this motion" in str(certificate)
    assert [check.name for check in certificate.checks if check.open] == ["a second solve"]


def test_a_stop_of_the_user_stops_it():
    with pytest.raises(KeyboardInterrupt):
        told(solve(move()), solver=Recording(Ipopt(), [], {"outcome": "interrupted"}))


def test_progress_is_told():
    lines = []
    told(solve(move()), progress=lines.append)
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
        certify(solve(move()), diagnostics=diagnostics)
