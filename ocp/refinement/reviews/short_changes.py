"""The review for other controls that are better for a short time, between two points."""

from __future__ import annotations

from ocp.estimates.other_controls.points_there import mesh_with_points_there
from ocp.estimates.other_controls.promise import other_controls, promised_by
from ocp.estimates.promised_gain import CERTIFIED_GAIN
from ocp.refinement.reviews.finding import Candidate, Found, Onward


def short_changes(answer: Candidate) -> Found:
    """Where controls of the answer's own valley are better, and a mesh with points there.

    As good an answer on a mesh without these points is none.
    """
    meshes, iterate = answer.meshes, answer.best.iterate
    if not (meshes.settings.refinement.adapts and answer.is_settled):
        return Found()
    others = list(other_controls(iterate, meshes.evaluator))
    nearby = [other for other in others if other.one_valley and not other.vanished]
    if not promised_by(nearby, iterate) > CERTIFIED_GAIN:
        return Found()
    names = [phase.name for phase in meshes.problem.phases]
    mesh = mesh_with_points_there(iterate.fixed_mesh, nearby, names)
    return Found(Onward(iterate, mesh, former="coarser"))
