"""The show "engine-planted": problems made to fool the engine, most of which nobody would state.

Each of them once had a mechanism of its own in the path of a solve. The mechanisms are gone, and
this tells what is left: which answers are right, which a solve refuses or warns of, which a
certificate refuses, and which are wrong and pass. Case `i` asks the i-th of `PLANTED`; nothing is
drawn.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from benchmarks.shows.show import Columns, Question, Row, listed
from ocp import (
    TIME,
    Between,
    Bound,
    Constant,
    Control,
    OcpError,
    Phase,
    Problem,
    Solution,
    State,
    StatementWarning,
    certify,
    joined,
    solve,
)
from studies.common.console import Table, number

LINE = "problems made to fool the engine: right, refused, or wrong and passed"
LIMIT = 300.0  # [s]

RIGHT = 1e-5  # of the optimum, or of 1e-3 where that is more
OUTCOMES = ("right", "warned", "not solved", "refused", "open", "WRONG AND PASSED")

X, V = State("x", "m"), State("v", "m/s")


@dataclass(frozen=True)
class Planted:
    """A problem with a trap in it.

    Attributes
    ----------
    trap : what it is made of.
    stated_by : who would state such a thing.
    found : solves it as a user would.
    optimum : what the least objective is.
    """

    trap: str
    stated_by: str
    found: Callable[[], Solution]
    optimum: float


def question(seed: int, index: int) -> Question:
    """One problem after the other; the seed has no say."""
    del seed
    return {"name": list(PLANTED)[index % len(PLANTED)]}


def answer(question: Question, folder: Path) -> Row:
    """Solve it, and have the answer certified."""
    del folder
    planted = PLANTED[question["name"]]
    common = {"trap": planted.trap, "stated_by": planted.stated_by, "optimum": planted.optimum}
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", StatementWarning)
        try:
            found = planted.found()
        except OcpError as error:
            words = f"{type(error).__name__}: {error}"
            return {**common, "value": math.nan, "outcome": "not solved", "by": [words]}
        certificate = certify(found)

    off = abs(found.objective - planted.optimum) / max(abs(planted.optimum), 1e-3)
    refused = [check.name for check in certificate.checks if check.failed]
    warned = [str(each.message) for each in said if each.category is StatementWarning]
    if off <= RIGHT:
        outcome = "right"
    elif warned:
        outcome = "warned"
    elif refused:
        outcome = "refused"
    else:
        outcome = "WRONG AND PASSED" if certificate.confirmed else "open"
    return {**common, "value": found.objective, "outcome": outcome, "by": refused}


def tables(rows: Sequence[Row]) -> list[Table]:
    """One line a problem, and how many came to which end."""
    columns: Columns = {
        "": "name",
        "optimum": lambda row: number(row["optimum"], 6),
        "found": lambda row: number(row["value"], 6),
        "outcome": lambda row: row["failure"] or row["outcome"],
        "by": lambda row: ", ".join(row["by"])[:60],
        "who would state it": "stated_by",
    }
    counts = Counter(row["failure"] or row["outcome"] for row in rows)
    total = [[outcome, str(counts[outcome])] for outcome in OUTCOMES]
    return [
        listed("Planted problems", rows, columns),
        Table("Together", ["outcome", "problems"], total),
    ]


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
    return Planted(
        "a gust of a ten thousandth of the motion, between all points",
        "nobody: tables of wind have times, which become breakpoints",
        lambda: solve(_metre(strength * _pulse(at, width))),
        12 * (way**2 + way * speed) + 4 * speed**2,
    )


def _hidden_gust() -> Planted:
    """A control that only pays for a thousandth of a second, and rests at zero otherwise."""
    at, width, most = 0.4321, 5e-4, 30.0
    w = Control("w", "1", lower=0, upper=1)
    half = math.sqrt(math.log(most)) * width
    t = np.linspace(-half, half, 100_001)
    gained = float(np.trapezoid(most * np.exp(-((t / width) ** 2)) - 1, t))
    return Planted(
        "a short gain that a control of zero multiplies",
        "nobody",
        lambda: solve(_metre(cost=w * (1 - most * _pulse(at, width)))),
        12 - gained,
    )


# ----------------------------------------------------------------------------------------- sizes


def _far_origin() -> Planted:
    return Planted(
        "a metre, counted from an origin that is 1e9 m away",
        "nobody: orbits in metres reach 1e7 m, and come out right",
        lambda: solve(_metre(origin=1e9)),
        12.0,
    )


def _near_origin() -> Planted:
    return Planted(
        "a metre, counted from an origin that is 1e7 m away",
        "a rendezvous in inertial coordinates",
        lambda: solve(_metre(origin=1e7)),
        12.0,
    )


def _oscillator() -> Planted:
    """Van der Pol's oscillator whose states are said to be a million times as large."""
    x, y = State("x", scale=1e6), State("y", lower=-0.4, scale=1e6)
    u = Control("u")
    swing = Phase("swing", {x: y, y: -x + y * (1 - x**2) + u}, {x: 1, y: 0}, end=5.0)
    problem = Problem("oscillator", [swing], minimise=swing.integral(x**2 + y**2 + u**2))
    return Planted(
        "sizes of 1e6 stated for states of 1",
        "who takes them for another unit's",
        lambda: solve(problem),
        2.9537014,
    )


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
    return Planted(
        "limits of 1e6 that stand for none",
        "many: other tools ask for limits",
        lambda: solve(problem),
        1.5 / (0.5**3 - 0.15**3),
    )


# -------------------------------------------------------------------- stationary, and no minimum


def _saddle() -> Planted:
    """Standing still is best up to a constant of pi^2, and a saddle beyond."""
    push = Constant("push", "1/s^2", 5.0)
    x, u = State("x", "m", lower=-1, upper=1), Control("u", "m/s", lower=-20, upper=20)
    way = Phase("way", {x: u}, {x: 0}, {x: 0}, end=1.0)
    problem = Problem("unstable", [way], minimise=way.integral(u**2 - push * x**2))

    # up to the limit by a sine, along it, and back: sine and cosine have the same mean square
    rate = math.sqrt(12.0)
    return Planted(
        "the optimum for one constant is a saddle for the next",
        "who goes on from one value of a constant to another",
        lambda: solve(problem, guess=solve(problem), constants={push: 12.0}),
        -12.0 * (1 - math.pi / rate),
    )


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
    return Planted(
        "a guess where the slope by a free time and its curvature vanish",
        "nobody: the guess is the answer to another problem",
        lambda: solve(problem, guess=solve(problem, constants={least: half, most: half})),
        4 / math.sqrt(3),
    )


def _flat() -> Planted:
    """The fourth power of the way; the guess is to stay, where no derivative tells."""
    u = Control("u", "m/s^2", lower=-1, upper=1)
    move = Phase("move", {X: V, V: u}, {X: 0, V: 0}, end=1.0, guess={u: 0.0})
    problem = Problem("flat", [move], maximise=move.at_end(X) ** 4)
    return Planted(
        "a guess where slope and curvature vanish",
        "nobody: who wants a fourth power does not guess zero",
        lambda: solve(problem),
        0.5**4,
    )


def _ridge() -> Planted:
    """Two wells, and a start on the kink between them."""
    push = Constant("push", "m", 0.0)
    u = Control("u", "m/s")
    go = Phase("go", {X: u}, {X: 0}, end=1.0)
    problem = Problem("wells", [go], minimise=go.integral(u**2 + 4 * (ca.fabs(X) - push) ** 2))
    return Planted(
        "the optimum for one constant rests on a concave kink for the next",
        "who goes on from one value of a constant to another",
        lambda: solve(problem, guess=solve(problem), constants={push: 1.0}),
        2 * math.tanh(2.0),
    )


# ------------------------------------------------------------------------------------------ steps


def _crossing(weight: ca.SX) -> Problem:
    """A metre in a second, twice as fast behind its half: 0.5625."""
    u = Control("u", "m/s")
    move = Phase("move", {X: u * (1.5 + 0.5 * weight)}, {X: 0}, {X: 1}, end=1.0)
    return Problem("crossing", [move], minimise=move.integral(u**2))


def _sign() -> Planted:
    return Planted(
        "a rate that steps at a place, by sign",
        "many: friction, a drive with two gears",
        lambda: solve(_crossing(ca.sign(X - 0.5))),
        0.5625,
    )


def _steep() -> Planted:
    return Planted(
        "a rate that changes within 1e-7 of a place, by tanh",
        "nobody: who smooths a step resolves it",
        lambda: solve(_crossing(ca.tanh(1e7 * (X - 0.5)))),
        0.5625,
    )


def _floor() -> Planted:
    """An objective that steps with the end value."""
    u = Control("u", lower=-3, upper=3)
    move = Phase("move", {X: u}, {X: 0}, end=1.0)
    end = move.at_end(X)
    cost = move.integral(u**2) + (end - 1.4) ** 2 + ca.floor(end)
    return Planted(
        "an objective that counts whole metres",
        "nobody: that is an integer problem",
        lambda: solve(Problem("floor", [move], minimise=cost)),
        0.96,
    )


# ------------------------------------------------------------------------------- controls far away


def _wells() -> Planted:
    """Two local minima of the Hamiltonian; the guess is in the worse one."""
    u = Control("u", lower=-2, upper=2)
    go = Phase("go", {X: u}, {X: 0}, end=1.0, guess={X: (0, -1), u: -1})
    problem = Problem("wells", [go], minimise=go.integral((u**2 - 1) ** 2) - 0.3 * go.at_end(X))
    values = np.linspace(0.9, 1.2, 1_000_001)
    return Planted(
        "a guess in the worse one of two modes",
        "who guesses the wrong mode of an engine",
        lambda: solve(problem),
        float(((values**2 - 1) ** 2 - 0.3 * values).min()),
    )


def _dead_zone() -> Planted:
    """Full flow for half of the time is cheaper than less all the time."""
    u = Control("u")
    rate = ca.fmax(u - 2, 0) + ca.fmin(u + 2, 0)
    go = Phase("go", {X: rate}, {X: 0}, {X: 1}, end=1.0, guess={u: 3.0, X: (0, 1)})
    problem = Problem("dead zone", [go], minimise=go.integral(u**2))
    return Planted(
        "a drive with a dead zone that pays to open and close",
        "who has a valve, and no limit on its switches",
        lambda: solve(problem),
        8.0,
    )


# ------------------------------------------------------------------------------------ known times


def _tariff() -> Planted:
    """A price that falls to a hundredth at 0.9 s, and an end that is free."""
    u = Control("u", "m/s")
    price = ca.pw_const(TIME, ca.DM([0.9]), ca.DM([1, 0.01]))
    go = Phase("go", {X: u}, {X: 0}, {X: 1}, end=Between(0.2, 3))
    cost = go.integral(u**2 * price) + 0.05 * go.duration
    t = np.linspace(0.2, 3, 2_000_001)
    costs = 1 / (np.minimum(t, 0.9) + 100 * np.maximum(t - 0.9, 0)) + 0.05 * t
    return Planted(
        "a price that steps at a known time, and a free end",
        "who has a tariff; two phases state it better",
        lambda: solve(Problem("tariff", [go], minimise=cost)),
        float(costs.min()),
    )


def _no_recuperation() -> Planted:
    """Energy of a drive that gives none back, written with if_else."""
    force = Control("force", "N", lower=-8, upper=8)
    move = Phase("move", {X: V, V: force}, {X: 0, V: 0}, {X: 1, V: 0}, end=1.0)
    power = force * V
    problem = Problem("drive", [move], minimise=move.integral(ca.if_else(power > 0, power, 0)))
    fastest = 4 * (1 - math.sqrt(0.5))
    return Planted(
        "a cost with a kink, written with if_else",
        "many; fmax states the same",
        lambda: solve(problem),
        fastest**2 / 2,
    )


PLANTED: Mapping[str, Planted] = {
    "gust": _gust(),
    "hidden gust": _hidden_gust(),
    "origin at 1e7 m": _near_origin(),
    "origin at 1e9 m": _far_origin(),
    "stated sizes": _oscillator(),
    "wide limits": _wide(),
    "saddle": _saddle(),
    "inflection": _inflection(),
    "flat guess": _flat(),
    "concave kink": _ridge(),
    "sign": _sign(),
    "steep": _steep(),
    "floor": _floor(),
    "wrong mode": _wells(),
    "dead zone": _dead_zone(),
    "tariff": _tariff(),
    "if_else": _no_recuperation(),
}
