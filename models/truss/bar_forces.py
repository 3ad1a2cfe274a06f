"""Axial forces in the bars of a module, at the motor, by statics; compression is positive.

Cut free: a slider, half a cross-bar, and the ring between two modules. With T1 on the rope on
either side of the slider, and N the push of one face of the ring along a side,

    link          F = (2 T1 - k1 (l0 - e)) d / (2 h)             from the slider
    cross-bar     T1 + N sin(alpha)                              from crank to middle joint
                  T1 + N sin(alpha) - F (c sin^2 - h cos) / d    from bar end to crank

with h = sqrt(d^2 - c^2 sin^2) and, for a taut net and a ring whose mass M sits at the bar ends,

    N = (k2 b (sin(alpha) - sin(alpha_c)) + M b (cos(alpha) acc - sin(alpha) omega^2) / (2 n))
        / (2 sin^2(pi/n))

The vertical bars carry no axial force at their middle. Bending, the masses of single bars, and the
friction of sliders, which unloads the links while the truss opens, are left out.

Without pulley friction all modules are alike, and these forces are the derivatives of the energy
by the members' lengths (virtual work). With it a rope loses force along the ring, and the ring
passes the difference on as shear, which is not modelled: links and bars then carry up to four
times what stands here.

Symbols: T1 [N] motor force on one rope; alpha [rad], omega [rad/s], acc [rad/s^2].
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from models.truss.inertia import total_mass
from models.truss.kinematics import Expression, slider_distance
from models.truss.parameters import TrussParameters
from models.truss.potential import Net, net_stretch


class BarForces(NamedTuple):
    """Compression in the bars at the motor [N]; a pull is negative."""

    link: Expression
    outer_cross_bar: Expression  # from the crank to the middle joint
    inner_cross_bar: Expression  # from the bar end to the crank


def bar_forces(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    tension: Expression,
    net: Net = "by angle",
) -> BarForces:
    """Compression in the bars under the motor force `tension` [N] on each rope."""
    c, d = parameters.crank, parameters.link
    sine, cosine = ca.sin(alpha), ca.cos(alpha)
    e = slider_distance(parameters, alpha)
    height = e - c * cosine

    squeeze = parameters.spring_stiffness * (parameters.spring_free_length - e)
    link = (2 * tension - squeeze) * d / (2 * height)

    outer = tension + _ring_push(parameters, alpha, omega, acc, net) * sine
    inner = outer - link * (c * sine**2 - height * cosine) / d
    return BarForces(link, outer, inner)


def _ring_push(
    parameters: TrussParameters, alpha: Expression, omega: Expression, acc: Expression, net: Net
) -> Expression:
    """N [N], by which neighbours along one face of the ring push each other apart."""
    n, half = parameters.modules, math.sin(math.pi / parameters.modules)
    radius = parameters.half_cross_bar / half
    of_net = parameters.net_stiffness * radius * net_stretch(parameters, alpha, net)
    outward = radius * (ca.cos(alpha) * acc - ca.sin(alpha) * omega**2)
    return (of_net + total_mass(parameters) / (2 * n) * outward) / (2 * half)
