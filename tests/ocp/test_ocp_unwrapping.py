"""Steering angles without bounds: unwrapped where a turn changes nothing, and nowhere else."""

import re
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    AdaptiveMesh,
    Between,
    Bound,
    Control,
    NumericalTrouble,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    certify,
    solve,
)
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.piecewise_polynomial import bernstein
from ocp.optimality.unwrapping import periods, unwrapped
from ocp.transcription.packing import trajectory_of
from tests.ocp.problems import pendulum


def crossing(cost=None, angle=None, extra=(), factor=1.0):
    """Zermelo's boat in a current that grows with the distance from the bank, in the least time.

    Bryson and Ho, "Applied Optimal Control", section 2.7, example 1, in units of h and V.
    """
    x, y = State("x"), State("y")
    heading = angle or Control("heading", "rad")
    a = factor * heading
    ride = Phase(
        "ride",
        {x: ca.cos(a) - y, y: ca.sin(a)},
        {x: 3.66, y: -1.86},
        {x: 0, y: 0},
        end=Between(0.5, 30, 6),
        bounds=[make(heading, x) for make in extra],
    )
    goal = ride.end_time + (0 if cost is None else ride.integral(cost(heading)))
    return Problem("crossing", ride, minimise=goal)


def periods_of(problem):
    return periods(problem, 0)


@pytest.mark.parametrize(("factor", "turn"), [(1.0, 2 * np.pi), (np.pi / 180, 360.0)])
def test_a_free_heading_has_the_period_of_its_sines(factor, turn):
    assert periods_of(crossing(factor=factor)) == pytest.approx({"heading": turn})


def test_of_several_frequencies_the_longest_period_counts():
    # H = sin(2 a) + cos(3 a) comes again after a whole turn of a only
    problem = crossing(cost=lambda a: 0.01 * (ca.sin(2 * a) + ca.cos(3 * a)))
    assert periods_of(problem) == pytest.approx({"heading": 2 * np.pi})


@pytest.mark.parametrize(
    "options",
    [
        {"cost": lambda a: 1e-6 * a**2},
        {"angle": Control("heading", upper=100.0)},
        {"extra": [lambda a, x: Bound("cone", a - x, upper=50.0)]},
        {"cost": lambda a: 1e-6 * ca.sin(0.37 * a)},
    ],
    ids=["a cost on itself", "a bound", "a link to a state", "an incommensurable frequency"],
)
def test_an_angle_that_something_notices_is_never_shifted(options):
    assert periods_of(crossing(**options)) == {}


def test_a_turn_that_is_wanted_stays():
    # the angle is asked to be 0, then a whole turn: the same direction, but not the same cost
    x, a = State("x"), Control("heading")
    wanted = ca.if_else(TIME < 0.5, 0.0, 2 * np.pi)
    ride = Phase("ride", {x: ca.cos(a)}, {x: 0}, end=1.0)
    problem = Problem("turn", ride, minimise=ride.integral((a - wanted) ** 2) - ride.at_end(x))
    assert periods_of(problem) == {}
    solution = solve(problem)
    # both parts at their best: no cost, and the farthest way
    assert solution.objective == pytest.approx(-1.0, abs=1e-6)
    assert solution.sample(a, [0.25, 0.75]) == pytest.approx([0, 2 * np.pi], abs=1e-4)


def test_a_boat_crosses_in_few_rounds_and_its_heading_is_smooth():
    solution = solve(crossing())
    # Bryson and Ho give 5.46 h/V
    assert solution.objective == pytest.approx(5.46, abs=0.01)
    assert len(solution.mesh_iterations) <= 4
    assert certify(solution).passed
    heading = solution.sample("heading", np.linspace(0, solution.objective, 2001))
    assert np.abs(np.diff(heading)).max() < 0.1


def test_shifted_points_are_shifted_back_and_rows_stay():
    solution = solve(crossing())
    iterate = solution.iterate
    (group,) = iterate.transcription.columns.phases[0].groups[:1]

    # one point of one interval a turn away
    ids, tau = group.controls[0][1, :, 0], group.collocation.points
    basis, size = bernstein(tau.size, tau), iterate.scales.signals["heading"]
    x = iterate.x.copy()
    values = basis @ x[ids]
    values[1] += 2 * np.pi / size
    x[ids] = np.linalg.solve(basis, values)
    broken = replace(
        iterate, x=x, trajectory=trajectory_of(iterate.transcription, x, iterate.parameters)
    )
    mended = unwrapped(broken, Evaluator(iterate.problem))
    oracle, constants = iterate.transcription.program.oracle, iterate.parameters.vector
    rows = [np.array(oracle(i.x, constants)[1]).ravel() for i in (iterate, broken, mended)]
    # rounding of an angle that was shifted and of a basis that was inverted
    assert rows[1] == pytest.approx(rows[0], abs=1e-10)
    assert rows[2] == pytest.approx(rows[0], abs=1e-10)
    assert mended.x[ids] == pytest.approx(iterate.x[ids], abs=1e-9)
    assert unwrapped(iterate, Evaluator(iterate.problem)) is iterate


@pytest.mark.slow
def test_an_angle_with_a_small_cost_that_is_lost_is_said_to_need_bounds():
    """What comes of it is chance: the angle is lost, or a motion is found that turns at jumps."""

    # a turn of the heading costs a little, so that it is never unwrapped
    def priced(**bounds):
        angle = Control("heading", "rad", **bounds)
        return crossing(cost=lambda heading: 1e-4 * heading**2, angle=angle)

    def told(problem):
        try:
            found = solve(problem)
        except NumericalTrouble as error:
            return str(error)
        assert not certify(found).passed
        return found.verdict

    assert re.search(r"'heading'.*bound this angle, as in Control|may improve", told(priced()))
    # as the message says; without the cost the crossing takes 5.45787 s, and it is less than
    # 1e-4 pi^2 times that more
    assert 5.45787 < solve(priced(lower=-4, upper=4)).objective < 5.45787 * 1.001


@pytest.mark.slow
def test_a_mesh_of_one_point_an_interval_has_no_turns_to_look_at():
    coarse = AdaptiveMesh(rounds=3)
    settings = Settings(scheme=Radau(1), intervals=2, verify=False, refinement=coarse)
    assert len(solve(pendulum(), settings=settings).mesh_iterations) >= 3
