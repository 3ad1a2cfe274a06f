"""One verifier for every contestant: its control, replayed by another integrator, is right or not.

The replay integrates angle, speed and acceleration from rest under the contestant's jerk, with
SciPy's DOP853, and evaluates the rope force with `models.truss`, between all mesh points.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator

from models.truss import DYNAMIC_SET, rope_force
from studies.speed.rows.row import DURATION, END, JERK_CAP, START

Array = NDArray[np.float64]

OPTIMUM = {"A": 3.417562e-4, "B": 44.53360}  # least peak, [rad/s^2] and [N]
MISS, PEAK, EXCESS = 1e-6, 1e-3, 1e-3  # allowed: [rad], relative, relative
POINTS = 20_000  # of the dense evaluation, about
FRICTION = 0.01
ROUNDING = 1e-9  # of the duration


@dataclass(frozen=True)
class Check:
    """What the replay found.

    Attributes
    ----------
    miss : of the final angle [rad].
    peak : the largest acceleration or force [rad/s^2 or N].
    peak_error : relative to the optimum, signed.
    excess : of the worst cap, relative; `worst` names it.
    right : whether all are within the limits.
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
        reasons = []
        if not abs(self.miss) <= MISS:
            reasons.append(f"ends {self.miss:+.1e} rad off")
        if not abs(self.peak_error) <= PEAK:
            reasons.append(f"peak {100 * self.peak_error:+.2g} % off")
        if not self.excess <= EXCESS:
            reasons.append(f"{self.worst} exceeded by {100 * self.excess:.2g} %")
        return ", ".join(reasons)


def check(problem: str, control: Mapping[str, Any]) -> Check:
    """Replay a contestant's control (see `rows.row.answer`).

    Raises
    ------
    ValueError
        If it is no control over the stated duration.
    """
    _, state, jerk = replay(problem, control["edges"], control["nodes"], control["jerk"])
    angle, speed, acceleration = state
    cap, duration = JERK_CAP[problem], DURATION[problem]
    excesses = {"jerk": float(np.abs(jerk).max() / cap - 1)}
    if problem == "A":
        peak = float(np.abs(acceleration).max())
    else:
        force = _force(angle, speed, acceleration)
        peak = float(force.max())
        mean_speed = (END - START) / duration
        excesses["speed >= 0"] = float(-speed.min() / mean_speed)
        excesses["force >= 0"] = float(-force.min() / OPTIMUM[problem])
    worst = max(excesses, key=lambda name: _nan_last(excesses[name]))
    miss, error = float(angle[-1]) - END, peak / OPTIMUM[problem] - 1
    right = abs(miss) <= MISS and abs(error) <= PEAK and excesses[worst] <= EXCESS
    return Check(miss, peak, error, excesses[worst], worst, bool(right))


def replay(
    problem: str, edges: Sequence[float], nodes: Sequence[float], jerk: Sequence[Sequence[float]]
) -> tuple[Array, Array, Array]:
    """Times (m,), angle, speed and acceleration (3, m), and jerk (m,), [s, rad].

    Each interval is integrated by itself, so that no step crosses a jump of the jerk.
    """
    ends = np.asarray(edges, dtype=float)
    if not (ends[0] == 0.0 and abs(ends[-1] / DURATION[problem] - 1) <= ROUNDING):
        raise ValueError(f"it lasts {ends[-1] - ends[0]:g} s, not {DURATION[problem]:g} s")
    scale = np.array([1.0, 1.0 / DURATION[problem], 1.0 / DURATION[problem] ** 2])
    state = np.array([START, 0.0, 0.0])
    count = max(8, math.ceil(POINTS / (ends.size - 1)))
    times, states, controls = [], [], []
    for k, values in enumerate(jerk):
        first, last = ends[k], ends[k + 1]
        if last <= first:
            continue
        control = _polynomial(first, last, nodes, values)
        grid = np.linspace(first, last, count)
        done = solve_ivp(
            lambda t, x, u=control: np.array([x[1], x[2], float(u(t))]),
            (first, last), state, "DOP853", grid, rtol=1e-12, atol=1e-12 * scale,
        )  # fmt: skip
        state = done.y[:, -1]
        times.append(grid)
        states.append(done.y)
        controls.append(np.asarray(control(grid)))
    return np.concatenate(times), np.concatenate(states, axis=1), np.concatenate(controls)


def _polynomial(first: float, last: float, nodes: Sequence[float], values: Sequence[float]) -> Any:
    """The jerk in an interval, through its values at the nodes."""
    if len(nodes) == 1:
        return lambda t: np.full(np.shape(t), values[0])
    return BarycentricInterpolator(first + (last - first) * np.asarray(nodes), np.asarray(values))


def _force(angle: Array, speed: Array, acceleration: Array) -> Array:
    """Rope force [N] at m points."""
    truss = dataclasses.replace(DYNAMIC_SET, pulley_friction=FRICTION)
    x = ca.SX.sym("x", 3)
    force = ca.Function("force", [x], [rope_force(truss, x[0], x[1], x[2])])
    return np.asarray(force(np.stack([angle, speed, acceleration])).full()).ravel()


def _nan_last(value: float) -> float:
    return math.inf if math.isnan(value) else value
