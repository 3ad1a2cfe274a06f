"""Breakpoints stand where a motion crosses a kink, and each side keeps to its own dynamics."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Between,
    Control,
    Phase,
    Problem,
    State,
    certify,
    joined,
    load,
    save,
    solve,
)
from ocp.estimates.kink_crossings import KinkCrossings, kink_crossings
from ocp.mesh.mesh import PhaseMesh, uniform
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.kinks import KinkSurfaces
from ocp.problem.kinks import crossable_kinks
from ocp.refinement.policies.kink_breakpoints import (
    are_met,
    with_crossings,
    with_sides,
)

x, v = State("x", "m"), State("v", "m/s")
u = Control("u", "m/s^2")


def pushed(force, cost=0.0):
    """A motion into a force that begins at 1 m, and out of it again."""
    phase = Phase("push", {x: v, v: u - force}, {x: 0, v: 1}, {x: 0, v: -2}, end=2.0)
    return Problem("push", phase, minimise=phase.integral(u**2 + cost))


def pushed_by_parts():
    """The same motion into a soft stop, in phases before, at and behind it."""
    came, went = Between(0.3, 1.6, guess=0.9), Between(0.5, 1.9, guess=1.3)
    before = Phase("before", {x: v, v: u}, {x: 0, v: 1}, {x: 1}, end=came)
    at = Phase("at", {x: v, v: u - 10 * (x - 1)}, final={x: 1}, start=came, end=went)
    behind = Phase("behind", {x: v, v: u}, final={x: 0, v: -2}, start=went, end=2.0)
    phases = before, at, behind
    effort = sum(phase.integral(u**2) for phase in phases)
    return Problem(
        "parts", phases, minimise=effort, links=(*joined(before, at), *joined(at, behind))
    )


# a parabola (t - 1/2)^2 + height, whose kinks are those of |x|
def parabola(height, kinked=None):
    phase = Phase("fall", {x: v, v: 2.0}, {x: 0.25 + height, v: -1}, end=1.0)
    cost = ca.fabs(x) if kinked is None else kinked
    # of a square it is not known that the integral only costs, so that its kinks stay
    return Problem("fall", phase, minimise=phase.integral(cost) ** 2 + phase.at_end(v))


def crossings_of(problem):
    solution = solve(problem)
    return kink_crossings(solution.trajectory, Evaluator(problem), problem.phases[0].name)


@pytest.mark.parametrize(
    ("expression", "above", "below"),
    [
        (lambda a: ca.fabs(a), lambda a: a, lambda a: -a),
        (lambda a: ca.sign(a) * a, lambda a: a, lambda a: -a),
        (lambda a: ca.fmax(3 * a, a), lambda a: 3 * a, lambda a: a),
        (lambda a: ca.fmin(3 * a, a), lambda a: a, lambda a: 3 * a),
        (lambda a: ca.if_else(a > 0, 2 * a, a), lambda a: 2 * a, lambda a: a),
        (lambda a: ca.if_else(a >= 0, 2 * a, a), lambda a: 2 * a, lambda a: a),
    ],
    ids=["fabs", "sign", "fmax", "fmin", "lt", "le"],
)
def test_an_expression_goes_on_as_on_a_given_side(expression, above, below):
    a, side = ca.SX.sym("a"), ca.SX.sym("side")
    kinks = KinkSurfaces.of([expression(a)])
    (held,) = kinks.with_sides([expression(a)], side)
    function = ca.Function("held", [a, side], [held])
    surface = ca.Function("surface", [a], list(kinks.values))

    for value in (-0.7, 0.3):
        # which side is called 1 is the surface's business
        up = float(np.sign(float(surface(value)) * value))
        assert float(function(value, up)) == pytest.approx(float(above(value)))
        assert float(function(value, -up)) == pytest.approx(float(below(value)))
        assert float(function(value, 0)) == pytest.approx(float(expression(ca.DM(value))))


def test_a_kink_is_known_again_in_another_expression():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    kinks = KinkSurfaces.of([ca.fabs(a - b), ca.fmax(a, 1), ca.fabs(a - b) * b])
    assert len(kinks.keys) == 2
    side = ca.SX.sym("side", 2)
    held = kinks.with_sides([7 * ca.fabs(a - b), ca.fabs(a)], side)
    function = ca.Function("held", [a, b, side], held)
    # the second one is no kink of the first three
    assert [float(value) for value in function(1, 3, ca.DM([1, 0]))] == [-14.0, 1.0]


def test_kinks_of_controls_are_not_crossed_by_a_motion():
    problem = pushed(ca.fmax(x - 1, 0) + ca.fabs(u) + ca.fmax(x, u))
    (surface,) = crossable_kinks(problem, "push").values
    assert not ca.depends_on(surface, u.symbol)


@pytest.mark.parametrize(
    ("limits", "sign", "count"),
    [({"lower": 0}, 1, 0), ({"lower": 0}, -1, 0), ({"upper": -1}, 1, 0), ({"lower": -1}, 1, 1)],
)
def test_a_signal_that_keeps_its_sign_makes_no_kink(limits, sign, count):
    speed, force = State("speed", "m/s", **limits), Control("force", "N")
    drag = speed * ca.fabs(sign * speed)
    push = Phase("push", {speed: force - drag}, end=1)
    problem = Problem("push", push, minimise=push.integral(force**2))
    assert len(crossable_kinks(problem, "push").values) == count


def test_crossings_are_found_where_they_are():
    crossings = crossings_of(parabola(-0.0625))
    assert crossings.places == pytest.approx([0.25, 0.75], abs=1e-9)
    assert crossings.behind.tolist() == [-1, 1]
    moving = crossings_of(parabola(-0.0625, ca.fabs(x + 0.0625 - TIME**2)))
    assert moving.places == pytest.approx([0.25], abs=1e-9)


def test_a_motion_that_touches_a_kink_does_not_cross_it():
    assert crossings_of(parabola(0.0)).count == 0
    assert crossings_of(parabola(1e-3)).count == 0


def test_a_step_is_no_kink():
    with pytest.warns(UserWarning, match="jumps"):
        problem = parabola(-0.0625, ca.if_else(x > 0, 2 + x, 1))
    assert crossings_of(problem).count == 0


def test_a_soft_stop_costs_what_it_costs_in_phases():
    solution = solve(pushed(10 * ca.fmax(x - 1, 0)))
    parts = solve(pushed_by_parts())
    assert certify(parts).passed
    assert certify(solution).passed
    assert solution.objective == pytest.approx(parts.objective, rel=1e-7)

    # a breakpoint at each crossing, and hardly any other one
    (motion,), places = solution.trajectory.phases, [p.end for p in parts.trajectory.phases[:2]]
    assert [np.abs(motion.breakpoints - t).min() for t in places] == pytest.approx([0, 0], abs=1e-6)
    assert motion.intervals <= 24


@pytest.mark.parametrize(
    "problem",
    [
        pushed(10 * ca.if_else(x > 1, x - 1, 0)),
        pushed(100 * ca.fmax(x - 1, 0) ** 2),
        pushed(2 * v * ca.fabs(v)),
        pushed(10 * ca.fmax(x - 0.5 - 0.1 * TIME, 0)),
    ],
    ids=["if", "square", "drag", "moving"],
)
def test_what_crosses_a_kink_is_certified(problem):
    solution = solve(problem)
    certificate = certify(solution)
    assert certificate.passed, certificate
    assert solution.trajectory.phases[0].intervals <= 30
    assert all(entry.iterations <= 5 for entry in solution.mesh_iterations[1:])


def test_a_saved_solution_keeps_its_sides(tmp_path):
    solution = solve(pushed(10 * ca.fmax(x - 1, 0)))
    save(solution, tmp_path / "stop.ocp")
    again = load(tmp_path / "stop.ocp")
    sides = again.mesh.phases[0].sides
    assert sides is not None
    assert np.array_equal(sides, solution.mesh.phases[0].sides)
    assert certify(again).passed


def test_a_problem_without_kinks_gives_no_sides():
    solution = solve(pushed(ca.sin(x)))
    assert solution.mesh.phases[0].sides is None


def crossed(breakpoints, places, behind=(1, -1)):
    """A mesh with two breakpoints for crossings of one kink, and where these are."""
    mesh = uniform(10, 4)
    sides = np.zeros((10, 1), dtype=np.int64)
    fractions = mesh.breakpoints.copy()
    for number, (at, side) in enumerate(zip((3, 7), behind, strict=True)):
        fractions[at] = breakpoints[number]
        sides[at - 1], sides[at] = -side, side
    mesh = PhaseMesh(fractions, mesh.degrees, sides=sides)
    off = np.abs(np.asarray(places) - np.asarray(breakpoints))
    zeros = np.zeros(2, dtype=np.int64)
    found = KinkCrossings(
        np.array(places), zeros, np.array(behind), off, 1, np.zeros(10, dtype=bool)
    )
    return mesh, found


def test_breakpoints_that_come_no_nearer_are_given_up():
    nearing = [crossed([0.3, 0.7], [0.3 + 0.01 * 0.5**k, 0.7])[1] for k in range(8)]
    staying = [crossed([0.3, 0.7], [0.31, 0.7])[1] for _ in range(5)]
    assert are_met(nearing, 10)
    assert are_met(staying[:4], 10)
    assert not are_met(staying, 10)


def test_a_breakpoint_follows_its_crossing_and_leaves_known_times_alone():
    solved, crossings = crossed([0.3, 0.7], [0.305, 0.7])
    moved = with_crossings(solved, crossings, np.empty(0), 1e-8)
    assert moved.moved.tolist() == [True, False]
    expected = np.sort(np.append(np.delete(uniform(10, 4).breakpoints, 3), 0.305))
    assert moved.mesh.breakpoints == pytest.approx(expected)
    held = with_crossings(solved, crossings, np.array([0.3]), 1e-8)
    assert {0.3, 0.305} <= set(np.round(held.mesh.breakpoints, 12).tolist())

    sides = with_sides(moved.mesh, moved.crossings, 1e-8).sides
    assert sides is not None
    assert sides.ravel().tolist() == [0, 0, -1, 1, 0, 0, 1, -1, 0, 0]


def test_sides_reach_as_far_as_a_crossing_may_move():
    # the first one was 0.009 from its breakpoint, the second one on it
    _, near = crossed([0.309, 0.7], [0.3, 0.7])
    mesh = uniform(40, 4)
    sides = with_sides(mesh, near, 1e-8).sides
    assert sides is not None
    assert np.flatnonzero(sides[:, 0] == 1).tolist() == [12, 13, 14, 15, 27]
    assert np.flatnonzero(sides[:, 0] == -1).tolist() == [8, 9, 10, 11, 28]
    # and no farther than half-way to the next one, of which each keeps its own
    far = with_sides(mesh, near, 1e-8, np.ones(2)).sides
    assert far is not None
    assert far.ravel().tolist() == [-1] * 12 + [1] * 16 + [-1] * 12
