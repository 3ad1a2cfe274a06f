"""What unit laws of many durations leave on B21: one Runge-Kutta run, all durations abreast.

The steps of each law end on its breakpoints. Modes too fast for the step are damped: smooth laws
are right to 1e-3, what a jump of torque leaves is some per cent too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from models.arm.reduced_simulation import reduced_modes
from models.laws import Law
from studies.arm.laws.rigid import feed_forward, joint_motion
from studies.arm.replay.ensemble import angle_driven, runge_kutta, torque_driven
from studies.arm.replay.full import Drive
from studies.arm.stage import Stage

Array = NDArray[np.float64]
_STABLE = 2.2  # step times the fastest mode's angular frequency; the method's limit is 2.8
_ABREAST = 64  # laws at a time, for memory
_AWAY = 1e-9  # share of a step by which values at breakpoints are taken inside


def left_by_laws(stage: Stage, laws: Sequence[Law], drive: Drive) -> Array:
    """E_res on B21 [J] of each law (m,) after the lock at its end; one joint turns.

    Raises
    ------
    ModelError
        If the stage turns both joints.
    """
    found = np.empty(len(laws))
    alike: dict[int, list[int]] = {}
    for place, law in enumerate(laws):
        alike.setdefault(len(law.breakpoints), []).append(place)
    for places in alike.values():
        for part in range(0, len(places), _ABREAST):
            some = places[part : part + _ABREAST]
            found[some] = _abreast(stage, [laws[i] for i in some], drive)
    return found


def _abreast(stage: Stage, laws: Sequence[Law], drive: Drive) -> Array:
    """The same of laws with equally many breakpoints."""
    lanes, longest = len(laws), _step(stage.lasting(1.0))
    edges = np.array([(0.0, *law.breakpoints, law.duration) for law in laws])
    advance, energy, start = _machine(stage.lasting(1.0), drive, lanes)
    y, nominal = np.tile(start[:, None], lanes), np.ones(3)
    for low, high in pairwise(edges.T):
        steps = int(np.ceil((high - low).max() / longest))
        h = (high - low) / steps
        share = np.linspace(0.0, 1.0, 2 * steps + 1)
        share[[0, -1]] = _AWAY / steps, 1.0 - _AWAY / steps
        times = low[:, None] + (high - low)[:, None] * share
        given = np.stack([_given(stage, law, drive, t) for law, t in zip(laws, times, strict=True)])
        for k in range(steps):
            now = np.concatenate(given[:, :, 2 * k : 2 * k + 3], axis=1)
            y = advance(y, now, nominal, h)
    return np.asarray(energy(y, given[:, :, -1].T, nominal).full())[0]


def _given(stage: Stage, law: Law, drive: Drive, t: Array) -> Array:
    """Torque (1, m), or angle with two derivatives (3, m), of the joint that turns."""
    k = stage.moving[0]
    if drive == "torque":
        return feed_forward(stage, law)(t)[k : k + 1]
    return np.stack([part[k] for part in joint_motion(stage, law, t)])


@lru_cache(maxsize=32)
def _machine(stage: Stage, drive: Drive, lanes: int) -> tuple[ca.Function, ca.Function, Array]:
    """One step and the energy left of many arms of the stage, and the state they start from."""
    rate, energy, start = _equations(stage, drive)
    advance = runge_kutta(rate).map("advance", "serial", lanes, [2], [])
    return advance, energy.map("energy", "serial", lanes, [2], []), start


@lru_cache(maxsize=8)
def _equations(stage: Stage, drive: Drive) -> tuple[ca.Function, ca.Function, Array]:
    return (torque_driven if drive == "torque" else angle_driven)(stage, True)


@lru_cache(maxsize=8)
def _step(stage: Stage) -> float:
    """Longest stable step [s] for the fastest mode along the stage."""
    angles = (np.array(stage.start) + share * stage.turn for share in np.linspace(0.0, 1.0, 9))
    fastest = max(reduced_modes(stage.model, stage.model.at(*a))[0][-1] for a in angles)
    return float(_STABLE / (2 * np.pi * fastest))
