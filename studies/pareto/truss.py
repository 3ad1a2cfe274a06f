"""Fronts of the truss: what continuation asks of it, and where its walks begin.

The limit is a constant of the engine's problem: a bound of a signal, of an expression or of the
duration. Each solve starts from the variables and the multipliers of its neighbour, on its mesh,
whose program is kept. Where arcs leave the intervals that were made for them, the next mesh has few
intervals, all of whose breakpoints move with the arcs. Where such a mesh fails, one that stays is
refined.
"""

from __future__ import annotations

import functools
import time as clock
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from models.errors import ModelError
from models.laws import Law, least_jerk_cap
from ocp import (
    Accuracy,
    AdaptiveMesh,
    Constant,
    FixedMesh,
    Interrupted,
    MovingMesh,
    OcpError,
    Problem,
    Settings,
    Solution,
    SolveFailed,
    Trajectory,
    Unverified,
    solve,
)
from ocp.analysis.front.continuation import FrontPoint, NotFoundError, Way
from ocp.analysis.sensitivity import slopes_by_multipliers
from ocp.refinement.policies.moving_mesh import merged_mesh, moving_mesh
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.common.second_solve import SecondSolve, second_solve
from studies.pareto.config import ParetoStudy
from studies.truss.checks import criteria, judged
from studies.truss.config import SolverOptions, TrussStudy
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.caps import CAPPED, cap_on
from studies.truss.limits.feasibility import Unattained
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import law_of
from studies.truss.motions.starts import start_from_law
from studies.truss.problem import Statement, state
from studies.truss.quantities import OBJECTIVES, QUANTITIES
from studies.truss.search.best_law import best_law
from studies.truss.search.motion_search import Search
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
MOVING_ITERATIONS = 500  # on a mesh that moves, which converges soon or not at all
# of the range of a signal: what a breakpoint of a mesh that moves has to be worth
MERGED = 5e-4

LONGER = 1.01  # than the longest duration that is asked for, which a program leaves as room

# The first limit is above the least by the first of these parts at which a motion is found: at the
# least itself there is no room for anything, and near it little.
ABOVE_THE_LEAST = (2e-3, 1e-2, 5e-2)
COARSE_START = ("bezier",)


@dataclass(frozen=True, eq=False)
class FrontMotion:
    """What is kept of a point.

    Attributes
    ----------
    program : the problem that it solves, with its limit as a constant.
    solution : of the engine.
    deployment : its law on the truss.
    slopes : of what is least by every named number of the program.
    """

    program: FrontProgram
    solution: Solution
    deployment: Deployment
    slopes: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class FrontProgram:
    """One statement for all limits of a walk."""

    statement: Statement
    problem: Problem
    limit: Constant


def _moves(solution: Solution) -> bool:
    """Whether the breakpoints of a solution's mesh move."""
    return any(phase.movable for phase in solution.mesh.phases)


def _gain(solution: Solution) -> float:
    """What finer controls promise, relative to the objective."""
    return solution.mesh_iterations[-1].gain


def study_at(study: ParetoStudy, limit: float, level: float | None = None) -> TrussStudy:
    """A study of the truss that asks for one point of a front; of a slice with its level, too."""
    truss, sliced = study.truss, study.pareto.sliced
    if sliced is not None and level is not None:
        truss = limited(truss, sliced, level)
    return limited(truss, study.pareto.limited, limit)


def limited(truss: TrussStudy, name: str, limit: float) -> TrussStudy:
    """A study with a limit on a quantity; that of the time is its longest duration."""
    if name == "time":
        return replace(truss, duration=(truss.duration[0], limit))
    return replace(truss, caps=replace(truss.caps, **{CAPPED[name]: limit}))


class TrussFront:
    """A study's motions as points of a front; a `continuation.Subject`."""

    def __init__(self, study: ParetoStudy, console: Console) -> None:
        self.study, self.console = study, console
        self.limited, self.least = study.pareto.limited, study.pareto.least
        coarse = study.pareto.coarse
        own = study.truss
        if coarse:
            options = SolverOptions(starts=COARSE_START, seconds=own.solver.seconds)
            own = replace(own, solver=options)
        self.truss = own
        self.traded = frozenset({self.limited, self.least})
        # further limits that are constants of the program, and their values
        self.others: dict[str, Constant] = {}
        self.constants: dict[Constant, float] = {}
        self.solves = self.refined = 0
        self.settings = Settings(
            intervals=COARSE_INTERVALS if coarse else INTERVALS,
            accuracy=ACCURACY,
            refinement=AdaptiveMesh(move_breakpoints=False, rounds=ROUNDS),
            iterations=ITERATIONS,
            seconds=SECONDS,
        )
        # on the neighbour's mesh if that will do, whose program is kept
        self.kept = Settings(refinement=FixedMesh(), iterations=ITERATIONS, seconds=SECONDS)
        # else on few intervals that follow the arcs
        self.moving = replace(
            self.settings,
            refinement=MovingMesh(kept=KEPT),
            iterations=MOVING_ITERATIONS,
        )
        self.closer = replace(self.settings, accuracy=Accuracy(objective=ACCURACY.objective))

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
                Search(self.minimising(name), self.console).check_feasible()
        if self.study.pareto.range is not None:
            for limit in self.study.pareto.range:
                Search(self.at(limit), self.console).check_feasible()

    @functools.cached_property
    def open_ends(self) -> dict[str, Unattained]:
        """Least values of the two objectives that no motion attains, by objective."""
        found = {}
        for name in (self.limited, self.least):
            if name in OBJECTIVES:
                search = Search(self.minimising(name), self.console)
                if (least := search.unattained) is not None:
                    found[name] = least
        return found

    def minimising(self, name: str) -> TrussStudy:
        """The study with an objective of its own, and no limit."""
        return replace(self.truss, minimise=name)

    def at(self, limit: float) -> TrussStudy:
        """The study with a limit."""
        return limited(self.truss, self.limited, limit)

    def ends(self) -> tuple[tuple[tuple[float, ...], Law], tuple[float, Law]]:
        """Lowest limits to try and the highest, each with a motion that a search found there.

        Raises
        ------
        StudyError
            If there is none.
        """
        if self.study.pareto.range is not None:
            low, high = self.study.pareto.range
            return ((low,), self._found(self.at(low))), (high, self._found(self.at(high)))

        least = self._least_limit()
        lows = tuple(least[0] * (1 + part) for part in ABOVE_THE_LEAST)
        stated = self.truss.duration[1] if self.limited == "time" else self._cap
        law = self._found(self.truss)
        high = stated or self._deployment(law).values[self.limited]
        if high <= lows[0]:
            raise StudyError(
                f"there is nothing to trade: the least {QUANTITIES[self.least].title} comes with "
                f"the least {QUANTITIES[self.limited].title}, {least[0]:.6g} "
                f"{QUANTITIES[self.limited].unit}"
            )
        return (lows, least[1]), (high, law)

    @property
    def _cap(self) -> float | None:
        """A cap that the study itself has on what is limited."""
        return cap_on(self.truss.caps, self.truss.drive, self.limited)

    def _least_limit(self) -> tuple[float, Law]:
        """The least of what is limited, and its motion."""
        if self.limited == "peak-jerk":
            least = least_jerk_cap(self.truss.stroke, self.truss.duration[1])
            return least, self._found(self.at(least * (1 + ABOVE_THE_LEAST[0])))
        law = self._found(self.minimising(self.limited))
        return self._deployment(law).values[self.limited], law

    def _found(self, study: TrussStudy) -> Law:
        """The best motion of a search from all starts."""
        self.console.progress(f"an end of the front: {study.question}")
        return best_law(study, self.console)

    def _deployment(self, law: Law) -> Deployment:
        return Deployment("front", law, self.truss.truss, self.truss.drive, self.truss.margin)

    def program(self, law: Law, highest: float) -> FrontProgram:
        """The problem of a walk, with a motion to start from and its highest limit."""
        study, single = self.stated(highest), dict.fromkeys(OBJECTIVES, 1.0)
        limit = Constant("limit", QUANTITIES[self.limited].unit, highest)
        price = PRICE * first_price(study, 0, single, True)
        start = start_from_law("end of the front", law, study)
        # the rope's pull matters everywhere but in some slow motions: there it costs a few rows
        limits = {self.limited: limit, **self.others}
        statement = state(study, start, single, True, price, limits=limits)
        return FrontProgram(statement, statement.problem(), limit)

    def stated(self, highest: float) -> TrussStudy:
        """The study that a program states, with its highest limit.

        The longest duration lies above the highest limit on it: where both met in one number,
        neither would have a price of its own.
        """
        study = self.at(highest)
        if "time" in (self.limited, *self.others):
            return replace(study, duration=(study.duration[0], LONGER * study.duration[1]))
        return study

    def first(self, program: FrontProgram, limits: Sequence[float], way: Way) -> FrontPoint:
        """The point at the end of a front, from the program's own start; the first of some."""
        for limit in limits[:-1]:
            try:
                return self._point(program, limit, None, way, afresh=False)
            except NotFoundError as error:
                self.console.progress(f"no motion was found at {limit:.6g}: {error}")
        return self._point(program, limits[-1], None, way, afresh=False)

    def near(self, limit: float, before: FrontPoint, way: Way) -> FrontPoint:
        """The point at a limit, from the variables and multipliers of a neighbour."""
        motion: FrontMotion = before.motion
        return self._point(motion.program, limit, motion.solution, way, afresh=False)

    def afresh(self, limit: float, before: FrontPoint, way: Way) -> FrontPoint:
        """The same from the neighbour's motion alone, and a first mesh."""
        motion: FrontMotion = before.motion
        return self._point(motion.program, limit, motion.solution.trajectory, way, afresh=True)

    def _point(
        self,
        program: FrontProgram,
        limit: float,
        guess: Solution | Trajectory | None,
        way: Way,
        afresh: bool,
    ) -> FrontPoint:
        self.solves += 1
        begin = clock.perf_counter()
        try:
            solution = self._solved(program, limit, guess)
            deployment, failed = self._held(program, limit, solution)
            if failed:
                # a limit that is no part of the trade leaks, which a slack rope feels most
                solution = self._refined(program, limit, solution, self.closer)
                deployment, failed = self._held(program, limit, solution)
            x, y = deployment.values[self.limited], deployment.values[self.least]
        except Interrupted as stop:
            raise KeyboardInterrupt from stop
        except (OcpError, ModelError) as error:
            raise NotFoundError(str(error)) from error

        if failed:
            raise NotFoundError("; ".join(failed))
        seconds = clock.perf_counter() - begin
        slopes = slopes_by_multipliers(solution)
        motion = FrontMotion(program, solution, deployment, slopes)
        return FrontPoint(limit, x, y, slopes[program.limit.name], way, afresh, seconds, motion)

    def confirmed(self, point: FrontPoint, name: str) -> tuple[FrontPoint, SecondSolve]:
        """A point with what a second solve says of it, or the better one that this leads to."""
        motion: FrontMotion = point.motion
        program, limits = motion.program, {motion.program.limit: point.limit, **self.constants}
        second = second_solve(
            motion.solution,
            self.settings,
            self.console,
            constants=limits,
            gain=ACCURACY.objective,
            name=name,
        )
        if second.solution is motion.solution:
            return point, second
        deployment, failed = self._held(program, point.limit, second.solution)
        if failed:
            words = f"FAILED: {name}: a better motion was found that keeps not all limits"
            return point, replace(second, check=replace(second.check, passed=False, sentence=words))
        slopes = slopes_by_multipliers(second.solution)
        return replace(
            point,
            x=deployment.values[self.limited],
            y=deployment.values[self.least],
            slope=slopes[program.limit.name],
            motion=FrontMotion(program, second.solution, deployment, slopes),
        ), second

    def _held(
        self, program: FrontProgram, limit: float, solution: Solution
    ) -> tuple[Deployment, list[str]]:
        """The motion of a solution, and the checks that it fails."""
        study = self.at(limit)
        asked = judged(study) | self.traded
        law = law_of(study, program.statement, solution)
        deployment = replace(self._deployment(law), only=asked)
        # the limit is what was found: it is measured, not promised
        held = criteria(self.measured(limit, deployment), deployment)
        return deployment, [check.sentence for check in held if not check.passed]

    def measured(self, limit: float, deployment: Deployment) -> TrussStudy:
        """The study whose limit is what a motion has, where that is a little more than was set."""
        return self.at(max(limit, deployment.values[self.limited]))

    def _solved(
        self, program: FrontProgram, limit: float, guess: Solution | Trajectory | None
    ) -> Solution:
        """On the mesh of a neighbour, on one that follows it, or else refined on one that stays."""
        constants = {program.limit: limit, **self.constants}
        follows = isinstance(guess, Solution) and _moves(guess)
        if isinstance(guess, Solution) and not follows:
            with suppress(SolveFailed):
                found = solve(
                    program.problem,
                    settings=self.kept,
                    constants=constants,
                    guess=guess,
                    progress=self.console.live,
                    partial=False,
                )
                if found.verification.excess <= LEAK and _gain(found) <= KEPT.objective:
                    return found
                # a leak alone is soon closed; a gain says that arcs have left their intervals
                guess, follows = found, _gain(found) > ACCURACY.objective

        if isinstance(guess, Solution) and follows:
            with suppress(SolveFailed):
                return solve(
                    program.problem,
                    settings=self.moving,
                    constants=constants,
                    guess=guess,
                    mesh=moving_mesh(guess.kept_iterate, guess.evaluator, MERGED),
                    progress=self.console.live,
                    partial=False,
                )

        return self._refined(program, limit, guess, self.settings)

    def _refined(
        self,
        program: FrontProgram,
        limit: float,
        guess: Solution | Trajectory | None,
        settings: Settings,
    ) -> Solution:
        """On a mesh that is refined; what leaks little is good enough for a front."""
        self.refined += 1
        mesh = None
        if isinstance(guess, Solution) and _moves(guess):
            mesh = merged_mesh(guess.kept_iterate, guess.evaluator, MERGED)
        try:
            return solve(
                program.problem,
                settings=settings,
                constants={program.limit: limit, **self.constants},
                guess=guess,
                mesh=mesh,
                progress=self.console.live,
                partial=False,
            )
        except Unverified as error:
            answer = error.iterate
            if isinstance(answer, Solution) and answer.verification.excess <= LEAK:
                return answer
            raise

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

        return functools.cache(PhasePlane(self.truss.truss).least_force)
