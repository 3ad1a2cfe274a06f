"""Whether a stationary point is a saddle, and starts beside it.

At a minimum the objective curves upwards along all small changes that the constraints allow. At a
saddle the matrix of a Newton step has too many negative eigenvalues, and IPOPT adds curvature until
the step leads down (Waechter and Biegler 2006, section 3.1). So what it adds tells which of the two
a point is. At the saddle itself no step leads down, because the slope is zero. From a point beside
it a solver goes down.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ocp.arrays import Array
from ocp.nlp.ipopt import Ipopt
from ocp.nlp.solver import NlpSolver, StartingPoint
from ocp.transcription.kernels import Program
from ocp.transcription.transcribe import ProgramLimits

# Random changes of scaled unknowns: small ones stay near, large ones get away where the objective
# curves little.
_CHANGES = (1e-3, 3e-2)

# Iterations within which the solver is back, or at a lower point. Most take thirty to fifty.
PATIENCE = 100

# The change where one step is made to see what is added. At the point itself IPOPT may stop before
# it makes any. Small pivots are not worth their speed where the signs of eigenvalues are asked for.
_BESIDE = 1e-8

_ONE_STEP = Ipopt(tolerance=1e-12, max_iterations=1, stall=0, pivot_tolerance=1e-3)


def added_curvature(
    program: Program, point: StartingPoint, limits: ProgramLimits, parameters: Array
) -> float:
    """What IPOPT adds to the Hessian of the Lagrangian for a step from a stationary point, scaled.

    It is 0 at a strict minimum and positive at a saddle. Where some change of the unknowns leaves
    the objective as it is, it may be either.

    Parameters
    ----------
    point : StartingPoint
        With its multipliers.
    parameters : (n_p,)
        Values of the problem's constants.

    Raises
    ------
    KeyboardInterrupt
        The user stopped it.
    """
    change = _BESIDE * _direction(point.x.size)
    step = _ONE_STEP.solve(program, _beside(point, limits, change), limits, parameters)
    if step.outcome == "interrupted":
        raise KeyboardInterrupt
    return step.added_curvature


def starts_beside(
    point: StartingPoint, limits: ProgramLimits
) -> Iterator[tuple[StartingPoint, StartingPoint]]:
    """Pairs of starts on both sides of a point, from which a solver leaves a saddle.

    They are the same in every run.
    """
    random = np.random.default_rng(0)
    for size in _CHANGES:
        change = size * random.standard_normal(point.x.size)
        yield _beside(point, limits, change), _beside(point, limits, -change)


def without_standstill(solver: NlpSolver) -> NlpSolver:
    """A solver that goes on where progress is slow, as it is beside a saddle."""
    return replace(solver, stall=0) if isinstance(solver, Ipopt) else solver


@lru_cache(maxsize=4)
def _direction(size: int) -> Array:
    """A random change of unknowns (size,), the same in every run."""
    return np.random.default_rng(0).standard_normal(size)


def _beside(point: StartingPoint, limits: ProgramLimits, change: Array) -> StartingPoint:
    """A point beside one; unknowns at a limit stay there."""
    lower, upper = limits.columns
    free = (point.x > lower) & (point.x < upper)
    return StartingPoint(np.clip(point.x + change * free, lower, upper), point.multipliers)
