"""Primal and dual warm starts."""

import numpy as np
import pytest

from ocp import Constant, Control, FixedMesh, Mesh, Phase, Problem, Settings, Solution, State, solve
from ocp.mesh.mesh import bisected
from ocp.optimality.warm_start import Origin, duals

CAP = Constant("cap", "m", 1 / 9)


def ride() -> Problem:
    """Bryson and Denham's problem; its cap is a constant."""
    x, v, u = State("x", "m", upper=CAP), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("ride", {x: v, v: u}, initial={x: 0, v: 1}, final={x: 0, v: -1})
    return Problem("ride", phase, minimise=phase.integral(u.symbol**2 / 2))


@pytest.fixture(scope="module")
def solved() -> Solution:
    """The problem on a fixed mesh."""
    return solve(ride(), settings=Settings(intervals=12, refinement=FixedMesh()))


def test_the_same_mesh_gets_the_same_multipliers(solved: Solution) -> None:
    program = solved.kept_program
    copy = Mesh(program.mesh.phases, program.mesh.extra)
    origin = Origin(solved.trajectory, program)
    target = origin.transcription(program.problem, copy, program.method, {"cap": CAP.value})
    assert target is not program.transcription
    found = duals(program, solved.trajectory, target)
    np.testing.assert_allclose(found.rows, program.row_multipliers, atol=1e-7)
    lower, upper = target.columns.evaluate({"cap": CAP.value})
    free = lower < upper
    np.testing.assert_allclose(found.columns[free], program.bound_multipliers[free], atol=1e-7)


def test_costates_and_masses_carry_over_to_a_finer_mesh(solved: Solution) -> None:
    program = solved.kept_program
    finer = bisected(program.mesh, 100)
    assert finer is not None
    again = solve(ride(), settings=Settings(refinement=FixedMesh()), mesh=finer).kept_program
    origin = Origin(solved.trajectory, program)
    target = origin.transcription(program.problem, finer, program.method, {"cap": CAP.value})
    found = duals(program, solved.trajectory, target)
    size = np.abs(again.row_multipliers).max()
    assert np.abs(found.rows - again.row_multipliers).max() < 0.02 * size
    lower, upper = target.columns.evaluate({"cap": CAP.value})
    free = lower < upper
    mass = again.bound_multipliers[free].sum()
    assert mass == pytest.approx(4, rel=1e-3)  # two jumps of 18 by the size 1/9 of the position
    assert found.columns[free].sum() == pytest.approx(mass, rel=1e-4)


def test_a_solution_starts_its_own_program_again(solved: Solution) -> None:
    again = solve(
        solved.problem, settings=Settings(intervals=12, refinement=FixedMesh()), guess=solved
    )
    assert again.kept_program.transcription is solved.kept_program.transcription
    assert again.iterations <= 1
    assert again.objective == pytest.approx(solved.objective, rel=1e-9)


def test_other_constants_warm_start_from_multipliers(solved: Solution) -> None:
    settings = Settings(intervals=12, refinement=FixedMesh())
    cold = solve(solved.problem, settings=settings, constants={CAP: 0.999 / 9})
    warm = solve(solved.problem, settings=settings, guess=solved, constants={CAP: 0.999 / 9})
    assert warm.objective == pytest.approx(cold.objective, rel=1e-8)
    assert warm.iterations < cold.iterations
