"""Back-off: limits that are kept between the points because the points keep inside them."""

import casadi as ca
import numpy as np
import pytest

from ocp import (
    AdaptiveMesh,
    Bound,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    State,
    certify,
    load,
    peak,
    save,
    solve,
)
from ocp.estimates.promised_gain import back_off_costs
from ocp.mesh.mesh import Mesh, uniform
from ocp.refinement.policies import adaptive_mesh, back_off
from tests.ocp.problems import bryson_denham, check_of, double_integrator


def under_a_roof(roof):
    """Bryson and Denham's problem with the roof as a path constraint."""
    x, v, u, rates = double_integrator()
    limit = Bound("roof", 1.0 * x.symbol, "m", upper=roof)
    phase = Phase("move", rates, {x: 0, v: 1}, {x: 0, v: -1}, end=1.0, bounds=[limit])
    return Problem("roof", [phase], minimise=phase.integral(0.5 * u**2))


def stiffening():
    """Least peak of a force whose factor grows along the way, under a cap on the jerk."""
    x, v, a = State("x", "m"), State("v", "m/s"), State("a", "m/s^2")
    jerk = Control("jerk", "m/s^3", lower=-60, upper=60, piecewise="linear")
    phase = Phase("move", {x: v, v: a, a: jerk}, {x: 0, v: 0, a: 0}, {x: 1, v: 0, a: 0}, end=1.0)
    force = a.symbol * (1 + ca.sin(3 * x.symbol)) + v.symbol**2
    return Problem("stiffening", [phase], minimise=peak((phase, force)))


@pytest.mark.parametrize("problem", [under_a_roof, bryson_denham])
def test_a_back_off_moves_the_limit_at_the_points(problem):
    intervals, distance = 12, 0.01
    settings = Settings(refinement=FixedMesh())
    plain = Mesh((uniform(intervals, 4),))
    inside = Mesh(plain.phases, back_off=({0: np.full(intervals, distance)},))
    moved = solve(problem(0.12), settings=settings, mesh=inside)
    lower = solve(problem(0.12 - distance), settings=settings, mesh=plain)
    assert moved.objective == pytest.approx(lower.objective, rel=1e-9)


def test_the_ends_of_a_phase_keep_their_values_on_a_bound():
    """Both ends of the motion lie on a bound that its points keep away from."""
    x, v, u = State("x", "m", lower=0.0), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("hop", {x: v, v: u}, {x: 0, v: 1}, {x: 0, v: -1}, end=1.0)
    problem = Problem("hop", [phase], minimise=phase.integral(0.5 * u**2))
    mesh = Mesh((uniform(8, 4),), back_off=({0: np.full(8, 1e-3)},))
    moved = solve(problem, settings=Settings(refinement=FixedMesh()), mesh=mesh)
    heights = moved.sample(x, np.linspace(0, 1, 9))
    assert heights[[0, -1]] == pytest.approx(0.0, abs=1e-12)
    assert heights[1:-1].min() >= 1e-3


@pytest.mark.slow
def test_leaks_that_points_do_not_close_are_closed_by_back_offs(monkeypatch, tmp_path):
    with_back_off = solve(stiffening())
    kept = with_back_off.mesh.back_off[0]
    assert any(values.any() for values in kept.values())
    assert with_back_off.verification.passed

    file = tmp_path / "stiffening.ocp"
    save(with_back_off, file)
    loaded = load(file).mesh.back_off[0]
    assert all(np.array_equal(loaded[number], kept[number]) for number in kept)

    # what they cost is below the tolerance on the objective
    monkeypatch.setattr(adaptive_mesh, "chosen_back_offs", lambda *_, **__: [{}])
    with_points = solve(stiffening())
    assert not any(values.any() for values in with_points.mesh.back_off[0].values())
    tolerance = Settings().accuracy.objective
    assert with_back_off.objective == pytest.approx(with_points.objective, rel=tolerance)


def test_a_back_off_that_costs_too_much_is_not_taken(monkeypatch):
    monkeypatch.setattr(back_off, "_BACK_OFF_COST", 0.0)
    solution = solve(stiffening(), settings=Settings(refinement=AdaptiveMesh()))
    assert not any(values.any() for values in solution.mesh.back_off[0].values())
    assert solution.verification.passed


def held_below_a_roof(distance):
    """A mesh whose points keep that far below the roof of 0.12, and the motion on it."""
    plain = uniform(24, 4)
    mesh = Mesh((plain,), back_off=({0: np.full(plain.intervals, distance)},))
    return mesh, solve(under_a_roof(0.12), settings=Settings(refinement=FixedMesh()), mesh=mesh)


def test_what_a_back_off_costs_is_promised_as_a_gain():
    """The optimum is 4 / (9 roof): its slope times the back-off, relative to it, is closed form."""
    distance = 1e-4
    _, moved = held_below_a_roof(distance)
    costs = back_off_costs(moved.iterate, 0)
    assert costs.sum() == pytest.approx(distance / (0.12 - distance), rel=1e-2)

    check = check_of(moved, "finer controls")
    assert not check.passed
    assert check.value >= costs.sum()


def test_a_back_off_that_turned_out_dear_is_given_up():
    """It is 8e-4 of the objective, eight hundred times the tolerance."""
    mesh, moved = held_below_a_roof(1e-4)
    assert moved.objective > 4 / (9 * 0.12) * (1 + 8e-4)
    found = solve(under_a_roof(0.12), mesh=mesh)
    assert found.objective == pytest.approx(4 / (9 * 0.12), rel=1e-6)
    assert certify(found).passed
