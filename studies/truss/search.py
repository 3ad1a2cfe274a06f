"""Solves the truss's problem from several starts and says what was found, and how sure that is."""

from __future__ import annotations

import functools
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from models.truss import static_peak
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
from studies.common.result import Verdict
from studies.truss.bounds import check_feasible, lower_bounds
from studies.truss.config import TrussStudy
from studies.truss.deployment import Deployment
from studies.truss.laws import law_of, paper_laws, starting_motion
from studies.truss.problem import Statement, control_shape, needs_forces, state
from studies.truss.quantities import OBJECTIVES

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.phase_plane import LeastForce, PhasePlane

BOUND_MET = 1e-4  # relative distance to a global bound that counts as meeting it
SMOOTHING = 3e-5  # of the Bezier law's value: what smoothness may cost a peak at most
SAME_BASIN = 1e-4  # relative: optima closer than this are one basin, solved to different meshes
FAST = 1e-3  # relative: a force peak this far below the static one is due to momentum


@dataclass(frozen=True, eq=False)
class Attempt:
    """One start and what came of it: a solution with its statement, or why there is none.

    An unverified solution has both.
    """

    start: str
    value: float | None
    seconds: float
    statement: Statement | None = None
    solution: Solution | None = None
    failure: str | None = None


@dataclass(frozen=True)
class Basin:
    """Starts that ended in the same optimum.

    Attributes
    ----------
    kind : of the force problem: "fast" (momentum carries the motion over the ridge of the static
        force), "slow" (on that ridge) or "inertial" (above it); else empty.
    """

    value: float
    starts: tuple[str, ...]
    kind: str = ""


@dataclass(frozen=True, eq=False)
class BestMotion:
    """The best motion found.

    Attributes
    ----------
    deployment : the optimal law on its truss.
    solution : of the last stage.
    attempts : all starts, those that failed among them.
    basins : optima found, best first.
    bounds : lower bounds by quantity.
    verdict : how sure the result is.
    remarks : sentences that belong beside it.
    interrupted : whether the user stopped the search.
    """

    deployment: Deployment
    solution: Solution
    attempts: tuple[Attempt, ...]
    basins: tuple[Basin, ...]
    bounds: Mapping[str, float]
    verdict: Verdict
    remarks: tuple[str, ...]
    interrupted: bool


class Search:
    """One study on its way to a result; holds what is computed once and used often."""

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

    def check(self) -> None:
        """Refuse caps that no motion meets, and optima that no motion attains.

        Raises
        ------
        StudyError
            With the nearest value that works.
        """
        check_feasible(self.study, lambda: self.least_force)

        caps = self.study.caps
        free = caps.jerk is None and caps.acceleration is None and caps.speed is None
        if not free or self.study.minimise[0].keys() != {"peak-force"}:
            return
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
            self.console.progress("the rope would have to push: again with forces in the problem")
            self.remarks.append("The rope's pull limits this motion (T1 >= 0 is active).")
            best = self._from_all_starts(True)
        return best

    def _from_all_starts(self, with_forces: bool) -> BestMotion:
        """The best of all starts, one after the other until one meets the bound."""
        names = list(self.study.solver.starts)
        if not with_forces:  # the phase plane of the force says nothing here
            names = [name for name in names if name != "phase-plane"] or names

        attempts: list[Attempt] = []
        for place, name in enumerate(names, start=1):
            label = f"start {place} of {len(names)} ({name})"
            attempt = self._attempt(name, with_forces, label)
            if attempt is None:
                break
            attempts.append(attempt)
            self.console.progress(f"{label}: {_result_of(attempt, self.study)}")
            met = attempt.failure is None and self._bound_met(attempt.value)
            if met or self.interrupted:
                break
        return self._best_of(attempts)

    def _attempt(self, name: str, with_forces: bool, label: str) -> Attempt | None:
        """One start; None if the user interrupted it and nothing is left of it."""
        begin = clock.monotonic()
        statement = None
        try:
            start = starting_motion(name, self.study, lambda: self.least_force)
            statement = state(self.study, start, self._weights(), with_forces)
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
        answer = error.iterate
        if statement is None or not isinstance(answer, Solution):
            return Attempt(name, None, seconds, failure=str(error))
        value = answer.value(statement.stages[0], replayed=True)
        reasons = "; ".join(answer.verification.reasons)
        return Attempt(name, value, seconds, statement, answer, reasons)

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
        # a Ctrl-C too late to stop this solve stops the next one
        self.interrupted = self.interrupted or interrupts.asked
        return solution

    def _smoothing(self, stage: int) -> float:
        """Weight of the roughness beside a stage: only peaks leave the law free elsewhere."""
        terms = self.study.minimise[stage]
        peaks = all(OBJECTIVES[name].kind == "peak" for name in terms)
        if not self.study.smooth or not peaks or set(terms) == {"peak-acceleration"}:
            return 0.0
        references, weights = self.references, self._weights()
        return SMOOTHING * sum(
            weight * references[name] / weights[name] for name, weight in terms.items()
        )

    def _best_of(self, attempts: Sequence[Attempt]) -> BestMotion:
        """The best attempt, its later stages, and the verdict."""
        answered = [attempt for attempt in attempts if attempt.solution is not None]
        if not answered:
            raise self._nothing_found(attempts)
        verified = [attempt for attempt in answered if attempt.failure is None]
        candidates = verified or answered
        best = min(candidates, key=lambda attempt: attempt.value or 0.0)
        assert best.statement is not None
        assert best.solution is not None
        assert best.value is not None

        found = basins(self.study, candidates)
        if not verified:
            verdict = Verdict("unverified", f"unverified: {best.failure}")
        elif self._bound_met(best.value):
            verdict = _global_verdict(self.study, best.value, self._bound(), found[0])
        else:
            verdict = _local_verdict(
                self.study, best.value, self._bound(), found, len(attempts), self.interrupted
            )

        solution = best.solution
        if verified and not self.interrupted:
            solution = self._later_stages(best.statement, solution)
        law = law_of(self.study, best.statement, solution)
        return BestMotion(
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
            search = Search(relaxed, self.console)
            search.check()
            return search.run().deployment.values["peak-force"]
        except (StudyError, KeyboardInterrupt):
            return None

    def _later_stages(self, statement: Statement, solution: Solution) -> Solution:
        """Later objectives, each with the earlier ones held; never a loss."""
        held: list[Bound] = []
        for stage in range(1, len(statement.stages)):
            # held at the replayed value, which is the one that is reported
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
    """One line of progress for a start that is done."""
    if attempt.solution is None:
        return f"failed, {attempt.failure}"
    if attempt.failure is not None:
        return f"unverified, {attempt.failure}"

    first = list(study.minimise[0])
    name, unit = (first[0], OBJECTIVES[first[0]].unit) if len(first) == 1 else ("weighted sum", "1")
    return (
        f"{name} {number(attempt.value, 7)} {unit}, {attempt.solution.iterations} iterations, "
        f"{attempt.seconds:.1f} s"
    )


def basins(study: TrussStudy, solved: Sequence[Attempt]) -> tuple[Basin, ...]:
    """The distinct optima that the starts found, best first."""
    distinct: list[Basin] = []
    for attempt in sorted(solved, key=lambda attempt: attempt.value or 0.0):
        value = attempt.value or 0.0
        last = distinct[-1] if distinct else None
        if last is not None and abs(value - last.value) <= SAME_BASIN * abs(last.value):
            distinct[-1] = replace(last, starts=(*last.starts, attempt.start))
        else:
            distinct.append(Basin(value, (attempt.start,), _kind(study, value)))
    return tuple(distinct)


def _global_verdict(study: TrussStudy, value: float, bound: float | None, basin: Basin) -> Verdict:
    """The verdict on a value that meets its bound."""
    assert bound is not None
    gap = f"gap {abs(value / bound - 1):.1e}"
    words = f"global: the bound {bound:.6g} is met ({gap}){_in_words(study, basin)}"
    return Verdict("global", words)


def _local_verdict(
    study: TrussStudy,
    value: float,
    bound: float | None,
    found: Sequence[Basin],
    tried: int,
    interrupted: bool,
) -> Verdict:
    """The verdict on the best of several starts."""
    kind = f"local: best of {tried} start{'s' * (tried > 1)}"
    if interrupted:
        kind += f" of {len(study.solver.starts)}, then interrupted"

    listed = "; ".join(
        f"{basin.value:.6g}{_in_words(study, basin)} from {', '.join(basin.starts)}"
        for basin in found
    )
    gap = f"; its bound leaves room for {100 * (1 - bound / value):.3g} % less" if bound else ""
    words = f"{kind}; {len(found)} basin{'s' * (len(found) > 1)} found: {listed}{gap}"
    return Verdict("local", words)


def _kind(study: TrussStudy, value: float) -> str:
    """Which basin of the force problem has this value."""
    if study.minimise[0].keys() != {"peak-force"}:
        return ""
    ratio = value / static_peak(study.truss).force
    if ratio < 1 - FAST:
        return "fast"
    return "slow" if ratio < 1 + FAST else "inertial"


def _in_words(study: TrussStudy, basin: Basin) -> str:
    """Which basin of the force problem this is."""
    if not basin.kind:
        return ""
    ridge = f"the static {static_peak(study.truss).force:.6g} N"
    words = {
        "fast": f"momentum carries it over {ridge}",
        "slow": ridge,
        "inertial": f"above {ridge}",
    }
    return f" ({basin.kind}: {words[basin.kind]})"
