"""The baselines of a stage by name, and the frequency of the shaped ones.

Angle drive: the locked frequency at the stage's end. Torque drive: the frequency of the free
joint; where it varies along the stage, the constant that leaves least on B21.
"""

from __future__ import annotations

from functools import lru_cache
from typing import get_args

import numpy as np

from models.ancf.analysis import natural_modes
from models.ancf.joints import Free, Locked
from models.ancf.state import posed
from models.arm.reduced_simulation import simulate_reduced
from ocp.arrays import Array
from studies.arm.laws.rigid import torque_drives
from studies.arm.laws.scan import left_by_laws
from studies.arm.laws.unit_laws import SHAPERS, NamedLaw, ShaperKind, shaped_bang_bang, unit_law
from studies.arm.replay.full_model import ELEMENTS, Drive
from studies.arm.replay.reduced_model import reduced_residual
from studies.arm.search_limits import (
    FREQUENCIES_OF_BOTH,
    FREQUENCIES_REFINED,
    FREQUENCIES_TRIED,
    LONGEST_SHAPER,
)
from studies.arm.stage import ELBOW, ROOT, Stage

SMOOTH = ("quintic", "Step5", "Bezier")
SHAPED: tuple[ShaperKind, ...] = get_args(ShaperKind)
_POSES = 25  # along the stage, at which the free frequency is found
_SAME = 1e-6  # relative difference of frequencies that counts as none


def baseline_names(drive: Drive) -> tuple[str, ...]:
    """All baselines; linear torque under torque drive only."""
    return ("linear torque", *SMOOTH, *SHAPED) if drive == "torque" else (*SMOOTH, *SHAPED)


def baseline_law(stage: Stage, name: str, drive: Drive) -> NamedLaw:
    """A baseline over the stage's duration."""
    for kind in SHAPED:
        if name == kind:
            f = shaper_frequency(stage, kind, drive)
            return NamedLaw(f"{kind} {f:.3f} Hz", shaped_bang_bang(stage.duration, f, kind), True)
    return unit_law(name, stage.duration)


@lru_cache(maxsize=32)
def locked_frequency(stage: Stage) -> float:
    """First frequency of the arm locked at the stage's end [Hz]."""
    chain = stage.arm.chain(ELEMENTS)
    rest = posed(chain, list(stage.end))
    joints = [Locked(angle) for angle in stage.end]
    return float(natural_modes(chain, joints, rest, count=1).frequencies[0])


@lru_cache(maxsize=32)
def free_frequencies(stage: Stage) -> tuple[float, ...]:
    """First elastic frequency with the joints that turn free, at even shares of the turn [Hz]."""
    chain, frequencies = stage.arm.chain(ELEMENTS), []
    for share in np.linspace(0.0, 1.0, _POSES):
        angles = np.array(stage.start) + share * stage.turn
        joints = [Free() if k in stage.moving else Locked(a) for k, a in enumerate(angles)]
        modes = natural_modes(chain, joints, posed(chain, list(angles)), count=1)
        frequencies.append(float(modes.frequencies[0]))
    return tuple(frequencies)


def varies(stage: Stage) -> bool:
    """Whether the free joints' frequency changes along the stage."""
    free = free_frequencies(stage.lasting(1.0))  # which no duration changes: found in the cache
    return max(free) - min(free) > _SAME * max(free)


def needs_search(stage: Stage, name: str, drive: Drive) -> bool:
    """Whether a baseline's shaper has to be sought at each duration."""
    return name in SHAPED and drive == "torque" and varies(stage)


def shaper_note(stage: Stage, drive: Drive) -> str:
    """What the shapers are tuned to, for a table."""
    if drive == "angle":
        return f"shapers: the locked frequency at the end, {locked_frequency(stage):.4g} Hz"
    free = free_frequencies(stage.lasting(1.0))
    if not varies(stage):
        return f"shapers: the frequency with the joint free, {max(free):.4g} Hz"
    return (
        f"shapers: the frequency with the joint free varies between {min(free):.3g} and "
        f"{max(free):.3g} Hz along the stage; the shaper uses the constant with the minimum "
        "residual energy on B21"
    )


@lru_cache(maxsize=256)
def shaper_frequency(stage: Stage, kind: ShaperKind, drive: Drive) -> float:
    """Frequency of a shaper [Hz]."""
    if drive == "angle":
        return locked_frequency(stage.lasting(1.0))
    free = free_frequencies(stage.lasting(1.0))
    if not varies(stage):
        return max(free)

    # a constant for a frequency that varies: the one that leaves least, sought in two passes
    shortest = SHAPERS[kind][-1][0] / (LONGEST_SHAPER * stage.duration)
    one_joint = len(stage.moving) == 1
    count = FREQUENCIES_TRIED if one_joint else FREQUENCIES_OF_BOTH
    tried = np.geomspace(max(min(free), shortest), max(free), count)
    energies = _left(stage, kind, tried)
    if one_joint:
        k = int(np.argmin(energies))
        finer = np.linspace(tried[max(k - 1, 0)], tried[min(k + 1, count - 1)], FREQUENCIES_REFINED)
        tried = np.append(tried, finer)
        energies = np.append(energies, _left(stage, kind, finer))
    return float(tried[np.argmin(energies)])


def _left(stage: Stage, kind: ShaperKind, frequencies: Array) -> Array:
    """E_res on B21 under torque drive [J], by frequency."""
    laws = [shaped_bang_bang(stage.duration, float(f), kind) for f in frequencies]
    if len(stage.moving) == 1:
        return left_by_laws(stage, laws, "torque")

    start, times = stage.model.at(*stage.start), np.array([0.0, stage.duration])
    energies = []
    for law in laws:
        drives = torque_drives(stage, law)
        motion = simulate_reduced(
            stage.model, start, times, root=drives[ROOT], elbow=drives[ELBOW], tolerance=1e-6
        )
        energies.append(reduced_residual(stage, motion))
    return np.array(energies)
