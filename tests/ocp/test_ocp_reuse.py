"""Prepared problems, homotopy, budgets and solves without verification."""

import dataclasses
import time

import casadi as ca
import pytest

from ocp import (
    AdaptiveMesh,
    Between,
    BudgetSpent,
    Constant,
    Control,
    FixedMesh,
    HomotopyStopped,
    IterationLimit,
    Phase,
    Problem,
    Radau,
    Settings,
    State,
    StatementError,
    certify,
    homotopy,
    prepare,
    solve,
)

DISTANCE = Constant("distance", "m", 1.0)
CAP = Constant("cap", "m/s^2", 2.0)


def race() -> Problem:
    """Least time between two points of rest, ``2 sqrt(distance / cap)``."""
    x, v, u = State("x", "m"), State("v", "m/s"), Control("u", "m/s^2", lower=-CAP, upper=CAP)
    phase = Phase(
        "race",
        {x: v, v: u},
        {x: 0, v: 0},
        {x: DISTANCE, v: 0},
        end=Between(0.1, 20, guess=2),
        guess={x: (0, 1)},
    )
    return Problem("race", phase, minimise=phase.end_time)


def swing() -> Problem:
    """Least effort that turns a pendulum by an angle; the far turn is hard from a bad guess."""
    q, w, u = State("q", "rad"), State("w", "rad/s"), Control("u", "N m")
    phase = Phase(
        "swing", {q: w, w: u - 9.81 * ca.sin(q)}, {q: 0, w: 0}, {q: DISTANCE, w: 0}, end=1.0
    )
    return Problem("swing", phase, minimise=phase.integral(u.symbol**2))


def test_what_is_read_of_an_answer_later_is_its_own() -> None:
    x, v, u = State("x", "m", upper=CAP), State("v", "m/s"), Control("u", "m/s^2")
    ride = Phase("ride", {x: v, v: u}, {x: 0, v: 1}, {x: 0, v: -1}, end=1.0)
    problem = Problem("ride", (ride,), minimise=ride.integral(u.symbol**2 / 2))
    made = prepare(problem, settings=Settings(intervals=10, refinement=FixedMesh()))

    # of the first answer nothing is read before the second one is there
    low = made.solve(constants={CAP: 0.2})
    lower = made.solve(constants={CAP: 0.11}, guess=low)
    assert low.verdict == "local: best of 1 start; not confirmed (ocp.certify)"
    assert low.verification.replayed_objective == pytest.approx(2.24, rel=1e-9)
    assert low.mesh_iterations[0].excess < 1e-9
    assert low.costate(x, 0.25) == pytest.approx(4.8, rel=1e-6)
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
    path = homotopy(swing(), DISTANCE, [1.2, 1.5], settings=Settings(intervals=8))
    assert [s.trajectory.constants["distance"] for s in path.solutions] == [1.2, 1.5]
    assert [s.solved for s in path.steps] == [True, True]
    assert all(s.verdict.startswith("local") for s in path.solutions)
    direct = solve(swing(), settings=Settings(intervals=8), constants={DISTANCE: 1.5})
    assert path.solution.objective == pytest.approx(direct.objective, rel=1e-7)
    assert path.solution.iterations <= direct.iterations


def test_a_homotopy_halves_its_step_and_says_how_far_it_came() -> None:
    x, u = State("x"), Control("u", lower=-1, upper=1)
    phase = Phase("move", {x: u}, initial={x: 0}, final={x: DISTANCE}, end=1.6)
    problem = Problem("unreachable", phase, minimise=phase.integral(u.symbol**2))
    settings = Settings(intervals=3)
    with pytest.raises(HomotopyStopped, match=r"stopped at 1\.5 m on the way to 2 m") as stopped:
        homotopy(problem, DISTANCE, 2.0, settings=settings, least_step=0.25)
    assert stopped.value.reached == 1.5
    assert stopped.value.solution.objective == pytest.approx(1.5**2 / 1.6)
    assert [s.value for s in stopped.value.steps] == [2.0, 1.5, 2.0, 1.75]
    assert [s.solved for s in stopped.value.steps] == [False, True, False, False]


def test_a_homotopy_needs_somewhere_to_go() -> None:
    with pytest.raises(StatementError, match="no value to go to"):
        homotopy(swing(), DISTANCE, [])
    with pytest.raises(StatementError, match="least step"):
        homotopy(swing(), DISTANCE, 1.2, least_step=0)


def test_a_budget_ends_refinement_with_the_best_round_that_holds() -> None:
    settings = Settings(intervals=7)
    full = solve(race(), settings=settings)
    assert len(full.mesh_iterations) > 1
    assert full.mesh_iterations[0].dynamics_error < settings.accuracy.dynamics
    short = solve(
        race(), settings=Settings(intervals=7, iterations=full.mesh_iterations[0].iterations)
    )
    assert len(short.mesh_iterations) == 1
    assert short.verification.passed
    assert "the budget of" in short.verdict
    assert "ended the refinement" in short.verdict
    assert "budget" not in full.verdict


def test_a_budget_can_end_inside_a_later_round() -> None:
    settings = Settings(intervals=7)
    first = solve(race(), settings=settings).mesh_iterations[0]
    short = solve(race(), settings=Settings(intervals=7, iterations=first.iterations + 1))
    assert [r.status for r in short.mesh_iterations] == [
        first.status,
        "Maximum_Iterations_Exceeded",
    ]
    assert short.iterations == first.iterations + 1
    assert short.objective == pytest.approx(first.objective, rel=1e-12)
    assert "ended the refinement" in short.verdict


def test_a_budget_that_ends_before_any_round_is_an_error_with_the_iterate() -> None:
    with pytest.raises(BudgetSpent, match=r"budget of 3 iterations .* no mesh iteration") as spent:
        solve(race(), settings=Settings(iterations=3))
    assert isinstance(spent.value, IterationLimit)
    assert spent.value.iterate.phases[0].name == "race"
    assert spent.value.finished is None


def test_a_budget_that_ends_on_a_coarse_mesh_is_an_error_with_that_round() -> None:
    coarse = Settings(scheme=Radau(2), intervals=1, refinement=AdaptiveMesh(highest_degree=2))
    with pytest.raises(BudgetSpent, match="no mesh iteration") as spent:
        solve(swing(), settings=dataclasses.replace(coarse, iterations=1))
    assert spent.value.finished is None
    one = solve(
        swing(),
        settings=dataclasses.replace(
            coarse, refinement=AdaptiveMesh(rounds=1, highest_degree=2), verify=False
        ),
    )
    enough = dataclasses.replace(coarse, iterations=one.mesh_iterations[0].iterations)
    with pytest.raises(BudgetSpent, match="errors between the points were still") as spent:
        solve(swing(), settings=enough)
    assert spent.value.finished is not None


def test_a_budget_of_seconds_is_kept() -> None:
    begin = time.perf_counter()
    with pytest.raises(BudgetSpent, match=r"budget of 0\.001 s"):
        solve(race(), settings=Settings(seconds=1e-3))
    assert time.perf_counter() - begin < 5


@pytest.mark.parametrize("budget", [{"iterations": 0}, {"seconds": -1.0}])
def test_a_budget_is_positive(budget: dict[str, float]) -> None:
    with pytest.raises(StatementError, match="give a positive number"):
        Settings(**budget)


def test_without_verification_nothing_is_replayed_and_nothing_is_claimed() -> None:
    found = solve(race(), settings=Settings(verify=False))
    assert found.verdict == "unverified"
    assert not found.verification.passed
    assert found.objective == pytest.approx(2**0.5, rel=1e-6)
    with pytest.raises(StatementError, match="no replay; solve with verify=True"):
        found.value(found.problem.minimise, replayed=True)
    assert certify(found).passed  # it replays on its own
