"""The two problems of the race, stated once for every contestant.

Both open the ring truss from 4.4 to 90 degrees, from rest to rest, with the jerk as the control:

    A   T = 140 s, |jerk| <= 124.2192 / T^3, least peak of |acceleration|
    B   T = 5 s, |jerk| <= 200 / T^3, least peak of the rope force, with force and speed >= 0

Symbols: alpha [rad] angle of the truss; omega, acc [rad/s, rad/s^2] its rates; T1 [N] rope force;
J [kg m^2] inertia; D [N m s] damping; U [N m] potential energy; f [m] leverage of the ropes;
e [m] height of a slider.

This file stands alone, so that a contestant in whatever environment states the same problem. It
imports nothing heavy, because the time of imports is measured. A test holds the rope force against
`models.truss`.
"""

from __future__ import annotations

import math
from typing import Any

START, END = math.radians(4.4), math.pi / 2  # alpha at both ends [rad], where all rates are zero
DURATION = {"A": 140.0, "B": 5.0}  # T [s]
JERK_CAP = {"A": 124.2192 / 140.0**3, "B": 200.0 / 5.0**3}  # [rad/s^3]

# The dynamic set of the paper (DOI 10.1109/ACCESS.2019.2918614), with pulley friction 0.01.
MODULES = 24
HALF_BAR, CRANK, LINK = 0.45, 0.1, 0.15  # [m]
PULLEY, JOINT, SLIDER = 0.01, 0.1, 0.1  # friction: [-], [N m s/rad], [N s/m]
SPRING, NET_STIFFNESS = 100.0, 200.0  # [N/m]
FREE_LENGTH = 0.3  # of a spring [m]
NET_TAUT = math.radians(80)  # alpha from which the net is taut [rad]

# J = cosine cos^2 + sine sin^2 + slide e'^2 - mixed sin e', eq. (23) summed over the modules.
# A prime is the derivative with respect to alpha.
COSINE, SINE, SLIDE, MIXED = 207.64031227463002, 0.3183336, 0.51552, 0.051552

# Numbers near one, as the peers are given them: time over T, jerk over its cap.
UNIT_JERK = {name: JERK_CAP[name] * DURATION[name] ** 3 for name in JERK_CAP}
UNIT_FORCE = 40.0  # [N]
UNIT_ACCELERATION = 4 * (END - START)  # that of a bang-bang motion in unit time [rad]


def rope_force(lib: Any, where: Any, alpha: Any, omega: Any, acc: Any) -> Any:
    """Rope force T1 [N], from J acc + J' omega^2 / 2 + D omega + U' = T1 f.

    Parameters
    ----------
    lib : module
        An algebra (CasADi, NumPy, SymPy) with sin, cos, exp and sqrt.
    where : function
        where(condition, this, else_that), element by element, of the same algebra.
    alpha, omega, acc : expressions
        Angle [rad] and its rates [rad/s, rad/s^2].
    """
    sine, cosine = lib.sin(alpha), lib.cos(alpha)

    # The slider's height e and its derivatives: a crank and a link above it.
    height = lib.sqrt(LINK**2 - (CRANK * sine) ** 2)
    g = CRANK * cosine / height
    e = CRANK * cosine + height
    slope = -CRANK * sine * (1 + g)  # e'
    bend = (CRANK * sine) ** 2 * (1 - g**2) / height - CRANK * cosine * (1 + g)  # e''

    inertia = COSINE * cosine**2 + SINE * sine**2 + SLIDE * slope**2 - MIXED * sine * slope
    inertia_slope = (
        2 * (SINE - COSINE) * sine * cosine
        + 2 * SLIDE * slope * bend
        - MIXED * (cosine * slope + sine * bend)
    )
    damping = MODULES * (JOINT * (12 + 4 * g**2 + 4 * (1 + g) ** 2) + 2 * SLIDER * slope**2)

    # Springs act always, the net only once it is taut.
    net_lever = (HALF_BAR / math.sin(math.pi / MODULES)) ** 2
    net = 2 * MODULES * NET_STIFFNESS * net_lever * (sine - math.sin(NET_TAUT)) * cosine
    springs = -2 * MODULES * SPRING * (FREE_LENGTH - e) * slope
    potential_slope = springs + where(alpha >= NET_TAUT, net, 0 * net)

    # Friction lowers the tension at every pulley: a geometric series over the modules.
    x = 4 * PULLEY * (math.pi - alpha)
    series = (1 - lib.exp(-MODULES * x)) / (1 - lib.exp(-x))
    leverage = -2 * slope * series * (1 + lib.exp(-PULLEY * (3 * math.pi - 4 * alpha)))

    return (inertia * acc + inertia_slope * omega**2 / 2 + damping * omega + potential_slope) / (
        leverage
    )


def unit_force(lib: Any, where: Any, angle: Any, speed: Any, acc: Any) -> Any:
    """Rope force of B over `UNIT_FORCE`, its arguments in unit time; `lib`, `where` as above."""
    duration = DURATION["B"]
    force = rope_force(lib, where, angle, speed / duration, acc / duration**2)
    return force / UNIT_FORCE


def in_si_units(problem: str, times: Any, jerk: Any) -> tuple[Any, Any]:
    """Times [s] and jerk [rad/s^3] from times in [0, 1] and a jerk in [-1, 1]."""
    return times * DURATION[problem], jerk * JERK_CAP[problem]
