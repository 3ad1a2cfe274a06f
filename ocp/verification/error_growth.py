"""How much a motion amplifies errors, and where a replay has to be restarted because of it.

The variational equation ``Phi' = df/dx Phi`` along the solution tells how an error made at one time
grows until another. States are in units of their sizes. A forward replay of a motion that amplifies
errors by more than `MOST` would measure round-off and tolerances times that factor instead of the
solution. It is therefore cut into segments that amplify less (multiple shooting).
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import PhaseTrajectory

# Factor by which a segment may amplify errors. Beyond it the errors of the replay's own steps of
# 1e-11 would fill ten times the tolerance of 1e-6 for the missed end.
MOST = 1e6

# Parts of an interval in each of which df/dx is taken as constant. The growth is asked for its
# order of magnitude, not for its digits.
_PARTS = 4

# Terms of the exponential's power series, exact to rounding for norms up to 1/2: 0.5^14 / 14! < eps
_TERMS = 13


def transitions(rate: ca.Function, phase: PhaseTrajectory, sizes: Array) -> Array:
    """Growth of a small error of the states over each interval, shape (N, n_x, n_x).

    Parameters
    ----------
    rate : casadi.Function
        ``(x, u, t) -> f``, where `u` are all signals but the states.
    sizes : (n_x,)
        Typical sizes of the states.
    """
    count, n_x = phase.intervals, len(sizes)
    intervals = np.repeat(np.arange(count), _PARTS)
    tau = np.tile((np.arange(_PARTS) + 0.5) / _PARTS, count)
    steps = np.diff(phase.breakpoints)[intervals]
    signals, times = phase.local(intervals, tau), phase.breakpoints[intervals] + tau * steps

    # CasADi puts the Jacobians of all instants side by side
    jacobian = _state_jacobian(rate)
    slopes = jacobian(signals[:, :n_x].T, signals[:, n_x:].T, times[None, :]).full()
    slopes = slopes.reshape(n_x, intervals.size, n_x).transpose(1, 0, 2) * sizes / sizes[:, None]

    # at an instant without a derivative, such as a corner of the model, nothing is known of growth
    exponents = slopes * (steps / _PARTS)[:, None, None]
    exponents = np.nan_to_num(exponents, posinf=0.0, neginf=0.0)
    parts = exponential(exponents).reshape(count, _PARTS, n_x, n_x)
    product = parts[:, 0]
    for part in range(1, _PARTS):
        product = parts[:, part] @ product
    return np.asarray(product)


def _state_jacobian(rate: ca.Function) -> ca.Function:
    """``(x, u, t) -> df/dx``, dense."""
    x, u, t = (ca.SX.sym(name, rate.sparsity_in(i)) for i, name in enumerate("xut"))
    return ca.Function("slope", [x, u, t], ca.cse([ca.densify(ca.jacobian(rate(x, u, t), x))]))


def exponential(matrices: Array) -> Array:
    """Exponential of each matrix of a stack (m, n, n).

    The matrix is halved often, put into a power series and squared back. Squaring loses a digit
    where the norm is about 10. `scipy.linalg.expm` does the same more finely, but loading it takes
    longer than loading all of `ocp`, and every verified solve would have to.
    """
    norm = float(np.abs(matrices).sum(axis=-1).max(initial=0.0))
    halvings = max(0, math.ceil(math.log2(max(norm, 1e-300))) + 1)
    small, unit = np.ldexp(matrices, -halvings), np.eye(matrices.shape[-1])

    powers = np.broadcast_to(unit, matrices.shape)
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(_TERMS, 0, -1):
            powers = unit + small @ powers / k
        for _ in range(halvings):
            powers = powers @ powers
    return np.asarray(powers)


def growth(transition: Array) -> float:
    """Largest factor by which errors grow from the start to any time, or from any to the end.

    Parameters
    ----------
    transition : (N, n_x, n_x)
        Of the intervals, see `transitions`.
    """
    forward = backward = np.eye(transition.shape[1])
    most = 1.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first, last in zip(transition, transition[::-1], strict=True):
            forward, backward = first @ forward, backward @ last
            most = max(most, _norm(forward), _norm(backward))
    return most


def _norm(matrix: Array) -> float:
    return float(np.linalg.norm(matrix)) if np.isfinite(matrix).all() else np.inf


def segments(transition: Array, most: float = MOST) -> list[slice]:
    """Runs of intervals over which errors grow by no more than `most`: halved until they do."""

    def halved(first: int, last: int) -> list[slice]:
        if last - first <= 1 or growth(transition[first:last]) <= most:
            return [slice(first, last)]
        middle = (first + last) // 2
        return [*halved(first, middle), *halved(middle, last)]

    return halved(0, len(transition))
