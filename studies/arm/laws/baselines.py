"""The baselines of a stage by name, and the frequency of the shaped ones.

Angle drive: the locked frequency at the stage's end. Torque drive: the frequency of the free
joint; where it varies along the stage, the constant that leaves least on B21.
"""

from __future__ import annotations

from functools import lru_cache
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from models.ancf.analysis import natural_modes
from models.ancf.joints import Free, Locked
from models.ancf.state import posed
from models.arm.reduced_simulation import simulate_reduced
from studies.arm.laws.rigid import torque_drives
from studies.arm.laws.scan import left_by_laws
from studies.arm.laws.unit_laws import SHAPERS, NamedLaw, ShaperKind, baselines, shaped_bang_bang
from studies.arm.optimal.solve import reduced_residual
from studies.arm.replay.full import Drive
from studies.arm.stage import ELBOW, ROOT, Stage

Array = NDArray[np.float64]
SMOOTH = ("quintic", "Step5", "Bezier")
SHAPED: tuple[ShaperKind, ...] = get_args(ShaperKind)
_TRIES = 32  # constants tried for a frequency that varies along the stage
_FEW = 9  # where both joints turn, whose motions take longer
_FINER = 8  # tried between the best one's neighbours
_LONGEST_SHAPER = 0.8  # of the stage's duration
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
    return next(law for law in baselines(stage.duration, 10.0 / stage.duration) if law.name == name)


@lru_cache(maxsize=32)
def locked_frequency(stage: Stage) -> float:
    """First frequency of the arm locked at the stage's end [Hz]."""
    chain = stage.arm.chain(8)
    rest = posed(chain, list(stage.end))
    joints = [Locked(angle) for angle in stage.end]
    return float(natural_modes(chain, joints, rest, count=1).frequencies[0])


@lru_cache(maxsize=32)
def free_frequencies(stage: Stage) -> tuple[float, ...]:
    """First elastic frequency with the joints that turn free, at even shares of the turn [Hz]."""
    chain, found = stage.arm.chain(8), []
    for share in np.linspace(0.0, 1.0, 25):
        angles = np.array(stage.start) + share * stage.turn
        joints = [Free() if k in stage.moving else Locked(a) for k, a in enumerate(angles)]
        modes = natural_modes(chain, joints, posed(chain, list(angles)), count=1)
        found.append(float(modes.frequencies[0]))
    return tuple(found)


def varies(stage: Stage) -> bool:
    """Whether the free joints' frequency changes along the stage."""
    found = free_frequencies(stage.lasting(1.0))
    return max(found) - min(found) > _SAME * max(found)


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
        f"{max(free):.3g} Hz along the stage; taken is the constant that leaves least on B21"
    )


@lru_cache(maxsize=256)
def shaper_frequency(stage: Stage, kind: ShaperKind, drive: Drive) -> float:
    """Frequency of a shaper [Hz]."""
    if drive == "angle":
        return locked_frequency(stage.lasting(1.0))
    free = free_frequencies(stage.lasting(1.0))
    if not varies(stage):
        return max(free)
    shortest = SHAPERS[kind][-1][0] / (_LONGEST_SHAPER * stage.duration)
    one = len(stage.moving) == 1
    tried = np.geomspace(max(min(free), shortest), max(free), _TRIES if one else _FEW)
    values = _left(stage, kind, tried)
    k = int(np.argmin(values))
    finer = np.linspace(tried[max(k - 1, 0)], tried[min(k + 1, len(tried) - 1)], _FINER)
    if one:
        tried, values = np.append(tried, finer), np.append(values, _left(stage, kind, finer))
    return float(tried[np.argmin(values)])


def _left(stage: Stage, kind: ShaperKind, frequencies: Array) -> Array:
    """E_res on B21 under torque drive [J], by frequency."""
    laws = [shaped_bang_bang(stage.duration, float(f), kind) for f in frequencies]
    if len(stage.moving) == 1:
        return left_by_laws(stage, laws, "torque")
    start, times = stage.model.at(*stage.start), np.array([0.0, stage.duration])
    found = []
    for law in laws:
        drives = torque_drives(stage, law)
        motion = simulate_reduced(
            stage.model, start, times, root=drives[ROOT], elbow=drives[ELBOW], tolerance=1e-6
        )
        found.append(reduced_residual(stage, motion))
    return np.array(found)
