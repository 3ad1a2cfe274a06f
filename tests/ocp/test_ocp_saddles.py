"""Answers that meet all first-order conditions and are saddles: they are left, or refused."""

import dataclasses
import math
from itertools import chain
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.sparse
from scipy.sparse.linalg import splu

from ocp import (
    TIME,
    Between,
    Bound,
    Constant,
    Control,
    FixedMesh,
    Phase,
    Problem,
    Settings,
    Solution,
    State,
    Unbounded,
    certify,
    family,
    homotopy,
    joined,
    solve,
)
from ocp.nlp import inflection
from ocp.nlp.saddle import added_curvature, starts_beside
from ocp.nlp.solver import StartingPoint
from ocp.refinement.better_motions.saddles import StationaryPoint, stationary_point

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


@pytest.mark.parametrize("push", [12.0, 20.0])
def test_a_solve_from_an_optimum_for_another_constant_leaves_a_saddle(
    still: Solution, push: float
) -> None:
    solution = solve(still.problem, guess=still, constants={PUSH: push})
    assert solution.objective == pytest.approx(least(push), rel=1e-6)
    assert certify(solution).passed


def test_a_slope_that_is_slight_beside_the_objective_leads_down_as_well() -> None:
    # a thousandth of the objective is at stake: beside the saddle its slope is within tolerances
    problem = unstable(offset=1000.0)
    saddle = solve(problem)
    assert saddle.objective == pytest.approx(1000.0)
    solution = solve(problem, guess=saddle, constants={PUSH: 15.0})
    assert solution.objective == pytest.approx(1000.0 + least(15.0), rel=1e-7)


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


def test_on_a_mesh_that_stays_a_saddle_is_no_answer(still: Solution) -> None:
    # the lower motion leaks between the points, so that it is not verified
    fixed = Settings(refinement=FixedMesh())
    solution = solve(still.problem, settings=fixed, guess=still, constants={PUSH: 20.0})
    assert solution.objective == pytest.approx(least(20.0), rel=1e-4)
    assert solution.verdict == "unverified"


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


@pytest.mark.slow
def test_saddles_are_not_followed_where_ever_faster_changes_gain() -> None:
    # R. Luus and O. Rosen, Ind. Eng. Chem. Res. 30 (1991): u and -u cost the same but for their
    # mean, so that changes between them gain, and those who follow them come to no end
    x, y = State("x"), State("y")
    z, u = State("z"), Control("u", lower=-4.0, upper=10.0)
    phase = Phase(
        "run",
        {x: y, y: -z * u + 16.0 * TIME - 8.0, z: u},
        {x: 0.0, y: -1.0, z: -math.sqrt(5.0)},
        end=1.0,
    )
    off = y + 16.0 * TIME - 8.0 - 0.1 * z * u**2
    cost = phase.integral(x**2 + y**2 + 5e-4 * off**2)
    answer = solve(Problem("nearly_singular", phase, minimise=cost))

    assert answer.objective == pytest.approx(0.119222, rel=2e-4)
    assert answer.mesh.intervals < 400
    assert "ever faster switches gain" in answer.verdict
    assert not certify(answer).passed


def test_a_certificate_refuses_a_saddle(still: Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("ocp.refinement.reviews.left_saddle.lower_motion", lambda *_: None)
        saddle = solve(still.problem, guess=still, constants={PUSH: 20.0})
    assert saddle.objective == pytest.approx(0.0, abs=1e-9)
    refused = [check for check in certify(saddle).checks if not check.passed]
    assert [check.name for check in refused] == ["a second solve"]
    assert refused[0].start is not None


def flat(power: int) -> Problem:
    """Most of a power of the way that is gone in a second; the guess is to stay."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-1, upper=1)
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, end=1.0, guess={u: 0.0})
    return Problem("flat", move, maximise=move.at_end(x) ** power)


@pytest.mark.parametrize("power", [2, 3, 4, 6])
def test_where_neither_slope_nor_curvature_tells_values_do(power: int) -> None:
    """No step of Newton's leads away from zero: for powers above two, 0 was certified."""
    found = solve(flat(power))
    assert found.objective == pytest.approx(0.5**power, rel=1e-6)
    assert certify(found).passed


def test_an_optimum_of_zero_is_flat_and_needs_no_other_run() -> None:
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-1, upper=1)
    move = Phase("move", {x: v, v: u}, {x: 0, v: 0}, {x: 1}, end=3.0)
    found = solve(Problem("quiet", move, minimise=move.at_end(v) ** 4))
    assert found.objective == pytest.approx(0.0, abs=1e-9)
    assert len(found.mesh_iterations) <= 3
    assert certify(found).passed


LEAST, MOST = Constant("least", "s", 0.0), Constant("most", "s", 1e3)


def handed_over(factor: float) -> Problem:
    """One metre from rest to rest; behind the switch the same control does more."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2")
    switch, end = Between(0, 1e3), Between(0, 1e3)
    first = Phase("first", {x: v, v: u}, {x: 0, v: 0}, end=switch)
    then = Phase("then", {x: v, v: factor * u}, final={x: 1, v: 0}, start=switch, end=end)
    cost = first.integral(u**2) + then.integral(u**2) + then.end_time
    limits = [Bound("switch", first.end_time, "s", lower=LEAST, upper=MOST)]
    return Problem("hand_over", [first, then], cost, links=joined(first, then), bounds=limits)


@pytest.fixture(scope="module")
def inflected() -> Solution:
    """The motion whose control is zero at the switch, with half of the way on either side."""
    half = math.sqrt(2.0)
    return solve(handed_over(2.0), constants={LEAST: half, MOST: half})


def test_where_slope_and_curvature_vanish_together_the_answer_is_left(inflected: Solution) -> None:
    """The slope by the switch time is a square, so that a solver stops where the control is 0."""
    assert inflected.objective == pytest.approx(math.sqrt(8.0), rel=1e-7)
    found = solve(inflected.problem, guess=inflected)
    # all of it with the stronger drive: 12 / (2^2 T^3) + T is least
    assert found.objective == pytest.approx(4.0 / math.sqrt(3.0), rel=1e-6)
    assert certify(found).passed


def test_a_certificate_refuses_an_inflection(
    inflected: Solution, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("ocp.refinement.reviews.left_saddle.lower_motion", lambda *_: None)
        stays = solve(inflected.problem, guess=inflected)
    assert stays.objective == pytest.approx(math.sqrt(8.0), rel=1e-6)
    refused = [check.name for check in certify(stays).checks if not check.passed]
    assert refused == ["a second solve"]


def test_a_switch_without_influence_is_no_inflection(monkeypatch: pytest.MonkeyPatch) -> None:
    kinds: list[str] = []

    def noted(*arguments: Any, **options: Any) -> StationaryPoint:
        found = stationary_point(*arguments, **options)
        kinds.append(found.kind)
        return found

    monkeypatch.setattr("ocp.refinement.reviews.left_saddle.stationary_point", noted)
    found = solve(handed_over(1.0))
    assert found.objective == pytest.approx(12.0 / 6.0**1.5 + math.sqrt(6.0), rel=1e-6)
    assert set(kinds) == {"minimum"}


def test_beside_a_saddle_the_objective_may_run_away(still: Solution) -> None:
    assert certify(still).passed
    x, u = State("x", "m"), Control("u", "m/s")
    ends = Phase("way", {x: u}, end=1.0, guess={x: 0.0, u: 0.0})
    returns = Bound("returns", ends.at_end(x) - ends.at_start(x), "m", lower=0, upper=0)
    problem = Problem("away", ends, minimise=ends.integral(u**2 - 5 * x**2), links=[returns])
    with pytest.raises(Unbounded, match="ran away"):
        solve(problem)


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


def test_what_limits_of_times_leave_no_room_for_is_no_inflection() -> None:
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


def test_factors_beside_dense_columns_stay_sparse(monkeypatch):
    """A time is in the rows of every interval: with its column the factors would fill up."""
    sizes = []

    def counted(matrix, **how):
        factors = splu(matrix, **how)
        sizes.append(factors.nnz)
        return factors

    monkeypatch.setattr("scipy.sparse.linalg.splu", counted)
    n, rng = 3000, np.random.default_rng(0)
    chain = scipy.sparse.diags_array(
        [1.0, -0.3, 1.0], offsets=[-1, 0, 1], shape=(n, n), format="csc"
    )
    beside = rng.standard_normal((n, 3))
    corner = np.diag([1.0, 2.0, 3.0])
    matrix = scipy.sparse.block_array([[chain, beside], [beside.T, corner]], format="csc")
    right = rng.standard_normal((n + 3, 2))

    numbers = ca.DM(ca.Sparsity(n + 3, n + 3, matrix.indptr.tolist(), matrix.indices.tolist()))
    numbers.nz[:] = matrix.data
    found = inflection._solved(numbers, right)
    assert np.abs(matrix @ found - right).max() < 1e-8
    assert sizes
    assert max(sizes) < 30 * n
