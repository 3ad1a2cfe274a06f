"""Evaluation between the points: maxima, peaks, integrals and values along a motion."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from ocp import (
    TIME,
    Algebraic,
    Between,
    Bound,
    Constant,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    Unknown,
    peak,
    solve,
)
from ocp.numerics.extrema import dense_grid, maxima


def all_maxima(function, intervals, level=-np.inf):
    grid = dense_grid(4)
    k, tau = np.repeat(np.arange(intervals), grid.size), np.tile(grid, intervals)
    return maxima(function, function(k, tau).reshape(intervals, -1), grid, level)


def test_maxima_of_known_functions():
    # interval k: a parabola with its top at (k + 1) / 5, on a slope that moves none of them out
    def parabolas(k, tau):
        return 3 * k - (tau - (k + 1) / 5) ** 2

    found = all_maxima(parabolas, 4)
    # five rounds of zooming by 1/4 or more from a grid of 0.1: below 1e-4, squared in the value
    np.testing.assert_allclose(found.tau, [0.2, 0.4, 0.6, 0.8], atol=2e-4)
    np.testing.assert_allclose(found.values, [0, 3, 6, 9], atol=1e-7)


def test_maxima_at_ends_kinks_and_of_constants():
    functions = [lambda t: t, lambda t: -t, lambda t: 1 - np.abs(t - 1 / 3), lambda t: 0 * t + 5]

    def values(k, tau):
        return np.array([functions[i](t) for i, t in zip(k, tau, strict=True)])

    found = all_maxima(values, 4)
    np.testing.assert_allclose(found.values, [1, 0, 1, 5], atol=1e-4)  # a kink: the last grid
    np.testing.assert_allclose(found.tau[:3], [1, 0, 1 / 3], atol=1e-4)


def test_only_what_may_reach_the_level_or_is_the_largest_is_zoomed_into():
    asked = set()

    def parabolas(k, tau):
        asked.update(k)
        return k - 2.5 - (tau - 0.437) ** 2

    grid = dense_grid(4)
    k, tau = np.repeat(np.arange(4), grid.size), np.tile(grid, 4)
    values = parabolas(k, tau).reshape(4, -1)
    for level, zoomed in ((0.0, {3}), (-0.5001, {2, 3}), (7.0, {3})):
        asked.clear()
        found = maxima(parabolas, values, grid, level)
        assert asked == zoomed
        np.testing.assert_allclose(found.values[3], 0.5, atol=1e-7)
        np.testing.assert_allclose(found.values, [-2.5, -1.5, -0.5, 0.5], atol=0.02)


def test_a_value_that_is_not_finite_is_the_largest():
    found = all_maxima(lambda k, tau: np.where(tau > 0.9, np.nan, tau), 1)
    assert found.values[0] == np.inf


@pytest.fixture(scope="module")
def motion():
    x, v, z = State("x", "m"), State("v", "m/s"), Algebraic("z")
    u, step = Control("u", shape="linear"), Control("step", shape="constant")
    mass, gravity = Unknown("mass", "kg", 1, 3, guess=2.0), Constant("gravity", value=2.5)
    first = Phase(
        "first", {x: v, v: u / mass + step - gravity * ca.sin(x)}, initial={x: 0, v: 0},
        start=1.0, end=Between(2, 4, 3), bounds=[Bound("sum", z - x - 2 * u, lower=0, upper=0)],
    )  # fmt: skip
    second = Phase("second", {x: v, v: u - x}, final={x: 1, v: 0}, start=Between(2, 4, 3), end=5.0)
    cost = first.integral(u**2 + step**2 + z**2) + second.integral(u**2) + (mass - 2) ** 2
    links = [
        Bound("clock", second.start_time - first.end_time, lower=0, upper=0),
        Bound("place", second.at_start(x) - first.at_end(x), lower=0, upper=0),
        Bound("speed", second.at_start(v) - first.at_end(v), lower=0, upper=0),
    ]
    problem = Problem("motion", [first, second], minimise=cost, links=links)
    found = solve(problem, settings=Settings(scheme=Radau(5), intervals=6, refinement=FixedMesh()))
    return found, first, second, {s.name: s for s in (x, v, z, u, step, mass, gravity)}


def test_functionals_equal_independent_quadrature(motion):
    found, first, second, s = motion
    expression = s["u"] ** 2 + s["step"] ** 2 + s["z"] ** 2 + TIME * s["v"] / s["mass"]
    own = found.trajectory.phase("first")
    total = sum(
        quad(lambda t, k=k: float(found.sample(expression, t, first)), *own.breakpoints[k : k + 2],
             epsabs=1e-12)[0]
        for k in range(len(own.breakpoints) - 1)
    )  # fmt: skip
    # polynomials of degree 10 on both sides: round-off; but quad may touch a breakpoint
    assert found.value(first.integral(expression)) == pytest.approx(total, rel=1e-10)
    assert found.value(first.end_time) == own.end
    assert found.value(second.duration) == pytest.approx(5.0 - own.end, rel=1e-14)
    assert found.value(second.at_end(s["x"])) == pytest.approx(1.0, abs=1e-9)  # solver


def test_the_objective_is_the_value_of_its_expression(motion):
    found, _, _, _ = motion
    problem = found.problem
    # the solver's quadrature of degree 2 * 5 - 2 against a finer one, of polynomials
    assert found.value(problem.minimise) == pytest.approx(found.objective, rel=1e-9)


def test_expressions_of_all_kinds_of_symbols(motion):
    found, first, _, s = motion
    times = np.linspace(1.0, found.value(first.end_time), 7)[:-1]
    x, u, z = (found.sample(s[n], times) for n in ("x", "u", "z"))
    mass, gravity = found.value(s["mass"]), found.value(s["gravity"])
    assert gravity == 2.5
    given = found.sample(s["mass"] * ca.cos(s["x"]) + s["gravity"] * s["u"] * TIME, times)
    # the same formula in NumPy
    np.testing.assert_allclose(given, mass * np.cos(x) + gravity * u * times, rtol=1e-13)
    # an algebraic equation between polynomials holds between the points too
    np.testing.assert_allclose(z, x + 2 * u, atol=1e-4)
    assert found.sample(s["x"], times.reshape(2, 3)).shape == (2, 3)


def test_peaks_between_the_points(motion):
    found, first, second, s = motion
    dense = [
        found.sample(s["v"], np.linspace(p.start, p.end, 20001), p.name)
        for p in found.trajectory.phases
    ]
    both = peak((first, s["v"]), (second, -2 * s["v"]))
    # 20 000 samples of a smooth function miss a top by less than 1e-8
    assert found.value(first.peak(s["v"])) == pytest.approx(dense[0].max(), rel=1e-7)
    expected = max(dense[0].max(), -2 * dense[1].min())
    assert found.value(both) == pytest.approx(expected, rel=1e-7)
    size = second.peak(-s["v"], absolute=True)
    assert found.value(size) == pytest.approx(np.abs(dense[1]).max(), rel=1e-7)
