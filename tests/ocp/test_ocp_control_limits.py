"""Equations that tie controls together: another value of the one needs another of the other."""

from __future__ import annotations

import casadi as ca
import pytest

from ocp import TIME, Bound, Control, Phase, Problem, State, certify, solve

x = State("x")


def test_controls_that_share_a_demand_are_tried_together() -> None:
    """An engine that is best at none or full of its power, and a battery for the rest."""
    engine, battery = Control("engine", lower=0, upper=2), Control("battery", lower=-1.6, upper=1.6)
    demand = Bound("demand", engine + battery - 1 - 0.5 * ca.sin(6 * TIME.symbol), lower=0, upper=0)
    fuel = engine + 0.45 * ca.sin(ca.pi * engine) ** 2 + 0.3 * ca.sin(ca.pi * engine / 2) ** 2
    phase = Phase(
        "drive",
        {x: -battery},
        initial={x: 0},
        final={x: 0},
        end=1.0,
        bounds=[demand],
        guess={x: (0, 0), engine: 1, battery: 0},
    )
    found = solve(Problem("split", phase, minimise=phase.integral(fuel + 0.1 * battery**2)))
    assert found.objective == pytest.approx(1.316, rel=1e-3)  # and 1.05 by turns
    assert "other controls promise to gain" in found.verdict
    (check,) = [check for check in certify(found).checks if check.name == "other controls"]
    assert not check.passed
