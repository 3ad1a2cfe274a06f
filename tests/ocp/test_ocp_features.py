"""One small problem with a known answer for each kind of thing a statement can say."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from ocp import (
    TIME,
    Algebraic,
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
    joined,
    solve,
    solve_lexicographic,
    with_objective,
)

SOLVED = 1e-8  # the solver's tolerance of 1e-10 on scaled rows, times multipliers up to 100
FEW = Settings(intervals=6)


def double_integrator(**options):
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    return x, v, u, {x: v, v: u}


def test_an_unknown_decay_rate():
    x, rate = State("x"), Unknown("rate", "1/s", lower=0, upper=5)
    phase = Phase("decay", {x: -rate * x}, initial={x: 1.0}, end=1.0)
    problem = Problem(
        "half-life", [phase], minimise=rate, bounds=[Bound("half", phase.at_end(x), upper=0.5)]
    )
    found = solve(problem, settings=FEW)
    assert found.value(rate) == pytest.approx(math.log(2), rel=SOLVED)
    assert found.trajectory.unknowns["rate"] == found.value(rate)


def test_an_unknown_in_a_polynomial_cost():
    x, centre = State("x"), Unknown("centre", "s", lower=-5, upper=5)
    phase = Phase("spread", {x: (TIME - centre) ** 2}, initial={x: 0}, end=1.0)
    found = solve(Problem("variance", [phase], minimise=phase.at_end(x)), settings=FEW)
    assert found.objective == pytest.approx(1 / 12, rel=SOLVED)  # variance on [0, 1]
    assert found.value(centre) == pytest.approx(0.5, abs=1e-6)  # flat minimum: a root of SOLVED


def test_a_fit_to_measurements_at_given_instants():
    x, rate = State("x"), Unknown("rate", "1/s", lower=0, upper=5)
    phase = Phase("decay", {x: -rate * x}, end=2.0)
    instants = np.array([0.1, 0.3, 0.75, 1.21, 1.9])
    data = 1.3 * np.exp(-0.8 * instants)
    found = solve(Problem("fit", [phase], minimise=phase.misfit(x, instants, data)))
    # exact data: the squared misfit vanishes, its root is known to the root of the tolerance
    assert found.value(rate) == pytest.approx(0.8, abs=1e-5)
    assert found.value(phase.at_start(x)) == pytest.approx(1.3, abs=1e-5)
    np.testing.assert_allclose(found.sample(x, instants), data, atol=1e-5)
    assert set(np.round(instants, 9)) <= set(np.round(found.breakpoints, 9))


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
    x, v, u, rates = double_integrator()
    phase = Phase("move", rates, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    cap = Bound("cap", phase.peak(u, absolute=True), "m/s^2", upper=5)
    found = solve(Problem("capped", [phase], minimise=phase.integral(u**2), bounds=[cap]))
    assert found.objective == pytest.approx(capped_effort(math.sqrt(0.6))[1], rel=1e-5)
    assert np.abs(found.sample(u, np.linspace(0, 1, 10_000))).max() <= 5 * (1 + 1e-7)


def test_a_weighted_sum_of_peak_and_effort():
    x, v, u, rates = double_integrator()
    phase = Phase("move", rates, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    cost = phase.peak(u, absolute=True) + 0.1 * phase.integral(u**2)
    found = solve(Problem("both", [phase], minimise=cost))
    best = minimize_scalar(
        lambda r: capped_effort(r)[0] + 0.1 * capped_effort(r)[1],
        bounds=(0, 1),
        method="bounded",
        options={"xatol": 1e-10},
    )
    assert found.objective == pytest.approx(best.fun, rel=1e-5)


def test_a_free_initial_time():
    # 12 / T^3 + T is least for T^4 = 36
    x, v, u, rates = double_integrator()
    phase = Phase(
        "move", rates, initial={x: 0, v: 0}, final={x: 1, v: 0}, start=Between(-9, 0), end=1.0
    )
    cost = phase.integral(u**2) + phase.duration
    found = solve(Problem("early", [phase], minimise=cost), settings=FEW)
    assert found.value(phase.start_time) == pytest.approx(1 - 36**0.25, rel=1e-6)  # flat minimum
    assert found.objective == pytest.approx(4 / 3 * 36**0.25, rel=SOLVED)


def test_a_jump_of_a_state_between_phases():
    # half of the speed is lost at 1 s; 60/37 by elimination of the two cubic pieces' costs
    # 4 (3 d^2 - 3 d v + v^2) with respect to position and speed before the jump
    x, v, u, rates = double_integrator()
    first = Phase("first", rates, initial={x: 0, v: 0}, start=0, end=1)
    second = Phase("second", rates, final={x: 1, v: 0}, start=1, end=2)
    found = solve(
        Problem(
            "bump",
            [first, second],
            minimise=first.integral(u**2) + second.integral(u**2),
            links=joined(first, second, jump={v: 0.5 * v}),
        ),
        settings=FEW,
    )
    assert found.objective == pytest.approx(60 / 37, rel=SOLVED)
    assert found.value(first.at_end(v)) == pytest.approx(36 / 37, rel=1e-6)  # flat minimum
    assert found.value(second.at_start(v)) == pytest.approx(18 / 37, rel=1e-6)
    assert found.sample(v, 1.0) == pytest.approx(18 / 37, rel=1e-6)  # the later phase answers
    assert found.sample(v, 1.0, first) == pytest.approx(36 / 37, rel=1e-6)


def test_a_budget_of_effort_bounds_an_integral():
    # x(1) = int (1 - t) u dt is at most sqrt(1/3) with int u^2 = 1 (Cauchy-Schwarz)
    x, v, u, rates = double_integrator()
    phase = Phase("throw", rates, initial={x: 0, v: 0}, end=1.0)
    problem = Problem(
        "throw",
        [phase],
        maximise=phase.at_end(x),
        bounds=[Bound("effort", phase.integral(u**2), upper=1)],
    )
    found = solve(problem, settings=FEW)
    assert found.objective == pytest.approx(math.sqrt(1 / 3), rel=SOLVED)
    times = np.linspace(0, 1, 11)
    np.testing.assert_allclose(found.sample(u, times), math.sqrt(3) * (1 - times), atol=1e-6)


def test_a_nonlinear_function_of_an_integral():
    x, v, u, rates = double_integrator()
    phase = Phase("move", rates, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    effort = phase.integral(u**2)
    found = solve(Problem("squared", [phase], minimise=(1 + effort) ** 2), settings=FEW)
    assert found.objective == pytest.approx(13.0**2, rel=SOLVED)
    assert found.value(effort) == pytest.approx(12.0, rel=SOLVED)


@pytest.mark.parametrize("distance", [1.0, 3.0])
def test_constants_change_boundary_values(distance):
    x, v, u, rates = double_integrator()
    target = Constant("target", "m", 1.0)
    phase = Phase("move", rates, initial={x: 0, v: 0}, final={x: target, v: 0}, end=1.0)
    problem = Problem("move", [phase], minimise=phase.integral(u**2))
    found = solve(problem, settings=FEW, constants={target: distance})
    assert found.objective == pytest.approx(12 * distance**2, rel=SOLVED)
    assert found.value(2 * target) == 2 * distance


def test_constants_change_bounds_of_signals_and_numbers():
    x, most, least = State("x", "m"), Constant("most", "m/s", 1.0), Constant("least", "s", 0.5)
    u = Control("u", "m/s", lower=-most, upper=most)
    phase = Phase("run", {x: u}, initial={x: 0}, end=1.0)
    effort = phase.integral(u)
    problem = Problem(
        "run", [phase], maximise=phase.at_end(x), bounds=[Bound("b", effort, upper=least)]
    )
    assert solve(problem, settings=FEW).objective == pytest.approx(0.5, rel=SOLVED)
    changed = solve(problem, settings=FEW, constants={most: 3.0, least: 9.0})
    assert changed.objective == pytest.approx(3.0, rel=SOLVED)


def test_running_time_in_a_cost():
    # int (1 + t) u^2 with int u = 1 over 2 s: u = c / (1 + t), optimum 1 / ln 3
    x, u = State("x"), Control("u")
    phase = Phase("weighted", {x: u}, initial={x: 0}, final={x: 1}, end=2.0)
    found = solve(Problem("weighted", [phase], minimise=phase.integral((1 + TIME) * u**2)))
    assert found.objective == pytest.approx(1 / math.log(3), rel=1e-7)  # dynamics tolerance


def test_running_time_does_not_start_at_zero():
    x = State("x")
    phase = Phase("late", {x: 3 * TIME**2}, initial={x: 1}, start=2.0, end=3.0)
    found = solve(Problem("cube", [phase], minimise=phase.at_end(x)), settings=FEW)
    assert found.value(phase.at_end(x)) == pytest.approx(1 + 27 - 8, rel=SOLVED)
    assert found.sample(TIME, [2.0, 2.5]) == pytest.approx([2.0, 2.5])


def test_an_algebraic_signal_follows_its_equation():
    # x' = -z with z + z^3 = x: t = int dx / z = int (1/z + 3 z) dz, so
    # ln(z0/z1) + 3/2 (z0^2 - z1^2) = 1
    x, z = State("x"), Algebraic("z", lower=0)
    law = Bound("law", z + z**3 - x, lower=0, upper=0)
    phase = Phase("decay", {x: -z}, initial={x: 1}, bounds=[law], guess={z: 0.5}, end=1.0)
    found = solve(Problem("implicit", [phase], minimise=phase.at_end(x)), settings=FEW)
    start = float(np.real(np.roots([1, 0, 1, -1])[-1]))
    end = found.value(phase.at_end(z))
    assert found.value(phase.at_start(z)) == pytest.approx(start, rel=1e-6)  # extrapolated
    assert math.log(start / end) + 1.5 * (start**2 - end**2) == pytest.approx(1, rel=1e-6)


def test_the_same_phases_with_another_objective():
    x, v, u, rates = double_integrator()
    phase = Phase("move", rates, initial={x: 0, v: 0}, final={x: 1}, end=1.0)
    problem = Problem("move", [phase], minimise=phase.integral(u**2))
    assert solve(problem, settings=FEW).objective == pytest.approx(3.0, rel=SOLVED)
    stopped = with_objective(
        problem, phase.integral(u**2), [Bound("stop", phase.at_end(v), lower=0, upper=0)]
    )
    assert solve(stopped, settings=FEW).objective == pytest.approx(12.0, rel=SOLVED)


def test_first_the_end_then_the_effort():
    # |u| <= 1 from rest: at most 1/2 m in 1 s, and only with full thrust; with a slack of a
    # thousandth some effort can be saved
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-1, upper=1)
    phase = Phase("push", {x: v, v: u}, initial={x: 0, v: 0}, end=1.0)
    problem = Problem("push", [phase], maximise=phase.at_end(x))
    found = solve_lexicographic(
        problem, [-phase.at_end(x), phase.integral(u**2)], slack=1e-3, settings=FEW
    )
    assert found.solution.value(phase.at_end(x)) == pytest.approx(0.5 * (1 - 1e-3), rel=1e-6)
    assert 0.9 < found.solution.objective < 1.0


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
