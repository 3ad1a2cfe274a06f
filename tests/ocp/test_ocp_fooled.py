"""Problems made to fool the engine, most of which nobody would state, end as the page says.

The page is `docs/explanation/fooled.md`. Where an answer is wrong, either a warning, an error or a
certificate tells. It names the two that pass all the same.
"""

import math
import warnings
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Between,
    Bound,
    Constant,
    Control,
    OcpError,
    Phase,
    Problem,
    Settings,
    Solution,
    State,
    StatementWarning,
    certify,
    joined,
    solve,
)

Planted = tuple[Callable[[], Solution], float]  # solves it as a user would; the least objective

X, V = State("x", "m"), State("v", "m/s")
SHORT = Settings(iterations=600)  # of a solve that finds nothing with 10,000 iterations either

# ------------------------------------------------------------------------------- what hides in time


def _metre(extra: ca.SX = 0.0, cost: ca.SX = 0.0, origin: float = 0.0) -> Problem:
    """A metre from rest to rest in a second: 12 for the least integral of the square."""
    u = Control("u", "m/s^2")
    ends = {X: origin, V: 0}, {X: origin + 1, V: 0}
    move = Phase("move", {X: V, V: u + extra}, *ends, end=1.0)
    return Problem("metre", [move], minimise=move.integral(u**2 + cost))


def _pulse(at: float, width: float) -> ca.SX:
    """A pulse of time whose largest value is 1."""
    return ca.exp(-(((TIME - at) / width) ** 2))


def _gust() -> Planted:
    """An acceleration of 0.5 m/s in a ten thousandth of a second."""
    at, speed, width = 0.4321, 0.5, 1e-4
    way = 1 - speed * (1 - at)
    strength = speed / (width * math.sqrt(math.pi))
    optimum = 12 * (way**2 + way * speed) + 4 * speed**2
    return lambda: solve(_metre(strength * _pulse(at, width))), optimum


def _hidden_gust() -> Planted:
    """A control that only pays for a thousandth of a second, and rests at zero otherwise."""
    at, width, most = 0.4321, 5e-4, 30.0
    w = Control("w", "1", lower=0, upper=1)
    half = math.sqrt(math.log(most)) * width
    t = np.linspace(-half, half, 100_001)
    gained = float(np.trapezoid(most * np.exp(-((t / width) ** 2)) - 1, t))
    return lambda: solve(_metre(cost=w * (1 - most * _pulse(at, width)))), 12 - gained


# ----------------------------------------------------------------------------------------- sizes


def _far_origin() -> Planted:
    return lambda: solve(_metre(origin=1e9)), 12.0


def _near_origin() -> Planted:
    return lambda: solve(_metre(origin=1e7)), 12.0


def _oscillator() -> Planted:
    """Van der Pol's oscillator whose states are said to be a million times as large."""
    x, y = State("x", scale=1e6), State("y", lower=-0.4, scale=1e6)
    u = Control("u")
    swing = Phase("swing", {x: y, y: -x + y * (1 - x**2) + u}, {x: 1, y: 0}, end=5.0)
    problem = Problem("oscillator", [swing], minimise=swing.integral(x**2 + y**2 + u**2))
    return lambda: solve(problem), 2.9537014


def _wide() -> Planted:
    """A metre with a pause, and limits of 1e6 that stand for none."""
    wide = 1e6
    x, v = State("x", "m", lower=-wide, upper=wide), State("v", "m/s", lower=-wide, upper=wide)
    u = Control("u", "m/s^2", lower=-wide, upper=wide)
    ends, begins = Between(0, 2, 0.3), Between(0, 2, 0.6)
    push = Phase("push", {x: v, v: u}, {x: 0, v: 0}, end=ends)
    coast = Phase("coast", {x: v, v: 0 * v}, start=ends, end=begins)
    brake = Phase("brake", {x: v, v: u}, final={x: 1, v: 0}, start=begins, end=1.0)
    problem = Problem(
        "pause",
        (push, coast, brake),
        minimise=push.integral(u**2) + brake.integral(u**2),
        links=(*joined(push, coast), *joined(coast, brake)),
        bounds=[coast.duration >= 0.3],
    )
    return lambda: solve(problem), 1.5 / (0.5**3 - 0.15**3)


# -------------------------------------------------------------------- stationary, and no minimum


def _saddle() -> Planted:
    """Standing still is best up to a constant of pi^2, and a saddle beyond."""
    push = Constant("push", "1/s^2", 5.0)
    x, u = State("x", "m", lower=-1, upper=1), Control("u", "m/s", lower=-20, upper=20)
    way = Phase("way", {x: u}, {x: 0}, {x: 0}, end=1.0)
    problem = Problem("unstable", [way], minimise=way.integral(u**2 - push * x**2))

    # up to the limit by a sine, along it, and back: sine and cosine have the same mean square
    optimum = -12.0 * (1 - math.pi / math.sqrt(12.0))
    return lambda: solve(problem, guess=solve(problem), constants={push: 12.0}), optimum


def _inflection() -> Planted:
    """Behind the switch the same control does more; slope and curvature by its time vanish."""
    least, most = Constant("least", "s", 0.0), Constant("most", "s", 1e3)
    u, half = Control("u", "m/s^2"), math.sqrt(2.0)
    switch, end = Between(0, 1e3), Between(0, 1e3)
    first = Phase("first", {X: V, V: u}, {X: 0, V: 0}, end=switch)
    then = Phase("then", {X: V, V: 2 * u}, final={X: 1, V: 0}, start=switch, end=end)
    cost = first.integral(u**2) + then.integral(u**2) + then.end_time
    limits = [Bound("switch", first.end_time, "s", lower=least, upper=most)]
    problem = Problem("hand_over", [first, then], cost, links=joined(first, then), bounds=limits)
    elsewhere = {least: half, most: half}
    return lambda: solve(problem, guess=solve(problem, constants=elsewhere)), 4 / math.sqrt(3)


def _flat() -> Planted:
    """The fourth power of the way; the guess is to stay, where no derivative tells."""
    u = Control("u", "m/s^2", lower=-1, upper=1)
    move = Phase("move", {X: V, V: u}, {X: 0, V: 0}, end=1.0, guess={u: 0.0})
    problem = Problem("flat", [move], maximise=move.at_end(X) ** 4)
    return lambda: solve(problem), 0.5**4


def _ridge() -> Planted:
    """Two wells, and a start on the kink between them."""
    push = Constant("push", "m", 0.0)
    u = Control("u", "m/s")
    go = Phase("go", {X: u}, {X: 0}, end=1.0)
    problem = Problem("wells", [go], minimise=go.integral(u**2 + 4 * (ca.fabs(X) - push) ** 2))
    return lambda: solve(problem, guess=solve(problem), constants={push: 1.0}), 2 * math.tanh(2.0)


# ------------------------------------------------------------------------------------------ steps


def _crossing(weight: ca.SX) -> Problem:
    """A metre in a second, twice as fast behind its half: 0.5625."""
    u = Control("u", "m/s")
    move = Phase("move", {X: u * (1.5 + 0.5 * weight)}, {X: 0}, {X: 1}, end=1.0)
    return Problem("crossing", [move], minimise=move.integral(u**2))


def _sign() -> Planted:
    return lambda: solve(_crossing(ca.sign(X - 0.5))), 0.5625


def _steep() -> Planted:
    return lambda: solve(_crossing(ca.tanh(1e7 * (X - 0.5)))), 0.5625


def _floor() -> Planted:
    """An objective that steps with the end value."""
    u = Control("u", lower=-3, upper=3)
    move = Phase("move", {X: u}, {X: 0}, end=1.0)
    end = move.at_end(X)
    cost = move.integral(u**2) + (end - 1.4) ** 2 + ca.floor(end)
    return lambda: solve(Problem("floor", [move], minimise=cost)), 0.96


# ------------------------------------------------------------------------------- controls far away


def _wells() -> Planted:
    """Two local minima of the Hamiltonian; the guess is in the worse one."""
    u = Control("u", lower=-2, upper=2)
    go = Phase("go", {X: u}, {X: 0}, end=1.0, guess={X: (0, -1), u: -1})
    problem = Problem("wells", [go], minimise=go.integral((u**2 - 1) ** 2) - 0.3 * go.at_end(X))
    values = np.linspace(0.9, 1.2, 1_000_001)
    return lambda: solve(problem), float(((values**2 - 1) ** 2 - 0.3 * values).min())


def _dead_zone() -> Planted:
    """Full flow for half of the time is cheaper than less all the time."""
    u = Control("u")
    rate = ca.fmax(u - 2, 0) + ca.fmin(u + 2, 0)
    go = Phase("go", {X: rate}, {X: 0}, {X: 1}, end=1.0, guess={u: 3.0, X: (0, 1)})
    problem = Problem("dead zone", [go], minimise=go.integral(u**2))
    return lambda: solve(problem), 8.0


# ------------------------------------------------------------------------------------ known times


def _tariff() -> Planted:
    """A price that falls to a hundredth at 0.9 s, and an end that is free."""
    u = Control("u", "m/s")
    price = ca.pw_const(TIME, ca.DM([0.9]), ca.DM([1, 0.01]))
    go = Phase("go", {X: u}, {X: 0}, {X: 1}, end=Between(0.2, 3))
    cost = go.integral(u**2 * price) + 0.05 * go.duration
    t = np.linspace(0.2, 3, 2_000_001)
    costs = 1 / (np.minimum(t, 0.9) + 100 * np.maximum(t - 0.9, 0)) + 0.05 * t
    return lambda: solve(Problem("tariff", [go], minimise=cost), settings=SHORT), float(costs.min())


def _no_recuperation() -> Planted:
    """Energy of a drive that gives none back, written with if_else."""
    force = Control("force", "N", lower=-8, upper=8)
    move = Phase("move", {X: V, V: force}, {X: 0, V: 0}, {X: 1, V: 0}, end=1.0)
    power = force * V
    problem = Problem("drive", [move], minimise=move.integral(ca.if_else(power > 0, power, 0)))
    fastest = 4 * (1 - math.sqrt(0.5))
    return lambda: solve(problem, settings=SHORT), fastest**2 / 2


# what a problem ends with, and what says so
CASES = {
    "gust": (_gust, "right", ""),
    "hidden gust": (_hidden_gust, "refused", "a second solve"),
    "origin at 1e7 m": (_near_origin, "right", ""),
    "origin at 1e9 m": (_far_origin, "not solved", "replay misses the end"),
    "stated sizes": (_oscillator, "refused", "a second solve"),
    "wide limits": (_wide, "right", ""),
    "saddle": (_saddle, "refused", "a second solve"),
    "inflection": (_inflection, "refused", "a second solve"),
    "flat guess": (_flat, "passed", ""),
    "concave kink": (_ridge, "refused", "a second solve"),
    "sign": (_sign, "refused", "jumps"),
    "steep": (_steep, "refused", "Hamiltonian of 'move'"),
    "floor": (_floor, "passed", ""),
    "wrong mode": (_wells, "refused", "other controls"),
    "dead zone": (_dead_zone, "refused", "other controls"),
    "tariff": (_tariff, "not solved", ""),
    "if_else": (_no_recuperation, "not solved", ""),
}
WARNED = ("sign", "floor", "tariff")  # when they are stated
FAST = ("origin at 1e7 m", "wrong mode", "dead zone")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in FAST else pytest.mark.slow) for name in CASES]
)
def test_it_ends_as_the_page_says(name: str) -> None:
    make, ending, words = CASES[name]
    found, optimum = make()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", StatementWarning)
        try:
            solution = found()
        except OcpError as error:
            assert (ending, words in str(error)) == ("not solved", True)  # noqa: PT017
        else:
            refused = [check.name for check in certify(solution).checks if check.failed]
            right = solution.objective == pytest.approx(optimum, rel=1e-5, abs=1e-8)
            assert ending == ("right" if right else "refused" if refused else "passed")
            assert words in refused or not words
            assert not (right and refused)
    assert bool(said) == (name in WARNED)
