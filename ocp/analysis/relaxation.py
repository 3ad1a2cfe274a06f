"""The smallest relaxation of a problem that no motion meets.

Every named limit gets slacks that may not be negative, and their sum, each in units of the size of
what it relaxes, is minimised: with this L1 penalty few limits give way rather than all a little.
Dynamics, links, times and equations along a phase stay as they are.  The names are those of
`ocp.analysis.sensitivity`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ocp.analysis.loosened import Elastic, Side, Slack, effort, is_limited, loosened
from ocp.errors import StatementError
from ocp.mesh.initial_guess import evaluate_limit, start_of
from ocp.problem.statement import Problem
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solve import solve
from ocp.transcription.scaling import scales_of

# one mesh, and controls that are constant in its intervals, where limits as rows hold between the
# points too: a motion that minimises nothing but slacks has no shape of its own to resolve
_SETTINGS = Settings(intervals=40, refine=False)
_NOTHING = 1e-6  # of its size, below which a slack is the solver's tolerance
_TIE = 1e-3  # more weight from slack to slack, so that one of several equals gives way
_SAMPLES = 2001


@dataclass(frozen=True)
class Relaxed:
    """One limit that has to give way.

    Attributes
    ----------
    name, side : of the limit.
    phase, time : where the motion found makes use of it; "" and None for a number of all of it.
    limit, needed : as stated, and as it would have to be, in `unit`.
    """

    name: str
    side: Side
    phase: str
    time: float | None
    unit: str
    limit: float
    needed: float

    @property
    def amount(self) -> float:
        """By how much the limit would have to move."""
        return abs(self.needed - self.limit)

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        where = f" (used in phase '{self.phase}' at {self.time:.4g} s)" if self.phase else ""
        return (f"'{self.name}' from {self.limit:.6g} to {self.needed:.6g}{unit}, by "
                f"{self.amount:.4g}{unit}{where}")  # fmt: skip


@dataclass(frozen=True, eq=False)
class Relaxation:
    """What to relax, the least in sum, and a motion that then meets everything.

    Attributes
    ----------
    items : limits that have to give way, the largest part of its size first; none if feasible.
    total : weighted sum of the relaxations, each as a part of the size of what it relaxes.  Of
        several that are equal to a part in a thousand the last stated gives way, bounds of the
        problem before final values and these before initial ones.
    solution : a motion of the relaxed problem, which minimises the relaxation and nothing else;
        its signals go by name.
    """

    problem: str
    items: tuple[Relaxed, ...]
    total: float
    solution: Solution

    def __str__(self) -> str:
        if not self.items:
            return f"'{self.problem}' can be met as it is stated"
        listed = "; ".join(str(item) for item in self.items)
        doubt = "; ".join(self.solution.verification.reasons)
        return (f"'{self.problem}' can be met if these limits are changed: {listed}"
                f"{f' (not verified: {doubt})' if doubt else ''}")  # fmt: skip


def relaxed(
    problem: Problem, *, keep: Collection[str] = (), weights: Mapping[str, float] | None = None,
    settings: Settings | None = None,
) -> Relaxation:  # fmt: skip
    """The smallest relaxation of a problem's limits that some motion meets.

    Parameters
    ----------
    keep : names of limits that must not give way, without "lower" or "upper": ``"x"`` for the
        bounds of a signal or unknown, ``"landing"`` for a bound of the problem,
        ``"flight: power"`` for one of a phase, ``"flight: x initial"`` for a boundary value.
    weights : of a limit's relaxation, by the same names; 1 where nothing is said.

    Raises
    ------
    StatementError
        When `keep` or `weights` name something else.
    SolveFailed
        When dynamics, links, equations, times and the limits kept contradict each other.
    """
    weights = weights or {}
    _check(problem, [*keep, *weights])
    constants = {c.name: float(c.value) for c in problem.constants}
    start = start_of(problem, constants)
    elastic = Elastic(scales_of(problem, start, constants), keep)
    statement = loosened(problem, elastic, start)
    slacks = list(elastic.slacks.values())
    cost = sum(
        (weights.get(s.name, 1.0) * (1.0 + _TIE * i) * s.unknown / s.size
         for i, s in enumerate(reversed(slacks))), effort(statement, elastic))  # fmt: skip
    if not slacks:
        raise StatementError(f"no limit of '{problem.name}' may give way; name fewer to keep")
    solution = solve(
        Problem(problem.name, statement.phases, minimise=cost, bounds=statement.bounds,
                links=statement.links), settings=settings or _SETTINGS)  # fmt: skip
    moved = {s.unknown: solution.value(s.unknown) for s in slacks}
    given = [s for s in slacks if moved[s.unknown] > _NOTHING * s.size]
    given.sort(key=lambda s: -moved[s.unknown] / s.size)
    items = tuple(_item(s, moved[s.unknown], solution, constants) for s in given)
    total = sum(weights.get(s.name, 1.0) * moved[s.unknown] / s.size for s in given)
    return Relaxation(problem.name, items, total, solution)


def _check(problem: Problem, names: Collection[str]) -> None:
    """StatementError unless there are limits of these names."""
    known = {s.name for s in problem.symbols if hasattr(s, "lower") and is_limited(s)}
    known |= {b.name for b in problem.bounds}
    for phase in problem.phases:
        known |= {f"{phase.name}: {b.name}" for b in phase.bounds if not b.is_equation}
        for what, values in (("initial", phase.initial), ("final", phase.final)):
            known |= {f"{phase.name}: {state.name} {what}" for state in values}
    for name in names:
        if name not in known:
            listed = ", ".join(f"'{n}'" for n in sorted(known))
            raise StatementError(f"'{problem.name}' has no limit '{name}'; its limits are {listed}")


def _item(
    slack: Slack, amount: float, solution: Solution, constants: Mapping[str, float]
) -> Relaxed:
    limit = evaluate_limit(slack.limit, constants)
    sign = 1.0 if slack.side == "upper" else -1.0
    phase, time = "", None
    if slack.end is not None:
        phase = slack.end[0]
        time = float(solution.trajectory.phase(phase).breakpoints[slack.end[1]])
    highest = -math.inf
    for name, expression in slack.path.items():
        own = solution.trajectory.phase(name)
        times = np.linspace(own.start, own.end, _SAMPLES)
        values = sign * solution.sample(expression, times, name)
        if values.max() > highest:
            highest, phase, time = values.max(), name, float(times[np.argmax(values)])
    return Relaxed(slack.name, slack.side, phase, time, slack.unit, limit, limit + sign * amount)
