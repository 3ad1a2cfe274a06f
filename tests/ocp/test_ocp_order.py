"""Observed order of convergence equals the declared one."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ocp import Control, FixedMesh, Phase, Problem, Settings, State, solve
from tests.ocp.named_schemes import scheme_named

METHODS = [
    *[("radau", s) for s in (1, 2, 3, 4)],
    *[("gauss", s) for s in (1, 2, 3)],
    *[("lobatto", s) for s in (2, 3, 4)],
    ("hermite-simpson", 3),
    ("trapezoid", 2),
]
SPAN, LQ_SPAN = 2.0, 3.0
# number of intervals: few for the high orders, so that errors stay above the solver's tolerance
MESHES = {
    1: (40, 80, 160),
    2: (20, 40, 80),
    3: (8, 16, 32),
    4: (6, 12, 24),
    5: (4, 8, 16),
    6: (6, 12, 24),
    7: (8, 12, 24),
}
LQ_MESHES = {**MESHES, 6: (4, 8, 16), 7: (3, 6, 12)}
FLOOR = 2e-12  # errors below are round-off: Newton's last step squares the solver's 1e-10


def pendulum_end(name, degree, intervals):
    """End of a driven pendulum stated as a problem that has nothing to choose."""
    angle, rate = State("angle", "rad"), State("rate", "rad/s")
    phase = Phase(
        "swing",
        {angle: rate, rate: -4 * ca.sin(angle)},
        initial={angle: 1.0, rate: 0.5},
        end=SPAN,
    )
    settings = Settings(
        scheme=scheme_named(name, degree), intervals=intervals, refinement=FixedMesh()
    )
    found = solve(Problem("pendulum", [phase], minimise=phase.at_end(angle)), settings=settings)
    return np.array([found.value(phase.at_end(s)) for s in (angle, rate)])


@pytest.fixture(scope="module")
def exact():
    found = solve_ivp(
        lambda t, y: [y[1], -4 * np.sin(y[0])],
        (0, SPAN),
        [1.0, 0.5],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
    )
    return found.y[:, -1]


def slope(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize(("name", "degree"), METHODS)
def test_end_state_converges_with_the_declared_order(name, degree, exact):
    order = scheme_named(name, degree).at(degree).order
    meshes = MESHES[order]
    errors = np.array([np.abs(pendulum_end(name, degree, n) - exact).max() for n in meshes])
    seen = errors > FLOOR
    assert seen.sum() >= 2
    # the next power of the step still bends the line: a third of an order on these meshes
    assert slope(1.0 / np.array(meshes)[seen], errors[seen]) == pytest.approx(order, abs=0.35)


@cache
def lq(name, degree, intervals):
    """Minimise int (x^2 + u^2) for x' = x + u from 1, free end."""
    x, u = State("x"), Control("u")
    phase = Phase("lq", {x: x + u}, initial={x: 1.0}, end=LQ_SPAN)
    settings = Settings(
        scheme=scheme_named(name, degree), intervals=intervals, refinement=FixedMesh()
    )
    return solve(Problem("lq", [phase], minimise=phase.integral(x**2 + u**2)), settings=settings)


@pytest.mark.parametrize(("name", "degree"), METHODS)
def test_optimum_converges_with_the_declared_order(name, degree):
    # Riccati's equation -s' = 2 s + 1 - s^2, s(3) = 0 has the roots 1 -+ sqrt 2
    w = np.sqrt(2)
    e = np.exp(-2 * w * LQ_SPAN)
    exact = (1 - e) / ((w - 1) + (w + 1) * e)
    order = scheme_named(name, degree).at(degree).order
    meshes = LQ_MESHES[order]
    errors = np.array([abs(lq(name, degree, n).objective - exact) for n in meshes])
    assert errors.min() > FLOOR
    # as above
    assert slope(1.0 / np.array(meshes), errors) == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize(("name", "degree"), METHODS)
def test_controls_and_costates_converge_with_their_own_order(name, degree):
    # x' = x - p/2, p' = -2 x - p with p(3) = 0, u = -p/2
    method = scheme_named(name, degree).at(degree)
    times = np.linspace(0.01, 2.99, 97)
    matrix = np.array([[1.0, -0.5], [-2.0, -1.0]])
    at_end = expm(LQ_SPAN * matrix)
    first = np.array([1.0, -at_end[1, 0] / at_end[1, 1]])
    costate = np.array([(expm(t * matrix) @ first)[1] for t in times])
    meshes = LQ_MESHES[method.order]
    found = [lq(name, degree, n) for n in meshes]
    errors = np.array(
        [
            [
                np.abs(f.sample("u", times) + costate / 2).max(),
                np.abs(f.costate("x", times) - costate).max(),
            ]
            for f in found
        ]
    )
    for error in errors.T:
        # the same times lie anywhere in the intervals of three meshes: two thirds of an order
        assert slope(1.0 / np.array(meshes), error) == pytest.approx(method.control_order, abs=0.67)
