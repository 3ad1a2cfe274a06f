"""Solves the truss's problem from several starts and says what was found, and how sure that is."""

from __future__ import annotations

import functools
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ocp import (
    AdaptiveMesh,
    Bound,
    FixedMesh,
    Interrupted,
    Mesh,
    OcpError,
    PhaseTrajectory,
    Settings,
    Solution,
    SolveFailed,
    Unverified,
    solve,
)
from ocp.mesh.mesh import PhaseMesh
from ocp.nlp.interrupts import noted_interrupts
from studies.common.console import Console, number
from studies.common.exit_codes import ExitCode, StudyError
from studies.truss.bounds import lower_bounds
from studies.truss.compare import paper_laws
from studies.truss.config import TrussStudy
from studies.truss.deployment import Deployment
from studies.truss.guesses import Start, starts
from studies.truss.outcome import Attempt, Outcome, basins, global_verdict, local_verdict
from studies.truss.problem import Statement, control_shape, needs_forces, state
from studies.truss.quantities import OBJECTIVES
from studies.truss.solved_law import law_of

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.phase_plane import LeastForce, PhasePlane

BOUND_MET = 1e-4  # relative distance to a global bound that counts as meeting it
SMOOTHING = 3e-5  # of the Bezier law's value: what smoothness may cost a peak at most


class Search:
    """One study on its way to an outcome; holds what is computed once and used often."""

    def __init__(self, study: TrussStudy, console: Console) -> None:
        self.study = study
        self.console = console
        self.remarks: list[str] = []
        self.interrupted = False

    @functools.cached_property
    def plane(self) -> PhasePlane:
        """The phase plane of the truss."""
        from studies.truss.phase_plane import PhasePlane

        return PhasePlane(self.study.truss)

    @functools.cached_property
    def least_force(self) -> LeastForce:
        """The phase-plane bound of the force."""
        self.console.progress("phase plane: least force without further caps")
        return self.plane.least_force(self.study.duration[1])

    @functools.cached_property
    def bounds(self) -> dict[str, float]:
        """Lower bounds by quantity; the phase plane only where it can matter."""
        cap = self.study.caps.force
        least_time, force = 0.0, None
        if self.interrupted:  # no more long work
            return lower_bounds(self.study, None)
        try:
            least_time = 0.0 if cap is None else self.plane.least_time(cap)
            force = self.least_force if "peak-force" in self.study.objectives else None
        except KeyboardInterrupt:  # the motions found so far are worth more than this bound
            self.interrupted = True
        except StudyError as error:  # none to be had
            self.remarks.append(str(error))
        return lower_bounds(self.study, force, least_time)

    @functools.cached_property
    def references(self) -> dict[str, float]:
        """Sizes that make weighted objectives comparable: the Bezier law's values."""
        bezier, _ = paper_laws(self.study.truss, self.study.duration[1])
        return {name: bezier.values[name] for name in OBJECTIVES}

    def run(self) -> Outcome:
        """Search, first without forces where they do not matter, and report the best."""
        self._check_attained()
        with_forces = needs_forces(self.study)
        outcome = self._from_all_starts(with_forces)
        floor = self.study.caps.least_tension
        if not with_forces and outcome.deployment.values["least-tension"] < floor:
            self.console.progress("the rope would have to push: again with forces in the problem")
            self.remarks.append("The rope's pull limits this motion (T1 >= 0 is active).")
            outcome = self._from_all_starts(True)
        return outcome

    def _check_attained(self) -> None:
        """Refuse to print an optimum that no motion attains."""
        caps = self.study.caps
        free = caps.jerk is None and caps.acceleration is None and caps.speed is None
        if free and self.study.minimise[0].keys() == {"peak-force"}:
            try:
                least = self.least_force
            except StudyError:  # it gives no bound here, which is said beside the result
                return
            if not least.attained:
                raise StudyError(
                    f"there is no optimal motion: {least.sentence}; cap the jerk, or choose a "
                    f"duration below {least.motion.duration:.3g} s",
                    ExitCode.INFEASIBLE,
                )

    def _from_all_starts(self, with_forces: bool) -> Outcome:
        attempts: list[Attempt] = []
        recipes = starts(self.study, lambda: self.least_force)
        named = list(zip(self.study.solver.starts, recipes, strict=True))
        if not with_forces:  # the phase plane of the force says nothing here
            named = [item for item in named if item[0] != "phase-plane"] or named
        for place, (name, recipe) in enumerate(named, start=1):
            label = f"start {place} of {len(named)} ({name})"
            attempt = self._attempt(name, recipe, with_forces, label)
            if attempt is None:
                break
            attempts.append(attempt)
            self.console.progress(f"{label}: {_result_of(attempt, self.study)}")
            met = attempt.failure is None and self._bound_met(attempt.value)
            if met or self.interrupted:
                break
        return self._outcome(attempts)

    def _attempt(
        self, name: str, recipe: Callable[[], Start], with_forces: bool, label: str
    ) -> Attempt | None:
        """One start; None if the user interrupted it."""
        begin = clock.monotonic()
        statement = None
        try:
            statement = state(self.study, recipe(), self._weights(), with_forces)
            solution = self._solve(statement, 0, (), None, label)
        except (Interrupted, KeyboardInterrupt) as stop:
            self.interrupted = True
            rescued = self._rescued(statement, stop)
            if rescued is None or statement is None:
                return None
            solution = rescued
        except Unverified as error:
            return self._unverified(name, clock.monotonic() - begin, statement, error)
        except (OcpError, StudyError) as error:
            return Attempt(name, None, clock.monotonic() - begin, failure=str(error))
        value = solution.value(statement.stages[0], replayed=True)
        return Attempt(name, value, clock.monotonic() - begin, statement, solution)

    def _unverified(
        self, name: str, seconds: float, statement: Statement | None, error: Unverified
    ) -> Attempt:
        """An answer that failed its verification: kept, but second to every other."""
        found = error.iterate
        if statement is None or not isinstance(found, Solution):
            return Attempt(name, None, seconds, failure=str(error))
        value = found.value(statement.stages[0], replayed=True)
        return Attempt(
            name, value, seconds, statement, found, "; ".join(found.verification.reasons)
        )

    def _rescued(self, statement: Statement | None, stop: BaseException) -> Solution | None:
        """What a stopped solve had reached, solved on its own mesh once more to be verified."""
        reached = getattr(stop, "verified", None) or getattr(stop, "finished", None)
        if statement is None or reached is None:
            return None
        self.console.progress("interrupted: finishing the best mesh round; Ctrl-C again to drop it")
        mesh = Mesh(tuple(_mesh_of(phase) for phase in reached.phases))
        problem = statement.problem(0, (), self._smoothing(0))
        try:
            return solve(
                problem, settings=Settings(refinement=FixedMesh()), guess=reached, mesh=mesh
            )
        except (OcpError, KeyboardInterrupt):
            return None

    def _weights(self) -> dict[str, float]:
        """References by which to divide; a single objective keeps its own unit."""
        single = all(len(stage) == 1 for stage in self.study.minimise)
        return dict.fromkeys(OBJECTIVES, 1.0) if single else self.references

    def _solve(
        self, statement: Statement, stage: int, held: Sequence[Bound], guess: Any, label: str
    ) -> Solution:
        phases = len(statement.phases)
        settings = Settings(
            intervals=max(2, -(-self.study.solver.intervals // phases)),
            # moved to the switches of the jerk; where forces matter, bisection is more robust
            refinement=AdaptiveMesh(
                move_breakpoints=phases == 1 and control_shape(self.study) == "constant"
            ),
        )
        problem = statement.problem(stage, held, self._smoothing(stage))
        with noted_interrupts() as interrupts:
            solution = solve(
                problem,
                settings=settings,
                guess=guess,
                progress=lambda line: self.console.live(f"{label}: {line}"),
            )
        self.interrupted = self.interrupted or interrupts.asked  # too late to stop this one
        return solution

    def _smoothing(self, stage: int) -> float:
        """Weight of the roughness beside a stage: only peaks leave the law free elsewhere."""
        terms = self.study.minimise[stage]
        peaks = all(OBJECTIVES[name].kind == "peak" for name in terms)
        if not self.study.smooth or not peaks or set(terms) == {"peak-acceleration"}:
            return 0.0
        references, weights = self.references, self._weights()
        return SMOOTHING * sum(w * references[n] / weights[n] for n, w in terms.items())

    def _outcome(self, attempts: Sequence[Attempt]) -> Outcome:
        answered = [attempt for attempt in attempts if attempt.solution is not None]
        if not answered:
            raise self._nothing_found(attempts)
        verified = [attempt for attempt in answered if attempt.failure is None]
        solved = verified or answered
        best = min(solved, key=lambda attempt: attempt.value or 0.0)
        assert best.statement is not None
        assert best.solution is not None
        found = basins(self.study, solved)
        assert best.value is not None
        if self._bound_met(best.value):
            verdict = global_verdict(self.study, best.value, self._bound(), found[0])
        else:
            verdict = local_verdict(
                self.study, best.value, self._bound(), found, len(attempts), self.interrupted
            )
        if not verified:
            verdict = f"unverified: {best.failure}"
        solution = best.solution
        if verified and not self.interrupted:
            solution = self._later_stages(best.statement, solution)
        law = law_of(self.study, best.statement, solution)
        return Outcome(
            deployment=Deployment("optimal", law, self.study.truss),
            solution=solution,
            attempts=tuple(attempts),
            basins=found,
            bounds=self.bounds,
            verdict=verdict,
            remarks=tuple(self.remarks),
            interrupted=self.interrupted,
        )

    def _nothing_found(self, attempts: Sequence[Attempt]) -> StudyError:
        if self.interrupted:
            return StudyError(
                "interrupted before a motion was found; the inputs are kept", ExitCode.INTERRUPTED
            )
        cap, least = self.study.caps.force, self._least_force_found()
        if cap is not None and least is not None and least > cap:
            return StudyError(
                f"no motion was found with at most {cap:g} N on each rope; the least peak found "
                f"under the other caps is {least:.6g} N (local: from one start), raise the cap to "
                "that or loosen another one",
                ExitCode.INFEASIBLE,
            )
        failures = "; ".join(f"from {a.start}: {a.failure}" for a in attempts[:1])
        return StudyError(
            f"no motion was found from {len(attempts)} starts; {failures}", ExitCode.NOT_SOLVED
        )

    def _least_force_found(self) -> float | None:
        """Least peak force without its cap, from one start [N]; None if there is no such cap."""
        if self.study.caps.force is None:
            return None
        self.console.progress("no motion meets the force cap: looking for the least peak instead")
        relaxed = replace(
            self.study,
            minimise=({"peak-force": 1.0},),
            caps=replace(self.study.caps, force=None),
            solver=replace(self.study.solver, starts=("bezier",)),
        )
        try:
            return Search(relaxed, self.console).run().deployment.values["peak-force"]
        except (StudyError, KeyboardInterrupt):
            return None

    def _later_stages(self, statement: Statement, solution: Solution) -> Solution:
        """Later objectives, each with the earlier ones held; never a loss."""
        held: list[Bound] = []
        for stage in range(1, len(statement.stages)):
            reached = solution.value(statement.stages[stage - 1], replayed=True)
            limit = reached + self.study.concession * abs(reached)
            held.append(Bound(f"objective {stage}", statement.stages[stage - 1], upper=limit))
            label = f"objective {stage + 1}"
            try:
                solution = self._solve(statement, stage, held, solution, label)
            except (Interrupted, KeyboardInterrupt):
                self.interrupted = True
                break
            except SolveFailed as error:
                self.remarks.append(f"The stage '{label}' failed and was left out: {error}")
                break
            self.console.progress(f"{label}: done")
            if self.interrupted:
                break
        return solution

    def _bound(self) -> float | None:
        """A proven bound of the first objective."""
        first = self.study.minimise[0]
        return self.bounds.get(next(iter(first))) if len(first) == 1 else None

    def _bound_met(self, value: float | None) -> bool:
        bound = self._bound()
        return value is not None and bound is not None and value <= bound * (1 + BOUND_MET)


def _mesh_of(phase: PhaseTrajectory) -> PhaseMesh:
    """The mesh on which a trajectory was found."""
    fractions = (phase.breakpoints - phase.start) / (phase.end - phase.start)
    fractions[0], fractions[-1] = 0.0, 1.0
    return PhaseMesh(fractions, phase.degrees)


def _result_of(attempt: Attempt, study: TrussStudy) -> str:
    if attempt.solution is None:
        return f"failed, {attempt.failure}"
    if attempt.failure is not None:
        return f"unverified, {attempt.failure}"
    first = study.minimise[0]
    name, unit = (
        (next(iter(first)), OBJECTIVES[next(iter(first))].unit)
        if len(first) == 1
        else ("weighted sum", "1")
    )
    return (
        f"{name} {number(attempt.value, 7)} {unit}, {attempt.solution.iterations} iterations, "
        f"{attempt.seconds:.1f} s"
    )
