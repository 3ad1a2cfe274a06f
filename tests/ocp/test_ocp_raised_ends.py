"""Kinks of end values and unknowns that are minimised."""

import casadi as ca
import pytest

from ocp import Control, Phase, Problem, State, Unknown, load, save, solve

x = State("x", "m")
u = Control("u", "m/s")
p = Unknown("p", "m", lower=-5, upper=5)
move = Phase("move", {x: u}, {x: 0}, end=1.0)
effort, end = move.integral(u**2), move.at_end(x)

# From 0 to y in 1 s the least effort is y^2, and the derivative of the rest is that of one side, or
# the optimum is on the kink
STATEMENTS = {
    "missed point": (3 * ca.fabs(end - 1) + effort, 1.0),
    "larger of two": (ca.fmax(end, 1 - end) + 0.1 * effort, 0.525),
    "off the kink": (ca.fabs(end - 1) + effort, 0.75),
    "lesser one, negative": (effort - ca.fmin(end, 2 - end), -0.25),
    # on the kink of the inner term: 2 max(|y - 1|, 0.2) + y^2 at y = 0.8
    "kink in a side": (2 * ca.fmax(ca.fabs(end - 1), 0.2) + effort, 1.04),
    "of an unknown": (4 * ca.fabs(p - 2) + (p - end) ** 2 + effort, 2.0),
}


@pytest.mark.parametrize(("cost", "least"), STATEMENTS.values(), ids=STATEMENTS)
def test_kinks_of_what_is_minimised(cost, least):
    found = solve(Problem("ends", move, minimise=cost))
    assert found.objective == pytest.approx(least, rel=1e-6)
    assert found.value(cost) == pytest.approx(found.objective, abs=1e-6)


def test_what_is_maximised_has_the_other_sign():
    found = solve(Problem("ends", move, maximise=-3 * ca.fabs(end - 1) - effort))
    assert found.objective == pytest.approx(-1.0, rel=1e-6)


def test_a_kink_that_gains_stays():
    problem = Problem("ends", move, minimise=effort - ca.fabs(end - 1), bounds=[end <= 5])
    found = solve(problem)
    assert found.form.problem is problem
    # y^2 - (1 - y) for y < 1
    assert found.objective == pytest.approx(-1.25, rel=1e-6)


def test_it_is_stored(tmp_path):
    found = solve(Problem("ends", move, minimise=STATEMENTS["missed point"][0]))
    save(found, tmp_path / "ends")
    assert load(tmp_path / "ends").objective == found.objective
