"""What a stopped solve had reached, as a solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ocp.algorithm import solve
from ocp.errors import BudgetSpent, Interrupted, OcpError
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.mesh.trajectory import Trajectory
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant
from ocp.progress import Progress
from ocp.refinement.policies.policy import FixedMesh
from ocp.settings import Settings
from ocp.solution.solution import Solution

_SECONDS = 20.0  # whoever has stopped a solve does not wait for longer


def rescued(
    problem: Problem,
    stop: Interrupted | BudgetSpent,
    *,
    settings: Settings | None = None,
    constants: Mapping[Constant, float] | None = None,
    progress: Progress | bool | None = None,
) -> Solution | None:
    """The best mesh iteration of a stopped solve, solved once more on its own mesh and verified.

    It is one mesh, from its own solution: what takes longer than 20 s is given up.

    Parameters
    ----------
    problem : Problem
        The one that was solved.
    stop : Interrupted or BudgetSpent
        The error of that solve.
    settings, constants, progress : optional
        As they were given to `ocp.solve`.

    Returns
    -------
    Solution or None
        None if no mesh iteration was finished, or if it fails now.  Its mesh was on the way to a
        finer one: the verdict says whether it passed its verification.

    Raises
    ------
    Interrupted
        When the user stops this too.
    """
    reached = getattr(stop, "verified", None) or stop.finished
    if not isinstance(reached, Trajectory):
        return None
    mesh = Mesh(tuple(PhaseMesh(phase.fractions, phase.degrees) for phase in reached.phases))
    settings = settings or Settings()
    fixed = FixedMesh(highest_degree=settings.refinement.highest_degree)
    try:
        return solve(
            problem,
            settings=replace(settings, refinement=fixed, seconds=_SECONDS),
            guess=reached,
            mesh=mesh,
            constants=constants,
            progress=progress,
        )
    except Interrupted:
        raise
    except OcpError:
        return None
