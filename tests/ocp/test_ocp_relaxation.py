"""The smallest relaxation of infeasible problems, against closed forms."""

import pytest

from ocp import (
    Between,
    Bound,
    Constant,
    Control,
    Infeasible,
    Phase,
    Problem,
    Settings,
    State,
    StatementError,
    Unknown,
    joined,
    relaxed,
    solve,
)

INITIAL = ["flight: x initial", "flight: v initial"]
EXACT = 1e-6  # slacks are solved to the solver's 1e-10 of scaled numbers; _NOTHING of elastic


def too_far(target=2.0):
    """2 m in 1 s from rest with 1 m/s^2, which reach 1/2 m."""
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", lower=-1, upper=Constant("thrust", "m/s^2", 1.0))
    phase = Phase("flight", {x: v, v: u}, {x: 0, v: 0}, {x: target}, end=1.0)
    return Problem("too far", [phase], minimise=phase.integral(u**2))


@pytest.mark.parametrize(
    ("keep", "name", "side", "needed", "unit"),
    [
        ([*INITIAL, "u"], "flight: x final", "lower", 0.5, "m"),
        ([*INITIAL, "flight: x final"], "u", "upper", 4.0, "m/s^2"),
        (["u", "flight: x final", "flight: x initial"], "flight: v initial", "upper", 1.5, "m/s"),
        (["u", "flight: x final", "flight: v initial"], "flight: x initial", "upper", 1.5, "m"),
    ],
)
def test_one_limit_gives_way(keep, name, side, needed, unit):
    found = relaxed(too_far(), keep=keep)
    (item,) = found.items
    assert (item.name, item.side, item.unit, item.phase) == (name, side, unit, "flight")
    assert item.needed == pytest.approx(needed, rel=EXACT)
    assert item.amount == pytest.approx(abs(item.needed - item.limit))
    assert found.solution.verification.passed
    assert f"'{name}' from {item.limit:g} to {needed:g} {unit}, by" in str(found)


def test_a_roof_and_the_time_at_which_it_is_too_low():
    # up to 1 m and down again within a second, below a roof of 0.4 m
    x, v, u = State("x", "m", upper=0.4), State("v", "m/s"), Control("u", "m/s^2")
    up = Phase("up", {x: v, v: u}, {x: 0, v: 0}, end=0.5)
    down = Phase("down", {x: v, v: u}, {}, {x: 0, v: 0}, start=0.5, end=1.0)
    top = Bound("top", up.at_end(x), "m", lower=1.0)
    effort = up.integral(u**2) + down.integral(u**2)
    problem = Problem("hop", [up, down], minimise=effort, bounds=[top], links=joined(up, down))
    found = relaxed(problem, keep=["top"])
    (item,) = found.items
    assert (item.name, item.side, item.phase) == ("x", "upper", "up")
    assert item.needed == pytest.approx(1.0, rel=EXACT)
    assert item.time == pytest.approx(0.5, abs=1e-3)  # one of 2001 samples
    (other,) = relaxed(problem, keep=["x"]).items
    assert (other.name, other.phase, other.time) == ("top", "", None)
    assert other.needed == pytest.approx(0.4, rel=EXACT)


def test_a_bound_of_a_phase_and_one_of_an_unknown():
    # x' = k to x = 1 within 0.5 s and k <= 1; and the speed allowed is 1.5
    x, k = State("x", "m"), Unknown("k", "m/s", upper=1.0)
    phase = Phase(
        "go", {x: k.symbol}, {x: 0}, {x: 1}, end=0.5, bounds=[Bound("speed", k, "m/s", upper=1.5)]
    )
    found = relaxed(Problem("go", [phase], minimise=k), keep=["go: x initial", "go: x final"])
    assert {i.name: pytest.approx(i.needed, rel=EXACT) for i in found.items} == {
        "k": 2.0,
        "go: speed": 2.0,
    }


def there_and_back(first=0.7, second=0.6):
    """1 m and 2 m, a second each, below a limit of speed that both phases state."""
    x, v = State("x", "m"), Control("v", "m/s")
    there = Phase(
        "there", {x: v}, {x: 0}, {x: 1}, bounds=[Bound("pace", v, "m/s", upper=first)], end=1.0
    )
    on = Phase(
        "on", {x: v}, {}, {x: 3}, start=1.0, end=2.0, bounds=[Bound("pace", v, "m/s", upper=second)]
    )
    effort = there.integral(v**2) + on.integral(v**2)
    return Problem("trip", [there, on], minimise=effort, links=joined(there, on))


def test_only_what_is_named_gives_way_and_bounds_of_one_name_together():
    found = relaxed(there_and_back(first=0.7, second=0.7), only=["pace"])
    (item,) = found.items
    assert (item.name, item.side, item.phase) == ("pace", "upper", "on")
    assert item.needed == pytest.approx(2.0, rel=EXACT)
    apart = relaxed(there_and_back(), only=["there: pace", "on: pace"])
    assert {i.name: pytest.approx(i.needed, rel=EXACT) for i in apart.items} == {
        "on: pace": 2.0,
        "there: pace": 1.0,
    }


def test_a_name_for_all_phases_keeps_them_all():
    ends = ["there: x final", "on: x final", "there: x initial"]
    with pytest.raises(StatementError, match="all limits of 'trip' are in keep"):
        relaxed(there_and_back(), keep=["pace", *ends])
    found = relaxed(there_and_back(), keep=["pace"])
    assert all("pace" not in item.name for item in found.items)


def test_a_solution_of_another_statement_is_a_guess():
    start = solve(there_and_back(first=9, second=9), settings=Settings(intervals=5))
    found = relaxed(there_and_back(first=0.7, second=0.7), only=["pace"], guess=start)
    assert found.items[0].needed == pytest.approx(2.0, rel=EXACT)


def test_a_feasible_problem_needs_nothing():
    found = relaxed(too_far(target=0.4))
    assert found.items == ()
    assert str(found) == "'too far' is feasible without changes"
    assert found.solution.sample("x", 1.0) == pytest.approx(0.4, rel=EXACT)


def test_what_stays_hard_can_still_contradict():
    x, v = State("x", "m"), State("v", "m/s")
    u = Control("u", "m/s^2", upper=9.0)

    def stuck(initial):
        rails = [Bound("rail", x + 1, "m", 0, 0), Bound("other rail", x - 1, "m", 0, 0)]
        phase = Phase("flight", {x: v, v: u}, initial, bounds=rails, end=1.0)
        return Problem("stuck", [phase], minimise=phase.integral(u**2))

    with pytest.raises(Infeasible, match=r"'stuck' has 640 equations.*over-determined"):
        relaxed(stuck({v: 0}), keep=["flight: v initial"])
    with pytest.raises(Infeasible, match=r"initial values of phase 'flight' make 'rail' 1 m"):
        relaxed(stuck({x: 0, v: 0}), keep=INITIAL)


def test_names_that_are_none():
    with pytest.raises(StatementError, match=r"no limit 'flight: z final'; its limits.*'u'"):
        relaxed(too_far(), keep=["flight: z final"])
    x, u = State("x"), Control("u")
    free = Phase("free", {x: u}, end=Between(1, 2))
    with pytest.raises(StatementError, match=r"all limits of 'free' are in keep"):
        relaxed(Problem("free", [free], minimise=free.integral(u**2 + x**2)))
