"""The force that inertia cannot save where the ridge of the static force is crossed.

A motion that crosses an angle with the speed omega and the deceleration d needs, from (38),

    T1 = (U' + C + I' omega^2 / 2 + D omega - I d) / f

on each rope. Caps on the rates bound both. No motion between two rests is faster at an angle than
the one that speeds up all the way from the nearer end. And it has to come to rest without going
back: with a jerk of at most j a deceleration d takes d^2 / (2 j) off the speed before it can end,
so that d <= sqrt(2 j omega). The least T1 over what is left holds for every motion, at each angle.
A factored force is such a sum, too.

Symbols: s [rad] way from the nearer end; v, A, j caps on speed, acceleration and jerk.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import casadi as ca
import numpy as np

from models.truss import (
    Opening,
    TrussParameters,
    inertia,
    inertia_slope,
    joint_damping,
    rope_leverage,
    static_torque,
    whole_opening,
)
from ocp.arrays import Array
from studies.margin.loads import required_forces
from studies.margin.schema import LoadCase, MarginRequirements
from studies.truss.limits.caps import Caps

ANGLES = 2001
SPEEDS = 101  # at each of the angles, to choose the one where the bound is computed


class RidgeForce(NamedTuple):
    """A force that every motion needs [N], on each rope, and the angle where it does [rad]."""

    force: float
    angle: float


@functools.lru_cache(maxsize=8)
def ridge_force(
    truss: TrussParameters, caps: Caps, opening: Opening | None = None
) -> RidgeForce | None:
    """Lower bound on the peak force, from caps on the rates of the angle; by default of it all.

    Any angle gives a bound. That of the highest one on a grid is computed without a grid of speeds.

    Returns
    -------
    RidgeForce or None
        None without a cap on jerk or acceleration.
    """
    return _ridge(functools.partial(_terms, truss), opening or whole_opening(truss), caps)


@functools.lru_cache(maxsize=8)
def ridge_need(
    margin: MarginRequirements, truss: TrussParameters, caps: Caps, opening: Opening | None = None
) -> RidgeForce | None:
    """Lower bound on what the motor must be able to pull for its margins, in the worst load case.

    Inertia counts without its factor, as where it helps: where it resists the need is larger.

    Returns
    -------
    RidgeForce or None
        None without a cap on jerk or acceleration.
    """
    found = []
    for case in margin.load_cases(truss):
        terms_at = functools.partial(_factored_terms, margin, case)
        bound = _ridge(terms_at, opening or whole_opening(truss), caps)
        if bound is None:
            return None
        share = (1 + margin.required[1]) / case.derating.whole
        found.append(RidgeForce(share * bound.force, bound.angle))
    return max(found)


def _ridge(terms_at: Callable[[Array], Array], opening: Opening, caps: Caps) -> RidgeForce | None:
    """The bound of a force that is a + b omega^2 + c omega + m acceleration, of angle (m,)."""
    if caps.jerk is None and caps.acceleration is None:
        return None
    alpha = np.linspace(opening.start, opening.end, ANGLES)[1:-1]
    terms = terms_at(alpha)
    top = _top_speed(opening, caps, alpha)

    # squares: what a deceleration saves rises steeply from rest
    omega = top * np.linspace(0.0, 1.0, SPEEDS)[:, None] ** 2
    highest = int(np.argmax(_force(terms, omega, _deceleration(caps, omega)).min(axis=0)))

    there = terms[:, highest]
    omega = _extremes(there, caps, float(top[highest]))
    least = float(_force(there, omega, _deceleration(caps, omega)).min())
    return RidgeForce(least, float(alpha[highest]))


def _terms(truss: TrussParameters, alpha: Array) -> Array:
    """a, b, c and m of T1 at angles (m,), shape (4, m)."""
    terms = (static_torque, inertia_slope, joint_damping, inertia, rope_leverage)
    slope, change, damping, mass, leverage = (
        term(truss, ca.DM(alpha)).full().ravel() for term in terms
    )
    return np.array([slope, change / 2, damping, mass]) / leverage


def _factored_terms(margin: MarginRequirements, case: LoadCase, alpha: Array) -> Array:
    """The same of the factored force of a load case, read off at four pairs of rates."""
    angle, rates = ca.SX.sym("angle"), ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0))
    helping = dataclasses.replace(case, factors=dataclasses.replace(case.factors, inertia=1.0))
    forces = [required_forces(margin, helping, (angle, *pair))["dynamic"][0] for pair in rates]
    kernel = ca.Function("terms", [angle], [ca.vertcat(*forces)], {"cse": True})

    rest, forth, back, moved = kernel(alpha[None]).full()
    return np.array([rest, (forth + back) / 2 - rest, (forth - back) / 2, moved - rest])


def _force(terms: Array, omega: Array, deceleration: Array) -> Array:
    rest, square, linear, mass = terms
    return np.asarray(rest + square * omega**2 + linear * omega - mass * deceleration)


def _top_speed(opening: Opening, caps: Caps, alpha: Array) -> Array:
    """Largest speed [rad/s] at angles (m,), from one end or to the other.

    A motion that is under way at its start has any acceleration there: no jerk bounds its speed.
    """
    way = opening.end - alpha
    speeds = [np.full_like(way, math.inf if caps.speed is None else caps.speed)]
    if not opening.rate:
        way = np.minimum(alpha - opening.start, way)
    elif caps.acceleration is not None:
        speeds.append(np.sqrt(opening.rate**2 + 2 * caps.acceleration * (alpha - opening.start)))
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
    _, square, linear, mass = terms
    ends = [0.0, top]
    roots = [np.roots([2 * square, linear])]
    if caps.jerk is not None:
        free = math.sqrt(2 * caps.jerk)
        roots.append(np.roots([4 * square, 0.0, 2 * linear, -mass * free]) ** 2)
        if caps.acceleration is not None:
            ends.append(min(top, caps.acceleration**2 / (2 * caps.jerk)))
    found = np.concatenate(roots)
    real = found[np.abs(found.imag) <= 1e-9 * np.abs(found)].real
    return np.concatenate([ends, real[(real > 0) & (real < top)]])
