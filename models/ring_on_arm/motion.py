"""Numbers of the arm while its ring opens by a motion law: its states, its tip, what is left.

The law is given, so that the arm follows from it. It starts undeformed and at rest.

Symbols: q, v coordinates of the arm and their rates (4,); y = (q, v).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arm.split_steps import STABLE, STAGES, split_steps
from models.arrays import Array, elementwise
from models.laws import Law
from models.ring_on_arm.equations import RingOnArm
from models.truss import kinetic_energy

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

TOLERANCE = 1e-11  # of a step, for entries of the state of at most 1: 1e-9 of what a motion has
# Samples in a step that is stable for the fastest mode. The quintic between two of them is good to
# 1e-9 of a swing at 10 Hz, and faster ones are hardly there.
_SAMPLES = 2
_INSIDE = 1 - 1e-9  # of a step, up to which the law is asked: at its end another piece may begin


@dataclass(frozen=True, eq=False)
class ArmMotion:
    """The arm along a motion of its ring.

    Attributes
    ----------
    model : RingOnArm
    law : of the ring's angle.
    time : (m,) samples, all breakpoints of the law among them [s].
    q, v : (4, m) coordinates of the arm and their rates.
    """

    model: RingOnArm
    law: Law
    time: Array
    q: Array
    v: Array

    def at(self, time: ArrayLike) -> tuple[Array, Array]:
        """Coordinates and rates at times (k,) in [0, T], (4, k) each."""
        instants = np.atleast_1d(np.asarray(time, dtype=float))
        cell = np.clip(np.searchsorted(self.time, instants, side="right") - 1, 0, len(self) - 2)
        h = np.diff(self.time)[cell]
        s = (instants - self.time[cell]) / h
        first, last = self._accelerations
        terms = (
            *(self.q[:, cell], h * self.v[:, cell], h**2 * first[:, cell]),
            *(self.q[:, cell + 1], h * self.v[:, cell + 1], h**2 * last[:, cell]),
        )

        # the quintic with these values, rates and accelerations at both ends
        c = 1 - s
        of_first = (c**3 * (1 + 3 * s + 6 * s**2), c**3 * s * (1 + 3 * s), c**3 * s**2 / 2)
        of_last = (s**3 * (1 + 3 * c + 6 * c**2), -(s**3) * c * (1 + 3 * c), s**3 * c**2 / 2)
        rise = 30 * s**2 * c**2
        rates_first = (-rise, c**2 * (1 + 5 * s) * (1 - 3 * s), c**2 * s * (2 - 5 * s) / 2)
        rates_last = (rise, s**2 * (1 + 5 * c) * (1 - 3 * c), -(s**2) * c * (2 - 5 * c) / 2)
        q = sum(w * term for w, term in zip((*of_first, *of_last), terms, strict=True))
        v = sum(w * term for w, term in zip((*rates_first, *rates_last), terms, strict=True))
        return np.asarray(q), np.asarray(v / h)

    def torque(self, time: ArrayLike) -> Array:
        """By which the ropes have to do more than on a tip that is held, (k,) [N m]."""
        return self._along(time)[1].ravel()

    def tip(self, time: ArrayLike) -> Array:
        """Displacement of the tip along the straight arm and across it, (2, k) [m].

        Seen from the satellite.
        """
        moved = self._along(time)[2].T
        return moved - np.array([[self.model.arm.big.length + self.model.arm.small.length], [0.0]])

    def energy(self, time: ArrayLike) -> Array:
        """Of the arm, and of the ring by more than where the tip is held, (k,) [J]."""
        return self._along(time)[3].ravel()

    def damped(self, time: ArrayLike) -> Array:
        """Power that the arm's damping takes, (k,) [W]."""
        return self._along(time)[4].ravel()

    def root_moment(self, time: ArrayLike) -> Array:
        """Of the satellite on the arm about the root, (k,) [N m]."""
        return self._along(time)[5].ravel()

    def angular_momentum(self, time: ArrayLike) -> Array:
        """Handed to the satellite, (k,) [N m s]."""
        return self._along(time)[6].ravel()

    def satellite_turn(self, time: ArrayLike) -> Array:
        """Angle of a satellite that is free, (k,) [rad]; zero of one that is held."""
        instants = np.atleast_1d(np.asarray(time, dtype=float))
        H = self.model.satellite_inertia
        return np.zeros(instants.size) if H is None else -self._handed(instants) / H

    @cached_property
    def _handed(self) -> CubicHermiteSpline:
        """Integral of the angular momentum over the time [N m s^2]."""
        from scipy.interpolate import CubicHermiteSpline

        # Gauss's rule of three points, exact for the quintic between two samples
        h = np.diff(self.time)
        nodes, weights = np.polynomial.legendre.leggauss(3)
        inside = (self.time[:-1, None] + h[:, None] * (1 + nodes) / 2).ravel()
        each = self.angular_momentum(inside).reshape(-1, 3) @ weights * h / 2
        rates = self.angular_momentum(self.time)
        return CubicHermiteSpline(self.time, np.append(0.0, np.cumsum(each)), rates)

    @property
    def residual_energy(self) -> float:
        """Left in arm and ring where the ring has opened [J]."""
        return float(self.model.residual_energy(self.q[:, -1], self.v[:, -1]))

    def __len__(self) -> int:
        """Number of samples m."""
        return self.time.size

    @cached_property
    def _accelerations(self) -> tuple[Array, Array]:
        """Of q where each cell begins and where it ends, (4, m - 1) each."""
        after = self._values(self.time[:-1], self.q[:, :-1], self.v[:, :-1])[0]
        before = np.nextafter(self.time[1:], 0.0)  # where the law's acceleration may jump
        return after.T, self._values(before, self.q[:, 1:], self.v[:, 1:])[0].T

    def _along(self, time: ArrayLike) -> list[Array]:
        return self._values(time, *self.at(time))

    def _values(self, time: ArrayLike, q: Array, v: Array) -> list[Array]:
        """Accelerations (k, 4), torque (k, 1), tip (k, 2), and four more of (k, 1).

        These are energy, damped power, moment at the root, and angular momentum handed on.
        """
        motion = self.law.motion(time)
        ring = (motion.angle, motion.speed, motion.acceleration)
        return elementwise(_kernel(self.model), *q, *v, *ring)


def arm_motion(model: RingOnArm, law: Law) -> ArmMotion:
    """The arm from rest while its ring opens by a law.

    Raises
    ------
    ModelError
        If no step of the integration is short enough.
    """
    ends = law.start_angle, law.end_angle
    fastest = 2 * math.pi * max(float(model.frequencies(angle)[-1]) for angle in ends)
    decay = model.arm.relaxation_time * fastest**2  # of a mode that its damping keeps from swinging
    longest = STABLE / max(fastest, decay)

    # no step goes over a breakpoint, where the acceleration may jump
    edges = np.array([0.0, *law.breakpoints, law.duration])
    counts = np.ceil(_SAMPLES * np.diff(edges) / longest).astype(int)
    inner = [
        np.linspace(begin, end, count, endpoint=False)
        for (begin, end), count in zip(pairwise(edges), counts, strict=True)
    ]
    times = np.append(np.concatenate(inner), law.duration)

    def ring(instants: Array) -> Array:
        stages = instants.reshape(-1, STAGES)
        begin, width = stages[:, :1], np.ptp(stages, axis=1, keepdims=True)
        motion = law.motion(np.minimum(stages, begin + _INSIDE * width).ravel())
        return np.array([motion.angle, motion.speed, motion.acceleration])

    path = split_steps(_rates(model), np.zeros(8), times, ring, longest, TOLERANCE)
    return ArmMotion(model, law, times, path[:4], path[4:])


@lru_cache(maxsize=8)
def _rates(model: RingOnArm) -> ca.Function:
    """`(y, (alpha, omega, acc)) -> its rate`."""
    y, ring = ca.SX.sym("y", 8), ca.SX.sym("ring", 3)
    acceleration, _ = model.response(y[:4], y[4:], ring[0], ring[1], ring[2])
    return ca.Function("rates", [y, ring], [ca.vertcat(y[4:], acceleration)], {"cse": True})


@lru_cache(maxsize=8)
def _kernel(model: RingOnArm) -> ca.Function:
    """Eight entries of the state, then angle, speed and acceleration of the ring."""
    y, ring = ca.SX.sym("y", 8), ca.SX.sym("ring", 3)
    q, v = y[:4], y[4:]
    kinetic = model.kinetic_energy(q, v, ring[0], ring[1])
    energy = kinetic - kinetic_energy(model.truss, ring[0], ring[1]) + model.strain_energy(q)
    damped = 2 * model.arm.relaxation_time * model.strain_energy(v)  # v^T C v
    state = q, v, ring[0], ring[1], ring[2]
    loads = model.root_moment(*state), model.angular_momentum(*state[:4])
    rows = [*model.response(*state), model.tip(q), energy, damped, *loads]
    inputs = [*ca.vertsplit(y), *ca.vertsplit(ring)]
    return ca.Function("arm", inputs, [ca.densify(row) for row in rows], {"cse": True})
