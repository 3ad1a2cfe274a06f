"""Shear through the middle joints, which pulley friction causes; nothing grows with n.

Slider m, between the modules m and m + 1, is pulled by the last segment of module m and the first
of module m + 1; the last slider, on the fixed bar, by the last and the first of the whole rope.
The hoop force is the same in all modules, so the deviation of this pull t_m from its mean is
passed on from module to module:

    V_{m+1} - V_m = kappa (t_m - mean t),   kappa = c e / (h b),   t_m = T1 (q + y) q^(m-1) or,
                                                                   for m = n, T1 (1 + y q^(n-1))

with q = exp(-x), x = 4 mu (pi - alpha), of (29); y = exp(-mu (3 pi - 4 alpha)) over one module.
The sums are geometric series. They close round the ring; the constant that they leave, a uniform
self-stress, is such that the V_m have zero mean: this gives the links the least norm. V is concave
in m, so it is least at an end, where V_1 >= V_n, and largest where t is as its mean.

Symbols: V [N] upward push of the upper half-module on the left on that on the right, on the upper
face; the lower face mirrors it. T1 [N] motor force on one rope; e, h [m] as in `bar_forces`.
"""

from __future__ import annotations

import math

import casadi as ca

from models.truss.kinematics import Expression, link_height, slider_distance
from models.truss.parameters import TrussParameters
from models.truss.rope import decay_mean, decay_moment

_NO_FRICTION = 1e-9  # of x: below it the largest V is some 1e-8 of T1, wherever it is


def shear_per_pull(parameters: TrussParameters, alpha: Expression) -> Expression:
    """Step kappa of V for a unit of pull on a slider."""
    arm = parameters.crank * slider_distance(parameters, alpha)
    return arm / (parameters.half_cross_bar * link_height(parameters, alpha))


def module_shear(
    parameters: TrussParameters, alpha: Expression, tension: Expression, module: Expression
) -> Expression:
    """V of a module [N] under the motor force `tension` [N]; `module` from 1 to n, not only whole.

    A module may be an expression, and its index continuous: between whole numbers V is smooth.
    """
    x, q, y = _decay(parameters, alpha)
    n, before = parameters.modules, module - 1
    first, all_ = decay_mean(x), decay_mean(n * x)

    # sum of q^0 .. q^(m-2), less its mean over the modules m = 1..n
    passed = before * decay_mean(before * x)
    mean = (n * decay_moment(n * x) - decay_moment(x)) / first
    pulled = (q + y) * (passed - mean) - (1 + y) * all_ * (before - (n - 1) / 2)
    return shear_per_pull(parameters, alpha) * tension * pulled / first


def extreme_modules(parameters: TrussParameters, alpha: Expression) -> dict[str, Expression]:
    """The modules at both ends, and the one where V is largest.

    The last one may lie between two modules: its index is continuous, which makes V smooth, and
    for a ring of 24 at most half a percent larger. Without friction any module stands for all.
    """
    mu, n = parameters.pulley_friction, parameters.modules
    if isinstance(mu, int | float) and mu == 0:
        return {"any": 1}
    x, q, y = _decay(parameters, alpha)
    rubs = x > _NO_FRICTION
    ratio = (1 + y) * decay_mean(n * x) / (q + y)
    passed = ca.if_else(rubs, -ca.log(ratio) / ca.if_else(rubs, x, 1), (n - 1) / 2)
    return {"first": 1, "last": n, "between": 1 + passed}


def slider_pull(
    parameters: TrussParameters, alpha: Expression, tension: Expression, module: Expression
) -> Expression:
    """Pull of a rope on the slider behind a module 1..n-1 [N], and for module n on the last."""
    x, q, y = _decay(parameters, alpha)
    last = module == parameters.modules
    decay = ca.exp(-(module - 1) * x)
    return tension * ca.if_else(last, 1 + y * decay, (q + y) * decay)


def mean_slider_pull(
    parameters: TrussParameters, alpha: Expression, tension: Expression
) -> Expression:
    """Mean of the pulls of a rope on the n sliders of a face [N]."""
    x, _, y = _decay(parameters, alpha)
    return tension * (1 + y) * decay_mean(parameters.modules * x) / decay_mean(x)


def _decay(
    parameters: TrussParameters, alpha: Expression
) -> tuple[Expression, Expression, Expression]:
    """x, and what is left of a tension a module later, q, and at its last segment, y."""
    mu = parameters.pulley_friction
    x = 4 * mu * (math.pi - alpha)
    return x, ca.exp(-x), ca.exp(-mu * (3 * math.pi - 4 * alpha))
