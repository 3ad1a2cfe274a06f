"""The force on each rope by its contributions, multiplied by their uncertainty factors.

Symbols: f0 [m] generalised force of both ropes without pulley friction, f with it; k uncertainty
factors; J, U, D, C inertia, potential, damping and Coulomb friction of the truss, and B what a test
bench adds: weight and friction of the off-load (`models.truss.dynamics`).

    F0 = k_i (J acc + J' omega^2 / 2) / f0 + (k_s U_s' + k_n U_n') / f0 + k_h H
         + (k_j D_j + k_l D_l) omega / f0 + k_m M / f0 + (k_c C + k_b B) / f0
    F  = F0 (1 + k_p (f0 / f - 1)) + k_r R

Pulley friction is a share of the tension, so its factor acts on the factored rest. R [N] is what
the rotor takes of the motor's force; it reaches no pulley. Inertia that helps is not multiplied: of
F with k_i and F with 1 the larger one counts, and with k_r and 1 likewise.

Every function takes and gives CasADi expressions, and none grows with the number of modules.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import casadi as ca

from models.numerics import dense_peak
from models.truss import (
    Net,
    Opening,
    TrussParameters,
    coulomb_torque,
    gravity_slope,
    inertia,
    inertia_slope,
    joint_damping,
    potential_slope,
    rope_acceleration,
    rope_length,
    rope_leverage,
    rope_speed,
    whole_opening,
    with_symbols,
)
from models.truss.measured import torque_at
from studies.drive.motor import rotor_force
from studies.drive.schema import Drive
from studies.margin.schema import LoadCase, MarginRequirements

AT_REST = ("springs", "net", "coulomb_friction", "test_bench", "holding", "measured")
IN_MOTION = ("inertia", "joint_friction", "slider_friction")
CONTRIBUTIONS = (*IN_MOTION, *AT_REST, "pulley_friction", "rotor")

Motion = tuple[Any, Any, Any]  # angle, speed and acceleration of the truss


def contributions(
    margin: MarginRequirements, case: LoadCase, motion: Motion, net: Net = "by angle"
) -> dict[str, Any]:
    """Factored contributions to F0 [N on each rope], inertia with its factor though it may help."""
    (alpha, omega, acc), truss, factors = motion, case.truss, case.factors
    without = rope_leverage(_only(truss, pulley_friction=0.0, other_pulleys=()), alpha)

    # what moves: of each friction the truss with that one alone
    inertial = inertia(truss, alpha) * acc + inertia_slope(truss, alpha) * omega**2 / 2
    in_joints = joint_damping(_only(truss, slider_friction=0.0), alpha) * omega
    in_sliders = joint_damping(_only(truss, joint_friction=0.0), alpha) * omega

    # what holds the truss at rest: the net only pulls, a spring may also help
    in_space = _only(truss, gravity=(0.0, 0.0, 0.0))
    of_springs = potential_slope(_only(in_space, net_stiffness=0.0), alpha, net)
    of_net = potential_slope(_only(in_space, spring_stiffness=0.0), alpha, net)
    hung = coulomb_torque(_only(truss, joint_coulomb=0.0, slider_coulomb=0.0), alpha)
    rough = coulomb_torque(_only(truss, off_load_friction=0.0), alpha)
    weight = _resisting(gravity_slope(truss, alpha), factors.test_bench)
    measured = 0 * alpha
    if curve := margin.resistance or truss.measured_torque:
        measured = torque_at(curve, factors.measured, alpha)

    return {
        "inertia": factors.inertia * inertial / without,
        "joint_friction": factors.joint_friction * in_joints / without,
        "slider_friction": factors.slider_friction * in_sliders / without,
        "springs": _resisting(of_springs, factors.springs) / without,
        "net": factors.net * of_net / without,
        "coulomb_friction": factors.coulomb_friction * rough / without,
        "test_bench": (weight + factors.test_bench * hung) / without,
        "holding": factors.holding * case.holding + 0 * alpha,
        "measured": measured / without,
    }


def with_pulleys(case: LoadCase, force: Any, alpha: Any) -> Any:
    """F [N] of an F0, with the pulleys' factored friction."""
    if case.truss.pulley_friction == 0.0 and not case.truss.other_pulleys:
        return force
    without = rope_leverage(_only(case.truss, pulley_friction=0.0, other_pulleys=()), alpha)
    share = without / rope_leverage(case.truss, alpha) - 1
    return force * (1 + case.factors.pulley_friction * share)


def of_the_rotor(drive: Drive | None, truss: TrussParameters, motion: Motion) -> Any:
    """R [N on each rope] of angle, speed and acceleration, without a factor; 0 without a rotor."""
    alpha, omega, _ = motion
    wound = rope_length(truss, truss.stowed_angle) - rope_length(truss, alpha)
    winding = -rope_speed(truss, alpha, omega), -rope_acceleration(truss, *motion)
    return rotor_force(drive, *winding, wound)


def required_forces(
    margin: MarginRequirements,
    case: LoadCase,
    motion: Motion,
    net: Net = "by angle",
    drive: Drive | None = None,
) -> Mapping[str, tuple[Any, ...]]:
    """Factored force [N on each rope] at rest and in motion, before margin and derating.

    Parameters
    ----------
    drive : whose rotor counts; None where there is none.

    Returns
    -------
    mapping of str to tuple
        "static" and "dynamic"; of several expressions the largest counts.
    """
    alpha, parts = motion[0], contributions(margin, case, motion, net)
    resting = sum(parts[name] for name in AT_REST)
    moving = resting + parts["joint_friction"] + parts["slider_friction"]
    inertias = {
        1.0: parts["inertia"] / case.factors.inertia,
        case.factors.inertia: parts["inertia"],
    }
    rotors: dict[float, Any] = {1.0: 0.0}
    if drive is not None and drive.motor_inertia > 0.0:
        plain = of_the_rotor(drive, case.truss, motion)
        rotors = {1.0: plain, case.factors.rotor: case.factors.rotor * plain}
    return {
        "static": (with_pulleys(case, resting, alpha),),
        "dynamic": tuple(
            with_pulleys(case, moving + one, alpha) + rotor
            for one in inertias.values()
            for rotor in rotors.values()
        ),
    }


def needed_of_the_motor(
    margin: MarginRequirements,
    truss: TrussParameters,
    motion: Motion,
    net: Net = "by angle",
    drive: Drive | None = None,
    opening: Opening | None = None,
) -> tuple[Any, ...]:
    """What the motor must be able to pull [N on each rope], new and at its best.

    The largest counts. Each required force, times one plus the required margin, over what
    derating leaves. What is needed at rest is the same for all motions: its peak along the travel
    stands there as a number, or its expressions where the truss has unknown parameters.
    """
    known = isinstance(truss, TrussParameters)
    at_rest = (
        [least_static_need(margin, truss, opening)]
        if known
        else static_needs(margin, truss, motion[0], net)
    )
    return (*at_rest, *needed_in_motion(margin, truss, motion, net, drive))


def needed_in_motion(
    margin: MarginRequirements,
    truss: TrussParameters,
    motion: Motion,
    net: Net,
    drive: Drive | None,
) -> list[Any]:
    """What the motor must be able to pull in motion [N], in each load case."""
    _, wanted = margin.required
    return [
        (1 + wanted) / case.derating.whole * force
        for case in margin.load_cases(truss)
        for force in required_forces(margin, case, motion, net, drive)["dynamic"]
    ]


@lru_cache(maxsize=32)
def least_static_need(
    margin: MarginRequirements, truss: TrussParameters, opening: Opening | None = None
) -> float:
    """What the motor must be able to pull in any motion between two angles [N], by default all."""
    alpha, ends = ca.SX.sym("alpha"), opening or whole_opening(truss)
    needs = static_needs(margin, truss, alpha)
    kernel = ca.Function("needs", [alpha], [ca.vertcat(*needs)], {"cse": True})
    peak = dense_peak(
        lambda angle: kernel(angle[None]).full().max(axis=0),
        ends.start,
        ends.end,
        breakpoints=(truss.net_angle,),
    )
    return float(peak.value)


def static_needs(
    margin: MarginRequirements, truss: TrussParameters, alpha: Any, net: Net = "by angle"
) -> list[Any]:
    """What the motor must be able to pull at rest [N], in each load case."""
    wanted, _ = margin.required
    return [
        (1 + wanted) / case.derating.whole * force
        for case in margin.load_cases(truss)
        for force in required_forces(margin, case, (alpha, 0.0, 0.0), net)["static"]
    ]


def _only(truss: TrussParameters, **changes: Any) -> TrussParameters:
    # a part of the truss needs no check of its own, and no second warning
    return with_symbols(truss, **changes)


def _resisting(force: Any, factor: float) -> Any:
    """A force with its factor where it resists."""
    return force if factor == 1.0 else force + (factor - 1) * ca.fmax(force, 0)
