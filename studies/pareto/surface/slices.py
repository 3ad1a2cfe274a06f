"""Slices of a surface of the truss: fronts of two objectives under a limit on a third.

The limit of the slice is a constant of the program, as the limit of the front is. So all slices
share one program, and a slice's ends start from the variables and the multipliers of its
neighbours' ends, wherever these are solved already.
"""

from __future__ import annotations

import functools
import time as clock
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from models.laws import Law
from ocp import Constant, Solution, SolveFailed, Trajectory
from ocp.analysis.front.both_ways import Walked, both_ways, walked_down
from ocp.analysis.front.continuation import FrontPoint, NotFoundError, Way
from ocp.analysis.front.envelope import alone
from studies.common.console import Console
from studies.pareto.config import ParetoStudy
from studies.pareto.surface.shape import SurfacePoint
from studies.pareto.surface.walk import OutOfTimeError, Slice
from studies.pareto.truss import (
    ABOVE_THE_LEAST,
    ACCURACY,
    KEPT,
    LEAK,
    LONGER,
    FrontProgram,
    TrussFront,
    limited,
)
from studies.truss.config import TrussStudy
from studies.truss.motions.deployment import Deployment
from studies.truss.quantities import QUANTITIES
from studies.truss.search.best_law import best_law

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import LeastForce

# a sketch begins where a motion is soon found
COARSE_ABOVE = (2e-2, 5e-2)
# and is drawn: of what finer controls may gain, which is 1 % at most, trials left out 0.2 %
SKETCH = replace(ACCURACY, objective=KEPT.objective)
# what a point of a slice may take: neighbours on all sides are other chances
ITERATIONS = 600
FREE = 10.0  # times what a neighbour has: a limit that does not press
SAME = 1e-3  # relative: ends of a slice that are closer than this are one point


def slice_study(study: ParetoStudy, limit: float) -> ParetoStudy:
    """The trade-off of the other two objectives under a limit on the sliced one."""
    pareto, sliced = study.pareto, study.pareto.sliced
    assert sliced is not None
    two = replace(pareto, objectives=(pareto.limited, pareto.least), slices=None)
    return ParetoStudy(pareto=two, truss=limited(study.truss, sliced, limit))


class SliceFront(TrussFront):
    """A slice's motions as points of a front.

    Parameters
    ----------
    level : float
        The limit of the slice.
    constant : Constant
        That stands for it in the programs, which all slices share.
    until : float
        When the seconds of the surface are over, on the monotonic clock.
    origin : SliceFront, optional
        That states the programs of all slices: the one with the highest limit.
    """

    def __init__(
        self,
        study: ParetoStudy,
        level: float,
        constant: Constant,
        console: Console,
        until: float,
        origin: SliceFront | None = None,
    ) -> None:
        super().__init__(slice_study(study, level), console)
        assert study.pareto.sliced is not None
        self.sliced, self.level, self.until = study.pareto.sliced, level, until
        self.constant, self.origin = constant, origin
        self.traded |= {self.sliced}
        self.others, self.constants = {self.sliced: constant}, {constant: level}
        self.kept = replace(self.kept, iterations=ITERATIONS)
        accuracy = SKETCH if study.pareto.coarse else ACCURACY
        self.settings = replace(self.settings, iterations=ITERATIONS, accuracy=accuracy)
        self.closer = replace(self.closer, iterations=ITERATIONS)

    def walk(self, neighbours: Sequence[Slice], count: int) -> Slice:
        """The slice, from the ends of its neighbours or, without any, from searches.

        A sketch is walked one way, with falling limits: there a mesh is coarser than that of a
        motion under a low limit.

        Raises
        ------
        NotFoundError, StudyError
            If it has no motion.
        """
        slow = self._least(neighbours)
        lows = self._lows(slow)
        right = self._right(neighbours)
        if lows[0] >= right.x * (1 - SAME):
            # nothing is traded on this slice: one point is all of it
            return Slice(self, right, right, Walked(alone(right), (), stopped=False))
        if not self.study.pareto.coarse:
            left = self._left(neighbours, lows, slow, right.limit)
            return Slice(self, left, right, both_ways(self, left, right, count, _nowhere))

        tallest = self._deployment(slow).values[self.least]
        walked = walked_down(self, right, lows[0], tallest, count)
        return Slice(self, walked.front.points[0], right, walked)

    def _least(self, neighbours: Sequence[Slice]) -> Law:
        """The motion with the least of what is limited, from all starts or near a neighbour's."""
        self.console.live(f"the least {self.limited} of a slice")
        study = self.minimising(self.limited)
        if not neighbours:
            return best_law(study, self.console)
        study = replace(study, solver=replace(study.solver, starts=study.solver.starts[:1]))
        law = neighbours[0].left.motion.deployment.law
        return best_law(study, self.console, law)

    def _lows(self, slow: Law) -> list[float]:
        """Lowest limits to try: a little above the least, and within what is stated.

        Raises
        ------
        NotFoundError
            If the stated range ends below the least.
        """
        least = self._deployment(slow).values[self.limited]
        parts = COARSE_ABOVE if self.study.pareto.coarse else ABOVE_THE_LEAST
        lows = [least * (1 + part) for part in parts]
        if self.study.pareto.range is None:
            return lows
        low, high = self.study.pareto.range
        if lows[0] >= high:
            unit = QUANTITIES[self.limited].unit
            raise NotFoundError(
                f"its least {QUANTITIES[self.limited].title} is {least:.6g} {unit}, and the range "
                f"ends at {high:.6g} {unit}"
            )
        return [max(low, one) for one in lows if one < high]

    @property
    def _high(self) -> float | None:
        """The highest limit that is stated; None where there is none."""
        if self.study.pareto.range is not None:
            return float(self.study.pareto.range[1])
        return self.truss.duration[1] if self.limited == "time" else self._cap

    def _right(self, neighbours: Sequence[Slice]) -> FrontPoint:
        """The point at the highest limit; where that does not press, at what the motion has."""
        high = self._high
        if neighbours:
            free = FREE * neighbours[0].right.x if high is None else high
            found = self._of_neighbours(free, [n.right for n in neighbours], "down")
        else:
            law = self._found(self.truss if high is None else self.at(high))
            free = self._deployment(law).values[self.limited] if high is None else high
            found = self.first(self.program(law, free), (free,), "down")
        return replace(found, limit=min(found.limit, found.x))

    def _left(
        self, neighbours: Sequence[Slice], lows: Sequence[float], slow: Law, high: float
    ) -> FrontPoint:
        """The point at the lowest limit at which one is found."""
        for low in lows if neighbours else ():
            with suppress(NotFoundError):
                return self._of_neighbours(low, [n.left for n in neighbours], "up")
        return self.first(self.program(slow, high), lows, "up")

    def _of_neighbours(self, limit: float, before: Sequence[FrontPoint], way: Way) -> FrontPoint:
        """The best that the neighbours' points lead to.

        Raises
        ------
        NotFoundError
            If they lead nowhere.
        """
        found, why = [], ""
        for point in before:
            try:
                found.append(self.near(limit, point, way))
            except NotFoundError as error:
                why = str(error)
        if not found:
            raise NotFoundError(why)
        return min(found, key=lambda point: point.y)

    def program(self, law: Law, highest: float) -> FrontProgram:
        """As of a front, stated once for all slices."""
        if self.origin is not None:
            return self.origin.program(law, highest)
        return super().program(law, highest)

    def stated(self, highest: float) -> TrussStudy:
        """As of a front; the shortest duration lies below that of the lowest slice, too."""
        study = super().stated(highest)
        low, high = study.duration
        if self.sliced == "time":
            return replace(study, duration=(low / LONGER, high))
        return study

    def measured(self, limit: float, deployment: Deployment) -> TrussStudy:
        """As of a front; the slice's limit is what a motion has, too."""
        study = super().measured(limit, deployment)
        study = limited(study, self.sliced, max(self.level, deployment.values[self.sliced]))
        if self.sliced == "time":  # of the lowest slice the limit may leak downwards, too
            low, high = study.duration
            return replace(study, duration=((1 - LEAK) * low, high))
        return study

    def on_surface(self, point: FrontPoint) -> SurfacePoint:
        """A point of the slice with its third objective, and the price of the slice's limit."""
        z = point.motion.deployment.values[self.sliced]
        return SurfacePoint(self.level, z, point.motion.slopes[self.constant.name], point)

    @functools.cached_property
    def _plane(self) -> Callable[[float], LeastForce]:
        """As of a front, shared by all slices."""
        if self.origin is not None:
            return self.origin._plane
        return super()._plane

    def _solved(
        self, program: FrontProgram, limit: float, guess: Solution | Trajectory | None
    ) -> Solution:
        """As of a front; a sketch refines a first, coarse mesh a little, which is soonest."""
        if self.study.pareto.coarse and isinstance(guess, Solution):
            with suppress(SolveFailed):
                return self._refined(program, limit, guess.trajectory, self.settings)
        return super()._solved(program, limit, guess)

    def _point(self, *arguments: Any, **named: Any) -> FrontPoint:
        if clock.monotonic() > self.until:
            raise OutOfTimeError
        return super()._point(*arguments, **named)


def _nowhere(text: str) -> None:
    """Take a line of progress that the surface says in its own words."""
