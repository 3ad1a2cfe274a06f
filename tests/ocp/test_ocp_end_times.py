"""Free end times where a peak or a limit depends on time and acts at the end itself."""

from __future__ import annotations

import dataclasses
import math

import pytest

from ocp import TIME, Between, Bound, Control, Phase, Problem, State, certify, solve

x, u = State("x", "m"), Control("u", "m/s")


def ride(final=None, **stated):
    times = {"end": Between(0.2, 9.0), "initial": {x: 0}, **stated}
    return Phase("ride", {x: u}, final={x: 1} if final is None else final, **times)


def peak_at_the_end():
    """Effort and the largest of t x: 1/T + T, half of the T by the value at the end."""
    phase = ride()
    moment = 0.5 * phase.at_end(TIME * x) + 0.5 * phase.peak(TIME * x)
    return Problem("late", phase, minimise=phase.integral(u**2) + moment)


def peak_at_the_start():
    """The same backwards: the largest of (1 - t) x is where the ride begins."""
    phase = ride({x: 0}, start=Between(-3.0, 0.8), end=1.0, initial={x: 1})
    return Problem("early", phase, minimise=phase.integral(u**2) + phase.peak(x * (1 - TIME)))


def limit_at_the_end():
    """At the end x + t <= 2 acts: (u^2 + 1 - 3 u) T with T = 2 / (1 + u), u = sqrt(5) - 1."""
    phase = ride({}, bounds=[Bound("closing gate", x + TIME, upper=2)])
    return Problem("gate", phase, minimise=phase.integral(u**2 + 1) - 3 * phase.at_end(x))


@pytest.mark.parametrize(
    ("problem", "optimum", "end"),
    [
        (peak_at_the_end(), 2.0, "end"),
        (peak_at_the_start(), 2.0, "start"),
        (limit_at_the_end(), 4 * math.sqrt(5) - 10, "end"),
    ],
    ids=["peak at the end", "peak at the start", "limit at the end"],
)
def test_what_acts_at_a_free_time_counts_with_its_slope_by_time(problem, optimum, end):
    found = solve(problem)
    assert found.objective == pytest.approx(optimum, rel=1e-7)
    assert certify(found).passed

    # and a costate that is off by a hundredth is still told
    (own,) = found.multipliers.costates
    (piece,) = own.polynomial.pieces
    piece = dataclasses.replace(piece, coefficients=1.01 * piece.coefficients)
    spoilt = dataclasses.replace(
        own, polynomial=dataclasses.replace(own.polynomial, pieces=(piece,))
    )
    multipliers = dataclasses.replace(found.multipliers, costates=(spoilt,))
    checks = certify(dataclasses.replace(found, multipliers=multipliers)).checks
    (told,) = [c for c in checks if c.name == f"Hamiltonian at the {end} of 'ride'"]
    assert not told.passed
