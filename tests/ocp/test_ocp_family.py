"""Families, Pareto fronts and objectives in order: each motion from the one before."""

import dataclasses
import itertools
import math
import os
import signal

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    AdaptiveMesh,
    Constant,
    Control,
    Family,
    FamilyStopped,
    FixedMesh,
    Interrupted,
    Ipopt,
    Phase,
    Problem,
    Settings,
    SolveFailed,
    State,
    StatementError,
    family,
    front,
    solve,
    solve_lexicographic,
    with_objective,
)
from ocp.refinement.policies.moving_mesh import KeptWhileGood
from tests.ocp.problems import STRONGEST, double_integrator, least_time, race, rest_to_rest

FEW, SIX = Settings(intervals=8), Settings(intervals=6)


def test_members_follow_their_switch_on_one_mesh_and_few_meshes_are_made():
    values = np.linspace(1.0, 6.0, 26)
    found = family(race(), STRONGEST, values, settings=FEW)
    assert found.values == pytest.approx(values)
    # the tolerance of a solve with default settings, which the members need not be refined for
    assert found.objectives == pytest.approx([least_time(value) for value in values], rel=1e-5)
    assert not any(member.alone for member in found.members[1:])
    assert len({id(member.iterate.transcription) for member in found.members}) <= 5

    # the switch lies where the speed is highest
    motion = found.members[-1].trajectory.phases[0]
    assert np.abs(motion.fractions - 1 / 7).min() < 1e-5
    assert "26 members" in repr(found)
    assert "6: objective" in repr(found.members[-1])


def test_a_member_refined_and_verified_is_what_a_solve_finds():
    problem = race()
    found = family(problem, STRONGEST, [1.0, 1.5, 2.0], settings=FEW)
    solutions = found.solutions()
    for value, solution in zip(found.values, solutions, strict=True):
        assert solution.verdict.startswith("local")
        assert solution.verification.passed
        assert solution.trajectory.constants["strongest"] == value
    alone = solve(problem, settings=FEW, constants={STRONGEST: 2.0})
    assert solutions[-1].objective == pytest.approx(alone.objective, rel=1e-5)
    assert solutions[-1].iterations < alone.iterations


def test_a_mesh_that_stays_is_everybodys():
    fixed = dataclasses.replace(FEW, refinement=FixedMesh())
    found = family(race(), STRONGEST, [1.0, 1.02, 1.04], settings=fixed)
    assert len({id(member.iterate.transcription) for member in found.members}) == 1
    # the switch of the second lies within an interval of eight
    assert found.objectives == pytest.approx([least_time(v) for v in found.values], rel=1e-2)


def test_a_member_far_from_its_neighbour_is_refined_on_a_mesh_of_its_own():
    short = dataclasses.replace(FEW, solver=Ipopt(max_iterations=40))
    found = family(race(), STRONGEST, [1.0, 1.01, 1e3], settings=short)
    assert found.objectives[-1] == pytest.approx(least_time(1e3), rel=1e-5)


def test_a_member_that_is_not_found_is_named_and_those_before_it_are_kept():
    words = (
        r"family in 'strongest' stopped at 0\.001 m/s\^2: .*; error.family contains the 2 members"
    )
    with pytest.raises(FamilyStopped, match=words) as caught:
        family(race(), STRONGEST, [1.0, 1.01, 1e-3], settings=FEW)
    kept = caught.value.family
    assert isinstance(kept, Family)
    assert kept.solution(1).objective == pytest.approx(least_time(1.01), rel=1e-6)


@pytest.mark.parametrize("values", [[], [1.0, math.nan]])
def test_a_family_needs_values(values):
    with pytest.raises(StatementError, match=r"family in 'strongest' has the values .* give one"):
        family(race(), STRONGEST, values)


def test_values_are_checked_like_those_of_a_solve():
    with pytest.raises(StatementError, match="contradict each other"):
        family(race(), STRONGEST, [1.0, -2.0], settings=FEW)


def test_other_constants_keep_their_values():
    way = Constant("way", "m", 1.0)
    found = family(race(way), STRONGEST, [1.0, 1.2], settings=FEW, constants={way: 4.0})
    assert found.objectives == pytest.approx([2 * least_time(v) for v in (1.0, 1.2)], rel=1e-5)
    assert found.solution(1).objective == pytest.approx(2 * least_time(1.2), rel=1e-5)


def test_a_family_that_is_stopped_says_where():
    count = 0

    def stopping(line):
        nonlocal count
        count += 1
        if count == 200:  # the first member takes less than half of these iterations
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match=r"the family of 'race' was stopped at 'strongest' = "):
        family(race(), STRONGEST, np.linspace(1.0, 6.0, 200), settings=FEW, progress=stopping)


def test_a_policy_that_keeps_a_good_mesh_has_the_numbers_of_the_one_it_holds():
    policy = AdaptiveMesh(rounds=7, highest_degree=6)
    kept = KeptWhileGood(policy)
    assert (kept.adapts, kept.rounds, kept.highest_degree) == (True, 7, 6)


@pytest.mark.slow
def test_a_step_at_a_time_that_varies_is_not_passed_over():
    """J = 1 / (c + 4 (1 - c)): a gear that doubles the speed from time c on."""
    change = Constant("change", "s", 0.2)
    x, u = State("x"), Control("u")
    phase = Phase("go", {x: u * ca.if_else(change > TIME, 1, 2)}, {x: 0}, {x: 1}, end=1.0)
    values = np.array([0.2, 0.25, 0.4, 0.55])
    found = family(Problem("gear", phase, minimise=phase.integral(u**2)), change, values)
    assert found.objectives == pytest.approx(1 / (4 - 3 * values), rel=2e-5)


@pytest.mark.slow
def test_members_see_a_gust_between_the_points_of_a_neighbour():
    """It changes the speed by 0.5 m/s in next to no time, at a time that varies."""
    at = Constant("at", "s", 0.4321)
    x, v, u, _ = double_integrator()
    gust = 0.5e4 / np.sqrt(np.pi) * ca.exp(-(((TIME - at) * 1e4) ** 2))
    move = Phase("move", {x: v, v: u + gust}, {x: 0, v: 0}, {x: 1, v: 0}, end=1.0)
    problem, times = Problem("gust", move, minimise=move.integral(u**2)), np.linspace(0.43, 0.6, 4)
    ways = 1 - 0.5 * (1 - times)
    expected = 12 * (ways**2 + 0.5 * ways) + 1
    assert family(problem, at, times).objectives == pytest.approx(expected, rel=1e-4)


def load():
    """1 kg moved by 1 m in 2 s, from rest to rest: its peak force and its heat."""
    _, _, force, move = rest_to_rest(end=2.0)
    heat = move.integral(force**2)
    return Problem("load", move, minimise=heat), move.peak(force, absolute=True), heat


def least_heat(peak):
    """The force is a straight line in time that is cut off at the peak."""
    straight = math.sqrt(3 * (1 - 1 / peak))
    return 2 * peak**2 * (1 - 2 * straight / 3)


def test_a_front_lies_on_its_closed_form_and_has_its_slopes():
    problem, peak, heat = load()
    found = front(problem, limited=peak, minimised=heat, points=5)
    assert len(found.points) >= 4
    assert not found.gaps
    # the minimum of the heat has a peak of 1.5 N, and no motion has a peak below 1 N
    assert found.points[0].x == pytest.approx(1.0, rel=3e-3)
    # the front is flat there: points nearer than a hundredth are alike to six digits
    assert found.points[-1].x == pytest.approx(1.5, rel=1e-2)
    for point in found.points:
        assert point.y == pytest.approx(least_heat(point.x), rel=1e-4)
        assert point.motion.verification.passed
    for point in found.points[1:-1]:
        step = 1e-5
        slope = (least_heat(point.limit + step) - least_heat(point.limit - step)) / (2 * step)
        # it vanishes at the flat end
        assert point.slope == pytest.approx(slope, rel=1e-2, abs=1e-3)
    assert all(a.x < b.x and a.y > b.y for a, b in itertools.pairwise(found.points))
    assert found.knee in found.points[1:-1]


@pytest.mark.slow
def test_a_front_between_stated_limits():
    problem, peak, heat = load()
    found = front(problem, limited=peak, minimised=heat, limits=(1.1, 1.3), points=2)
    np.testing.assert_allclose([found.points[0].x, found.points[-1].x], [1.1, 1.3], rtol=1e-5)


def test_an_end_that_no_motion_attains_is_left_open():
    problem, peak, heat = load()
    found = front(problem, limited=peak, minimised=heat, limits=(0.5, 1.3), points=4)
    assert [point.x for point in found.points] == pytest.approx([1.3], rel=1e-5)
    assert "no motion was found at the limit 0.5" in found.remarks[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"points": 1}, "the number of points of the Pareto front is 1; give 2 or more"),
        (
            {"limits": (2, 1)},
            r"the limits \(2, 1\) of the Pareto front are not in order; give \(lowest, highest\)",
        ),
    ],
)
def test_a_front_refuses_in_a_sentence(options, words):
    problem, peak, heat = load()
    with pytest.raises(StatementError, match=words):
        front(problem, limited=peak, minimised=heat, **options)


def push():
    """From rest with |u| <= 1: at most 1/2 m in 1 s."""
    x, v, u, rates = double_integrator(lower=-1, upper=1)
    phase = Phase("push", rates, {x: 0, v: 0}, end=1.0)
    return Problem("push", phase, maximise=phase.at_end(x)), phase, x, u


def test_each_objective_has_its_own_concession():
    problem, phase, x, u = push()
    end, effort = phase.at_end(x), phase.integral(u**2)
    found = solve_lexicographic(
        problem, [-end, effort, -phase.at_start(u)], slack=[1e-2, 1e-1, 0.0], settings=SIX
    )
    first, second, third = found.levels
    assert first.value == pytest.approx(-0.5, rel=1e-6)
    assert first.held == pytest.approx(-0.5 * (1 - 1e-2), rel=1e-6)
    assert second.held == pytest.approx(1.1 * second.value)
    assert third.held is None
    assert found.solution is third.solution
    assert found.solution.value(end) >= 0.495 * (1 - 1e-6)
    assert found.solution.value(effort) <= second.held * (1 + 1e-6)


def test_a_solution_of_the_first_objective_is_not_solved_again():
    problem, phase, x, u = push()
    first = solve(with_objective(problem, -phase.at_end(x)), settings=SIX)
    found = solve_lexicographic(
        problem, [-phase.at_end(x), phase.integral(u**2)], slack=1e-2, first=first, settings=SIX
    )
    assert found.levels[0].solution is first
    assert found.solution.value(phase.at_end(x)) == pytest.approx(0.495, rel=1e-5)


def test_terms_beside_are_not_held():
    # a heavy price of effort shortens the way, and only the way that is left is held
    problem, phase, x, u = push()
    effort = phase.integral(u**2)
    found = solve_lexicographic(
        problem, [-phase.at_end(x), effort], beside=[effort, 0], slack=1e-6, settings=SIX
    )
    # u = (1 - t) / 2 costs 1/12 and goes 1/6 m
    assert found.levels[0].value == pytest.approx(-1 / 6, rel=1e-6)
    assert found.solution.value(phase.at_end(x)) == pytest.approx(1 / 6, rel=1e-5)


def test_a_later_objective_that_fails_keeps_what_was_found():
    problem, phase, x, u = push()
    few = Settings(intervals=6, iterations=1)
    objectives = [-phase.at_end(x), phase.integral(u**2)]
    found = solve_lexicographic(problem, objectives, slack=1e-2, settings=[SIX, few])
    assert found.solution is found.levels[0].solution
    assert isinstance(found.levels[1].error, SolveFailed)
    assert not found.interrupted
    assert "failed" in repr(found)
    with pytest.raises(SolveFailed):
        solve_lexicographic(problem, objectives, settings=few)


def test_an_interruption_keeps_what_was_found():
    problem, phase, x, u = push()

    def interrupting(line):
        if line.startswith("objective 2 of 3"):
            os.kill(os.getpid(), signal.SIGINT)

    objectives = [-phase.at_end(x), phase.integral(u**2), phase.at_end(x)]
    found = solve_lexicographic(problem, objectives, settings=SIX, progress=interrupting)
    assert found.interrupted
    assert len(found.levels) == 2
    assert found.solution.value(phase.at_end(x)) == pytest.approx(0.5, rel=1e-6)


def test_as_many_of_everything_as_objectives():
    problem, phase, x, _ = push()
    for wrong in ({"slack": [0.1]}, {"settings": [SIX]}, {"beside": [0.0]}):
        with pytest.raises(StatementError, match="has 1 entries for 2 objectives; give one for"):
            solve_lexicographic(problem, [-phase.at_end(x), phase.at_end(x)], **wrong)
    with pytest.raises(StatementError, match="no keyword 'slak'; did you mean 'slack'"):
        solve_lexicographic(problem, [-phase.at_end(x)], slak=0.1)


@pytest.mark.parametrize("slack", [1e-1, 1e-3])
def test_exchanged_roles_give_the_same_motion(monkeypatch, slack):
    # a solver that has one iteration under the limit goes astray at once
    problem, phase, x, u = push()
    objectives = [-phase.at_end(x), phase.integral(u**2)]
    direct = solve_lexicographic(problem, objectives, slack=slack, settings=SIX)
    monkeypatch.setattr("ocp.analysis.lexicographic._PATIENCE", 1)
    exchanged = solve_lexicographic(problem, objectives, slack=slack, settings=SIX)

    level = exchanged.levels[1]
    assert exchanged.solution.verification.passed
    assert exchanged.solution.value(objectives[0]) <= exchanged.levels[0].held * (1 + 1e-6)
    # at most a twentieth of the concession is unused; the effort falls with its square root
    assert level.value == pytest.approx(direct.levels[1].value, rel=0.05)
    assert level.value >= direct.levels[1].value * (1 - 1e-5)
    assert 0.0 < level.gap < 1.0


def test_objectives_that_do_not_contend_leave_no_room(monkeypatch):
    problem, phase, x, _ = push()
    v = problem.phases[0].states[1]
    monkeypatch.setattr("ocp.analysis.lexicographic._PATIENCE", 1)
    objectives = [-phase.at_end(x), -phase.at_end(v)]
    found = solve_lexicographic(problem, objectives, slack=1e-3, settings=SIX)
    assert found.solution.value(phase.at_end(v)) == pytest.approx(1.0, rel=1e-6)
    assert found.levels[1].gap == 0.0
