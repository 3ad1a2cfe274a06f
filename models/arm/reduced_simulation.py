"""Numbers from the reduced arm: motion under torque laws, natural modes.

Symbols: q, v coordinates and rates of the model (n,); y = (q, v) its state (2 n,); m instants.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import Literal

import numpy as np

from models.ancf.joints import Free, Torque, breakpoints, law_values
from models.arm.reduced import ReducedArm
from models.arm.split_steps import STABLE, split_steps
from models.arrays import Array
from models.errors import ModelError, require
from models.numerics import interior

Method = Literal["DOP853", "Radau"]
# Finest tolerances: below 3e-14 rounding is larger than the error, and below 1e-9 rounding in the
# implicit equations makes steps tiny.
_FINEST: dict[Method, float] = {"DOP853": 3e-14, "Radau": 1e-9}
# Modes are elastic if their omega^2 exceeds this share of the highest: rigid motions have zero
# but for rounding, bending modes more by orders of magnitude.
_RIGID = 1e-9


@dataclass(frozen=True, eq=False)
class ReducedMotion:
    """Motion of a reduced arm: times (m,) [s], q and v (n, m), tip and elbow (2, m) [m]."""

    model: ReducedArm
    times: Array
    q: Array
    v: Array
    tip: Array
    elbow: Array


def simulate_reduced(
    model: ReducedArm,
    q: Array,
    times: Array,
    *,
    v: Array | None = None,
    root: Torque | Free | None = None,
    elbow: Torque | Free | None = None,
    tolerance: float = 1e-9,
    method: Method = "DOP853",
) -> ReducedMotion:
    """Integrate a reduced arm between breakpoints.

    Parameters
    ----------
    model : ReducedArm
    q : (n,)
        Coordinates at `times[0]`.
    times : (m,)
        Increasing instants [s].
    v : (n,), optional
        Rates, zero by default.
    root, elbow : Torque, optional
        Torques; none by default.
    tolerance : float
        Relative and absolute tolerance of the integrator; 1e-9 at least with "Radau".
    method : Method
        "DOP853" is explicit, of order 8, and takes a step or two for each swing of the fastest
        mode, see `models.arm.split_steps`. "Radau" is SciPy's, implicit and of order 5, and takes
        fewer where no mode swings.

    Raises
    ------
    ModelError
        If the times do not increase, a law is not finite or of another shape, or the integrator
        fails.
    """
    times = np.asarray(times, dtype=float)
    require(
        times.ndim == 1 and len(times) >= 2 and bool((np.diff(times) > 0).all()),
        "simulate_reduced: times do not increase; give two or more increasing instants.",
    )
    laws = [joint if isinstance(joint, Torque) else None for joint in (root, elbow)]
    start, end = float(times[0]), float(times[-1])
    # the laws are looked at first: a step across a jump that no one stated meets no tolerance
    edges = [start, *breakpoints([law or Free() for law in laws], start, end), end]

    tolerance = max(tolerance, _FINEST[method])
    state = np.concatenate((q, np.zeros(model.size) if v is None else v))
    history = np.empty((2 * model.size, len(times)))
    history[:, 0] = state
    for window in pairwise(edges):
        asked = (times > window[0]) & (times <= window[1])
        instants = np.unique(np.concatenate(([window[0]], times[asked], [window[1]])))
        integrate = _explicit if method == "DOP853" else _implicit
        path = integrate(model, laws, state, instants, tolerance)
        # the end of the window comes last, asked for or not
        history[:, asked], state = path[:, 1 : asked.sum() + 1], path[:, -1]

    q_all, v_all = history[: model.size], history[model.size :]
    nodes = model.to_nodes(q_all, v_all, 1)[0]
    return ReducedMotion(model, times, q_all, v_all, tip=nodes[12:14], elbow=nodes[4:6])


def _explicit(
    model: ReducedArm, laws: list[Torque | None], state: Array, times: Array, tolerance: float
) -> Array:
    """States (2 n, m) at the times of a window, by steps that the fastest mode allows."""
    fastest = float(reduced_modes(model, state[: model.size])[0][-1])
    inside = interior(float(times[0]), float(times[-1]))
    return split_steps(
        model.rates,
        state,
        times,
        lambda t: _torques(laws, np.clip(t, *inside)),
        STABLE / (2 * pi * fastest),
        tolerance,
    )


def _implicit(
    model: ReducedArm, laws: list[Torque | None], state: Array, times: Array, tolerance: float
) -> Array:
    """States (2 n, m) at the times of a window, by SciPy's Radau."""
    from scipy.integrate import solve_ivp

    window = float(times[0]), float(times[-1])
    piece = solve_ivp(
        _right_hand_side(model, laws, window),
        window,
        state,
        method="Radau",
        t_eval=times,
        rtol=tolerance,
        atol=tolerance,
    )
    require(
        piece.success,
        f"simulate_reduced: stopped at t = {piece.t[-1]:g} s ({piece.message}); "
        "raise the tolerance or declare a breakpoint.",
    )
    return np.asarray(piece.y)


def _torques(laws: list[Torque | None], times: Array) -> Array:
    """Torques (2, m) of both joints at instants inside a window."""
    given = np.zeros((2, len(times)))
    for k, law in enumerate(laws):
        if law is not None:
            given[k] = law_values(law.torque, times, f"simulate_reduced: the law of joint {k}")
    return given


def _right_hand_side(
    model: ReducedArm, laws: list[Torque | None], window: tuple[float, float]
) -> Callable[[float, Array], Array]:
    """State rates of the reduced arm inside a window, through CasADi's buffers.

    Buffers spare the conversion of arguments, which takes longer than the evaluation.
    """
    first, last = interior(*window)
    state, torque, rates = np.empty(2 * model.size), np.zeros(2), np.empty(2 * model.size)
    buffer, evaluate = model.rates.buffer()
    for k, argument in enumerate((state, torque)):
        buffer.set_arg(k, argument.data)
    buffer.set_res(0, rates.data)

    alive = buffer, model.rates  # evaluate() does not keep them

    def rate(t: float, y: Array, _alive: object = alive) -> Array:
        state[:] = y
        torque[:] = _torques(laws, np.array([min(max(t, first), last)]))[:, 0]
        evaluate()
        return rates.copy()

    return rate


def reduced_modes(model: ReducedArm, q: Array) -> tuple[Array, Array]:
    """Frequencies (k,) [Hz] and shapes (n, k) at undeformed coordinates, rigid motions left out.

    Raises
    ------
    ModelError
        If the masses are so unlike that rounding leaves no modes.
    """
    from scipy.linalg import LinAlgError, eigh

    mass, stiffness = (matrix.full() for matrix in model.linear(q))
    try:
        squares, vectors = eigh(stiffness, mass)
    except (LinAlgError, ValueError) as error:
        raise ModelError(
            "the masses of the arm are too unlike for its modes to be found; give tubes that are "
            "less light beside the tip and the hub"
        ) from error
    elastic = squares > _RIGID * squares[-1]
    return np.sqrt(squares[elastic]) / (2 * pi), vectors[:, elastic]
