"""Known times at which something steps or bends, in phases that begin or end at a free time."""

import casadi as ca
import numpy as np
import pytest
from scipy import optimize

from ocp import (
    TIME,
    Between,
    Bound,
    Constant,
    Control,
    FixedMesh,
    MovingMesh,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    certify,
    family,
    joined,
    load,
    save,
    solve,
)
from ocp.algorithm import first_mesh
from ocp.mesh.known_times import with_known_times
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.refinement.first_round.side_choices import side_choices

x, v, u = State("x"), State("v"), Control("u")
thrust = Control("thrust", lower=-1, upper=1)


def steps(times, values):
    return ca.pw_const(TIME, ca.DM(times), ca.DM(values))


def bends(times, values):
    return ca.pw_lin(TIME, ca.DM(times), ca.DM(values))


def go(rate, cost, start=0.0, end=3.0, price=0.3, **options):
    """From 0 to 1 by a rate, at a cost along the way and a price of the duration."""
    phase = Phase("go", {x: rate}, {x: 0}, {x: 1}, start=start, end=end, **options)
    duration = phase.end_time - (phase.start_time if isinstance(start, Between) else 0)
    least = [Bound("least", duration, lower=0.1)] if isinstance(start, Between) else []
    return Problem("go", phase, minimise=phase.integral(cost) + price * duration, bounds=least)


WIND = steps([0.3, 0.5], [1, 3, 0.2])
TABLE = [0, 0.3, 0.5, 1.1, 1.4, 2.0], [1.0, 3.0, 0.2, 2.0, -1.0, 0.5]


def drifted(t):
    """Integral of the wind from 0."""
    return np.interp(t, [0, 0.3, 0.5, 3.0], [0, 0.3, 0.9, 1.4])


FINE = np.linspace(0, 2, 20_001)
RATES = np.interp(FINE, *TABLE)
WHOLE = np.insert(np.cumsum(0.5 * np.diff(FINE) * (RATES[1:] + RATES[:-1])), 0, 0.0)


def blown(t):
    """Integral of the table's straight lines from 0, exact at its samples."""
    return np.interp(t, FINE, WHOLE)


def least(function, low, high):
    """The least value over an interval, by samples and then between them."""
    at = np.linspace(low, high, 4001)
    place = int(np.argmin([function(t) for t in at]))
    bounds = at[max(place - 1, 0)], at[min(place + 1, at.size - 1)]
    options = {"xatol": 1e-12}
    found = optimize.minimize_scalar(function, bounds=bounds, method="bounded", options=options)
    return min(found.fun, function(at[place]))


def price_of_end(t):
    return (1 - drifted(t)) ** 2 / t + 0.01 * t


def price_of_start(t):
    return (1 - drifted(1.0) + drifted(t)) ** 2 / (1 - t) + 0.01 * (1 - t)


# the problem, and its least objective in closed form
CASES = {
    "dynamics step, free end": (
        lambda: go(WIND + u, u**2, end=Between(0.1, 1.1), price=0.01),
        lambda: least(price_of_end, 0.1, 1.1),
    ),
    "dynamics step, free start": (
        lambda: go(WIND + u, u**2, start=Between(0, 0.9), end=1.0, price=0.01),
        lambda: least(price_of_start, 0, 0.9),
    ),
    "dynamics bend, free end": (
        lambda: go(bends(*TABLE) + u, u**2, end=Between(0.2, 2), price=0.5),
        lambda: least(lambda t: (1 - blown(t)) ** 2 / t + 0.5 * t, 0.2, 2),
    ),
    "cost steps": (
        lambda: go(u, u**2 * steps([0.9], [1, 0.01]), end=Between(0.2, 3), price=0.05),
        lambda: least(lambda t: 1 / (min(t, 0.9) + 100 * max(t - 0.9, 0)) + 0.05 * t, 0.2, 3),
    ),
    "cost bends": (
        lambda: go(u, u**2 + 3 * ca.fmax(0, TIME - 0.7), end=Between(0.2, 3), price=0.1),
        lambda: least(lambda t: 1 / t + 1.5 * max(t - 0.7, 0) ** 2 + 0.1 * t, 0.2, 3),
    ),
    # its end is at 1 s without the step, and so it is with it
    "known time beyond the end": (
        lambda: go(u, u**2 + steps([1.05], [0, 5]), end=Between(0.2, 3), price=1.0),
        lambda: 2.0,
    ),
    # without the step it would end at 1 s, and at 0.41 s behind it: it ends at the step
    "ends at a known time": (
        lambda: go(u, u**2 + steps([0.9], [0, 5]), end=Between(0.2, 3), price=1.0),
        lambda: 1 / 0.9 + 0.9,
    ),
    # the guess ends before the known time, where nothing is feasible
    "first side is not feasible": (
        lambda: go(thrust * steps([1.0], [0.05, 1.0]), thrust**2, end=Between(0.1, 5, 0.5)),
        lambda: 2 * np.sqrt(0.3) + 0.3 * (1 - 0.05**2),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_the_best_of_all_sides_is_found_and_certified(case):
    statement, expected = CASES[case]
    found = solve(statement())
    assert found.objective == pytest.approx(expected(), rel=1e-6, abs=1e-9)
    assert certify(found).passed
    assert len(found.mesh_iterations) <= 3


def test_two_phases_meet_on_any_side():
    """By 1 at a rate u, then by 2 at a rate 2 u, where u^2 costs 1, then 6, then a half."""
    cost = steps([1.0, 2.0], [1, 6, 0.5]) * u**2
    slow = Phase("slow", {x: u}, {x: 0}, {x: 1}, end=Between(0.2, 3.5))
    fast = Phase("fast", {x: 2 * u}, {x: 1}, {x: 3}, start=Between(0.2, 3.5), end=Between(0.5, 4))
    found = solve(
        Problem(
            "two",
            [slow, fast],
            minimise=slow.integral(cost) + fast.integral(cost) + 0.5 * fast.end_time,
            links=joined(slow, fast),
        )
    )
    # each way squared by its integral of 1 / price
    first, last = np.meshgrid(np.linspace(0.2, 3.5, 331), np.linspace(0.5, 4, 351), indexing="ij")
    slow_by, fast_by = (np.interp(t, [0, 1, 2, 4], [0, 1, 7 / 6, 31 / 6]) for t in (first, last))
    ordered = last > first + 0.01
    fast_by = np.where(ordered, fast_by, slow_by + 1.0)
    values = 1 / slow_by + 1 / (fast_by - slow_by) + 0.5 * last
    best = float(values[ordered].min())
    assert found.objective == pytest.approx(best, rel=1e-4)
    assert found.objective <= best
    assert certify(found).passed


def test_switches_beside_a_known_time_are_located():
    """In the least time from rest to rest the thrust switches, and its strength steps before."""
    strength = steps([0.8, 1.7], [1, 0.3, 1.5])
    move = Phase(
        "go", {x: v, v: thrust * strength}, {x: 0, v: 0}, {x: 1, v: 0}, end=Between(0.1, 6)
    )
    found = solve(Problem("rest", move, minimise=move.end_time))
    parts = [
        Phase("a", {x: v, v: thrust}, {x: 0, v: 0}, end=0.8),
        Phase("b", {x: v, v: 0.3 * thrust}, start=0.8, end=1.7),
        Phase("c", {x: v, v: 1.5 * thrust}, {}, {x: 1, v: 0}, start=1.7, end=Between(1.7, 6)),
    ]
    links = (*joined(*parts[:2]), *joined(*parts[1:]))
    split = solve(Problem("split", parts, minimise=parts[-1].end_time, links=links))
    assert found.objective == pytest.approx(split.objective, rel=1e-6)
    assert certify(found).passed


def test_a_limit_that_steps_is_met_on_both_sides():
    # no further than 0.5 before 1 s
    gate = Bound("gate", x - steps([1.0], [0.5, 10]), upper=0)
    move = Phase("go", {x: u}, {x: 0}, {x: 2}, end=Between(0.2, 8), bounds=[gate])
    found = solve(Problem("gate", move, minimise=move.integral(u**2) + 0.3 * move.end_time))
    # 0.5 in the first second, then 1.5 in what follows
    assert found.objective == pytest.approx(0.25 + 0.3 + 2 * 1.5 * np.sqrt(0.3), rel=1e-6)
    assert certify(found).passed


def test_a_motion_that_ends_at_a_known_time_costs_what_it_does_before_it():
    """From a guess of 0.3 s it goes on behind six known times, and ends at 2.8 s."""
    known, prices = 0.4 * np.arange(1, 10), [1, 2] * 5
    move = Phase(
        "go",
        {x: v, v: u},
        {x: 0, v: 0},
        {x: 1, v: 0},
        end=Between(0.3, 5, 0.3),
        guess={x: (0, 1)},
    )
    cost = move.integral(u**2 * steps(known, prices)) + 0.4 * move.end_time
    found = solve(Problem("walk", move, minimise=cost))
    # u = (a + b s) / price with s until the end: least of a quadratic form under two equations
    left = 2.8 - np.array([0.0, *known[:7]])
    moments = [
        sum((a**n - b**n) / n / p for a, b, p in zip(left, left[1:], prices, strict=False))
        for n in (1, 2, 3)
    ]
    gramian = np.array([moments[:2], moments[1:]])
    least_effort = np.linalg.inv(gramian)[1, 1]
    assert found.objective == pytest.approx(least_effort + 0.4 * 2.8, rel=1e-8)
    assert found.trajectory.phases[0].end == pytest.approx(2.8, abs=1e-8)
    assert certify(found).passed


def test_what_is_not_feasible_on_one_side_is_met_on_another():
    slow = thrust * steps([0.5, 1.0, 1.5, 2.0], [0.05, 0.1, 0.05, 0.1, 1.0])
    problem = go(slow, 0 * u, end=Between(0.1, 5, 0.3), price=1.0, guess={x: (0, 1)})
    assert solve(problem).objective == pytest.approx(3 - 0.15, rel=1e-8)


def test_slopes_hold_the_known_times():
    def statement(start=0.0):
        return go(0.3 * WIND + u, u**2, start=start, end=Between(0.2, 3))

    step = 1e-4
    later, earlier = (solve(statement(start)).objective for start in (step, -step))
    slope = solve(statement()).sensitivities()["go: start"]
    # the end time is paid, and not the duration
    assert slope == pytest.approx((later - earlier) / (2 * step), rel=1e-5)


def test_a_family_passes_over_a_known_time():
    gust = Constant("gust", "", 1.0)
    problem = go(0.3 * gust * WIND + u, u**2, end=Between(0.1, 3))
    members = family(problem, gust, [1.0, 2.4, 5.0]).members
    ends = [member.trajectory.phases[0].end for member in members]
    assert ends[1] > 0.5 > ends[2]
    for member in members:
        alone = solve(problem, constants={gust: member.value})
        assert member.objective == pytest.approx(alone.objective, rel=1e-7)


@pytest.mark.parametrize("refinement", [FixedMesh(), MovingMesh()], ids=["fixed", "moving"])
def test_known_times_stay_under_other_policies(refinement):
    statement, expected = CASES["dynamics step, free end"]
    found = solve(statement(), settings=Settings(refinement=refinement))
    assert found.objective == pytest.approx(expected(), rel=1e-6)
    own = found.mesh.phases[0]
    at = [i for i, _ in own.known]
    assert found.trajectory.phases[0].breakpoints[at].tolist() == [0.3, 0.5]
    assert not set(at) & set(own.movable)


def test_a_stored_solution_keeps_its_known_times(tmp_path):
    found = solve(CASES["dynamics step, free end"][0]())
    save(found, tmp_path / "wind.ocp")
    again = load(tmp_path / "wind.ocp")
    assert again.mesh.phases[0].known == found.mesh.phases[0].known
    assert certify(again).passed
    assert solve(again.problem, guess=again).objective == pytest.approx(found.objective, rel=1e-9)


def test_stated_breakpoints_count_in_phases_of_free_times():
    problem = go(u, u**2, end=Between(0.2, 3), breakpoints=[0.7, 2.5])
    found = solve(problem)
    assert found.objective == pytest.approx(2 * np.sqrt(0.3), rel=1e-6)
    assert [time for _, time in found.mesh.phases[0].known] == [0.7]
    with pytest.raises(StatementError, match="no time between"):
        go(u, u**2, end=Between(0.2, 3), breakpoints=[3.5])


def test_known_times_that_are_next_to_one_are_one():
    close = steps([0.5, 0.5 + 1e-10, 0.5 + 1e-7], [1, 2, 1, 3])
    found = solve(go(0.2 * close + u, u**2, end=Between(0.2, 3)))
    assert certify(found).passed


def test_a_mesh_is_stretched_between_its_known_times():
    problem = go(WIND + u, u**2, end=Between(0.1, 1.1))
    mesh = with_known_times(problem, first_mesh(problem, Settings()), {"go": (0.0, 0.6)})
    own = mesh.phases[0]
    assert own.times == (0.3, 0.5)
    assert own.between == (-np.inf, np.inf)
    assert (own.breakpoints[[i for i, _ in own.known]] * 0.6).tolist() == pytest.approx([0.3, 0.5])

    # it ends later: only what is behind the last known time is longer
    before, later = own.times_at(own.positions, 0.0, 0.6), own.times_at(own.positions, 0.0, 1.1)
    inside = before <= 0.5
    assert later[inside] == pytest.approx(before[inside], abs=1e-15)
    assert later[~inside] - 0.5 == pytest.approx(6 * (before[~inside] - 0.5))
    # it is the same mesh, wherever the phase ends
    assert with_known_times(problem, mesh, {"go": (0.0, 0.6)}) is mesh
    # before the first known time it may not end behind it
    alone = with_known_times(problem, first_mesh(problem, Settings()), {"go": (0.0, 0.2)})
    assert alone.phases[0].known == ()
    assert alone.phases[0].between == (-np.inf, 0.3)


def test_a_known_time_at_an_end_belongs_to_no_breakpoint():
    with pytest.raises(StatementError, match="known times belong to inner breakpoints"):
        PhaseMesh(np.array([0.0, 0.5, 1.0]), np.array([3]), known=((2, 1.0),))
    free = Mesh((PhaseMesh(np.array([0.0, 0.5, 1.0]), np.array([3]), known=((1, 1.0),)),)).freed()
    assert free.phases[0].movable == ()


def test_choices_of_sides_are_tried_in_order_and_at_three_places():
    phase = Phase("go", {x: u}, start=Between(0, 1), end=Between(0.5, 3))
    choices = side_choices([phase], {"go": (1.0, 2.0)}, {"go": (0.5, 1.75)}, 40)
    ends = [times["go"] for times in choices]
    # both before 1 s, then with the end between the known times, then behind both
    assert np.ravel(ends[:3]).tolist() == pytest.approx([0.25, 0.875, 0.5, 1.5, 0.5, 2.5])
    assert len(ends) == 9
    assert all(start < end for start, end in ends)
    assert len(side_choices([phase], {"go": (1.0, 2.0)}, {"go": (0.5, 1.75)}, 2)) == 2


def test_a_time_without_a_limit_is_tried_behind_the_last_known_one():
    phase = Phase("go", {x: u}, end=Between(0.5, np.inf, 2.0))
    choices = side_choices([phase], {"go": (1.0,)}, {"go": (0.0, 2.0)}, 40)
    assert [times["go"][1] > 1.0 for times in choices] == [False, True] * 3
