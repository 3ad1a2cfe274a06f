"""A drive that feeds nothing back, whose motion crosses the kink of its cost."""

from __future__ import annotations

import casadi as ca
import pytest

from ocp import Control, Phase, Problem, Settings, State, certify, solve

x, v = State("x", "m", lower=-1.2, upper=1.2), State("v", "m/s")


def turn() -> Problem:
    """A cart turns back at full thrust, and its drive feeds nothing back: it crosses v = 0."""
    u = Control("u", "m/s^2", lower=-1, upper=1)
    rates = {x: v, v: u - 0.3 * v}
    phase = Phase("go", rates, {x: 0, v: 1}, {x: -1, v: 0}, end=4.0)
    return Problem("turn", phase, minimise=phase.integral(ca.fmax(0, u * v)))


@pytest.mark.parametrize("intervals", [10, 24])
def test_the_optimum_is_found(intervals: int) -> None:
    found = solve(turn(), settings=Settings(intervals=intervals))
    assert found.objective == pytest.approx(0.2954279, rel=1e-6)
    assert certify(found).passed
