"""Failed solves, in the user's words."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.errors import Infeasible, InvalidNumber, IterationLimit, SolveFailed
from ocp.ipopt import NlpResult
from ocp.transcribe import Transcription

Array = NDArray[np.float64]
_RUNAWAY = 1e7


@dataclass(frozen=True)
class Violation:
    """One violated row: what it is and by how much, relative to its scale."""

    what: str
    amount: float


def violations(
    transcription: Transcription, rows: Array, limits: tuple[Array, Array], most: int = 3
) -> list[Violation]:
    """The worst violated rows, one a kind."""
    excess = np.maximum(np.maximum(rows - limits[1], limits[0] - rows), 0.0)
    excess = np.where(np.isfinite(excess), excess, np.inf)
    found: list[Violation] = []
    for block in transcription.blocks:
        if block.rows.size == 0:
            continue
        own = excess[block.rows]
        for row in range(own.shape[1]):
            worst = int(np.argmax(own[:, row]))
            if own[worst, row] > 1e-7:
                found.append(Violation(block.label(worst, row), float(own[worst, row])))
    return sorted(found, key=lambda v: -v.amount)[:most]


def failure(
    transcription: Transcription, result: NlpResult, limits: tuple[Array, Array],
    constants: Array, iterate: object,
) -> SolveFailed:  # fmt: skip
    """The error that a failed solve raises, naming its worst constraints."""
    name = transcription.problem.name
    if result.outcome == "invalid number":
        return InvalidNumber(
            f"'{name}': {_invalid(transcription, result.x, constants)}; start from a guess "
            "where everything is finite, or bound the signals that lead there", iterate
        )  # fmt: skip
    if result.outcome == "unbounded" or abs(result.objective) > _RUNAWAY:
        return SolveFailed(
            f"the objective of '{name}' ran away to {result.objective:.1e} times its typical "
            f"size in {result.iterations} iterations: it seems unbounded; bound what it depends "
            "on", iterate
        )  # fmt: skip
    worst = violations(transcription, result.rows, limits)
    listed = "; ".join(f"{v.what} is off by {v.amount:.3g} of its size" for v in worst)
    if result.outcome == "budget":
        return IterationLimit(
            f"'{name}' used up its budget of iterations or seconds after {result.iterations} "
            f"iterations{' (' + listed + ')' if worst else ''}; raise the budget, give a better "
            "guess or check the scales", iterate)  # fmt: skip
    if worst:
        return Infeasible(
            f"no motion was found that meets all constraints of '{name}'; worst: {listed}; "
            "relax one of these or start from another guess", iterate)  # fmt: skip
    return SolveFailed(
        f"IPOPT stopped on '{name}' with '{result.status}' after {result.iterations} iterations "
        "although the constraints are met; the objective may be unbounded: bound what it "
        "minimises, or give a better guess or scales", iterate)  # fmt: skip


def _invalid(transcription: Transcription, x: Array, constants: Array) -> str:
    """The first expression that is not finite, and the values it was evaluated at."""
    for block in transcription.blocks:
        if block.count == 0:
            continue
        w, d = x[block.columns].T, block.data.T
        f, g = block.kernel.map(block.count, [False, False, True])(w, d, ca.DM(constants))
        g = np.array(g).reshape(-1, block.count, order="F") if block.rows.size else np.empty((0, 1))
        bad = np.argwhere(~np.isfinite(g))
        if bad.size:
            row, instance = bad[0]
            return f"{block.label(int(instance), int(row))} is NaN or infinite"
        if not np.all(np.isfinite(np.array(f))):
            return f"the objective is NaN or infinite in '{block.name}'"
    return "a derivative of the problem is NaN or infinite"
