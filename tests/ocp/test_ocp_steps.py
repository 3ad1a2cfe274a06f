"""Steps of expressions that no derivative shows: said, and stated as phases they are solved."""

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Between,
    Constant,
    Control,
    Phase,
    Problem,
    Settings,
    State,
    StatementWarning,
    certify,
    joined,
    solve,
)
from ocp.analysis.sensitivity import ActiveSetWarning, slopes_by_multipliers
from ocp.numerics.stepwise_operations import stepwise_operations

x, speed = State("x", "m"), Control("speed", "m/s")


def crossing(rate, end=1.0):
    """One metre at a rate that depends on the place, with least effort."""
    phase = Phase("move", dynamics={x: rate}, initial={x: 0}, final={x: 1}, end=end)
    return Problem("crossing", phase, minimise=phase.integral(speed**2))


STEPPING = {
    "comparison": speed * ca.if_else(x < 0.5, 1, 2),
    "sign": speed * (1.5 + 0.5 * ca.sign(x - 0.5)),
    "floor": speed * (1 + ca.floor(2 * x + 1e-12)),
    "copysign": speed * (1.5 + 0.5 * ca.copysign(1, x.symbol - 0.5)),
    "angle": speed * (1.5 + ca.atan2(1e-9 * (x.symbol - 0.5), -1) / (2 * ca.pi)),
    "quotient": speed * (1.5 + 0.5 * (x - 0.5) / ca.fabs(x - 0.5)),
    "its inverse": speed * (1.5 + 0.5 * ca.fabs(x - 0.5) / (x - 0.5)),
    "root of a square": speed * (1.5 + 0.5 * (x - 0.5) / ca.sqrt((x - 0.5) ** 2)),
    "larger of two": speed * (1.5 + 0.5 * (x - 0.5) / ca.fmax(x - 0.5, 0.5 - x)),
    "square": speed * (1.5 + 0.5 * (x - 0.5) * ca.fabs(x - 0.5) / (x - 0.5) ** 2),
}


@pytest.mark.parametrize("rate", STEPPING.values(), ids=STEPPING)
def test_a_step_at_a_place_is_said(rate):
    with pytest.warns(StatementWarning, match=r"rate of 'x' in phase 'move' steps at 0\.8 s"):
        found = solve(crossing(rate))

    # the solver sees equal speeds in both halves; the optimum is 0.5625
    assert found.objective == pytest.approx(0.625, rel=1e-5)
    assert "need not be an optimum" in found.verdict


STEEPER = {
    "direction": (0.5 * (x - 0.5) / ca.norm_2(ca.vertcat(x - 0.5, 2 * x - 1)), "sqrt"),
    "arc tangent": (ca.atan(0.1 / (x - 0.5)) / ca.pi, "x - 0.5"),
    "arc tangent of a tangent": (0.1 * ca.sin(ca.atan(ca.tan(x + 1.0708))), "cos"),
    "hyperbolic tangent": (0.5 * ca.tanh(0.1 / (x - 0.5)), "x - 0.5"),
}


@pytest.mark.parametrize(("part", "divisor"), STEEPER.values(), ids=STEEPER)
def test_a_quotient_that_steps_where_its_divisor_vanishes_is_said(part, divisor):
    with pytest.warns(StatementWarning, match=f"'.*{divisor}.*' vanishes, by which it divides"):
        found = solve(crossing(speed * (1.5 + part)))
    assert not certify(found).passed


SMOOTH = {
    "sine": ca.sin(x - 0.5) / (x - 0.5),
    "exponential": (ca.exp(x - 0.5) - 1) / (x - 0.5),
    "modulus": (x - 0.5) ** 2 / ca.fabs(x - 0.5),
    "rounded": (x - 0.5) / ca.sqrt((x - 0.5) ** 2 + 1e-4),
    "soft": (x - 0.5) / (ca.fabs(x - 0.5) + 1e-2),
    "tangent": ca.cos(3 * x) * ca.tan(3 * x),
}


LONG = {"soft"}


@pytest.mark.parametrize(
    "part",
    [pytest.param(p, marks=[pytest.mark.slow] * (n in LONG)) for n, p in SMOOTH.items()],
    ids=SMOOTH,
)
def test_a_quotient_that_goes_on_where_its_divisor_vanishes_is_no_step(part):
    # The rate is 0/0 next to a breakpoint of 20 intervals: there rounding decides whether a mesh is
    # solved.
    found = solve(crossing(speed * (1.5 + 0.5 * part)), settings=Settings(intervals=21))
    assert "steps" not in found.verdict
    assert certify(found).passed


def test_the_remedy_finds_the_optimum():
    """With t the time in the first half, J = 0.25 / t + 0.0625 / (1 - t), least at t = 2/3."""
    meeting = Between(0.1, 0.9)
    slow = Phase("slow", dynamics={x: speed}, initial={x: 0}, final={x: 0.5}, end=meeting)
    fast = Phase("fast", dynamics={x: 2 * speed}, final={x: 1}, start=meeting, end=1.0)
    cost = slow.integral(speed**2) + fast.integral(speed**2)
    found = solve(Problem("crossing", [slow, fast], minimise=cost, links=joined(slow, fast)))
    assert found.objective == pytest.approx(0.5625, rel=1e-7)
    assert found.value(slow.end_time) == pytest.approx(2 / 3, abs=1e-4)
    assert certify(found).passed


def test_a_remainder_steps_too():
    place = speed - 0.5 * ca.fmod(x.symbol, 0.6)
    with pytest.warns(StatementWarning, match=r"rate of 'x'.* steps at .*fmod"):
        solve(crossing(place))


CONTINUOUS = {
    "one comparison": ca.if_else(x < 0.5, 1, 2 * x),
    "two that change together": ca.if_else(x < 0.5, 1, 0) + ca.if_else(x - 0.5 >= 0, 2 * x, 0),
    "kink": ca.fabs(x - 0.3) + 1,
}


@pytest.mark.parametrize("factor", CONTINUOUS.values(), ids=CONTINUOUS)
def test_a_kink_is_no_step(factor):
    # the optimum has x' / factor constant, and J is the square of the integral of 1 / factor
    found = solve(crossing(speed * factor))
    at = np.linspace(0, 1, 200_001)
    middle = 0.5 * (at[1:] + at[:-1])
    values = ca.Function("factor", [x.symbol], [factor])(middle[None, :])
    assert found.objective == pytest.approx(float(np.mean(1 / np.array(values))) ** 2, rel=1e-6)
    assert certify(found).passed


def test_a_known_time_is_no_step_that_moves_but_its_constant_has_no_slope():
    """J = 1 / (4 - 3 c), whose slope by c = 0.4 is 3 / 2.8^2: multipliers would say 0."""
    change = Constant("change", "s", 0.4)
    found = solve(crossing(speed * ca.if_else(change > TIME, 1, 2)))
    assert found.objective == pytest.approx(1 / 2.8, rel=1e-6)
    assert certify(found).passed
    with pytest.warns(ActiveSetWarning, match="'change'.* are not known"):
        slopes = found.sensitivities()
    assert np.isnan([slopes[name] for name in ("change", "move: start", "move: end")]).all()
    assert slopes["move: x final"] == pytest.approx(2 / 2.8, rel=1e-5)
    assert np.isnan(slopes_by_multipliers(found)["change"])


def test_a_known_time_is_no_step_that_moves_where_the_end_is_free():
    found = solve(crossing(speed * ca.if_else(TIME < 0.4, 1, 1.001), end=Between(0.5, 1.0)))
    assert certify(found).passed


def test_a_time_that_no_breakpoint_is_held_at_moves_where_the_end_is_free():
    change = Constant("change", "s", 0.4)
    rate = speed * ca.if_else(change > TIME, 1, 1.001)
    with pytest.warns(StatementWarning, match=r"steps at 0\.4 s, where 'time < change' changes"):
        solve(crossing(rate, end=Between(0.5, 1.0)))


def test_friction_of_one_sign_is_no_step():
    place, rate = State("place", "m"), State("rate", "m/s")
    force = Control("force", "N")
    phase = Phase(
        "slide",
        dynamics={place: rate, rate: force - ca.sign(rate)},
        initial={place: 0, rate: 0},
        final={place: 1, rate: 0},
        end=2.0,
    )
    found = solve(Problem("slide", phase, minimise=phase.integral((force - 1) ** 2)))
    assert found.objective == pytest.approx(12 / 2**3, rel=1e-6)
    assert "steps" not in found.verdict


def test_stepwise_operations_share_their_parts():
    """Of 40 signs in a chain each is written once, and not once for each of those after it."""
    symbol = ca.SX.sym("s")
    value = symbol
    for k in range(40):
        value = ca.sin(value) + ca.sign(value - 0.01 * k)
    found = stepwise_operations([value], [symbol])
    together = ca.Function("results", [symbol], [ca.vertcat(*found.results)])
    assert together.size1_out(0) == 40
    assert together.n_instructions() < 300
    # with the results of a place the function has the value of the expression there
    results = together(0.5)
    again = ca.Function("value", [symbol], [value])(0.5)
    assert float(found.function(0.5, results)) == pytest.approx(float(again), abs=1e-14)
