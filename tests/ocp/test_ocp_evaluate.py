"""Evaluation between the points: peaks, integrals and values along a motion."""

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
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
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
