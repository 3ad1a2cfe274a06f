"""Gusts that a control, a state, an unknown or a constant multiplies, and that a zero hides."""

import math
import warnings

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Bound,
    Constant,
    Control,
    FixedMesh,
    HermiteSimpson,
    Lobatto,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    Unknown,
    certify,
    family,
    solve,
)
from ocp.analysis.sensitivity import ActiveSetWarning
from ocp.mesh.mesh import uniform, with_points

FIXED = Settings(refinement=FixedMesh())


def gust(at, width):
    """Its integral is 1."""
    return ca.exp(-(((TIME - at) / width) ** 2)) / (width * math.sqrt(math.pi))


def move(extra_rate, extra_cost=0.0, bounds=(), more=None, beyond=0.0, breakpoints=()):
    """Rest to rest over one metre in a second, with an acceleration and a cost beside."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    more = more or {}
    phase = Phase(
        "move",
        {x: v, v: u + extra_rate, **more},
        {x: 0, v: 0, **dict.fromkeys(more, 0)},
        {x: 1, v: 0},
        end=1.0,
        bounds=[bound(u) for bound in bounds],
        breakpoints=breakpoints,
    )
    return Problem("move", phase, minimise=phase.integral(u**2 / 2 + extra_cost) + beyond)


def effort(change, at):
    """The least integral of u^2/2 where a gust changes the speed at an instant."""
    way, speed = 1 - change * (1 - at), -change
    return 6 * (way**2 - way * speed) + 2 * speed**2


def failed(solution):
    return [check.name for check in certify(solution).checks if not check.passed]


# without a gust u = 6 - 12 t, and an impulse at t changes the effort by -u(t)
AT = 0.4321
SLOPE = -(6 - 12 * AT)


@pytest.mark.parametrize("scheme", [Radau(), Lobatto(), HermiteSimpson()])
@pytest.mark.parametrize("width", [1e-4, 1e-3, 0.01, 0.1])
def test_the_sensitivity_by_the_strength_of_a_gust_of_zero(scheme, width):
    strength = Constant("strength", "m/s", value=0.0)
    problem = move(strength * gust(AT, width))
    found = solve(problem, settings=Settings(scheme=scheme))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found.sensitivities()["strength"] == pytest.approx(SLOPE, rel=2e-4)
    assert found.objective == pytest.approx(6.0, rel=1e-8)
    assert certify(found).passed


@pytest.mark.parametrize("width", [1e-4, 1e-3, 0.01])
def test_a_fixed_mesh_that_misses_the_gust_refuses_the_slope(width):
    strength, way = Constant("strength", "m/s", value=0.0), Constant("way", "m", value=1.0)
    problem = move(strength * gust(AT, width), beyond=0 * way)
    found = solve(problem, settings=FIXED)
    with pytest.warns(ActiveSetWarning, match="'strength' are not known: they act between"):
        slopes = found.sensitivities()
    assert math.isnan(slopes["strength"])
    # the others are what they were
    assert slopes["move: x final"] == pytest.approx(12.0, rel=1e-8)
    # nothing is wrong with the motion
    assert certify(found).passed


def test_a_fixed_mesh_with_breakpoints_there_knows_the_slope():
    strength = Constant("strength", "m/s", value=0.0)
    around = tuple(AT + 1e-3 * np.linspace(-4, 4, 9))
    found = solve(move(strength * gust(AT, 1e-3), breakpoints=around), settings=FIXED)
    assert found.sensitivities()["strength"] == pytest.approx(SLOPE, rel=1e-4)


@pytest.mark.parametrize("settings", [Settings(), FIXED])
def test_what_constants_do_everywhere_is_known_on_any_mesh(settings):
    mass, drag = Constant("mass", "kg", value=1.0), Constant("drag", "1/s", value=0.0)
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "N")
    rate = u / mass - drag * ca.sqrt(1 + v**2) + drag * ca.sin(6 * TIME)
    phase = Phase("move", {x: v, v: rate}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    found = solve(Problem("m", phase, minimise=phase.integral(u**2 / 2)), settings=settings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        slopes = found.sensitivities()
    assert slopes["mass"] == pytest.approx(12.0, rel=1e-6)
    # int u (sqrt(1 + v^2) - sin 6 t), with u = 6 - 12 t and v = 6 t - 6 t^2
    t = np.linspace(0, 1, 100_001)
    own = (6 - 12 * t) * (np.sqrt(1 + (6 * t - 6 * t**2) ** 2) - np.sin(6 * t))
    assert slopes["drag"] == pytest.approx(np.trapezoid(own, t), rel=1e-5)


def lidded(wider, **more):
    """Under a limit on the acceleration that a constant opens for a moment."""
    opening = wider * ca.exp(-(((TIME - 0.0432) / 1e-3) ** 2))
    return move(0.0, bounds=[lambda u: Bound("lid", u - opening, upper=5.0)], **more)


def test_a_slope_through_a_limit():
    closed = Constant("wider", "m/s^2", value=0.0)
    with pytest.warns(ActiveSetWarning, match="'wider'"):
        assert math.isnan(solve(lidded(closed), settings=FIXED).sensitivities()["wider"])

    around, step = tuple(0.0432 + 1e-3 * np.linspace(-4, 4, 17)), 1e-2
    narrower, wider = (
        solve(lidded(Constant("wider", "m/s^2", value=size), breakpoints=around)).objective
        for size in (-step, step)
    )
    slope = solve(lidded(closed)).sensitivities()["wider"]
    assert slope < -1e-4
    assert slope == pytest.approx((wider - narrower) / (2 * step), rel=5e-3)


def test_a_limit_that_does_not_act_there_gives_no_slope():
    wider = Constant("wider", "m/s^2", value=0.0)
    late = wider * ca.exp(-(((TIME - 0.5123) / 1e-3) ** 2))
    found = solve(move(0.0, bounds=[lambda u: Bound("lid", u - late, upper=5.0)]), settings=FIXED)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found.sensitivities()["wider"] == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("at", [0.223, AT, 0.71])
def test_an_unknown_of_zero_that_pays(at):
    w = Unknown("w", "m/s", lower=-10, upper=10)
    problem = move(w * gust(at, 5e-4), beyond=5e-2 * w**2)
    found = solve(problem)
    # the effort is a square function of w
    w_best = np.linspace(-4, 4, 800_001)
    assert found.objective == pytest.approx((effort(w_best, at) + 5e-2 * w_best**2).min(), rel=1e-8)
    assert certify(found).passed


@pytest.mark.parametrize("at", [0.223, AT, 0.71])
def test_a_control_of_zero_that_pays(at):
    width, most = 5e-4, 30.0
    w = Control("w", "1", lower=0, upper=1)
    found = solve(move(0.0, extra_cost=w * (1 - most * gust(at, width) * width * math.pi**0.5)))
    # w is 1 where that pays
    half = math.sqrt(math.log(most))
    t = np.linspace(-half, half, 100_001) * width
    gained = np.trapezoid(most * np.exp(-((t / width) ** 2)) - 1, t)
    assert found.objective == pytest.approx(6 - gained, rel=2e-6)
    assert certify(found).passed


@pytest.mark.parametrize("at", [0.223, AT, 0.71])
def test_a_state_of_zero_that_pays(at):
    y, w = State("y", "1"), Control("w", "1/s")
    problem = move(0.0, w**2 / 2 - y * gust(at, 1e-4), more={y: w})
    found = solve(problem)
    # w is 1 until the gust, and 0 after it
    assert found.objective == pytest.approx(6 - at / 2, rel=1e-5)
    assert certify(found).passed


def test_a_zero_that_is_kept_there_hides_nothing():
    # the gust would have to be paid for, and the limit keeps the control from the other side
    w = Control("w", "1", lower=0, upper=1)
    price = 1 + 30 * ca.exp(-(((TIME - AT) / 5e-4) ** 2))
    found = solve(move(0.0, extra_cost=w * price), settings=FIXED)
    assert found.objective == pytest.approx(6.0, rel=1e-6)
    assert "acts on" not in found.verdict
    assert failed(found) == []


@pytest.mark.parametrize("mass", [1.0, Constant("mass", "kg", value=1.0)])
def test_a_drag_beside_a_gust_does_not_hide_it(mass):
    # |v| v has a slope that steps with v, in the same rate as the gust
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    sail = Control("sail", "1", lower=-1, upper=1)
    rate = (mass * u + sail * gust(0.1, 3e-4) - 1e-9 * ca.fabs(v.symbol) * v) / mass
    phase = Phase("move", {x: v, v: rate}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    cost = phase.integral(u**2 / 2 + 1e-3 * sail**2)
    found = solve(Problem("drag", phase, minimise=cost))
    assert found.objective == pytest.approx(effort(1.0, 0.1), abs=5e-3)
    assert certify(found).passed


@pytest.mark.slow
def test_a_family_along_which_the_gust_moves():
    at, w = Constant("at", "s", value=0.3), Unknown("w", "m/s", lower=-10, upper=10)
    problem = move(w * gust(at, 5e-4), beyond=5e-2 * w**2)
    found = family(problem, at, [0.3, 0.32, 0.41, 0.46, 0.48, 0.5, 0.7])
    w_best = np.linspace(-4, 4, 800_001)
    best = [(effort(w_best, m.value) + 5e-2 * w_best**2).min() for m in found.members]
    assert found.objectives == pytest.approx(best, rel=1e-6)


def test_breakpoints_that_are_added_do_not_coincide():
    mesh = with_points(uniform(4, 3), np.array([0.3, 0.3 + 1e-16, 0.3 + 3e-17, 0.6]))
    assert np.allclose(mesh.breakpoints, [0, 0.25, 0.3, 0.5, 0.6, 0.75, 1])
    assert np.diff(mesh.breakpoints).min() > 1e-3
