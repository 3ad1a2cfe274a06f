"""A certificate: what has been checked about a solution, with which numbers and tolerances.

`certify` does not believe what the solve checked. It drives the dynamics with the controls again,
evaluates the motion between the points and tests the first-order conditions from the multipliers.
For schemes whose multipliers do not tell what a finer mesh gains, it solves the problem on one. The
conditions themselves are in `motion_conditions`, `optimality_conditions`, `program_conditions` and
`finer_mesh`, beside it.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from typing import Protocol

import numpy as np

from ocp.errors import StatementError
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import Multipliers, all_multipliers
from ocp.reformulate.form import Form
from ocp.verification.conditions import Condition, Evidence
from ocp.verification.finer_mesh import finer_mesh_conditions
from ocp.verification.known_times import known_time_conditions
from ocp.verification.motion_conditions import motion_conditions, step_conditions
from ocp.verification.optimality_conditions import optimality_conditions
from ocp.verification.program_conditions import (
    curvature_condition,
    peak_conditions,
    program_conditions,
)
from ocp.verification.tolerances import Tolerances


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
    checks : tuple of Condition
        Each with its number, tolerance, and what it means.
    """

    problem: str
    objective: float
    verdict: str
    checks: tuple[Condition, ...]

    def __repr__(self) -> str:
        met = sum(check.passed for check in self.checks)
        return (
            f"Certificate('{self.problem}': {met} of {len(self.checks)} conditions met; print it)"
        )

    @property
    def passed(self) -> bool:
        """Whether every condition is met."""
        return all(check.passed for check in self.checks)

    def as_json(self) -> str:
        """The certificate as JSON; numbers that are not finite become strings."""
        checks = [
            {**asdict(check), "passed": check.passed, "value": _plain(check.value)}
            for check in self.checks
        ]
        content = {
            "problem": self.problem,
            "objective": _plain(self.objective),
            "verdict": self.verdict,
            "passed": self.passed,
            "checks": checks,
        }
        return json.dumps(content, indent=2, allow_nan=False)

    def __str__(self) -> str:
        head = f"{self.problem}: {self.objective:.10g}, {self.verdict}"
        foot = f"  {'certified' if self.passed else 'NOT certified'}"
        return "\n".join([head, *(f"  {check}" for check in self.checks), foot])


def _plain(value: float) -> float | str:
    return float(value) if np.isfinite(value) else str(float(value))


class Certifiable(Protocol):
    """What a certificate reads of a solution, see `ocp.Solution`."""

    @property
    def objective(self) -> float: ...

    @property
    def verdict(self) -> str: ...

    @property
    def trajectory(self) -> Trajectory: ...

    @property
    def form(self) -> Form: ...

    @property
    def form_evaluator(self) -> Evaluator: ...

    @property
    def kept_iterate(self) -> Iterate: ...

    @property
    def kept_multipliers(self) -> Multipliers: ...


def certify(solution: Certifiable, tolerances: Tolerances | None = None) -> Certificate:
    """Check a solution anew.

    Parameters
    ----------
    solution : Solution
    tolerances : Tolerances, optional
        What is allowed.

    Raises
    ------
    StatementError
        When it is no solution, or does not carry its multipliers.
    """
    if not hasattr(solution, "kept_iterate"):
        raise StatementError(f"certify checks a Solution, not {solution!r}; solve it first")

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
    evidence = Evidence(
        form=form,
        iterate=shown,
        multipliers=solution.kept_multipliers,
        scaled=all_multipliers(shown),
        evaluator=solution.form_evaluator,
    )

    allowed = tolerances or Tolerances()
    checks = (
        *motion_conditions(evidence, allowed),
        *program_conditions(evidence, allowed),
        curvature_condition(evidence, allowed),
        *optimality_conditions(evidence, allowed),
        *finer_mesh_conditions(evidence, allowed),
        *known_time_conditions(evidence, allowed),
        *step_conditions(evidence, allowed),
        *peak_conditions(evidence, allowed),
    )
    return Certificate(iterate.problem.name, solution.objective, solution.verdict, checks)
