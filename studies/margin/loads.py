"""The force on each rope by its contributions, multiplied by their uncertainty factors.

Symbols: f0 [m] generalised force of both ropes without pulley friction, f with it; k uncertainty
factors; J, U, D inertia, potential and damping of the truss (`models.truss.dynamics`).

    F0 = k_i (J acc + J' omega^2 / 2) / f0 + (k_s U_s' + k_n U_n') / f0 + k_h H
         + (k_j D_j + k_l D_l) omega / f0 + k_m M / f0
    F  = F0 (1 + k_p (f0 / f - 1))

Pulley friction is a share of the tension, so its factor acts on the factored rest. Inertia that
helps is not multiplied: of F with k_i and F with 1 the larger one counts.

Every function takes and gives CasADi expressions, and none grows with the number of modules.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import casadi as ca

from models.numerics import dense_peak
from models.truss import (
    Net,
    TrussParameters,
    inertia,
    inertia_slope,
    joint_damping,
    potential_slope,
    rope_leverage,
    with_symbols,
)
from studies.margin.resistance import torque_at
from studies.margin.schema import LoadCase, MarginRequirements

OPEN = math.pi / 2
AT_REST = ("springs", "net", "holding", "measured")
IN_MOTION = ("inertia", "joint_friction", "slider_friction")
CONTRIBUTIONS = (*IN_MOTION, *AT_REST, "pulley_friction")


def contributions(
    margin: MarginRequirements,
    case: LoadCase,
    alpha: Any,
    omega: Any,
    acc: Any,
    net: Net = "by angle",
) -> dict[str, Any]:
    """Factored contributions to F0 [N on each rope], inertia with its factor though it may help."""
    truss, factors = case.truss, case.factors
    without = rope_leverage(_only(truss, pulley_friction=0.0), alpha)

    # what moves: of each friction the truss with that one alone
    inertial = inertia(truss, alpha) * acc + inertia_slope(truss, alpha) * omega**2 / 2
    in_joints = joint_damping(_only(truss, slider_friction=0.0), alpha) * omega
    in_sliders = joint_damping(_only(truss, joint_friction=0.0), alpha) * omega

    # what holds the truss at rest: the net only pulls, a spring may also help
    of_springs = potential_slope(_only(truss, net_stiffness=0.0), alpha, net)
    of_net = potential_slope(_only(truss, spring_stiffness=0.0), alpha, net)
    measured = 0 * alpha
    if margin.resistance is not None:
        measured = torque_at(margin.resistance, factors.measured, alpha)

    return {
        "inertia": factors.inertia * inertial / without,
        "joint_friction": factors.joint_friction * in_joints / without,
        "slider_friction": factors.slider_friction * in_sliders / without,
        "springs": _resisting(of_springs, factors.springs) / without,
        "net": factors.net * of_net / without,
        "holding": factors.holding * case.holding + 0 * alpha,
        "measured": measured / without,
    }


def with_pulleys(case: LoadCase, force: Any, alpha: Any) -> Any:
    """F [N] of an F0, with the pulleys' factored friction."""
    if case.truss.pulley_friction == 0.0:
        return force
    without = rope_leverage(_only(case.truss, pulley_friction=0.0), alpha)
    share = without / rope_leverage(case.truss, alpha) - 1
    return force * (1 + case.factors.pulley_friction * share)


def required_forces(
    margin: MarginRequirements,
    case: LoadCase,
    alpha: Any,
    omega: Any,
    acc: Any,
    net: Net = "by angle",
) -> Mapping[str, tuple[Any, ...]]:
    """Factored force [N on each rope] at rest and in motion, before margin and derating.

    Returns
    -------
    mapping of str to tuple
        "static" and "dynamic"; of several expressions the largest counts.
    """
    parts = contributions(margin, case, alpha, omega, acc, net)
    resting = _sum(parts[name] for name in AT_REST)
    moving = resting + parts["joint_friction"] + parts["slider_friction"]
    inertias = {
        1.0: parts["inertia"] / case.factors.inertia,
        case.factors.inertia: parts["inertia"],
    }
    return {
        "static": (with_pulleys(case, resting, alpha),),
        "dynamic": tuple(with_pulleys(case, moving + one, alpha) for one in inertias.values()),
    }


def needed_of_the_motor(
    margin: MarginRequirements,
    truss: TrussParameters,
    alpha: Any,
    omega: Any,
    acc: Any,
    net: Net = "by angle",
) -> tuple[Any, ...]:
    """What the motor must be able to pull [N on each rope], new and at its best.

    The largest counts. Each required force, times one plus the required margin, over what
    derating leaves. What is needed at rest is the same for all motions: its peak along the travel
    stands there as a number, or its expressions where the truss has unknown parameters.
    """
    known = isinstance(truss, TrussParameters)
    found = (
        [least_static_need(margin, truss)] if known else _static_needs(margin, truss, alpha, net)
    )
    _, wanted = margin.required
    for case in margin.load_cases(truss):
        forces = required_forces(margin, case, alpha, omega, acc, net)["dynamic"]
        found += [(1 + wanted) / case.derating.whole * force for force in forces]
    return tuple(found)


@lru_cache(maxsize=32)
def least_static_need(margin: MarginRequirements, truss: TrussParameters) -> float:
    """What the motor must be able to pull whatever the motion [N]: the largest static need."""
    alpha = ca.SX.sym("alpha")
    needs = _static_needs(margin, truss, alpha)
    kernel = ca.Function("needs", [alpha], [ca.vertcat(*needs)], {"cse": True})
    peak = dense_peak(
        lambda angle: kernel(angle[None]).full().max(axis=0),
        truss.stowed_angle,
        OPEN,
        breakpoints=(truss.net_angle,),
    )
    return float(peak.value)


def _static_needs(
    margin: MarginRequirements, truss: TrussParameters, alpha: Any, net: Net = "by angle"
) -> list[Any]:
    """What the motor must be able to pull at rest [N], in each load case."""
    wanted, _ = margin.required
    return [
        (1 + wanted) / case.derating.whole * force
        for case in margin.load_cases(truss)
        for force in required_forces(margin, case, alpha, 0.0, 0.0, net)["static"]
    ]


def _only(truss: TrussParameters, **changes: float) -> TrussParameters:
    # a part of the truss needs no check of its own, and no second warning
    return with_symbols(truss, **changes)


def _resisting(force: Any, factor: float) -> Any:
    """A force with its factor where it resists."""
    return force if factor == 1.0 else force + (factor - 1) * ca.fmax(force, 0)


def _sum(terms: Any) -> Any:
    total: Any = 0.0
    for term in terms:
        total = total + term
    return total
