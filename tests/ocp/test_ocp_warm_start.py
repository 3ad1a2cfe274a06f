"""Primal and dual warm starts."""

import dataclasses

import numpy as np
import pytest

from ocp import Constant, Control, FixedMesh, Mesh, Phase, Problem, Settings, Solution, State, solve
from ocp.mesh.mesh import bisected
from ocp.optimality.iterate import Iterate
from ocp.optimality.warm_start import carried_multipliers
from ocp.transcription.transcribe import Transcription, transcribe

CAP = Constant("cap", "m", 1 / 9)


def ride() -> Problem:
    """Bryson and Denham's problem; its cap is a constant."""
    x, v, u = State("x", "m", upper=CAP), State("v", "m/s"), Control("u", "m/s^2")
    phase = Phase("ride", {x: v, v: u}, initial={x: 0, v: 1}, final={x: 0, v: -1}, end=1.0)
    return Problem("ride", phase, minimise=phase.integral(u.symbol**2 / 2))


@pytest.fixture(scope="module")
def solved() -> Solution:
    """The problem on a fixed mesh."""
    return solve(ride(), settings=Settings(intervals=12, refinement=FixedMesh()))


def on_mesh(iterate: Iterate, mesh: Mesh, objective: float = 1.0) -> Transcription:
    """The iterate's problem on another mesh, the size of its objective multiplied."""
    size = objective * iterate.scales.objective
    scales = dataclasses.replace(iterate.scales, objective=size)
    return transcribe(iterate.problem, mesh, iterate.scheme, iterate.controls, scales)


def test_its_own_program_gets_the_very_multipliers(solved: Solution) -> None:
    iterate = solved.kept_iterate
    carried = carried_multipliers(iterate, iterate.transcription)
    assert carried is not None
    assert carried[0] is iterate.bound_multipliers
    assert carried[1] is iterate.row_multipliers


@pytest.mark.parametrize("objective", [1.0, 5.0])
def test_the_same_mesh_gets_the_same_multipliers(solved: Solution, objective: float) -> None:
    iterate = solved.kept_iterate
    copy = Mesh(iterate.mesh.phases, iterate.mesh.extra)
    target = on_mesh(iterate, copy, objective)
    carried = carried_multipliers(iterate, target)
    assert carried is not None
    columns, rows = carried
    np.testing.assert_allclose(objective * rows, iterate.row_multipliers, atol=1e-7)
    lower, upper = target.columns.limits.at(iterate.parameters)
    free = lower < upper
    np.testing.assert_allclose(
        objective * columns[free], iterate.bound_multipliers[free], atol=1e-7
    )


def test_other_sizes_of_signals_get_none(solved: Solution) -> None:
    iterate = solved.kept_iterate
    scales = dataclasses.replace(
        iterate.scales, signals={name: 2.0 * size for name, size in iterate.scales.signals.items()}
    )
    target = transcribe(iterate.problem, iterate.mesh, iterate.scheme, iterate.controls, scales)
    assert carried_multipliers(iterate, target) is None


def test_costates_and_masses_carry_over_to_a_finer_mesh(solved: Solution) -> None:
    iterate = solved.kept_iterate
    finer = bisected(iterate.mesh, 100)
    assert finer is not None
    again = solve(ride(), settings=Settings(refinement=FixedMesh()), mesh=finer).kept_iterate
    target = on_mesh(iterate, finer)
    carried = carried_multipliers(iterate, target)
    assert carried is not None
    columns, rows = carried
    size = np.abs(again.row_multipliers).max()
    assert np.abs(rows - again.row_multipliers).max() < 0.02 * size
    lower, upper = target.columns.limits.at(iterate.parameters)
    free = lower < upper
    mass = again.bound_multipliers[free].sum()
    assert mass == pytest.approx(4, rel=1e-3)  # two jumps of 18 by the size 1/9 of the position
    assert columns[free].sum() == pytest.approx(mass, rel=1e-4)


def test_a_solution_starts_its_own_program_again(solved: Solution) -> None:
    again = solve(
        solved.problem, settings=Settings(intervals=12, refinement=FixedMesh()), guess=solved
    )
    assert again.kept_iterate.transcription is solved.kept_iterate.transcription
    assert again.iterations <= 1
    assert again.objective == pytest.approx(solved.objective, rel=1e-9)


def test_other_constants_warm_start_from_multipliers(solved: Solution) -> None:
    settings = Settings(intervals=12, refinement=FixedMesh())
    cold = solve(solved.problem, settings=settings, constants={CAP: 0.999 / 9})
    warm = solve(solved.problem, settings=settings, guess=solved, constants={CAP: 0.999 / 9})
    assert warm.objective == pytest.approx(cold.objective, rel=1e-8)
    assert warm.iterations < cold.iterations
