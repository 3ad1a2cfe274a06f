"""Units do not matter: kilometres and microseconds solve like metres and seconds."""

import numpy as np
import pytest

from ocp import Between, Control, Phase, Problem, Settings, State, solve
from ocp.guess import start_of
from ocp.scaling import scales_of


def transfer(length, second):
    """Least effort, 3 m in 2 s, with all numbers in other units of length and time."""
    x, v, u = State("x"), State("v"), Control("u")
    phase = Phase(
        "move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 3 * length, v: 0}, end=2 * second
    )
    return Problem("transfer", [phase], minimise=phase.integral(u**2)), u


UNITS = [(1.0, 1.0), (1e-3, 1e6), (1e6, 1e-3), (1e-9, 1.0), (1e3, 1e9)]


@pytest.mark.parametrize(("length", "second"), UNITS)
def test_least_effort_in_any_units(length, second):
    problem, u = transfer(length, second)
    found = solve(problem, settings=Settings(intervals=8))
    # 12 D^2 / T^3 in these units; quadratic program: the solver's tolerance
    assert found.objective == pytest.approx(12 * 9 / 8 * length**2 / second**3, rel=1e-9)
    assert found.iterations <= 4  # as in metres and seconds
    assert found.sample(u, 0.0) == pytest.approx(4.5 * length / second**2, rel=1e-7)


@pytest.mark.parametrize(("length", "second"), UNITS)
def test_least_time_in_any_units(length, second):
    x, v = State("x"), State("v")
    unit = length / second**2
    u = Control("u", lower=-2 * unit, upper=unit)
    phase = Phase(
        "dash", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 300 * length, v: 0},
        end=Between(second, 100 * second),
    )  # fmt: skip
    found = solve(Problem("dash", [phase], minimise=phase.end_time))
    assert found.objective == pytest.approx(30 * second, rel=1e-5)  # objective tolerance


def test_sizes_follow_the_chain_of_derivatives():
    problem, _ = transfer(1e-3, 1e6)
    scales = scales_of(problem, start_of(problem, {}), {})
    assert scales.signals["x"] == pytest.approx(3e-3)
    # twice the distance over the duration, twice the speed over the duration
    assert scales.signals["v"] == pytest.approx(2 * 3e-3 / 2e6)
    assert scales.signals["u"] == pytest.approx(4 * 3e-3 / 2e6**2)
    assert scales.time == pytest.approx(2e6)
    assert "duration" in scales.reasons["u"]


def test_a_stated_size_wins():
    x, u = State("x", scale=7.0), Control("u", lower=-2, upper=5)
    phase = Phase("move", {x: 3 * u}, initial={x: 1}, final={x: 2})
    problem = Problem("stated", [phase], minimise=phase.integral(u**2))
    scales = scales_of(problem, start_of(problem, {}), {})
    assert scales.signals == {"x": 7.0, "u": 5.0}
    assert np.all([scales.reasons["x"] == "stated", scales.reasons["u"] == "bounds"])
