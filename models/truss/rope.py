"""Tension along the two ropes, their generalised force and the loss at their pulleys, (28)-(35).

Symbols: T1 [N] force of the motor on one rope; f [m] generalised force of both ropes per T1;
mu pulley friction; alpha [rad]; omega [rad/s]; n modules; e [m] slider distance, e' [m/rad].

Seen from the motor a rope runs, in each module, from slider to bar end (e), along two half
cross-bars (b, b) and from bar end to slider (e). Its far end is fixed, so the rope passes over
a pulley at the rate at which all segments beyond that pulley shorten.

The rope is taken to run towards the motor (omega >= 0): with mu > 0 nothing here holds for
omega < 0, where the friction would act the other way.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from models.arrays import Array
from models.truss.kinematics import (
    Expression,
    rope_speed,
    slider_distance,
    slider_distance_slope,
)
from models.truss.parameters import TrussParameters
from models.truss.pulleys import runs, segment_ratio, turns

_SERIES_TERMS = 8  # for z <= 1/2 the first neglected term is 3e-23, its second derivative 4e-20


def tension_ratios(parameters: TrussParameters, alpha: Expression) -> Expression:
    """T_k / T1 of all segments k = 1..4n of a rope, shape (4n,), (29). It grows with n."""
    places = [(module, k) for module in range(1, parameters.modules + 1) for k in (1, 2, 3, 4)]
    return ca.vertcat(*(segment_ratio(parameters, alpha, *place) for place in places))


def module_tension(
    parameters: TrussParameters, alpha: Expression, tension: Expression, module: Expression
) -> tuple[Expression, Expression]:
    """Tension along the left and the right half of the cross-bars of a module 1..n [N], (29)."""
    left, right = (segment_ratio(parameters, alpha, module, segment) for segment in (2, 3))
    return tension * left, tension * right


def far_end_ratio(parameters: TrussParameters, alpha: Expression) -> Expression:
    """T_4n / T1, the tension of the last segment, (29)."""
    return segment_ratio(parameters, alpha, parameters.modules, 4)


def rope_leverage(parameters: TrussParameters, alpha: Expression) -> Expression:
    """f(alpha) [m], (34)-(35): T1 f is the generalised force of both ropes.

    The sum over modules is a geometric series of ratio exp(-x), x = 4 mu (pi - alpha), in each run.
    """
    slope, total = slider_distance_slope(parameters, alpha), 0.0
    for run in runs(parameters, alpha):
        first, _, _, last = run.ratios
        series = run.length * mean_of_modules(parameters, alpha, run.length)
        total = total - 2 * slope * series * (first + last)
    return total


def mean_tension_ratio(parameters: TrussParameters, alpha: Expression) -> Expression:
    """Mean of T_k / T1 along a rope, by the lengths e, b, b, e of the segments in each module."""
    e, b = slider_distance(parameters, alpha), parameters.half_cross_bar
    total: Expression = 0.0
    for run in runs(parameters, alpha):
        first, second, third, fourth = run.ratios
        mean = run.length / parameters.modules * mean_of_modules(parameters, alpha, run.length)
        total = total + mean * (e * (first + fourth) + b * (second + third)) / (2 * (e + b))
    return total


def mean_of_modules(parameters: TrussParameters, alpha: Expression, count: int) -> Expression:
    """Mean of exp(-i x) over i = 0..count-1, x = 4 mu (pi - alpha): of tensions in a run."""
    # the quotient of two means is the sum of the series over n, and 1 where the friction is zero
    x = 4 * parameters.pulley_friction * (math.pi - alpha)
    return decay_mean(count * x) / decay_mean(x)


def pulley_loss(
    parameters: TrussParameters, alpha: Expression, omega: Expression, tension: Expression
) -> Expression:
    """Power dissipated at the pulleys of both ropes [W]: motor power less what drives the truss.

    It equals the sum over pulleys of tension drop times speed of the rope over the pulley,
    where the rope beyond a pulley, up to its fixed far end, shortens through it.
    """
    motor_power = -2 * tension * rope_speed(parameters, alpha, omega)
    return motor_power - tension * rope_leverage(parameters, alpha) * omega


def pulley_loss_by_sum(
    parameters: TrussParameters, angle: ArrayLike, speed: ArrayLike, tension: ArrayLike
) -> Array:
    """Power dissipated at the pulleys of both ropes [W], shape (m,), pulley by pulley.

    It knows nothing of the sums in closed form above, which it serves to check.

    Parameters
    ----------
    angle, speed, tension : alpha [rad], omega [rad/s], T1 [N], shape (m,), omega >= 0.
    """
    alpha = np.atleast_1d(np.asarray(angle, dtype=float))
    slope = slider_distance_slope(parameters, ca.DM(alpha)).full().ravel()
    wound = -slope * np.asarray(speed, dtype=float)  # by each sliding segment [m/s]
    wraps = turns(alpha)
    others = {(module, pulley): mu for module, pulley, mu in parameters.other_pulleys}
    sliding = (1, 0, 0, 1)  # which of a module's segments change length

    # From the motor to the far end: the tension of the segment before each pulley, and the rate
    # at which the segments beyond it shorten.
    beyond = 2 * parameters.modules * wound
    segment_tension = np.asarray(tension, dtype=float) + 0 * alpha
    loss = np.zeros_like(alpha)
    for k in range(4 * parameters.modules - 1):
        beyond = beyond - sliding[k % 4] * wound
        mu = others.get((k // 4 + 1, k % 4 + 1), parameters.pulley_friction)
        drop = -segment_tension * np.expm1(-mu * wraps[k % 4])
        loss += 2 * drop * beyond  # on both ropes
        segment_tension = segment_tension - drop
    return loss


def decay_mean(y: Expression) -> Expression:
    """(1 - exp(-y)) / y, the mean of exp(-y s) over s in [0, 1], for y >= 0.

    Accurate to rounding with its derivatives, through y = 0: below 1 it is exp(-y/2) times a power
    series of sinh(y/2)/(y/2), above 1 the quotient. Each branch is only given arguments at which
    it is finite.
    """
    small = y < 1
    large = ca.if_else(small, 1, y)
    half = ca.if_else(small, y, 0) / 2
    return ca.if_else(small, ca.exp(-half) * _sinh_mean(half**2), (1 - ca.exp(-large)) / large)


def decay_moment(y: Expression) -> Expression:
    """(1 - decay_mean(y)) / y, the mean of s exp(-y (1 - s)) over s in [0, 1], for y >= 0.

    As accurate as `decay_mean`, through y = 0: below 1 by its own power series.
    """
    small = y < 1
    large, little = ca.if_else(small, 1, y), ca.if_else(small, y, 0)
    series: Expression = 1.0
    for k in range(2 * _SERIES_TERMS, 0, -1):
        series = 1 - little / (k + 2) * series
    return ca.if_else(small, series / 2, (1 - decay_mean(large)) / large)


def _sinh_mean(square: Expression) -> Expression:
    """Horner form of sinh(z)/z = sum z^2k / (2 k + 1)!, of the square of z."""
    total: Expression = 1.0
    for k in range(_SERIES_TERMS, 0, -1):
        total = 1 + square / (2 * k * (2 * k + 1)) * total
    return total
