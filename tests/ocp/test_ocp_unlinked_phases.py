"""Phases that meet without a link between their states: that it is said, and where it is not."""

import pytest

from ocp import (
    Between,
    Control,
    Phase,
    Problem,
    State,
    StatementWarning,
    Unknown,
    joined,
    solve,
)
from ocp.problem.checks_before_solve import check_before_solve
from ocp.problem.parameters import parameters_of

x, v = State("position", "m"), State("speed", "m/s")
u = Control("force", "N", lower=-4, upper=4)
RATES = {x: v, v: u}
START, GOAL = {x: 0, v: 0}, {x: 1, v: 0}
PUSH = Phase("push", RATES, initial=START, end=1.0)
REST = Phase("rest", RATES, final=GOAL, start=1.0, end=2.0)


def test_phases_that_follow_each_other_without_a_link_are_told():
    phases = (PUSH, REST)
    effort = PUSH.integral(u**2 + (x - 1) ** 2) + REST.integral(u**2)
    with pytest.warns(StatementWarning, match=r"'rest' begins at 1.0 s, where 'push' ends, and"):
        solve(Problem("apart", phases, minimise=effort))

    # an unknown may stand between the two
    height, pace = Unknown("height"), Unknown("pace")
    between = [
        phase_at(state) == unknown
        for phase_at in (PUSH.at_end, REST.at_start)
        for state, unknown in ((x, height), (v, pace))
    ]
    linked = solve(Problem("linked", phases, minimise=effort, links=joined(*phases)))
    by_unknowns = solve(Problem("by unknowns", phases, minimise=effort, bounds=between))
    assert by_unknowns.objective == pytest.approx(linked.objective, rel=1e-8)


ANY_TIME = Between(0.1, 1.9)


def free_pair(begins=ANY_TIME, **second):
    """Two phases of a drive, of which the first one ends at a free time."""
    stated = {"final": GOAL, "start": begins, "end": 2.0, **second}
    return Phase("push", RATES, initial=START, end=ANY_TIME), Phase("rest", RATES, **stated)


def apart(phases, **changed):
    """A problem of two phases, of each of which something depends on the states."""
    effort = sum(phase.integral(u**2 + (x - 1) ** 2) for phase in phases)
    return Problem("apart", phases, **{"minimise": effort, **changed})


def checked(problem):
    """What is checked before a solve, without one."""
    check_before_solve(problem, parameters_of(problem))


def meeting_pairs():
    """Problems of two phases that meet, with nothing between their states."""
    same = free_pair()
    return {
        "the same range": (
            apart(same),
            r"begins between 0\.1 s and 1\.9 s, where 'push' ends, and both have the state "
            r"'position'.*links=joined.* or give 'position' an initial value in 'rest' if it",
        ),
        "another guess": (apart(free_pair(begins=Between(0.1, 1.9, 1.0))), "where 'push' ends"),
        "a budget of both": (
            apart(same, bounds=[sum(phase.integral(u**2) for phase in same) <= 9]),
            "where 'push' ends",
        ),
        "an end value in a bound": (
            apart(free_pair(final={}), bounds=[same[1].at_end(x) == 1]),
            "where 'push' ends",
        ),
    }


@pytest.mark.parametrize("which", meeting_pairs())
def test_phases_that_meet_at_a_free_time_without_a_link_are_told(which):
    problem, words = meeting_pairs()[which]
    with pytest.warns(StatementWarning, match=words):
        checked(problem)


def separate_pairs():
    """Problems of two phases that have a link, or that none needs."""
    pair, jumping, later = free_pair(), free_pair(), free_pair(begins=Between(0.1, 1.8))
    between = Unknown("between", "m")
    alike = Between(0.0, 1.9)
    side_by_side = tuple(
        Phase(name, RATES, start=alike, end=alike, final=GOAL) for name in ("calm", "windy")
    )
    return {
        "joined": apart(pair, links=joined(*pair)),
        "jumping": apart(jumping, links=joined(*jumping, jump={v: -v})),
        "by an unknown": apart(
            pair, bounds=[pair[0].at_end(x) == between, pair[1].at_start(x) == between]
        ),
        "by an expression of several": apart(pair, bounds=[pair[1].at_start(v - 2 * x) == 0]),
        "at a price": apart(
            pair,
            minimise=pair[0].integral(u**2) + (pair[1].at_start(x) - pair[0].at_end(x)) ** 2,
            bounds=[pair[1].peak(u) <= 3],
        ),
        "begins anew": apart(free_pair(initial=START)),
        "other ranges": apart(later),
        "a pause between": apart(later, links=[later[1].start_time == later[0].end_time + 0.1]),
        "side by side": apart(side_by_side),
        "side by side from one time on": apart(free_pair(begins=0.0)),
    }


@pytest.mark.parametrize("which", separate_pairs())
def test_phases_that_are_linked_or_separate_are_no_false_alarm(which):
    checked(separate_pairs()[which])
