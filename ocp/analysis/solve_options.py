"""How all problems of an analysis are solved that solves more than one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ocp.algorithm import solve
from ocp.mesh.mesh import Mesh
from ocp.mesh.trajectory import Trajectory
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution


@dataclass(frozen=True, eq=False)
class SolveOptions:
    """What the solves of an analysis have in common; as the arguments of `ocp.solve`."""

    settings: Settings
    constants: Mapping[Constant, float]
    progress: Progress | bool | None

    def solved(
        self,
        problem: Problem,
        guess: Solution | Trajectory | None = None,
        mesh: Mesh | None = None,
        constants: Mapping[Constant, float] | None = None,
        **changed: Any,
    ) -> Solution:
        """`ocp.solve` from a guess and a mesh, with some constants and settings changed.

        Raises
        ------
        SolveFailed, Interrupted
            As `ocp.solve`.
        """
        return solve(
            problem,
            settings=replace(self.settings, **changed),
            guess=guess,
            mesh=mesh,
            constants={**self.constants, **(constants or {})},
            progress=self.progress,
            partial=False,
        )
