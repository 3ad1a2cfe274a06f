"""Evaluation between the points: degrees, maxima, peaks, integrals and values along a motion."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from ocp import (
    TIME,
    AdaptiveMesh,
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
    joined,
    peak,
    solve,
)
from ocp.numerics.piecewise_polynomial import dense_grid, maxima
from ocp.numerics.polynomial_expressions import polynomial_degree
from tests.ocp.problems import double_integrator, rest_to_rest, solved_on


@pytest.fixture(scope="module")
def motion():
    x, v, z = State("x", "m"), State("v", "m/s"), Algebraic("z")
    u, step = Control("u", piecewise="linear"), Control("step", piecewise="constant")
    mass, gravity = Unknown("mass", "kg", 1, 3, guess=2.0), Constant("gravity", value=2.5)
    first = Phase(
        "first",
        {x: v, v: u / mass + step - gravity * ca.sin(x)},
        initial={x: 0, v: 0},
        start=1.0,
        end=Between(2, 4, 3),
        bounds=[Bound("sum", z - x - 2 * u, lower=0, upper=0)],
    )
    second = Phase("second", {x: v, v: u - x}, final={x: 1, v: 0}, start=Between(2, 4, 3), end=5.0)
    cost = first.integral(u**2 + step**2 + z**2) + second.integral(u**2) + (mass - 2) ** 2
    problem = Problem("motion", [first, second], minimise=cost, links=joined(first, second))
    found = solved_on(6, problem, scheme=Radau(5))
    return found, first, second, {s.name: s for s in (x, v, z, u, step, mass, gravity)}


def test_functionals_equal_independent_quadrature(motion):
    found, first, second, s = motion
    expression = s["u"] ** 2 + s["step"] ** 2 + s["z"] ** 2 + TIME * s["v"] / s["mass"]
    own = found.trajectory.phase("first")
    total = sum(
        quad(
            lambda t, k=k: float(found.sample(expression, t, first)),
            *own.breakpoints[k : k + 2],
            epsabs=1e-12,
        )[0]
        for k in range(len(own.breakpoints) - 1)
    )
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


def test_what_the_problem_does_not_state_is_integrated_and_searched_between_the_points():
    _, v, u, move = rest_to_rest()
    found = solve(Problem("move", move, minimise=move.integral(u**2)))
    # u = 6 - 12 t and v = 6 t - 6 t^2
    narrow = ca.exp(-(((TIME - 0.4321) / 1e-3) ** 2))
    assert found.value(move.integral(narrow)) == pytest.approx(np.sqrt(np.pi) * 1e-3, rel=1e-9)
    # v is below 1 m/s until t_1, and from 1 - t_1 on
    t_1 = 0.5 - np.sqrt(1 / 12)
    assert found.value(move.integral(v < 1)) == pytest.approx(2 * t_1, rel=1e-9)
    way = 3 * t_1**2 - 2 * t_1**3
    apart = 2 * (t_1 - way) + (1 - 2 * way) - (1 - 2 * t_1)
    assert found.value(move.integral(ca.fabs(v - 1))) == pytest.approx(apart, rel=1e-9)
    assert found.value(move.peak(v * narrow)) == pytest.approx(6 * 0.4321 * 0.5679, rel=1e-5)
    assert found.value(move.integral(u**2)) == pytest.approx(12.0, rel=1e-9)


x, u, k = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("k")
POLYNOMIALS = [
    (x, 4),
    (x + u, 4),
    (x * u, 7),
    (k * x**2 - u / k, 8),
    (x**5, 20),
    (ca.sin(k) * x, 4),
    (ca.SX(3), 0),
    (k, 0),
    (2 * x - x, 4),
    ((x + u) * (x - u), 8),
    (ca.sqrt(k) * x**3 * u, 15),
]
OTHERS = [x**k, x / u, ca.sin(x), ca.fabs(u), x**0.5, x**-1, 1 / (1 + x**2)]


@pytest.mark.parametrize(("expression", "degree"), [*POLYNOMIALS, *((e, None) for e in OTHERS)])
def test_degree_of_an_expression(expression, degree):
    assert polynomial_degree(ca.densify(ca.SX(expression)), [x, u], [4, 3]) == degree


def test_a_limit_that_is_exceeded_between_the_points_is_named():
    """Bryson and Denham's motion with bounds of several kinds."""
    x, v, u, rates = double_integrator()
    ceiling = Constant("ceiling", "1", 1 / 9)
    bounds = [
        Bound("height", x + 0 * v, upper=ceiling),
        Bound("product", x * v * (1 + TIME), upper=1.0, lower=-1.0),
        Bound("wave", ca.sin(x), upper=1.0),
    ]
    phase = Phase("ride", rates, {x: 0, v: 1}, {x: 0, v: -1}, bounds=bounds, end=1.0)
    found = solved_on(7, Problem("ride", phase, minimise=phase.integral(u**2 / 2)))
    assert not found.verification.passed
    assert any("the violation of 'ride: height' is" in r for r in found.verification.reasons)


def test_equations_hold_between_the_points_too():
    # z + z^3 = x on so coarse a mesh that it fails between the points at first
    height, z = State("height"), Algebraic("z", lower=0)
    law = Bound("law", z + z**3 - height, lower=0, upper=0)
    phase = Phase("fall", {height: -z}, initial={height: 1}, bounds=[law], guess={z: 0.5}, end=1.0)
    problem = Problem("implicit", phase, minimise=phase.at_end(height))
    times, error = np.linspace(0, 1, 10_000), {}
    for refine, refinement in ((False, FixedMesh()), (True, AdaptiveMesh())):
        settings = Settings(Radau(2), intervals=2, refinement=refinement)
        found = solve(problem, settings=settings)
        error[refine] = np.abs(found.sample(law.expression, times)).max()
    (scale,) = (e.size for e in found.scaling.entries if e.kind == "bound")
    assert error[False] > 1e-4
    assert error[True] <= 1e-7 * scale


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


def test_only_what_may_reach_the_level_is_zoomed_into_and_without_one_the_largest():
    asked = set()

    def parabolas(k, tau):
        asked.update(k)
        return k - 2.5 - (tau - 0.437) ** 2

    grid = dense_grid(4)
    k, tau = np.repeat(np.arange(4), grid.size), np.tile(grid, 4)
    values = parabolas(k, tau).reshape(4, -1)
    for level, zoomed in ((0.0, {3}), (-0.5001, {2, 3}), (7.0, set()), (None, {3})):
        asked.clear()
        found = maxima(parabolas, values, grid, level)
        assert asked == zoomed
        np.testing.assert_allclose(found.values[3], 0.5, atol=1e-7 if zoomed else 1e-3)
        np.testing.assert_allclose(found.values, [-2.5, -1.5, -0.5, 0.5], atol=0.02)


def test_a_value_that_is_not_finite_is_the_largest():
    found = all_maxima(lambda k, tau: np.where(tau > 0.9, np.nan, tau), 1)
    assert found.values[0] == np.inf


def test_a_peak_beside_lower_samples_is_found_where_the_highest_sample_is_at_an_end():
    # the end is at -0.4; between two samples there is a narrow peak of 5.7, beside them -80
    grid = dense_grid(4)
    middle = 0.5 * (grid[15] + grid[16])
    curvature = 85.7 / (grid[16] - middle) ** 2

    def values(k, tau):
        return np.maximum(5.7 - curvature * (tau - middle) ** 2, -0.4 - 1e5 * (1.0 - tau))

    samples = values(np.zeros(grid.size, dtype=int), grid)
    assert samples.max() == -0.4  # no sample shows it
    found = all_maxima(values, 1, level=0.0)
    np.testing.assert_allclose(found.values, [5.7], atol=1e-3)
    np.testing.assert_allclose(found.tau, [middle], atol=1e-5)
