"""The same nonlinear program for other constants, without building it again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.problem.statement import Problem
from ocp.problem.symbols import Constant
from ocp.refinement.loop import Progress, method_of
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.solve import constant_values, first_mesh, origin_of, solve_from
from ocp.transcription.transcribe import Transcription


@dataclass(frozen=True, eq=False)
class Prepared:
    """A problem transcribed once, to be solved for many values of its constants.

    Whatever may differ between two solves (a number in the dynamics, a bound, a boundary value) is
    stated as a `Constant`; mesh and scales stay as they are.
    """

    problem: Problem
    settings: Settings
    transcription: Transcription

    @property
    def mesh(self) -> Mesh:
        """The mesh of every solve."""
        return self.transcription.mesh

    def solve(
        self, *, constants: Mapping[Constant, float] | None = None,
        guess: Solution | Trajectory | None = None, bound: float | None = None,
        progress: Progress | None = None,
    ) -> Solution:  # fmt: skip
        """`ocp.solve` on this mesh, without refinement; a `guess` made here is a warm start.

        An answer that does not pass its verification is returned with the verdict "unverified".

        Raises
        ------
        StatementError, SolveFailed, Interrupted
            As `ocp.solve`.
        """
        origin = replace(origin_of(self.problem, self.settings, guess), built=self.transcription)
        return solve_from(
            origin, self.problem, self.settings, self.mesh, constants, bound, progress
        )


def prepare(
    problem: Problem, *, settings: Settings | None = None, mesh: Mesh | None = None,
    guess: Solution | Trajectory | None = None,
    constants: Mapping[Constant, float] | None = None,
) -> Prepared:  # fmt: skip
    """Transcribe a problem once, to solve it for many values of its constants.

    Parameters
    ----------
    mesh : Mesh, optional
        By default that of `guess` if it is a `Solution`, else a uniform one.
    guess, constants :
        What the scales are taken from; by default the statement.  A solution of this problem
        lends its own program.
    """
    settings = replace(settings or Settings(), refine=False)
    if mesh is None:
        mesh = guess.mesh if isinstance(guess, Solution) else first_mesh(problem, settings)
    origin = origin_of(problem, settings, guess)
    values = constant_values(problem, constants)
    made = origin.transcription(problem, mesh, method_of(settings), values, settings.compile)
    return Prepared(problem, settings, made)
