"""What a truss does on a rope that gives, while the motor winds in what a law takes of a rigid one.

    J alphaddot + J' alphadot^2 / 2 + D alphadot + U' = (T1 + T1*) f / 2
    T1 = k (h - s(alpha)) / c

with h(t) = s(law) and the stretch that the stowed truss at rest needs; symbols as in
`models.truss.rope_stiffness`. A slack rope does not push: T1 is never negative. Where the truss
swings back the friction of the pulleys keeps its sense, which a rope at its turn does not.

Each rope has a stiffness and a motor of its own. T1* is that of the second one, whose motor may be
behind: h*(t) = h(t - d). Both have the same leverage f / 2, and the truss keeps one angle: what two
unequal ropes twist is left out. As both are alike, a rope that is early is the other one late.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array, Flags, elementwise
from models.errors import ModelError
from models.laws.motion import Law
from models.numerics import gauss_legendre
from models.truss.dynamics import angular_acceleration, rope_force
from models.truss.inertia import kinetic_energy
from models.truss.kinematics import rope_speed
from models.truss.parameters import TrussParameters
from models.truss.potential import potential_slope
from models.truss.rope import rope_leverage
from models.truss.rope_stiffness import (
    RopeYields,
    rope_mode_frequency,
    rope_taken,
    wound_rope,
    yielding_tension,
)

SAMPLES = 4001  # of a swing: a hundred to a period of 12 Hz in a motion of 3 s
TAIL = 10  # periods of the open truss that are watched after the motor has stopped
REACHED = 1e-6  # [rad] before the end of a law, where the truss counts as there
BACKWARD = 1e-5  # of the greatest speed, beyond which a speed is no rounding at rest
TOLERANCE = 1e-8  # of the integrator, relative; in angle and speed also absolute
_CELLS, _NODES = 400, 4  # of the quadrature of what is left; a rope may become slack in one
_GRID = 401  # of angles, on which a rest is looked for: 0.06 deg apart
_NEAR = 0.2  # [rad] about the end of a law, in which the truss comes to rest on a rope that is held


@dataclass(frozen=True, eq=False)
class WoundRope:
    """What a motor winds in so that a truss on ropes that give keeps to a law.

    Attributes
    ----------
    curve : maps times to the rope wound in [m].
    peak_speed, peak_acceleration : of it [m/s, m/s^2]; the latter leaves out steps of the speed.
    end_speed : largest at both ends, a step for the motor [m/s].
    """

    curve: Callable[[Any], Any]
    peak_speed: float
    peak_acceleration: float
    end_speed: float

    @classmethod
    def of(
        cls, parameters: TrussParameters, law: Law, stiffness: float, yields: RopeYields
    ) -> WoundRope:
        """Of a law whose jerk may jump at its breakpoints."""
        from scipy.interpolate import CubicHermiteSpline

        time = np.union1d(np.linspace(0.0, law.duration, SAMPLES), law.breakpoints)
        before = np.nextafter(time[1:], 0.0)
        wound, speed = _wound_kernel(parameters, stiffness, yields, law, time)
        _, left = _wound_kernel(parameters, stiffness, yields, law, before)
        # no speed has a step inside of an interval
        gained = (left - speed[:-1]) / np.diff(time)
        return cls(
            CubicHermiteSpline(time, wound, speed),
            float(max(np.abs(speed).max(), np.abs(left).max())),
            float(np.abs(gained).max()),
            float(max(abs(speed[0]), abs(left[-1]))),
        )


def _wound_kernel(
    parameters: TrussParameters, stiffness: float, yields: RopeYields, law: Law, time: Array
) -> tuple[Array, Array]:
    """Rope that keeps a truss to a law, and its rate, at times (m,) [m, m/s]."""
    state = ca.SX.sym("state", 3)
    jerk = ca.SX.sym("jerk")
    wound = wound_rope(parameters, state[0], state[1], state[2], stiffness, yields)
    rate = ca.jtimes(wound, state, ca.vertcat(state[1], state[2], jerk))
    kernel = ca.Function("wound", [state, jerk], [wound, rate], {"cse": True})
    motion = law.motion(time)
    speed = np.maximum(motion.speed, 0.0)
    rows = kernel(np.stack([motion.angle, speed, motion.acceleration]), motion.jerk[None])
    return rows[0].full().ravel(), rows[1].full().ravel()


@dataclass(frozen=True, eq=False)
class RopeSwing:
    """Motion of a truss on a rope that gives; arrays are (m,).

    Attributes
    ----------
    time : [s], from the start of the law to some periods after its end.
    angle, speed : of the truss [rad, rad/s].
    tension : T1 of both ropes (2, m) [N], zero where one is slack; the second may be behind.
    meant_angle, meant_tension : of the law on a rigid rope [rad, N]; after its end those of rest.
    rest_angle : at which the truss comes to rest with the motor held [rad].
    arrival_energy : of the truss in motion when it first reaches the end of the law [J]; nan where
        it does not.
    energy_left : when the last motor stops, above that of this rest [J].
    slack : time for which one rope is slack, or both are [s].
    backward : time for which the truss moves back [s].
    """

    time: Array
    angle: Array
    speed: Array
    tension: Array
    meant_angle: Array
    meant_tension: Array
    rest_angle: float
    arrival_energy: float
    energy_left: float
    slack: float
    backward: float

    @property
    def angle_miss(self) -> float:
        """Largest deviation from the angle of the law [rad]."""
        return float(np.abs(self.angle - self.meant_angle).max())

    @property
    def force_miss(self) -> float:
        """Largest deviation from the motor force of the law on a rigid rope [N]."""
        return float(np.abs(self.tension - self.meant_tension).max())


def rope_swing(
    parameters: TrussParameters,
    law: Law,
    stiffness: float,
    yields: RopeYields = "at the motor",
    winds_stretch: bool = False,
    behind: float = 0.0,
) -> RopeSwing:
    """Integrate the truss on ropes of which the motors wind in what a law takes.

    Parameters
    ----------
    law : of the deployment angle, from rest.
    stiffness : k of one rope [N/m], above the least one.
    winds_stretch : whether the motors also wind in the stretch that the law's tension causes. Then
        the truss keeps to the law, if its ropes stay taut and no motor is behind.
    behind : d, by which the motor of one rope is behind that of the other [s].

    Raises
    ------
    ModelError
        If the truss leaves the reach of its mechanism, or finds no rest at the end.
    """
    from scipy.integrate import solve_ivp

    duration, stop = law.duration, law.duration + behind
    wound_in = _course(parameters, law, stiffness, yields, winds_stretch)
    rates, balance = _kernels(parameters, stiffness, yields)
    held = float(wound_in(duration))
    rest = _rest(balance, held, law.end_angle)
    end = stop + TAIL / float(rope_mode_frequency(parameters, rest, stiffness, yields)[0])

    def right_side(time: float, state: Array) -> list[float]:
        wound = wound_in(np.array([time, time - behind]))
        return [state[1], float(rates(*state, *wound))]

    def short_of_the_end(_: float, state: Array) -> float:
        return float(state[0]) - (law.end_angle - REACHED)

    time = np.union1d(np.linspace(0.0, stop, SAMPLES), np.linspace(stop, end, 40 * TAIL + 1))
    solved = solve_ivp(
        right_side,
        (0.0, end),
        [law.start_angle, 0.0],
        "LSODA",
        time,
        events=short_of_the_end,
        rtol=TOLERANCE,
        atol=TOLERANCE,
        max_step=duration / 100,
    )
    if not solved.success or not np.isfinite(solved.y).all():
        raise ModelError(
            f"the truss leaves the reach of its mechanism on a rope of {stiffness:g} N/m; "
            "give a stiffer rope or a slower law."
        )

    angle, speed = solved.y
    pulled = [elementwise(balance, angle, wound_in(time - late))[0] for late in (0.0, behind)]
    tension = np.stack([one.ravel() for one in pulled])
    meant_angle, meant_tension = _meant(parameters, law, time)
    place, arrivals = int(np.searchsorted(time, stop)), solved.y_events[0]
    left = _above_rest(balance, held, rest, float(angle[place]))
    return RopeSwing(
        time=time,
        angle=angle,
        speed=speed,
        tension=tension,
        meant_angle=meant_angle,
        meant_tension=meant_tension,
        rest_angle=rest,
        arrival_energy=float(kinetic_energy(parameters, *arrivals[0]))
        if len(arrivals)
        else math.nan,
        energy_left=left + float(kinetic_energy(parameters, angle[place], speed[place])),
        slack=_time_of(time, tension.min(axis=0) <= 0.0),
        backward=_time_of(time, speed < -BACKWARD * speed.max()),
    )


def _course(
    parameters: TrussParameters,
    law: Law,
    stiffness: float,
    yields: RopeYields,
    winds_stretch: bool,
) -> Callable[[ArrayLike], Array]:
    """Maps times to the rope that a motor has wound in [m]; it stands before and after the law."""
    first, last = (
        float(wound_rope(parameters, angle, 0.0, 0.0, stiffness, yields))
        for angle in (law.start_angle, law.end_angle)
    )
    if winds_stretch:
        curve = WoundRope.of(parameters, law, stiffness, yields).curve
    else:
        curve = _wound(parameters, law, first)
        last = float(curve(law.duration))

    def wound_in(time: ArrayLike) -> Array:
        at = np.asarray(time, dtype=float)
        # the tension of a law may step at its ends
        moving = curve(np.clip(at, 0.0, law.duration))
        return np.where(at <= 0.0, first, np.where(at >= law.duration, last, moving))

    return wound_in


def _wound(parameters: TrussParameters, law: Law, at_first: float) -> Any:
    """Rope that the motor has wound in over time [m], a curve through what the law takes."""
    from scipy.interpolate import CubicHermiteSpline

    inner = np.array(law.breakpoints)
    time = np.union1d(np.linspace(0.0, law.duration, SAMPLES), inner)
    motion = law.motion(time)
    taken = rope_taken(parameters, ca.DM(motion.angle)).full().ravel()
    rate = -rope_speed(parameters, ca.DM(motion.angle), ca.DM(motion.speed)).full().ravel()
    return CubicHermiteSpline(time, at_first + taken, rate)


def _kernels(
    parameters: TrussParameters, stiffness: float, yields: RopeYields
) -> tuple[ca.Function, ca.Function]:
    """The acceleration by alpha, omega and h of both ropes, and `balance` by alpha and one h.

    It has T1 of a rope, and what pulls the truss back at rest on two such ropes.
    """
    alpha, omega, wound, later = (ca.SX.sym(name) for name in ("alpha", "omega", "h", "later"))
    pull, behind = (
        ca.fmax(0, yielding_tension(parameters, alpha, one, stiffness, yields))
        for one in (wound, later)
    )
    acceleration = angular_acceleration(parameters, alpha, omega, (pull + behind) / 2)
    back = potential_slope(parameters, alpha) - pull * rope_leverage(parameters, alpha)
    return (
        ca.Function("rates", [alpha, omega, wound, later], [acceleration], {"cse": True}),
        ca.Function("balance", [alpha, wound], [ca.densify(pull), ca.densify(back)]),
    )


def _rest(balance: ca.Function, wound: float, angle: float) -> float:
    """The angle nearest to another one at which the truss rests on a rope that is held [rad]."""
    from scipy.optimize import brentq

    grid = np.linspace(angle - _NEAR, angle + _NEAR, _GRID)
    back = elementwise(balance, grid, wound + 0 * grid)[1].ravel()
    stable = np.flatnonzero((back[:-1] < 0.0) & (back[1:] >= 0.0))
    if stable.size == 0:
        raise ModelError(
            f"the truss finds no rest within {math.degrees(_NEAR):.3g} deg of "
            f"{math.degrees(angle):.4g} deg when its motor stops; give a stiffer rope."
        )
    place = stable[np.argmin(np.abs(grid[stable] - angle))]
    ends = grid[place : place + 2].tolist()
    return float(brentq(lambda one: float(balance(one, wound)[1]), *ends, xtol=1e-14))


def _above_rest(balance: ca.Function, wound: float, rest: float, angle: float) -> float:
    """Work that the truss gives back on its way to rest with the rope held [J]."""
    nodes, weights = gauss_legendre(_NODES)
    shares = (np.arange(_CELLS)[:, None] + nodes) / _CELLS
    alpha = rest + (angle - rest) * shares.ravel()
    back = elementwise(balance, alpha, wound + 0 * alpha)[1].reshape(shares.shape)
    return float((angle - rest) * (back @ weights).mean())


def _meant(parameters: TrussParameters, law: Law, time: Array) -> tuple[Array, Array]:
    """Angle and motor force of the law on a rigid rope, at rest after its end."""
    motion = law.motion(np.minimum(time, law.duration))
    after = time > law.duration
    speed = np.where(after, 0.0, np.maximum(motion.speed, 0.0))
    acceleration = np.where(after, 0.0, motion.acceleration)
    rows = (ca.DM(row) for row in (motion.angle, speed, acceleration))
    return motion.angle, rope_force(parameters, *rows).full().ravel()


def _time_of(time: Array, true: Flags) -> float:
    """How long something holds, by its samples [s]."""
    return float(np.diff(time)[true[1:] & true[:-1]].sum())
