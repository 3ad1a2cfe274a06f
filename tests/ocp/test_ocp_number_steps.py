"""Steps as an end value, a time or a parameter changes: said, and not certified."""

import casadi as ca
import pytest

from ocp import (
    TIME,
    Between,
    Bound,
    Control,
    Phase,
    Problem,
    State,
    StatementWarning,
    Unknown,
    certify,
    solve,
)

x, u = State("x"), Control("u", lower=-3, upper=3)


def move(**options):
    """A phase that starts at zero."""
    return Phase(
        "move", {x: options.pop("rate", u)}, {x: 0}, end=options.pop("end", 1.0), **options
    )


def stepping(step, effort=u**2):
    """A problem whose objective steps with the end of x; it ends at 0.7 on the side of zero."""
    phase = move()
    end = phase.at_end(x)
    return Problem(
        "p", phase, minimise=phase.integral(effort) + (end - 1.4) ** 2 + step(end, phase)
    )


def of_a_parameter(rate, lower=-1.0):
    """A problem whose rate depends on a parameter."""
    p = Unknown("p", lower=lower, upper=2, guess=1)
    phase = move(rate=u + rate(p), final={x: -1})
    return Problem("p", phase, minimise=phase.integral(u**2) + 0.01 * (p - 0.5) ** 2)


def late():
    """A bonus beyond 3 s, where the effort alone asks for 2.2 s."""
    phase = move(end=Between(0.5, 5), final={x: 1})
    bonus = ca.if_else(phase.end_time > 3, -10, 0)
    return Problem("p", phase, minimise=phase.integral(u**2) + 0.2 * phase.duration + bonus)


def far_off():
    """A bonus for an end that is eight times as far off as the start, which no limit excludes."""
    phase = Phase("move", {x: u}, {x: 0.2}, end=1.0)
    bonus = ca.if_else(phase.at_end(x) > 1.6, -3, 0)
    return Problem("p", phase, minimise=phase.integral(u**2) / 2 + bonus)


def for_a_short_time(p):
    """A push that a parameter turns on, for a twentieth of the phase."""
    return ca.if_else(p.symbol > 1.5, 10, 0) * ca.if_else(TIME.symbol < 0.05, 1, 0)


def in_a_bound():
    phase = move()
    end = phase.at_end(x)
    bound = Bound("allowed", end + ca.if_else(end > 0.5, 0.1, 0), upper=2)
    return Problem("p", phase, minimise=phase.integral((u - 0.3) ** 2), bounds=[bound])


STEPS = {
    "end value": (stepping(lambda end, _: ca.floor(end)), "the objective steps at x at the end"),
    "quotient": (stepping(lambda end, _: end / ca.fabs(end)), "'abs.*' vanishes"),
    "expression": (stepping(lambda _, p: p.at_end(ca.floor(x))), r"the floor\(x\) at the end of"),
    "time": (late(), r"the objective steps at end of move = 3 s \(now 2.23607\)"),
    "far off": (far_off(), r"the objective steps at x at the end of move = 1.6 \(now 0.2\)"),
    "bound": (in_a_bound(), "the bound 'allowed' steps at x at the end of move = 0.5"),
    "parameter": (of_a_parameter(ca.sign), "the rate of 'x' steps at p = 0"),
    "a short time": (of_a_parameter(for_a_short_time), "the rate of 'x' steps at p = 1.5"),
    "its quotient": (of_a_parameter(lambda p: p / ca.fabs(p)), r"p = 0 \(now 0.5\)"),
}


@pytest.mark.parametrize(("problem", "words"), STEPS.values(), ids=STEPS)
def test_a_step_beside_the_motion_is_said(problem, words):
    with pytest.warns(StatementWarning, match=words):
        found = solve(problem)
    assert "the answer may be the best on its own side of that value only" in found.verdict


def fixed(**options):
    phase = move(**options)
    return Problem("p", phase, minimise=phase.integral(u**2) + ca.floor(phase.at_end(x)))


def bounded():
    phase = move()
    end = phase.at_end(x)
    bounds = [Bound("end", end, lower=1.1, upper=1.9)]
    return Problem("p", phase, minimise=phase.integral(u**2) + ca.floor(end), bounds=bounds)


NONE = {
    "given": fixed(final={x: 1.5}),
    "limited": fixed(final={x: (1.1, 1.9)}),
    "bounded": bounded(),
    "parameter of one sign": of_a_parameter(ca.sign, lower=0.1),
    "smooth quotient": of_a_parameter(lambda p: p / (1 + p.symbol**2)),
    "kink": stepping(lambda end, _: ca.fabs(end - 3)),
}


@pytest.mark.parametrize("problem", NONE.values(), ids=NONE)
def test_what_cannot_step_is_certified(problem):
    found = solve(problem)
    assert "steps" not in found.verdict
    assert certify(found).passed


def test_an_objective_that_steps_with_an_integral_counts_all_of_it():
    phase = move(final={x: 1})
    effort = phase.integral(u**2)
    with pytest.warns(StatementWarning, match="steps at integral of u"):
        found = solve(Problem("p", phase, minimise=effort + ca.floor(effort / 0.7)))
    assert found.objective == pytest.approx(2.0, rel=1e-6)
    assert not found.problem.summed
