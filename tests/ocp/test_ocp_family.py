"""Families of motions: each member from the one before, refined and verified when asked."""

import dataclasses
import math
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
    State,
    StatementError,
    family,
    solve,
)
from ocp.refinement.policies.moving_mesh import KeptWhileGood
from tests.ocp.problems import STRONGEST, least_time, race

FEW = Settings(intervals=8)


def test_members_follow_their_switch_on_one_mesh_and_few_meshes_are_made() -> None:
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


def test_a_member_refined_and_verified_is_what_a_solve_finds() -> None:
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


def test_a_mesh_that_stays_is_everybodys() -> None:
    fixed = dataclasses.replace(FEW, refinement=FixedMesh())
    found = family(race(), STRONGEST, [1.0, 1.02, 1.04], settings=fixed)
    assert len({id(member.iterate.transcription) for member in found.members}) == 1
    # the switch of the second lies within an interval of eight
    assert found.objectives == pytest.approx([least_time(v) for v in found.values], rel=1e-2)


def test_a_member_far_from_its_neighbour_is_refined_on_a_mesh_of_its_own() -> None:
    short = dataclasses.replace(FEW, solver=Ipopt(max_iterations=40))
    found = family(race(), STRONGEST, [1.0, 1.01, 1e3], settings=short)
    assert found.objectives[-1] == pytest.approx(least_time(1e3), rel=1e-5)


def test_a_member_that_is_not_found_is_named_and_those_before_it_are_kept() -> None:
    words = r"family in 'strongest' stopped at 0\.001 m/s\^2: .*; the 2 members before are in error"
    with pytest.raises(FamilyStopped, match=words) as caught:
        family(race(), STRONGEST, [1.0, 1.01, 1e-3], settings=FEW)
    kept = caught.value.family
    assert isinstance(kept, Family)
    assert kept.solution(1).objective == pytest.approx(least_time(1.01), rel=1e-6)


@pytest.mark.parametrize("values", [[], [1.0, math.nan]])
def test_a_family_needs_values(values: list[float]) -> None:
    with pytest.raises(StatementError, match=r"family in 'strongest' has the values .* give one"):
        family(race(), STRONGEST, values)


def test_values_are_checked_like_those_of_a_solve() -> None:
    with pytest.raises(StatementError, match="cross"):
        family(race(), STRONGEST, [1.0, -2.0], settings=FEW)


def test_other_constants_keep_their_values() -> None:
    way = Constant("way", "m", 1.0)
    found = family(race(way), STRONGEST, [1.0, 1.2], settings=FEW, constants={way: 4.0})
    assert found.objectives == pytest.approx([2 * least_time(v) for v in (1.0, 1.2)], rel=1e-5)
    assert found.solution(1).objective == pytest.approx(2 * least_time(1.2), rel=1e-5)


def test_a_family_that_is_stopped_says_where() -> None:
    count = 0

    def stopping(line: str) -> None:
        nonlocal count
        count += 1
        if count == 200:  # the first member takes less than half of these iterations
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match=r"the family of 'race' was stopped at 'strongest' = "):
        family(race(), STRONGEST, np.linspace(1.0, 6.0, 200), settings=FEW, progress=stopping)


def test_a_policy_that_keeps_a_good_mesh_has_the_numbers_of_the_one_it_holds() -> None:
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
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    gust = 0.5e4 / np.sqrt(np.pi) * ca.exp(-(((TIME - at) * 1e4) ** 2))
    ends = {"initial": {x: 0, v: 0}, "final": {x: 1, v: 0}}
    move = Phase("move", {x: v, v: u + gust}, **ends, end=1.0)
    problem, times = Problem("gust", move, minimise=move.integral(u**2)), np.linspace(0.43, 0.6, 4)
    ways = 1 - 0.5 * (1 - times)
    expected = 12 * (ways**2 + 0.5 * ways) + 1
    assert family(problem, at, times).objectives == pytest.approx(expected, rel=1e-4)
