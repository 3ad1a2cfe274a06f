"""Numbers from the reduced arm: motion under torque laws, natural modes, lock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import pi

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, solve

from models.ancf.joints import Free, Torque
from models.arm.reduced import COORDINATES, ReducedArm
from models.arrays import Array
from models.errors import ModelError


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
) -> ReducedMotion:
    """Integrate a reduced arm with an explicit method of order 8, between breakpoints.

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
        Relative and absolute tolerance of the integrator.

    Raises
    ------
    ModelError
        If the integrator fails.
    """
    laws = [joint if isinstance(joint, Torque) else None for joint in (root, elbow)]
    start, end = float(times[0]), float(times[-1])
    breaks = {b for law in laws if law for b in law.breakpoints if start < b < end}
    edges = sorted({start, end} | breaks)
    state = np.concatenate((q, np.zeros(model.size) if v is None else v))
    out = np.empty((2 * model.size, len(times)))
    out[:, 0] = state
    for lo, hi in pairwise(edges):
        inside = (times > lo) & (times <= hi)
        asked = np.append(times[inside], hi)
        rate = _right_hand_side(model, laws, (lo, hi))
        done = solve_ivp(
            rate,
            (lo, hi),
            state,
            method="DOP853",
            t_eval=np.unique(asked),
            rtol=max(tolerance, 3e-14),
            atol=tolerance,
        )
        if not done.success:
            raise ModelError(
                f"simulate_reduced: stopped at t = {done.t[-1]:g} s ({done.message}); "
                "raise the tolerance or declare a breakpoint."
            )
        out[:, inside], state = done.y[:, : inside.sum()], done.y[:, -1]
    q_all, v_all = out[: model.size], out[model.size :]
    nodes = model.to_nodes(q_all, v_all, 1)[0]
    return ReducedMotion(model, times, q_all, v_all, nodes[12:14], nodes[4:6])


def _right_hand_side(
    model: ReducedArm, laws: list[Torque | None], window: tuple[float, float]
) -> Callable[[float, Array], Array]:
    """State rates of the reduced arm inside a window, through CasADi's buffers."""
    n, edge = model.size, 1e-13 * max(1.0, abs(window[1]))
    first, last = window[0] + edge, window[1] - edge
    state, torque, out = np.empty(2 * n), np.zeros(2), np.empty(n)
    buffer, evaluate = model.dynamics.buffer()
    for k, part in enumerate((state[:n], state[n:], torque)):
        buffer.set_arg(k, part.data)
    buffer.set_res(0, out.data)

    alive = buffer, model.dynamics  # evaluate() does not keep them

    def rate(t: float, y: Array, _alive: object = alive) -> Array:
        state[:] = y
        at = np.array([min(max(t, first), last)])
        for k, law in enumerate(laws):
            if law is not None:
                torque[k] = law.torque(at)[0]
        evaluate()
        return np.concatenate((y[n:], out))

    return rate


def reduced_modes(model: ReducedArm, q: Array) -> tuple[Array, Array]:
    """Frequencies (k,) [Hz] and shapes (n, k) at undeformed coordinates, rigid motions left out."""
    mass, stiffness = (m.full() for m in model.linear(q))
    squares, vectors = eigh(stiffness, mass)
    elastic = squares > 1e-9 * squares[-1]
    return np.sqrt(squares[elastic]) / (2 * pi), vectors[:, elastic]


def lock_reduced(
    model: ReducedArm, q: Array, v: Array, *, root: bool = False, elbow: bool = False
) -> tuple[ReducedArm, Array, Array]:
    """Lock joints at the angles reached: the locked model, its coordinates and its rates.

    The rates are those after the inelastic impulse: J^T M J v+ = J^T M v, with J the tangent
    of the locked coordinates in the free ones.
    """
    p = np.array(model.embed(q).full())[:, 0]
    angle = float(model.elbow_angle(q))
    locked = ReducedArm(
        model.parameters,
        model.variant,
        float(p[0]) if root else model.root_lock,
        angle if elbow else model.elbow_lock,
    )
    kept = [model.coordinates.index(name) for name in locked.coordinates]
    z = q[kept]
    s = ca.SX.sym("s", locked.size)
    all_six = ca.Function("p", [s], [ca.jacobian(locked.embed(s), s)])(z).full()
    J = all_six[[COORDINATES.index(name) for name in model.coordinates]]
    mass = model.linear(q)[0].full()
    return locked, z, solve(J.T @ mass @ J, J.T @ mass @ v, assume_a="pos")
