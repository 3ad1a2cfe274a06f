"""Pulleys whose friction differs from that of all others, such as a seized one.

Pulley k = 1..4 of a module lies behind its k-th rope segment: bar end, middle joint, bar end, and
the slider to the next module. Between modules with such a pulley lie runs of alike modules, whose
tensions are geometric series: what is summed up here grows with the list of pulleys, not with n.

Symbols: mu [-]; alpha [rad]; q = exp(-x), x = 4 mu (pi - alpha), what is left of a tension a module
later.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from models.truss.kinematics import Expression
from models.truss.parameters import TrussParameters


class LikeModules(NamedTuple):
    """Modules one after the other in which the tensions fall alike, or a single other one."""

    first: int
    length: int
    ratios: tuple[Expression, ...]  # T / T1 of the four segments of its first module


def turns(alpha: Expression) -> tuple[Expression, ...]:
    """Angles by which the rope wraps the four pulleys of a module [rad]."""
    return math.pi - alpha, math.pi - 2 * alpha, math.pi - alpha, math.pi


def segment_ratio(
    parameters: TrussParameters, alpha: Expression, module: Expression, segment: int
) -> Expression:
    """T / T1 of segment 1..4 of a module, (29); a module may be an expression."""
    mu = parameters.pulley_friction
    within = 0 * alpha, math.pi - alpha, 2 * math.pi - 3 * alpha, 3 * math.pi - 4 * alpha
    wrap = 4 * (module - 1) * (math.pi - alpha) + within[segment - 1]
    return ca.exp(-mu * wrap - more_friction(parameters, alpha, module, segment))


def more_friction(
    parameters: TrussParameters, alpha: Expression, module: Expression, segment: int
) -> Expression:
    """Sum of (mu_k - mu) times the wrap over the other pulleys between motor and a segment."""
    total: Expression = 0.0
    wraps = turns(alpha) if parameters.other_pulleys else ()
    for place, pulley, mu in parameters.other_pulleys:
        more = (mu - parameters.pulley_friction) * wraps[pulley - 1]
        passed = 4 * module + segment > 4 * place + pulley
        total = total + ca.if_else(passed, more, 0.0)
    return total


def runs(parameters: TrussParameters, alpha: Expression) -> list[LikeModules]:
    """All modules as runs, from the motor on; one if no pulley differs."""
    found, start = [], 1
    for module in sorted({place for place, _, _ in parameters.other_pulleys}):
        if module > start:
            found.append((start, module - start))
        found.append((module, 1))
        start = module + 1
    if start <= parameters.modules:
        found.append((start, parameters.modules - start + 1))
    return [
        LikeModules(
            first, length, tuple(segment_ratio(parameters, alpha, first, k) for k in (1, 2, 3, 4))
        )
        for first, length in found
    ]
