"""Sizes of signals by limits that they share, and a motion that has no answer without them."""

from __future__ import annotations

import casadi as ca
import pytest

from ocp import (
    Accuracy,
    Between,
    Bound,
    Constant,
    Control,
    HermiteSimpson,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    solve,
)
from ocp.mesh.initial_guess import initial_guess
from ocp.problem.parameters import parameters_of
from ocp.scaling.automatic import scales_of
from ocp.scaling.symbol_sizes import BOUNDS, NOTHING_KNOWN

X, Y = State("x", "m"), State("y", "m")
FX, FY, FZ = (Control(f"f{axis}", "N") for axis in "xyz")
MOST = Constant("most", "N", value=400.0)


def sizes(*bounds):
    """Sizes of the forces in a motion with such bounds, and why."""
    rates = {X: FX * ca.cos(X), Y: FY + FZ * ca.cos(Y)}
    phase = Phase("go", rates, {X: 0, Y: 0}, {X: 1, Y: 1}, end=1.0, bounds=bounds)
    problem = Problem("p", phase, minimise=phase.integral(FX**2 + FY**2))
    parameters = parameters_of(problem)
    scales = scales_of(problem, initial_guess(problem, parameters), parameters)
    names = [force.name for force in (FX, FY, FZ)]
    reasons = {scales.reasons["signal", name] for name in names}
    return [scales.signals[name] for name in names], reasons


@pytest.mark.parametrize(
    ("bound", "expected"),
    [
        (Bound("square", FX**2 + FY**2 / 4 + FZ**2, upper=400.0**2), [400, 800, 400]),
        (Bound("norm", ca.sqrt(FX**2 + FY**2 + FZ**2), upper=MOST), [400, 400, 400]),
        (Bound("small", FX**2 + FY**2 + FZ**2, upper=1e-8), [1e-4, 1e-4, 1e-4]),
        (Bound("direction", FX**2 + FY**2 + FZ**2, lower=1, upper=1), [1, 1, 1]),
        (Bound("sum", FX - 2 * FY + FZ, lower=-1, upper=3), [3, 1.5, 3]),
    ],
    ids=lambda given: getattr(given, "name", ""),
)
def test_a_signal_is_as_large_as_it_may_be_alone(bound, expected):
    found, reasons = sizes(bound)
    assert found == pytest.approx(expected, rel=2e-5)
    assert reasons == {BOUNDS}


def test_of_several_limits_the_largest_counts():
    found, _ = sizes(FX**2 + FY**2 + FZ**2 <= 9, FX**2 + FY**2 + FZ**2 >= 1, FX + FY + FZ <= 2)
    assert found == pytest.approx([3, 3, 3], rel=2e-5)


def test_limits_that_are_never_reached_or_depend_on_more_tell_nothing():
    found, reasons = sizes(FX - FY + FZ <= 400 + X, ca.tanh(FX + FY + FZ) <= 2)
    assert (found, reasons) == ([1, 1, 1], {NOTHING_KNOWN})


@pytest.mark.slow
@pytest.mark.parametrize("scheme", [HermiteSimpson(), Radau(4)], ids=lambda scheme: scheme.name)
def test_a_speed_limit_that_changes_along_the_way_by_a_smooth_step(scheme):
    """Slow in the middle of the way; the force may change the speed within a hundredth of it.

    With forces of size one next to a limit of 400 there was no answer in 3,000 iterations. The
    value is that of another program, 150 intervals written by hand: 6.2195 s.
    """
    x, y = State("x", "m", lower=0, upper=10), State("y", "m", lower=0, upper=10)
    vx, vy = State("vx", "m/s", lower=0.5), State("vy", "m/s", lower=0.1)

    def within(first, last):
        return (ca.tanh(10 * (x - first)) - ca.tanh(10 * (x - last))) / 2

    speed = ca.sqrt(vx**2 + vy**2)
    limits = [speed * within(*zone) <= most for *zone, most in ((-1, 3, 5), (3, 7, 1), (7, 11, 5))]
    ride = Phase(
        "ride",
        {x: vx, y: vy, vx: FX - vx, vy: FY - vy},
        {x: 0, y: 0},
        {x: 10, y: 10},
        end=Between(0.1, 30, guess=5),
        bounds=[FX**2 + FY**2 <= 400.0**2, *limits],
    )
    coarse = Accuracy(dynamics=1e-3, path=1e-3, objective=1e-3, replay=1e-3)
    settings = Settings(scheme=scheme, accuracy=coarse, iterations=6000)
    found = solve(Problem("zones", ride, minimise=ride.duration), settings=settings)
    assert found.verification.passed
    assert found.objective == pytest.approx(6.2195, rel=1e-3)
