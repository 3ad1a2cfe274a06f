"""Bounds between the points that no instant exceeds."""

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocp import (
    TIME,
    AdaptiveMesh,
    Algebraic,
    Bound,
    Constant,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    solve,
)
from ocp.numerics.piecewise_polynomial import bernstein
from ocp.numerics.polynomial_expressions import largest, polynomial_degree

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


coefficients = st.lists(st.floats(-1, 1), min_size=1, max_size=9)


@given(coefficients)
def test_bound_is_above_and_close(values):
    bound = largest(np.array([values, [-v for v in values]]), 1e-9)
    dense = bernstein(len(values), np.linspace(0, 1, 2001)) @ np.array(values)
    # the samples miss a maximum by at most curvature / 8 / 2000^2, curvature below 4 * 64
    for found, true in zip(bound, (dense.max(), -dense.min()), strict=True):
        assert true - 1e-12 <= found <= true + 1e-9 + 8e-6


def test_bound_of_a_parabola():
    # 4 t (1 - t) has Bernstein coefficients 0, 2, 0 and the maximum 1
    assert largest(np.array([[0.0, 2.0, 0.0]]), 1e-12)[0] == pytest.approx(1.0, abs=2e-12)
    assert largest(np.array([[0.0, 2.0, 0.0]]), 1e-12)[0] >= 1.0


def ride(**settings):
    """Bryson and Denham's ride with bounds of several kinds."""
    position, speed, thrust = State("position"), State("speed"), Control("thrust")
    ceiling = Constant("ceiling", "1", 1 / 9)
    bounds = [
        Bound("height", position + 0 * speed, upper=ceiling),
        Bound("product", position * speed * (1 + TIME), upper=1.0, lower=-1.0),
        Bound("wave", ca.sin(position), upper=1.0),
    ]
    phase = Phase(
        "ride",
        {position: speed, speed: thrust},
        initial={position: 0, speed: 1},
        final={position: 0, speed: -1},
        bounds=bounds,
        end=1.0,
    )
    return solve(
        Problem("ride", phase, minimise=phase.integral(thrust**2 / 2)),
        settings=Settings(**settings),
    )


def test_margins_stand_beside_the_dense_values():
    found = ride()
    margins = {m.name: m for m in found.verification.margins}
    assert set(margins) == {"height", "product", "wave"}
    assert margins["wave"].rigorous is None  # no polynomial
    for name in ("height", "product"):
        margin = margins[name]
        # 1e-10 from the subdivision, 2e-9 from round-off at degree 24
        assert margin.dense <= margin.rigorous <= margin.dense + 3e-9
    assert margins["height"].rigorous <= 1e-7 + 3e-9  # the dense value is held to 1e-7
    times = np.linspace(0, 1, 10_000)
    position = found.sample("position", times)
    product = position * found.sample("speed", times) * (1 + times)
    assert margins["height"].rigorous >= 9 * position.max() - 1
    assert margins["product"].rigorous >= np.abs(product).max() - 1


def test_a_leak_between_the_points_is_bounded_too():
    found = ride(refinement=FixedMesh(), intervals=7)
    (height,) = (m for m in found.verification.margins if m.name == "height")
    assert height.rigorous >= height.dense > 1e-4
    # its size leaves the leak itself out, and a bound may be 1e-10 above
    assert height.rigorous == pytest.approx(height.dense, rel=1e-3)
    assert not found.verification.passed
    assert any("'height' in phase 'ride' may be exceeded" in r for r in found.verification.reasons)


def test_a_peak_is_bounded():
    position, speed, thrust = State("position"), State("speed"), Control("thrust")
    phase = Phase(
        "move",
        {position: speed, speed: thrust},
        initial={position: 0, speed: 0},
        final={position: 1, speed: 0},
        end=1.0,
    )
    found = solve(Problem("softly", phase, minimise=phase.peak(thrust, absolute=True)))
    bounds = [m.rigorous for m in found.verification.margins]
    assert len(bounds) == 2  # both sides of the absolute value
    assert all(math.isfinite(b) and b <= 1e-7 for b in bounds)


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
