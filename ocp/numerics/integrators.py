"""The two integrators of the replay, which share nothing with collocation.

Where dynamics are stiff they are backward differences, implicit. An explicit step must be shorter
than the fastest decay, however smooth the motion is. Backward differences (orders 1 to 5, Newton's
method with the exact Jacobian) need not be. They are those of CVODES, which comes with CasADi and
chooses its steps and orders itself. Source: Hindmarsh et al., "SUNDIALS: suite of nonlinear and
differential/algebraic equation solvers", ACM Transactions on Mathematical Software 31, 2005.

Elsewhere they are extrapolated modified midpoint steps (Gragg, Bulirsch, Stoer): it is explicit, of
order 8, and has its own error estimate. Source: Hairer, Norsett, Wanner, "Solving Ordinary
Differential Equations I", section II.9.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array

# Midpoint substeps of the rows of the extrapolation table. The harmonic sequence of even numbers
# needs the fewest evaluations for its order, two for each row.
SUBSTEPS = (2, 4, 6, 8)

# Instructions beyond which a rate is called and not written out in every substep, because
# building the step would take longer than the calls
_LONG = 2000


def extrapolated_step(rate: Callable[[Any, Any], Any], x: Any, span: Any) -> tuple[Any, Any]:
    """One step from local time 0 to `span` of ``x' = rate(x, tau)``.

    Parameters
    ----------
    rate : callable
        Takes a state (n_x, 1) and a local time, and returns the derivative by local time (n_x, 1).

    Returns
    -------
    end : (n_x, 1)
        The state at the end, of order ``2 * len(SUBSTEPS)``.
    error : (n_x, 1)
        Its difference to the value of two orders less.
    """
    row: list[Any] = []
    for j, count in enumerate(SUBSTEPS):
        above, row = row, [_midpoint(rate, x, span, count)]

        # the error of the midpoint rule has even powers of the step only (Aitken and Neville)
        for i in range(j):
            ratio = (count / SUBSTEPS[j - i - 1]) ** 2
            row.append(row[i] + (row[i] - above[i]) / (ratio - 1.0))
    return row[-1], row[-1] - row[-2]


def _midpoint(rate: Callable[[Any, Any], Any], x: Any, span: Any, count: int) -> Any:
    """The modified midpoint rule with smoothing at the end."""
    h = span / count
    before, now = x, x + h * rate(x, 0 * span)
    for i in range(1, count):
        before, now = now, before + 2.0 * h * rate(now, i * h)
    return 0.5 * (before + now + h * rate(now, span))


def driven_step(rate: ca.Function, n_x: int, n_u: int, count: int) -> ca.Function:
    """One step of dynamics whose inputs are polynomials of local time in an interval.

    Parameters
    ----------
    rate : casadi.Function
        ``(x, u, t) -> dx/dt``.
    n_x, n_u, count : int
        Numbers of states, of inputs, and of powers of local time in an input.

    Returns
    -------
    casadi.Function
        ``(x, data) -> (end, error)``. The data are the coefficients (n_u, count) of the inputs row
        by row, start and length of the interval [s], and local time and length of the step within
        it.
    """
    kind = ca.SX if rate.n_instructions() < _LONG else ca.MX
    x, data, local = kind.sym("x", n_x), kind.sym("data", n_u * count + 4), kind.sym("local")
    table = ca.reshape(data[: n_u * count], count, n_u)
    t, h, tau, span = ca.vertsplit(data[n_u * count :])

    u = kind(0, 1)
    if n_u:
        # Horner's rule, all inputs at once
        row = table[count - 1, :]
        for i in range(count - 2, -1, -1):
            row = row * (tau + local) + table[i, :]
        u = row.T
    # a function, so that each substep is one call
    slope = ca.Function("slope", [x, local, data], [h * rate(x, u, t + (tau + local) * h)])

    ends = extrapolated_step(lambda state, at: slope(state, at, data), x, span)
    return ca.Function("step", [x, data], list(ends))


def accumulated(step: ca.Function, count: int) -> ca.Function:
    """The step applied `count` times in sequence, all intermediate values returned."""
    # a tree of maps of four keeps the built function short for thousands of steps; of ten it takes
    # five times as long to build
    return step.mapaccum("sequence", count, {"base": 4})


# Of an interval, beyond which it has failed. Thousands are spent where a motion turns fast.
_MOST_STEPS = 100_000


def backward_differences(
    rate: ca.Function,
    start: Array,
    inputs: Array,
    times: tuple[Array, Array],
    sizes: Array,
    samples: int,
    tolerance: float,
) -> Array | None:
    """States in each of some intervals that follow each other; None where a step fails.

    Parameters
    ----------
    rate : casadi.Function
        ``(x, u, t) -> dx/dt``.
    start : (n_x,)
        State at the start of the first interval.
    inputs : (N, n_u, count)
        Coefficients of powers of local time of the inputs in each interval.
    times : (N,), (N,)
        Start and end of each interval [s].
    sizes : (n_x,)
        Typical sizes of the states.
    samples : int
        Equal parts of an interval, at whose ends states are kept.
    tolerance : float
        Of the estimated error of a step, relative to the sizes.

    Returns
    -------
    (N, samples + 1, n_x) or None
    """
    advance = _integrator(rate, inputs.shape[2], sizes, samples, tolerance)
    x, parts = start / sizes, []
    for coefficients, first, last in zip(inputs, *times, strict=True):
        data = np.concatenate([coefficients.ravel(), [first, last - first]])
        try:
            after = advance(x0=x, p=data)["xf"].full().T
        except RuntimeError:  # of CVODES: steps that become too short or too many
            return None
        parts.append(np.vstack([x, after]))
        x = after[-1]
    states = np.array(parts) * sizes
    return states if np.all(np.isfinite(states)) else None


def _integrator(
    rate: ca.Function, count: int, sizes: Array, samples: int, tolerance: float
) -> ca.Function:
    """CVODES over the local time of an interval, in states relative to their sizes."""
    n_x, n_u = rate.size1_in(0), rate.size1_in(1)
    x, tau = ca.SX.sym("x", n_x), ca.SX.sym("tau")
    data = ca.SX.sym("data", n_u * count + 2)
    table = ca.reshape(data[: n_u * count], count, n_u)
    first, width = ca.vertsplit(data[n_u * count :])

    u = ca.SX(0, 1)
    if n_u:
        powers = ca.vertcat(*[tau**k for k in range(count)])
        u = table.T @ powers
    slope = width * rate(x * sizes, u, first + tau * width) / sizes
    options = {
        # it holds the root of the mean square of all states to its tolerance
        "abstol": tolerance / math.sqrt(n_x),
        "reltol": 0.0,
        "max_num_steps": _MOST_STEPS,
        "disable_internal_warnings": True,
    }
    grid = np.arange(1, samples + 1) / samples
    equations = {"x": x, "p": data, "t": tau, "ode": ca.densify(slope)}
    return ca.integrator("stiff", "cvodes", equations, 0.0, grid.tolist(), options)
