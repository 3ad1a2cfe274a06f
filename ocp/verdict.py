"""The verdict of a verified answer: what it is the best of, and what is open or may be better.

It is one line of words, the first of which say how far the answer was compared: ``local: best of 6
starts``, or ``global`` where a proven bound is met. Then follow remarks on what the solve has seen
itself. What only a diagnostic tells is not claimed: a local answer ends with the words that it is
not confirmed.
"""

from __future__ import annotations

from collections.abc import Iterator

from ocp.arrays import TINY
from ocp.estimates.estimated_gain import CERTIFIED_GAIN
from ocp.mesh.algebraic_equations import taken_algebraics
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.refine import Refinement
from ocp.refinement.solved_mesh import CUT_SHORT
from ocp.verification.verify import NOT_CONFIRMED, Verification

# Part of a proven bound by which a value that meets it may be off: bounds that are computed are not
# better themselves.
BOUND_MET = 1e-5


def verdict_on(
    meshes: MeshSolver, refinement: Refinement, checked: Verification, bound: float | None
) -> str:
    """The verdict of an answer that passed its verification, or whose solve was cut short.

    Parameters
    ----------
    checked : Verification
        Of the answer.
    bound : float or None
        A proven bound of the optimum [unit of the objective].
    """
    parts = [_compared(meshes, refinement, bound), *_remarks(meshes, refinement)]
    if checked.one_run > meshes.settings.accuracy.replay >= checked.miss:
        parts.append(
            f"the error from node to node is {checked.miss:.1e}; the error of a single run at the "
            f"end is {checked.one_run:.1e} (errors grow by a factor of "
            f"{checked.amplification:.0f}): control this motion with feedback"
        )
    if refinement.ending in CUT_SHORT:
        parts.insert(1, f"accurate to {checked.accuracy:.1e}")
    # what meets a proven bound needs no second opinion
    if not is_global(parts[0]):
        parts.append(NOT_CONFIRMED)
    return "; ".join(parts)


def _compared(meshes: MeshSolver, refinement: Refinement, bound: float | None) -> str:
    """What the answer is the best of."""
    entry = max(refinement.mesh_iterations, key=lambda entry: entry.starts)
    answers = max(entry.starts - entry.lost, 1)
    verdict = f"local: best of {answers} start{'s' if answers > 1 else ''}"
    if answers < entry.starts:
        verdict += f" ({entry.starts - answers} more failed)"
    if bound is None:
        return verdict

    value, sense = refinement.best.iterate.objective, meshes.problem.sense
    allowed = max(meshes.settings.accuracy.objective, BOUND_MET)
    return with_bound(verdict, value, bound, sense, allowed)


def _remarks(meshes: MeshSolver, refinement: Refinement) -> Iterator[str]:
    """Sentences on what is open, though the answer is verified."""
    if shortfall := _shortfall(meshes, refinement):
        yield shortfall
    if refinement.best.raised:
        yield (
            "the reported peaks include the overshoot between the points of the mesh, which is "
            f"{refinement.best.raised:.0e} of the objective"
        )
    if taken := taken_algebraics(refinement.best.iterate.trajectory, meshes.evaluator):
        names = ", ".join(f"'{name}'" for name in taken)
        yield (
            f"the replay takes {names} from the solution, because no equations of the phase "
            "determine these values between the points: give as many equations as algebraic "
            "variables, each with one of them"
        )


def _shortfall(meshes: MeshSolver, refinement: Refinement) -> str:
    """Why the refinement ended short of its tolerances, and which they are, if it did."""
    gain, count = refinement.best.errors.gain, len(refinement.mesh_iterations)
    if not meshes.settings.refinement.adapts:
        # it may be coarse on purpose, but what that costs should be known
        if not meshes.settings.scheme.informative_multipliers:
            return "the mesh is fixed, and this scheme gives no estimate of a finer one"
        coarse = gain > CERTIFIED_GAIN
        return f"the mesh is fixed, and a finer one may improve it by {gain:.0e}" if coarse else ""
    endings = {
        "tolerances": "",
        "standstill": "no finer mesh improved it",
        "mesh iterations": f"refinement ended after {count} mesh iterations",
        "failure": "refinement ended after a mesh that failed",
        "budget": f"refinement ended at the budget of {meshes.budget}",
        "cost": "further meshes would take much time for a small improvement",
        "interrupted": "you stopped the refinement",
    }
    ending, best, accuracy = endings[refinement.ending], refinement.best, meshes.settings.accuracy

    open_tolerances = [
        f"{what} are met to {value:.1e} (tolerance {allowed:.0e})"
        for what, value, allowed in (
            ("the constraints", best.excess, accuracy.path),
            ("the dynamics", best.errors.dynamics, accuracy.dynamics),
        )
        if value > allowed
    ]
    # refuted by a finer mesh or not, the estimated gain is stated
    if best.errors.gain > accuracy.objective:
        open_tolerances.append(f"finer controls may improve it by {best.errors.gain:.0e}")
    # without such an estimate a standstill says nothing of a finer mesh
    if ending and not meshes.settings.scheme.informative_multipliers:
        open_tolerances.append("this scheme gives no estimate of a finer one")
    return ": ".join(part for part in (ending, "; ".join(open_tolerances)) if part)


def with_bound(verdict: str, value: float, bound: float, sense: float, allowed: float) -> str:
    """A verdict on a value for which there is a proven bound: global if it meets that.

    Parameters
    ----------
    value, bound : float
        [unit of the objective]
    sense : float
        Of the problem: 1 where it is minimised, -1 where it is maximised.
    allowed : float
        Part of the bound by which a value that meets it may be off.
    """
    # only zero meets a bound of zero
    gap = sense * (value - bound) / max(abs(bound), TINY)
    if abs(gap) <= allowed:
        return f"global: bound met (gap {abs(gap):.1e})"
    if gap < 0:
        verdict += f"; the bound of {bound:.6g} is refuted by {value:.6g}"
    return verdict


def is_global(verdict: str) -> bool:
    """Whether a verdict says that a proven bound is met."""
    return verdict.startswith("global")
