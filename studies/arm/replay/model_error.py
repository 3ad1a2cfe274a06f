"""What the reduced model's error in the pinned/free frequency does to both joints at once.

With root pinned and elbow free B21 is 13 % off in the first frequency, B22 12 %. While both joints
turn, the arm is such a structure. The optimum, and a law that strikes this mode, are replayed on
all three models.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from models.ancf.analysis import natural_modes
from models.ancf.integrate import StepControl
from models.ancf.joints import Free, Torque
from models.ancf.state import posed
from models.arm.reduced_simulation import reduced_modes, simulate_reduced
from models.laws import Law
from models.laws.unit_turns import linear_torque
from studies.arm.laws.rigid import feed_forward
from studies.arm.replay.full_model import ELEMENTS, Motion, replay
from studies.arm.replay.reduced_model import reduced_residual
from studies.arm.stage import ELBOW, ROOT, Stage

LAW = "linear torque"  # its torque jumps: it strikes what the optimum leaves alone
VARIANTS: tuple[Literal["B21", "B22"], ...] = ("B21", "B22")
FULL = "full model"
# two torques that jump need a finer step than one
_FINE_JUMPS = StepControl(1e-7, fixed_step=0.001)
_TOLERANCE = 1e-7  # of the replays on the reduced models
_SAMPLES = 2001  # of the tabulated torques


@dataclass(frozen=True)
class ModelComparison:
    """Both joints at once on the reduced models and on the full one.

    Attributes
    ----------
    frequency : first one with both joints free and the arm straight [Hz], by model.
    residual_energy : what `LAW` leaves [J], by model.
    """

    frequency: dict[str, float]
    residual_energy: dict[str, float]


def compare_models(stage: Stage) -> ModelComparison:
    """Frequencies of the arm, and what the linear torque leaves, on all three models."""
    straight = (stage.end[ROOT], 0.0)
    frequency: dict[str, float] = {}
    for variant in VARIANTS:
        model = stage.reduced(variant=variant)
        frequency[variant] = float(reduced_modes(model, model.at(*straight))[0][0])
    chain = stage.arm.chain(ELEMENTS)
    full = natural_modes(chain, [Free(), Free()], posed(chain, list(straight)), count=1)
    frequency[FULL] = float(full.frequencies[0])

    drives = _tabulated(stage, linear_torque(stage.duration))
    energies: dict[str, float] = {variant: _reduced(stage, drives, variant) for variant in VARIANTS}
    done = replay(Motion(LAW, "torque", stage, drives, jumps=True), settings=_FINE_JUMPS)
    return ModelComparison(frequency, {**energies, FULL: done.residual_energy})


def _tabulated(stage: Stage, law: Law) -> dict[int, Torque]:
    """Feed-forward torques of a law without inner breakpoints, as splines: quick to evaluate."""
    t = np.linspace(0.0, stage.duration, _SAMPLES)
    torques = feed_forward(stage, law)(t)
    return {k: Torque(CubicSpline(t, torques[k])) for k in stage.moving}


def _reduced(stage: Stage, drives: dict[int, Torque], variant: Literal["B21", "B22"]) -> float:
    """E_res on a reduced model [J]."""
    model = stage.reduced(variant=variant)
    motion = simulate_reduced(
        model,
        model.at(*stage.start),
        np.array([0.0, stage.duration]),
        root=drives[ROOT],
        elbow=drives[ELBOW],
        tolerance=_TOLERANCE,
    )
    return reduced_residual(stage, motion)
