r"""Forces in the bars of any module, by statics with inertia forces; compression is positive.

Half a cross-bar turns about its bar end, its link about the slider:

    slider o                u [-] along the cross-bar, from its bar end to the middle joint
            \ link           p [-] along the link, from the slider to its joint at the crank
    bar end  o crank        p . u = (c sin^2 - h cos) / d,   u x p = e sin / d
       o=====o=======o      h [m] height of the link, e - c cos
              middle joint, which passes the hoop force N along the side and the shear V upward

The balances of a slider, of half a cross-bar along itself, and of a vertical bar give, at rest,

    link            F = d (mean t - S) / (2 h) +- b d V / (c e)
    outer part      P = T + N sin -+ V cos               of a cross-bar, outside of its crank
    inner part      P - F (p . u)                        from bar end to crank
    vertical bar    V_{m+1} - V_m                        at its middle, behind module m
    moment          (b - c) (N cos +- V sin)             in a cross-bar at its crank

with the upper sign for the left half of a module, seen from outside with the motor on the left: t
and V are in `shear`, T is the tension of the rope along that half, S = k1 (l0 - e). The moments of
half a cross-bar about its bar end then balance as well, for T1 as in (38).

Slider friction and the joint torques act too, viscous ones (27) in motion and Coulomb's also at
rest, and the inertia of `inertia_loads`.
N presses the corners outward against net and inertia. The ring's centre moves, as one corner is
fixed, and the fixed bar's reaction drives it. Its part that is the same at all corners works
against the opening, and is included: without it the forces would miss (38). What is left of it
moves the ring as a whole and bends it; that is left out. Weight and friction of a test bench enter
in the same way, by their parts of the hoop force. A measured load acts as a torque at the bar ends.

Symbols: T1 [N] motor force on one rope; alpha [rad], omega [rad/s], acc [rad/s^2].
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import casadi as ca

from models.truss.friction import off_load_push
from models.truss.gravity import gravity_push
from models.truss.inertia_loads import InertiaLoads, inertia_loads, inertia_push
from models.truss.kinematics import (
    Expression,
    link_height,
    link_ratio,
    slider_distance,
    slider_distance_slope,
)
from models.truss.parameters import TrussParameters
from models.truss.potential import Net, net_stretch
from models.truss.rope import module_tension
from models.truss.shear import (
    extreme_modules,
    mean_slider_pull,
    module_shear,
    shear_per_pull,
    slider_pull,
)

KINDS = ("link", "outer_cross_bar", "inner_cross_bar")  # of bars in a module, all but the vertical
SIDES = ("left", "right")


class BarForces(NamedTuple):
    """Axial forces in the bars of a module [N], a pull negative, and the moment at the crank.

    Each but the vertical bar is a pair: left and right half of the module, seen from outside.
    """

    link: tuple[Expression, Expression]
    outer_cross_bar: tuple[Expression, Expression]  # from the crank to the middle joint
    inner_cross_bar: tuple[Expression, Expression]  # from the bar end to the crank
    vertical_bar: Expression  # at its middle, behind the module
    crank_moment: tuple[Expression, Expression]  # bends the cross-bar, at the outer side [N m]


def bar_forces(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    tension: Expression,
    module: Expression,
    net: Net = "by angle",
    self_stress: Expression = 0.0,
) -> BarForces:
    """Forces in the bars of a module 1..n under the motor force `tension` [N] on each rope.

    Parameters
    ----------
    module : which one, from the motor; an expression if you like, or a row of several.
    self_stress : shear that is the same in all modules [N], on top of the one with zero mean.
    """
    c, b, d = parameters.crank, parameters.half_cross_bar, parameters.link
    e, h = slider_distance(parameters, alpha), link_height(parameters, alpha)
    sine, cosine = ca.sin(alpha), ca.cos(alpha)
    along, across = (c * sine**2 - h * cosine) / d, e * sine / d  # p . u and u x p

    loads = inertia_loads(parameters, alpha, omega, acc)
    viscous, rough = parameters.joint_friction * omega, parameters.joint_coulomb
    twist = (viscous * (1 + 2 * link_ratio(parameters, alpha)) + 2 * rough) / d
    bend = 2 * viscous + rough  # of the middle joint
    shear = self_stress + module_shear(parameters, alpha, tension, module)
    push = hoop_force(parameters, alpha, omega, acc, net)

    mean = _mean_link(parameters, alpha, omega, tension, loads, twist)

    def half(sign: int, rope: Expression) -> tuple[Expression, ...]:
        link = mean + sign * b * d / (c * e) * shear
        of_ends = _dot(loads.middle, sine, -cosine) + _dot(loads.outer, sine, -cosine)
        outer = rope + push * sine - sign * shear * cosine - of_ends
        inner = outer - link * along + twist * across - _dot(loads.crank, sine, -cosine)
        pressed = push * cosine + sign * shear * sine - _dot(loads.middle, cosine, sine)
        return link, outer, inner, (b - c) * pressed + bend

    ropes = module_tension(parameters, alpha, tension, module)
    link, outer, inner, moment = zip(half(1, ropes[0]), half(-1, ropes[1]), strict=True)

    pull = slider_pull(parameters, alpha, tension, module)
    more = pull - mean_slider_pull(parameters, alpha, tension)
    lifted = 2 * sum(load[1] for load in loads)  # by the inertia of both halves beside the bar
    vertical = shear_per_pull(parameters, alpha) * more - lifted
    return BarForces(link, outer, inner, vertical, moment)


def extreme_bar_forces(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    tension: Expression,
    net: Net = "by angle",
) -> dict[str, Expression]:
    """Forces in links and cross-bars among which is the largest of the ring [N], by name.

    The tension falls along the ring while the shear is least at its ends, so cross-bars carry most
    there; links do so where the shear is largest or least. The number of forces does not grow with
    n: 12, or 3 without friction, and more only with the number of pulleys that differ. Each is
    smooth in the angle but where the net becomes taut.
    """
    # of alike modules the first link carries no more than the last; of runs any end may be largest
    skipped = dict.fromkeys(KINDS, "between")
    skipped["link"] = "none" if parameters.other_pulleys else "first"
    found: dict[str, Expression] = {}
    for place, forces in extreme_modules_forces(parameters, alpha, omega, acc, tension, net):
        for kind, pair in zip(KINDS, forces[:3], strict=True):
            if place == "any":
                found[kind] = pair[0]
            elif not place.startswith(skipped[kind]):
                found |= {f"{side}_{kind}_{place}": pair[k] for k, side in enumerate(SIDES)}
    return found


def extreme_modules_forces(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    tension: Expression,
    net: Net = "by angle",
) -> list[tuple[str, BarForces]]:
    """Names of the modules of `extreme_modules`, and the forces in each.

    The modules stand in one row: what does not depend on them is worked out once.
    """
    modules = extreme_modules(parameters, alpha)
    row = ca.horzcat(*(module + 0 * alpha for module in modules.values()))
    alpha, omega, acc, tension = (
        _repeated(value, len(modules)) for value in (alpha, omega, acc, tension)
    )
    forces = bar_forces(parameters, alpha, omega, acc, tension, row, net)
    parts = zip(*(_split(found, len(modules)) for found in forces), strict=True)
    return [(name, BarForces(*found)) for name, found in zip(modules, parts, strict=True)]


def _repeated(value: Expression, times: int) -> Expression:
    """What goes with a row of angles, as often; a single value serves them all."""
    several = hasattr(value, "columns") and value.columns() > 1
    return ca.repmat(value, 1, times) if several else value


def _split(found: Any, count: int) -> list[Any]:
    """A row in equal parts; of a pair of rows, the pairs of their parts."""
    if isinstance(found, tuple):
        return list(zip(*(_split(side, count) for side in found), strict=True))
    parts: list[Any] = ca.horzsplit(found, found.columns() // count)
    return parts


def largest_bar_force(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    tension: Expression,
    net: Net = "by angle",
) -> Expression:
    """Largest push or pull in a link or cross-bar of the ring [N]; its slope may jump.

    Of several angles, a row of them, it is the largest.
    """
    forces = extreme_bar_forces(parameters, alpha, omega, acc, tension, net)
    return ca.mmax(ca.fabs(ca.horzcat(*forces.values())))


def hoop_force(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    acc: Expression,
    net: Net = "by angle",
) -> Expression:
    """N [N], by which neighbouring modules push each other apart along one face of the ring."""
    half = math.sin(math.pi / parameters.modules)
    radius = parameters.half_cross_bar / half
    of_net = parameters.net_stiffness * radius * net_stretch(parameters, alpha, net)
    of_bench = gravity_push(parameters) + off_load_push(parameters)
    return of_net / (2 * half) + of_bench + inertia_push(parameters, alpha, omega, acc)


def _mean_link(
    parameters: TrussParameters,
    alpha: Expression,
    omega: Expression,
    tension: Expression,
    loads: InertiaLoads,
    twist: Expression,
) -> Expression:
    """Mean force in the links [N], from the balance of all sliders."""
    spring = parameters.spring_stiffness * (
        parameters.spring_free_length - slider_distance(parameters, alpha)
    )
    viscous = -parameters.slider_friction * slider_distance_slope(parameters, alpha) * omega
    rubbing = viscous + parameters.slider_coulomb
    lean = 2 * twist * parameters.crank * ca.sin(alpha) / parameters.link
    pull = mean_slider_pull(parameters, alpha, tension) - spring - rubbing - lean
    return parameters.link / (2 * link_height(parameters, alpha)) * (pull + 2 * loads.slider[1])


def _dot(force: tuple[Expression, Expression], x: Expression, z: Expression) -> Expression:
    return force[0] * x + force[1] * z
