"""What stops a solve: budgets, failed attempts, Ctrl-C; what is handed over, and what it says."""

import math
import signal
import time
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from ocp import (
    TIME,
    Between,
    BudgetSpent,
    Control,
    Interrupted,
    Ipopt,
    IterationLimit,
    Phase,
    Problem,
    Settings,
    State,
    load,
    save,
    solve,
)
from ocp.nlp.solver import NlpResult, StartingPoint
from ocp.refinement import budget as budgets
from ocp.refinement import mesh_solver
from ocp.refinement.budget import Budget
from ocp.refinement.mesh_solver import with_retries
from ocp.refinement.solved_mesh import MeshIteration
from ocp.transcription.kernels import Program
from tests.ocp.problems import cubic_oscillator, race, rest_to_rest


def following():
    """A signal that few intervals do not follow."""
    x, u = State("x"), Control("u")
    phase = Phase("follow", {x: u - x**3}, {x: 0}, end=20.0)
    return Problem("follow", [phase], minimise=phase.integral((x - ca.sin(TIME**2)) ** 2 + u**2))


# its switches lie between the points
SWING = cubic_oscillator(Between(1, 9, 3))
OPTIMUM = 1.7630295896  # on meshes of 4 to 13 intervals, all the same
FEW = Settings(intervals=4)


def stopped_in(mesh_iteration, **how):
    """The answer to Ctrl-C in a mesh iteration."""

    def stop(line):
        if f"mesh iteration {mesh_iteration} " in line:
            signal.raise_signal(signal.SIGINT)

    return solve(SWING, settings=FEW, progress=stop, **how)


def test_ctrl_c_hands_over_the_best_motion_and_what_it_is_accurate_to():
    found = stopped_in(2)
    assert found.interrupted
    assert len(found.mesh_iterations) == 2
    error = abs(found.objective - OPTIMUM) / OPTIMUM
    assert 1e-6 < error < found.accuracy <= 1e-2
    assert f"accurate to {found.accuracy:.1e}; you stopped the refinement" in found.verdict
    assert not found.verification.passed  # not to what was asked for


def test_a_finished_solution_says_what_it_is_accurate_to():
    found = solve(SWING)
    assert found.ending == "tolerances"
    assert not found.interrupted
    assert found.verification.passed
    assert 0 < found.accuracy < 1e-5


def test_a_stopped_solution_is_kept_in_a_file_as_such(tmp_path):
    found = stopped_in(2)
    save(found, tmp_path / "stopped")
    again = load(tmp_path / "stopped")
    assert again.interrupted
    assert again.ending == "interrupted"
    assert (again.accuracy, again.verdict) == (found.accuracy, found.verdict)


def test_who_asks_for_it_gets_an_error_with_what_was_reached():
    with pytest.raises(Interrupted, match="'swing' was stopped in mesh iteration 2") as caught:
        stopped_in(2, partial=False)
    assert caught.value.finished is not None


def test_a_second_ctrl_c_ends_at_once():
    def stop(line):
        if "mesh iteration 2 " in line:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        solve(SWING, settings=FEW, progress=stop)


def test_a_spent_budget_hands_over_the_best_motion():
    first = solve(SWING, settings=FEW).mesh_iterations[0]
    most = first.iterations + 1
    found = solve(SWING, settings=replace(FEW, iterations=most))
    statuses = [entry.status for entry in found.mesh_iterations]
    assert statuses == [first.status, "Maximum_Iterations_Exceeded"]
    assert found.iterations == most
    assert found.objective == pytest.approx(first.objective, rel=1e-12)
    assert found.ending == "budget"
    assert not found.interrupted
    assert abs(found.objective - OPTIMUM) / OPTIMUM < found.accuracy <= 1e-2
    assert f"refinement ended at the budget of {most} iterations" in found.verdict


def test_a_budget_ends_refinement_with_the_best_round_that_holds() -> None:
    x, *_, phase = rest_to_rest(end=Between(0.1, 20, guess=2), lower=-2, upper=2)
    phase = replace(phase, guess={x: (0, 1)})
    problem, settings = Problem("race", phase, minimise=phase.end_time), Settings(intervals=7)
    full = solve(problem, settings=settings)
    first, *later = full.mesh_iterations
    assert later
    assert first.dynamics_error < settings.accuracy.dynamics
    short = solve(problem, settings=replace(settings, iterations=first.iterations))
    assert len(short.mesh_iterations) == 1
    assert short.verification.passed
    assert "the budget of" in short.verdict
    assert "refinement ended" in short.verdict
    assert "budget" not in full.verdict


def test_a_budget_that_ends_before_any_round_is_an_error_with_the_iterate() -> None:
    with pytest.raises(BudgetSpent, match=r"budget of 3 iterations .* no mesh iteration") as spent:
        solve(race(), settings=Settings(iterations=3))
    assert isinstance(spent.value, IterationLimit)
    assert spent.value.iterate.phases[0].name == "race"
    assert spent.value.finished is None


def test_a_budget_of_seconds_is_kept() -> None:
    begin = time.process_time()
    with pytest.raises(BudgetSpent, match=r"budget of 0\.001 s"):
        solve(race(), settings=Settings(seconds=1e-3))
    assert time.process_time() - begin < 5


def test_what_nobody_can_trust_is_no_solution():
    with pytest.raises(BudgetSpent, match="remaining errors between the points are") as caught:
        solve(following(), settings=Settings(intervals=2, iterations=20))
    assert caught.value.finished is not None


def test_the_functions_of_a_program_are_built_within_the_seconds(monkeypatch):
    prepare = Program.prepare

    def slowly(program):
        time.sleep(0.3)
        prepare(program)

    monkeypatch.setattr(Program, "prepare", slowly)
    assert solve(following(), settings=Settings(solver=Ipopt(seconds=30)))
    with pytest.raises(IterationLimit):
        solve(following(), settings=Settings(solver=Ipopt(seconds=0.25)))


def test_no_mesh_is_begun_that_cannot_be_examined_in_time(monkeypatch):
    estimate_errors, skipped = mesh_solver.estimate_errors, []  # [s]
    ahead = SimpleNamespace(perf_counter=lambda: time.perf_counter() + sum(skipped))
    monkeypatch.setattr(budgets, "clock", ahead)

    def slowly(*arguments):
        skipped.append(120.0)
        return estimate_errors(*arguments)

    monkeypatch.setattr(mesh_solver, "estimate_errors", slowly)
    with pytest.raises(BudgetSpent, match="was reached in mesh iteration 1 "):
        solve(following(), settings=Settings(seconds=200))


COLD = StartingPoint(np.zeros(2))
WARM = StartingPoint(np.zeros(2), (np.ones(2), np.ones(1)))


@dataclass
class Runs:
    """Runs that end so, each with an objective less by one; notes options and start of each."""

    outcomes: list[str]
    notes: list[tuple[str, str, int, bool]] = field(default_factory=list)

    def __call__(self, solver, start):
        warm = start.multipliers is not None
        self.notes.append((solver.barrier, solver.line_search, solver.max_iterations, warm))
        outcome, nothing = self.outcomes.pop(0), np.zeros(0)
        left = float(len(self.outcomes))
        return NlpResult(outcome, outcome, start.x, left, nothing, nothing, nothing, 10, 0.5)


def solved_before(attempts=1):
    """One mesh iteration before this one, which took seven iterations."""
    numbers = (math.nan,) * 4
    return (MeshIteration(20, 0, 0, 7, 0.1, *numbers, "Solve_Succeeded", attempts=attempts),)


USUAL = ("adaptive", "filter", 1000)
ATTEMPTS = {
    "a first round without multipliers": (COLD, (), [(*USUAL, False)]),
    "a first round with multipliers": (WARM, (), [(*USUAL, True), (*USUAL, False)]),
    "a later round without multipliers": (
        COLD,
        solved_before(),
        [("monotone", "filter", 1000, False), (*USUAL, False)],
    ),
    "a later round with multipliers": (
        WARM,
        solved_before(),
        [
            ("adaptive", "filter", 300, True),
            ("adaptive", "cg-penalty", 300, True),
            ("monotone", "filter", 1000, False),
            (*USUAL, False),
        ],
    ),
}


@pytest.mark.parametrize(("start", "before", "attempts"), ATTEMPTS.values(), ids=ATTEMPTS)
def test_attempts_in_order(start, before, attempts) -> None:
    runs = Runs(["failed"] * len(attempts))
    result = with_retries(runs, Ipopt(), start, Budget(), before)
    assert runs.notes == attempts
    # what every attempt took is counted
    assert (result.iterations, result.seconds) == (10 * len(attempts), 0.5 * len(attempts))


@pytest.mark.parametrize("outcome", ["solved", "interrupted"])
def test_an_attempt_that_is_solved_or_interrupted_is_the_last(outcome) -> None:
    runs = Runs(["failed", outcome, "failed"])
    result = with_retries(runs, Ipopt(), WARM, Budget(), solved_before())
    assert len(runs.notes) == 2
    assert (result.outcome, result.iterations) == (outcome, 20)


def test_an_attempt_that_leads_to_a_worse_optimum_has_failed() -> None:
    runs = Runs(["solved"] * 3)
    result = with_retries(runs, Ipopt(), WARM, Budget(), solved_before(), worst=1.5)
    assert (result.outcome, result.objective, result.iterations) == ("solved", 1.0, 20)
    runs = Runs(["solved"] * 4)
    result = with_retries(runs, Ipopt(), WARM, Budget(), solved_before(), worst=-0.5)
    assert (result.outcome, result.attempts) == ("failed", 4)


def test_a_warm_start_that_lost_its_way_before_is_not_waited_for_as_long() -> None:
    limits = []
    for attempts in (1, 2):
        runs = Runs(["failed", "solved"])
        with_retries(runs, Ipopt(), WARM, Budget(), solved_before(attempts))
        limits.append([limit for _, _, limit, _ in runs.notes])
    patient, hasty = limits
    assert hasty[0] < patient[0] == 300
    assert hasty[1] == patient[1] == 300


@pytest.mark.parametrize(
    ("budget", "of_this_mesh", "limits"),
    [(Budget(iterations=25), {}, [18, 8]), (Budget(), {"most": 15}, [15, 5])],
)
def test_all_attempts_together_take_no_more_than_is_left(budget, of_this_mesh, limits) -> None:
    runs = Runs(["failed"] * 4)
    result = with_retries(runs, Ipopt(), WARM, budget, solved_before(), **of_this_mesh)
    # each takes ten, and after the second one nothing is left
    assert [limit for _, _, limit, _ in runs.notes] == limits
    assert result.iterations == 20


def test_a_budget_cuts_a_solver_to_what_is_left() -> None:
    assert Budget().within(Ipopt(), 500) == Ipopt()
    assert Budget(iterations=600).within(Ipopt(), 500) == Ipopt(max_iterations=100)
    assert Budget(iterations=600).within(Ipopt(max_iterations=50), 500).max_iterations == 50
    cut = Budget(seconds=5.0).within(Ipopt(), 0)
    assert 0 < cut.seconds <= 5.0
    assert replace(cut, seconds=Ipopt().seconds) == Ipopt()


def test_a_budget_in_words() -> None:
    assert str(Budget(iterations=600)) == "600 iterations"
    assert str(Budget(iterations=600, seconds=2.5)) == "600 iterations or 2.5 s"
    assert not Budget().spent(10**9)
    assert Budget(iterations=3).spent(3)
    assert Budget(seconds=1.0, begin=-math.inf).spent(0)
