"""Phases that meet at free times: guesses in order, several starts, phases that need no time.

A metre from rest to rest in a second, with forces of which each phase has its own strength. By the
times at which they meet the least effort is stationary where it is no minimum, and least where a
phase takes no time.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest

from ocp import TIME, Between, Bound, Control, Phase, Problem, State, audit, joined, solve
from ocp.mesh.initial_guess import drawn_times, guessed_times
from tests.ocp.problems import certified, check_of, failed

x, v, u = State("x"), State("v"), Control("u")


def least_effort(meetings: Sequence[float], strengths: Sequence[float]) -> float:
    """Closed form with given meetings: the inverse of the Gramian of moments of (1 - t, 1)."""

    def moment(first: float, last: float, power: int) -> float:
        return ((1 - first) ** (power + 1) - (1 - last) ** (power + 1)) / (power + 1)

    gramian = np.zeros((2, 2))
    ends = itertools.pairwise([0.0, *meetings, 1.0])
    for (first, last), strength in zip(ends, strengths, strict=True):
        powers = ((2, 1), (1, 0))
        gramian += strength**2 * np.array([[moment(first, last, p) for p in row] for row in powers])
    return float(np.linalg.solve(gramian, [1.0, 0.0])[0])


def metre(strengths: Sequence[float], latest: float) -> Problem:
    """Phases that meet anywhere between 0 and `latest`, without a guess."""
    last = len(strengths) - 1
    phases = [
        Phase(
            f"p{i}",
            dynamics={x: v, v: strength * u},
            initial={x: 0, v: 0} if i == 0 else {},
            final={x: 1, v: 0} if i == last else {},
            start=Between(0, latest) if i else 0.0,
            end=1.0 if i == last else Between(0, latest),
        )
        for i, strength in enumerate(strengths)
    ]
    links = [link for pair in itertools.pairwise(phases) for link in joined(*pair)]
    return Problem("metre", phases, minimise=sum(p.integral(u**2) for p in phases), links=links)


def test_the_closed_form_is_stationary_where_it_is_no_minimum() -> None:
    near = [least_effort([t], (0.5, 1.0)) for t in (0.64, 2 / 3, 0.69)]
    assert near[1] == pytest.approx(27.0, rel=1e-12)
    assert near[0] < near[1] < near[2]
    assert near[1] - near[0] < 1e-2
    assert least_effort([0.0], (0.5, 1.0)) == pytest.approx(12.0, rel=1e-12)


@pytest.mark.parametrize(
    ("strengths", "latest", "meetings"),
    [
        ((0.5, 1.0), 5.0, (0.0,)),
        ((0.99, 0.76, 1.27, 0.73), 5.0, (0.0, 0.0, 1.0)),
        ((1.25, 1.07, 1.41), 1.0, (0.0, 0.0)),
        pytest.param((1.45, 0.56, 1.44), 1.0, (1.0, 1.0), marks=pytest.mark.slow),
        pytest.param((0.98, 0.91, 0.47), 0.8, (0.8, 0.8), marks=pytest.mark.slow),
    ],
)
def test_the_least_effort_is_found_and_weak_phases_take_no_time(strengths, latest, meetings):
    # without a warning: rates of a phase without length divide by nothing
    solution = certified(metre(strengths, latest), least_effort(meetings, strengths), 1e-8)
    ends = [solution.value(phase.end_time) for phase in solution.problem.phases[:-1]]
    assert ends == pytest.approx(meetings, abs=1e-6)


@pytest.mark.slow
def test_an_audit_draws_the_meetings() -> None:
    found = audit(metre((0.5, 1.0), 5.0), starts=6)
    assert found.best.objective == pytest.approx(12.0, rel=1e-8)


def test_times_without_a_guess_are_spread_between_the_others() -> None:
    phases = metre((1, 1, 1, 1), 5.0).phases
    times = guessed_times(phases)
    assert [times[p.name] for p in phases] == [(0, 0.25), (0.25, 0.5), (0.5, 0.75), (0.75, 1.0)]
    # middles that are in order stay, and so does what is stated
    assert guessed_times(metre((1, 1), 0.8).phases)["p1"] == (0.4, 1.0)
    stated = Between(0, 5, guess=3.0)
    first = Phase("first", {x: u}, initial={x: 0}, end=stated)
    second = Phase("second", {x: u}, start=stated, end=Between(0, 9))
    third = Phase("third", {x: u}, final={x: 1}, start=Between(0, 9), end=Between(0, 8))
    assert guessed_times([first, second, third]) == {
        "first": (0, 3),
        "second": (3, 3.5),
        "third": (3.5, 4),
    }
    with_gap = Phase("third", {x: u}, final={x: 1}, start=4.5, end=6.0)
    assert guessed_times([first, second, with_gap])["third"] == (4.5, 6.0)


def test_drawn_times_keep_their_order_what_is_known_and_their_limits() -> None:
    phases = metre((1, 1, 1), 0.9).phases
    random = np.random.default_rng(0)
    ends = []
    for _ in range(50):
        drawn = drawn_times(phases, guessed_times(phases), random)
        times = [drawn["p0"][0], *(drawn[p.name][1] for p in phases)]
        assert all(a < b for a, b in itertools.pairwise(times))
        assert (times[0], times[-1]) == (0.0, 1.0)
        assert max(times[1:-1]) <= 0.9
        ends.append(times[1])
    assert min(ends) < 0.1
    assert max(ends) > 0.6


def climb(weak_start: float | None = None) -> Problem:
    """As fast as possible: a push of 2 for up to a second, then one of 1.5 against a drag of 1."""
    speed = State("speed", "m/s")
    first = Control("first push", "m/s^2", lower=0, upper=2)
    second = Control("second push", "m/s^2", lower=0, upper=1.5)
    guesses: list[dict[Any, Any]] = [{}, {}]
    meeting, end = Between(0.5, 1), Between(0.5, 3)
    if weak_start is not None:
        guesses = [{first: 2, speed: (0, 2)}, {second: weak_start, speed: 2}]
        meeting, end = Between(0.5, 1, guess=1), Between(0.5, 3, guess=1.01)
    start = Phase("start", {speed: first}, {speed: 0}, end=meeting, guess=guesses[0])
    climb = Phase("climb", {speed: second - 1}, start=meeting, end=end, guess=guesses[1])
    fastest = climb.at_end(speed)
    return Problem("climb", [start, climb], maximise=fastest, links=joined(start, climb))


def test_a_phase_that_pays_with_other_controls_does_not_vanish() -> None:
    # in a phase without duration any control is stationary, and by a weak one a longer phase loses
    certified(climb(), 2.0 + 0.5 * 2.0)


def test_a_vanished_phase_is_refused_where_a_longer_one_would_pay() -> None:
    # a stated guess is the user's choice of a valley
    found = solve(climb(weak_start=0.8))
    assert found.objective == pytest.approx(2.0, rel=1e-6)
    told = check_of(found, "other controls").sentence
    assert "phase 'climb' has zero duration (at 1 s), but if it lasts 1 s with" in told
    assert "with second push = 1.5 m/s^2 instead of 0.9" in told
    assert "the objective may improve by 25 %; give a guess" in told
    # beside it the solver may find the longer phase, too
    assert failed(found) <= {"other controls", "a second solve"}


@pytest.mark.parametrize("weak_start", [0.7, 0.9])
def test_a_vanished_phase_is_not_cut_for_what_a_longer_one_would_gain(weak_start: float) -> None:
    # 26 meshes were solved in vain, in the end with intervals without any width
    assert len(solve(climb(weak_start)).mesh_iterations) <= 4


def test_switches_of_a_phase_that_takes_no_time_are_not_spoken_of() -> None:
    """A limit makes the control swing in it, and nothing is to be gained by it."""
    place, rate = State("place", "m"), State("rate", "m/s")
    swinging = Control("swinging", "m/s^2", lower=-1, upper=1)
    force = Control("force", "m/s^2", lower=-1, upper=1)
    limit = Bound("swing", swinging - ca.sin(40 * TIME), upper=0)
    meeting = Between(0, 1e-3)
    start, goal = {place: 0, rate: 0}, {place: 1, rate: 0}
    first = Phase("first", {place: rate, rate: swinging}, start, end=meeting, bounds=[limit])
    end, rates = Between(0.5, 5), {place: rate, rate: force}
    second = Phase("second", rates, final=goal, start=meeting, end=end)
    cost = second.end_time + first.integral(place * swinging)
    found = solve(Problem("rest", [first, second], minimise=cost, links=joined(first, second)))
    assert found.objective == pytest.approx(2.0, rel=1e-6)
    assert found.value(first.duration) < 1e-6
    assert "a control switches on a breakpoint" not in found.verdict
