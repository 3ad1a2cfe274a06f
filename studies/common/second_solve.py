"""A second, different solve of an answer that is about to be printed.

It takes about the time of the solve itself, and is asked after the answer is there, so that a user
who does not wait for it has the answer all the same.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from ocp import (
    Certificate,
    Constant,
    Interrupted,
    OcpError,
    Settings,
    Solution,
    Tolerances,
    Trajectory,
    certify,
    confirm,
    solve,
)
from ocp.diagnostics.optimality_conditions import other_controls_condition
from studies.common.console import Console
from studies.common.finished import NOTHING_KEPT, FinishedSteps, mark
from studies.common.result import Criterion

NAME = "a second solve"

# Part of what a better answer may have more: less than that is left by the accuracy of a solve
_LEFT_BY_A_SOLVE = 0.1

# [s] for a solve of less: a busy machine should end it, too
LEAST_SECONDS = 10.0
_SHORTEST = 1.0  # [s] of a solve, if the budget is spent


@dataclass(frozen=True, eq=False)
class SecondSolve:
    """What came of it.

    Attributes
    ----------
    solution : Solution
        The answer to print: the first one, or the one that the better motion led to.
    check : Criterion
        Whether it holds; what could not be finished does not fail.
    interrupted : bool
        Whether the user stopped it.
    """

    solution: Solution
    check: Criterion
    interrupted: bool = False


def second_solve(
    solution: Solution,
    settings: Settings,
    console: Console,
    *,
    left: float = math.inf,
    constants: Mapping[Constant, float] | None = None,
    gain: float = Tolerances().gain,
    name: str = NAME,
    kept: FinishedSteps = NOTHING_KEPT,
) -> SecondSolve:
    """Confirm an answer; where a better motion is found, solve once from there.

    Parameters
    ----------
    settings, constants
        Of the solve.
    left : float
        Of the user's budget; nothing is asked if nothing is left [s].
    gain : float
        Part of the objective that a better answer may have more.
    name : str
        Of the check, where several answers are asked.
    kept : FinishedSteps, optional
        Where what came of it goes to, and where that of an earlier run is read.
    """
    if left <= 0.0:
        return SecondSolve(
            solution, _criterion(name, "open: the time limit was reached", math.nan, gain)
        )
    return kept.step(
        name,
        lambda: _asked(solution, settings, console, left, constants, gain, name),
        solution.problem,
        console.progress,
        begins_with=mark(solution),
    )


def _asked(
    solution: Solution,
    settings: Settings,
    console: Console,
    left: float,
    constants: Mapping[Constant, float] | None,
    gain: float,
    name: str,
) -> SecondSolve:
    begin = clock.monotonic()
    console.progress(f"{name}, on another mesh and from a perturbed start")
    seconds = min(max(solution.seconds, LEAST_SECONDS), left)
    asked = partial(confirm, seconds=seconds, progress=console.live), other_controls_condition
    try:
        certificate = certify(solution, Tolerances(gain=gain), diagnostics=asked)
        least = _LEFT_BY_A_SOLVE * gain
        left = max(left - (clock.monotonic() - begin), _SHORTEST)
        within = settings
        if left < (settings.seconds or math.inf):
            within = replace(settings, seconds=left)
        better = _from(certificate.start, solution, within, constants, least, console)
    except (KeyboardInterrupt, Interrupted):
        stopped = _criterion(name, "stopped by the user", math.nan, gain)
        return SecondSolve(solution, stopped, interrupted=True)

    found = SecondSolve(solution, _said(name, certificate, gain))
    if better is not None:
        part = _gain(solution, better)
        words = (
            f"it found a solution that is better by {part:.1e} of the objective; this is the "
            "result now"
        )
        found = SecondSolve(better, _criterion(name, words, math.nan, gain))
    console.progress(f"{found.check.sentence}, {clock.monotonic() - begin:.1f} s")
    return found


def _from(
    start: Trajectory | None,
    before: Solution,
    settings: Settings,
    constants: Mapping[Constant, float] | None,
    least: float,
    console: Console,
) -> Solution | None:
    """The verified answer that a motion leads to, if it is better by a least part; else None."""
    if start is None:
        return None
    console.progress("a second solve found a better motion: solving again from it")
    try:
        found = solve(
            before.problem,
            settings=settings,
            guess=start,
            constants=constants,
            progress=console.live,
            partial=False,
        )
    except Interrupted:
        raise
    except OcpError as error:
        console.progress(f"from the better motion: {error}")
        return None
    better = _gain(before, found) > least
    return found if better and found.verification.passed else None


def _gain(before: Solution, after: Solution) -> float:
    """Part of the objective by which an answer is better than one before."""
    gained = before.problem.sense * (before.objective - after.objective)
    return gained / before.kept_iterate.objective_size


def _said(name: str, certificate: Certificate, gain: float) -> Criterion:
    """What findings say, the worst of them first."""
    wrong = [check for check in certificate.checks if check.failed]
    if wrong:
        sentences = "; ".join(f"{check.name}: {check.sentence}" for check in wrong)
        worst = max(check.value for check in wrong)
        return _criterion(name, f"{sentences}", worst, gain)
    unfinished = [check.sentence for check in certificate.checks if check.open]
    if unfinished:
        return _criterion(name, f"open: {'; '.join(unfinished)}", math.nan, gain)
    worst = max(check.value for check in certificate.checks)
    return _criterion(name, f"confirmed within {worst:.1e} of the objective", worst, gain)


def _criterion(name: str, words: str, value: float, gain: float) -> Criterion:
    """A criterion that fails by a number alone."""
    passed = not value > gain
    begin = "passed" if passed else "FAILED"
    return Criterion(name, "1", value, gain, passed, f"{begin}: {name}: {words}")
