"""Fronts of the truss: what continuation asks of it, and where its walks begin.

The limit is a constant of the engine's problem: a bound of a signal, of an expression or of the
duration. Each solve starts from its neighbour's, see `ocp.NeighbourSolver`.
"""

from __future__ import annotations

import functools
import math
import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from models.errors import ModelError
from models.laws import Law
from ocp import (
    Accuracy,
    AdaptiveMesh,
    FrontPoint,
    FrontWay,
    Interrupted,
    NeighbourSolver,
    OcpError,
    PointNotFound,
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
from studies.pareto.config import ParetoStudy
from studies.pareto.ends import both_ends
from studies.pareto.laws import axis_of
from studies.pareto.traded import FrontProgram, Traded
from studies.truss.config import SolverOptions, TrussStudy
from studies.truss.limits.feasibility import Unattained
from studies.truss.motions.deployment import Deployment
from studies.truss.search.best_law import best_law
from studies.truss.search.proofs import PhasePlanes, check_some_motion, open_limit

# A front is read to four digits, and its values are evaluated between the points of the mesh. So a
# limit or a peak may be exceeded by this part between them, as the motion is then a point with a
# little more of it, and a finer control may gain a thousandth. Other caps, which are no part of the
# trade, are held as closely as the truss asks. A refined mesh leaves a fifth of that violation, so
# that neighbours can be solved on it, too.
LEAK = 5e-4
ACCURACY = Accuracy(objective=1e-3, path=1e-4)
# On few intervals that move an estimated gain is some fifty times what finer ones gained in trials.
KEPT = Accuracy(objective=1e-2, path=LEAK)
INTERVALS, COARSE_INTERVALS = 80, 20  # of each phase of the first mesh
ROUNDS = 12
# what a point may take: iterations, so that a slow machine finds the same points, and seconds, so
# that a crawl ends
ITERATIONS, SECONDS = 1500, 180.0

COARSE_START = ("bezier",)
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
        limited, least = study.pareto.limited, study.pareto.least
        self.axes = axis_of(limited), axis_of(least)
        coarse = study.pareto.coarse
        own = study.truss
        if coarse:
            options = SolverOptions(starts=COARSE_START, seconds=own.solver.seconds)
            own = replace(own, solver=options)
        self.traded = Traded(own, limited, least)
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
        traded = self.traded
        studies = [traded.minimising(name) for name in traded.objectives]
        studies += [traded.at(limit) for limit in self.study.pareto.range or ()]
        for study in studies:
            check_some_motion(self._planes(study))

    @functools.cached_property
    def open_ends(self) -> dict[str, Unattained]:
        """Least values of the two objectives that no motion attains, by objective."""
        names = self.traded.objectives
        found = ((name, open_limit(self._planes(self.traded.minimising(name)))) for name in names)
        return {name: limit for name, limit in found if limit is not None}

    def _planes(self, study: TrussStudy) -> PhasePlanes:
        return PhasePlanes(study, self.console.progress)

    def ends(self) -> Iterator[FrontPoint]:
        """The points at the lowest and at the highest limit, from motions that searches found.

        Raises
        ------
        StudyError, PointNotFound
            If one has none.
        """
        traded, stated = self.traded, self.study.pareto.range
        low, high = both_ends(traded, stated, self.open_ends, self._found)
        (highest,) = high.limits
        yield self._first(traded.program(low.law, highest), low.limits, "up")
        yield self._first(traded.program(high.law, highest), high.limits, "down")

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

    def _first(self, program: FrontProgram, limits: Sequence[float], way: FrontWay) -> FrontPoint:
        """The point at the end of a front, from the program's own start; the first of some."""
        for limit in limits[:-1]:
            try:
                return self._point(program, limit, None, way, afresh=False)
            except PointNotFound as error:
                self.console.progress(
                    f"point at {limit:.6g} skipped, because no motion was found: {error}"
                )
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
            deployment, failed = self.traded.held(program, limit, trial.solution)
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
        if self.traded.held(program, limit, solution)[1]:
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
        deployment, failed = self.traded.held(program, point.limit, second.solution)
        if failed:
            words = (
                f"FAILED: {name}: the second solve found a better motion, which does not keep all "
                "limits"
            )
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
            x=deployment.values[self.traded.limited],
            y=deployment.values[self.traded.least],
            slope=slopes_by_multipliers(trial.solved)[program.limit.name],
            way=way,
            afresh=afresh,
            seconds=trial.seconds,
            motion=FrontMotion(program, trial.solved, deployment),
        )
