"""Costates between the collocation points, and controls that are wanted where those say nothing."""

import math

import numpy as np
import pytest

from ocp import (
    Control,
    FixedMesh,
    Gauss,
    Lobatto,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    certify,
    solve,
)
from ocp.optimality.active_set import acting_on_states
from ocp.optimality.control_gains import costate_errors
from ocp.optimality.multipliers import phase_costates


def filled(lag, price):
    """A vessel that a valve with a lag fills for 1 s; what the valve is left open costs a price.

    The motion is constant for as long as the valve is open. It is to be closed in the end.
    """
    flow, level = State("flow"), State("level")
    valve = Control("valve", lower=0, upper=1)
    fill = Phase(
        "fill",
        {flow: (valve - flow) / lag, level: flow},
        {flow: 1, level: 0},
        end=1.0,
    )
    return Problem("filled", fill, minimise=price * fill.at_end(flow) - fill.at_end(level))


def least(lag, price):
    """The optimum: with ``x' = (u - x) / e`` and ``lambda_y = -1``.

    ``lambda_x = (e + c) exp(-s / e) - e`` at the time ``s`` before the end. It is positive, so that
    the valve is shut, from ``s = e ln(1 + c / e)`` on, and this is what is gained of the level 1.
    """
    return lag * math.log(1.0 + price / lag) - 1.0


def coarse(scheme, problem):
    settings = Settings(intervals=5, scheme=scheme, refinement=FixedMesh(), verify=False)
    found = solve(problem, settings=settings)
    return found.kept_iterate, found.evaluator


@pytest.mark.parametrize("scheme", [Radau(), Gauss()])
def test_costates_follow_their_equation_through_a_layer(scheme):
    lag, price = 0.02, 0.002
    iterate, evaluator = coarse(scheme, filled(lag, price))
    before_end = np.array([0.2, 0.1, 0.04, 0.02, 0.01, 0.005, 0.0])
    intervals, tau = np.full(before_end.size, 4), 1.0 - 5.0 * before_end
    exact = (lag + price) * np.exp(-before_end / lag) - lag

    of_program = phase_costates(iterate, 0).local(intervals, tau)
    lacking = costate_errors(iterate, evaluator, 0, np.zeros(5, dtype=bool))
    off = np.abs(of_program[:, 0] - exact).max()
    # ten time constants in an interval of four points
    assert off > 0.1 * lag
    left = of_program + lacking.local(intervals, tau)
    np.testing.assert_allclose(left[:, 0], exact, atol=0.03 * lag)
    np.testing.assert_allclose(left[-1], [price, -1.0], atol=1e-9)


def test_nothing_is_found_where_it_says_nothing():
    def largest(iterate, evaluator, acting=(False,) * 5):
        return np.abs(costate_errors(iterate, evaluator, 0, np.array(acting)).values).max()

    assert largest(*coarse(Radau(), filled(0.02, 0.002))) > 0.0
    assert largest(*coarse(Radau(), filled(0.02, 0.002)), acting=(True,) * 5) == 0.0
    # these costates meet the principle on any mesh
    assert largest(*coarse(Lobatto(), filled(0.02, 0.002))) == 0.0


def test_costates_that_are_exact_lack_nothing():
    # x'' = u with the least integral of u^2: constant and linear costates
    x, v, u = State("x"), State("v"), Control("u")
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    problem = Problem("move", move, minimise=move.integral(u**2))
    iterate, evaluator = coarse(Radau(), problem)
    assert not acting_on_states(iterate)[0].any()
    lacking = costate_errors(iterate, evaluator, 0, np.zeros(5, dtype=bool))
    # of costates of 24 and 12, to the solver's tolerance
    assert np.abs(lacking.values).max() < 1e-6


@pytest.mark.parametrize(
    ("lag", "price", "intervals"),
    [(0.03, 0.003, 5), (0.01, 0.01, 2), (3e-3, 3e-2, 2), (1e-3, 1e-3, 20), (1e-4, 1e-3, 10)],
)
def test_a_control_leaves_its_bound_in_a_layer_at_the_end(lag, price, intervals):
    # open all the time was called optimal: up to two per cent were lost
    found = solve(filled(lag, price), settings=Settings(intervals=intervals))
    assert found.objective == pytest.approx(least(lag, price), rel=1e-6)
    assert certify(found).passed
