"""The force that inertia cannot save where the ridge of the static force is crossed.

A motion that crosses an angle with the speed omega and the deceleration d needs, from (38),

    T1 = (U' + I' omega^2 / 2 + D omega - I d) / f

on each rope. Caps on the rates bound both. No motion between two rests is faster at an angle than
the one that speeds up all the way from the nearer end. And it has to come to rest without going
back: with a jerk of at most j a deceleration d takes d^2 / (2 j) off the speed before it can end,
so that d <= sqrt(2 j omega). The least T1 over what is left holds for every motion, at each angle.

Symbols: s [rad] way from the nearer end; v, A, j caps on speed, acceleration and jerk.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import casadi as ca
import numpy as np

from models.truss import (
    TrussParameters,
    inertia,
    inertia_slope,
    joint_damping,
    potential_slope,
    rope_leverage,
)
from ocp.arrays import Array
from studies.truss.config import DEPLOYED
from studies.truss.limits.caps import Caps

ANGLES = 2001
SPEEDS = 101  # at each of the angles, to choose the one where the bound is computed


class RidgeForce(NamedTuple):
    """A force that every motion needs [N], on each rope, and the angle where it does [rad]."""

    force: float
    angle: float


@functools.lru_cache(maxsize=8)
def ridge_force(truss: TrussParameters, caps: Caps) -> RidgeForce | None:
    """Lower bound on the peak force, from caps on the rates of the angle.

    Any angle gives a bound. That of the highest one on a grid is computed without a grid of speeds.

    Returns
    -------
    RidgeForce or None
        None without a cap on jerk or acceleration.
    """
    if caps.jerk is None and caps.acceleration is None:
        return None
    alpha = np.linspace(truss.stowed_angle, DEPLOYED, ANGLES)[1:-1]
    terms = _terms(truss, alpha)
    top = _top_speed(truss, caps, alpha)

    # squares: what a deceleration saves rises steeply from rest
    omega = top * np.linspace(0.0, 1.0, SPEEDS)[:, None] ** 2
    highest = int(np.argmax(_force(terms, omega, _deceleration(caps, omega)).min(axis=0)))

    there = terms[:, highest]
    omega = _extremes(there, caps, float(top[highest]))
    least = float(_force(there, omega, _deceleration(caps, omega)).min())
    return RidgeForce(least, float(alpha[highest]))


def _terms(truss: TrussParameters, alpha: Array) -> Array:
    """U', I', D, I and f at angles (m,), shape (5, m)."""
    terms = (potential_slope, inertia_slope, joint_damping, inertia, rope_leverage)
    return np.array([term(truss, ca.DM(alpha)).full().ravel() for term in terms])


def _force(terms: Array, omega: Array, deceleration: Array) -> Array:
    slope, inertia_change, damping, mass, leverage = terms
    torque = slope + inertia_change * omega**2 / 2 + damping * omega - mass * deceleration
    return np.asarray(torque / leverage)


def _top_speed(truss: TrussParameters, caps: Caps, alpha: Array) -> Array:
    """Largest speed [rad/s] at angles (m,), from one rest or to the other."""
    way = np.minimum(alpha - truss.stowed_angle, DEPLOYED - alpha)
    speeds = [np.full_like(way, math.inf if caps.speed is None else caps.speed)]
    if caps.acceleration is not None:
        speeds.append(np.sqrt(2 * caps.acceleration * way))
    if caps.jerk is not None:
        speeds.append(caps.jerk / 2 * (6 * way / caps.jerk) ** (2 / 3))
    return np.min(speeds, axis=0)


def _deceleration(caps: Caps, omega: Array) -> Array:
    """Largest deceleration [rad/s^2] at speeds [rad/s]."""
    most = np.full_like(omega, math.inf if caps.acceleration is None else caps.acceleration)
    return most if caps.jerk is None else np.minimum(most, np.sqrt(2 * caps.jerk * omega))


def _extremes(terms: Array, caps: Caps, top: float) -> Array:
    """Speeds up to `top` among which the least force of one angle is.

    Both branches of the deceleration are polynomials of the root of the speed. The least value is
    at a stationary point of one of them, where they meet, or at an end.
    """
    _, inertia_change, damping, mass, _ = terms
    ends = [0.0, top]
    roots = [np.roots([inertia_change, damping])]
    if caps.jerk is not None:
        free = math.sqrt(2 * caps.jerk)
        roots.append(np.roots([2 * inertia_change, 0.0, 2 * damping, -mass * free]) ** 2)
        if caps.acceleration is not None:
            ends.append(min(top, caps.acceleration**2 / (2 * caps.jerk)))
    found = np.concatenate(roots)
    real = found[np.abs(found.imag) <= 1e-9 * np.abs(found)].real
    return np.concatenate([ends, real[(real > 0) & (real < top)]])
