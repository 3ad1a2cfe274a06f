"""How much a motion amplifies errors, and where a replay has to be restarted because of it.

The variational equation ``Phi' = df/dx Phi`` along the solution, with states in units of their
sizes, tells how an error made at one time grows until another.  A forward replay of a motion that
amplifies errors by more than `MOST` would measure round-off and tolerances times that factor
instead of the solution, so that it is cut into segments that amplify less (multiple shooting).
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.trajectory import PhaseTrajectory

Array = NDArray[np.float64]
MOST = 1e6
_PIECES = 4  # of an interval, in each of which df/dx is taken as constant
_TERMS = 13
_STEP = 1e-6  # of a state's size, in central differences


def transitions(rate: ca.Function, own: PhaseTrajectory, sizes: Array) -> Array:
    """Growth of a small error of the states over each interval, shape (N, n_x, n_x).

    Parameters
    ----------
    rate : ``(x, u, t) -> f``, where `u` are all signals but the states.
    sizes : (n_x,) of the states.
    """
    count, n_x = len(own.breakpoints) - 1, len(own.states)
    k = np.repeat(np.arange(count), _PIECES)
    tau = np.tile((np.arange(_PIECES) + 0.5) / _PIECES, count)
    steps = np.diff(own.breakpoints)[k]
    signals, times = own.local(k, tau), own.breakpoints[k] + tau * steps
    slopes = np.empty((k.size, n_x, n_x))
    for j in range(n_x):
        ends = []
        for sign in (1.0, -1.0):
            x = signals[:, :n_x].copy()
            x[:, j] += sign * _STEP * sizes[j]
            ends.append(rate(x.T, signals[:, n_x:].T, times[None, :]).full().T)
        slopes[:, :, j] = (ends[0] - ends[1]) / (2.0 * _STEP) / sizes
    slopes = np.nan_to_num(slopes * (steps / _PIECES)[:, None, None], posinf=0.0, neginf=0.0)
    parts = exponential(slopes).reshape(count, _PIECES, n_x, n_x)
    found = parts[:, 0]
    for i in range(1, _PIECES):
        found = parts[:, i] @ found
    return np.asarray(found)


def exponential(matrices: Array) -> Array:
    """Exponential of each matrix of a stack (m, n, n): halved often, a power series, squared back.

    The series of `_TERMS` terms is exact to rounding for norms up to 1/2; squaring loses a digit
    where the norm is about 10.  SciPy's function would take longer to load than the rest of `ocp`.
    """
    norm = float(np.abs(matrices).sum(axis=-1).max(initial=0.0))
    halvings = max(0, math.ceil(math.log2(max(norm, 1e-300))) + 1)
    small, unit = np.ldexp(matrices, -halvings), np.eye(matrices.shape[-1])
    found = np.broadcast_to(unit, matrices.shape)
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(_TERMS, 0, -1):
            found = unit + small @ found / k
        for _ in range(halvings):
            found = found @ found
    return np.asarray(found)


def growth(phi: Array) -> float:
    """Largest factor by which errors grow from the start to any time, or from any to the end."""
    forward = backward = np.eye(phi.shape[1])
    most = 1.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first, last in zip(phi, phi[::-1], strict=True):
            forward, backward = first @ forward, backward @ last
            most = max(most, *(_norm(m) for m in (forward, backward)))
    return most


def _norm(matrix: Array) -> float:
    return float(np.linalg.norm(matrix)) if np.isfinite(matrix).all() else np.inf


def segments(phi: Array, most: float = MOST) -> list[slice]:
    """Runs of intervals over which errors grow by no more than `most`: halved until they do."""

    def halved(first: int, last: int) -> list[slice]:
        if last - first <= 1 or growth(phi[first:last]) <= most:
            return [slice(first, last)]
        middle = (first + last) // 2
        return [*halved(first, middle), *halved(middle, last)]

    return halved(0, len(phi))
