"""Baseline by hand: a uniform mesh of constant or linear jerk, integrated exactly, mapped."""

import casadi as ca
import numpy as np
import problems
import row
from by_hand import minimise, powers, quintic

IMPORTED = row.now()
SIZE = {"A": 56, "B": 210}  # intervals, about the fewest that are right
NODES = (0.5,)  # of the jerk in an interval: it is constant


def solve(problem, size):
    """Return edges [s], places in an interval and the jerk there, and a note."""
    n = size or SIZE[problem]
    h, places = 1 / n, NODES
    z = ca.SX.sym("z", 3 + len(places))
    angle, speed, acc = ca.vertsplit(z[:3])
    cap = problems.UNIT_JERK[problem]
    j, rise = cap * z[3], cap * (z[-1] - z[3])
    end = ca.vertcat(
        angle + h * (speed + h * (acc / 2 + h * (j / 6 + rise / 24))),
        speed + h * (acc + h * (j / 2 + rise / 6)),
        acc + h * (j + rise / 2),
    )
    if problem == "A":
        relative = end[2] / (4 * (problems.END - problems.START))
        peaked, positive = ca.vertcat(relative, -relative), ca.SX(0, 1)
    else:
        rates = powers(problem, end[1], end[2])
        peaked = problems.rope_force(ca, ca.if_else, end[0], *rates) / 40
        positive = peaked
    guess = np.vstack([quintic(np.arange(n) * h), np.zeros((len(places), n))])
    lower = np.full(guess.shape, -np.inf)
    upper = -lower
    lower[:3, 0] = upper[:3, 0] = guess[:3, 0]
    lower[1, 1:] = 0.0
    lower[3:], upper[3:] = -1.0, 1.0
    found, _, note = minimise(z, end, peaked, positive, guess, lower, upper)
    edges = np.linspace(0.0, problems.DURATION[problem], n + 1)
    return edges, places, problems.JERK_CAP[problem] * found[3:].T, note


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
