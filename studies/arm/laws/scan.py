"""What unit laws of many durations leave on B21: one Runge-Kutta run, all durations abreast.

The steps of each law end on its breakpoints. Modes too fast for the step are damped: smooth laws
are right to 1e-3, what a jump of torque leaves is some per cent too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from models.laws import Law
from ocp.arrays import Array
from studies.arm.laws.rigid import feed_forward, joint_motion
from studies.arm.replay.full_model import Drive
from studies.arm.replay.reduced_model import arm_equations, fastest_rate, march
from studies.arm.stage import Stage

_STABLE = 2.2  # step times the fastest mode's rate; the method's limit is 2.6
_ABREAST = 64  # laws at a time, for memory
_AWAY = 1e-9  # share of a step by which values at breakpoints are taken inside


def left_by_laws(stage: Stage, laws: Sequence[Law], drive: Drive) -> Array:
    """E_res on B21 [J] of each law (m,) after the lock at its end; one joint turns.

    Raises
    ------
    ModelError
        If the stage turns both joints.
    """
    # laws with equally many breakpoints take their steps together
    alike: dict[int, list[int]] = {}
    for place, law in enumerate(laws):
        alike.setdefault(len(law.breakpoints), []).append(place)

    energies = np.empty(len(laws))
    for places in alike.values():
        for first in range(0, len(places), _ABREAST):
            some = places[first : first + _ABREAST]
            energies[some] = _abreast(stage, [laws[i] for i in some], drive)
    return energies


def _abreast(stage: Stage, laws: Sequence[Law], drive: Drive) -> Array:
    """E_res of laws with equally many breakpoints."""
    # equations and step do not depend on the duration: those of 1 s are found again in the cache
    unit, arms = stage.lasting(1.0), len(laws)
    equations = arm_equations(unit, drive, compiled=True)
    advance = equations.step.map("advance", "serial", arms, [2], [])
    longest = _STABLE / fastest_rate(unit, drive)
    state, nominal = np.tile(equations.start[:, None], arms), np.ones(3)

    edges = np.array([(0.0, *law.breakpoints, law.duration) for law in laws])
    for low, high in pairwise(edges.T):
        steps = int(np.ceil((high - low).max() / longest))
        share = np.linspace(0.0, 1.0, 2 * steps + 1)
        share[[0, -1]] = _AWAY / steps, 1.0 - _AWAY / steps
        times = low[:, None] + (high - low)[:, None] * share
        given = np.stack([_given(stage, law, drive, t) for law, t in zip(laws, times, strict=True)])
        inputs = [np.concatenate(given[:, :, 2 * k : 2 * k + 3], axis=1) for k in range(steps)]
        state = march(advance, state, inputs, nominal, (high - low) / steps)

    energy = equations.energy.map("energy", "serial", arms, [2], [])
    return np.asarray(energy(state, given[:, :, -1].T, nominal).full())[0]


def _given(stage: Stage, law: Law, drive: Drive, t: Array) -> Array:
    """Torque (1, m), or angle with two derivatives (3, m), of the joint that turns."""
    k = stage.moving[0]
    if drive == "torque":
        return feed_forward(stage, law)(t)[k : k + 1]
    return np.stack([part[k] for part in joint_motion(stage, law, t)])
