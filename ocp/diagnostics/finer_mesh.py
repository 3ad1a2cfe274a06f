"""What a finer mesh gains, found by solving the problem on one.

The multipliers of Lobatto's, Simpson's and the trapezoidal scheme meet the minimum principle on any
mesh, so that they do not tell. Neither do the meshes of the solve: two of them may share the
intervals that are too long, and then agree whatever is lost there. So all intervals are cut.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ocp.diagnostics.conditions import Condition, Evidence
from ocp.diagnostics.tolerances import Tolerances
from ocp.mesh.mesh import cut_in_two
from ocp.refinement.mesh_solver import MeshSolver
from ocp.settings import Settings

# Where each interval is cut: by the golden section. Halves would have points where what oscillates
# in time takes the same values again.
_SHARE = (3.0 - math.sqrt(5.0)) / 2.0

# What is left of an error that is in proportion to the widths: a part of each error is the square
# of its interval's part.
_LEFT = _SHARE**2 + (1.0 - _SHARE) ** 2


def finer_mesh_conditions(evidence: Evidence, allowed: Tolerances) -> Iterator[Condition]:
    """How far the objective is from its limit on ever finer meshes, where multipliers do not tell.

    A problem without controls has nothing that a finer mesh could gain.
    """
    iterate = evidence.iterate
    if iterate.scheme.informative_multipliers or not any(iterate.problem.controls.values()):
        return
    meshes = MeshSolver.of(
        iterate.problem, Settings(), iterate.parameters, evaluator=evidence.evaluator
    )

    # what moves has found its place, and would hide by errors of the mesh what the cuts gain
    mesh = cut_in_two(iterate.fixed_mesh, _SHARE)
    program = meshes.next_program(iterate, mesh)
    result = meshes.solve(program, iterate, meshes.settings.solver)
    if result.outcome == "interrupted":
        raise KeyboardInterrupt

    error, sentence = math.inf, "the problem could not be solved on a mesh that is twice as fine"
    if result.outcome == "solved":
        finer = iterate.problem.sense * result.objective * program.scales.objective
        error = abs(iterate.objective - finer) / iterate.objective_size / (1.0 - _LEFT)
        sentence = (
            f"on a mesh that is twice as fine the objective is {finer:.10g}: by that it is off by "
            "this part, if its error falls like the intervals"
        )
    yield Condition("a finer mesh", error, allowed.gain, sentence)
