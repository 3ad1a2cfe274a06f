"""The conditions of a certificate on the nonlinear program: that a point is its optimum.

They are those of first order by Karush, Kuhn and Tucker. What is stationary and no minimum, a
second solve leaves (`ocp.diagnostics.second_solve`).
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.diagnostics.diagnostic import Evidence, Finding
from ocp.optimality.active_set import limit_distances
from ocp.optimality.iterate import Iterate


def program_conditions(answer: Evidence) -> Iterator[Finding]:
    """First-order conditions of the nonlinear program (Karush, Kuhn and Tucker)."""
    iterate, multipliers, allowed = answer.iterate, answer.scaled, answer.allowed
    distances = limit_distances(iterate)

    yield Finding(
        "constraint residuals",
        distances.violation,
        allowed.feasible,
        "the largest violation of a row or bound of the program, scaled",
    )
    yield Finding(
        "effect of the residuals",
        _effect_of_residuals(iterate, multipliers),
        allowed.objective,
        "residuals of all rows and bounds, times their multipliers: a first-order change of the "
        "objective",
    )
    yield Finding(
        "stationarity",
        float(_lagrangian_slope(iterate, multipliers).max()),
        allowed.stationary,
        "the largest slope of the scaled Lagrangian",
    )

    # a multiplier at a side without a limit counts by its own size, one of an equation not at all:
    # its sign is free, and its residual is tested above
    with np.errstate(invalid="ignore"):
        distance = np.where(multipliers > 0, distances.upper, distances.lower)
        products = np.where(multipliers == 0, 0.0, np.abs(multipliers * distance))
    products = np.where(np.isfinite(products), products, np.abs(multipliers))
    limits = iterate.limits
    equations = [lower == upper for lower, upper in (limits.rows, limits.columns)]
    products[np.concatenate(equations)] = 0.0
    yield Finding(
        "complementarity",
        float(products.max(initial=0.0)),
        allowed.complementary,
        "the largest product of an inequality's multiplier and the distance to its limit",
    )


def _effect_of_residuals(iterate: Iterate, multipliers: Array) -> float:
    """What violations of the program change of the objective, to first order, relative.

    A square that is to be zero is met to the tolerance where its root is far from zero, and has a
    multiplier that is as large.
    """
    values = np.concatenate([iterate.rows, iterate.x])
    lower, upper = np.hstack([iterate.limits.rows, iterate.limits.columns])
    beyond = values - np.clip(values, lower, upper)
    effect = abs(float(multipliers @ beyond)) * iterate.scales.objective
    return effect / iterate.objective_size


def _lagrangian_slope(iterate: Iterate, multipliers: Array) -> Array:
    """Size of the scaled Lagrangian's slope by each unknown, (n,)."""
    program, constants = iterate.transcription.program, iterate.parameters.vector
    gradient = program.objective_gradient(iterate.x, constants)[1]
    jacobian = program.constraint_jacobian(iterate.x, constants)[1]
    of_rows, of_bounds = np.split(multipliers, [iterate.row_multipliers.size])
    slope = ca.vec(gradient) + ca.mtimes(jacobian.T, ca.DM(of_rows)) + ca.DM(of_bounds)
    return np.abs(np.array(slope)).ravel()
