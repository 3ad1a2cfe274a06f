"""The integrator of the replay where dynamics are stiff: backward differences, implicit.

An explicit step must be shorter than the fastest decay, however smooth the motion is. Backward
differences (orders 1 to 5, Newton's method with the exact Jacobian) need not be. They are those of
CVODES, which comes with CasADi and chooses its steps and orders itself. It shares nothing with
collocation either.
Source: Hindmarsh et al., "SUNDIALS: suite of nonlinear and differential/algebraic equation
solvers", ACM Transactions on Mathematical Software 31, 2005.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ocp.arrays import Array

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
