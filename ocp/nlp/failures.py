"""Failed solves, in the user's words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocp.errors import (
    Collapsed,
    Infeasible,
    InvalidNumber,
    IterationLimit,
    NumericalTrouble,
    Overdetermined,
    SolveFailed,
    Unbounded,
)
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.ipopt import NlpResult
from ocp.transcription.kernels import RowName
from ocp.transcription.transcribe import Transcription

Array = NDArray[np.float64]
_NO_TIME = 1e-6  # of the guessed duration, below which a motion takes no time
_RUNAWAY = 1e7  # typical sizes of the objective, beyond which it counts as unbounded


@dataclass(frozen=True)
class Violation:
    """One violated row: what it is, by how much of its typical size, and the sign of it."""

    row: RowName
    amount: float

    def words(self, iterate: Trajectory) -> str:
        """The row with its phase, its time in the iterate, and the amount in its unit."""
        row = self.row
        text = row.what
        if row.phase:
            text += f" in phase '{row.phase}'"
        if row.at is not None:
            own = iterate.phase(row.phase)
            text += f" at {own.start + row.at * (own.end - own.start):.3g} s"
        unit = "" if row.unit in ("", "1") else f" {row.unit}"
        return f"{text} is off by {self.amount * row.size:.3g}{unit}"


def violations(
    transcription: Transcription, rows: Array, limits: tuple[Array, Array], most: int = 3
) -> list[Violation]:
    """The worst violated rows relative to their sizes, one a kind."""
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
    iterate: Trajectory,
) -> SolveFailed:  # fmt: skip
    """The error that a failed solve raises, naming its worst constraints."""
    name, count = transcription.problem.name, result.iterations
    if result.outcome == "invalid number":
        from ocp.nlp.non_finite import undefined

        found = undefined(transcription.problem, iterate)
        what = found or "a derivative of the problem is NaN or infinite"
        return InvalidNumber(
            f"'{name}': {what}; start from a guess where everything is finite, or bound the "
            "signals that lead there", iterate)  # fmt: skip
    if result.outcome == "unbounded" or abs(result.objective) > _RUNAWAY:
        value = transcription.problem.sense * result.objective * transcription.scales.objective
        return Unbounded(
            f"the objective of '{name}' ran away to {value:.1e} in {count} iterations: it seems "
            "unbounded; bound what it depends on", iterate)  # fmt: skip
    worst = violations(transcription, result.rows, limits)
    listed = "; ".join(v.words(iterate) for v in worst)
    if result.outcome == "budget":
        return IterationLimit(
            f"'{name}' used up its budget of iterations or seconds after {count} "
            f"iterations{' (' + listed + ')' if worst else ''}; raise the budget, give a better "
            "guess or check the scales", iterate)  # fmt: skip
    free, equations = _counted(transcription, limits, iterate)
    if result.outcome == "overdetermined" or (result.outcome == "infeasible" and equations > free):
        return Overdetermined(
            f"'{name}' has {equations} equations for {free} free unknowns on its mesh"
            f"{' and meets not all of them (' + listed + ')' if worst else ''}: more is "
            "prescribed than the controls and unknowns can bring about; take back a boundary "
            "value, a link or an equation, or add a control", iterate)  # fmt: skip
    if result.outcome == "infeasible" and worst:
        return Infeasible(
            f"no motion was found that meets all constraints of '{name}'; worst: {listed}; "
            f"{_remedy(worst)} or start from another guess; ocp.relaxed(problem) finds the "
            "smallest relaxation", iterate)  # fmt: skip
    return NumericalTrouble(
        f"IPOPT got into numerical trouble on '{name}' after {count} iterations "
        f"('{result.status}'), {'with ' + listed if worst else 'all constraints met'}; state "
        "sizes by `scale`, give a better guess, or bound what the objective depends on",
        iterate)  # fmt: skip


def _remedy(worst: list[Violation]) -> str:
    """What the user can change about rows that cannot be met."""
    if worst[0].row.what.startswith("dynamics"):
        return "nothing within the limits joins the prescribed values: relax one of them or a limit"
    return "relax one of these"


def _counted(
    transcription: Transcription, limits: tuple[Array, Array], iterate: Trajectory
) -> tuple[int, int]:
    """Numbers of free unknowns and of equations."""
    lower, upper = transcription.columns.evaluate(iterate.constants)
    return int((lower < upper).sum()), int((limits[0] == limits[1]).sum())


def collapsed(transcription: Transcription, trajectory: Trajectory) -> Collapsed | None:
    """The error of a motion that takes no time, or None."""
    duration = sum(own.end - own.start for own in trajectory.phases)
    if duration > _NO_TIME * transcription.scales.time:
        return None
    return Collapsed(
        f"the motion of '{transcription.problem.name}' shrinks to {duration:.1e} s: nothing in "
        "the statement needs time; prescribe where the motion ends, or a least duration",
        trajectory)  # fmt: skip
