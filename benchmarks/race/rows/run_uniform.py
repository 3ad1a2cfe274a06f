"""Baseline by hand: a uniform mesh of constant jerk, integrated exactly, mapped."""

import casadi as ca
import numpy as np
import problems
import row
from by_hand import at_rest, minimise, quintic

IMPORTED = row.now()
SIZE = {"A": 56, "B": 210}  # intervals, about the fewest that are right


def solve(problem, size):
    """Return edges [s], places in an interval and the jerk there, and a note."""
    n = size or SIZE[problem]
    h = 1 / n

    # One interval in unit time: the state at its start and the relative jerk.
    z = ca.SX.sym("z", 4)
    angle, speed, acc, relative_jerk = ca.vertsplit(z)
    jerk = problems.UNIT_JERK[problem] * relative_jerk
    end = (
        angle + h * (speed + h * (acc / 2 + h * (jerk / 6))),
        speed + h * (acc + h * (jerk / 2)),
        acc + h * jerk,
    )

    # Acceleration is linear in an interval: its peak is at an end. That of the force nearly so.
    if problem == "A":
        relative = end[2] / problems.UNIT_ACCELERATION
        peaked, positive = ca.vertcat(relative, -relative), ca.SX(0, 1)
    else:
        peaked = positive = problems.unit_force(ca, ca.if_else, *end)

    guess = np.vstack([quintic(np.arange(n) * h), np.zeros((1, n))])
    lower, upper = at_rest(guess)
    lower[3], upper[3] = -1.0, 1.0
    values, _, note = minimise(z, ca.vertcat(*end), peaked, positive, guess, lower, upper)

    edges, jerks = problems.in_si_units(problem, np.linspace(0.0, 1.0, n + 1), values[3:].T)
    return edges, (0.5,), jerks, note


if __name__ == "__main__":
    *control, words = solve(*row.asked())
    row.answer(IMPORTED, *control, note=words)
