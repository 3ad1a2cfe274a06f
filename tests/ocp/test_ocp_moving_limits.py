"""Limits of controls that change in time."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

from ocp import (
    TIME,
    Between,
    Bound,
    Control,
    HermiteSimpson,
    Phase,
    Problem,
    Settings,
    State,
    certify,
    solve,
)

X, V, U = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")


def dash(share, rate, way):
    """Least time over a way from rest to rest, with |u| <= 1 + share sin(rate t)."""
    limit = 1 + share * ca.sin(rate * TIME)
    phase = Phase(
        "dash",
        {X: V, V: U},
        initial={X: 0, V: 0},
        final={X: way, V: 0},
        end=Between(0.5, 12),
        bounds=[Bound("push", U - limit, upper=0), Bound("brake", U + limit, lower=0)],
    )
    return Problem("dash", phase, minimise=phase.duration)


def least_time(share, rate, way):
    """With one switch: speed and way of the limit as closed integrals."""

    def speed(t):
        return t + share * (1 - np.cos(rate * t)) / rate

    def moment(t):
        return t**2 / 2 + share * (t - np.sin(rate * t) / rate) / rate

    def missed(times):
        switch, end = times
        back = moment(switch) - moment(end)
        at_rest = 2 * speed(switch) - speed(end)
        return at_rest, moment(switch) + 2 * speed(switch) * (end - switch) + back - way

    return fsolve(missed, [np.sqrt(way), 2 * np.sqrt(way)], xtol=1e-12)[1]


@pytest.mark.parametrize(
    ("share", "rate", "way"), [(0.5, 3.0, 3.0), pytest.param(0.8, 6.0, 4.0, marks=pytest.mark.slow)]
)
def test_a_control_follows_a_limit_that_waves(share, rate, way) -> None:
    found = solve(dash(share, rate, way))
    assert found.objective == pytest.approx(least_time(share, rate, way), rel=2e-6)
    assert certify(found).passed


@pytest.mark.slow
def test_schemes_without_telling_multipliers_are_held_against_a_mesh_of_halves() -> None:
    found = solve(dash(0.5, 3.0, 3.0), settings=Settings(scheme=HermiteSimpson()))
    assert found.objective == pytest.approx(least_time(0.5, 3.0, 3.0), rel=1e-5)


def test_a_peak_relative_to_a_limit_that_waves() -> None:
    """The least largest |u| / (1 + sin(3 t) / 2) over 1 m in 2 s: one switch, both sides equal."""
    limit = 1 + 0.5 * ca.sin(3 * TIME)
    phase = Phase("move", {X: V, V: U}, {X: 0, V: 0}, {X: 1, V: 0}, end=2.0)
    found = solve(Problem("move", phase, minimise=phase.peak(U / limit, absolute=True)))

    def speed(t):
        return t + 0.5 * (1 - np.cos(3 * t)) / 3

    def moment(t):  # of the speed: the way of a push of one
        return t**2 / 2 + 0.5 * (t - np.sin(3 * t) / 3) / 3

    switch = brentq(lambda t: 2 * speed(t) - speed(2), 0, 2)
    way = moment(switch) + 2 * speed(switch) * (2 - switch) + moment(switch) - moment(2)
    assert found.objective == pytest.approx(1 / way, rel=2e-6)
    assert certify(found).passed


@pytest.mark.slow
def test_an_arc_on_a_limit_that_waves_and_holds_a_state() -> None:
    """A drive of at most 2 m/s^2, whose power is limited by 1 + 0.6 sin 3t."""
    fast, push = State("v", "m/s", lower=0), Control("u", "m/s^2", lower=-2, upper=2)
    phase = Phase(
        "haul",
        {X: fast, fast: push},
        initial={X: 0, fast: 0},
        final={X: 3, fast: 0},
        end=Between(0.5, 9),
        bounds=[Bound("power", push * fast - 0.6 * ca.sin(3 * TIME), upper=1)],
    )
    found = solve(Problem("haul", phase, minimise=phase.duration))

    def driven(t, y):
        return [y[1], min(2.0, (1 + 0.6 * np.sin(3 * t)) / max(y[1], 1e-9))]

    at = solve_ivp(driven, (0, 6), [0, 0], rtol=1e-9, atol=1e-12, max_step=0.01, dense_output=True)
    brake = brentq(lambda t: at.sol(t)[0] + at.sol(t)[1] ** 2 / 4 - 3, 0.1, 6)
    assert found.objective == pytest.approx(brake + at.sol(brake)[1] / 2, rel=4e-6)
    assert certify(found).passed
