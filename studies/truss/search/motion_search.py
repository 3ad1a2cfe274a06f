"""Solves the truss's problem from several starts and says what was found, and how sure that is."""

from __future__ import annotations

import functools
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from models.laws import Law
from ocp import Accuracy, Audit, Interrupted, OcpError, Optimum, Problem, Solution, Trial, audit
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT
from studies.common.result import Verdict
from studies.common.rounding import up
from studies.common.second_solve import SecondSolve, second_solve
from studies.drive.motor import rotor_mass
from studies.truss.checks import objective_sizes
from studies.truss.config import TrussStudy
from studies.truss.limits.bounds import lower_bounds
from studies.truss.limits.feasibility import (
    Unattained,
    check_feasible,
    force_cap,
    motor_force_cap,
    unattained,
)
from studies.truss.motions.deployment import Deployment
from studies.truss.motions.laws import deployment_of, law_of
from studies.truss.motions.starts import (
    KINDS,
    from_neighbour,
    in_order,
    start_from_law,
    starting_motion,
)
from studies.truss.problem import Statement, control_of, needs_forces, settings_of, state
from studies.truss.quantities import OBJECTIVES
from studies.truss.search.best_motion import BestMotion, NoMotionError, first_motion
from studies.truss.search.later_stages import in_order as in_order_in_words
from studies.truss.search.later_stages import later_stages
from studies.truss.search.missed_cap import (
    CapsMissedError,
    curve_in_words,
    hard_cap,
    hard_caps,
    solved_soon,
    together,
)
from studies.truss.search.relaxation import none_found, relaxation_in_words
from studies.truss.search.smoothness import (
    first_price,
    lightened,
    price_in_words,
)
from studies.truss.search.verdict import (
    BOUND_MET,
    basins,
    global_verdict,
    local_verdict,
    of_trial,
    starts_agree,
    unattained_verdict,
)

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.motions.phase_plane import LeastForce, PhasePlane
    from studies.truss.motions.starts import StartingMotion

SAME_BASIN = 1e-4  # relative: optima closer than this are one basin, solved to different meshes
SAME_WITH_ARM = 2e-3  # the same with an arm, whose optima are known to 1e-3
STOPPED = "interrupted before a motion was found; the inputs are kept"
LEAST_LEFT = 0.1  # of the seconds, for what has to follow the starts
OTHER_START = "without a cap"  # the motion that was found with the least of what the cap is on


class Search:
    """One study on its way to a result; holds what is computed once and used often.

    Parameters
    ----------
    enough : float, optional
        A value of the first objective that ends the search. Then about the least value is all that
        is asked: without bounds, and at the first price of the roughness.
    accuracy : Accuracy, optional
        Of the motions; that of a result by default.
    confirms : bool
        Whether the motion is solved a second time, in another way, because it will be printed.
    """

    def __init__(
        self,
        study: TrussStudy,
        console: Console,
        neighbour: Law | None = None,
        enough: float | None = None,
        accuracy: Accuracy | None = None,
        *,
        confirms: bool = False,
    ) -> None:
        self.study = study
        self.enough = enough
        self.accuracy = accuracy
        self.confirms = confirms
        self.neighbour = neighbour  # motion of a like study, from which the first start begins
        self.console = console
        self.remarks: list[str] = []
        self.in_order = ""  # what the later objectives reached
        self.interrupted = False
        self.kept = NOTHING_KEPT  # where finished starts go to, and come from
        self._begin = clock.monotonic()
        self._with_forces = needs_forces(study)
        self._started = 0  # starts that are done
        self._hard_cap = hard_cap(study)
        self._statements: dict[Problem, Statement] = {}

    @functools.cached_property
    def plane(self) -> PhasePlane:
        """The phase plane of the truss."""
        from studies.truss.motions.phase_plane import PhasePlane

        return PhasePlane(self.study.truss)

    @functools.cached_property
    def motor_plane(self) -> PhasePlane:
        """That of a motor with a rotor, which is a mass on the rope if its drum has one layer.

        Raises
        ------
        StudyError
            If the drum has several.
        """
        from studies.truss.motions.phase_plane import PhasePlane

        drive = self.study.drive
        if drive is not None and drive.rope_diameter is not None:
            raise StudyError("The phase plane gives no bound for a drum of several layers.")
        return PhasePlane(self.study.truss, rotor_mass(drive, 0.0))

    @functools.cached_property
    def _least_force_or_why(self) -> LeastForce | StudyError:
        """The phase-plane bound of the force, or why there is none; worked out once either way."""
        self.console.progress("phase plane: least force without further caps")
        try:
            return self.plane.least_force(self.study.duration[1])
        except StudyError as error:
            return error

    @functools.cached_property
    def _least_pull_or_why(self) -> LeastForce | StudyError:
        """The same of the force of a motor with a rotor."""
        self.console.progress("phase plane: least force of the motor with its rotor")
        try:
            return self.motor_plane.least_force(self.study.duration[1])
        except StudyError as error:
            return error

    @property
    def least_force(self) -> LeastForce:
        """The phase-plane bound of the force.

        Raises
        ------
        StudyError
            If it cannot be had for this truss.
        """
        return _or_raised(self._least_force_or_why)

    @property
    def least_pull(self) -> LeastForce:
        """The phase-plane bound of the force of a motor with a rotor.

        Raises
        ------
        StudyError
            If it cannot be had for this truss or drum.
        """
        return _or_raised(self._least_pull_or_why)

    @functools.cached_property
    def bounds(self) -> dict[str, float]:
        """Lower bounds by quantity; the phase plane only where it can matter."""
        cap, motor_cap = force_cap(self.study), motor_force_cap(self.study)
        least_time, force, motor = 0.0, None, None
        if self.interrupted or self.enough is not None or self.study.arm is not None:
            # no more long work, or none that holds for a ring on an arm
            return lower_bounds(self.study, None)

        drive, objectives = self.study.drive, set(self.study.objectives)
        of_the_motor = {"peak-motor-force", "peak-motor-torque", "peak-factored-force"}
        try:
            least_time = 0.0 if cap is None else self.plane.least_time(cap)
            if drive is not None and drive.motor_inertia > 0.0:
                if motor_cap is not None:
                    least_time = max(least_time, self.motor_plane.least_time(motor_cap))
                motor = self.least_pull if objectives & of_the_motor else None
                of_the_motor = set()
            force = self.least_force if objectives & {"peak-force", *of_the_motor} else None
        except KeyboardInterrupt:  # the motions found so far are worth more than this bound
            self.interrupted = True
        except StudyError as error:  # none to be had
            self.remarks.append(str(error))
        return lower_bounds(self.study, force, least_time, motor=motor)

    @functools.cached_property
    def references(self) -> dict[str, float]:
        """Sizes that make weighted objectives comparable."""
        return objective_sizes(self.study)

    def check(self) -> None:
        """Refuse caps that no motion meets, and optima that no motion attains.

        Raises
        ------
        StudyError
            With the nearest value that works.
        """
        self.check_feasible()
        if self.unattained is not None:
            raise self.unattained.refusal

    def check_feasible(self) -> None:
        """Refuse caps that no motion meets.

        Raises
        ------
        StudyError
            With the nearest value that works.
        """
        check_feasible(self.study, lambda: self.least_force, lambda: self.least_pull)

    @functools.cached_property
    def unattained(self) -> Unattained | None:
        """The least value of the only objective where no motion attains it."""
        return unattained(self.study, lambda: self.least_force, lambda: self.least_pull)

    def run(self) -> BestMotion:
        """Search, first without forces where they do not matter, and report the best.

        Raises
        ------
        StudyError
            If no motion was found.
        """
        with_forces = needs_forces(self.study)
        best = self._from_all_starts(with_forces)

        floor = self.study.caps.least_tension
        if not with_forces and best.deployment.values["least-tension"] < floor:
            if self.interrupted:  # what was found is no motion that the rope can pull
                raise StudyError(STOPPED, ExitCode.INTERRUPTED)
            self.console.progress("the rope would have to push: again with forces in the problem")
            self.remarks.append("The rope's pull limits this motion (T1 >= 0 is active).")
            best = self._from_all_starts(True)
        return best

    def _from_all_starts(self, with_forces: bool) -> BestMotion:
        """The best of all starts, one after the other until one meets the bound or enough agree."""
        force_drives = control_of(self.study, with_forces)[0] == "force"
        names = in_order(self.study.solver.starts, force_drives)
        if not with_forces:  # the phase plane of the force says nothing here
            names = [name for name in names if name != "phase-plane"] or names

        self._with_forces, self._started, self._statements = with_forces, 0, {}
        starts: dict[str, Callable[[], Problem]]
        starts = {name: functools.partial(self._stated, name) for name in names}
        if self.neighbour is not None:
            near = from_neighbour(self.neighbour, self.study)
            starts = {near.name: functools.partial(self._stated_from, near), **starts}
        try:
            return self._from_some(starts)
        except CapsMissedError as missed:
            # a search for a least value is part of the table itself
            if self.enough is not None or len(hard_caps(self.study)) < 2:
                raise
            self.console.progress("no motion keeps the caps together: the least of each")
            share = self._some_left() / (2 * len(hard_caps(self.study)) + 1)
            raise together(self.study, self._least_of, share) from missed
        except Interrupted as stop:
            raise StudyError(STOPPED, ExitCode.INTERRUPTED) from stop
        except (OcpError, NoMotionError) as error:
            if self.interrupted:
                raise StudyError(STOPPED, ExitCode.INTERRUPTED) from error
            return self._from_the_least_relaxation(names, error)

    def _from_some(self, starts: Mapping[str, Callable[[], Problem]]) -> BestMotion:
        """The best of some starts; CapsMissedError if the first finds none and a cap is missed."""
        first, *_ = starts
        soon = self._solved_soon(first, starts[first], len(starts))
        if soon is not None and soon.error is not None:
            if self.interrupted:
                raise Interrupted(STOPPED) from soon.error
            self._check_the_least(soon)
            soon = None
        return self._best_of(self._audited(starts, soon))

    def _least_of(self, study: TrussStudy, key: str) -> float | None:
        """About the least value of a quantity that a study minimises; None if none is found."""
        search = Search(study, self.console, enough=0.0)
        try:
            search.check()
            return search.run().deployment.values[key]
        except StudyError as error:
            if error.exit_code is ExitCode.INTERRUPTED:
                raise
            return None

    def _solved_soon(self, name: str, start: Callable[[], Problem], count: int) -> Trial | None:
        """The first start, where a cap may be missed and little effort tells."""
        known = name in self.kept.names(self._kind)
        if known or self._hard_cap is None:
            return None
        soon, self.interrupted = solved_soon(
            name,
            start,
            count,
            settings=settings_of(self.study, self._with_forces, self.accuracy),
            value=self._value,
            seconds=self._some_left(),
            console=self.console,
        )
        return soon

    def _check_the_least(self, soon: Trial) -> None:
        """Refuse a hard cap below the least found of what it is on; Interrupted if stopped."""
        assert self._hard_cap is not None
        self.console.progress(f"{soon.name}: no motion was found at once")
        least = self._least
        if self.interrupted:
            raise Interrupted(STOPPED)
        if least is not None:
            self._hard_cap.check(self.study, least)

    def _audited(
        self, starts: Mapping[str, Callable[[], Problem]], soon: Trial | None = None
    ) -> Audit:
        """What came of starts; those that are known, or that an earlier run has finished, are read.

        Parameters
        ----------
        soon : Trial, optional
            What came of the first one already.
        """
        # another start than a law begins where a search ended
        stated = {name: functools.partial(self._stated, name) for name in starts if name in KINDS}
        at_once = {} if soon is None else {soon.name: soon}
        found = audit(
            starts=starts,
            settings=settings_of(self.study, self._with_forces, self.accuracy),
            bound=self._bound_now,
            bound_gap=BOUND_MET,
            value=self._value,
            same=self._same,
            enough=lambda trials: self._enough(list(starts), trials),
            failures=(StudyError,),
            seconds=self._some_left(),
            known={**self.kept.known(self._kind, stated), **at_once},
            progress=self.console.live,
            finished=lambda trial: self._finished(trial, len(starts)),
        )
        self.interrupted = self.interrupted or found.interrupted
        return found

    def _enough(self, names: Sequence[str], trials: Sequence[Trial]) -> bool:
        """Whether no further start is needed."""
        last = trials[-1]
        if self.interrupted:
            return True
        if self.enough is not None and last.error is None and last.value <= self.enough:
            return True
        return starts_agree(names, trials, self._same)

    @property
    def _same(self) -> float:
        """Relative distance of two optima within which they are one."""
        return SAME_BASIN if self.study.arm is None else SAME_WITH_ARM

    @property
    def _left(self) -> float:
        """What is left of the seconds that the search may take, negative when they are over."""
        return self.study.solver.seconds - (clock.monotonic() - self._begin)

    def _some_left(self) -> float:
        """The same, and a little where nothing is left."""
        return max(self._left, LEAST_LEFT * self.study.solver.seconds)

    @property
    def _kind(self) -> str:
        """Name of the problem that is being solved, in files of finished starts."""
        return "forces" if self._with_forces else "motion"

    def _stated(self, name: str) -> Problem:
        """The problem as it is stated for one start, with its guess."""
        return self._stated_from(starting_motion(name, self.study, lambda: self.least_force))

    def _stated_from(self, start: StartingMotion) -> Problem:
        """The problem as it is stated for a motion to start from."""
        price = first_price(self.study, 0, self._weights(), self._with_forces)
        statement = state(self.study, start, self._weights(), self._with_forces, price)
        problem = statement.problem()
        self._statements[problem] = statement
        return problem

    def _value(self, problem: Problem, solution: Solution) -> float:
        """The first objective of the replay, as it is reported: without the price of roughness."""
        return solution.value(self._statements[problem].stages[0], replayed=True)

    def _finished(self, trial: Trial, count: int) -> None:
        """Keep a start that is done, and say so in one line."""
        # kept before it is said: who reads that it is done may kill the process
        earlier = trial.name in KINDS and not self.kept.keep(self._kind, trial)

        self._started += 1
        label = f"start {self._started} of {count} ({trial.name})"
        when = ", in an earlier run" if earlier else ""
        self.console.progress(f"{label}: {of_trial(trial, self.study)}{when}")

    def _weights(self) -> dict[str, float]:
        """References by which to divide; a single objective keeps its own unit."""
        single = all(len(stage) == 1 for stage in self.study.minimise)
        return dict.fromkeys(OBJECTIVES, 1.0) if single else self.references

    def _best_of(self, found: Audit) -> BestMotion:
        """The best of an audit, its later stages, and the verdict.

        Raises
        ------
        NoMotionError
            If the model takes none of the unverified answers for a motion.
        """
        optima = self._smoothed(found.optima)
        optimum, deployment = first_motion(optima, self._moved)
        statement = self._statements[optimum.solution.problem]
        distinct = basins(self.study, optima)
        solution, verified = optimum.solution, optimum.solution.verification.passed
        if verified and not self.interrupted and len(statement.stages) > 1:
            solution = self._later_stages(statement, solution)
            deployment = self._deployment(statement, solution)
        # with an arm a second solve would take as long again: the arm is integrated another way
        confirms = self.confirms and verified and self.study.arm is None
        second = self._second_solve(solution) if confirms else None
        if second is not None and second.solution is not solution:
            solution = second.solution
            deployment = self._deployment(statement, solution)
            if len(statement.stages) == 1:
                value = solution.value(statement.stages[0], replayed=True)
                optimum = replace(optimum, solution=solution, value=value)
                distinct = basins(self.study, [optimum, *optima[1:]])

        if price := price_in_words(statement, optimum.solution):
            self.remarks.append(price)

        bound = self._bound()
        if not verified:
            reasons = "; ".join(optimum.solution.verification.reasons)
            stopped = ", then interrupted" if self.interrupted else ""
            verdict = Verdict("unverified", f"unverified: {reasons}{stopped}")
        elif (unattained := self._unattained(deployment)) is not None:
            verdict = unattained
        elif bound is not None and optimum.value <= bound * (1 + BOUND_MET):
            verdict = global_verdict(self.study, optimum.value, bound, distinct[0])
        else:
            verdict = local_verdict(
                self.study, found, optimum.value, bound, distinct, late=self._left < 0.0
            )

        if self.in_order:
            verdict = replace(verdict, sentence=f"{verdict.sentence}; {self.in_order}")
        return BestMotion(
            deployment=deployment,
            solution=solution,
            trials=found.trials,
            basins=distinct,
            bounds=self.bounds,
            verdict=verdict,
            remarks=tuple(self.remarks),
            interrupted=self.interrupted,
            second=() if second is None else (second.check,),
        )

    def _second_solve(self, solution: Solution) -> SecondSolve | None:
        """What a second solve says of an answer; None where the user has stopped the search."""
        if self.interrupted:
            return None
        settings = settings_of(self.study, self._with_forces, self.accuracy)
        left = self._some_left()
        second = second_solve(solution, settings, self.console, left=left, kept=self.kept)
        self.interrupted = second.interrupted
        return second

    def _smoothed(self, optima: Sequence[Optimum]) -> list[Optimum]:
        """The optima without what smoothness costs them, the best one first."""
        if self.enough is not None or self.study.arm is not None:
            return sorted(optima, key=lambda optimum: optimum.value)
        found, interrupted = lightened(
            optima,
            self._statements,
            settings=settings_of(self.study, self._with_forces, self.accuracy),
            left=self._some_left,
            value=self._value,
            console=self.console,
            stopped=self.interrupted,
            kept=self.kept,
        )
        self.interrupted = self.interrupted or interrupted
        return found

    def _moved(self, solution: Solution) -> Deployment:
        """The motion of a solution."""
        return self._deployment(self._statements[solution.problem], solution)

    def _deployment(self, statement: Statement, solution: Solution) -> Deployment:
        law = law_of(self.study, statement, solution)
        return deployment_of("optimal", law, self.study)

    def _unattained(self, deployment: Deployment) -> Verdict | None:
        """The verdict on a motion whose force is at a limit that no motion attains."""
        if self.interrupted or self.study.jerk_limited or self.study.arm is not None:
            return None
        for key in ("peak-force", "peak-motor-force"):
            if key in self.study.objectives:
                of_the_rope = key == "peak-force"
                least = self._least_force_or_why if of_the_rope else self._least_pull_or_why
                if not isinstance(least, StudyError):
                    return unattained_verdict(deployment.values[key], least)
        return None

    def _later_stages(self, statement: Statement, solution: Solution) -> Solution:
        """Later objectives, each with the earlier ones held; never a loss."""
        settings = settings_of(self.study, self._with_forces, self.accuracy)
        found, remarks = later_stages(
            self.study,
            statement,
            solution,
            self._weights(),
            self._with_forces,
            replace(settings, seconds=self._some_left()),
            self.console,
            self.kept,
        )
        self.remarks += remarks
        self.in_order = in_order_in_words(self.study, found)
        self.interrupted = self.interrupted or found.interrupted
        return found.solution

    def _from_the_least_relaxation(self, names: Sequence[str], error: Exception) -> BestMotion:
        """Where every start failed: the best motion from one that a relaxed problem gives.

        Raises
        ------
        StudyError
            If that fails too: with the least relaxation found, and the error of the first start.
        """
        tried = max(self._started, 1)
        hard, needed = self._hard_cap, "the relaxed problem was not solved either"
        least = None if hard is None else self._least
        if hard is not None and least is not None:
            value, name = least.deployment.values[hard.key], hard.quantity.title
            unit = hard.quantity.unit
            needed = (
                f"under the other caps {up(value)} {unit} is the least found for the {name} "
                "(local): raise its cap to that, or loosen another one"
                f"{hard.margins_in_words(least)}"
            )
            if value <= hard.value and not self.interrupted:
                try:
                    start = start_from_law(OTHER_START, least.deployment.law, self.study)
                    again = {OTHER_START: functools.partial(self._stated_from, start)}
                    return self._best_of(self._audited(again))
                except (OcpError, NoMotionError):
                    needed = f"a motion with a {name} of {value:.6g} {unit} meets the caps"
        elif hard is None and self.enough is None:
            self.console.progress("no motion was found: looking for the least relaxation")
            needed = relaxation_in_words(self._stated("bezier"), self.console.live) or needed

        needed += curve_in_words(self.study)
        raise none_found(names, tried, needed, error, self.interrupted) from error

    @functools.cached_property
    def _least(self) -> BestMotion | None:
        """The motion with the least of the hardest cap under the other caps; None if none is found.

        A search of its own, from one start of each kind: `ocp.relaxed` answers at once, but on a
        fixed mesh it is 0.2 to 1.5 % off, and on an adapting one it takes far longer than this.
        A CapsMissedError says that the other caps alone are missed.
        """
        hard = self._hard_cap
        assert hard is not None
        title = hard.quantity.title
        self.console.progress(f"looking for what is the least under the other caps: {title}")
        lifted = hard.lifted(self.study, self._some_left())
        search = Search(lifted, self.console, enough=hard.enough)
        search.kept = self.kept.within(f"least {hard.key}")
        try:
            found = search.run()
            self.interrupted = search.interrupted
            return found
        except (Interrupted, KeyboardInterrupt):
            self.interrupted = True
        except CapsMissedError:  # the other caps are missed by themselves
            raise
        except StudyError as error:
            self.interrupted = error.exit_code is ExitCode.INTERRUPTED
        except OcpError:
            pass
        return None

    def _bound(self) -> float | None:
        """A proven bound of the first objective."""
        first = self.study.minimise[0]
        return self.bounds.get(next(iter(first))) if len(first) == 1 else None

    def _bound_now(self) -> float | None:
        """The same for the engine, which stops where the user stopped the search for it."""
        bound = self._bound()
        if self.interrupted:
            raise KeyboardInterrupt
        return bound


def _or_raised(found: LeastForce | StudyError) -> LeastForce:
    if isinstance(found, StudyError):
        raise found
    return found
