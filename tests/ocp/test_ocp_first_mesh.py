"""The first mesh: uniform, or finer where the stated guess moves fast."""

import numpy as np
import pytest

from ocp import Control, Phase, Problem, Settings, State, solve
from ocp.algorithm import first_mesh

SWING = 0.2  # [s], at the end of a long phase


def waiting(duration, swing=SWING):
    """A mass waits for long, then moves by 1 m: that is the guess."""
    x, v = State("x", "m", lower=0), State("v", "m/s", lower=0)
    u = Control("u", "m/s^2")

    def since(time):
        return np.clip((time - duration + swing) / swing, 0.0, 1.0)

    phase = Phase(
        "all",
        {x: v, v: u},
        {x: 0, v: 0},
        {x: 1, v: 0},
        end=duration,
        guess={
            x: lambda time: 3 * since(time) ** 2 - 2 * since(time) ** 3,
            v: lambda time: 6 * since(time) * (1 - since(time)) / swing,
        },
    )
    return Problem("waiting", phase, minimise=phase.integral(u**2))


def test_a_guess_that_a_uniform_mesh_carries_leaves_it_uniform():
    (mesh,) = first_mesh(waiting(2.0, swing=2.0), Settings(intervals=20)).phases
    assert np.diff(mesh.breakpoints) == pytest.approx(1 / 20, abs=1e-12)  # rounding


def test_intervals_gather_where_the_guess_moves():
    (mesh,) = first_mesh(waiting(100.0), Settings(intervals=20)).phases
    moving = mesh.breakpoints > 1 - SWING / 100
    # half of the way is the states', of which two go 1 and 2 of their ranges
    assert moving.sum() >= 0.5 * mesh.intervals
    # and the wait keeps its share
    assert np.diff(mesh.breakpoints).max() <= 2.1 * 4 / mesh.intervals


def test_the_optimum_may_move_where_the_guess_waits():
    solution = solve(waiting(100.0))
    # the cubic law: 12 D^2/T^3
    assert solution.objective == pytest.approx(1.2e-5, rel=1e-6)
    assert solution.verification.passed
