"""One verifier for every contestant: its control, replayed by another integrator, is right or not.

The replay integrates angle, speed and acceleration from rest under the contestant's jerk, with
SciPy's DOP853, and evaluates the rope force with `models.truss`, between all mesh points.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator

from benchmarks.race.rows.problems import DURATION, END, JERK_CAP, PULLEY, START
from models.arrays import Array
from models.truss import DYNAMIC_SET, rope_force

OPTIMUM = {"A": 3.417562e-4, "B": 44.53360}  # least peak, [rad/s^2] and [N]
MISS, PEAK, EXCESS = 1e-6, 1e-3, 1e-3  # allowed: [rad], relative, relative
POINTS = 20_000  # of the dense evaluation, about
ROUNDING = 1e-9  # of the duration


@dataclass(frozen=True)
class Judgement:
    """What the replay of a control gave.

    Attributes
    ----------
    miss : float
        Of the final angle [rad].
    peak : float
        The largest acceleration or force [rad/s^2 or N].
    peak_error : float
        Relative to the optimum, signed.
    excess : float
        Of the worst cap, relative.
    worst : str
        Name of that cap.
    right : bool
        Whether all are within the limits.
    """

    miss: float
    peak: float
    peak_error: float
    excess: float
    worst: str
    right: bool

    @property
    def reason(self) -> str:
        """Why it is not right, in a few words; empty if it is."""
        # `not <=` instead of `>`: a nan is not right either.
        reasons = []
        if not abs(self.miss) <= MISS:
            reasons.append(f"ends {self.miss:+.1e} rad off")
        if not abs(self.peak_error) <= PEAK:
            reasons.append(f"peak {100 * self.peak_error:+.2g} % off")
        if not self.excess <= EXCESS:
            reasons.append(f"{self.worst} exceeded by {100 * self.excess:.2g} %")
        return ", ".join(reasons)


def judge(problem: str, control: Mapping[str, Any]) -> Judgement:
    """Replay a contestant's control (see `rows.row.answer`).

    Raises
    ------
    ValueError
        If it is no control over the stated duration.
    """
    _, states, jerk = replay(problem, control["edges"], control["nodes"], control["jerk"])
    angle, speed, acceleration = states

    excesses = {"jerk": float(np.abs(jerk).max() / JERK_CAP[problem] - 1)}
    if problem == "A":
        peak = float(np.abs(acceleration).max())
    else:
        force = _force(angle, speed, acceleration)
        peak = float(force.max())
        mean_speed = (END - START) / DURATION[problem]
        excesses["speed >= 0"] = float(-speed.min() / mean_speed)
        excesses["force >= 0"] = float(-force.min() / OPTIMUM[problem])

    worst = max(excesses, key=lambda name: _nan_is_worst(excesses[name]))
    miss, error = float(angle[-1]) - END, peak / OPTIMUM[problem] - 1
    right = abs(miss) <= MISS and abs(error) <= PEAK and excesses[worst] <= EXCESS
    return Judgement(miss, peak, error, excesses[worst], worst, bool(right))


def replay(
    problem: str, edges: Sequence[float], nodes: Sequence[float], jerk: Sequence[Sequence[float]]
) -> tuple[Array, Array, Array]:
    """Integrate the motion from rest.

    Parameters
    ----------
    problem : str
    edges : (m + 1,) times [s]
    nodes : (p,) places in [0, 1] of an interval
    jerk : (m, p) values there [rad/s^3]

    Returns
    -------
    times, states, jerk : ndarray, shapes (n,), (3, n), (n,)
        Dense times [s]; angle, speed and acceleration; the jerk [s, rad].

    Raises
    ------
    ValueError
        If the control has another duration than the problem.
    """
    duration, ends = DURATION[problem], np.asarray(edges, dtype=float)
    if not (ends[0] == 0.0 and abs(ends[-1] / duration - 1) <= ROUNDING):
        raise ValueError(f"it lasts {ends[-1] - ends[0]:g} s, not {duration:g} s")

    state = np.array([START, 0.0, 0.0])
    tolerances = 1e-12 * np.array([1.0, 1.0 / duration, 1.0 / duration**2])
    points = max(8, math.ceil(POINTS / (ends.size - 1)))
    times, states, controls = [], [], []

    # Each interval is integrated by itself, so that no step crosses a jump of the jerk.
    for k, values in enumerate(jerk):
        first, last = ends[k], ends[k + 1]
        if last <= first:  # moving breakpoints may have shut an interval
            continue
        control = _polynomial(first, last, nodes, values)
        dense = np.linspace(first, last, points)
        motion = solve_ivp(
            lambda t, x, u=control: np.array([x[1], x[2], float(u(t))]),
            (first, last),
            state,
            method="DOP853",
            t_eval=dense,
            rtol=1e-12,
            atol=tolerances,
        )
        state = motion.y[:, -1]
        times.append(dense)
        states.append(motion.y)
        controls.append(np.asarray(control(dense)))

    return np.concatenate(times), np.concatenate(states, axis=1), np.concatenate(controls)


def _polynomial(
    first: float, last: float, nodes: Sequence[float], values: Sequence[float]
) -> Callable[[Any], Any]:
    """The jerk in an interval, through its values at the nodes."""
    if len(nodes) == 1:
        return lambda t: np.full(np.shape(t), values[0])
    places = first + (last - first) * np.asarray(nodes)
    interpolator: Callable[[Any], Any] = BarycentricInterpolator(places, np.asarray(values))
    return interpolator


def _force(angle: Array, speed: Array, acceleration: Array) -> Array:
    """Rope force [N] at m points."""
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=PULLEY)
    x = ca.SX.sym("x", 3)
    force = ca.Function("force", [x], [rope_force(truss, x[0], x[1], x[2])])
    return np.asarray(force(np.stack([angle, speed, acceleration])).full()).ravel()


def _nan_is_worst(value: float) -> float:
    return math.inf if math.isnan(value) else value
