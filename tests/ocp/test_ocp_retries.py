"""The attempts at one nonlinear program, and the budget of all of them."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from ocp import Ipopt
from ocp.nlp.solver import NlpResult, StartingPoint
from ocp.refinement.budget import Budget
from ocp.refinement.mesh_solver import with_retries
from ocp.refinement.solved_mesh import MeshIteration

COLD = StartingPoint(np.zeros(2))
WARM = StartingPoint(np.zeros(2), (np.ones(2), np.ones(1)))


@dataclass
class Runs:
    """Runs that fail until the last one; notes barrier, line search, limit and start of each."""

    outcomes: list[str]
    notes: list[tuple[str, str, int, bool]] = field(default_factory=list)

    def __call__(self, solver, start):
        warm = start.multipliers is not None
        self.notes.append((solver.barrier, solver.line_search, solver.max_iterations, warm))
        outcome, nothing = self.outcomes.pop(0), np.zeros(0)
        return NlpResult(outcome, outcome, start.x, 0.0, nothing, nothing, nothing, 10, 0.5)


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


@pytest.mark.parametrize("case", ATTEMPTS)
def test_attempts_in_order(case) -> None:
    start, before, attempts = ATTEMPTS[case]
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


def test_a_warm_start_that_lost_its_way_before_is_not_waited_for_as_long() -> None:
    limits = []
    for attempts in (1, 2):
        runs = Runs(["failed", "solved"])
        with_retries(runs, Ipopt(), WARM, Budget(), solved_before(attempts))
        limits.append([limit for _, _, limit, _ in runs.notes])
    patient, hasty = limits
    assert hasty[0] < patient[0] == 300
    assert hasty[1] == patient[1] == 300


def test_a_spent_budget_ends_the_attempts() -> None:
    runs = Runs(["failed"] * 4)
    with_retries(runs, Ipopt(), WARM, Budget(iterations=25), solved_before())
    # 18 iterations are left, then 8, then none
    assert [limit for _, _, limit, _ in runs.notes] == [18, 8]


def test_a_mesh_that_may_take_so_many_iterations_takes_no_more_in_all_attempts() -> None:
    runs = Runs(["failed"] * 4)
    result = with_retries(runs, Ipopt(), WARM, Budget(), solved_before(), most=15)
    # 15 iterations are left, then 5, then none
    assert [limit for _, _, limit, _ in runs.notes] == [15, 5]
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
