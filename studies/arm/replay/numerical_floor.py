"""The numerical floor of a residual energy: what halving the step and the mesh changes."""

from __future__ import annotations

from dataclasses import dataclass

from models.ancf.integrate import StepControl
from models.errors import ModelError
from studies.arm.replay.full_model import ELEMENTS, Motion, replay

STEPS = 1000  # of the coarser run
HALVINGS = 4  # of that step where it is too long
TOLERANCE = 1e-9  # of the Newton iterations; the step is fixed


@dataclass(frozen=True)
class Floor:
    """E_res of one motion [J]: with a step, with half of it, and with half the element length."""

    step: float
    coarse: float
    half_step: float
    half_mesh: float

    @property
    def energy(self) -> float:
        """Largest change of E_res by either halving [J]: differences below it mean nothing."""
        return max(abs(self.half_step - self.coarse), abs(self.half_mesh - self.coarse))

    def __str__(self) -> str:
        return (
            f"numerical floor: E_res is {self.coarse:.2e} J with {self.step:.3g} s steps, "
            f"{self.half_step:.2e} J with half the step, {self.half_mesh:.2e} J with "
            f"{2 * ELEMENTS} elements a link; the changes are at most {self.energy:.1e} J"
        )


def numerical_floor(motion: Motion) -> Floor:
    """Three replays of a motion with steps of one length.

    Where a step is too long for Newton's iteration, as in a motion of much more than the paper's
    angles, it is halved.

    Raises
    ------
    ModelError
        If the shortest step is too long, too.
    """
    step = motion.stage.duration / STEPS
    for _ in range(HALVINGS):
        try:
            return _floor(motion, step)
        except ModelError:
            step /= 2
    return _floor(motion, step)


def _floor(motion: Motion, step: float) -> Floor:
    whole = StepControl(TOLERANCE, fixed_step=step)
    half = StepControl(TOLERANCE, fixed_step=step / 2)
    return Floor(
        step,
        coarse=replay(motion, settings=whole).residual_energy,
        half_step=replay(motion, settings=half).residual_energy,
        half_mesh=replay(motion, settings=whole, elements=2 * ELEMENTS).residual_energy,
    )
