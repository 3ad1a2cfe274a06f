"""A ring on its arm by a plain collocation: even intervals, Radau points, jerk linear in each.

It shares no mesh, no statement and no engine with the studies, and of the models the equations of
motion alone. What it finds is attained by a motion, so that it comes down to the optimum from above
with more intervals.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from models.laws import Bezier, paper_points
from models.ring_on_arm import RingOnArm, arm_motion
from models.truss import TrussParameters, rope_force, rope_leverage

SLACK = 0.75  # of the intervals, before the net becomes taut
FORCE = 20.0  # [N], size of the rope force
LEFT = 0.8e-6  # [J] in the arm at the end


# of arm's coordinates and rates, angle, speed and acceleration
Formula = Callable[[Any, Any, Any, Any, Any], Any]


def least_peak(
    model: RingOnArm,
    duration: float,
    jerk: float,
    peak: tuple[Formula, float],
    caps: tuple[tuple[Formula, float], ...] = (),
    intervals: int = 120,
) -> float:
    """Least largest modulus of a formula, from rest to rest, while the ropes pull.

    The unknowns are states (arm's coordinates and rates; angle, speed, acceleration) in sizes of
    the Bezier law.

    Parameters
    ----------
    peak : of which formula, and its size.
    caps : formulas and what their moduli are at most.
    """
    truss, stowed = model.truss, model.truss.stowed_angle
    law = Bezier(duration, paper_points(stowed, math.pi / 2))
    moved = arm_motion(model, law)

    def states(time: Any) -> Any:
        ring = law.motion(time)
        return np.vstack([*moved.at(time), ring.angle, ring.speed, ring.acceleration])

    grid = np.linspace(0.0, duration, 4001)
    sizes = np.abs(states(grid)).max(axis=1)
    net_time = float(grid[np.argmax(law.motion(grid).angle >= truss.net_angle)])

    first = round(SLACK * intervals)
    X, Z = ca.MX.sym("X", 11, intervals + 1), ca.MX.sym("Z", 44, intervals)
    J, switch, highest = ca.MX.sym("J", 2, intervals), ca.MX.sym("switch"), ca.MX.sym("peak")
    end = X[:, -1] * sizes
    zero = [ca.vec(Z[33:, :] - X[:, 1:])]
    positive = [LEFT * 1e6 - 1e6 * model.residual_energy(end[:4], end[4:8])]
    for net, begin, until, span in (
        ("slack", 0, first, switch),
        ("taut", first, intervals, duration - switch),
    ):
        count, here = until - begin, slice(begin, until)
        kernel = _interval(model, jerk, sizes, net, (peak, *caps)).map(count)
        steps = ca.repmat(span / count, 1, count)
        rows, pulls, peaks, *capped = kernel(X[:, here], Z[:, here], J[:, here], steps)
        zero.append(ca.vec(rows))
        positive += [highest - ca.vec(peaks), highest + ca.vec(peaks), ca.vec(pulls)]
        positive += [1 - sign * ca.vec(one) for one in capped for sign in (-1, 1)]

    low, high = _bounds(truss, sizes, first, intervals)
    edges = np.concatenate(
        [
            np.linspace(0.0, net_time, first + 1),
            np.linspace(net_time, duration, intervals - first + 1)[1:],
        ]
    )
    inside = (edges[:-1, None] + np.diff(edges)[:, None] * _radau(4)[0][1:]).ravel()
    guess = [np.clip(states(edges) / sizes[:, None], low, high), states(inside) / sizes[:, None]]
    unknowns = ca.vertcat(ca.vec(X), ca.vec(Z), ca.vec(J), switch, highest)
    rows = ca.vertcat(*zero, *positive)
    equations = sum(each.numel() for each in zero)
    free, caps = np.full(44 * intervals, np.inf), np.ones(2 * intervals)
    solver = ca.nlpsol(
        "plain",
        "ipopt",
        # a hair of smoothness, as many motions have the same peak
        {"x": unknowns, "f": highest + 1e-7 * ca.sumsqr(J) / intervals, "g": rows},
        {"ipopt.print_level": 0, "print_time": False, "error_on_fail": True, "ipopt.tol": 1e-7},
    )
    found = solver(
        x0=np.concatenate([*(one.ravel("F") for one in guess), 0 * caps, [net_time, 2.0]]),
        lbx=np.concatenate([low.ravel("F"), -free, -caps, [0.3 * duration, 0.0]]),
        ubx=np.concatenate([high.ravel("F"), free, caps, [0.98 * duration, 10.0]]),
        lbg=np.zeros(rows.numel()),
        ubg=np.append(np.zeros(equations), np.full(rows.numel() - equations, np.inf)),
    )
    return peak[1] * float(found["x"][-1])


def _bounds(truss: TrussParameters, sizes: Any, first: int, intervals: int) -> tuple[Any, Any]:
    """Of the states: rest at both ends, and the angle at which the net becomes taut."""
    low, high = np.full((11, intervals + 1), -np.inf), np.full((11, intervals + 1), np.inf)
    low[9] = 0.0
    low[:, 0] = high[:, 0] = np.append(np.zeros(8), [truss.stowed_angle, 0.0, 0.0]) / sizes
    low[8:, -1] = high[8:, -1] = np.array([math.pi / 2, 0.0, 0.0]) / sizes[8:]
    low[8, first] = high[8, first] = truss.net_angle / sizes[8]
    return low, high


def _interval(
    model: RingOnArm, jerk: float, sizes: Any, net: Any, formulas: tuple[tuple[Formula, float], ...]
) -> ca.Function:
    """Of an interval's first state, states at its points, jerks at its ends and length.

    Outputs are what the collocation leaves over, rope forces and formulas, in sizes.
    """
    tau, slopes = _radau(4)
    x, z, j, h = (ca.SX.sym(name, n) for name, n in (("x", 11), ("z", 44), ("j", 2), ("h", 1)))
    places = ca.horzcat(x, ca.reshape(z, 11, 4))
    rows, pulls = [], []
    values: list[list[Any]] = [[] for _ in formulas]
    for at in range(1, 5):
        s = places[:, at] * sizes
        q, v, (alpha, omega, acc) = s[:4], s[4:8], ca.vertsplit(s[8:])
        own, torque = model.response(q, v, alpha, omega, acc)
        rates = ca.vertcat(v, own, omega, acc, jerk * (j[0] * (1 - tau[at]) + j[1] * tau[at]))
        rows.append(places @ slopes[:, at] - h * rates / sizes)
        held = rope_force(model.truss, alpha, omega, acc, net)
        pulls.append((held + torque / rope_leverage(model.truss, alpha)) / FORCE)
        for column, (formula, size) in zip(values, formulas, strict=True):
            column.append(formula(q, v, alpha, omega, acc) / size)
    outputs = [ca.vertcat(*each) for each in (rows, pulls, *values)]
    return ca.Function("interval", [x, z, j, h], outputs, {"cse": True})


def _radau(degree: int) -> tuple[Any, Any]:
    """Points with 0 before them, and in column s what each value has in the slope at point s."""
    tau = np.array([0.0, *ca.collocation_points(degree, "radau")])
    powers = np.vander(tau, increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = powers[:, :-1] * np.arange(1, degree + 1)
    return tau, np.linalg.solve(powers.T, slopes.T)
