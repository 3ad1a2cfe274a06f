"""One small problem with a known answer for each kind of thing a statement can say."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from ocp import (
    TIME,
    Between,
    Bound,
    Constant,
    Control,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    Unknown,
    solve,
    with_objective,
)
from tests.ocp.problems import double_integrator, least_effort, rest_to_rest

SOLVED = 1e-8  # the solver's tolerance of 1e-10 on scaled rows, times multipliers up to 100
FEW = Settings(intervals=6)


def test_an_unknown_in_a_polynomial_cost():
    x, centre = State("x"), Unknown("centre", "s", lower=-5, upper=5)
    phase = Phase("spread", {x: (TIME - centre) ** 2}, initial={x: 0}, end=1.0)
    found = solve(Problem("variance", [phase], minimise=phase.at_end(x)), settings=FEW)
    assert found.objective == pytest.approx(1 / 12, rel=SOLVED)  # variance on [0, 1]
    assert found.value(centre) == pytest.approx(0.5, abs=1e-6)  # flat minimum: a root of SOLVED


def test_data_are_weighted():
    # a constant through 1 and 3 with weights 1 and 3 is 2.5, at a misfit of 1.5^2 + 3 * 0.5^2
    x = State("x")
    phase = Phase("still", {x: 0 * x}, end=1.0)
    misfit = phase.misfit(x, [0.25, 0.75], [1, 3], weights=[1, 3])
    found = solve(Problem("mean", [phase], minimise=misfit), settings=FEW)
    assert found.objective == pytest.approx(3.0, rel=SOLVED)
    assert found.sample(x, 0.5) == pytest.approx(2.5, rel=1e-6)  # flat minimum
    with pytest.raises(StatementError, match=r"2 times, 1 values.*as many values as times"):
        phase.misfit(x, [0.1, 0.2], [1])
    with pytest.raises(StatementError, match=r"1\.5 s lies outside phase 'still'"):
        phase.misfit(x, 1.5, 0.0)


def capped_effort(r):
    """Peak and effort of 1 m in 1 s: thrust p, then a line to -p in r s, then -p."""
    p = 12 / (3 - r**2)
    return p, p**2 * (1 - 2 * r / 3)


def test_a_peak_is_bounded():
    _, _, u, phase = rest_to_rest()
    cap = Bound("cap", phase.peak(u, absolute=True), "m/s^2", upper=5)
    found = solve(Problem("capped", [phase], minimise=phase.integral(u**2), bounds=[cap]))
    assert found.objective == pytest.approx(capped_effort(math.sqrt(0.6))[1], rel=1e-5)
    assert np.abs(found.sample(u, np.linspace(0, 1, 10_000))).max() <= 5 * (1 + 1e-7)


def test_a_weighted_sum_of_peak_and_effort():
    _, _, u, phase = rest_to_rest()
    cost = phase.peak(u, absolute=True) + 0.1 * phase.integral(u**2)
    found = solve(Problem("both", [phase], minimise=cost))

    def least(r):
        top, effort = capped_effort(r)
        return top + 0.1 * effort

    best = minimize_scalar(least, bounds=(0, 1), options={"xatol": 1e-10})
    assert found.objective == pytest.approx(best.fun, rel=1e-5)


def test_a_free_initial_time():
    # 12 / T^3 + T is least for T^4 = 36
    x, v, u, rates = double_integrator()
    start = Between(-9, 0)
    phase = Phase("move", rates, {x: 0, v: 0}, {x: 1, v: 0}, start=start, end=1.0)
    cost = phase.integral(u**2) + phase.duration
    found = solve(Problem("early", [phase], minimise=cost), settings=FEW)
    assert found.value(phase.start_time) == pytest.approx(1 - 36**0.25, rel=1e-6)  # flat minimum
    assert found.objective == pytest.approx(4 / 3 * 36**0.25, rel=SOLVED)


def test_a_nonlinear_function_of_an_integral():
    _, _, u, phase = rest_to_rest()
    effort = phase.integral(u**2)
    found = solve(Problem("squared", [phase], minimise=(1 + effort) ** 2), settings=FEW)
    assert found.objective == pytest.approx(13.0**2, rel=SOLVED)
    assert found.value(effort) == pytest.approx(12.0, rel=SOLVED)


@pytest.mark.parametrize("distance", [1.0, 3.0])
def test_constants_change_boundary_values(distance):
    target = Constant("target", "m", 1.0)
    found = solve(least_effort(target), settings=FEW, constants={target: distance})
    assert found.objective == pytest.approx(12 * distance**2, rel=SOLVED)
    assert found.value(2 * target) == 2 * distance


def test_constants_change_bounds_of_signals_and_numbers():
    x, most, least = State("x", "m"), Constant("most", "m/s", 1.0), Constant("least", "s", 0.5)
    u = Control("u", "m/s", lower=-most, upper=most)
    phase = Phase("run", {x: u}, initial={x: 0}, end=1.0)
    effort = Bound("b", phase.integral(u), upper=least)
    problem = Problem("run", [phase], maximise=phase.at_end(x), bounds=[effort])
    assert solve(problem, settings=FEW).objective == pytest.approx(0.5, rel=SOLVED)
    changed = solve(problem, settings=FEW, constants={most: 3.0, least: 9.0})
    assert changed.objective == pytest.approx(3.0, rel=SOLVED)


def test_running_time_does_not_start_at_zero():
    x = State("x")
    phase = Phase("late", {x: 3 * TIME**2}, initial={x: 1}, start=2.0, end=3.0)
    found = solve(Problem("cube", [phase], minimise=phase.at_end(x)), settings=FEW)
    assert found.value(phase.at_end(x)) == pytest.approx(1 + 27 - 8, rel=SOLVED)
    assert found.sample(TIME, [2.0, 2.5]) == pytest.approx([2.0, 2.5])


def test_the_same_phases_with_another_objective():
    x, v, u, rates = double_integrator()
    phase = Phase("move", rates, initial={x: 0, v: 0}, final={x: 1}, end=1.0)
    problem = Problem("move", [phase], minimise=phase.integral(u**2))
    assert solve(problem, settings=FEW).objective == pytest.approx(3.0, rel=SOLVED)
    stop = Bound("stop", phase.at_end(v), lower=0, upper=0)
    stopped = with_objective(problem, phase.integral(u**2), [stop])
    assert solve(stopped, settings=FEW).objective == pytest.approx(12.0, rel=SOLVED)


def test_a_proven_bound_is_reported():
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("run", {x: u}, initial={x: 0}, end=1.0)
    problem = Problem("run", [phase], maximise=phase.at_end(x))
    assert solve(problem, settings=FEW, bound=1.0).verdict.startswith("global: bound met")
    assert solve(problem, settings=FEW, bound=2.0).verdict.startswith("local")
    # the value lies beyond it, so that it is no bound
    verdict = solve(problem, settings=FEW, bound=0.5).verdict
    assert verdict == (
        "local: best of 1 start; the bound of 0.5 is refuted by 1; not confirmed (ocp.certify)"
    )


def test_progress_is_told_and_can_stop_the_solve():
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("run", {x: ca.sin(u)}, initial={x: 0}, end=1.0)
    problem = Problem("run", [phase], maximise=phase.at_end(x))
    told = []
    found = solve(problem, settings=FEW, progress=told.append)
    assert found.objective == pytest.approx(math.sin(1), rel=1e-6)
    assert "run: mesh iteration 1 (6 intervals), iteration 0" in told[0]
    assert found.iterations == sum(r.iterations for r in found.mesh_iterations)

    class Enough(Exception):
        pass

    def stop(line):
        raise Enough(line)

    with pytest.raises(Enough, match="iteration 0"):
        solve(problem, settings=FEW, progress=stop)


def test_a_ratio_of_two_integrals_is_minimised():
    """Cauchy and Schwarz: the integral of u^2 by the square of that of u is 1 for a constant u."""
    x, u = State("x"), Control("u", lower=0.5, upper=2)
    phase = Phase("run", {x: u}, initial={x: 0}, final={x: (0.5, 2)}, end=1.0, guess={u: 1.5})
    squares, sums = phase.integral(u**2, "squares"), phase.integral(u, "sums")
    found = solve(Problem("ratio", phase, minimise=squares / sums**2), settings=FEW)
    assert found.objective == pytest.approx(1.0, rel=1e-8)
