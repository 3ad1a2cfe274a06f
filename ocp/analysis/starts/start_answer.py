"""What comes of one start of several."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace

from ocp.algorithm import solve
from ocp.errors import BudgetSpent, Interrupted, OcpError, Unverified
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.interrupts import noted_interrupts
from ocp.problem.problem import Problem
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution

Guess = Solution | Trajectory | None


@dataclass(frozen=True, eq=False, repr=False)
class StartAnswer:
    """What came of a start.

    Attributes
    ----------
    solution : Solution or None
    error : Exception or None
        Why the solution does not count, or why there is none.
    seconds : float
        That it took [s].
    stopped : bool
        Whether the user asked to stop meanwhile.
    """

    solution: Solution | None
    error: Exception | None
    seconds: float
    stopped: bool = False


def answered(
    start: Callable[[], tuple[Problem, Guess]],
    settings: Settings,
    bound: float | None,
    seconds: float,
    *,
    failures: tuple[type[Exception], ...] = (OcpError,),
    progress: Progress | None = None,
    asked: Callable[[], bool] | None = None,
) -> StartAnswer:
    """Solve from a start; where it is stopped or its seconds are over, keep what it had reached.

    Parameters
    ----------
    start : function
        Gives the problem and its guess.
    settings, bound, progress : optional
        As of `ocp.solve`.
    seconds : float
        That are left for it, infinite for no budget but that of the settings [s].
    failures : tuple of exception classes
        Errors that end the start and nothing more.
    asked : function, optional
        Whether another process asks this one to stop; called with each line of progress.
    """
    begin = clock.perf_counter()
    problem: Problem | None = None
    solution: Solution | None = None
    error: Exception | None = None
    with noted_interrupts() as interrupts:

        def told(line: str) -> None:
            if progress:
                progress(line)
            if asked and asked():
                interrupts.ask()

        try:
            problem, guess = start()
            solution = solve(
                problem,
                settings=_within(settings, seconds),
                guess=guess,
                bound=bound,
                progress=told if progress or asked else None,
            )
            # what was cut short counts only if it is as accurate as asked for
            if settings.verify and settings.refinement.adapts and not solution.verification.passed:
                kind = Interrupted if solution.interrupted else BudgetSpent
                error = kind(solution.verdict)
        except Unverified as unverified:
            solution = unverified.iterate if isinstance(unverified.iterate, Solution) else None
            error = unverified
        except failures as failure:
            error = failure
    return StartAnswer(solution, error, clock.perf_counter() - begin, interrupts.asked)


def _within(settings: Settings, seconds: float) -> Settings:
    """The settings of a solve that may take so long, and no longer than they say."""
    own = math.inf if settings.seconds is None else settings.seconds
    least = min(own, seconds)
    return settings if math.isinf(least) else replace(settings, seconds=least)
