"""Baseline by hand: few intervals of linear jerk, integrated exactly, whose breakpoints move.

The first breakpoints are what a hand puts there that has seen a coarse solution; each interval may
shrink or grow by a factor.
"""

import casadi as ca
import numpy as np
import problems
import row
from by_hand import minimise, powers, quintic

IMPORTED = row.now()
ARC = 12  # intervals on which the force of B rides its peak
NODES = {"A": (0.5,), "B": (0.0, 1.0)}  # of the jerk in an interval
STRETCH = {"A": 3.0, "B": 1.3}  # of an interval


def first_breakpoints(problem, arc):
    """Of unit time."""
    if problem == "A":
        return np.array([0, 0.1, 0.4, 0.6, 0.9, 1])
    u = np.linspace(0, 1, arc + 1)
    return np.array([0, *(0.01 + 0.595 * (u / 2 + (1 - np.cos(np.pi * u)) / 4)), 0.615, 0.86, 1])


def at(z, s, cap):
    """State at the fraction s of an interval: constant or linear jerk, integrated exactly."""
    angle, speed, acc, h, left = ca.vertsplit(z[:5])
    d, j, rise = s * h, cap * left, cap * (z[-1] - left) * s
    return (
        angle + d * (speed + d * (acc / 2 + d * (j / 6 + rise / 24))),
        speed + d * (acc + d * (j / 2 + rise / 6)),
        acc + d * (j + rise / 2),
    )


def solve(problem, arc):
    """Return edges [s], places in an interval and the jerk there, and a note."""
    edges = first_breakpoints(problem, arc or ARC)
    lengths = np.diff(edges)
    n = lengths.size
    n_z = {"A": 5, "B": 6}[problem]  # states, length, jerk: constant or at both ends
    z = ca.SX.sym("z", n_z)
    cap = problems.UNIT_JERK[problem]
    end = at(z, 1.0, cap)
    if problem == "A":
        acc = end[2] / (4 * (problems.END - problems.START))
        peaked, positive = ca.vertcat(acc, -acc), ca.SX(0, 1)
    else:
        states = [ca.horzcat(*at(z, s, cap)) for s in (0.33, 0.67, 1.0)]
        angle, speed, acc = ca.horzsplit(ca.vertcat(*states))
        peaked = problems.rope_force(ca, ca.if_else, angle, *powers(problem, speed, acc)) / 40
        positive = peaked
    lower = np.full((n_z, n), -np.inf)
    upper = -lower
    guess = np.vstack([quintic(edges[:-1]), lengths, np.zeros((n_z - 4, n))])
    lower[:3, 0] = upper[:3, 0] = guess[:3, 0]
    lower[1, 1:] = 0.0
    lower[3], upper[3] = lengths / STRETCH[problem], lengths * STRETCH[problem]
    lower[4:], upper[4:] = -1.0, 1.0
    found, _, note = minimise(z, ca.vertcat(*end), peaked, positive, guess, lower, upper, whole=3)
    edges = np.append(0.0, np.cumsum(found[3]))
    size = problems.JERK_CAP[problem]
    return edges / edges[-1] * problems.DURATION[problem], NODES[problem], size * found[4:].T, note


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
