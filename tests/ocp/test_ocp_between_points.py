"""Degrees of expressions of polynomials, and limits between the points."""

import casadi as ca
import numpy as np
import pytest

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
from ocp.numerics.polynomial_expressions import polynomial_degree

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


def test_a_limit_that_is_exceeded_between_the_points_is_named():
    found = ride(refinement=FixedMesh(), intervals=7)
    assert not found.verification.passed
    assert any("'ride: height' is exceeded by" in r for r in found.verification.reasons)


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
