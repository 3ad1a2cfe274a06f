"""What the forces in the bars of all modules add to a result: checks, and what they leave open."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from models.truss import KINDS, RingForces, TrussParameters, play_angle, ring_forces
from ocp.arrays import Array
from studies.common.result import at_most
from studies.truss.limits.caps import Caps
from studies.truss.motions.deployment import Deployment
from studies.truss.parts import Parts

ROWS = 1201  # even instants; what a force exceeds between them is of second order
PLAY = 5e-5  # [m] of a slider along its bar, an assumption
NOTHING = 1e-6  # of the largest force in a link: less is no push or pull
BUCKLING = "peak-buckling-load"


def bars_of(deployment: Deployment, caps: Caps) -> Parts:
    """Limits on buckling and reversal, what self-stress may change, and the play of links."""
    time = np.union1d(np.linspace(0.0, deployment.law.duration, ROWS), deployment.edges)
    angle, forces = forces_of(deployment, time)

    buckling = at_most("part of a bar's buckling load", "1", deployment.values[BUCKLING], 1.0)
    if not buckling.passed:
        remedy = "; plan with --buckling-cap 1, in a study caps.buckling_load = 1"
        buckling = replace(buckling, sentence=buckling.sentence + remedy)
    checks = [buckling]
    if caps.link_reversal is not None:
        found = forces.reversal()
        checks.append(at_most("reversal of a link", "N", found, caps.link_reversal))
    moment = float(np.abs(forces.crank_moment).max())
    sentences = (
        *_self_stress(forces),
        f"The links bend the cross-bars at their cranks by up to {moment:.3g} N m.",
        *_play(deployment.truss, angle, forces),
    )
    return Parts(tuple(checks), sentences)


def forces_of(deployment: Deployment, time: Array) -> tuple[Array, RingForces]:
    """Angle [rad], (m,), and the forces in all bars at times (m,)."""
    motion, truss = deployment.at(time)
    return motion.angle, ring_forces(deployment.truss, truss.angle, truss.speed, truss.acceleration)


def _self_stress(forces: RingForces) -> tuple[str, ...]:
    """What the assembly of the ring may change; without shear the links are all alike."""
    free = [float(forces.least_largest(*kinds).max()) for kinds in ((), KINDS[:1], KINDS[1:])]
    found = [float(forces.largest(*kinds).max()) for kinds in ((), KINDS[:1], KINDS[1:])]
    if free[0] >= (1 - NOTHING) * found[0]:
        return ()
    return (
        f"Forces in the bars depend on the self-stress of the ring. With shears of zero mean the "
        f"largest is {found[0]:.4g} N (links {found[1]:.4g}, cross-bars {found[2]:.4g}); with the "
        f"best self-stress for each it is {free[0]:.4g} N (links {free[1]:.4g}, cross-bars "
        f"{free[2]:.4g}).",
    )


def _play(truss: TrussParameters, angle: Array, forces: RingForces) -> tuple[str, ...]:
    """Which links change between push and pull, and what their play is worth there."""
    links = forces.bars["link"].reshape(angle.size, -1)
    pushed = links > NOTHING * np.abs(links).max()
    pulled = links < -NOTHING * np.abs(links).max()
    turning = pushed.any(axis=0) & pulled.any(axis=0)
    if not turning.any():
        return ()

    changes = np.flatnonzero(np.diff(links[:, turning] > 0, axis=0).any(axis=1))
    low, high = (float(angle[k]) for k in (changes[0], changes[-1]))
    worth = [math.degrees(float(play_angle(truss, at, PLAY))) for at in (low, high)]
    return (
        f"{turning.sum()} of the {turning.size} links of a face are both pushed and pulled; the "
        f"smaller of the two forces is at most {forces.reversal():.4g} N. They cross their play "
        f"between {math.degrees(low):.4g} and {math.degrees(high):.4g} deg, where {1e3 * PLAY:g} "
        f"mm of play is worth {worth[0]:.2g} and {worth[1]:.2g} deg.",
    )
