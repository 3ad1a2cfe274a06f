"""Shear through the middle joints, which pulley friction causes; nothing grows with n.

Slider m, between the modules m and m + 1, is pulled by the last segment of module m and the first
of module m + 1; the last slider, on the fixed bar, by the last and the first of the whole rope.
The hoop force is the same in all modules, so the deviation of this pull t_m from its mean is
passed on from module to module:

    V_{m+1} - V_m = kappa (t_m - mean t),   kappa = c e / (h b),   t_m = T1 (q + y) q^(m-1) or,
                                                                   for m = n, T1 (1 + y q^(n-1))

with q = exp(-x), x = 4 mu (pi - alpha), of (29); y = exp(-mu (3 pi - 4 alpha)) over one module.
The sums are geometric series, one for each run of alike modules if some pulleys differ
(`pulleys`). They close round the ring; the constant that they leave, a uniform
self-stress, is such that the V_m have zero mean: this gives the links the least norm. In a run V is
concave in m, so it is least at an end, and largest where t is as its mean or at an end. If all
modules are alike V_1 >= V_n.

Symbols: V [N] upward push of the upper half-module on the left on that on the right, on the upper
face; the lower face mirrors it. T1 [N] motor force on one rope; e, h [m] as in `bar_forces`.
"""

from __future__ import annotations

import itertools
import math

import casadi as ca

from models.truss.kinematics import Expression, link_height, slider_distance
from models.truss.parameters import TrussParameters
from models.truss.pulleys import runs, segment_ratio
from models.truss.rope import decay_mean, decay_moment, mean_of_modules

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
    x, q, _ = _decay(parameters, alpha)
    n, first = parameters.modules, decay_mean(x)
    pull = mean_slider_pull(parameters, alpha, tension)
    alike = runs(parameters, alpha)

    # what the sliders of a run pass on up to this module, less its mean over the modules m = 1..n
    passed: Expression = 0.0
    for run in alike:
        c, before = run.length - 1, module - run.first
        if c == 0:
            continue
        if len(alike) > 1:
            before = ca.fmin(ca.fmax(before, 0), c)
        whole = c * decay_mean(c * x) / first
        falling = c * (c * decay_moment(c * x) - decay_moment(x)) / first**2  # of (c - 1 - k) q^k
        mean = ((n - run.first - (c - 1)) * whole + falling) / n
        upto = before * decay_mean(before * x) / first
        passed = passed + (run.ratios[3] + q * run.ratios[0]) * (upto - mean)
    # and the sliders between two runs
    for run, after in itertools.pairwise(alike):
        last = after.first - 1
        upto = ca.fmin(ca.fmax(module - last, 0), 1)
        both = run.ratios[3] * ca.exp(-(run.length - 1) * x) + after.ratios[0]
        passed = passed + both * (upto - (n - last) / n)

    shear = tension * passed - pull * (module - 1 - (n - 1) / 2)
    return shear_per_pull(parameters, alpha) * shear


def extreme_modules(parameters: TrussParameters, alpha: Expression) -> dict[str, Expression]:
    """The modules at both ends of each run, and the one where V is largest in it.

    The last one, "between", may lie between two modules: its index is continuous, which makes V
    smooth, and for a ring of 24 at most half a percent larger. Without friction any module stands
    for all.
    """
    mu, others = parameters.pulley_friction, parameters.other_pulleys
    if isinstance(mu, int | float) and mu == 0 and not others:
        return {"any": 1}
    x, q, _ = _decay(parameters, alpha)
    rubs = x > _NO_FRICTION
    mean = mean_slider_pull(parameters, alpha, 1.0)
    found: dict[str, Expression] = {}
    for number, run in enumerate(runs(parameters, alpha), start=1):
        mark = f"_{number}" if others else ""
        found[f"first{mark}"] = run.first
        if run.length == 1:
            continue
        # V rises by (r4 + q r1) exp(-k x) / D(x) a module less the mean, at a continuous k
        pull = run.ratios[0] * q + run.ratios[3]
        passed = -ca.log(mean * decay_mean(x) / pull) / ca.if_else(rubs, x, 1)
        passed = ca.if_else(rubs, passed, (run.length - 1) / 2)
        if others:  # it may be reached elsewhere
            passed = ca.fmin(ca.fmax(passed, 0), run.length - 1)
        found[f"last{mark}"] = run.first + run.length - 1
        found[f"between{mark}"] = run.first + passed
    return found


def slider_pull(
    parameters: TrussParameters, alpha: Expression, tension: Expression, module: Expression
) -> Expression:
    """Pull of a rope on the slider behind a module 1..n-1 [N], and for module n on the last."""
    last = module == parameters.modules
    after = ca.if_else(last, 1, segment_ratio(parameters, alpha, module + 1, 1))
    return tension * (after + segment_ratio(parameters, alpha, module, 4))


def mean_slider_pull(
    parameters: TrussParameters, alpha: Expression, tension: Expression
) -> Expression:
    """Mean of the pulls of a rope on the n sliders of a face [N]."""
    total: Expression = 0.0
    for run in runs(parameters, alpha):
        mean = run.length / parameters.modules * mean_of_modules(parameters, alpha, run.length)
        total = total + tension * (run.ratios[0] + run.ratios[3]) * mean
    return total


def _decay(
    parameters: TrussParameters, alpha: Expression
) -> tuple[Expression, Expression, Expression]:
    """x, and what is left of a tension a module later, q, and at its last segment, y."""
    mu = parameters.pulley_friction
    x = 4 * mu * (math.pi - alpha)
    return x, ca.exp(-x), ca.exp(-mu * (3 * math.pi - 4 * alpha))
