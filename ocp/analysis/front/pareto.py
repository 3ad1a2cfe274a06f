"""The Pareto front of a problem, by the epsilon-constraint method.

The limited objective is bounded by a constant; each point minimises the other one and starts from
its neighbour's variables and multipliers.  The slope of the front is the multiplier of the limit.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ocp.analysis.front.both_ways import front_between
from ocp.analysis.front.continuation import FrontPoint, FrontWay, PointNotFound
from ocp.analysis.front.envelope import ParetoFront
from ocp.analysis.sensitivity import slopes_by_multipliers
from ocp.analysis.solve_options import SolveOptions
from ocp.errors import Interrupted, OcpError, StatementError
from ocp.keywords import checked_keywords
from ocp.mesh.trajectory import Trajectory
from ocp.problem.bounds import Bound
from ocp.problem.problem import Problem, with_objective
from ocp.problem.symbols import Constant, is_real
from ocp.progress import Progress
from ocp.settings import Settings
from ocp.solution.solution import Solution

# Parts above the least limit at which the front's first point is sought.  At the least itself only
# one motion is left, and the multiplier of the limit may be infinite.
_ABOVE_THE_LEAST = (2e-3, 1e-2, 5e-2)
_LIMIT = "limit of the Pareto front"


@checked_keywords()
def front(
    problem: Problem,
    *,
    limited: Any,
    minimised: Any,
    limits: tuple[float, float] | None = None,
    points: int = 30,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    constants: Mapping[Constant, float] | None = None,
    progress: Progress | bool | None = None,
) -> ParetoFront:
    """Compute the Pareto front of two objectives, walking from both of its ends.

    Every point is solved, refined and verified as `ocp.solve` does it.  Each is a local optimum;
    walks in both directions can end in different ones, of which the lower one counts.

    Parameters
    ----------
    problem : Problem
        Its own objective is not used.
    limited, minimised : expression of functionals, unknowns and constants
        The two objectives: the first one is limited in steps, the second one is minimised at each.
    limits : (float, float), optional
        Lowest and highest limit.  Without it the front begins where the limited objective has its
        minimum, and ends where the minimised one has its minimum.
    points : int
        About as many as a walk along the whole front takes.
    settings, guess, constants, progress : optional
        As of `ocp.solve`.

    Returns
    -------
    ParetoFront

    Raises
    ------
    StatementError
        The statement contradicts itself, the limits cross, or there are fewer than two points.
    SolveFailed, Unverified, Interrupted
        An end of the front was not found.
    """
    if not isinstance(points, int) or points < 2:
        raise StatementError(
            f"the number of points of the Pareto front is {points!r}; give 2 or more"
        )
    if limits is not None:
        low, high = limits
        if not (is_real(low) and is_real(high) and low < high):
            raise StatementError(
                f"the limits {limits!r} of the Pareto front are not in order; give (lowest, "
                "highest)"
            )

    # the limit is a constant, so that all points share one program
    limit = Constant(_LIMIT, value=0.0)
    bound = Bound("limited objective", limited, upper=limit)
    subject = _Traded(
        problem=with_objective(problem, minimised, [bound]),
        alone=(with_objective(problem, limited), with_objective(problem, minimised)),
        limited=limited,
        minimised=minimised,
        limit=limit,
        options=SolveOptions(settings or Settings(), constants or {}, progress),
    )

    left, right, remarks = subject.ends(limits, guess)
    if left is None or right.x <= left.x:
        return ParetoFront((right,), remarks=remarks)
    found = front_between(subject, left, right, points)
    return replace(found, remarks=(*remarks, *found.remarks))


@dataclass(frozen=True, eq=False, repr=False)
class _Traded:
    """A problem whose two objectives are traded; a `FrontSubject`.

    Attributes
    ----------
    problem : Problem
        With the limit as a constant.
    alone : (Problem, Problem)
        Least limited objective, and least of the other one, without a limit.
    """

    problem: Problem
    alone: tuple[Problem, Problem]
    limited: Any
    minimised: Any
    limit: Constant
    options: SolveOptions

    def ends(
        self, limits: tuple[float, float] | None, guess: Solution | Trajectory | None
    ) -> tuple[FrontPoint | None, FrontPoint, tuple[str, ...]]:
        """First and last point, and remarks; no first point if none is found near its limit."""
        if limits is not None:
            right = self._point(limits[1], guess, "down", afresh=True)
            return self._first([limits[0]], right)
        least, other = (self.options.solved(problem, guess) for problem in self.alone)
        lowest, highest = (self._value(found, self.limited) for found in (least, other))
        right = self._point(highest, other.trajectory, "down", afresh=True)
        room = max(abs(lowest), 1e-3 * abs(highest - lowest))
        return self._first([lowest + part * room for part in _ABOVE_THE_LEAST], right, least)

    def _first(
        self, lowest: list[float], right: FrontPoint, near: Solution | None = None
    ) -> tuple[FrontPoint | None, FrontPoint, tuple[str, ...]]:
        """The point at the first of some limits that has one."""
        remarks = list[str]()
        for limit in lowest:
            if limit >= right.limit:
                break
            for guess in (near, right.motion):
                try:
                    if guess is None:
                        continue
                    left = self._point(limit, guess.trajectory, "up", afresh=True)
                    return left, right, tuple(remarks)
                except PointNotFound as error:
                    reason = str(error)
            remarks.append(f"no motion was found at the limit {limit:.6g}: {reason}")
        return None, right, tuple(remarks)

    def near(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The point at a limit, from the variables and multipliers of a neighbour."""
        return self._point(limit, before.motion, way, afresh=False)

    def afresh(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The same from the neighbour's motion alone, on a first mesh."""
        return self._point(limit, before.motion.trajectory, way, afresh=True)

    def _point(
        self, limit: float, guess: Solution | Trajectory | None, way: FrontWay, *, afresh: bool
    ) -> FrontPoint:
        begin = clock.perf_counter()
        try:
            found = self.options.solved(self.problem, guess, constants={self.limit: limit})
        except Interrupted as stop:
            raise KeyboardInterrupt from stop
        except OcpError as error:
            raise PointNotFound(str(error)) from error
        return FrontPoint(
            limit=limit,
            x=self._value(found, self.limited),
            y=self._value(found, self.minimised),
            slope=slopes_by_multipliers(found)[_LIMIT],
            way=way,
            afresh=afresh,
            seconds=clock.perf_counter() - begin,
            motion=found,
        )

    def _value(self, found: Solution, objective: Any) -> float:
        """The larger of the solution's value and its replay's, which lies between the points."""
        return max(float(found.value(objective, replayed=which)) for which in (False, True))
