"""Limits of controls alone, ``|u| <= p`` and ``u1 + u2 <= F``: held between the points by rows."""

import casadi as ca
import numpy as np
import pytest

from ocp import Between, Control, Phase, Problem, State, Unknown, certify, solve
from ocp.numerics.piecewise_polynomial import bernstein, elevation


@pytest.mark.parametrize(("count", "higher"), [(1, 1), (1, 4), (2, 5), (3, 4)])
def test_elevated_coefficients_are_the_same_polynomial(count, higher):
    coefficients = np.arange(1.0, count + 1) ** 2
    tau = np.linspace(0, 1, 7)
    raised = elevation(count, higher) @ coefficients
    assert bernstein(higher, tau) @ raised == pytest.approx(bernstein(count, tau) @ coefficients)


def spring(limited):
    """Rest to rest of a damped mass on a spring within 2 s, by the least largest thrust."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    p = Unknown("p", "m/s^2", lower=0, upper=10, guess=5)
    move = Phase(
        "move",
        dynamics={x: v, v: u - 0.3 * v - x},
        initial={x: 0, v: 0},
        final={x: 1, v: 0},
        end=2.0,
        bounds=[u <= p, u >= -p] if limited else (),
    )
    return Problem("spring", move, minimise=p if limited else move.peak(u, absolute=True)), u


def least_thrust():
    """Bang-bang with one switch: the end is linear in thrust and switching time alone sets it."""
    slopes = np.array([[0.0, 1.0], [-1.0, -0.3]])
    rates, vectors = np.linalg.eig(slopes)

    def driven(seconds):
        # integral of e^{A s} B over [0, seconds]
        grown = (np.exp(rates * seconds) - 1) / rates
        return (vectors @ np.diag(grown) @ np.linalg.inv(vectors) @ [0, 1]).real

    low, high = 0.0, 2.0
    for _ in range(100):
        switch = 0.5 * (low + high)
        # thrust +1 until the switch, then -1
        end = driven(2.0) - 2 * driven(2.0 - switch)
        low, high = (switch, high) if end[1] < 0 else (low, switch)
    return 1 / end[0]


@pytest.mark.parametrize("limited", [True, False])
def test_a_largest_thrust_takes_few_rounds_and_never_leaks(limited):
    problem, u = spring(limited)
    solution = solve(problem)
    assert solution.objective == pytest.approx(least_thrust(), rel=2e-6)
    # point by point it took twelve
    assert len(solution.mesh_iterations) <= 4
    thrust = solution.sample(u, np.linspace(0, 2, 20001))
    assert np.abs(thrust).max() <= solution.objective * (1 + 1e-7)
    assert certify(solution).passed


def test_a_drive_gives_room_to_another_where_they_share_a_limit():
    # the second drive is worth half as much for the first state but pays nothing: all thrust goes
    # to the first as long as it pays, and the sum is always used up
    x, v = State("x"), State("v")
    a, b = Control("a", lower=0, upper=2), Control("b", lower=0, upper=2)
    go = Phase(
        "go",
        {x: v, v: a + 0.5 * b},
        {x: 0, v: 0},
        {x: 1},
        end=Between(0.1, 9, 2),
        bounds=[a + b <= 1],
    )
    solution = solve(Problem("go", go, minimise=go.end_time))
    # a = 1, b = 0: x = t^2 / 2
    assert solution.objective == pytest.approx(np.sqrt(2.0), rel=1e-6)
    times = np.linspace(0, solution.objective, 101)
    assert np.all(solution.sample(a, times) + solution.sample(b, times) <= 1 + 1e-7)


def test_a_limit_of_other_signals_keeps_its_points():
    x, v, u = State("x"), State("v"), Control("u", lower=-2, upper=2)
    bounds = [u * v <= 0.5, ca.sin(u) <= 0.9, u - v <= 1]
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=2.5, bounds=bounds)
    solution = solve(Problem("power", move, minimise=move.integral(u**2)))
    constraints = solution.iterate.transcription.constraints[0]
    assert not any(constraint.of_controls for constraint in constraints)
