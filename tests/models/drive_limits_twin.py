"""What a motor must be able to do for the truss: margins, bounds and the phase plane, in NumPy.

Everything follows from the drive in `drive_twin.py`, whose symbols are used.

- A margin is the torque that the motor has at its speed, over the torque that the factored loads
  ask of its shaft, less one. The static margin leaves out all that motion adds.
- The bounds are of the peak of the force at the drum with the rotor's own torque, of a motion from
  rest to rest whose ropes only pull.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.models.drive_twin import (
    Array,
    Drive,
    damping,
    derivative,
    inertia,
    leverage,
    loads,
    rope_acceleration,
    wound,
)

OPEN = np.pi / 2
STATIC = ("springs", "net")  # what resists at rest, beside the holding force
STEPS = 3000  # of the phase plane: 6e-3 N too high at 20 to 42 N, and half of it with twice as many
BISECTIONS = 25  # the last one is of 1e-6 N


# --- margins --------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Requirement:
    """What a margin counts.

    Attributes
    ----------
    factors : uncertainty factor of each load, at least 1, and 1 if not named: those of `loads`,
        "holding", "pulleys" and "rotor".
    holding : constant resistance [N] of each rope behind the pulleys, such as that of a harness.
    derating : what is left of the motor's torque, for each reason.
    torque_speed : rows of speed [rad/s] and torque [N m] of the motor, straight between them.
    """

    torque_speed: Any
    factors: Mapping[str, float] = field(default_factory=dict)
    holding: float = 0.0
    derating: tuple[float, ...] = ()

    def factored(self, name: str, load: Array) -> Array:
        """Load times its factor where it resists. What helps the motor is not multiplied."""
        return np.where(load > 0, self.factors.get(name, 1.0), 1.0) * load


def straight_line(stall_torque: float, no_load_speed: float) -> Array:
    """Torque-speed rows of a motor at constant voltage [N m, rad/s]."""
    return np.array([[0.0, stall_torque], [no_load_speed, 0.0]])


def available_torque(asked: Requirement, speed: Array) -> Array:
    """Torque [N m] that the derated motor has at a speed [rad/s]; none beyond the last row."""
    rows = np.asarray(asked.torque_speed)
    return np.prod(asked.derating) * np.interp(speed, rows[:, 0], rows[:, 1], right=0.0)


def required_torque(
    p: Any,
    drive: Drive,
    asked: Requirement,
    alpha: Array,
    rate: Array,
    acceleration: Array,
    *,
    static: bool = False,
) -> Array:
    """Torque [N m] on the shaft of one motor under factored loads.

    Without friction in the pulleys the pull of both ropes would be the loads over 2 s'. The pulleys
    add the same part to all of it, and their factor multiplies what they add.
    """
    parts = loads(p, alpha, rate, acceleration)
    names = STATIC if static else tuple(parts)
    resisting = sum(asked.factored(name, parts[name]) for name in names)
    free = resisting / (2 * wound(p, alpha)) + asked.factored("holding", asked.holding)

    pulleys = free * (2 * wound(p, alpha) / leverage(p, alpha) - 1)
    pull = (free + asked.factored("pulleys", pulleys)) / drive.efficiency
    if not static:
        rotor = drive.rope_mass * rope_acceleration(p, alpha, rate, acceleration)
        pull = pull + asked.factored("rotor", rotor)
    return pull * drive.drum_radius / drive.gear


def margin(available: Array, required: Array) -> Array:
    """Margin [-]; infinite where nothing is required."""
    needed = np.where(required > 0, required, 1.0)
    return np.where(required > 0, available / needed - 1, np.inf)


# --- bounds ---------------------------------------------------------------------------------------


def static_force(p: Any, alpha: Array) -> Array:
    """Pull [N] of each rope that moves the ring on from standstill; a rotor adds nothing."""
    still = np.zeros_like(alpha)
    parts = loads(p, alpha, still, still)
    return sum(parts[name] for name in STATIC) / leverage(p, alpha)


def restart_force(p: Any, stopped_at: float, points: int = 4001) -> float:
    """Pull [N] that opens the ring from standstill slowly: the most on the rest of the travel."""
    return float(np.max(static_force(p, np.linspace(stopped_at, OPEN, points))))


def work_bound(p: Any, duration: float = np.inf, order: int = 60) -> float:
    """Least peak force [N] by work: what a drum must do, over the travel of its rope.

    At the drums the rotors' work is zero from rest to rest. The pulleys make T1 = N/f of a
    resistance N, so the work of one rope is the integral of h (U' + D rate + K'), with h = s'/f and
    the ring's kinetic energy K. K adds no negative work, because h falls as the wraps become less.
    By Schwarz D adds at least the square of the integral of sqrt(h D), over the duration [s].
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    work = travel = viscous = 0.0
    for left, right in ((p.stowed_angle, p.net_angle), (p.net_angle, OPEN)):
        alpha = (left + right) / 2 + (right - left) / 2 * nodes
        step = weights * (right - left) / 2
        h = wound(p, alpha) / leverage(p, alpha)
        travel += np.sum(step * wound(p, alpha))
        work += np.sum(step * wound(p, alpha) * static_force(p, alpha))
        viscous += np.sum(step * np.sqrt(h * sum(damping(p, alpha))))
    return float((work + viscous**2 / duration) / travel)


@dataclass(frozen=True, eq=False)
class PhasePlane:
    """Curves of y = rate^2 [rad^2/s^2] over the angle, at the least and at the largest force.

    With y' = 2 acceleration, T1 = F - m (s' y'/2 + s'' y) in the equation of motion gives
    (J + m f s') y'/2 + (J'/2 + m f s'') y + D sqrt(y) + U' = f F for the force F at the drum, and
    the same with m = 0 and F = 0 for a rope without tension.

    Attributes
    ----------
    alpha : (2 N + 1,) [rad], N steps and the middle of each.
    rows : for each angle U', J'/2, D, J, f, and the rotor's m f s'' and m f s'.
    """

    alpha: Array
    rows: list[list[float]]

    def slope(self, k: int, y: float, force: float | None) -> float:
        """y' at the k-th angle under a force [N] at the drum, or under a rope without tension."""
        potential, bend, friction, mass, f, rotor_bend, rotor = self.rows[k]
        resisting = potential + friction * max(y, 0.0) ** 0.5 + bend * y
        if force is None:
            return -2 * resisting / mass
        return 2 * (f * force - resisting - rotor_bend * y) / (mass + rotor)

    def curve(self, force: float | None) -> Array:
        """y (N + 1,) by Runge and Kutta from the start, or from the end without tension.

        Where the ring stops short, y is 0 from there on.
        """
        whole = range(0, self.alpha.size - 1, 2)
        order, sign = (whole, 1) if force is not None else ([k + 2 for k in reversed(whole)], -1)
        values, y = [0.0], 0.0
        for k in order:
            step = self.alpha[k + 2 * sign] - self.alpha[k]
            one = self.slope(k, y, force)
            two = self.slope(k + sign, y + step / 2 * one, force)
            three = self.slope(k + sign, y + step / 2 * two, force)
            four = self.slope(k + 2 * sign, y + step * three, force)
            y += step / 6 * (one + 2 * two + 2 * three + four)
            if y <= 0:
                break
            values.append(y)
        values += [0.0] * (len(whole) + 1 - len(values))
        return np.array(values[::sign])


def phase_plane(p: Any, drive: Drive, steps: int = STEPS) -> PhasePlane:
    """Coefficients of the equation of motion along the travel."""
    alpha = np.linspace(p.stowed_angle, OPEN, 2 * steps + 1)
    still = np.zeros_like(alpha)
    potential = leverage(p, alpha) * static_force(p, alpha)
    bend = loads(p, alpha, still + 1, still)["inertia"]
    f, mass = leverage(p, alpha), drive.rope_mass
    rotor_bend = mass * f * derivative(lambda at: wound(p, at), alpha)
    rotor = mass * f * wound(p, alpha)
    columns = (potential, bend, sum(damping(p, alpha)), inertia(p, alpha), f, rotor_bend, rotor)
    return PhasePlane(alpha, np.stack(columns, axis=-1).tolist())


def least_time(plane: PhasePlane, force: float, falling: Array | None = None) -> float:
    """Least duration [s] at no more than this force [N]; infinite if the ring does not arrive.

    One switch: the whole force, and then no tension. The rate is the lower of both curves.
    """
    falling = plane.curve(None) if falling is None else falling
    rate = np.sqrt(np.minimum(plane.curve(force), falling))
    mean = (rate[1:] + rate[:-1]) / 2  # exact if the acceleration is constant over the step
    if np.any(mean <= 0):
        return float("inf")
    return float(np.sum(np.diff(plane.alpha[::2]) / mean))


def least_peak_force(p: Any, drive: Drive, duration: float, steps: int = STEPS) -> float:
    """Least peak [N] of the force at the drum of a motion that takes no longer than this [s].

    No cap on jerk, acceleration or speed, so it is a lower bound if there are any. The motor may
    brake its rotor as hard as it likes.
    """
    plane = phase_plane(p, drive, steps)
    falling = plane.curve(None)
    low, high = work_bound(p), 2 * work_bound(p)
    while least_time(plane, high, falling) > duration:
        low, high = high, 2 * high
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        late = least_time(plane, middle, falling) > duration
        low, high = (middle, high) if late else (low, middle)
    return high
