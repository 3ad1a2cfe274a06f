"""A front of the arm: the least of one quantity under each limit on another, torque drive.

Both ends are refined as a motion of `arm solve` is. A point between them starts from its neighbour,
on half the intervals and with twice the smoothness, which changes the least by a per cent at most,
and is aimed until the full model rests.

Where the energy that is left is limited, the lock may meet a swing. A motion is refined that ends
at rest, and all points start from it. They are not aimed: the full model swings as B21 does.

"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from models.errors import ModelError
from ocp import FrontPoint, FrontWay, PointNotFound
from ocp.arrays import Array
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.refinement import refine
from studies.arm.optimal.rounds import SAME
from studies.arm.optimal.solve import check_bending, check_caps, solve_stage
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.questions.fronts.nearby_solves import (
    NearbySolves,
    NotStillError,
    PointMotion,
    SoughtPoint,
)
from studies.arm.questions.fronts.point import (
    AXES,
    ArmPoint,
    Demand,
    most_left,
    slopes_of,
    values_of,
)
from studies.arm.search_limits import (
    ABOVE_REST,
    ABOVE_THE_LEAST,
    CALMER,
    FRONT_DURATIONS,
    LIGHTER,
    WIDEST_AT_LEAST,
)
from studies.arm.stage import ELBOW, Stage, TorqueCaps
from studies.arm.trade_off import RESIDUAL_ENERGY, TradeOffStudy
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps


class ArmFront:
    """A study's motions as points of a front; a `fronts.found.MechanismFront`.

    Parameters
    ----------
    kept : FinishedSteps, optional
        Where solves go to, and where those of an earlier run are read.
    """

    known = SAME

    def __init__(
        self, study: TradeOffStudy, console: Console, kept: FinishedSteps = NOTHING_KEPT
    ) -> None:
        self.study, self.console = study, console
        self.solver = StudySolver(console.progress, console.live, kept)
        self.limited, self.least = study.limited, study.least
        self.axes = AXES[self.limited], AXES[self.least]
        self.residual = study.still
        self.lightest = math.inf  # weight of the smoothness that either end needs, once known
        self.nearby = NearbySolves(self.solver, study.still)
        self.remarks: list[str] = []  # on limits at which no end was found
        self.bests: dict[str, ArmPoint] = {}  # of the quantities that ends were sought by
        self._at_rest: dict[tuple[float, TorqueCaps, str], OptimalMotion] = {}

    def ends(self) -> Iterator[FrontPoint]:
        """The points at the highest and at the lowest limit.

        Raises
        ------
        StudyError
            If there is none.
        """
        lows, high = self.limits()
        for limit in (lows[0], high):
            demand = self._demand(limit)
            check_bending(demand.stage)
            if demand.left is None:  # a rigid arm's least torque is that from rest to rest
                check_caps(demand.stage, demand.caps)
        right = self._end((high,), "down", self._best_of(self.least))
        yield right
        left = self._end(lows, "up", self._best_of("peak-torque"))
        self.lightest = min(end.motion.motion.weight for end in (left, right))
        yield left

    def limits(self) -> tuple[tuple[float, ...], float]:
        """Lowest limits to try and the highest: those stated, or what one would look at first."""
        if self.study.range is not None:
            low, high = self.study.range
            return (low,), high
        stage = self.study.slew
        if self.limited == "time":
            shortest, longest = FRONT_DURATIONS
            return (shortest * stage.duration,), longest * stage.duration
        if self.limited == RESIDUAL_ENERGY:
            return tuple(self.residual * ten for ten in ABOVE_REST), most_left(stage)

        # from little more than the least torque to that of the least of the other
        least, other = (self._best(name) for name in ("peak-torque", self.least))
        lows = tuple(least.values["peak-torque"] * (1 + part) for part in ABOVE_THE_LEAST)
        return lows, max(other.values["peak-torque"], WIDEST_AT_LEAST * lows[0])

    def _best(self, name: str) -> ArmPoint:
        """The motion that is best in a quantity, without a limit."""
        self.console.progress(f"an end of the front: minimum {AXES[name].title}")
        try:
            self.bests[name] = self._from_rest({}, name)
        except PointNotFound as error:
            raise StudyError(
                f"the minimum {AXES[name].title} was not found: {error}; give a range",
                ExitCode.NOT_SOLVED,
            ) from error
        return self.bests[name]

    def _best_of(self, name: str) -> list[ArmPoint]:
        """The motion that is best in a quantity, where it was sought: it may start an end."""
        return [self.bests[name]] if name in self.bests else []

    def _demand(self, limit: float) -> Demand:
        """What a limit asks for."""
        return Demand.of(self.study.slew, {self.limited: limit})

    def _end(self, limits: Sequence[float], way: FrontWay, near: Sequence[ArmPoint]) -> FrontPoint:
        """The point at an end, the first of some limits at which one is found.

        The best that motions near by lead to; else from a refined motion.

        Raises
        ------
        StudyError
            If there is none at the last limit.
        """
        axis = AXES[self.limited]
        for limit in limits:
            self.console.progress(f"an end of the front: {axis.title} {limit:.5g} {axis.unit}")
            found = []
            for start in near:
                with suppress(PointNotFound):
                    found.append(self._from(start, limit, way))
            if found:
                return min(found, key=lambda point: point.y)
            try:
                return self._cold(limit, way)
            except PointNotFound as error:
                if limit == limits[-1]:
                    end = "lower" if way == "up" else "upper"
                    raise StudyError(
                        f"no motion was found at the {end} end of the front, {axis.title} "
                        f"{limit:.6g} {axis.unit}: {error}; give another range",
                        ExitCode.NOT_SOLVED,
                    ) from error
                self.remarks.append(f"no point was found at {limit:.6g} {axis.unit}: {error}")
                self.console.progress(self.remarks[-1])
        raise AssertionError  # there is a limit

    def _cold(self, limit: float, way: FrontWay, *, afresh: bool = False) -> FrontPoint:
        """A point from a motion that was refined from a rigid arm's."""
        begin = clock.perf_counter()
        found = self._from_rest({self.limited: limit}, self.least)
        return self._told(limit, found, way, begin, afresh=afresh)

    def _from_rest(self, limits: Mapping[str, float], least: str) -> ArmPoint:
        """The motion that is best in a quantity, from the refined one that ends at rest."""
        demand = Demand.of(self.study.slew, limits)
        key = demand.stage.duration, demand.caps, least
        if key not in self._at_rest:
            self._at_rest[key] = self._refined(demand.stage, demand.caps, least)
        motion = self._at_rest[key]
        return self._solved(
            limits, least, motion, np.zeros(2 * motion.stage.model.size), coarser=True
        )

    def _refined(self, stage: Stage, caps: TorqueCaps, least: str) -> OptimalMotion:
        """The motion that `arm solve` would give."""
        try:
            motion = solve_stage(stage, caps=caps, objective=least, solver=self.solver)
            found = refine(motion, residual=self.residual, solver=self.solver)
        except (StudyError, ModelError) as error:
            raise PointNotFound(str(error)) from error
        if not found.resolved:
            raise PointNotFound(
                f"the residual energy on the full model is {found.replay.residual_energy:.2e} J, "
                f"allowed {self.residual:g} J (change it with --residual-energy)"
                if not found.still
                else "a smaller smoothness weight and a finer mesh still improve the objective by "
                "more than 1 %"
            )
        return found.motion

    def near(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The point at a limit, from the motion of a neighbour and its aim."""
        return self._from(before.motion, limit, way)

    def _from(self, start: ArmPoint, limit: float, way: FrontWay) -> FrontPoint:
        begin = clock.perf_counter()
        found = self._solved({self.limited: limit}, self.least, start.motion, start.aim)
        return self._told(limit, found, way, begin)

    def afresh(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The same, refined from a rigid arm's motion."""
        del before
        return self._cold(limit, way, afresh=True)

    def _told(
        self, limit: float, kept: ArmPoint, way: FrontWay, begin: float, *, afresh: bool = False
    ) -> FrontPoint:
        """The point of a motion, which progress is told of."""
        across, up = self.axes
        x, y = kept.values[across.key], kept.values[up.key]
        seconds = clock.perf_counter() - begin
        self.console.progress(
            f"{across.title} {x:.5g} {across.unit}: {up.title} {y:.5g} {up.unit}, residual energy "
            f"{kept.replay.residual_energy:.1e} J, {seconds:.1f} s"
        )
        return FrontPoint(limit, x, y, kept.slopes[self.limited], way, afresh, seconds, kept)

    def _solved(
        self,
        limits: Mapping[str, float],
        least: str,
        start: OptimalMotion,
        aim: Array,
        *,
        coarser: bool = False,
    ) -> ArmPoint:
        """The best motion under limits from another; `coarser` undoes its mesh's last halving."""
        halves, demand = 2 if coarser else 1, Demand.of(self.study.slew, limits)
        weight = halves * start.weight
        sought = SoughtPoint(start, demand, least, weight, aim, 1.0 / halves)
        try:
            found = self.nearby.once(sought)
        except NotStillError:
            # near the least torque its edges are sharp and stir modes that B21 lacks: no aim and
            # no finer mesh takes that away
            return self._kept(self.nearby.once(replace(sought, weight=CALMER * weight)), limits)
        # an end that needed more smoothness than the other one hands it on to its neighbours
        lighter = max(self.lightest, weight / LIGHTER[ELBOW in found.motion.stage.moving])
        if lighter < weight:
            with suppress(PointNotFound):
                found = self.nearby.once(
                    SoughtPoint(found.motion, demand, least, lighter, found.aim)
                )
        return self._kept(found, limits)

    def _kept(self, found: PointMotion, limits: Mapping[str, float]) -> ArmPoint:
        """What is kept of a motion under limits."""
        motion, replayed = found.motion, found.replay
        # a torque that leaks between the points of its mesh is a point with a little more of it
        values = values_of(replayed, motion.peak_torque)
        slopes = slopes_of(motion, limits, found.asked)
        return ArmPoint(motion, replayed, found.aim, values, slopes)
