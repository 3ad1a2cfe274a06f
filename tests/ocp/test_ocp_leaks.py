"""Leaks between the points: rounds that close them step by step, and what an objective may miss."""

import math
from itertools import pairwise

import numpy as np
import pytest

from ocp import (
    TIME,
    Accuracy,
    AdaptiveMesh,
    Bound,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    State,
    peak,
    solve,
)
from ocp.numerics.piecewise_polynomial import Extremes
from ocp.refinement.planning import mean_excess

# A mass of 1 kg moves 1 m from rest to rest in 3 s and brakes by at most 1 m/s^2. At full power P
# its speed is sqrt(2 P t), so that the force begins with a pole, beside which each point that is
# added leaks to its side. It then brakes for v seconds: 2 v - v^2 / 6 = 1, P = v^2 / (2 (3 - v)).
SPEED = 6 - math.sqrt(30)
LEAST = SPEED**2 / (2 * (3 - SPEED))


def least_power():
    x, v = State("x", "m"), State("v", "m/s", lower=0)
    u = Control("u", "m/s^2", lower=-1)
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=3.0)
    return Problem("power", move, minimise=peak((move, u * v)))


def test_rounds_that_close_a_leak_step_by_step_do_not_count():
    rounds = 8
    refinement = AdaptiveMesh(rounds=rounds, move_breakpoints=False)
    accuracy = Accuracy(objective=1e-3)
    found = solve(least_power(), settings=Settings(accuracy=accuracy, refinement=refinement))
    assert found.verification.passed
    # no breakpoint may move onto the instant at which the brake begins
    assert found.objective == pytest.approx(LEAST, rel=1e-3)
    assert found.objective > LEAST

    # those beyond the number have the intervals of one before them
    sizes = [iteration.intervals for iteration in found.mesh_iterations]
    assert len(sizes) > rounds
    assert sum(after == before for before, after in pairwise(sizes)) >= len(sizes) - rounds


@pytest.mark.parametrize("asked", [1e-3, 1e-4])
def test_what_the_mesh_loses_along_an_arc_is_no_more_than_asked(asked):
    # all but the brake is one arc at full power, on which multipliers sit at points
    settings = Settings(
        accuracy=Accuracy(objective=asked), refinement=AdaptiveMesh(move_breakpoints=False)
    )
    found = solve(least_power(), settings=settings)
    assert 0.0 <= found.objective / LEAST - 1.0 <= asked
    last = found.mesh_iterations[-1]
    assert 0.2 <= (found.objective / LEAST - 1.0) / last.gain <= 5.0  # what is promised is true


@pytest.mark.parametrize(("path", "passed"), [(1e-3, True), (1e-4, True), (1e-5, False)])
def test_an_objective_may_miss_what_its_peak_may_leak(path, passed):
    x, v, a = State("x", "m"), State("v", "m/s"), State("a", "m/s^2")
    jerk = Control("j", "m/s^3", -40.0, 40.0)
    rest = {v: 0.0, a: 0.0}
    phase = Phase(
        "move",
        dynamics={x: v, v: a, a: jerk},
        initial={x: 0.0, **rest},
        final={x: 1.0, **rest},
        end=1.0,
    )
    settings = Settings(intervals=15, refinement=FixedMesh(), accuracy=Accuracy(path=path))
    solution = solve(Problem("jerk", [phase], minimise=phase.peak(a)), settings=settings)
    found = solution.verification
    # between its points the acceleration is higher, and it is the objective
    assert 1e-4 < found.replayed_objective / solution.objective - 1.0 < 1e-3
    assert found.passed is passed


@pytest.mark.parametrize("peak", [0.51237, 0.4])
def test_an_excess_is_a_part_of_the_scale_that_is_stated(peak):
    """A hill of height 1 over a parabola of hundreds: both at rest at 0, touched once.

    A motion that has the height g at time t takes the effort 3 g^2 / (t (1 - t))^3 at least, and
    the height at t is 1 - 400 (t - c)^2.
    """
    x, v, u = State("x"), State("v"), Control("u")
    hill = Bound("hill", x - 1 + 400 * (TIME - peak) ** 2, lower=0, scale=1)
    rest = {x: 0, v: 0}
    phase = Phase("over", {x: v, v: u}, initial=rest, final=rest, end=1.0, bounds=[hill])
    found = solve(Problem("over", phase, minimise=phase.integral(u**2)))

    t = np.linspace(0, 1, 100_001)
    height = 1 - 400 * (t - peak) ** 2
    assert (height - found.sample(x, t)).max() < 1e-6
    inside = t[np.abs(t - peak) < 0.04]
    efforts = 3 * (1 - 400 * (inside - peak) ** 2) ** 2 / (inside * (1 - inside)) ** 3
    assert found.objective == pytest.approx(efforts.max(), rel=1e-6)


def test_a_leak_counts_by_the_time_that_it_takes() -> None:
    fractions = np.array([0.0, 0.5, 0.501, 1.0])
    middle = np.full(3, 0.5)
    excess = [
        Extremes(np.array([-0.3, 0.2, -np.inf]), middle),
        Extremes(np.array([-0.1, 0.4, 1e-6]), middle),
    ]
    # what is within a limit makes up for no leak
    assert mean_excess(fractions, excess) == pytest.approx(0.4 * 0.001 + 1e-6 * 0.499, rel=1e-12)
    assert mean_excess(fractions, []) == 0.0
