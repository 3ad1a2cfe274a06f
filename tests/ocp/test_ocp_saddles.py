"""Answers that meet all first-order conditions and are saddles: refused, and left by families."""

import dataclasses
import math
from itertools import chain

import casadi as ca
import numpy as np
import pytest

from ocp import (
    Between,
    Bound,
    Constant,
    Control,
    Phase,
    Problem,
    Solution,
    State,
    certify,
    family,
    homotopy,
    solve,
)
from ocp.analysis.saddles import added_curvature, starts_beside
from ocp.nlp.solver import StartingPoint

PUSH = Constant("push", "1/s^2", 5.0)

# where standing still stops to be best: half a sine wave costs pi^2 and gains the push
BIFURCATION = math.pi**2


def unstable(*, lowest: float = -1.0, offset: float = 0.0) -> Problem:
    """Leave the origin and return in a second: moving costs, being away gains."""
    x = State("x", "m", lower=lowest, upper=1.0)
    u = Control("u", "m/s", lower=-20.0, upper=20.0)
    phase = Phase("way", {x: u}, {x: 0}, {x: 0}, end=1.0)
    return Problem("unstable", phase, minimise=phase.integral(offset + u**2 - PUSH * x**2))


def least(push: float) -> float:
    """The optimum: sine waves up to the limit 1 m and back, and at the limit between them.

    On the way to the limit ``x = sin(r t)`` with ``r`` the root of the push, for a quarter of a
    period, over which the mean of cosine squared equals that of sine squared.
    """
    if push <= BIFURCATION:
        return 0.0
    quarter = math.pi / 2 / math.sqrt(push)
    return -push * (1.0 - 2.0 * quarter)


def globe() -> tuple[Problem, Constant]:
    """From one point of the equator to another; the pole is closed by a cap of `CAP`."""
    turn = Constant("turn", "rad", 2.0)
    polar, azimuth = State("polar", "rad", lower=CAP, upper=math.pi - CAP), State("azimuth", "rad")
    south, east = Control("south", "rad/s"), Control("east", "rad/s")
    dynamics, equator = {polar: south, azimuth: east}, math.pi / 2
    phase = Phase(
        "way", dynamics, {polar: equator, azimuth: 0}, {polar: equator, azimuth: turn}, end=1.0
    )
    speed = south**2 + ca.sin(polar) ** 2 * east**2
    return Problem("globe", phase, minimise=phase.integral(speed)), turn


CAP = 0.1


@pytest.fixture(scope="module")
def still() -> Solution:
    """The optimum of a push of 5: to stand still."""
    return solve(unstable())


def test_a_family_leaves_an_optimum_that_has_become_a_saddle(still: Solution) -> None:
    found = family(still.problem, PUSH, [5.0, 9.0, 12.0, 20.0])
    assert found.objectives[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    expected = [least(value) for value in (12.0, 20.0)]
    # members lie on few intervals, and are refined when they are asked for
    assert found.objectives[2:] == pytest.approx(expected, rel=2e-3)
    assert found.solution(3).objective == pytest.approx(expected[1], rel=1e-6)


@pytest.mark.parametrize("lowest", [-0.1, -3e-4])
def test_the_better_side_of_a_saddle_is_taken(lowest: float) -> None:
    # downwards there is next to no room
    found = family(unstable(lowest=lowest), PUSH, [5.0, 9.0, 12.0])
    assert found.objectives[0] == pytest.approx(0.0, abs=1e-9)
    assert found.solution(2).objective == pytest.approx(least(12.0), rel=2e-6)


def test_a_motion_that_vanishes_gives_the_objective_no_size() -> None:
    found = solve(unstable(lowest=-0.1))
    assert found.objective == pytest.approx(0.0, abs=1e-9)
    assert found.kept_iterate.scales.objective > 1.0


def test_a_homotopy_leaves_a_great_circle_that_is_no_shortest_way() -> None:
    # beyond half a turn the equator is a saddle. The best way touches the cap a quarter of a turn
    # from both ends: each side of that triangle is a quarter of a great circle
    problem, turn = globe()
    path = homotopy(problem, turn, [2.9, 4.7])
    short, long = path.solutions
    assert short.objective == pytest.approx(2.9**2, rel=1e-7)
    assert long.objective == pytest.approx(
        (math.pi + math.sin(CAP) * (4.7 - math.pi)) ** 2, rel=1e-6
    )


def test_a_certificate_refuses_a_saddle(still: Solution) -> None:
    saddle = solve(still.problem, guess=still, constants={PUSH: 20.0})
    assert saddle.objective == pytest.approx(0.0, abs=1e-9)
    refused = [check for check in certify(saddle).checks if not check.passed]
    assert [check.name for check in refused] == ["a second solve"]
    assert refused[0].start is not None


def test_a_certificate_is_refused_if_the_objective_runs_away(
    still: Solution,
) -> None:
    assert certify(still).passed
    x, u = State("x", "m"), Control("u", "m/s")
    ends = Phase("way", {x: u}, end=1.0, guess={x: 0.0, u: 0.0})
    returns = Bound("returns", ends.at_end(x) - ends.at_start(x), "m", lower=0, upper=0)
    problem = Problem("away", ends, minimise=ends.integral(u**2 - 5 * x**2), links=[returns])
    certificate = certify(solve(problem))
    (second,) = (check for check in certificate.checks if check.name == "a second solve")
    assert second.failed
    assert "runs away" in second.sentence
    assert not certificate.passed


def test_curvature_is_added_at_a_saddle_alone(still: Solution) -> None:
    def added(push: float) -> float:
        iterate = still.kept_iterate
        point = StartingPoint(iterate.x, (iterate.bound_multipliers, iterate.row_multipliers))
        program = iterate.transcription.program
        return added_curvature(program, point, iterate.limits, np.array([push]))

    # standing still is stationary for every push
    assert added(0.9 * BIFURCATION) == 0.0
    assert added(1.1 * BIFURCATION) > 0.0


def test_starts_beside_a_point_keep_to_its_limits(still: Solution) -> None:
    iterate = still.kept_iterate
    lower, upper = iterate.limits.columns
    point = StartingPoint(np.where(np.isfinite(lower), lower, iterate.x))
    for start in chain.from_iterable(starts_beside(point, iterate.limits)):
        assert np.all((start.x >= lower) & (start.x <= upper))
        # what lies on a limit stays, the rest does not
        assert np.array_equal(start.x == point.x, point.x == lower)


def test_an_optimum_costs_no_further_solve(still: Solution) -> None:
    again = solve(still.problem, guess=still)
    assert len(again.mesh_iterations) == 1
    assert dataclasses.asdict(again.verification)["passed"]


def test_what_limits_of_times_leave_no_room_for_is_certified() -> None:
    """The start of the second phase hardly matters, and lies between limits of its duration."""
    x, v, m = State("x"), State("v"), State("m", lower=0.2)
    u, meeting = Control("u", lower=0.0, upper=3.0), Between(0.05, 5)
    burn = Phase(
        "burn", {x: v, v: u / m - 1 - 0.1 * v**2, m: -0.3 * u}, {x: 0, v: 0, m: 1}, end=meeting
    )
    y, w = State("y"), State("w")
    coast = Phase(
        "coast",
        {y: w, w: -1 - 0.02 * w**2},
        final={y: 1, w: 0},
        start=meeting,
        end=Between(0.1, 10),
    )
    links = [
        Bound("x", coast.at_start(y) - burn.at_end(x), lower=0, upper=0),
        Bound("v", coast.at_start(w) - burn.at_end(v), lower=0, upper=0),
    ]
    cost = 0.05 * coast.end_time - burn.at_end(m)
    found = solve(Problem("unlinked times", [burn, coast], minimise=cost, links=links))
    assert certify(found).passed
