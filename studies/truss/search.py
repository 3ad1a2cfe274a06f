"""Solves the truss's problem from several starts and says what was found, and how sure that is."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from models.truss import static_peak
from ocp import (
    AdaptiveMesh,
    Audit,
    Interrupted,
    OcpError,
    Optimum,
    Problem,
    Settings,
    Solution,
    Trial,
    audit,
    solve_lexicographic,
)
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
    trials : all starts, those that failed among them.
    basins : optima found, best first.
    bounds : lower bounds by quantity.
    verdict : how sure the result is.
    remarks : sentences that belong beside it.
    interrupted : whether the user stopped the search.
    """

    deployment: Deployment
    solution: Solution
    trials: tuple[Trial, ...]
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
        self._with_forces = needs_forces(study)
        self._started = 0  # starts that are done
        self._statements: dict[Problem, Statement] = {}

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

        self._with_forces, self._started, self._statements = with_forces, 0, {}
        try:
            found = audit(
                starts={name: functools.partial(self._stated, name) for name in names},
                settings=self._settings(),
                bound=self._bound_now,
                bound_gap=BOUND_MET,
                value=self._value,
                same=SAME_BASIN,
                failures=(StudyError,),
                progress=self.console.live,
                finished=lambda trial: self._say(trial, len(names)),
            )
        except Interrupted as stop:
            raise StudyError(
                "interrupted before a motion was found; the inputs are kept", ExitCode.INTERRUPTED
            ) from stop
        except (OcpError, StudyError) as error:
            raise self._nothing_found(names, error) from error
        self.interrupted = self.interrupted or found.interrupted
        return self._best_of(found)

    def _stated(self, name: str) -> Problem:
        """The problem as it is stated for one start, with its guess."""
        start = starting_motion(name, self.study, lambda: self.least_force)
        statement = state(self.study, start, self._weights(), self._with_forces)
        problem = statement.problem(0, (), self._smoothing(0))
        self._statements[problem] = statement
        return problem

    def _value(self, problem: Problem, solution: Solution) -> float:
        """The first objective of the replay, as it is reported: without the price of roughness."""
        return solution.value(self._statements[problem].stages[0], replayed=True)

    def _say(self, trial: Trial, count: int) -> None:
        """One line of progress for a start that is done."""
        self._started += 1
        label = f"start {self._started} of {count} ({trial.name})"
        self.console.progress(f"{label}: {_result_of(trial, self.study)}")

    def _settings(self) -> Settings:
        """How the engine solves: the stated intervals, shared out over the phases."""
        phases = 2 if self._with_forces else 1
        # moved to the switches of the jerk; where forces matter, bisection is more robust
        moving = phases == 1 and control_shape(self.study) == "constant"
        return Settings(
            intervals=max(2, -(-self.study.solver.intervals // phases)),
            refinement=AdaptiveMesh(move_breakpoints=moving),
        )

    def _weights(self) -> dict[str, float]:
        """References by which to divide; a single objective keeps its own unit."""
        single = all(len(stage) == 1 for stage in self.study.minimise)
        return dict.fromkeys(OBJECTIVES, 1.0) if single else self.references

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

    def _best_of(self, found: Audit) -> BestMotion:
        """The best of an audit, its later stages, and the verdict."""
        optimum = found.optima[0]
        statement = self._statements[optimum.solution.problem]
        distinct = basins(self.study, found.optima)
        verified = optimum.solution.verification.passed
        if not verified:
            reasons = "; ".join(optimum.solution.verification.reasons)
            stopped = ", then interrupted" if self.interrupted else ""
            verdict = Verdict("unverified", f"unverified: {reasons}{stopped}")
        elif self._bound_met(optimum.value):
            verdict = _global_verdict(self.study, optimum.value, self._bound(), distinct[0])
        else:
            tried = len(found.trials)
            verdict = _local_verdict(
                self.study, optimum.value, self._bound(), distinct, tried, self.interrupted
            )

        solution = optimum.solution
        if verified and not self.interrupted:
            solution = self._later_stages(statement, solution)
        law = law_of(self.study, statement, solution)
        return BestMotion(
            deployment=Deployment("optimal", law, self.study.truss),
            solution=solution,
            trials=found.trials,
            basins=distinct,
            bounds=self.bounds,
            verdict=verdict,
            remarks=tuple(self.remarks),
            interrupted=self.interrupted,
        )

    def _later_stages(self, statement: Statement, solution: Solution) -> Solution:
        """Later objectives, each with the earlier ones held; never a loss."""
        count = len(statement.stages)
        if count == 1:
            return solution
        roughness = 0.0 if statement.roughness is None else statement.roughness
        found = solve_lexicographic(
            statement.problem(),
            statement.stages,
            slack=self.study.concession,
            first=solution,
            beside=[self._smoothing(stage) * roughness for stage in range(count)],
            settings=self._settings(),
            progress=self.console.live,
        )

        for place, level in enumerate(found.levels, start=1):
            label = f"objective {place}"
            if level.solution is not None and place > 1:
                self.console.progress(f"{label}: done")
            elif level.error is not None and not found.interrupted:
                self.remarks.append(f"The stage '{label}' failed and was left out: {level.error}")
        self.interrupted = self.interrupted or found.interrupted
        return found.solution

    def _nothing_found(self, names: Sequence[str], error: Exception) -> StudyError:
        """What to say where every start failed; the error is that of the first one."""
        cap, least = self.study.caps.force, self._least_force_found()
        if cap is not None and least is not None and least > cap:
            return StudyError(
                f"no motion was found with at most {cap:g} N on each rope; the least peak found "
                f"under the other caps is {least:.6g} N (local: from one start), raise the cap to "
                "that or loosen another one",
                ExitCode.INFEASIBLE,
            )
        return StudyError(
            f"no motion was found from {len(names)} starts; from {names[0]}: {error}",
            ExitCode.NOT_SOLVED,
        )

    def _least_force_found(self) -> float | None:
        """Least peak force without its cap, from one start [N]; None if there is no such cap.

        A search of its own: `ocp.relaxed` answers at once, but on a fixed mesh it is 0.2 to 1.5 %
        off, and on an adapting one it takes far longer than this.
        """
        if self.study.caps.force is None:
            return None
        self.console.progress("no motion meets the force cap: looking for the least peak instead")
        uncapped = replace(
            self.study,
            minimise="peak-force",
            caps=replace(self.study.caps, force=None),
            solver=replace(self.study.solver, starts=("bezier",)),
        )
        try:
            search = Search(uncapped, self.console)
            search.check()
            return search.run().deployment.values["peak-force"]
        except (StudyError, KeyboardInterrupt):
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

    def _bound_met(self, value: float) -> bool:
        bound = self._bound()
        return bound is not None and value <= bound * (1 + BOUND_MET)


def _result_of(trial: Trial, study: TrussStudy) -> str:
    """One line of progress for a start that is done."""
    if trial.solution is None:
        return f"failed, {trial.error}"
    if trial.error is not None:
        return f"unverified, {'; '.join(trial.solution.verification.reasons)}"

    first = list(study.minimise[0])
    name, unit = (first[0], OBJECTIVES[first[0]].unit) if len(first) == 1 else ("weighted sum", "1")
    return (
        f"{name} {number(trial.value, 7)} {unit}, {trial.solution.iterations} iterations, "
        f"{trial.seconds:.1f} s"
    )


def basins(study: TrussStudy, optima: Sequence[Optimum]) -> tuple[Basin, ...]:
    """The distinct optima that the starts found, best first."""
    return tuple(
        Basin(optimum.value, optimum.starts, _kind(study, optimum.value)) for optimum in optima
    )


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
