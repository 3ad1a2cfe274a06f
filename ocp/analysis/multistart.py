"""Many starts: which optima a problem has, as far as they find out.

Every start is solved and verified on its own.  They run one after the other, or side by side in
processes of their own (`ocp.analysis.worker_processes`).
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from numbers import Integral
from typing import Any

import numpy as np

from ocp.algorithm import check_arguments
from ocp.analysis.optima import Optimum, Trial, distinct_optima, same_value
from ocp.analysis.worker_processes import (
    Guess,
    StartJob,
    leave_if_imported_again,
    solved_here,
    solved_side_by_side,
)
from ocp.errors import Interrupted, OcpError, StatementError
from ocp.keywords import checked_keywords
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh, uniform
from ocp.mesh.trajectory import Trajectory
from ocp.mesh.wavy_guess import wavy_guess
from ocp.nlp.interrupts import noted_interrupts
from ocp.problem.parameters import parameters_of
from ocp.problem.problem import Problem
from ocp.processors import processors
from ocp.progress import Progress, shown
from ocp.scaling.automatic import scales_of
from ocp.settings import Settings, first_intervals
from ocp.solution.solution import Solution
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import transcribe
from ocp.verdict import BOUND_MET, is_global, with_bound


def random_trajectory(
    problem: Problem, settings: Settings, random: np.random.Generator
) -> Trajectory:
    """A random start of a problem, on a uniform mesh: waves around its stated guess."""
    parameters = parameters_of(problem)
    stated = initial_guess(problem, parameters)
    scales = scales_of(problem, stated, parameters)
    guess = wavy_guess(problem, parameters, stated, scales.signals, scales.unknowns, random)

    # as a trajectory it can be sent to another process
    intervals = first_intervals(settings, problem)
    mesh = Mesh(tuple(uniform(count, settings.scheme.degree) for count in intervals))
    program = transcribe(problem, mesh, settings.scheme, settings.controls, scales)
    x = decision_vector(program, guess, program.limits(parameters), parameters.vector)
    return trajectory_of(program, np.nan_to_num(x), parameters)


Start = Problem | Solution | Trajectory
StartLike = Start | Callable[[], Start]


@dataclass(frozen=True, eq=False, repr=False)
class Audit:
    """What came of all starts.

    Attributes
    ----------
    problem : str
    trials : tuple of Trial
        In the order in which they were tried.
    optima : tuple of Optimum
        Distinct ones, the best one first.
    verdict : str
        "global: ...", "local: best of n starts ..." or "unverified: ...".
    interrupted : bool
        Whether the user stopped it, so that later starts are left out.
    """

    problem: str
    trials: tuple[Trial, ...]
    optima: tuple[Optimum, ...]
    verdict: str
    interrupted: bool = False

    @property
    def best(self) -> Solution:
        """The best solution found, with the verdict of the audit."""
        return replace(self.optima[0].solution, verdict=self.verdict)

    @property
    def failures(self) -> tuple[tuple[str, str], ...]:
        """Starts without a verified solution, and why."""
        return tuple((trial.name, trial.reason) for trial in self.trials if trial.error)

    def __repr__(self) -> str:
        lines = [f"{self.problem}: {self.verdict}", *(f"  {optimum!r}" for optimum in self.optima)]
        return "\n".join([*lines, *(f"  failed: {name}: {why}" for name, why in self.failures)])


@checked_keywords()
def audit(
    problem: Problem | None = None,
    *,
    starts: int | Mapping[str, StartLike] = 8,
    guesses: Sequence[Solution | Trajectory] = (),
    seed: int = 0,
    processes: int | None = None,
    settings: Settings | None = None,
    bound: float | Callable[[], float | None] | None = None,
    bound_gap: float = BOUND_MET,
    value: Callable[[Problem, Solution], float] | None = None,
    same: float | None = None,
    enough: Callable[[Sequence[Trial]], bool] | None = None,
    failures: tuple[type[Exception], ...] = (),
    seconds: float | None = None,
    known: Mapping[str, Trial | Callable[[], Trial | None]] | None = None,
    progress: Progress | bool | None = None,
    finished: Callable[[Trial], None] | None = None,
) -> Audit:
    """Solve from several starts and compare what they find.

    Parameters
    ----------
    problem : Problem, optional
        None if each start is a problem.
    starts : int or mapping of name to start
        A number: the stated guess, then `guesses`, and random ones around the stated guess and
        inside all bounds for the rest.  Or named starts: a solution or trajectory, a problem (the
        same statement with a guess of its own), or a function that gives one when its turn comes.
    guesses, seed : sequence of Solution or Trajectory, and int
        Starts of one's own and the seed of the random ones, if `starts` is a number.
    processes : int, optional
        At once.  By default one where a bound may end the audit early, else one a processor.  Where
        they are spawned (Windows, macOS), a script calls this below ``if __name__ == "__main__"``.
    settings, progress : optional
        As of `ocp.solve`; each line of progress names the start that it is about.
    bound : float or function, optional
        A proven bound of the optimum, as of `ocp.solve`.  The first verified value that meets it
        ends the audit.  A function is called after the first solved start; it may return None.
    bound_gap : float
        Relative gap within which the bound counts as met.
    value : function of problem and solution, optional
        What is compared, in the sense of the objective; by default the objective.
    same : float, optional
        Relative distance of two values within which they count as one optimum.  By default ten
        times the tolerance on the objective, and then the motions have to agree too.
    enough, finished : functions of a sequence of Trial and of Trial, optional
        Called after each start, `enough` with all trials until then: True leaves out the rest.
    failures : tuple of exception classes
        Further errors that count as the failure of a start, for functions that give one.
    seconds : float, optional
        Budget of all starts together [s].  Those for which nothing is left are left out.  One that
        is cut short gives the best mesh iteration that it finished, if that passes verification.
    known : mapping of name to Trial, optional
        What came of starts in an earlier run, or functions that give it when its turn comes.
        They are not solved again, but where a function gives None.

    Raises
    ------
    StatementError
        When the statement contradicts itself or there is no start.
    SolveFailed
        When every start failed; the error is that of the first one.
    Interrupted
        When the user stopped it before anything was found.
    """
    settings = settings or Settings()
    named = _named_starts(problem, settings, starts, guesses, seed)
    workers = min(processes or (1 if bound is not None else processors()), len(named))
    limit = _Bound(bound, bound_gap)
    until = math.inf if seconds is None else clock.perf_counter() + _positive("seconds", seconds)
    search = _Starts(
        problem, settings, value, limit.number, (OcpError, *failures), until, dict(known or {})
    )

    with shown(progress) as say, closing(search.trials(named, workers, say)) as running:
        aloud = say if workers > 1 else None
        trials, interrupted = _until_enough(running, len(named), limit, enough, finished, aloud)
    return _audit(problem, settings, trials, same, limit, interrupted)


def _until_enough(
    running: Iterator[tuple[Trial, bool]],
    count: int,
    limit: _Bound,
    enough: Callable[[Sequence[Trial]], bool] | None,
    finished: Callable[[Trial], None] | None,
    say: Progress | None,
) -> tuple[list[Trial], bool]:
    """The trials up to the one that ends the audit, and whether the user stopped it.

    Parameters
    ----------
    running : trials as they are done, each with whether the user has asked to stop.
    count : of all starts.
    """
    trials, interrupted = list[Trial](), False
    try:
        for trial, stopped in running:
            trials.append(trial)
            if say:
                say(f"{trial.name} done, {len(trials)} of {count} starts")
            if finished:
                finished(trial)

            interrupted = interrupted or stopped
            if interrupted:
                continue  # what was reached until then still comes
            if trial.error is None and limit.is_met(trial):
                break
            if enough and enough(trials):
                break
    except (KeyboardInterrupt, Interrupted):
        interrupted = True
    return trials, interrupted


def _positive(name: str, value: float) -> float:
    """A positive number of seconds."""
    if not (math.isfinite(value) and value > 0):
        raise StatementError(f"the budget '{name}' is {value!r}; give a positive number")
    return value


def _named_starts(
    problem: Problem | None,
    settings: Settings,
    starts: int | Mapping[str, StartLike],
    guesses: Sequence[Solution | Trajectory],
    seed: int,
) -> dict[str, StartLike]:
    """The starts by name, in their order."""
    if isinstance(starts, Mapping):
        named = dict(starts)
        if not named:
            raise StatementError("the audit has no starts; give at least one")
        return named
    count: Any = starts
    if not isinstance(count, Integral):
        raise StatementError(f"the starts of an audit are {starts!r}; give a whole number")
    if starts < 1:
        raise StatementError(f"the audit has {starts} starts; give at least 1")
    check_arguments(problem, settings, None, None)
    assert problem is not None

    named = {"stated guess": problem}
    named |= {f"guess {i}": guess for i, guess in enumerate(guesses, start=1)}
    for i in range(1, starts - len(named) + 1):
        random = np.random.default_rng([seed, i])
        named[f"random {i}"] = partial(random_trajectory, problem, settings, random)
    return named


class _Bound:
    """A proven bound, evaluated when it is first needed.

    Attributes
    ----------
    number : float or None
        The bound if it is known beforehand.
    """

    def __init__(self, bound: float | Callable[[], float | None] | None, allowed: float) -> None:
        self.number = None if callable(bound) else bound
        self._bound = bound
        self._allowed = allowed

    def on(self, verdict: str, trial: Trial) -> str:
        """A verdict on a trial, with what the bound says of its value, if it is known by now."""
        if self._bound is None or callable(self._bound):
            return verdict
        sense = trial.solved.problem.sense
        return with_bound(verdict, trial.value, self._bound, sense, self._allowed)

    def is_met(self, trial: Trial) -> bool:
        """Whether the value of a trial is as good as any can be."""
        if callable(self._bound):
            self._bound = self._bound()
        return is_global(self.on("", trial))


@dataclass(frozen=True, eq=False, repr=False)
class _Starts:
    """What all starts have in common.

    Attributes
    ----------
    failures : errors that end a start and nothing more.
    until : end of the budget on the clock, infinite without one [s].
    known : trials of an earlier run, by name.
    """

    problem: Problem | None
    settings: Settings
    value: Callable[[Problem, Solution], float] | None
    bound: float | None
    failures: tuple[type[Exception], ...]
    until: float
    known: Mapping[str, Trial | Callable[[], Trial | None]]

    def trials(
        self, named: Mapping[str, StartLike], workers: int, say: Progress | None
    ) -> Generator[tuple[Trial, bool]]:
        """Trials in the order of the starts, each with whether the user has asked to stop.

        When the user asks to stop, what has been reached by then comes still.
        """
        jobs = self._jobs(named)
        if workers == 1:
            for job in jobs:
                trial, stopped = (job, False) if isinstance(job, Trial) else solved_here(job, say)
                yield self._valued(trial), stopped
                if stopped:
                    return
            return

        leave_if_imported_again()
        with noted_interrupts() as interrupts:
            found = solved_side_by_side(jobs, workers, say, lambda: interrupts.asked)
            with closing(found):
                for trial in found:
                    yield self._valued(trial), interrupts.asked
            if interrupts.asked:  # while the last processes ended
                raise KeyboardInterrupt

    def _jobs(self, named: Mapping[str, StartLike]) -> Iterator[StartJob | Trial]:
        """What is to be solved, or has come of a start already, each when its turn comes."""
        for number, (name, start) in enumerate(named.items(), start=1):
            known = self.known.get(name)
            earlier = known() if callable(known) else known
            if earlier is not None:
                yield earlier
                continue
            try:
                problem, guess = self._resolved(name, start)
            except self.failures as failure:
                yield Trial(name, None, failure, math.nan, 0.0)
                continue
            left = self.until - clock.perf_counter()
            if left <= 0.0:
                return
            prefix = f"start {number} of {len(named)} ({name}): "
            yield StartJob(name, problem, guess, self.settings, self.bound, left, prefix)

    def _resolved(self, name: str, start: StartLike) -> tuple[Problem, Guess]:
        """The problem and guess of a start."""
        given = start() if callable(start) else start
        if isinstance(given, Problem):
            return given, None
        if not isinstance(given, (Solution, Trajectory)):
            raise StatementError(
                f"the start '{name}' is of type {type(given).__name__}; give a Problem, a Solution "
                "or a Trajectory, or a function that returns one"
            )
        if self.problem is None:
            raise StatementError(
                f"the start '{name}' is a guess without a problem; write audit(problem, starts=...)"
            )
        return self.problem, given

    def _valued(self, trial: Trial) -> Trial:
        """A trial with the value that is compared, unless it has one."""
        solution = trial.solution
        if solution is None or not math.isnan(trial.value):
            return trial
        if self.value is None:
            return replace(trial, value=solution.objective)
        return replace(trial, value=float(self.value(solution.problem, solution)))


def _audit(
    problem: Problem | None,
    settings: Settings,
    trials: Sequence[Trial],
    same: float | None,
    bound: _Bound,
    interrupted: bool,
) -> Audit:
    """Compare the verified trials; the unverified ones if there is no other."""
    answered = [trial for trial in trials if trial.solution is not None]
    verified = [trial for trial in answered if trial.error is None]
    name = _name(problem, answered)
    if not answered:
        if interrupted or not trials:
            raise Interrupted(f"the audit of '{name}' was stopped before it found a solution")
        assert trials[0].error is not None
        raise trials[0].error

    optima = distinct_optima(verified or answered, settings, same)
    if verified:
        best = min(verified, key=lambda trial: trial.rank)
        verdict = bound.on(_verdict(trials, verified, optima[0], settings, same), best)
    else:
        verdict = f"unverified: {'; '.join(optima[0].solution.verification.reasons)}"
    if interrupted:
        verdict += "; stopped by the user"
    return Audit(name, tuple(trials), optima, verdict, interrupted)


def _name(problem: Problem | None, answered: Sequence[Trial]) -> str:
    if problem is None and answered:
        problem = answered[0].solved.problem
    return problem.name if problem else "several starts"


def _verdict(
    trials: Sequence[Trial],
    verified: Sequence[Trial],
    best: Optimum,
    settings: Settings,
    same: float | None,
) -> str:
    """How many starts agree on the best value, ended elsewhere, or failed."""
    own = best.solution.verdict
    if is_global(own):
        return own
    first = min(verified, key=lambda trial: trial.rank)
    agreed = sum(same_value(trial, first, settings, same) for trial in verified)
    failed = len(trials) - len(verified)
    parts = [f"{agreed} agree"]
    parts += [f"{len(verified) - agreed} ended elsewhere"] if agreed < len(verified) else []
    parts += [f"{failed} failed"] if failed else []
    return f"local: best of {len(trials)} starts ({', '.join(parts)})"
