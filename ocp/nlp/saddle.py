"""Whether a stationary point is a saddle, and starts beside it.

At a minimum the objective curves upwards along all small changes that the constraints allow. At a
saddle the matrix of a Newton step has too many negative eigenvalues, and IPOPT adds curvature until
the step leads down (Waechter and Biegler 2006, section 3.1). So what it adds tells which of the two
a point is. At the saddle itself no step leads down, because the slope is zero. From a point beside
it a solver goes down.

A concave kink, as that of ``-|x|`` at 0, may seem stationary, too: CasADi takes the slope of a
modulus of zero to be zero. Beside such a point the Lagrangian falls at once.

At a degenerate saddle the objective has neither slope nor curvature, as ``-x**4`` or ``x y z`` at
0. Only values far beside the point tell whether it falls.
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

# The same beside a degenerate saddle, from near which the solver would come back.
_FAR_CHANGES = (0.1, 1.0)

# Of the way down from an inflection: near it all is as the linear system says, farther away the
# objective is far below.
_PARTS_OF_WAY = (0.1, 0.4)

# Scaled slope of the objective, and multipliers, up to which it is flat: what a solver leaves of
# zero. And its scaled fall beside such a point that counts.
_FLAT = 1e-7
_FALLEN = 1e-9

# Iterations within which the solver is back, or at a lower point. Most take thirty to fifty.
PATIENCE = 100

# The change where one step is made to see what is added. At the point itself IPOPT may stop before
# it makes any. Small pivots are not worth their speed where the signs of eigenvalues are asked for.
_BESIDE = 1e-8

# The scaled change by which a fall of the Lagrangian is measured: a smooth one hardly falls
_ASIDE = 1e-7
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


def fall_beside(
    program: Program, point: StartingPoint, limits: ProgramLimits, parameters: Array
) -> float:
    """How fast the Lagrangian falls from a stationary point to a side of it, per scaled change.

    It is next to 0 where the program is smooth, and negative at a convex kink, as that of ``|x|``.

    Parameters
    ----------
    point : StartingPoint
        With its multipliers.
    parameters : (n_p,)
        Values of the problem's constants.
    """
    _, on_rows = point.multipliers or (None, np.zeros(program.rows))
    change = _ASIDE * _direction(point.x.size)

    def lagrangian(x: Array) -> float:
        objective, rows = program.oracle(x, parameters)
        return float(objective) + float(on_rows @ np.array(rows).ravel())

    sides = (_beside(point, limits, sign * change) for sign in (1.0, -1.0))
    lowest = min(lagrangian(side.x) for side in sides)
    return (lagrangian(point.x) - lowest) / _ASIDE


def is_degenerate_saddle(
    program: Program, point: StartingPoint, limits: ProgramLimits, parameters: Array
) -> bool:
    """Whether the objective has neither slope nor curvature at a point, and is lower far beside it.

    At an optimum of zero, as of a sum of squares, it is flat and nowhere lower.

    Parameters
    ----------
    point : StartingPoint
        With its multipliers.
    parameters : (n_p,)
        Values of the problem's constants.
    """
    # a multiplier tells at once that something pulls, without an evaluation
    if any(_pulls(multipliers) for multipliers in point.multipliers or ()):
        return False
    objective, gradient = program.objective_gradient(point.x, parameters)
    if _pulls(np.array(gradient)):
        return False
    return any(
        float(program.oracle(start.x, parameters)[0]) < float(objective) - _FALLEN
        for pair in starts_beside(point, limits, degenerate=True)
        for start in pair
    )


def _pulls(slopes: Array) -> bool:
    """Whether one of some scaled slopes or multipliers is no zero that a solver left."""
    return float(np.abs(slopes).max(initial=0.0)) > _FLAT


def starts_beside(
    point: StartingPoint, limits: ProgramLimits, *, degenerate: bool = False
) -> Iterator[tuple[StartingPoint, StartingPoint]]:
    """Pairs of starts on both sides of a point, from which a solver leaves a saddle.

    They are the same in every run. From a degenerate saddle they have to be far.
    """
    random = np.random.default_rng(0)
    for size in _FAR_CHANGES if degenerate else _CHANGES:
        change = size * random.standard_normal(point.x.size)
        yield _beside(point, limits, change), _beside(point, limits, -change)


def starts_along(
    point: StartingPoint, limits: ProgramLimits, way: Array
) -> Iterator[tuple[StartingPoint]]:
    """Starts on the way down from an inflection, from where a solver does not come back."""
    for part in _PARTS_OF_WAY:
        yield (_beside(point, limits, part * way),)


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
