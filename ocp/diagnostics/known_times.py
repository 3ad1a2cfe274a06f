"""What an answer that begins or ends at a known time would gain on the other side of it.

A program keeps the free ends of its phases between known times at which expressions step or bend.
Where an answer has an end at one of them, multipliers tell one side only, and no derivative tells
the other one. So the problem is solved there too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ocp.diagnostics.conditions import Condition, Evidence
from ocp.diagnostics.tolerances import Tolerances
from ocp.refinement.better_motions.across_known_times import (
    ends_at_known_times,
    other_sides,
    sides_of,
)
from ocp.refinement.mesh_solver import MeshSolver
from ocp.settings import Settings


def known_time_conditions(evidence: Evidence, allowed: Tolerances) -> Iterator[Condition]:
    """What each known time at which a phase begins or ends, though it need not, would gain."""
    iterate = evidence.iterate
    program, motion = iterate.transcription, iterate.trajectory
    if not ends_at_known_times(program, motion):
        return

    # neither the mesh nor the multipliers of the answer know of the other side: it is solved
    meshes = MeshSolver.of(
        iterate.problem, Settings(), iterate.parameters, evaluator=evidence.evaluator
    )
    for time, other, point, _ in other_sides(meshes, program, motion, {sides_of(program.mesh)}):
        result = meshes.solve(other, point, meshes.settings.solver)
        if result.outcome == "interrupted":
            raise KeyboardInterrupt

        gain, sentence = math.inf, "the problem could not be solved on the other side"
        if result.outcome == "infeasible":
            gain, sentence = 0.0, "no motion was found that is feasible on the other side"
        if result.outcome == "solved":
            sense = iterate.problem.sense
            found = sense * result.objective * other.scales.objective
            gain = max(sense * (iterate.objective - found), 0.0) / iterate.objective_size
            sentence = f"on the other side of it the objective is {found:.10g}"
        yield Condition(
            f"the known time {time:.6g} s",
            gain,
            allowed.gain,
            "a phase begins or ends at this time, at which an expression steps or bends, so that "
            f"the other side of it was solved, too: {sentence}",
        )
