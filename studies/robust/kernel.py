"""Rope force of any truss of the scenarios along a common motion, as one CasADi function.

It is mapped over the scenarios in the optimal control problem and over draws in the replay. A joint
that sticks adds a moment M s(alpha) against the motion, over a range of the angle: s is a squared
cosine, smooth, and 1 at the middle of the range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import casadi as ca

from models.truss import Net, TrussParameters, far_end_ratio, rope_force, with_symbols
from models.truss.rope import rope_leverage
from studies.robust.config import OF_THE_TRUSS, VARIED
from studies.truss.expressions import Pull


@lru_cache(maxsize=8)
def force_kernel(truss: TrussParameters, net: Net) -> ca.Function:
    """Function of alpha [rad], omega [rad/s], acc [rad/s^2] and values (len(VARIED),).

    It gives the motor's force on one rope and the tension at its far end [N].
    """
    alpha, omega, acc = (ca.SX.sym(name) for name in ("alpha", "omega", "acc"))
    values = ca.SX.sym("values", len(VARIED))
    named = dict(zip(VARIED, ca.vertsplit(values), strict=True))
    uncertain = with_symbols(truss, **{word: named[word] for word in OF_THE_TRUSS})

    middle, width = (named[f"stuck_{word}_deg"] * math.pi / 180 for word in ("angle", "width"))
    aside = alpha - middle
    share = ca.if_else(2 * ca.fabs(aside) < width, ca.cos(math.pi * aside / width) ** 2, 0)
    stuck = named["stuck_moment"] * share / rope_leverage(uncertain, alpha)
    force = rope_force(uncertain, alpha, omega, acc, net) + stuck
    far = force * far_end_ratio(uncertain, alpha)
    return ca.Function("force", [alpha, omega, acc, values], [force, far], {"cse": True})


def pull_of(truss: TrussParameters, scenarios: Sequence[Sequence[float]]) -> Pull:
    """Forces and far-end tensions in all scenarios, for the problem: the kernel, mapped."""
    values = ca.DM(list(scenarios)).T

    def pull(alpha: Any, omega: Any, acc: Any, net: Net) -> tuple[tuple[Any, ...], ...]:
        mapped = force_kernel(truss, net).map(values.shape[1])
        both = mapped(*(ca.repmat(s, 1, values.shape[1]) for s in (alpha, omega, acc)), values)
        return tuple(tuple(ca.horzsplit(row)) for row in both)

    return pull
