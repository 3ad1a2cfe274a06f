"""Fronts of the truss: what continuation asks of it, and where its walks begin.

The limit is a constant of the engine's problem: a bound of a signal, of an expression or of the
duration. Each solve starts from its neighbour's, see `ocp.NeighbourSolver`.
"""

from __future__ import annotations

import functools
import math
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from models.errors import ModelError
from models.laws import Law
from ocp import (
    Accuracy,
    AdaptiveMesh,
    Constant,
    FrontPoint,
    FrontWay,
    Interrupted,
    NeighbourSolver,
    OcpError,
    PointNotFound,
    Problem,
    Settings,
    Solution,
    Trajectory,
    Trial,
    slopes_by_multipliers,
)
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.common.finished import EARLIER, NOTHING_KEPT
from studies.common.second_solve import SecondSolve, second_solve
from studies.pareto.config import ParetoStudy, limited
from studies.pareto.laws import axis_of
from studies.truss.checks import criteria, judged
from studies.truss.config import SolverOptions, TrussStudy
from studies.truss.limits.bounds import least_jerk, lower_bounds, path_of_angle
from studies.truss.limits.caps import cap_on
from studies.truss.limits.feasibility import Unattained
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import deployment_of, law_of
from studies.truss.motions.starts import start_from_law
from studies.truss.problem import Statement, state
from studies.truss.quantities import OBJECTIVES, QUANTITIES
from studies.truss.search.best_law import best_law
from studies.truss.search.proofs import PhasePlanes, check_some_motion, open_limit
from studies.truss.search.smoothness import first_price

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import LeastForce

# The smoothness of a front's motions is cheaper than that of a single optimum: where a cap presses
# a motion is rougher, and pays more of the same price.
PRICE = 0.1

# A front is read to four digits, and its values are measured between the points of the mesh, not
# promised. So a limit or a peak may leak by this part between them, as the motion is then a point
# with a little more of it, and a finer control may promise a thousandth. What is no part of the
# trade, such as the other caps, is held as closely as the truss asks. A mesh that is refined leaks
# a fifth of that, so that neighbours can be solved on it, too.
LEAK = 5e-4
ACCURACY = Accuracy(objective=1e-3, path=1e-4)
# On few intervals that move a promised gain is some fifty times what finer ones gained in trials.
KEPT = Accuracy(objective=1e-2, path=LEAK)
INTERVALS, COARSE_INTERVALS = 80, 20  # of each phase of the first mesh
ROUNDS = 12
# what a point may take: iterations, so that a slow machine finds the same points, and seconds, so
# that a crawl ends
ITERATIONS, SECONDS = 1500, 180.0

LONGER = 1.01  # than the longest duration that is asked for, which a program leaves as room

# The first limit is above the least by the first of these parts at which a motion is found: at the
# least itself there is no room for anything, and near it little.
ABOVE_THE_LEAST = (2e-3, 1e-2, 5e-2)
COARSE_START = ("bezier",)
# Times the least limit, where a front ends whose other end is open, unless a range is stated. At 20
# times no motion of 140 s was found in 300 s, at 4 times within 5 s.
FAR = 4.0
POINT = "point"  # kind of the files of finished points


@dataclass(frozen=True, eq=False)
class FrontMotion:
    """What is kept of a point.

    Attributes
    ----------
    program : the problem that it solves, with its limit as a constant.
    solution : of the engine.
    deployment : its law on the truss.
    """

    program: FrontProgram
    solution: Solution
    deployment: Deployment


@dataclass(frozen=True, eq=False)
class FrontProgram:
    """One statement for all limits of a walk."""

    statement: Statement
    problem: Problem
    limit: Constant


class TrussFront:
    """A study's motions as points of a front; a `fronts.found.MechanismFront`.

    Attributes
    ----------
    kept : FinishedSteps
        Where ends and points go to, and where those of an earlier run are read. A front is walked
        in the same order whenever it is run, so that a point is known by its number and its limit.
    """

    known = 0.0  # no end is like the other one by chance

    def __init__(self, study: ParetoStudy, console: Console) -> None:
        self.study, self.console = study, console
        self.kept = NOTHING_KEPT
        self.limited, self.least = study.pareto.limited, study.pareto.least
        self.axes = axis_of(self.limited), axis_of(self.least)
        coarse = study.pareto.coarse
        own = study.truss
        if coarse:
            options = SolverOptions(starts=COARSE_START, seconds=own.solver.seconds)
            own = replace(own, solver=options)
        self.truss = own
        self.solves = self.searches = 0
        self.settings = Settings(
            intervals=COARSE_INTERVALS if coarse else INTERVALS,
            accuracy=ACCURACY,
            refinement=AdaptiveMesh(move_breakpoints=False, rounds=ROUNDS),
            iterations=ITERATIONS,
            seconds=SECONDS,
        )
        self.solver = NeighbourSolver(self.settings, KEPT, console.live)

    def check(self) -> None:
        """Refuse what no motion meets.

        A least value that no motion attains is an open end of the front, see `open_ends`.

        Raises
        ------
        StudyError
            As a study of the truss says it.
        """
        for name in (self.limited, self.least):
            if name in OBJECTIVES:
                check_some_motion(self._planes(self.minimising(name)))
        if self.study.pareto.range is not None:
            for limit in self.study.pareto.range:
                check_some_motion(self._planes(self.at(limit)))

    @functools.cached_property
    def open_ends(self) -> dict[str, Unattained]:
        """Least values of the two objectives that no motion attains, by objective."""
        found = {}
        for name in (self.limited, self.least):
            if name in OBJECTIVES:
                least = open_limit(self._planes(self.minimising(name)))
                if least is not None:
                    found[name] = least
        return found

    def _planes(self, study: TrussStudy) -> PhasePlanes:
        return PhasePlanes(study, self.console.progress)

    def minimising(self, name: str) -> TrussStudy:
        """The study with an objective of its own, and no limit."""
        return replace(self.truss, minimise=name)

    def at(self, limit: float) -> TrussStudy:
        """The study with a limit."""
        return limited(self.truss, self.limited, limit)

    def ends(self) -> Iterator[FrontPoint]:
        """The points at the lowest and at the highest limit, from motions that searches found.

        Raises
        ------
        StudyError, PointNotFound
            If one has none.
        """
        (lows, slow), (high, free) = self._limits()
        yield self.first(self.program(slow, high), lows, "up")
        yield self.first(self.program(free, high), (high,), "down")

    def _limits(self) -> tuple[tuple[tuple[float, ...], Law], tuple[float, Law]]:
        """Lowest limits to try and the highest, each with a motion that a search found there."""
        if self.study.pareto.range is not None:
            low, high = self.study.pareto.range
            return ((low,), self._found(self.at(low))), (high, self._found(self.at(high)))

        least, slow = self._least_limit()
        lows = tuple(least * (1 + part) for part in ABOVE_THE_LEAST)
        high, law = self._highest_limit(lows[-1])
        if high <= lows[0]:
            raise StudyError(
                f"there is nothing to trade: the least {QUANTITIES[self.least].title} comes with "
                f"the least {QUANTITIES[self.limited].title}, {least:.6g} "
                f"{QUANTITIES[self.limited].unit}"
            )
        return (lows, slow), (high, law)

    def _highest_limit(self, low: float) -> tuple[float, Law]:
        """The limit at which the other objective is least, and its motion."""
        stated = self.truss.duration[1] if self.limited == "time" else self._cap
        if self.least in self.open_ends:
            # the nearer to a limit that no motion attains, the longer motions take to find
            high = FAR * low if stated is None else min(FAR * low, stated)
            return high, self._found(self.at(high))
        law = self._found(self.truss)
        return stated or self._deployment(law).values[self.limited], law

    @property
    def _cap(self) -> float | None:
        """A cap that the study itself has on what is limited."""
        return cap_on(self.truss.caps, self.truss.drive, self.limited)

    def _least_limit(self) -> tuple[float, Law]:
        """The least of what is limited, and its motion."""
        if self.limited == "peak-jerk":
            least = least_jerk(path_of_angle(self.truss), self.truss.duration[1])
            return least, self._found(self.at(least * (1 + ABOVE_THE_LEAST[0])))
        if self.limited in self.open_ends:
            least = self.open_ends[self.limited].value
            return least, self._found(self.at(least * (1 + ABOVE_THE_LEAST[-1])))
        law = self._found(self.minimising(self.limited))
        return self._deployment(law).values[self.limited], law

    def _found(self, study: TrussStudy) -> Law:
        """The best motion of a search from all starts.

        Where it fails beside an open end, the error says what would close that.
        """
        self.searches += 1
        self.console.progress(f"an end of the front: {study.question}")
        try:
            kept = self.kept.within(f"end {self.searches}")
            return best_law(study, self.console, kept=kept)
        except StudyError as error:
            remedies = [limit.remedy for limit in self.open_ends.values()]
            raise StudyError("; or ".join([str(error), *remedies]), error.exit_code) from error

    def _deployment(self, law: Law) -> Deployment:
        return deployment_of("front", law, self.truss)

    def program(self, law: Law, highest: float) -> FrontProgram:
        """The problem of a walk, with a motion to start from and its highest limit."""
        study, single = self.stated(highest), dict.fromkeys(OBJECTIVES, 1.0)
        limit = Constant("limit", QUANTITIES[self.limited].unit, highest)
        price = PRICE * first_price(study, 0, single, True)
        start = start_from_law("end of the front", law, study)
        # the rope's pull matters everywhere but in some slow motions: there it costs a few rows
        statement = state(study, start, single, True, price, limits={self.limited: limit})
        return FrontProgram(statement, statement.problem(), limit)

    def stated(self, highest: float) -> TrussStudy:
        """The study that a program states, with its highest limit.

        The longest duration lies above the highest limit on it: where both met in one number,
        neither would have a price of its own.
        """
        study = self.at(highest)
        if self.limited == "time":
            return replace(study, duration=(study.duration[0], LONGER * study.duration[1]))
        return study

    def first(self, program: FrontProgram, limits: Sequence[float], way: FrontWay) -> FrontPoint:
        """The point at the end of a front, from the program's own start; the first of some."""
        for limit in limits[:-1]:
            try:
                return self._point(program, limit, None, way, afresh=False)
            except PointNotFound as error:
                self.console.progress(f"no motion was found at {limit:.6g}: {error}")
        return self._point(program, limits[-1], None, way, afresh=False)

    def near(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The point at a limit, from the variables and multipliers of a neighbour."""
        motion: FrontMotion = before.motion
        return self._point(motion.program, limit, motion.solution, way, afresh=False)

    def afresh(self, limit: float, before: FrontPoint, way: FrontWay) -> FrontPoint:
        """The same from the neighbour's motion alone, and a first mesh."""
        motion: FrontMotion = before.motion
        return self._point(motion.program, limit, motion.solution.trajectory, way, afresh=True)

    def _point(
        self,
        program: FrontProgram,
        limit: float,
        guess: Solution | Trajectory | None,
        way: FrontWay,
        afresh: bool,
    ) -> FrontPoint:
        self.solves += 1
        name = f"{self.solves:03d}-{limit:.9g}"
        trial = self.kept.read(POINT, name, program.problem)
        earlier = trial is not None
        if trial is None:
            trial = self._tried(name, program, limit, guess)
            # before it is said: who reads it may kill the process
            self.kept.keep(POINT, trial)
        across = self.axes[0]
        self.console.progress(
            f"solve {self.solves} of the front, {across.title} at most {limit:.5g} {across.unit}: "
            + (EARLIER if earlier else f"{trial.seconds:.1f} s")
        )
        if trial.solution is None:
            raise PointNotFound(str(trial.error))
        try:
            deployment, failed = self._held(program, limit, trial.solution)
        except ModelError as error:
            raise PointNotFound(str(error)) from error
        if failed:
            raise PointNotFound("; ".join(failed))
        return self._told(program, limit, trial, deployment, way, afresh)

    def _tried(
        self,
        name: str,
        program: FrontProgram,
        limit: float,
        guess: Solution | Trajectory | None,
    ) -> Trial:
        """What comes of a solve at a limit."""
        begin = clock.perf_counter()
        try:
            found = self._solved(program, limit, guess)
        except Interrupted as stop:
            raise KeyboardInterrupt from stop
        except (OcpError, ModelError) as error:
            return Trial(name, None, error, math.nan, clock.perf_counter() - begin)
        return Trial(name, found, None, found.objective, clock.perf_counter() - begin)

    def _solved(
        self, program: FrontProgram, limit: float, guess: Solution | Trajectory | None
    ) -> Solution:
        """The solution at a limit, whose caps that are no part of the trade hold, if they can."""
        constants = {program.limit: limit}
        solution = self.solver.near(program.problem, guess, constants)
        if self._held(program, limit, solution)[1]:
            # a limit that is no part of the trade leaks, which a slack rope feels most
            closer = Accuracy(objective=ACCURACY.objective)
            solution = self.solver.refined(program.problem, solution, constants, closer)
        return solution

    def confirmed(self, point: FrontPoint, name: str) -> tuple[FrontPoint, SecondSolve]:
        """A point with what a second solve says of it, or the better one that this leads to."""
        motion: FrontMotion = point.motion
        program = motion.program
        second = second_solve(
            motion.solution,
            self.settings,
            self.console,
            constants={program.limit: point.limit},
            gain=ACCURACY.objective,
            name=name,
            kept=self.kept,
        )
        if second.solution is motion.solution:
            return point, second
        deployment, failed = self._held(program, point.limit, second.solution)
        if failed:
            words = f"FAILED: {name}: a better motion was found that keeps not all limits"
            return point, replace(second, check=replace(second.check, passed=False, sentence=words))
        value, seconds = second.solution.objective, point.seconds
        trial = Trial(name, second.solution, None, value, seconds)
        found = self._told(program, point.limit, trial, deployment, point.way, point.afresh)
        return found, second

    def _told(
        self,
        program: FrontProgram,
        limit: float,
        trial: Trial,
        deployment: Deployment,
        way: FrontWay,
        afresh: bool,
    ) -> FrontPoint:
        """The point of a motion."""
        return FrontPoint(
            limit=limit,
            x=deployment.values[self.limited],
            y=deployment.values[self.least],
            slope=slopes_by_multipliers(trial.solved)[program.limit.name],
            way=way,
            afresh=afresh,
            seconds=trial.seconds,
            motion=FrontMotion(program, trial.solved, deployment),
        )

    def _held(
        self, program: FrontProgram, limit: float, solution: Solution
    ) -> tuple[Deployment, list[str]]:
        """The motion of a solution, and the checks that it fails."""
        study = self.at(limit)
        law = law_of(study, program.statement, solution)
        asked = judged(study) | {self.limited, self.least}
        deployment = replace(self._deployment(law), only=asked)
        # the limit is what was found: it is measured, not promised
        measured = self.at(max(limit, deployment.values[self.limited]))
        held = criteria(measured, deployment)
        return deployment, [check.sentence for check in held if not check.passed]

    def bound(self, x: float) -> float | None:
        """What no motion with at most an x is below, in the objective that is least."""
        study = self.at(x)
        force = None
        if self.least in ("peak-force", "peak-motor-torque", "peak-factored-force"):
            force = self._least_force(x)
        return lower_bounds(study, force).get(self.least)

    def _least_force(self, x: float) -> LeastForce | None:
        """The phase-plane bound of the force; None where there is none."""
        duration = x if self.limited == "time" else self.truss.duration[1]
        try:
            return self._plane(duration)
        except StudyError:
            return None

    @functools.cached_property
    def _plane(self) -> Callable[[float], LeastForce]:
        """The phase plane of the truss, which all points share, and what it has found."""
        from studies.truss.motions.phase_plane import PhasePlane

        plane = PhasePlane(self.truss.truss, opening=self.truss.opening)
        return functools.cache(plane.least_force)
