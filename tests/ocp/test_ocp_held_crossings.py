"""Crossings of a cost's kink that a breakpoint holds at a wrong time."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ocp import Control, Phase, Problem, Settings, State, certify, solve
from ocp.refinement.better_motions.held_crossings import _largest_step, held_crossing

x, v = State("x", "m", lower=-1.2, upper=1.2), State("v", "m/s")


def turn() -> Problem:
    """A cart turns back at full thrust, and its drive feeds nothing back: it crosses v = 0."""
    u = Control("u", "m/s^2", lower=-1, upper=1)
    rates = {x: v, v: u - 0.3 * v}
    phase = Phase("go", rates, {x: 0, v: 1}, {x: -1, v: 0}, end=4.0)
    return Problem("turn", phase, minimise=phase.integral(ca.fmax(0, u * v)))


def swing_up() -> Problem:
    """A cart swings a pole up, and its drive feeds nothing back: it turns at full thrust."""
    q, w = State("q", "rad"), State("w", "rad/s")
    force = Control("F", "N", lower=-20, upper=20)
    push = force + 0.3 * ca.sin(q) * (0.5 * w**2 + 9.81 * ca.cos(q))
    speeding = push / (1.0 + 0.3 * ca.sin(q) ** 2)
    turning = -(speeding * ca.cos(q) + 9.81 * ca.sin(q)) / 0.5
    phase = Phase(
        "go",
        {x: v, q: w, v: speeding, w: turning},
        {x: 0, q: 0, v: 0, w: 0},
        {x: 0, q: np.pi, v: 0, w: 0},
        end=2.5,
        guess={q: (0, np.pi)},
    )
    cost = phase.integral(ca.fmax(0, force * v) + 0.01 * force**2)
    return Problem("swing-up", phase, minimise=cost)


@pytest.mark.parametrize("intervals", [10, 24])
def test_at_an_optimum_next_to_nothing_is_promised(intervals: int) -> None:
    found = solve(turn(), settings=Settings(intervals=intervals))
    assert found.objective == pytest.approx(0.2954279, rel=1e-6)
    assert certify(found).passed
    assert held_crossing(found.kept_iterate, found.evaluator, 0) < 1e-4


def test_a_step_of_means_is_seen() -> None:
    fractions = np.linspace(0.0, 1.0, 201)
    means = np.where(fractions[1:] <= 0.5, 1.0, 1.25)
    assert _largest_step(fractions, means) == pytest.approx(0.25)
    assert _largest_step(fractions, np.ones(200)) == pytest.approx(0.0, abs=1e-12)
    assert _largest_step(np.array([0.0, 1.0]), np.array([1.0])) == 0.0


@pytest.mark.slow
def test_a_held_crossing_is_freed() -> None:
    """It was certified at 5.10122; a motion of 5.1011486 is known."""
    found = solve(swing_up(), settings=Settings(intervals=36))
    assert found.objective == pytest.approx(5.1011486, rel=1e-6)
    assert certify(found).passed
