"""A motion of the arm from a neighbour's, whose full model keeps what a point of a front asks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from models.errors import ModelError
from ocp import PointNotFound
from ocp.arrays import Array
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.refinement import aimed_at_rest
from studies.arm.optimal.rounds import MISS
from studies.arm.optimal.solve import solve_again
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.questions.fronts.point import ASKED_ENERGY, Demand
from studies.arm.replay.full_model import LockedMotion, steps_for
from studies.common.exit_codes import StudyError

_CORRECTIONS = 3  # solves at most until the full model keeps its energy


@dataclass(frozen=True, eq=False)
class SoughtPoint:
    """What is sought from a neighbour's motion.

    Attributes
    ----------
    start : the neighbour's motion.
    demand : what is to be kept.
    least : what is least.
    weight : of the smoothness.
    aim : (2 n,) beside rest.
    finer : intervals over those of the neighbour's motion.
    """

    start: OptimalMotion
    demand: Demand
    least: str
    weight: float
    aim: Array
    finer: float = 1.0


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
    solver : of the study.
    residual : energy that may be left where none is limited [J].
    count : of the solves.
    """

    solver: StudySolver
    residual: float
    count: int = 0

    def once(self, sought: SoughtPoint) -> PointMotion:
        """The motion that is best at a weight, whose full model keeps what is asked."""
        left = sought.demand.left
        try:
            tried = self._at_rest(sought) if left is None else self._swinging(sought, left)
        except (StudyError, ModelError) as error:
            raise PointNotFound(str(error)) from error
        energy, miss = tried.replay.residual_energy, tried.replay.miss
        if energy > (self.residual if left is None else left):
            raise NotStillError(f"the residual energy on the full model is {energy:.3g} J")
        if miss > MISS:
            raise PointNotFound(f"the full model misses its end angle by {miss:.1e} rad")
        return tried

    def _at_rest(self, sought: SoughtPoint) -> PointMotion:
        """The motion that ends at rest."""
        found, aim = aimed_at_rest(
            self._again(sought), sought.aim, residual=self.residual, solver=self.solver
        )
        return PointMotion(found.motion, found.replay, aim)

    def _swinging(self, sought: SoughtPoint, left: float) -> PointMotion:
        """The motion that may leave an energy; B21 is asked for less where the full model has more.

        Both models swing alike but for what they miss of each other, which adds to the amplitude,
        the root of the energy, and counts where little is allowed.
        """
        wanted = math.sqrt(ASKED_ENERGY * left)
        amplitude = wanted
        for _ in range(_CORRECTIONS):
            asked = amplitude**2
            motion = self._again(replace(sought, demand=replace(sought.demand, left=asked)))
            replayed = motion.replay(settings=steps_for(left))
            sought = replace(sought, start=motion)
            amplitude = wanted + amplitude - math.sqrt(replayed.residual_energy)
            if replayed.residual_energy <= left or amplitude <= 0.0:
                break
        return PointMotion(motion, replayed, sought.aim, asked)

    def _again(self, sought: SoughtPoint) -> OptimalMotion:
        self.count += 1
        return solve_again(
            sought.start,
            weight=sought.weight,
            aim=sought.aim,
            finer=sought.finer,
            stated=sought.demand.stated(sought.least),
            solver=self.solver,
        )
