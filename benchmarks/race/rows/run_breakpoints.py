"""Baseline by hand: few intervals of linear jerk, integrated exactly, whose breakpoints move.

The first breakpoints are what a hand puts there that has seen a coarse solution. Each interval may
shrink or grow by a factor.
"""

import casadi as ca
import numpy as np
import problems
import row
from by_hand import at_rest, minimise, quintic

IMPORTED = row.now()
ARC = 12  # intervals on which the force of B rides its peak
NODES = {"A": (0.5,), "B": (0.0, 1.0)}  # of the jerk in an interval: constant, or linear
STRETCH = {"A": 3.0, "B": 1.3}  # of an interval
INSIDE = (0.33, 0.67, 1.0)  # fractions of an interval at which the force is bounded


def first_breakpoints(problem, arc):
    """Of unit time."""
    if problem == "A":
        return np.array([0, 0.1, 0.4, 0.6, 0.9, 1])
    u = np.linspace(0, 1, arc + 1)
    denser_ahead = u / 2 + (1 - np.cos(np.pi * u)) / 4
    return np.array([0, *(0.01 + 0.595 * denser_ahead), 0.615, 0.86, 1])


def state_at(z, s, cap):
    """State at the fraction s of an interval: constant or linear jerk, integrated exactly."""
    angle, speed, acc, h, first_jerk = ca.vertsplit(z[:5])
    d, j, rise = s * h, cap * first_jerk, cap * (z[-1] - first_jerk) * s
    return (
        angle + d * (speed + d * (acc / 2 + d * (j / 6 + rise / 24))),
        speed + d * (acc + d * (j / 2 + rise / 6)),
        acc + d * (j + rise / 2),
    )


def solve(problem, arc):
    """Return edges [s], places in an interval and the jerk there, and a note."""
    breakpoints = first_breakpoints(problem, arc or ARC)
    lengths = np.diff(breakpoints)
    n_jerks = len(NODES[problem])

    # One interval in unit time: the state at its start, its length, the relative jerks.
    z = ca.SX.sym("z", 4 + n_jerks)
    cap = problems.UNIT_JERK[problem]
    end = state_at(z, 1.0, cap)
    if problem == "A":
        relative = end[2] / problems.UNIT_ACCELERATION
        peaked, positive = ca.vertcat(relative, -relative), ca.SX(0, 1)
    else:
        states = ca.vertcat(*(ca.horzcat(*state_at(z, s, cap)) for s in INSIDE))
        peaked = positive = problems.unit_force(ca, ca.if_else, *ca.horzsplit(states))

    guess = np.vstack([quintic(breakpoints[:-1]), lengths, np.zeros((n_jerks, lengths.size))])
    lower, upper = at_rest(guess)
    lower[3], upper[3] = lengths / STRETCH[problem], lengths * STRETCH[problem]
    lower[4:], upper[4:] = -1.0, 1.0
    end = ca.vertcat(*end)
    values, _, note = minimise(z, end, peaked, positive, guess, lower, upper, whole=3)

    # The lengths add up to 1 within IPOPT's tolerance; the edges are to end exactly there.
    edges = np.append(0.0, np.cumsum(values[3]))
    edges, jerks = problems.in_si_units(problem, edges / edges[-1], values[4:].T)
    return edges, NODES[problem], jerks, note


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
