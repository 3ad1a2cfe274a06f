"""What the reduced model's error in the pinned/free frequency does to both joints at once.

With root pinned and elbow free B21 is 13 % off in the first frequency, B22 12 %. While both joints
turn, the arm is such a structure. The optimum, and a law that strikes this mode, are replayed on
all three models.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from models.ancf.analysis import natural_modes
from models.ancf.integrate import StepControl
from models.ancf.joints import Free, Torque
from models.ancf.state import posed
from models.arm.reduced_simulation import reduced_modes, simulate_reduced
from models.laws import Law
from studies.arm.laws.rigid import feed_forward
from studies.arm.laws.unit_laws import baselines
from studies.arm.optimal.solve import Solved, reduced_residual
from studies.arm.replay.full import ELEMENTS, Motion, replay
from studies.arm.stage import ELBOW, ROOT, Stage

LAW = "linear torque"  # its torque jumps: it strikes what the optimum leaves alone
_FINE_JUMPS = StepControl(
    1e-7, fixed_step=0.001
)  # two torques that jump need a finer step than one
_TOLERANCE = 1e-7  # of the replays on the reduced models
_SAMPLES = 2001


def both_at_once(stage: Stage, solved: Solved) -> dict[str, float]:
    """Frequencies and residual energies of the two reduced models and the full one."""
    out = {}
    straight = (stage.end[ROOT], 0.0)
    for variant in ("B21", "B22"):
        model = stage.reduced(variant=variant)
        out[f"first frequency, both joints free, straight, {variant} [Hz]"] = float(
            reduced_modes(model, model.at(*straight))[0][0]
        )
    chain = stage.arm.chain(ELEMENTS)
    full = natural_modes(chain, [Free(), Free()], posed(chain, list(straight)), count=1)
    out["first frequency, both joints free, straight, full model [Hz]"] = float(full.frequencies[0])
    out["residual energy on B22 [J]"] = solved.energy_on_B22
    law = next(x.law for x in baselines(stage.duration, 10.0 / stage.duration) if x.name == LAW)
    drives = _tabulated(stage, law)
    for variant in ("B21", "B22"):
        out[f"{LAW} instead: residual energy on {variant} [J]"] = _reduced(stage, drives, variant)
    done = replay(Motion(LAW, "torque", stage, drives, jumps=True), settings=_FINE_JUMPS)
    out[f"{LAW} instead: residual energy, full model [J]"] = done.residual_energy
    return out


def _tabulated(stage: Stage, law: Law) -> dict[int, Torque]:
    """Feed-forward torques of a law without inner breakpoints, as splines: quick to evaluate."""
    t = np.linspace(0.0, stage.duration, _SAMPLES)
    torques = feed_forward(stage, law)(t)
    return {k: Torque(CubicSpline(t, torques[k])) for k in stage.moving}


def _reduced(stage: Stage, drives: dict[int, Torque], variant: str) -> float:
    """E_res on a reduced model [J]."""
    model = stage.reduced(variant="B21" if variant == "B21" else "B22")
    motion = simulate_reduced(
        model, model.at(*stage.start), np.array([0.0, stage.duration]),
        root=drives[ROOT], elbow=drives[ELBOW], tolerance=_TOLERANCE,
    )  # fmt: skip
    return reduced_residual(stage, motion)
