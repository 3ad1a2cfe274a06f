"""Rest-to-rest laws of a unit turn: the baselines.

Symbols: T duration [s], f shaper frequency [Hz].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.laws import Law, Piecewise, Step5, constant_acceleration
from models.laws.unit_turns import bezier, linear_torque, quintic
from studies.common.exit_codes import StudyError

ShaperKind = Literal["ZV", "ZVD"]
SHAPERS: dict[ShaperKind, tuple[tuple[float, float], ...]] = {
    # (delay in periods, weight) of an undamped mode; Singer and Seering (1990)
    "ZV": ((0.0, 0.5), (0.5, 0.5)),
    "ZVD": ((0.0, 0.25), (0.5, 0.5), (1.0, 0.25)),
}


def shaped_bang_bang(duration: float, frequency: float, kind: ShaperKind) -> Piecewise:
    """Bang-bang law of T minus the shaper's length, convolved with the shaper, lasting T.

    Raises
    ------
    StudyError
        If the shaper is longer than the motion.
    """
    impulses = SHAPERS[kind]
    core = duration - impulses[-1][0] / frequency
    if core <= 0:
        raise StudyError(
            f"the {kind} shaper of {frequency:.4g} Hz lasts {duration - core:.4g} s, longer than "
            f"the motion of {duration:g} s; give a longer duration"
        )

    # each impulse of the shaper repeats the jumps of the bang-bang law, delayed and weighed
    height = 4.0 / core**2
    jumps: dict[float, float] = {}
    for delay, weight in impulses:
        for at, jump in ((0.0, height), (core / 2, -2 * height), (core, height)):
            instant = round(delay / frequency + at, 14)
            jumps[instant] = jumps.get(instant, 0.0) + weight * jump

    edges = sorted(jumps)
    levels = np.cumsum([jumps[t] for t in edges])[:-1]
    return constant_acceleration((*edges[:-1], duration), levels.tolist())


@dataclass(frozen=True)
class NamedLaw:
    """A unit law with its name, and whether its acceleration jumps."""

    name: str
    law: Law
    jumps: bool = False


UNIT_LAWS: dict[str, Callable[[float], Law]] = {
    "linear torque": linear_torque,
    "quintic": quintic,
    "Step5": lambda duration: Step5(duration, 0.0, 1.0),
    "Bezier": bezier,
}


def unit_law(name: str, duration: float) -> NamedLaw:
    """One of `UNIT_LAWS` over a duration [s]; only the linear torque jumps."""
    return NamedLaw(name, UNIT_LAWS[name](duration), jumps=name == "linear torque")
