"""Which controls are tried in place of a motion's own."""

from __future__ import annotations

import math
import re

import pytest

from ocp import Control, Phase, Problem, State, certify, solve

x = State("x")


def solved(problem):
    """A solution, and what its certificate says of other controls."""
    found = solve(problem)
    (check,) = [check for check in certify(found).checks if check.name == "other controls"]
    return found, check


def test_controls_that_a_constraint_forbids_are_none() -> None:
    throttle = Control("throttle", lower=-2, upper=2)
    forward = Phase(
        "go",
        {x: 1 - (throttle**2 - 1) ** 2 + 0.3 * throttle * x},
        initial={x: -1},
        end=2.0,
        bounds=[throttle * (1 + 0.1 * throttle**2) >= 0],
    )
    _, check = solved(Problem("forward", forward, maximise=forward.at_end(x)))
    assert check.passed


def test_a_valley_narrower_than_the_steps_between_what_is_tried_is_found() -> None:
    """A lagrangian with two valleys of width 0.1, the second one deeper by 0.2."""
    place, control = State("x", lower=-2, upper=2), Control("u", lower=-1.7, upper=1.7)
    guess = {place: (0, 1), control: 1.0}
    phase = Phase("go", {place: control}, initial={place: 0}, end=1.0, guess=guess)
    cost = phase.integral(40 * (control**2 - 1) ** 2 + 0.1 * control)
    found, check = solved(Problem("narrow", phase, minimise=cost))
    assert found.objective == pytest.approx(0.1, rel=1e-3)
    assert re.search(r"u = -1(\.00\d)? instead of 0\.99", check.sentence)
    assert check.value == pytest.approx(2.0, rel=1e-2)


@pytest.mark.parametrize("limit", [math.inf, 30.0, 1e3, 1e6])
def test_limits_far_wider_than_the_motion_hide_no_valley(limit: float) -> None:
    """Valleys at 1 and, deeper by 0.6, at -1: 33 values between the limits may miss both."""
    place, control = State("x"), Control("u", lower=-limit, upper=limit)
    go = Phase("go", {place: control}, {place: 0}, end=1.0, guess={control: 1.0})
    cost = (control**2 - 1) ** 2 + 0.3 * control + 1e-3 * place
    found, check = solved(Problem("wide", go, minimise=go.integral(cost)))
    assert found.objective == pytest.approx(0.294, abs=1e-2)
    assert "u = -1.0" in check.sentence
    assert check.value > 1.0


@pytest.mark.parametrize("limit", [math.inf, 1e3, 1e6])
def test_wide_limits_do_not_refuse_the_deeper_valley(limit: float) -> None:
    place, control = State("x"), Control("u", lower=-limit, upper=limit)
    go = Phase("go", {place: control}, {place: 0}, end=1.0, guess={control: -1.0})
    cost = (control**2 - 1) ** 2 + 0.3 * control + 1e-3 * place
    _, check = solved(Problem("wide", go, minimise=go.integral(cost)))
    assert check.passed
