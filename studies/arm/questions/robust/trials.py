"""What one motion leaves in many arms, in parts that can be worked out side by side.

On B21 the arms of a grid and those that are drawn move abreast, on the full model those of a coarse
grid one after the other. The nominal arm in the middle of that grid is the one whose replay the
exported samples are held against, so that it is replayed once.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.refinement import FLOOR
from studies.arm.questions.robust.spread import Spread
from studies.arm.replay.full_model import CLOSE, LockedMotion, Motion, replay
from studies.arm.replay.reduced_model import NOMINAL, Factors, residuals, varied
from studies.arm.replay.sampled import SampledProfile, sampled_to
from studies.common.console import Console
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.processes.side_by_side import Part

Say = Callable[[str], None]
FULL = 3  # points a side on the full model
# arms on B21 in a group, or more, and groups at most: with a single one all processes but one wait
_ABREAST, _GROUPS = 500, 8
MASSES = (0.9, 1.1)
_MORE = 1.1  # times what a motion leaves, that its samples may leave


@dataclass(frozen=True, eq=False)
class TriedArms:
    """The arms that motions are tried on.

    Attributes
    ----------
    spread : Spread
    points : a side of the grid on B21.
    drawn : further arms on B21.
    """

    spread: Spread
    points: int
    drawn: Sequence[Factors] = ()

    @property
    def reduced(self) -> list[Sequence[Factors]]:
        """All arms on B21, those of the grid first, in groups that move abreast."""
        arms = (*self.spread.grid(self.points), *self.drawn)
        abreast = max(_ABREAST, -(-len(arms) // _GROUPS))
        return [arms[first : first + abreast] for first in range(0, len(arms), abreast)]

    @property
    def full(self) -> list[list[Factors]]:
        """Rows of the grid on the full model."""
        grid = self.spread.grid(FULL)
        return [grid[first : first + FULL] for first in range(0, len(grid), FULL)]


@dataclass(frozen=True, eq=False)
class ResidualMap:
    """What a motion leaves in the arms of the spread.

    Attributes
    ----------
    motion : OptimalMotion
    peak : largest torque [N m].
    reduced, full : (n, n), (k, k)
        sqrt(E_res) [sqrt(J)] on B21 and on the full model; the first axis is the first factor's.
    drawn : E_res of the arms that were drawn (m,) [J].
    profile : its samples, with the replay of the nominal arm.
    """

    motion: OptimalMotion
    peak: float
    reduced: Array
    full: Array
    drawn: Array
    profile: SampledProfile

    @property
    def at_nominal(self) -> float:
        """sqrt(E_res) of the nominal arm on the full model [sqrt(J)]."""
        return float(np.sqrt(self.profile.exact.residual_energy))

    def ratios(self, other: ResidualMap) -> tuple[float, float]:
        """Worst sqrt(E_res) over that of another motion, on B21 and on the full model."""
        return (
            float(self.reduced.max() / other.reduced.max()),
            float(self.full.max() / other.full.max()),
        )


def parts_of(
    motion: OptimalMotion, arms: TriedArms, kept: FinishedSteps = NOTHING_KEPT
) -> list[Part]:
    """The parts of a motion's map, what takes longest first."""
    given = motion.motion(arms.spread.drive)
    steps = kept.within(given.name)
    return [
        *(
            steps.part(f"arms on B21 {number}", _on_reduced_model, given, group)
            for number, group in enumerate(arms.reduced, start=1)
        ),
        Part(_sampled, (given, steps)),
        *(
            steps.part(f"arms on the full model {number}", _on_full_model, given, row)
            for number, row in enumerate(arms.full, start=1)
        ),
    ]


def map_of(motion: OptimalMotion, arms: TriedArms, answers: Iterator[Any], say: Say) -> ResidualMap:
    """The map, from what comes of `parts_of`, in the same order; no more is taken than that."""
    energies = np.concatenate([next(answers) for _ in arms.reduced])
    profile = next(answers)
    rows = [next(answers) for _ in arms.full]

    size, joint = arms.points, motion.stage.moving[0]
    reduced = np.sqrt(energies[: size**2]).reshape(size, size)
    full = np.sqrt(np.array(rows, dtype=float))
    here = np.array([[_is_nominal(factors) for factors in row] for row in arms.full])
    full[here] = np.sqrt(profile.exact.residual_energy)

    found = ResidualMap(
        motion, float(motion.peak_torque[joint]), reduced, full, energies[size**2 :], profile
    )
    say(
        f"{motion.name}: worst sqrt(E_res) {reduced.max():.3e} on B21, {size} x {size} arms, and "
        f"{full.max():.3e} on the full model, {len(full)} x {len(full)}"
    )
    return found


def _on_reduced_model(given: Motion, factors: Sequence[Factors], console: Console) -> Array:
    """E_res of arms on B21 (m,) [J]."""
    return residuals(given, factors, live=console.live)


def _on_full_model(given: Motion, arms: Sequence[Factors], console: Console) -> list[float]:
    """E_res of arms on the full model [J]; nan of the nominal one, which is replayed elsewhere."""
    left: list[float] = []
    for factors in arms:
        console.live(f"{given.name}: arm {len(left) + 1} of {len(arms)} on the full model")
        if _is_nominal(factors):
            left.append(float("nan"))
            continue
        left.append(replay(of_arm(given, factors), settings=CLOSE).residual_energy)
    return left


def _is_nominal(factors: Factors) -> bool:
    return bool(np.allclose(factors, NOMINAL, rtol=0.0, atol=1e-12))


def _sampled(given: Motion, kept: FinishedSteps, console: Console) -> SampledProfile:
    """Its profile, which leaves the nominal arm with hardly more than the motion itself."""
    console.live(f"{given.name}: sampled")
    exact = LockedMotion(given, kept.step("nominal arm", lambda: replay(given).fixed))
    return sampled_to(exact, allowed(exact.residual_energy), kept=kept)


def allowed(residual: float) -> float:
    """What samples of a motion may leave the nominal arm with [J], by what the motion leaves."""
    return _MORE * residual + FLOOR


def of_arm(motion: Motion, factors: Factors) -> Motion:
    """The same drive on another arm."""
    other = dataclasses.replace(motion.stage, arm=varied(motion.stage.arm, factors))
    return dataclasses.replace(motion, stage=other)


def mass_parts(motion: OptimalMotion, kept: FinishedSteps) -> list[Part]:
    """Parts that tell the angle misses [rad] with the tip masses of `MASSES` under torque drive."""
    given, steps = motion.motion("torque"), kept.within(motion.name)
    return [steps.part(f"tip mass times {mass:g}", _missed, given, mass) for mass in MASSES]


def _missed(given: Motion, mass: float, console: Console) -> float:
    """Angle miss [rad] at the lock with another tip mass."""
    console.live(f"{given.name}: angle miss with {mass:g} of the tip mass")
    return replay(of_arm(given, (1.0, 1.0, mass)), settings=CLOSE).miss
