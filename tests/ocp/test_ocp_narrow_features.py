"""Gusts, gates and peaks that are far narrower than the intervals of the first mesh."""

import math

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Bound,
    Control,
    FixedMesh,
    HermiteSimpson,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    certify,
    joined,
    solve,
)
from ocp.mesh.mesh import Mesh, PhaseMesh

_WIDTH = 1e-4  # of a motion of one second


def gust(at, speed):
    """An acceleration that changes the speed in some ten thousandths of a second."""
    return speed / (_WIDTH * math.sqrt(math.pi)) * ca.exp(-(((TIME - at) / _WIDTH) ** 2))


def carried(*gusts):
    """Rest to rest over one metre, with gusts (time, speed)."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    ends = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    rate = u + sum(gust(*each) for each in gusts)
    move = Phase("move", {x: v, v: rate}, **ends, end=1.0)
    return Problem("gusts", move, minimise=move.integral(u**2))


def least_effort(*gusts):
    """From rest by X to the speed V costs 12 (X^2 - X V) + 4 V^2."""
    way = 1 - sum(speed * (1 - at) for at, speed in gusts)
    speed = -sum(speed for _, speed in gusts)
    return 12 * (way**2 - way * speed) + 4 * speed**2


@pytest.mark.parametrize("scheme", [Radau(), HermiteSimpson()])
@pytest.mark.parametrize("gusts", [[(0.4321, 0.5)], [(0.4321, 0.5), (0.4412, 0.1), (0.77, -0.2)]])
def test_gusts_between_the_points_count(gusts, scheme):
    found = solve(carried(*gusts), settings=Settings(scheme=scheme))
    assert found.objective == pytest.approx(least_effort(*gusts), rel=1e-6)
    assert certify(found).passed


def test_a_fixed_mesh_that_misses_a_gust_is_not_verified():
    found = solve(carried((0.4321, 0.5)), settings=Settings(refinement=FixedMesh()))
    assert found.objective == pytest.approx(12.0, rel=1e-6)  # as without a gust
    # of the size of the speed, which is about 2 m/s
    assert found.verification.dynamics == pytest.approx(0.25, rel=0.1)
    assert not found.verification.passed


@pytest.mark.parametrize("adapts", [False, True])
def test_a_long_interval_beside_many_short_ones_hides_no_gust(adapts):
    """A mesh of more intervals than there are samples: 12.0 was certified for 11.449."""
    points = np.concatenate([np.linspace(0, 0.9, 20), np.linspace(0.9, 1, 601)[1:]])
    mesh = Mesh((PhaseMesh(points, np.full(points.size - 1, 4)),))
    found = solve(carried((0.4321, 0.5)), mesh=mesh)
    assert found.objective == pytest.approx(least_effort((0.4321, 0.5)), rel=1e-6)
    assert certify(found).passed


def test_a_narrow_price_counts():
    x, u = State("x"), Control("u")
    move = Phase("move", {x: u}, {x: 0}, {x: 1}, end=1.0)
    price = 1 + 1000 * ca.exp(-(((TIME - 0.4321) / _WIDTH) ** 2))
    found = solve(Problem("price", move, minimise=move.integral(price * u**2)))
    # u is in proportion to 1 / price
    times = 0.4321 + _WIDTH * np.linspace(-8, 8, 160_001)
    saved = 1 - 1 / (1 + 1000 * np.exp(-(((times - 0.4321) / _WIDTH) ** 2)))
    assert found.objective == pytest.approx(1 / (1 - np.trapezoid(saved, times)), rel=1e-6)
    assert certify(found).passed


def test_a_gate_between_the_points_is_kept():
    x, v, u = State("x"), State("v"), Control("u")
    limit = 2 - ca.exp(-(((TIME - 0.4321) / 1e-3) ** 2))
    gate = Bound("gate", v - limit, upper=0)
    ends = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    move = Phase("move", {x: v, v: u}, **ends, end=1.0, bounds=[gate])
    found = solve(Problem("gate", move, minimise=move.integral(u**2)))
    assert float(found.sample(v, [0.4321])[0]) <= 1 + 1e-6
    # without the gate it is 1.47 m/s there, and the effort is 12
    assert found.objective == pytest.approx(15.446058, rel=1e-5)


def test_a_peak_between_the_points_counts():
    x, v, u = State("x"), State("v"), Control("u")
    felt = u * (1 + 3 * ca.exp(-(((TIME - 0.262) / _WIDTH) ** 2)))
    ends = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    move = Phase("move", {x: v, v: u}, **ends, end=1.0)
    peak = move.peak(felt, absolute=True)
    found = solve(Problem("peak", move, minimise=peak))
    times = np.linspace(0.261, 0.263, 200_001)
    largest = np.abs(found.sample(felt, times)).max()
    assert largest == pytest.approx(found.value(peak), rel=1e-5)


def test_a_gust_in_a_later_phase_counts():
    x, v, u = State("x"), State("v"), Control("u")
    first = Phase("first", {x: v, v: u}, {x: 0, v: 0}, end=0.4)
    rate = u + gust(0.7321, 0.5)
    second = Phase("second", {x: v, v: rate}, final={x: 1, v: 0}, start=0.4, end=1.0)
    effort = first.integral(u**2) + second.integral(u**2)
    found = solve(Problem("two", (first, second), minimise=effort, links=joined(first, second)))
    assert found.objective == pytest.approx(least_effort((0.7321, 0.5)), rel=1e-6)
