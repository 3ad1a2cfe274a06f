"""What finer controls promise, and where the promise counts."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ocp import (
    Between,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    certify,
    solve,
)
from ocp.estimates.promised_gain import PhaseGains, promised_gain
from ocp.optimality.active_set import strongest_multipliers


def moved(minimise, end):
    """A distance of 1 m from rest to rest."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-10, upper=20)
    phase = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=end)
    problem = Problem("move", [phase], minimise=minimise(phase, u))
    return solve(problem, settings=Settings(intervals=7, refinement=FixedMesh()))


def telling(solution, *, acting):
    iterate = solution.kept_iterate
    strongest = np.full(iterate.trajectory.phases[0].intervals, float(acting))
    return PhaseGains.of(iterate, solution.evaluator, 0, strongest).telling


def test_a_coarse_switch_promises_about_what_its_place_gains():
    fastest = moved(lambda phase, u: phase.end_time, end=Between(0.1, 5.0))
    # from 20 to -10 m/s^2 at one third: the square root of 2 s (1/20 + 1/10)
    gained = fastest.objective / np.sqrt(0.3) - 1.0
    assert gained > 1e-3
    iterate = fastest.kept_iterate
    promised = promised_gain(iterate, fastest.evaluator, strongest_multipliers(iterate))
    assert promised == pytest.approx(gained, rel=0.1)
    # a control on its bound is one that it may have to leave: there the promise counts
    assert telling(fastest, acting=True).all()


def test_a_promise_is_noise_where_a_control_is_smooth_and_a_constraint_acts():
    easiest = moved(lambda phase, u: phase.integral(u**2), end=1.0)
    assert telling(easiest, acting=False).all()
    assert not telling(easiest, acting=True).any()


def slow_move(*, with_pump):
    """A distance of 1 m below a speed limit, beside a tank that a pump fills all the time."""
    x, v, u = State("x", "m"), State("v", "m/s", upper=1.2), Control("u", "m/s^2")
    level, pump = State("level"), Control("pump", lower=0.0, upper=1.0)
    dynamics, start = {x: v, v: u}, {x: 0, v: 0}
    if with_pump:
        dynamics, start = dynamics | {level: pump}, start | {level: 0}
    phase = Phase("move", dynamics, start, {x: 1, v: 0}, end=1.0)
    effort = phase.integral(u**2)
    problem = Problem(
        "slow move", [phase], minimise=effort - phase.at_end(level) if with_pump else effort
    )
    # odd, so that the arc begins inside an interval
    fixed = Settings(intervals=11, scheme=Radau(4), refinement=FixedMesh(), verify=False)
    return solve(problem, settings=fixed)


def test_a_control_on_its_bound_makes_no_noise_of_another_one_tell():
    alone, beside = slow_move(with_pump=False), slow_move(with_pump=True)
    assert beside.objective == pytest.approx(alone.objective - 1.0, rel=1e-7)
    promised = []
    for solution in (alone, beside):
        iterate = solution.kept_iterate
        strongest = strongest_multipliers(iterate)
        gains = PhaseGains.of(iterate, solution.evaluator, 0, strongest[0])
        promised.append(gains.told.sum() * iterate.objective_size)
        # what the speed limit leaves between its points is there in both
        assert gains.anywhere.sum() > 2.0 * gains.told.sum()
    assert promised[1] == pytest.approx(promised[0], rel=1e-2, abs=1e-9)


def test_a_limit_that_the_start_lies_on_does_not_hide_the_peak():
    """A panel that a spring opens and a rope holds back, from rest at its stop."""

    def rate_of(q, w, tension):
        return (6 * (2.2 - q) + 1.5 - 0.4 * w - 0.3 * tension * ca.cos(q / 2)) / 8

    def farthest(tension):
        """Where it comes to rest under a constant tension, by SciPy."""

        def stops(t, state):
            return state[1] + (t < 0.2)

        stops.terminal = True
        motion = solve_ivp(
            lambda t, y: [y[1], rate_of(*y, tension)],
            (0, 60),
            [0, 0],
            events=stops,
            rtol=1e-11,
            atol=1e-12,
        )
        return motion.y[0, -1]

    least = brentq(lambda tension: farthest(tension) - np.pi / 2, 30, 44)
    q, w = State("angle", "rad", lower=0), State("rate", "rad/s", lower=0)
    rope = Control("rope", "N", lower=0, upper=40)
    panel = Phase(
        "open",
        {q: w, w: rate_of(q, w, rope)},
        initial={q: 0, w: 0},
        final={q: np.pi / 2, w: (0, 0.05)},
        end=30.0,
    )
    found = solve(Problem("panel", panel, minimise=panel.peak(rope)))
    assert found.objective == pytest.approx(least, rel=1e-7)
    assert found.mesh_iterations[-1].intervals < 100
    assert certify(found).passed
