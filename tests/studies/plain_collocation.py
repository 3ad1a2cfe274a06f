"""Deployments by a plain collocation: jerk linear in intervals, limits at points of each.

The lengths of the intervals are unknowns, too, so that the jerk may switch where it likes. It
shares no mesh, no statement and no engine with the studies. Forces are formulas of angle, speed and
acceleration, so that nothing is integrated but the jerk, exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from models.laws import Bezier, paper_points
from models.truss import TrussParameters

DEPLOYED = np.pi / 2
SHORTEST, LONGEST = 0.05, 1.5  # interval, in even ones

Formula = Callable[[Any, Any, Any], list[Any]]


def least_peak(
    truss: TrussParameters,
    duration: float,
    jerk: float,
    peaks: Formula,
    limits: Formula = lambda *_: [],
    intervals: int = 80,
    points: int = 8,
    even: bool = False,
) -> float:
    """Least largest value of `peaks`, where `limits` are at most zero, in a duration [s].

    Even intervals are the more robust ones, and take more of them.
    """
    bounds = duration, duration
    return _solved(truss, bounds, jerk, peaks, limits, intervals, points, even)


def least_time(
    truss: TrussParameters,
    bounds: tuple[float, float],
    jerk: float,
    limits: Formula,
    intervals: int = 80,
) -> float:
    """Least duration [s] between bounds, where `limits` are at most zero."""
    return _solved(truss, bounds, jerk, None, limits, intervals, 8, even=False)


def _solved(
    truss: TrussParameters,
    bounds: tuple[float, float],
    jerk: float,
    peaks: Formula | None,
    limits: Formula,
    intervals: int,
    points: int,
    even: bool,
) -> float:
    states, jerks = ca.MX.sym("x", 3, intervals + 1), ca.MX.sym("j", 2, intervals)
    steps, peak = ca.MX.sym("h", 1, intervals), ca.MX.sym("peak")
    x, j, step = ca.SX.sym("x", 3), ca.SX.sym("j", 2), ca.SX.sym("h")

    motions = []
    for place in range(points + 1):
        t = place / points * step
        slope = (j[1] - j[0]) / step
        acceleration = x[2] + j[0] * t + slope * t**2 / 2
        speed = x[1] + x[2] * t + j[0] * t**2 / 2 + slope * t**3 / 6
        angle = x[0] + x[1] * t + x[2] * t**2 / 2 + j[0] * t**3 / 6 + slope * t**4 / 24
        motions.append((angle, speed, acceleration))
    worst = [one for motion in motions for one in (peaks(*motion) if peaks else [])]
    beyond = [one for motion in motions for one in limits(*motion)]
    outputs = [ca.vertcat(*motions[-1]), ca.vertcat(*worst), ca.vertcat(*beyond)]
    kernel = ca.Function("interval", [x, j, step], outputs, {"cse": True})
    ends, highest, over = kernel.map(intervals)(states[:, :-1], jerks, steps)

    size = 40.0  # [N], of the forces
    duration = ca.sum2(steps)
    rows = [ca.vec(ends - states[:, 1:]), duration]
    # of even intervals the duration is known
    within = (-np.inf, np.inf) if even else bounds
    low, high = ([np.zeros(3 * intervals), [bound]] for bound in within)
    for values in ((highest - peak) / size if peaks else None, over / size):
        if values is not None and values.numel():
            rows.append(ca.vec(values))
            low.append(np.full(values.numel(), -np.inf))
            high.append(np.zeros(values.numel()))

    at_rest = [[truss.stowed_angle, 0.0, 0.0], [DEPLOYED, 0.0, 0.0]]
    least = np.tile([[0.0], [0.0], [-np.inf]], intervals + 1)
    most = np.tile([[DEPLOYED], [np.inf], [np.inf]], intervals + 1)
    for column, values in zip((0, -1), at_rest, strict=True):
        least[:, column] = most[:, column] = values

    law = Bezier(bounds[1], paper_points(truss.stowed_angle, DEPLOYED))
    guess = law.motion(np.linspace(0.0, bounds[1], intervals + 1))
    first = np.clip(np.array([guess.angle, guess.speed, guess.acceleration]), least, most)
    unknowns = ca.vertcat(ca.vec(states), ca.vec(jerks), ca.vec(steps), peak)
    caps, share = np.full(2 * intervals, jerk), np.full(intervals, 1.0 / intervals)
    shortest, longest = (1.0, 1.0) if even else (SHORTEST, LONGEST)
    # each kind of rows by itself: beside the row of the duration, which holds all steps, the others
    # would be differentiated by one step after the other
    rates = ca.vertcat(*(ca.jacobian(row, unknowns) for row in rows))
    given, row = [unknowns, ca.MX.sym("none", 0)], ca.vertcat(*rows)
    options = {"ipopt.print_level": 0, "print_time": False, "error_on_fail": True}
    solver = ca.nlpsol(
        "plain",
        "ipopt",
        {"x": unknowns, "f": peak / size if peaks else duration, "g": row},
        {"ipopt.sb": "yes", "jac_g": ca.Function("rates", given, [row, rates]), **options},
    )
    found = solver(
        x0=np.concatenate(
            [first.ravel("F"), np.zeros(2 * intervals), bounds[1] * share, [2 * size]]
        ),
        lbx=np.concatenate([least.ravel("F"), -caps, shortest * bounds[0] * share, [0.0]]),
        ubx=np.concatenate([most.ravel("F"), caps, longest * bounds[1] * share, [np.inf]]),
        lbg=np.concatenate(low),
        ubg=np.concatenate(high),
    )
    return float(found["x"][-1] if peaks else found["f"])
