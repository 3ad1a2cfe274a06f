"""Peaks raised to what a motion has between its points.

A peak counts as the largest value at the points of its phase, and the motion may be higher between
them. Its own peak is no worse a motion: it meets all limits, and only its objective is a little
more than what was reported. Where points would have to chase such violations over many large
programs, the peaks are raised instead, as long as that costs no more than what is open anyway.
"""

from __future__ import annotations

from dataclasses import replace

from ocp.accuracy import Accuracy
from ocp.estimates.error_estimate import estimate_errors
from ocp.estimates.estimated_gain import is_affordable
from ocp.problem.functionals import Peak
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.solved_mesh import SolvedMesh
from ocp.transcription.kernels import evaluated
from ocp.transcription.packing import trajectory_of

# What a peak is raised by beyond its excess, relative to that: rounding of the maximum.
_AMPLE = 1.0 + 1e-6


def with_raised_peaks(
    meshes: MeshSolver, solved: SolvedMesh, accuracy: Accuracy
) -> SolvedMesh | None:
    """A solved mesh with its peaks raised; None where none is exceeded or that costs too much.

    The cost counts as an estimated gain of a finer mesh.
    """
    iterate = solved.iterate
    excess = _excess_of_peaks(solved)
    if not excess or solved.errors.dynamics > accuracy.dynamics:
        return None

    program, columns = iterate.transcription.program, iterate.transcription.columns
    x = iterate.x.copy()
    for peak, above in excess.items():
        x[columns.peaks[peak]] += _AMPLE * above / columns.sizes[columns.peaks[peak]]
    value, rows = evaluated(program.blocks, x, iterate.parameters.vector, program.rows)
    objective = iterate.problem.sense * float(value) * iterate.scales.objective
    cost = abs(objective - iterate.objective) / iterate.objective_size
    violation = float(iterate.limits.excess(rows).max(initial=0.0))
    # another limit may hold the peak down
    if violation > accuracy.path or not is_affordable(cost, solved.errors.gain):
        return None

    raised = replace(
        iterate,
        x=x,
        objective=objective,
        trajectory=trajectory_of(iterate.transcription, x, iterate.parameters),
        built=iterate.transcription,
    )
    errors = estimate_errors(raised, meshes.evaluator, accuracy)
    return replace(
        solved,
        iterate=raised,
        errors=replace(errors, gain=errors.gain + cost),
        violation=violation,
        raised=cost,
    )


def _excess_of_peaks(solved: SolvedMesh) -> dict[Peak, float]:
    """How far the motion is above its peaks between the points [unit of the peak]."""
    found: dict[Peak, float] = {}
    constraints = solved.iterate.transcription.constraints
    for of_phase, errors in zip(constraints, solved.errors.phases, strict=True):
        for constraint, extremes in zip(of_phase, errors.excess, strict=True):
            above = float(extremes.values.max()) * extremes.size
            if constraint.peak is not None and above > found.get(constraint.peak, 0.0):
                found[constraint.peak] = above
    return found
