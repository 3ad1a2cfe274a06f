"""A later objective by exchanged roles: it gets a cap, and the one held before is minimised.

Where an objective is held within a hair of its optimum, the motions that remain are few, and next
to each of them others break the limit. The price of that limit is then enormous, and a solver that
minimises the later objective under it goes astray. With the roles exchanged the price is its
reciprocal, and small. What the earlier objective costs under a cap on the later one rises as the
cap falls, so the least cap under which it keeps its limit is the optimum that was looked for.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ocp.analysis.solve_options import SolveOptions
from ocp.errors import SolveFailed, StatementWarning
from ocp.problem.bounds import Bound
from ocp.problem.problem import Problem, with_objective
from ocp.problem.symbols import Constant
from ocp.refinement.budget import Budget
from ocp.refinement.mesh_solver import PATIENCE
from ocp.refinement.policies.policy import FixedMesh
from ocp.solution.solution import Solution

# Part of what is conceded that may remain unused: the limit is met to the tolerance of the
# objectives, which is itself some part of a small concession.
_UNUSED = 0.03

# Part of the way down to the least of the later objective that the first step takes, and by how
# much a step that keeps the limit may be longer than the way until then.
_FIRST_STEP = 0.1
_LONGER = 2.0

# Part of a bracket by which a cap keeps away from its ends.
_NEAREST = 0.02

# Seconds that a solve has if the budget is spent.
_LEAST_LEFT = 0.1

# Solves at most
_SOLVES = 12


@dataclass(frozen=True, eq=False)
class Held:
    """An objective that keeps a limit.

    Attributes
    ----------
    objective : expression
    beside : expression
        Term added to it while it is minimised.
    value : float
        Its optimum.
    limit : float
        What it may be.
    """

    objective: Any
    beside: Any
    value: float
    limit: float


def by_exchanged_roles(
    problem: Problem,
    objective: Any,
    beside: Any,
    held: Held,
    first: Solution,
    bounds: Sequence[Bound],
    options: SolveOptions,
) -> tuple[Solution, float] | None:
    """The least of an objective while another one keeps its limit.

    Parameters
    ----------
    problem : Problem
        Its own objective is not used.
    objective, beside : expression
        To be made small, and the term beside it where it is minimised.
    held : Held
        The objective that keeps its limit.
    first : Solution
        That keeps it, to start from.
    bounds : sequence of Bound
        Further ones.
    options : SolveOptions
        The budget of seconds is that of all solves together.

    Returns
    -------
    (Solution, float) or None
        The motion of the least cap that was found, and how much less the objective may be at a
        local optimum, as a part of its value. None where nothing better than `first` was found.

    Raises
    ------
    Interrupted
        The user stopped it.
    """
    seconds = options.settings.seconds
    budget = Budget(seconds=math.inf if seconds is None else seconds)

    # without the limit, on one mesh: how far down the later objective goes at most, about
    alone = with_objective(problem, objective + beside, bounds)
    lowest = _attempted(alone, first, options, budget, refinement=FixedMesh(), verify=False)
    if lowest is None:
        return None
    search = _CapSearch(
        high=largest_value(objective, first),
        excess_high=held.value - held.limit,
        low=largest_value(objective, lowest),
        excess_low=largest_value(held.objective, lowest) - held.limit,
    )
    if search.excess_low <= 0.0:  # the two do not contend
        found = _attempted(alone, lowest, options, budget)
        return None if found is None else (found, 0.0)

    cap = Constant("cap on the next objective", value=0.0)
    below = Bound("next objective", objective - cap.symbol, upper=0.0)
    exchanged = with_objective(problem, held.objective + held.beside, (*bounds, below))
    best, latest = None, first
    for _ in range(_SOLVES):
        if budget.spent(0):
            break
        value = search.next_cap()
        found = _attempted(exchanged, latest, options, budget, constants={cap: value})
        if found is None:
            search.fail(value)
            continue

        latest = found
        excess = largest_value(held.objective, found) - held.limit
        search.note(value, excess)
        best = found if excess <= 0.0 else best
        if 0.0 <= -excess <= _UNUSED * (held.limit - held.value):
            break
    return None if best is None else (best, search.gap)


def _attempted(
    problem: Problem, guess: Solution, options: SolveOptions, budget: Budget, **changed: Any
) -> Solution | None:
    """A solution within what is left of a budget, None where none was found."""
    if options.settings.seconds is not None:
        changed["seconds"] = max(budget.seconds - budget.elapsed, _LEAST_LEFT)
    # from the neighbouring cap a solver takes few iterations
    patient = options.settings.solver.within(PATIENCE, math.inf)

    with warnings.catch_warnings():
        # what an objective alone leaves without effect is not the user's concern
        warnings.simplefilter("ignore", StatementWarning)
        try:
            return options.solved(problem, guess, solver=patient, **changed)
        except SolveFailed:
            return None


def largest_value(objective: Any, solution: Solution) -> float:
    """An objective's value, the larger one of the solution's and its replay's."""
    value = solution.value(objective)
    if solution.replay.phases:
        value = max(value, solution.value(objective, replayed=True))
    return float(value)


@dataclass
class _CapSearch:
    """The search for the cap at which an excess, which rises as the cap falls, is zero.

    Attributes
    ----------
    high, excess_high : a cap with an excess that is not positive, and that excess.
    low, excess_low : the same with a positive one.
    """

    high: float
    excess_high: float
    low: float
    excess_low: float

    def __post_init__(self) -> None:
        self._top = self.high
        self._step = _FIRST_STEP * (self.high - self.low)
        self._tried_below = False  # the lower end is one that was tried
        self._last_was_high: bool | None = None

    @property
    def gap(self) -> float:
        """How far the lower end of the bracket is, as a part of the upper one."""
        return (self.high - self.low) / abs(self.high)

    def next_cap(self) -> float:
        """The cap to try next."""
        width = self.high - self.low
        if not self._tried_below:
            return self.high - min(self._step, width / 2.0)
        share = self.excess_high / (self.excess_high - self.excess_low)
        return self.high - min(max(share, _NEAREST), 1.0 - _NEAREST) * width

    def fail(self, cap: float) -> None:
        """Nothing was found under a cap: the next one is nearer to those under which it was."""
        self._step = (self.high - cap) / 2.0
        self.excess_low *= 4.0

    def note(self, cap: float, excess: float) -> None:
        """Take up what came of a cap."""
        again = self._last_was_high is (excess <= 0.0)
        self._last_was_high = excess <= 0.0
        if excess > 0.0:
            self.low, self.excess_low, self._tried_below = cap, excess, True
            # an end that stays twice loses half of its weight, so that it moves, too (Illinois)
            self.excess_high /= 2.0 if again else 1.0
            return

        # along the last two caps to the limit: it is met sooner, as the excess bends upwards
        rise = (excess - self.excess_high) / (self.high - cap)
        most = _LONGER * (self._top - cap)
        self._step = min(-excess / rise, most) if rise > 0.0 else most
        self.high, self.excess_high = cap, excess
        self.excess_low /= 2.0 if again else 1.0
