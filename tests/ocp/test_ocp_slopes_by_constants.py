"""Slopes by constants that act everywhere, or for a short time only."""

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
    Phase,
    Problem,
    Settings,
    State,
    solve,
)
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


# without a gust u = 6 - 12 t, and an impulse at t changes the effort by -u(t)
AT = 0.4321
SLOPE = -(6 - 12 * AT)


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


def test_a_limit_that_does_not_act_there_gives_no_slope():
    wider = Constant("wider", "m/s^2", value=0.0)
    late = wider * ca.exp(-(((TIME - 0.5123) / 1e-3) ** 2))
    found = solve(move(0.0, bounds=[lambda u: Bound("lid", u - late, upper=5.0)]), settings=FIXED)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found.sensitivities()["wider"] == pytest.approx(0.0, abs=1e-8)


def test_breakpoints_that_are_added_do_not_coincide():
    mesh = with_points(uniform(4, 3), np.array([0.3, 0.3 + 1e-16, 0.3 + 3e-17, 0.6]))
    assert np.allclose(mesh.breakpoints, [0, 0.25, 0.3, 0.5, 0.6, 0.75, 1])
    assert np.diff(mesh.breakpoints).min() > 1e-3
