"""A stiff fit, whose motion follows from the unknown alone."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from ocp import Phase, Problem, State, Unknown, certify, solve

END = 1e5  # [s]
TIMES = np.array([1e-2, 1.0, 1e2, 1e4])  # at which values are measured [s]


def kinetics(t, x, factor=1.0):
    """Robertson's three substances; the second in units of 3.65e-5."""
    del t
    a, b, c = x
    r1, r2, r3 = 0.04 * factor * a, 0.365 * b * c, 3e7 * (3.65e-5 * b) ** 2
    return [r2 - r1, (r1 - r2 - r3) / 3.65e-5, r3]


def motion(times, factor=1.0):
    found = solve_ivp(
        kinetics, (0, END), [1, 0, 0], "Radau", times, args=(factor,), rtol=1e-8, atol=1e-10
    )
    return found.y


def measured():
    """Values that are off by one per cent, up and down by turns, (3, m)."""
    return motion(TIMES) * (1.0 + 0.01 * (-1.0) ** np.arange(TIMES.size))


def fit():
    """The rate of the first reaction, off by 30 % in the guess."""
    a, b, c = (State(name, lower=0, upper=2) for name in "abc")
    log = Unknown("log", lower=-2, upper=2, guess=0.3)
    rates = kinetics(0, [a.symbol, b.symbol, c.symbol], ca.exp(log.symbol))
    phase = Phase(
        "reaction",
        dict(zip((a, b, c), rates, strict=True)),
        initial={a: 1, b: 0, c: 0},
        end=END,
    )
    values = measured()
    misfit = sum(
        (phase.at(float(t), signal) - float(v)) ** 2
        for signal, row in zip((a, b, c), values, strict=True)
        for t, v in zip(TIMES, row, strict=True)
    )
    return Problem("kinetics", [phase], minimise=1e4 * misfit)


@pytest.mark.slow
def test_a_stiff_fit_is_found() -> None:
    values = measured()

    def misfit(log):
        return 1e4 * float(np.sum((motion(TIMES, np.exp(log)) - values) ** 2))

    best = minimize_scalar(misfit, bounds=(-0.1, 0.1), options={"xatol": 1e-5})
    solution = solve(fit())
    assert solution.objective == pytest.approx(best.fun, rel=1e-5)  # the default tolerance
    assert solution.trajectory.unknowns["log"] == pytest.approx(best.x, abs=1e-4)

    # in some intervals the terms of H are hundreds of times their mean size
    assert certify(solution).passed
