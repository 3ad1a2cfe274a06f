"""A certificate: what has been checked about a solution, with which numbers and tolerances.

`certify` does not believe what the solve checked. It drives the dynamics with the controls again,
evaluates the motion between the points, tests the first-order conditions from the multipliers, and
solves the problem a second time in another way. Each of these is a diagnostic, and others may be
asked beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ocp.diagnostics.diagnostic import Diagnostic, Evidence, Finding, Tolerances
from ocp.diagnostics.motion_conditions import motion_conditions
from ocp.diagnostics.optimality_conditions import optimality_conditions, other_controls_condition
from ocp.diagnostics.program_conditions import program_conditions
from ocp.diagnostics.second_solve import SECOND_SOLVE, confirm
from ocp.errors import StatementError
from ocp.mesh.trajectory import Trajectory
from ocp.optimality.multipliers import all_multipliers
from ocp.verification.verify import NOT_CONFIRMED

STANDARD: tuple[Diagnostic, ...] = (
    motion_conditions,
    program_conditions,
    optimality_conditions,
    other_controls_condition,
    confirm,
)
"""The diagnostics that `certify` asks by default, in their order."""


@dataclass(frozen=True, repr=False)
class Certificate:
    """All conditions that were checked on one solution.

    Attributes
    ----------
    problem : str
        Its name.
    objective : float
        In the user's sense [unit of the objective].
    verdict : str
        Of the solution, in words.
    checks : tuple of Finding
        Each with its number, tolerance, and what it means.
    """

    problem: str
    objective: float
    verdict: str
    checks: tuple[Finding, ...]

    def __repr__(self) -> str:
        met = sum(check.passed for check in self.checks)
        return (
            f"Certificate('{self.problem}': {met} of {len(self.checks)} conditions met; print it)"
        )

    @property
    def passed(self) -> bool:
        """Whether every condition is met, but for those that could not be finished."""
        return not any(check.failed for check in self.checks)

    @property
    def confirmed(self) -> bool:
        """Whether it passed, and a second, different solve agrees."""
        second = [check for check in self.checks if check.name == SECOND_SOLVE]
        return self.passed and any(check.passed for check in second)

    @property
    def start(self) -> Trajectory | None:
        """A motion from which a solve should reach a better answer; None if none was found."""
        return next((check.start for check in self.checks if check.start is not None), None)

    def __str__(self) -> str:
        head = f"{self.problem}: {self.objective:.10g}, {self.verdict}"
        foot = f"  {'certified' if self.passed else 'NOT certified'}"
        foot += ", confirmed by a second solve" if self.confirmed else ""
        return "\n".join([head, *(f"  {check}" for check in self.checks), foot])


def certify(
    solution: Any,
    tolerances: Tolerances | None = None,
    *,
    diagnostics: Sequence[Diagnostic] = STANDARD,
) -> Certificate:
    """Check a solution again.

    Parameters
    ----------
    solution : Solution
    tolerances : Tolerances, optional
        What is allowed.
    diagnostics : sequence of Diagnostic
        What is asked, in this order: `ocp.STANDARD` by default.

    Raises
    ------
    StatementError
        When it is no solution, does not carry its multipliers, or a diagnostic is none.
    KeyboardInterrupt
        When the user stops the second solve.
    """
    if not hasattr(solution, "kept_iterate"):
        raise StatementError(f"certify checks a Solution, not {solution!r}; solve it first")

    _check_diagnostics(diagnostics)

    # what the solution shows is tested, not what its solver once had
    iterate, form = solution.kept_iterate, solution.form
    shown = iterate
    if form.is_statement:
        shown = replace(
            iterate,
            trajectory=solution.trajectory,
            objective=solution.objective,
            built=iterate.transcription,
        )
    answer = Evidence(
        solution=solution,
        iterate=shown,
        multipliers=solution.kept_multipliers,
        scaled=all_multipliers(shown),
        evaluator=solution.form_evaluator,
        allowed=tolerances or Tolerances(),
    )
    checks = tuple(finding for ask in diagnostics for finding in _findings(ask, answer))
    # the certificate says itself what is confirmed
    verdict = solution.verdict.removesuffix(f"; {NOT_CONFIRMED}")
    return Certificate(iterate.problem.name, solution.objective, verdict, checks)


def _check_diagnostics(diagnostics: Any) -> None:
    """StatementError unless they are several functions."""
    if callable(diagnostics):
        raise StatementError("diagnostics is one function; write a list: diagnostics=[...]")
    if isinstance(diagnostics, (list, tuple)) and all(map(callable, diagnostics)):
        return
    raise StatementError(
        f"diagnostics is {diagnostics!r}; give a list of functions from Evidence to findings"
    )


def _findings(ask: Diagnostic, answer: Evidence) -> list[Finding]:
    """What a diagnostic finds.

    Raises
    ------
    StatementError
        When it gives something else.
    """
    found: Any = ask(answer)
    findings: list[Any] = [found] if isinstance(found, (Finding, type(None))) else list(found)
    if all(isinstance(finding, Finding) for finding in findings):
        return findings
    name = getattr(ask, "__name__", repr(ask))
    raise StatementError(f"the diagnostic '{name}' gave {found!r}; let it yield Finding(...)")
