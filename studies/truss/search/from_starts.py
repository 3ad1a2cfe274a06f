"""Solves problems of the truss from several starts, of which an earlier run may have done some."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ocp import Audit, Problem, Settings, Solution, Trial, audit
from studies.common.console import Console, number
from studies.common.exit_codes import StudyError
from studies.common.finished import FinishedSteps
from studies.truss.problem import Statement

Starts = Mapping[str, Callable[[], Problem]]


def starts_told(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """What came of each start, for the record of a result."""
    return [
        {
            "start": trial.name,
            "value": trial.value,
            "seconds": trial.seconds,
            "failure": None if trial.error is None else str(trial.error),
        }
        for trial in trials
    ]


@dataclass(frozen=True, eq=False)
class Statements:
    """The statements that problems were made from.

    Attributes
    ----------
    of : dict of Problem to Statement
    """

    of: dict[Problem, Statement] = field(default_factory=dict)

    def noted(self, problem: Problem, statement: Statement) -> Problem:
        """A problem, whose statement is kept."""
        self.of[problem] = statement
        return problem

    def value(self, problem: Problem, solution: Solution) -> float:
        """The first objective of the replay, as it is reported: without the price of roughness."""
        return solution.value(self.of[problem].stages[0], replayed=True)


def from_starts(
    starts: Starts,
    statements: Statements,
    settings: Settings,
    *,
    kind: str,
    kept: FinishedSteps,
    again: Starts | None = None,
    known: Mapping[str, Trial | Callable[[], Trial | None]] | None = None,
    line: Callable[[Trial, bool], str],
    console: Console,
    **options: Any,
) -> Audit:
    """What came of starts; each that is done is kept, and said.

    Parameters
    ----------
    starts : mapping of name to a function that states its problem
    statements : of these problems, as they are stated.
    settings, options : of `ocp.audit`.
    kind, kept : where starts go to, and where those of an earlier run are read.
    again : those of the starts that are the same in another run; by default all of them.
    known : trials of this run, or functions that give them when their turn comes.
    line : function of a trial, and of whether it is of an earlier run, that gives one line.
    """
    again = starts if again is None else again

    def finished(trial: Trial) -> None:
        # kept before it is said: who reads that it is done may kill the process
        earlier = trial.name in again and not kept.keep(kind, trial)
        console.progress(line(trial, earlier))

    return audit(
        starts=starts,
        settings=settings,
        value=statements.value,
        failures=(StudyError,),
        known={**kept.known(kind, again), **(known or {})},
        progress=console.live,
        finished=finished,
        **options,
    )


def one_line(trial: Trial, earlier: bool, unit: str, title: str = "") -> str:
    """A line of progress on a start that is done, in this run or in an earlier one.

    Parameters
    ----------
    unit, title : of the value; a title ends in a space.
    """
    if trial.solution is None:
        return f"{trial.name}: failed, {trial.error}"
    when = f"{trial.seconds:.1f} s{', in an earlier run' if earlier else ''}"
    words = "" if trial.error is None else ", unverified"
    return f"{trial.name}: {title}{number(trial.value, 7)} {unit}{words}, {when}"
