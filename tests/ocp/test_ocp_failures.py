"""Failed solves say what is wrong, and never pass for a solution."""

import dataclasses
import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Accuracy,
    AdaptiveMesh,
    Between,
    Bound,
    Collapsed,
    Control,
    FixedMesh,
    Infeasible,
    InvalidNumber,
    Ipopt,
    IterationLimit,
    Phase,
    Problem,
    Radau,
    Settings,
    SolveFailed,
    State,
    Unverified,
    solve,
)

FEW = Settings(intervals=5)


def pushed():
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-1, upper=1)
    return x, v, u, Phase("flight", {x: v, v: u}, initial={x: 0, v: 0}, end=1.0)


def test_an_unreachable_target_names_the_worst_constraint():
    # from rest with 1 m/s^2 at most 1/2 m in 1 s
    x, v, u, _ = pushed()
    phase = Phase("flight", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 2}, end=1.0)
    words = (
        r"no motion.*all constraints of 'too far'; worst: dynamics of '[xv]' in phase 'flight' at "
        r"\d\.\d+ s is off by .* m(/s)?; .*relax a limit or a prescribed value"
    )
    with pytest.raises(Infeasible, match=words) as caught:
        solve(Problem("too far", [phase], minimise=phase.integral(u**2)), settings=FEW)
    assert caught.value.iterate is not None


def test_contradicting_links_are_named():
    x, _, u, phase = pushed()
    far = Bound("far enough", phase.at_end(x), unit="m", lower=2)
    with pytest.raises(Infeasible, match=r"'far enough'|dynamics of '[xv]'"):
        solve(Problem("far", [phase], minimise=phase.integral(u**2), bounds=[far]), settings=FEW)


def test_an_unbounded_objective_is_a_failure():
    x, free = State("x"), Control("u")
    phase = Phase("flight", {x: free}, initial={x: 0}, end=1.0)
    with pytest.raises(SolveFailed, match=r"'endless'") as caught:
        solve(
            Problem("endless", [phase], minimise=phase.at_end(x)),
            settings=Settings(intervals=5, solver=Ipopt(max_iterations=200)),
        )
    assert not isinstance(caught.value, Unverified)


def test_a_used_up_budget_is_a_failure():
    x, _, _, phase = pushed()
    settings = Settings(intervals=5, solver=Ipopt(max_iterations=1))
    with pytest.raises(IterationLimit, match=r"'short' used up.*1 iterations.*raise the budget"):
        solve(Problem("short", [phase], maximise=phase.at_end(x)), settings=settings)


NOWHERE = r" is NaN or infinite at 0 s \(in (sqrt|log)\(\(x-5\)\)\), where .*x = 0 m; start from"
NOT_A_NUMBER = {
    "dynamics": (
        lambda x, v, u: ({x: v, v: u + ca.sqrt(x - 5)}, ()),
        r"the derivative of 'v' in phase 'flight'",
    ),
    "path constraint": (
        lambda x, v, u: ({x: v, v: u}, (Bound("log height", ca.log(x - 5), upper=3),)),
        r"'log height' in phase 'flight'",
    ),
}


@pytest.mark.parametrize("where", NOT_A_NUMBER)
def test_an_invalid_number_is_traced_to_its_expression(where):
    make, words = NOT_A_NUMBER[where]
    x, v, u, _ = pushed()
    rates, bounds = make(x, v, u)
    phase = Phase("flight", rates, initial={x: 0, v: 0}, bounds=bounds, end=1.0)
    with pytest.raises(InvalidNumber, match=words + NOWHERE):
        solve(Problem("undefined", [phase], maximise=phase.at_end(x)), settings=FEW)


@pytest.mark.parametrize("running", [True, False])
def test_an_invalid_objective_is_traced(running):
    x, _, _, phase = pushed()
    objective = phase.integral(ca.sqrt(x - 5)) if running else ca.log(phase.at_end(x) - 5)
    what = "integrand of 'integral' in phase 'flight'" if running else "objective"
    with pytest.raises(InvalidNumber, match=f"'undefined': the {what} is NaN or infinite"):
        solve(Problem("undefined", [phase], minimise=objective), settings=FEW)


def coarse(**options):
    """A nonlinear problem on a mesh that is far too coarse for it."""
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-1, upper=1)
    rates = {x: v, v: u - 4 * ca.sin(x)}
    phase = Phase("swing", rates, initial={x: 1, v: 0}, end=3)
    settings = Settings(scheme=Radau(2), intervals=6, **options)
    return Problem("swing", [phase], maximise=phase.at_end(x)), settings


def test_a_coarse_answer_is_unverified():
    problem, settings = coarse(refinement=AdaptiveMesh(rounds=1))
    with pytest.raises(Unverified, match=r"'swing'.*replay misses.*more mesh iterations") as caught:
        solve(problem, settings=settings)
    found = caught.value.iterate
    assert found.verdict == "unverified"
    assert not found.verification.passed
    assert found.verification.miss > settings.accuracy.replay
    assert any("replay misses" in reason for reason in found.verification.reasons)


def test_without_refinement_the_verification_is_there_to_read():
    problem, settings = coarse(refinement=FixedMesh())
    found = solve(problem, settings=settings)
    assert not found.verification.passed
    loose = dataclasses.replace(settings, accuracy=Accuracy(replay=1e9, dynamics=1e9))
    assert solve(problem, settings=loose).verification.passed


def test_a_polynomial_control_keeps_its_bounds_between_the_points():
    # interpolation of degree 6 through a bang-bang law would overshoot by more than a tenth
    x, v = State("x"), State("v")
    u = Control("u", lower=-1, upper=1, piecewise="polynomial")
    phase = Phase("dash", {x: v, v: u}, initial={x: 0, v: 0}, final={v: 0}, end=1)
    problem = Problem("overshoot", [phase], maximise=phase.at_end(x))
    settings = Settings(scheme=Radau(6), intervals=1, refinement=FixedMesh())
    values = solve(problem, settings=settings).sample(u, np.linspace(0, 1, 1001))
    assert np.ptp(values) > 1.0  # it does switch
    assert np.abs(values).max() <= 1 + 1e-9  # round-off of the interpolation


def test_a_least_time_without_a_limit_of_the_force_collapses():
    x, v, free = State("x", "m"), State("v", "m/s"), Control("force", "N")
    rest = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    phase = Phase("push", {x: v, v: free / 2}, **rest, end=Between(0, 10))
    with pytest.raises(Collapsed, match=r"motion of 'push' shrinks to .* bound what drives it"):
        solve(Problem("push", phase, minimise=phase.end_time))


@pytest.mark.parametrize("longest", [1.0, 1000.0])
def test_a_least_time_that_nothing_limits_collapses_at_once(longest):
    x, u = State("x", "m"), Control("u", "m/s")
    phase = Phase("dash", {x: u}, {x: 0}, {x: 1}, end=Between(0, longest))
    with pytest.raises(Collapsed, match=r"motion of 'dash' shrinks to .* bound what drives it"):
        solve(Problem("dash", phase, minimise=phase.end_time))


def test_a_solved_motion_is_short_by_its_own_times_and_not_by_wide_limits():
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")

    def approach(longest):
        phase = Phase("approach", {x: v, v: u - v}, {x: 0, v: 0}, end=Between(0, longest))
        cost = phase.integral(u**2) + 0.1 * phase.end_time + (phase.at_end(x) - 1) ** 2
        return solve(Problem("approach", phase, minimise=cost)).objective

    assert approach(1e8) == pytest.approx(approach(20.0), rel=1e-7)


def test_a_failed_motion_is_short_by_its_own_times_and_not_by_wide_limits():
    x, v = State("x", "m"), State("v", "m/s")
    push = Control("push", "m/s^2", lower=-1e4, upper=1e4)
    rest = {"initial": {x: 0, v: 0}, "final": {x: 1e-3, v: 0}}
    phase = Phase("fast", {x: v, v: push}, **rest, end=Between(0, 1e5))
    solution = solve(Problem("fast", phase, minimise=phase.end_time))
    assert solution.objective == pytest.approx(2.0 * math.sqrt(1e-7), rel=1e-6)


@pytest.mark.slow
def test_unknowns_that_ran_away_beyond_all_rows_say_nothing_of_the_objective():
    """Dido's problem: a straight guess has no slope of its length, and the first run is lost."""
    x, u = State("x", "m"), Control("u")
    phase = Phase("rope", {x: u}, {x: 0}, {x: 0}, end=1.0)
    length = Bound("length", phase.integral(ca.sqrt(1 + u**2)), lower=1.2, upper=1.2)
    solution = solve(Problem("dido", phase, maximise=phase.integral(x), bounds=[length]))
    # an arc of a circle over a chord of 1
    low, high = 0.1, 3.0
    for _ in range(60):
        half = (low + high) / 2
        low, high = (half, high) if half < 1.2 * math.sin(half) else (low, half)
    radius = 0.6 / half
    area = radius**2 * half - radius * math.cos(half) / 2
    assert solution.objective == pytest.approx(area, rel=1e-7)
