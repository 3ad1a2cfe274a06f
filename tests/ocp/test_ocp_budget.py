"""What a budget of seconds counts beside the iterations of a solver."""

import time

import casadi as ca
import pytest

from ocp import (
    TIME,
    BudgetSpent,
    Control,
    Ipopt,
    IterationLimit,
    Phase,
    Problem,
    Settings,
    State,
    collocate,
    solve,
)
from ocp.refinement import mesh_solver
from ocp.transcription.kernels import Program


def following():
    """A signal that few intervals do not follow."""
    x, u = State("x"), Control("u")
    phase = Phase("follow", {x: u - x.symbol**3}, {x: 0}, end=20.0)
    return Problem("follow", phase, minimise=phase.integral((x - ca.sin(TIME**2)) ** 2 + u**2))


def test_the_functions_of_a_program_are_built_within_the_seconds(monkeypatch):
    prepare = Program.prepare

    def slowly(program):
        time.sleep(0.3)
        prepare(program)

    monkeypatch.setattr(Program, "prepare", slowly)
    assert collocate(following(), settings=Settings(solver=Ipopt(seconds=30)))
    with pytest.raises(IterationLimit):
        collocate(following(), settings=Settings(solver=Ipopt(seconds=0.25)))


def test_no_mesh_is_begun_that_cannot_be_examined_in_time(monkeypatch):
    estimate_errors = mesh_solver.estimate_errors

    def slowly(*arguments):
        time.sleep(1.2)
        return estimate_errors(*arguments)

    monkeypatch.setattr(mesh_solver, "estimate_errors", slowly)
    with pytest.raises(BudgetSpent, match="ended in mesh iteration 1 "):
        solve(following(), settings=Settings(seconds=2))
