"""A motion law on a truss: all its histories, its peaks between samples, its energies.

Every number that a table, a figure or an export shows comes from here, whichever law it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import elementwise
from models.laws import AngularMotion, Hermite, Law
from models.numerics import peaks_in
from models.ring_on_arm import ArmMotion, RingOnArm, arm_motion
from models.truss import (
    Opening,
    RopeSwing,
    TrussMotion,
    TrussParameters,
    evaluate_motion,
    rope_jerk,
    rope_length,
    rope_swing,
)
from ocp.arrays import Array, Flags
from studies.drive.schema import Drive
from studies.margin.available import standstill_kernel
from studies.margin.schema import MarginRequirements
from studies.margin.travel import Travel, along, need_kernel
from studies.truss.motor_at_work import MotorAtWork
from studies.truss.quantities import QUANTITIES

GRID_POINTS = 4000  # samples of a motion, spread over its pieces, before peaks are refined
CANDIDATES = 4  # highest samples of a quantity that are refined
ZOOM_POINTS = 11  # between the neighbours of such a sample, again and again
BACKWARD = 1e-6  # of the mean speed: what a bound of an optimiser may leave below zero
GAUSS_POINTS = 8  # per cell of the energy quadrature
GAUSS_CELLS = 400  # cells of the energy quadrature, spread over the pieces
SAMPLES = 2001  # evenly spaced rows of a profile; the times of kinks and denser rows are added
LARGEST_STEP = 2e-3  # of stroke and peak speed: what changes from row to row of a profile
READ = 1e-7  # of the largest force: by how much what is read between two rows may differ
HALVINGS = 6  # of the distance of rows between which it differs by more
NARROWEST = 1e-9  # of the duration: rows are not closer
JUMP = 1e-6  # of the greatest acceleration: less is rounding
CLOSE = 0.4  # of the spacing: rows closer than this to a kink give way to it

# column: unit and meaning; forces are those of one of the two ropes
COLUMNS = {
    "time": ("s", "since the start"),
    "rope_length": ("m", "length of one driving rope"),
    "rope_speed": ("m/s", "rate of that length, negative while the rope is wound in"),
    "rope_acceleration": ("m/s^2", "rate of the rope's speed"),
    "motor_force": ("N", "force of the motor on one rope"),
    "far_end_tension": ("N", "tension of the rope's last segment"),
    "motor_power": ("W", "power of both motors"),
    "angle": ("rad", "deployment angle"),
    "angular_speed": ("rad/s", "rate of the angle"),
    "angular_acceleration": ("rad/s^2", "rate of the speed"),
    "angular_acceleration_before": ("rad/s^2", "its limit from the left, where it jumps"),
    "angular_jerk": ("rad/s^3", "rate of the acceleration"),
    "angular_jerk_before": ("rad/s^3", "its limit from the left, where it jumps"),
    "reaction_force": ("N", "reaction on the supporting arm"),
    "joint_power": ("W", "dissipated in the joints"),
    "pulley_power": ("W", "dissipated in the pulleys"),
    "kinetic_energy": ("J", "of the truss"),
    "potential_energy": ("J", "of springs and net"),
    "tip_along": ("m", "displacement of the tip of the arm that carries the ring, along the arm"),
    "tip_across": ("m", "the same across it, towards the side of the ring"),
}

TIP = ("tip_along", "tip_across")
"""Columns of a profile with an arm: displacement of its tip [m]."""


class Extreme(NamedTuple):
    """An extreme value and when it is taken [s]."""

    value: float
    time: float


@dataclass(frozen=True, eq=False)
class Energies:
    """Energies since the start, shape (m,) [J]; each from its own formula.

    Attributes
    ----------
    time : [s].
    motor : work of the motor, the integral of 2 T1 times the rope's speed.
    kinetic, potential : change of kinetic energy (22) and of potential energy (26).
    joints, pulleys : dissipated; the pulleys' summed pulley by pulley.
    arm : given to the arm that carries the ring, what its damping has taken included.
    """

    time: Array
    motor: Array
    kinetic: Array
    potential: Array
    joints: Array
    pulleys: Array
    arm: Array | float = 0.0

    @property
    def imbalance(self) -> float:
        """Largest miss of the balance at any time, relative to the work of the motor.

        Or to what the ring had in motion at its start, if that is more.
        """
        miss = self.motor - self.kinetic - self.potential - self.joints - self.pulleys - self.arm
        given = max(np.abs(self.motor).max(), -self.kinetic.min())
        return float(np.abs(miss).max() / given)


@dataclass(frozen=True)
class Deployment:
    """A motion law on a truss.

    Attributes
    ----------
    name : how tables and figures call it.
    law : angle over time.
    truss : its parameters.
    drive : that winds the ropes in; None where there is none.
    margin : that is asked for; None where there is none.
    only : the quantities whose extremes are located, where the others are nobody's question.
    carrier : the arm that carries the ring; None where its fixed bar is held.
    opening : between which angles margins have to be kept; None for all, from stowed to open.
    """

    name: str
    law: Law
    truss: TrussParameters
    drive: Drive | None = None
    margin: MarginRequirements | None = None
    only: frozenset[str] | None = None
    carrier: RingOnArm | None = None
    opening: Opening | None = None

    @cached_property
    def arm(self) -> ArmMotion | None:
        """The arm while the ring opens; None without one."""
        return None if self.carrier is None else arm_motion(self.carrier, self.law)

    def torque_of_arm(self, time: ArrayLike) -> Array | float:
        """By which the ropes have to do more than on a tip that is held [N m], (m,)."""
        return 0.0 if self.arm is None else self.arm.torque(time)

    def at(self, time: ArrayLike) -> tuple[AngularMotion, TrussMotion]:
        """Histories at times (m,) in [0, T]."""
        motion = self.law.motion(time)
        rounding = -BACKWARD * (self.law.end_angle - self.law.start_angle) / self.law.duration
        still = (motion.speed < 0) & (motion.speed > rounding)
        speed = np.where(still, 0.0, motion.speed)
        rows, torque = (motion.angle, speed, motion.acceleration), self.torque_of_arm(motion.time)
        return motion, evaluate_motion(self.truss, *rows, torque=torque)

    @cached_property
    def edges(self) -> tuple[float, ...]:
        """Start, end and all times between at which a history has a kink [s]."""
        duration = self.law.duration
        close = 1e-12 * duration
        of_law = [time for time in self.law.breakpoints if close < time < duration - close]
        kinks = [0.0, *of_law, duration]
        # a law of two phases breaks where the net becomes taut: that is one kink, the law's
        net = [time for time in self._net_times if min(abs(time - k) for k in kinks) > close]
        return tuple(sorted({*kinks, *net}))

    @cached_property
    def _net_times(self) -> tuple[float, ...]:
        """Times at which the angle passes the net angle [s]."""
        grid = np.linspace(0.0, self.law.duration, GRID_POINTS)
        above = self.law.motion(grid).angle >= self.truss.net_angle
        return tuple(self._net_time(*grid[k : k + 2]) for k in np.flatnonzero(np.diff(above)))

    def _net_time(self, low: float, high: float) -> float:
        above = self.law.motion(high).angle[0] >= self.truss.net_angle
        for _ in range(60):
            middle = (low + high) / 2
            beyond = self.law.motion(middle).angle[0] >= self.truss.net_angle
            low, high = (low, middle) if beyond == above else (middle, high)
        return high

    @cached_property
    def values(self) -> dict[str, float]:
        """Every quantity of `studies.truss.quantities` that truss and drive have, or of `only`."""
        found = {key: extreme.value for key, extreme in self.extremes.items()}
        values = ((key, quantity.value(self)) for key, quantity in QUANTITIES.items())
        return found | {key: value for key, value in values if value is not None}

    @cached_property
    def extremes(self) -> dict[str, Extreme]:
        """Peaks and least values, located between samples, and when they are taken."""
        # with the values before each edge, where a jerk may jump
        cells = [np.linspace(a, b, m) for a, b, m in self._cells(GRID_POINTS, 5)]
        before = [np.nextafter(cell[-1:], 0.0) for cell in cells]
        grid = np.unique(np.concatenate([*cells, *before]))
        return self._located(grid, self.histories(grid))

    def histories(self, time: Array) -> dict[str, Array]:
        """What the extremes are taken of, at times (m,)."""
        along = Histories(self, time)
        wanted = (key for key in QUANTITIES if self.only is None or key in self.only)
        found = (
            (key, QUANTITIES[key].history(along))
            for key in wanted
            if self._has_drive_for(QUANTITIES[key].needs)
        )
        return {key: values for key, values in found if values is not None}

    def _has_drive_for(self, needs: str) -> bool:
        """Whether the drive has what a quantity needs of it; nothing may be needed of a drive."""
        if needs not in ("drum_radius", "torque_speed", "motor_inertia"):
            return True
        return self.drive is not None and bool(getattr(self.drive, needs))

    def motor(self, truss: TrussMotion) -> MotorAtWork:
        """One motor while the truss moves like this, (m,)."""
        wound = float(rope_length(self.truss, self.truss.stowed_angle)) - truss.rope_length
        rows = truss.rope_force, -truss.rope_speed, -truss.rope_acceleration
        return MotorAtWork(self.drive, *rows, wound)

    def motor_energy(self) -> Array:
        """Energy that both motors have given so far, that of their rotors included (m,) [J].

        It is at the ropes, as their power, and at the times of `energies`.
        """
        if self.drive is None or not self.drive.motor_inertia:
            return self.energies.motor
        inertia = self.drive.efficiency * self.drive.motor_inertia
        motor = self.motor(self.at(self.energies.time)[1])
        return self.energies.motor + np.asarray(inertia * motor.shaft_speed**2)

    @cached_property
    def rope_swing(self) -> RopeSwing:
        """What the truss does on ropes that give; the motor winds in what the law takes of them."""
        stated = self.drive
        assert stated is not None
        assert stated.rope_stiffness is not None
        ropes = stated.rope_stiffness, stated.rope_yields
        return rope_swing(self.truss, self.law, *ropes, winds_stretch=stated.plan_stretch)

    @cached_property
    def swing_with_one_behind(self) -> RopeSwing | None:
        """The same with the stretch wound in and one motor behind the other; None if none is."""
        stated = self.drive
        if stated is None or stated.rope_stiffness is None or stated.rope_delay is None:
            return None
        ropes = stated.rope_stiffness, stated.rope_yields
        return rope_swing(
            self.truss, self.law, *ropes, winds_stretch=True, behind=stated.rope_delay
        )

    def _located(self, grid: Array, sampled: Mapping[str, Array]) -> dict[str, Extreme]:
        """Extremes of histories that are sampled on a grid, all of them refined at once."""
        signs = {key: -1.0 if QUANTITIES[key].kind == "least" else 1.0 for key in sampled}
        known = [key for key, values in sampled.items() if np.isfinite(values).all()]
        highest = {key: np.argsort(-signs[key] * sampled[key])[:CANDIDATES] for key in known}
        owners = [key for key in known for _ in highest[key]]
        places = np.array([place for key in known for place in highest[key]], dtype=int)

        def signed(times: Array) -> Array:
            histories = self.histories(times.ravel())
            rows = [histories[key].reshape(times.shape)[k] for k, key in enumerate(owners)]
            return np.array([signs[key] for key in owners])[:, None] * rows

        left = grid[np.maximum(places - 1, 0)]
        right = grid[np.minimum(places + 1, grid.size - 1)]
        peaks = peaks_in(signed, left, right, ZOOM_POINTS)

        found = dict.fromkeys(sampled, Extreme(float("nan"), float("nan")))
        for key in known:
            own = [peak for peak, owner in zip(peaks, owners, strict=True) if owner == key]
            best = max(own, key=lambda peak: peak.value)
            found[key] = Extreme(signs[key] * best.value, best.where)
        return found

    def _cells(self, total: int, least: int) -> list[tuple[float, float, int]]:
        """Pieces (start, end, points), `total` points shared out by length."""
        return [
            (a, b, max(least, round(total * (b - a) / self.law.duration)))
            for a, b in pairwise(self.edges)
        ]

    @cached_property
    def energies(self) -> Energies:
        """Energy histories by Gauss quadrature on cells split at every kink."""
        cells = [np.linspace(a, b, m + 1) for a, b, m in self._cells(GAUSS_CELLS, 2)]
        time = np.concatenate([cells[0], *(cell[1:] for cell in cells[1:])])
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        half = np.diff(time) / 2
        between = ((time[:-1] + half)[:, None] + half[:, None] * nodes).ravel()
        _, inside = self.at(between)
        _, ends = self.at(time)

        def integral(power: Array) -> Array:
            parts = half * (power.reshape(half.size, GAUSS_POINTS) @ weights)
            return np.concatenate([[0.0], np.cumsum(parts)])

        arm: Array | float = 0.0
        if self.arm is not None:
            arm = self.arm.energy(time) + integral(self.arm.damped(between))
        return Energies(
            time=time,
            arm=arm,
            motor=integral(inside.motor_power),
            kinetic=ends.kinetic_energy - ends.kinetic_energy[0],
            potential=ends.potential_energy - ends.potential_energy[0],
            joints=integral(inside.joint_power),
            pulleys=integral(inside.pulley_power),
        )


@dataclass(frozen=True, eq=False)
class Histories:
    """Histories of a deployment at some times, for the rows of quantities: shape (m,) each.

    Those of the margins and the arm are None where the deployment has none.

    Attributes
    ----------
    deployment : Deployment
    time : (m,) [s].
    """

    deployment: Deployment
    time: Array

    @cached_property
    def law(self) -> AngularMotion:
        """Angle and its rates."""
        return self.deployment.law.motion(self.time)

    @cached_property
    def truss(self) -> TrussMotion:
        """What the truss does."""
        return self.deployment.at(self.time)[1]

    @property
    def rope_jerk(self) -> Array:
        """Of one rope [m/s^3]."""
        law = self.law
        return _rope_jerks(self.deployment.truss, law.angle, law.speed, law.acceleration, law.jerk)

    @property
    def least_tension(self) -> Array:
        """Of all segments of a rope [N]."""
        return np.minimum(self.truss.rope_force, self.truss.far_end_tension)

    @property
    def root_moment(self) -> Array | None:
        """Modulus of the moment about the arm's root [N m]."""
        arm = self.deployment.arm
        return None if arm is None else np.abs(arm.root_moment(self.time))

    @property
    def root_momentum(self) -> Array | None:
        """Modulus of the angular momentum at the arm's root [N m s]."""
        arm = self.deployment.arm
        return None if arm is None else np.abs(arm.angular_momentum(self.time))

    def largest(self, rows: Sequence[Array]) -> Array:
        """At each time, of several histories."""
        return np.asarray(np.max(rows, axis=0))

    @cached_property
    def motor(self) -> MotorAtWork:
        """One motor."""
        return self.deployment.motor(self.truss)

    @property
    def _rows(self) -> tuple[Array, Array, Array]:
        truss = self.truss
        return truss.angle[None], truss.speed[None], truss.acceleration[None]

    @property
    def needed_of_the_motor(self) -> Array | None:
        """What the motor must be able to pull for the margins [N]."""
        motion = self.deployment
        if motion.margin is None:
            return None
        needs = need_kernel(motion.margin, motion.truss, motion.drive, motion.opening)(*self._rows)
        return np.asarray(needs.full().max(axis=0))

    @property
    def needed_at_standstill(self) -> Array | None:
        """What its stall force must be for the margins [N]."""
        motion = self.deployment
        if motion.margin is None:
            return None
        kernel = standstill_kernel(motion.margin, motion.drive, motion.truss, motion.opening)
        return None if kernel is None else np.asarray(kernel(*self._rows).full().max(axis=0))


def _rope_jerks(truss: TrussParameters, *motion: Array) -> Array:
    """Jerk of the rope [m/s^3] along angle, speed, acceleration and jerk, (m,) each."""
    (found,) = elementwise(_rope_jerk_kernel(truss), *motion)
    return found.ravel()


@lru_cache(maxsize=8)
def _rope_jerk_kernel(truss: TrussParameters) -> ca.Function:
    symbols = [ca.SX.sym(name) for name in ("alpha", "omega", "acc", "jerk")]
    return ca.Function("rope_jerk", symbols, [rope_jerk(truss, *symbols)], {"cse": True})


def profile(deployment: Deployment, samples: int = SAMPLES) -> dict[str, Array]:
    """All of `COLUMNS` at even times and at kinks, shape (m,) each."""
    return columns_at(deployment, _profile_times(deployment, samples))


def travel_of(deployment: Deployment) -> Travel | None:
    """The margins along the rows of the profile; None where none are asked for."""
    if deployment.margin is None:
        return None
    return travel_at(deployment, _profile_times(deployment, SAMPLES))


def travel_at(deployment: Deployment, time: Array) -> Travel:
    """The margins that are asked for, at times (m,) in [0, T]."""
    assert deployment.margin is not None
    motion = deployment.law.motion(time)
    rows = (motion.angle, motion.speed, motion.acceleration)
    of_it = (deployment.margin, deployment.truss, deployment.drive)
    return along(*of_it, time, rows, deployment.opening)


def columns_at(deployment: Deployment, time: Array) -> dict[str, Array]:
    """All of `COLUMNS` at times (m,) in [0, T], shape (m,) each."""
    motion, truss = deployment.at(time)
    before = deployment.law.motion(np.nextafter(time, 0.0))
    tip = {} if deployment.arm is None else dict(zip(TIP, deployment.arm.tip(time), strict=True))
    return {
        "time": time,
        "rope_length": truss.rope_length,
        "rope_speed": truss.rope_speed,
        "rope_acceleration": truss.rope_acceleration,
        "motor_force": truss.rope_force,
        "far_end_tension": truss.far_end_tension,
        "motor_power": deployment.motor(truss).power,
        "angle": motion.angle,
        "angular_speed": motion.speed,
        "angular_acceleration": motion.acceleration,
        "angular_acceleration_before": before.acceleration,
        "angular_jerk": motion.jerk,
        "angular_jerk_before": before.jerk,
        "reaction_force": truss.reaction_force,
        "joint_power": truss.joint_power,
        "pulley_power": truss.pulley_power,
        "kinetic_energy": truss.kinetic_energy,
        "potential_energy": truss.potential_energy,
        **tip,
    }


def how_to_read(deployment: Deployment) -> dict[str, str]:
    """What the head of a profile says of its rows: which columns jump, and what is between them."""
    edges = np.array(deployment.edges)
    after = deployment.law.motion(edges)
    before = deployment.law.motion(np.nextafter(edges, 0.0))
    jumps = np.abs(after.acceleration - before.acceleration)
    largest = max(np.abs(after.acceleration).max(), np.abs(before.acceleration).max())
    if (jumps > JUMP * largest).any():
        columns = (
            "angular_acceleration and all that follows from it: rope_acceleration, motor_force, "
            "far_end_tension, motor_power, reaction_force, pulley_power"
        )
    else:
        columns = "angular_jerk"
    return {
        "columns_that_jump": f"{columns}; a row holds the values after the jump, and a column "
        "that ends in _before those before it",
        "between_two_rows": "the quintic polynomial with angle, angular_speed and "
        "angular_acceleration of the first row, and angle, angular_speed and "
        "angular_acceleration_before of the second; straight lines leave jumps in the speed",
    }


def _profile_times(deployment: Deployment, samples: int) -> Array:
    """Times of all kinks, and others between: dense where it moves, and where a reader needs it."""
    law = deployment.law
    even, spacing = np.linspace(0.0, law.duration, samples, retstep=True)
    edges = np.array(deployment.edges)

    # a row for each small part of the stroke, and of the rise and fall of the speed
    fine = np.unique(np.concatenate([even, *(np.linspace(a, b, 9) for a, b in pairwise(edges))]))
    motion = law.motion(fine)
    stroke = law.end_angle - law.start_angle
    changes = np.abs(np.diff(motion.angle)) / stroke
    changes += np.abs(np.diff(motion.speed)) / np.abs(motion.speed).max()
    moved = np.concatenate([[0.0], np.cumsum(changes)])
    count = int(moved[-1] / LARGEST_STEP) + 1
    # where it stands still the inverse jumps, and even rows are enough
    dense = np.interp(np.linspace(0.0, moved[-1], count), moved, fine)
    dense = dense[np.diff(dense, append=np.inf) < CLOSE * spacing]

    time = np.unique(np.concatenate([even, dense]))
    time = np.unique(np.concatenate([time[_far_from(edges, time)], edges]))
    for _ in range(HALVINGS):
        missed = _misread(deployment, time)
        if not missed.any():
            break
        time = np.sort(np.concatenate([time, (time[:-1] + time[1:])[missed] / 2]))
    return time


def _misread(deployment: Deployment, time: Array) -> Flags:
    """After which rows quintics, as the profile's head states, miss the forces, shape (m - 1,)."""
    motion, _ = deployment.at(time)
    before = deployment.law.motion(np.nextafter(time, 0.0)).acceleration
    rows = Hermite(time, motion.angle, motion.speed, motion.acceleration, before)
    steps = np.diff(time)
    inside = (time[:-1, None] + steps[:, None] * np.array([0.25, 0.5, 0.75])).ravel()

    _, asked = deployment.at(inside)
    read = rows.motion(inside)
    # rounding beyond the rows is no motion
    angle = np.clip(read.angle, motion.angle.min(), motion.angle.max())
    speed = np.maximum(read.speed, min(asked.speed.min(), 0.0))
    torque = deployment.torque_of_arm(inside)
    found = evaluate_motion(deployment.truss, angle, speed, read.acceleration, torque=torque)
    allowed = READ * np.abs(asked.rope_force).max()
    off = np.abs(found.rope_force - asked.rope_force).reshape(-1, 3).max(axis=1) > allowed
    wide: Flags = steps > NARROWEST * deployment.law.duration
    return off & wide


def _far_from(edges: Array, time: Array) -> Array:
    """Whether each of the times (m,) keeps its distance from all edges, shape (m,).

    The distance is a share of the one to its own neighbour.
    """
    right = np.clip(np.searchsorted(edges, time), 1, edges.size - 1)
    nearest = np.minimum(np.abs(time - edges[right - 1]), np.abs(edges[right] - time))
    steps = np.diff(time)
    neighbour = np.minimum(np.append(steps, np.inf), np.insert(steps, 0, np.inf))
    far: Array = nearest > CLOSE * neighbour
    return far
