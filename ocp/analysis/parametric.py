"""The same nonlinear program for other constants, without building it again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ocp.algorithm import check_arguments, first_mesh, solve_from, start_from
from ocp.keywords import checked_keywords
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Evaluator, Trajectory
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress, shown
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.policies.policy import FixedMesh
from ocp.settings import Settings
from ocp.solution.solution import Solution
from ocp.transcription.transcribe import Transcription


@dataclass(frozen=True, eq=False, repr=False)
class Prepared:
    """A problem transcribed once, to be solved for many values of its constants.

    Whatever may differ between two solves (a number in the dynamics, a bound, a boundary value) is
    stated as a `Constant`; mesh and scales stay as they are.

    Attributes
    ----------
    problem : Problem
    settings : Settings
        With a mesh that stays.
    transcription : Transcription
        The nonlinear program of every solve.
    evaluator : Evaluator
        Of expressions of the problem, which it compiles once.
    """

    problem: Problem
    settings: Settings
    transcription: Transcription
    evaluator: Evaluator

    def __repr__(self) -> str:
        return f"Prepared('{self.problem.name}': {self.transcription.columns.count} unknowns)"

    @property
    def mesh(self) -> Mesh:
        """The mesh of every solve."""
        return self.transcription.mesh

    @checked_keywords()
    def solve(
        self,
        *,
        constants: Mapping[Constant, float] | None = None,
        guess: Solution | Trajectory | None = None,
        bound: float | None = None,
        progress: Progress | bool | None = None,
    ) -> Solution:
        """`ocp.solve` on this mesh, without refinement; a `guess` made here is a warm start.

        An answer that does not pass its verification is returned with the verdict "unverified".

        Parameters
        ----------
        constants, guess, bound, progress
            As of `ocp.solve`.

        Raises
        ------
        StatementError, SolveFailed, Interrupted
            As `ocp.solve`.
        """
        check_arguments(self.problem, self.settings, guess, self.mesh)
        parameters = parameters_of(self.problem, constants)
        start = start_from(self.problem, self.settings, guess)
        with shown(progress) as say:
            meshes = MeshSolver.of(
                self.problem, self.settings, parameters, say, self.transcription, self.evaluator
            )
            return solve_from(meshes, start, self.mesh, bound)


@checked_keywords()
def prepare(
    problem: Problem,
    *,
    settings: Settings | None = None,
    mesh: Mesh | None = None,
    guess: Solution | Trajectory | None = None,
    constants: Mapping[Constant, float] | None = None,
) -> Prepared:
    """Transcribe a problem once, to solve it for many values of its constants.

    Parameters
    ----------
    problem : Problem
    settings : Settings, optional
        Their refinement is left out: the mesh is fixed.
    mesh : Mesh, optional
        By default that of `guess` if it is a `Solution`, else a uniform one.
    guess, constants : optional
        What the scales are taken from; by default the statement. A solution of this problem lends
        its own program.

    Raises
    ------
    StatementError
        When the statement cannot be transcribed.
    """
    settings = Settings() if settings is None else settings
    check_arguments(problem, settings, guess, mesh)
    fixed = FixedMesh(highest_degree=settings.refinement.highest_degree)
    settings = replace(settings, refinement=fixed)

    if mesh is None:
        mesh = guess.mesh if isinstance(guess, Solution) else first_mesh(problem, settings)
    meshes = MeshSolver.of(problem, settings, parameters_of(problem, constants))
    program = meshes.first_program(start_from(problem, settings, guess), mesh)
    return Prepared(problem, settings, program, meshes.evaluator)
