"""How errors grow along a motion: the exponential against SciPy's, growth in closed form."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from ocp import Control, Phase, Problem, Settings, State, solve
from ocp.mesh.trajectory import PhaseTrajectory, SignalGroup
from ocp.numerics.piecewise_polynomial import Bernstein, Piece, PiecewisePolynomial
from ocp.numerics.schemes import Radau
from ocp.verification.simulation import exponential, growth, segments, transitions


@pytest.mark.parametrize("size", [0.0, 1e-8, 0.3, 5.0, 40.0])
def test_the_exponential_is_that_of_scipy(size: float) -> None:
    matrices = size * np.random.default_rng(1).normal(size=(5, 4, 4)) / 4
    wanted = expm(matrices)
    error = np.abs(exponential(matrices) - wanted).max(axis=(1, 2))
    # both square back; a growth by 1e10 costs a few digits, a factor of interest 1e6
    assert (error <= 1e-11 * np.abs(wanted).max(axis=(1, 2))).all()


def test_what_overflows_is_not_finite_and_warns_nobody() -> None:
    found = exponential(np.array([[[1e6, 0.0], [0.0, 0.0]]]))
    assert not np.isfinite(found).all()


def motion(breakpoints: list[float], **constants: float) -> PhaseTrajectory:
    """A phase in which every signal stays where it is."""
    points, count = np.array(breakpoints), len(breakpoints) - 1

    def held(kind: str, names: tuple[str, ...]) -> SignalGroup:
        values = np.tile([constants[name] for name in names], (count, 1, 1))
        piece = Piece(np.arange(count), Bernstein(1), values)
        return SignalGroup(kind, names, PiecewisePolynomial(points, (piece,)))

    groups = (held("state", ("angle", "rate")), held("control", ("push",)))
    return PhaseTrajectory("swing", Radau(1), points, np.ones(count, dtype=int), groups)


def test_transitions_of_a_pendulum_at_rest() -> None:
    # x'' = -g sin x + u at x = 0: errors turn as those of an oscillator of frequency sqrt(g)
    x, u, t = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("t")
    rate = ca.Function("rate", [x, u, t], [ca.vertcat(x[1], u - 4.0 * ca.sin(x[0]))])
    sizes = np.array([0.1, 10.0])
    found = transitions(rate, motion([0.0, 0.3, 1.0], angle=0.0, rate=0.0, push=0.0), sizes)
    for matrix, h in zip(found, (0.3, 0.7), strict=True):
        c, s = np.cos(2.0 * h), np.sin(2.0 * h)
        exact = np.array([[c, s / 2.0], [-2.0 * s, c]]) * sizes / sizes[:, None]
        # the Jacobian is exact and constant: rounding of the exponential alone
        np.testing.assert_allclose(matrix, exact, rtol=1e-12, atol=1e-12)


def test_where_there_is_no_derivative_growth_is_taken_as_none() -> None:
    x, u, t = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("t")
    rate = ca.Function("rate", [x, u, t], [ca.vertcat(x[1], ca.sqrt(x[0]) + u)])
    found = transitions(rate, motion([0.0, 1.0], angle=0.0, rate=0.0, push=0.0), np.ones(2))
    np.testing.assert_allclose(found[0], [[1.0, 1.0], [0.0, 1.0]], atol=1e-14)


def test_segments_amplify_less_than_is_allowed() -> None:
    steps = np.full((20, 1, 1), 10.0)  # errors grow tenfold in each of twenty intervals
    assert growth(steps) == pytest.approx(1e20)
    parts = segments(steps)
    assert [part.start for part in parts[1:]] == [part.stop for part in parts[:-1]]
    assert (parts[0].start, parts[-1].stop) == (0, 20)
    assert all(growth(steps[part]) <= 1e6 for part in parts)


def test_an_unstable_motion_is_held_to_its_nodes_and_says_so():
    x, u = State("x"), Control("u")
    phase = Phase("balance", {x: 12 * ca.sin(x) + u}, {x: 0.5}, {x: 0}, end=1.0)
    problem = Problem("balance", [phase], minimise=phase.integral(u**2 + x**2))
    found = solve(problem, settings=Settings(accuracy=1e-3, intervals=4))
    check = found.verification
    assert check.passed
    assert check.restarts > 0
    assert check.miss <= 1e-3 < 0.05 < check.one_run
    assert f"in one run it misses the end by {check.one_run:.1e} (errors grow 15" in found.verdict
    assert found.objective == pytest.approx(solve(problem).objective, rel=found.accuracy)
