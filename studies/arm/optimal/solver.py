"""Meshes and solver settings of the arm's problems: all that is asked of the engine's inside.

The smoothest torque bends evenly. Every other optimum turns its torque quickly at start, middle
and end; even meshes, however fine, did not resolve the fast modes there, and their optima of energy
were too high.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ocp import FixedMesh, Ipopt, Mesh, Radau, Settings
from ocp.mesh.mesh import PhaseMesh, uniform
from studies.arm.optimal.objectives import StatedMotion
from studies.arm.search_limits import ITERATIONS, ROBUST_ITERATIONS, Barrier

DEGREE = 4
PIVOTS = 1e-2  # of the linear solver: with its default the stiff modes spoil every step
# Of the optimality conditions, whose multipliers the stiff modes make large. The sum of all
# complementary products estimates what an optimum may still gain: about 1e-5 of it on the first
# meshes, more on finer ones, where 1e-2 is told.
_STATIONARITY, _PRODUCT = 1e-4, 1e-8
# Of the rows in their scales: stiff modes' forces are differences of large terms, whose rounding
# alone leaves up to 6e-9. What is asked for below that is never met.
_VIOLATION = 1e-8
_GRADING = 0.9


def mesh_of(stated: StatedMotion, intervals: Sequence[int]) -> Mesh:
    """Meshes of all phases; even where nothing turns a torque at once, neither goal nor cap."""
    calm = stated.objective == "smoothest" and not stated.capped
    turning = () if calm else tuple(arm.phase.name for arm in stated.arms)
    return Mesh(
        tuple(
            graded(count) if phase.name in turning else uniform(count, DEGREE)
            for phase, count in zip(stated.problem.phases, intervals, strict=True)
        )
    )


def graded(intervals: int) -> PhaseMesh:
    """A mesh ten times finer at start, middle and end, x = s - a sin(4 pi s) / (4 pi)."""
    s = np.linspace(0.0, 1.0, intervals + 1)
    x = s - _GRADING * np.sin(4 * np.pi * s) / (4 * np.pi)
    # the ends are exact: rounding would leave a gap to the phase's ends
    return PhaseMesh(np.array([0.0, *x[1:-1], 1.0]), np.array([DEGREE]))


def settings(barrier: Barrier) -> Settings:
    """For stiff elastic modes; the mesh is stated beside, the study verifies by its own replays."""
    solver = Ipopt(
        tolerance=_STATIONARITY,
        dual_tolerance=_STATIONARITY,
        constraint_violation=_VIOLATION,
        complementarity=_PRODUCT,
        max_iterations=ITERATIONS,
        barrier=barrier,
        pivot_tolerance=PIVOTS,
        stall=0,  # nothing is looser than this
    )
    return Settings(scheme=Radau(DEGREE), refinement=FixedMesh(), solver=solver, verify=False)


def robust_settings() -> Settings:
    """For many arms at once, whose optima are flat: looser than for one."""
    solver = Ipopt(
        tolerance=1e-7,
        dual_tolerance=1e-4,
        constraint_violation=1e-9,
        max_iterations=ROBUST_ITERATIONS,
        pivot_tolerance=PIVOTS,
    )
    return Settings(scheme=Radau(DEGREE), refinement=FixedMesh(), solver=solver, verify=False)
