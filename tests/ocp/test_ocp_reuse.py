"""What is used again: prepared problems, neighbours on a homotopy, multipliers as a warm start."""

import dataclasses

import numpy as np
import pytest

from ocp import (
    Between,
    Constant,
    Control,
    FixedMesh,
    HomotopyStopped,
    Mesh,
    Phase,
    Problem,
    Settings,
    Solution,
    State,
    StatementError,
    homotopy,
    prepare,
    solve,
)
from ocp.mesh.mesh import bisected
from ocp.optimality.iterate import Iterate
from ocp.optimality.warm_start import carried_multipliers
from ocp.transcription.transcribe import Transcription, transcribe
from tests.ocp.problems import bryson_denham, certified, double_integrator, pendulum

DISTANCE = Constant("distance", "m", 1.0)
CAP = Constant("cap", "m/s^2", 2.0)


def race() -> Problem:
    """Least time between two points of rest, ``2 sqrt(distance / cap)``."""
    x, v, _, rates = double_integrator(lower=-CAP, upper=CAP)
    ends, end = ({x: 0, v: 0}, {x: DISTANCE, v: 0}), Between(0.1, 20, guess=2)
    phase = Phase("race", rates, *ends, end=end, guess={x: (0, 1)})
    return Problem("race", phase, minimise=phase.end_time)


# the far turn is hard from a bad guess
SWING = pendulum(DISTANCE, 1.0)


def test_what_is_read_of_an_answer_later_is_its_own() -> None:
    made = prepare(bryson_denham(CAP), settings=Settings(intervals=10, refinement=FixedMesh()))

    # of the first answer nothing is read before the second one is there
    low = made.solve(constants={CAP: 0.2})
    lower = made.solve(constants={CAP: 0.11}, guess=low)
    assert low.verdict == "local: best of 1 start; not confirmed (ocp.certify)"
    assert low.verification.replayed_objective == pytest.approx(2.24, rel=1e-9)
    assert low.mesh_iterations[0].excess < 1e-9
    assert low.costate("x", 0.25) == pytest.approx(4.8, rel=1e-6)
    assert lower.verdict == "unverified"
    assert lower.verification.replayed_objective == pytest.approx(4.0407882, rel=1e-7)
    assert lower.mesh_iterations[0].excess == pytest.approx(2.4821e-4, rel=1e-3)
    assert lower.mesh_iterations[0].gain == pytest.approx(5.6805e-4, rel=1e-3)


def test_a_prepared_problem_is_solved_again_without_being_built() -> None:
    made = prepare(race(), settings=Settings(intervals=10))
    first = made.solve()
    again = made.solve(constants={DISTANCE: 1.1, CAP: 2.1}, guess=first)
    for found, distance, cap in ((first, 1.0, 2.0), (again, 1.1, 2.1)):
        assert found.objective == pytest.approx(2 * (distance / cap) ** 0.5, rel=1e-6)
        assert found.kept_iterate.transcription is made.transcription
        assert found.verdict.startswith("local")
    assert 2 * again.iterations <= first.iterations


def test_a_prepared_problem_of_a_solution_is_its_program() -> None:
    solution = solve(race())
    made = prepare(solution.problem, guess=solution)
    assert made.transcription is solution.kept_iterate.transcription
    found = made.solve(constants={DISTANCE: 1.05}, guess=solution)
    assert found.objective == pytest.approx(2 * (1.05 / 2) ** 0.5, rel=1e-6)


def test_a_homotopy_stops_at_every_value_and_starts_warm() -> None:
    path = homotopy(SWING, DISTANCE, [1.2, 1.5], settings=Settings(intervals=8))
    assert [s.trajectory.constants["distance"] for s in path.solutions] == [1.2, 1.5]
    assert [s.solved for s in path.steps] == [True, True]
    assert all(s.verdict.startswith("local") for s in path.solutions)
    direct = solve(SWING, settings=Settings(intervals=8), constants={DISTANCE: 1.5})
    assert path.solution.objective == pytest.approx(direct.objective, rel=1e-7)
    assert path.solution.iterations <= direct.iterations


def test_a_homotopy_halves_its_step_and_says_how_far_it_came() -> None:
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("move", {x: u}, initial={x: 0}, final={x: DISTANCE}, end=1.6)
    problem = Problem("unreachable", phase, minimise=phase.integral(u.symbol**2))
    settings = Settings(intervals=3)
    with pytest.raises(HomotopyStopped, match=r"stopped at 1\.5 m before 2 m") as stopped:
        homotopy(problem, DISTANCE, 2.0, settings=settings, least_step=0.25)
    assert stopped.value.reached == 1.5
    assert stopped.value.solution.objective == pytest.approx(1.5**2 / 1.6)
    assert [s.value for s in stopped.value.steps] == [2.0, 1.5, 2.0, 1.75]
    assert [s.solved for s in stopped.value.steps] == [False, True, False, False]


def test_a_homotopy_needs_somewhere_to_go() -> None:
    with pytest.raises(StatementError, match="no target value"):
        homotopy(SWING, DISTANCE, [])
    with pytest.raises(StatementError, match="minimum step"):
        homotopy(SWING, DISTANCE, 1.2, least_step=0)


def test_without_verification_nothing_is_replayed_and_nothing_is_claimed() -> None:
    # it replays on its own
    found = certified(race(), 2**0.5, settings=Settings(verify=False))
    assert found.verdict == "unverified"
    assert not found.verification.passed
    with pytest.raises(StatementError, match="no replay; solve with verify=True"):
        found.value(found.problem.minimise, replayed=True)


ROOF = Constant("cap", "m", 1 / 9)
FIXED = Settings(intervals=12, refinement=FixedMesh())


@pytest.fixture(scope="module")
def solved() -> Solution:
    """The problem on a fixed mesh."""
    return solve(bryson_denham(ROOF), settings=FIXED)


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
    again = solve(solved.problem, settings=FIXED, mesh=finer).kept_iterate
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
    again = solve(solved.problem, settings=FIXED, guess=solved)
    assert again.kept_iterate.transcription is solved.kept_iterate.transcription
    assert again.iterations <= 1
    assert again.objective == pytest.approx(solved.objective, rel=1e-9)


def test_other_constants_warm_start_from_multipliers(solved: Solution) -> None:
    cold = solve(solved.problem, settings=FIXED, constants={ROOF: 0.999 / 9})
    warm = solve(solved.problem, settings=FIXED, guess=solved, constants={ROOF: 0.999 / 9})
    assert warm.objective == pytest.approx(cold.objective, rel=1e-8)
    assert warm.iterations < cold.iterations
