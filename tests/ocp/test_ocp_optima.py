"""Problems whose optimum is known in closed form, beside those of every verb."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp import Between, Bound, Control, Phase, Problem, Settings, State, joined, solve
from tests.ocp.named_schemes import scheme_named

SCHEMES = ["radau", "gauss", "lobatto", "hermite-simpson"]
SHAPES = ["constant", "linear", "polynomial"]
PROMISED = 1e-5  # the objective tolerance of `Settings`


def chain(shape=None, **limits):
    return State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", piecewise=shape, **limits)


def brachistochrone():
    """Fastest slide under 9.8 m/s^2 from rest to a point 2 m across and 2 m down."""
    x, y, v = State("x", "m"), State("y", "m"), State("v", "m/s", lower=0)
    slope = Control("slope", "rad", lower=0, upper=3)
    phase = Phase(
        "slide",
        {x: v * ca.sin(slope), y: v * ca.cos(slope), v: 9.8 * ca.cos(slope)},
        initial={x: 0, y: 0, v: 0},
        final={x: 2, y: 2},
        end=Between(0.1, 5, 1),
        guess={slope: (0.1, 1.5), v: (0, 5)},
    )
    return Problem("brachistochrone", [phase], minimise=phase.end_time)


@pytest.mark.parametrize("name", SCHEMES)
def test_brachistochrone(name):
    # cycloid through (2, 2): 0.824 759 143 156 6 s; smooth, so far better than promised
    found = solve(brachistochrone(), settings=Settings(scheme=scheme_named(name, 4)))
    assert found.objective == pytest.approx(0.8247591431566, rel=1e-8)


def bryson_denham(shape):
    """Least effort with the position kept below l = 1/9: 4 / (9 l) = 4."""
    x, v = State("x", "m", upper=1 / 9), State("v", "m/s")
    u = Control("u", "m/s^2", piecewise=shape)
    phase = Phase("hop", {x: v, v: u}, initial={x: 0, v: 1}, final={x: 0, v: -1}, end=1.0)
    return Problem("Bryson-Denham", [phase], minimise=phase.integral(u**2 / 2)), x


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("radau", "polynomial"),
        ("gauss", "polynomial"),
        ("lobatto", "polynomial"),
        ("radau", "linear"),
        ("radau", "constant"),
    ],
)
def test_bryson_denham(name, shape):
    problem, x = bryson_denham(shape)
    found = solve(problem, settings=Settings(scheme=scheme_named(name, 4)))
    # the estimated gain left is below the promised tolerance, but counts first-order terms only
    rel = 4 * PROMISED if shape == "constant" else PROMISED
    assert found.objective == pytest.approx(4.0, rel=rel)
    # the ceiling: path tolerance of 1e-7, times 10 in the verification
    assert found.sample(x, np.linspace(0, 1, 2001)).max() <= (1 + 1e-6) / 9


@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize("shape", ["linear", "polynomial"])
def test_cubic_spline_through_a_point(name, shape):
    # int u^2 is least on the cubic spline 0, 1, 0 at 0, 1, 3 s, at rest at both ends: 10.125
    x, v, u = chain(shape)
    rates, settings = {x: v, v: u}, Settings(scheme=scheme_named(name, 4), intervals=5)
    there = Phase("there", rates, initial={x: 0, v: 0}, final={x: 1}, start=0, end=1)
    back = Phase("back", rates, final={x: 0, v: 0}, start=1, end=3)
    found = solve(
        Problem(
            "via",
            [there, back],
            minimise=there.integral(u**2) + back.integral(u**2),
            links=joined(there, back),
        ),
        settings=settings,
    )
    # the splines are in the space of the trial functions: the solver's tolerance of 1e-10 on
    # scaled rows times multipliers of the order of 10
    assert found.objective == pytest.approx(10.125, rel=1e-8)
    # slope at the knot from the tridiagonal system: v(1) = 3/4
    assert found.value(back.at_start(v)) == pytest.approx(0.75, abs=1e-6)
    assert found.value(there.at_end(v)) == pytest.approx(found.value(back.at_start(v)), abs=1e-8)


def test_least_peak_of_speed():
    # thrust up to 8 m/s^2: a trapezium of speed V with V (1 - V / 8) = 1
    x, v, u = chain("constant", lower=-8, upper=8)
    phase = Phase("move", {x: v, v: u}, initial={x: 0, v: 0}, final={x: 1, v: 0}, end=1.0)
    found = solve(Problem("least speed", [phase], minimise=phase.peak(v)))
    assert found.objective == pytest.approx(4 * (1 - math.sqrt(0.5)), rel=PROMISED)


def test_a_saturated_interval_that_the_control_should_leave_is_refined():
    # thrust 1, then falling from 1 to 0 in r s: x(1) = 1/2 - r^2/6, effort 1 - 2 r/3.  On ten
    # intervals the best linear thrust stays at 1 to the end of the one in which it should fall
    reached = 0.5 * (1 - 5e-3)
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-1, upper=1)
    phase = Phase("push", {x: v, v: u}, {x: 0, v: 0}, end=1)
    problem = Problem(
        "push",
        [phase],
        minimise=phase.integral(u**2),
        bounds=[Bound("reached", phase.at_end(x), "m", lower=reached)],
    )
    found = solve(problem, settings=Settings(intervals=10))
    exact = 1 - 2 / 3 * math.sqrt(6 * (0.5 - reached))
    assert len(found.mesh_iterations) > 1
    assert found.objective == pytest.approx(exact, rel=1e-6)  # `Accuracy.objective`
