"""The review for switches that breakpoints hold at wrong times."""

from __future__ import annotations

from ocp.refinement.better_motions.fresh_mesh import on_fresh_mesh
from ocp.refinement.policies.adaptive_mesh import AdaptiveMesh
from ocp.refinement.reviews.finding import Candidate, Found, Onward


def held_switches(answer: Candidate) -> Found:
    """A better motion on a mesh made anew, if there is one."""
    policy = answer.meshes.settings.refinement
    moves = isinstance(policy, AdaptiveMesh) and policy.move_breakpoints
    if not (moves and answer.is_settled):
        return Found()
    fresh = on_fresh_mesh(answer.meshes, answer.best.iterate, answer.history.rounds)
    if fresh is None:
        return Found()
    if fresh.better is None:
        return Found(timed=fresh.refutes)
    return Found(Onward(fresh.better, fresh.better.mesh, former="as good"))
