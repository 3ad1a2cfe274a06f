"""A problem near a solved one: on the mesh of its neighbour, on one that follows its arcs, refined.

Each solve starts from the variables and the multipliers of its neighbour, on its mesh, whose
program is kept. Where arcs leave the intervals that were made for them, the next mesh has few
intervals, all of whose breakpoints move with the arcs. Where such a mesh fails, one that stays is
refined.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from ocp.accuracy import Accuracy
from ocp.algorithm import solve
from ocp.errors import SolveFailed, Unverified
from ocp.mesh.trajectory import Trajectory
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress
from ocp.refinement.policies.moving_mesh import MovingMesh, merged_mesh, moving_mesh
from ocp.refinement.policies.policy import FixedMesh
from ocp.settings import Settings
from ocp.solution.solution import Solution

# Of the range of a signal: what a breakpoint of a mesh that moves has to be worth
_MERGED = 5e-4
# On a mesh that moves, which converges soon or not at all
_MOVING_ITERATIONS = 500


@dataclass(frozen=True, eq=False)
class NeighbourSolver:
    """Solves problems of one statement near each other, each from the solution of the one before.

    Attributes
    ----------
    settings : Settings
        Of a mesh that is refined.
    kept : Accuracy
        Within which a solution is good enough: on the mesh of its neighbour, the estimated gain of
        finer controls and the violation of limits between the points; refined, the latter.
    progress : callable, optional
        As of `ocp.solve`.
    """

    settings: Settings
    kept: Accuracy
    progress: Progress | bool | None = None

    def near(
        self,
        problem: Problem,
        guess: Solution | Trajectory | None,
        constants: Mapping[Constant, float],
    ) -> Solution:
        """The solution from a neighbour's, or refined from another guess.

        Raises
        ------
        SolveFailed, Unverified, Interrupted
            As `ocp.solve`, of the mesh that was refined.
        """
        if not isinstance(guess, Solution):
            return self.refined(problem, guess, constants)
        follows = _moves(guess)
        if not follows:
            settings = replace(self.settings, refinement=FixedMesh(), accuracy=Accuracy())
            with suppress(SolveFailed):
                found = solve(
                    problem,
                    settings=settings,
                    constants=constants,
                    guess=guess,
                    progress=self.progress,
                    partial=False,
                )
                estimated = found.mesh_iterations[-1].gain
                if self._is_kept(found) and estimated <= self.kept.objective:
                    return found
                # a violation alone is soon removed; a gain says that arcs have left their intervals
                guess, follows = found, estimated > self.settings.accuracy.objective

        if follows:
            settings = replace(
                self.settings,
                refinement=MovingMesh(kept=self.kept),
                iterations=_MOVING_ITERATIONS,
            )
            with suppress(SolveFailed):
                return solve(
                    problem,
                    settings=settings,
                    constants=constants,
                    guess=guess,
                    mesh=moving_mesh(guess.kept_iterate, guess.evaluator, _MERGED),
                    progress=self.progress,
                    partial=False,
                )
        return self.refined(problem, guess, constants)

    def refined(
        self,
        problem: Problem,
        guess: Solution | Trajectory | None,
        constants: Mapping[Constant, float],
        accuracy: Accuracy | None = None,
    ) -> Solution:
        """The solution on a mesh that is refined, to the settings' accuracy or another one.

        What is exceeded by no more than `kept` allows is an answer.

        Raises
        ------
        SolveFailed, Unverified, Interrupted
            As `ocp.solve`.
        """
        mesh = None
        if isinstance(guess, Solution) and _moves(guess):
            mesh = merged_mesh(guess.kept_iterate, guess.evaluator, _MERGED)
        try:
            return solve(
                problem,
                settings=replace(self.settings, accuracy=accuracy or self.settings.accuracy),
                constants=constants,
                guess=guess,
                mesh=mesh,
                progress=self.progress,
                partial=False,
            )
        except Unverified as error:
            answer = error.iterate
            if isinstance(answer, Solution) and self._is_kept(answer):
                return answer
            raise

    def _is_kept(self, found: Solution) -> bool:
        return found.verification.excess <= self.kept.path


def _moves(solution: Solution) -> bool:
    """Whether the breakpoints of a solution's mesh move."""
    return any(phase.movable for phase in solution.mesh.phases)
