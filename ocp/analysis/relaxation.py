"""The smallest relaxation of a problem that no motion meets.

The statement is rewritten.  Signals and unknowns lose their limits, which become bounds.  Every
named limit gets slacks that may not be negative, and their sum, each in units of the size of what
it relaxes, is minimised: with this L1 penalty few limits give way rather than all a little.
Dynamics, links, times and equations along a phase stay as they are.  The names are those of
`ocp.analysis.sensitivity`.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from ocp.algorithm import check_arguments, solve
from ocp.analysis.loosened import LimitNames, LimitSlack, Loosening, Side
from ocp.keywords import checked_keywords
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.trajectory import Trajectory
from ocp.optimality.active_set import path_multiplier_sums
from ocp.problem.parameters import Parameters, parameters_of
from ocp.problem.problem import Problem
from ocp.progress import Progress
from ocp.refinement.policies.policy import FixedMesh
from ocp.scaling.automatic import scales_of
from ocp.settings import Settings
from ocp.solution.solution import Solution

# One mesh, and controls that are constant in its intervals, where limits as rows hold between the
# points too: a motion that minimises nothing but slacks has no shape of its own to resolve.
_SETTINGS = Settings(intervals=40, refinement=FixedMesh())

# Part of its size, below which a slack is the solver's tolerance.
_NOTHING = 1e-6

# Times as strongly as an earlier phase, with which a later one has to need a limit to be named.
_MORE = 10.0

_SAMPLES = 2001  # of an interval, among which the instant is looked for that needs the relaxation


@dataclass(frozen=True)
class Relaxed:
    """One limit that has to give way.

    Attributes
    ----------
    name, side : str
        Of the limit.
    phase, time : str and float or None
        Where the motion needs it most [s]; "" and None for a number of the whole motion.
    unit : str
        Of the two numbers that follow.
    limit, needed : float
        As stated, and as it would have to be [unit].
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
        """By how much the limit would have to move [unit]."""
        return abs(self.needed - self.limit)

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        where = f" (needed in phase '{self.phase}' at {self.time:.4g} s)" if self.phase else ""
        return (
            f"'{self.name}' from {self.limit:.6g} to {self.needed:.6g}{unit}, by "
            f"{self.amount:.4g}{unit}{where}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Relaxation:
    """What to relax, the least in sum, and a motion that then meets everything.

    Attributes
    ----------
    problem : str
    items : tuple of Relaxed
        Limits that have to give way, the largest part of its size first; none if feasible.
    total : float
        Sum of the relaxations, each as a part of the size of what it relaxes.  Of
        several that are equal to a part in a thousand the last stated gives way, bounds of the
        problem before final values and these before initial ones.
    solution : Solution
        A motion of the relaxed problem, which minimises the relaxation and nothing else.  Its
        signals go by name.
    """

    problem: str
    items: tuple[Relaxed, ...]
    total: float
    solution: Solution

    def __repr__(self) -> str:
        names = ", ".join(f"'{item.name}' {item.side}" for item in self.items)
        verb = "give" if len(self.items) > 1 else "gives"
        return f"Relaxation of '{self.problem}': {names or 'nothing'} {verb} way; print it"

    def __str__(self) -> str:
        reasons = "; ".join(self.solution.verification.reasons)
        doubt = f" (not verified: {reasons})" if reasons else ""
        if not self.items:
            return f"'{self.problem}' is feasible without changes{doubt}"
        listed = "; ".join(str(item) for item in self.items)
        return f"'{self.problem}' is feasible if these limits are changed: {listed}{doubt}"


@checked_keywords()
def relaxed(
    problem: Problem,
    *,
    keep: Collection[str] = (),
    only: Collection[str] | None = None,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    progress: Progress | bool | None = None,
) -> Relaxation:
    """The smallest relaxation of a problem's limits that some motion meets.

    A limit is named without "lower" or "upper": ``"x"`` for the bounds of a signal or unknown,
    ``"landing"`` for a bound of the problem, ``"flight: power"`` for one of a phase,
    ``"flight: x initial"`` for a boundary value.  ``"power"`` stands for the bounds of that name in
    all phases.

    Parameters
    ----------
    problem : Problem
    keep : collection of str
        Limits that must not give way.
    only : collection of str, optional
        The limits that may give way; all others are kept.  Bounds of several phases that are
        named together here move together: what they need is one limit for all of them.
    settings : Settings, optional
        By default 40 intervals that stay, which is good to about a thousandth of what is needed.
        Where the motion does not hold between their points, the relaxation says so.
    guess, progress : optional
        As of `ocp.solve`.

    Raises
    ------
    StatementError
        When `keep` or `only` name something else.
    SolveFailed
        When dynamics, links, equations, times and the limits kept contradict each other.
    """
    settings = settings or _SETTINGS
    check_arguments(problem, settings, guess, None)
    limits = LimitNames(problem)
    limits.check([*keep, *(only or ())])
    kept = limits.each(keep)
    if only is not None:
        kept |= limits.names - limits.each(only)
    together = frozenset(only or ()) & limits.common

    parameters = parameters_of(problem)
    start = initial_guess(problem, parameters)
    scales = scales_of(problem, start, parameters)
    loosening = Loosening(problem, scales, start, kept, together)
    statement = loosening.statement()
    slacks = list(loosening.slacks.values())

    trajectory = guess.trajectory if isinstance(guess, Solution) else guess
    solution = solve(
        statement, settings=settings, guess=trajectory, progress=progress, partial=False
    )

    moved = {s.unknown: solution.value(s.unknown) for s in slacks}
    given_way = [s for s in slacks if moved[s.unknown] > _NOTHING * s.size]
    given_way.sort(key=lambda s: -moved[s.unknown] / s.size)
    items = tuple(_item(s, moved[s.unknown], solution, parameters) for s in given_way)
    total = sum(moved[s.unknown] / s.size for s in given_way)
    return Relaxation(problem.name, items, total, solution)


def _item(slack: LimitSlack, amount: float, solution: Solution, parameters: Parameters) -> Relaxed:
    """What a slack says, and where along the motion it is needed most."""
    sign = 1.0 if slack.side == "upper" else -1.0
    phase, time = "", None
    if slack.end is not None:
        phase = slack.end[0]
        time = float(solution.trajectory.phase(phase).breakpoints[slack.end[1]])

    pull = -math.inf
    for name, expression in slack.path.items():
        time_there, pull_there = _where_it_pulls(slack, expression, solution, name)
        # at an instant that two phases share, multipliers may be those of either
        if pull == -math.inf or pull_there > _MORE * pull:
            phase, time, pull = name, time_there, pull_there

    limit = parameters.limit(slack.limit)
    needed = limit + sign * amount
    return Relaxed(slack.name, slack.side, phase, time, slack.unit, limit, needed)


def _where_it_pulls(
    slack: LimitSlack, expression: Any, solution: Solution, name: str
) -> tuple[float, float]:
    """The time at which a phase needs the slack of a path limit most [s], and how strongly.

    Once a limit has moved, a motion goes up to it elsewhere as well. The multipliers tell where it
    has to.
    """
    iterate, motion = solution.kept_iterate, solution.trajectory.phase(name)
    index = [phase.name for phase in solution.trajectory.phases].index(name)
    names = [own.name for own in iterate.transcription.constraints[index]]
    sums = path_multiplier_sums(iterate, index)
    pulls = sums.get(names.index(f"{slack.name} {slack.side}"), np.zeros(motion.intervals))

    most = int(np.argmax(pulls))
    pulled = pulls[most] > 0.0
    first, last = motion.breakpoints[most : most + 2] if pulled else (motion.start, motion.end)
    times = np.linspace(first, last, _SAMPLES)
    values = solution.sample(expression, times, name)
    highest = np.argmax(values if slack.side == "upper" else -values)
    return float(times[highest]), float(pulls[most])
