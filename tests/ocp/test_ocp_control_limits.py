"""Limits that tie controls together: another value of the one needs another of the other."""

from __future__ import annotations

import re

import casadi as ca
import pytest

from ocp import (
    TIME,
    Algebraic,
    Between,
    Bound,
    Certificate,
    Control,
    Finding,
    Phase,
    Problem,
    Solution,
    State,
    certify,
    solve,
)

x = State("x")
ENGINE, BATTERY = Control("engine", lower=0, upper=2), Control("battery", lower=-1.6, upper=1.6)

# an engine that is best at none or full of its power
FUEL = ENGINE + 0.45 * ca.sin(ca.pi * ENGINE) ** 2 + 0.3 * ca.sin(ca.pi * ENGINE / 2) ** 2


def driven(demand: Bound, battery: Control | Algebraic, **states) -> Solution:
    """A drive that begins with the engine at half its power, and ends with a battery as full."""
    rates, initial = states.get("rates", {}), states.get("initial", {})
    phase = Phase(
        "drive",
        {x: -battery.symbol, **rates},
        initial={x: 0, **initial},
        final={x: 0},
        end=1.0,
        bounds=[demand],
        guess={x: (0, 0), ENGINE: 1, battery: 0, **initial},
    )
    cost = phase.integral(FUEL + 0.1 * battery.symbol**2)
    return solve(Problem("split", phase, minimise=cost))


def refused(found: Solution) -> bool:
    """Whether a certificate speaks of other controls."""
    return not told(found).passed


def told(found: Solution) -> Finding:
    """What a certificate says of other controls."""
    certificate: Certificate = certify(found)
    (check,) = [check for check in certificate.checks if check.name == "other controls"]
    return check


def test_controls_that_share_a_demand_are_tried_together() -> None:
    found = driven(
        Bound("demand", ENGINE + BATTERY - 1 - 0.5 * ca.sin(6 * TIME.symbol), lower=0, upper=0),
        BATTERY,
    )
    assert found.objective == pytest.approx(1.316, rel=1e-3)  # and 1.05 by turns
    assert refused(found)


@pytest.mark.slow
def test_a_demand_that_may_be_exceeded_is_kept() -> None:
    found = driven(Bound("demand", ENGINE + BATTERY, lower=1), BATTERY)
    assert found.objective == pytest.approx(1.3, rel=1e-3)  # and 1.1 by turns
    assert refused(found)


@pytest.mark.slow
def test_an_algebraic_signal_changes_with_the_controls() -> None:
    battery = Algebraic("battery", lower=-1.6, upper=1.6)
    found = driven(Bound("demand", ENGINE + battery, lower=1, upper=1), battery)
    assert found.objective == pytest.approx(1.3, rel=1e-3)
    assert refused(found)


@pytest.mark.slow
def test_a_demand_may_depend_on_states() -> None:
    speed = State("speed")
    found = driven(
        Bound("demand", ENGINE + BATTERY - 0.5 * speed, lower=0, upper=0),
        BATTERY,
        rates={speed: ENGINE + BATTERY - 0.5 * speed},
        initial={speed: 2},
    )
    assert found.objective == pytest.approx(1.3, rel=1e-3)
    assert refused(found)


def test_a_limit_with_a_gap_is_crossed() -> None:
    """|u| >= 1: all is linear but the limit, and a guess is on its wrong side."""
    u = Control("u", lower=-2, upper=2)
    gap = Bound("on", u**2, lower=1)
    phase = Phase("go", {x: u}, initial={x: 3}, end=1.0, bounds=[gap], guess={x: (3, 4), u: 1})
    found = solve(Problem("gap", phase, minimise=phase.integral(x)))
    assert found.objective == pytest.approx(3.5, rel=1e-6)  # and 2 with u = -2
    check = told(found)
    assert "u = -2 instead of 1" in check.sentence
    assert not check.passed


@pytest.mark.slow
def test_a_cost_above_a_curve_of_the_control_follows_it_into_other_valleys() -> None:
    """The curve has a valley of 0.397 where the guess is, and one of nothing at 1."""
    u, cost = Control("u", lower=-2, upper=3), Control("cost", lower=0, upper=20)
    curve = Bound("curve", cost - (u**2 - 1) ** 2 - 0.2 * (1 - u), lower=0)
    guess = {u: -1, cost: 1, x: (0, -1)}
    phase = Phase("go", {x: u}, initial={x: 0}, end=1.0, bounds=[curve], guess=guess)
    found = solve(Problem("curve", phase, minimise=phase.integral(cost + 1e-9 * x)))
    assert found.objective == pytest.approx(0.397434, rel=1e-5)
    check = told(found)
    assert re.search(r"u = (1|0\.99\d) instead of -0\.974, cost = ", check.sentence)
    assert not check.passed


@pytest.mark.parametrize(
    ("guessed", "best"), [(-1.0, False), pytest.param(1.0, True, marks=pytest.mark.slow)]
)
def test_a_curve_that_depends_on_a_state_has_valleys_too(guessed: float, best: bool) -> None:
    u, cost = Control("u", lower=-2, upper=3), Control("cost", lower=0, upper=20)
    curve = Bound("curve", cost - (u**2 - 1) ** 2 - 0.2 * (1 - u) - 0.1 * x, lower=0)
    guess = {u: guessed, cost: 1, x: (0, guessed)}
    phase = Phase("go", {x: u}, initial={x: 0}, end=1.0, bounds=[curve], guess=guess)
    found = solve(Problem("curve", phase, minimise=phase.integral(cost + 1e-3 * x**2)))
    assert (found.objective < 0.1) == best
    assert refused(found) != best
    assert certify(found).passed == best


def test_in_a_disc_nothing_better_is_found() -> None:
    """A push of one size in any direction: the Hamiltonian is linear, and the limit is convex."""
    y, a, b = State("y"), Control("a"), Control("b")
    disc = Bound("disc", a**2 + b**2, upper=1)
    rates, ends = {x: a + 0.5 * y, y: b}, {x: 2, y: 1}
    phase = Phase("go", rates, {x: 0, y: 0}, ends, end=Between(0.5, 9), bounds=[disc])
    found = solve(Problem("ferry", phase, minimise=phase.duration))
    assert certify(found).passed
