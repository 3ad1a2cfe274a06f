"""What finer controls promise, and where the promise counts."""

import numpy as np
import pytest

from ocp import Between, Control, FixedMesh, Phase, Problem, Settings, State, solve
from ocp.optimality.active_set import strongest_multipliers
from ocp.refinement.estimates.promised_gain import PhaseGains, promised_gain


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
