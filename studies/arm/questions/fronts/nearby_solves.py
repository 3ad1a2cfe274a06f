"""A motion of the arm from a neighbour's, whose full model keeps what a point of a front asks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from models.errors import ModelError
from ocp import PointNotFound
from ocp.arrays import Array
from studies.arm.optimal.finished_solves import FinishedSolves
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.refinement import aimed_at_rest
from studies.arm.optimal.rounds import MISS
from studies.arm.optimal.solve import solve_again
from studies.arm.questions.fronts.point import ASKED_ENERGY, Demand
from studies.arm.replay.full_model import LockedMotion, steps_for
from studies.common.console import Console
from studies.common.exit_codes import StudyError

_CORRECTIONS = 3  # solves at most until the full model keeps its energy


@dataclass(frozen=True, eq=False)
class PointMotion:
    """A solve with its replay, its next aim, and the energy that B21 was asked to leave at most."""

    motion: OptimalMotion
    replay: LockedMotion
    aim: Array
    asked: float | None = None


class NotStillError(PointNotFound):
    """A motion was found, but the full model is left with more than is allowed."""


@dataclass(eq=False)
class NearbySolves:
    """Solves from neighbours, and how many there were.

    Attributes
    ----------
    console : that hears of each iteration.
    solver : keeps what is finished.
    residual : energy that may be left where none is limited [J].
    count : of the solves.
    """

    console: Console
    solver: FinishedSolves
    residual: float
    count: int = 0

    def once(
        self,
        start: OptimalMotion,
        demand: Demand,
        least: str,
        weight: float,
        finer: float,
        aim: Array,
    ) -> PointMotion:
        """The motion that is best at a weight, whose full model keeps what is asked."""
        try:
            if demand.left is None:
                motion = self._again(start, demand, least, weight, finer, aim)
                found, aim = aimed_at_rest(
                    motion,
                    aim,
                    residual=self.residual,
                    live=self.console.live,
                    solver=self.solver,
                )
                tried = PointMotion(found.motion, found.replay, aim)
            else:
                tried = self._swinging(start, demand, least, weight, finer, aim)
        except (StudyError, ModelError) as error:
            raise PointNotFound(str(error)) from error
        left = tried.replay.residual_energy
        if left > (self.residual if demand.left is None else demand.left):
            raise NotStillError(f"the full model is left with {left:.3g} J")
        if tried.replay.miss > MISS:
            raise PointNotFound(f"the full model ends {tried.replay.miss:.1e} rad beside its angle")
        return tried

    def _swinging(
        self,
        start: OptimalMotion,
        demand: Demand,
        least: str,
        weight: float,
        finer: float,
        aim: Array,
    ) -> PointMotion:
        """The motion that may leave an energy; B21 is asked for less where the full model has more.

        Both models swing alike but for what they miss of each other, which adds to the amplitude,
        the root of the energy, and counts where little is allowed.
        """
        assert demand.left is not None
        wanted = math.sqrt(ASKED_ENERGY * demand.left)
        amplitude = wanted
        for _ in range(_CORRECTIONS):
            asked = amplitude**2
            motion = self._again(start, replace(demand, left=asked), least, weight, finer, aim)
            replayed = motion.replay(settings=steps_for(demand.left))
            start, amplitude = motion, wanted + amplitude - math.sqrt(replayed.residual_energy)
            if replayed.residual_energy <= demand.left or amplitude <= 0.0:
                break
        return PointMotion(motion, replayed, aim, asked)

    def _again(
        self,
        start: OptimalMotion,
        demand: Demand,
        least: str,
        weight: float,
        finer: float,
        aim: Array,
    ) -> OptimalMotion:
        self.count += 1
        return solve_again(
            start,
            weight=weight,
            aim=aim,
            finer=finer,
            stated=demand.stated(least),
            progress=self.console.live,
            solver=self.solver,
        )
