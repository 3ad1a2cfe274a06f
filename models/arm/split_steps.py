"""Explicit steps of order 8 of a reduced arm, many in one call of compiled functions.

Torques are known in advance, so that all stages of many steps can be given theirs at once, and
nothing is asked back from Python on the way. Steps begin as long as the fastest mode lets them be.
Those whose error is above the tolerance are split and taken again.

The method is SciPy's, with its tables and its estimate of the error. Source: Hairer, Norsett and
Wanner, Solving Ordinary Differential Equations I, Springer 1993, section II.10.

Symbols: y state (n_y,), u input (n_u,), h length of a step [s]; k slopes of the 12 stages.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import casadi as ca
import numpy as np

from models.arrays import Array
from models.errors import require

STAGES = 12  # of a step, each of which has an instant of its own
STABLE = 4.0  # step times the fastest angular frequency; the method's limit is 5.9
_STEPS = 256  # in one call
_SPLITS = 40  # of a step, with which rounding is reached


def split_steps(
    rate: ca.Function,
    state: Array,
    times: Array,
    inputs: Callable[[Array], Array],
    longest: float,
    tolerance: float,
) -> Array:
    """States at some times, (n_y, m).

    Parameters
    ----------
    rate : casadi.Function
        ``(y, u) -> dy/dt``.
    state : (n_y,)
        At the first time.
    times : (m,)
        Increasing [s].
    inputs : callable
        From instants (k,) to u (n_u, k).
    longest : float
        Step [s].
    tolerance : float
        Of the estimated error of a step, relative to each entry of the state plus one.

    Raises
    ------
    ModelError
        If no step is short enough.
    """
    from scipy.integrate import DOP853

    advance = _chunk(rate)
    counts = np.ceil(np.diff(times) / longest).astype(int)
    starts = np.repeat(times[:-1], counts)
    lengths = np.repeat(np.diff(times) / counts, counts)
    first = np.concatenate([[0], np.cumsum(counts)])[:-1]
    starts = starts + lengths * (np.arange(len(starts)) - np.repeat(first, counts))
    ends_here = np.zeros(len(starts), dtype=bool)
    ends_here[np.cumsum(counts) - 1] = True  # steps that end at an asked time
    smallest = lengths.min() / 2.0**_SPLITS

    y, found, done = np.asarray(state, dtype=float), [np.asarray(state, dtype=float)], 0
    while done < len(starts):
        now = slice(done, done + _STEPS)
        h, t = np.zeros(_STEPS), np.full(_STEPS, times[-1])
        count = len(starts[now])
        h[:count], t[:count] = lengths[now], starts[now]  # steps of no length fill the call
        given = inputs((t[:, None] + h[:, None] * DOP853.C).ravel())
        path, error = (
            x.full() for x in advance(y, given.reshape(-1, _STEPS * len(DOP853.C)), h, tolerance)
        )

        error = error[0, :count]
        rough = ~(error <= 1.0)
        if not np.isfinite(error).all():
            rough[np.argmin(np.isfinite(error)) + 1 :] = False  # nothing is known of what follows
        if rough.any():
            require(
                bool(lengths[now][rough].min() > smallest),
                f"split_steps: no step is short enough at t = {t[:count][rough][0]:g} s; raise the "
                "tolerance or declare a breakpoint.",
            )
            where = done + np.flatnonzero(rough)
            halves = lengths[where] / 2
            lengths[where] = halves
            lengths = np.insert(lengths, where + 1, halves)
            starts = np.insert(starts, where + 1, starts[where] + halves)
            ends_here = np.insert(ends_here, where, False)
            continue

        found += list(path[:, :count][:, ends_here[now]].T)
        y, done = path[:, count - 1], done + count
    return np.array(found).T


@lru_cache(maxsize=8)
def _chunk(rate: ca.Function) -> ca.Function:
    """Many steps: `(y, u of all stages, h, tolerance) -> (y after each, error of each)`."""
    from scipy.integrate import DOP853

    n, m, stages = rate.size1_in(0), rate.size1_in(1), len(DOP853.C)
    y, u = ca.MX.sym("y", n), ca.MX.sym("u", m, stages)
    h, tolerance = ca.MX.sym("h"), ca.MX.sym("tolerance")

    slopes: list[ca.MX] = []
    for k, row in enumerate(DOP853.A):
        known = ca.horzcat(*slopes) @ ca.DM(row[:k]) if k else 0.0
        slopes.append(rate(y + h * known, u[:, k]))
    K = ca.horzcat(*slopes)
    after = y + h * (K @ ca.DM(DOP853.B))

    # the estimate of SciPy, from embedded methods of orders 5 and 3
    size = tolerance * (1.0 + ca.fmax(ca.fabs(y), ca.fabs(after)))
    fifth, third = (ca.sumsqr(K @ ca.DM(E[:stages]) / size) for E in (DOP853.E5, DOP853.E3))
    below = fifth + 0.01 * third
    # what is no number stays none
    error = ca.if_else(below == 0.0, 0.0, ca.fabs(h) * fifth / ca.sqrt(below * n))

    step = ca.Function("step", [y, u, h, tolerance], [after, error])
    many = step.mapaccum("steps", _STEPS, 1)
    first, all_u = ca.MX.sym("y", n), ca.MX.sym("u", m, stages * _STEPS)
    each = ca.MX.sym("h", 1, _STEPS)
    path, errors = many(first, all_u, each, ca.repmat(tolerance, 1, _STEPS))
    return ca.Function("chunk", [first, all_u, each, tolerance], [path, errors])
