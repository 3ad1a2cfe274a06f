"""The review for what is so narrow that the points of an answer do not see it."""

from __future__ import annotations

from ocp.estimates.missed_slopes import missed_slopes
from ocp.estimates.motion_errors import MotionErrors
from ocp.estimates.narrow_features import (
    NarrowFeature,
    mesh_that_sees,
    narrow_features,
)
from ocp.optimality.steps import steps_along
from ocp.problem.symbols import Constant
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.reviews.finding import Candidate, Found, Onward
from ocp.refinement.solved_mesh import VERIFIABLE_SLACK, SolvedMesh


def unseen_features(answer: Candidate) -> Found:
    """What is missed, and a mesh that sees it.

    What was solved before is no answer: it holds for a problem without that.
    """
    if not answer.meshes.settings.refinement.adapts:
        return Found()
    features, of_constants = features_of(answer.meshes, answer.best)
    unseen = (*features, *of_constants)
    if not unseen or _has_steps(answer):
        return Found(features=features)
    iterate = answer.best.iterate
    mesh = mesh_that_sees(iterate.fixed_mesh, unseen)
    return Found(Onward(iterate, mesh, former="none"), features)


def _has_steps(answer: Candidate) -> bool:
    """Whether something steps where the motion crosses it: no mesh resolves that, and it is told.

    A mesh that begins to resolve what is steep would hide it.
    """
    motion, evaluator = answer.best.iterate.trajectory, answer.meshes.evaluator
    return any(step.unseen for step in steps_along(answer.meshes.problem, motion, evaluator))


def features_of(
    meshes: MeshSolver, solved: SolvedMesh
) -> tuple[tuple[NarrowFeature, ...], tuple[NarrowFeature, ...]]:
    """What the points of a mesh do not see, and what sensitivities alone miss by that."""
    iterate, evaluator = solved.iterate, meshes.evaluator
    errors = solved.errors.of_motion or MotionErrors(
        iterate.transcription, iterate.trajectory, evaluator, iterate.parameters
    )
    allowed = VERIFIABLE_SLACK * meshes.settings.accuracy.dynamics
    slopes = list(missed_slopes(iterate, evaluator, allowed))
    moving = [slope.feature for slope in slopes if not isinstance(slope.symbol, Constant)]
    of_constants = [slope.feature for slope in slopes if isinstance(slope.symbol, Constant)]
    return (*narrow_features(errors, allowed), *moving), tuple(of_constants)
