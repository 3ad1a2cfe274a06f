"""A second, different solve of the same problem: what it reaches is held against the answer.

Most of what makes an answer wrong and keeps its multipliers consistent belongs to the way on which
it was found: intervals that share what they miss, breakpoints that were moved, limits that were
moved inwards, scales of a statement that says little, a point that is stationary and no minimum. So
nothing is taken over but the motion. All its intervals are cut elsewhere, the scales are those of
the motion, and the solver starts beside it, without multipliers.

It does not see a better motion that is far away.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array
from ocp.diagnostics.diagnostic import Evidence, Finding
from ocp.mesh.initial_guess import initial_guess
from ocp.mesh.mesh import Mesh, PhaseMesh, cut_in_two
from ocp.mesh.trajectory import Trajectory
from ocp.nlp.ipopt import Ipopt
from ocp.nlp.solver import NlpSolver, Outcome, StartingPoint
from ocp.optimality.iterate import LEAST_OF_A_SCALE, Iterate
from ocp.progress import Progress
from ocp.scaling.automatic import scales_of, variation_of_objective
from ocp.scaling.symbol_sizes import size_or_one
from ocp.transcription.packing import decision_vector, trajectory_of
from ocp.transcription.transcribe import Transcription, transcribe

SECOND_SOLVE = "a second solve"

# Where each interval is cut: by the golden section. Halves would have points where what oscillates
# in time takes the same values again.
_SHARE = (3.0 - math.sqrt(5.0)) / 2.0

# What is left of an error that is in proportion to the widths: a part of each error is the square
# of its interval's part.
_LEFT = _SHARE**2 + (1.0 - _SHARE) ** 2

# How far beside the answer the runs start, in scales of the unknowns: on both sides, as a motion
# may be left downhill on one alone.
_BESIDE = (1e-2, -1e-2)

# [s] that it may take after a solve that took less
_LEAST_SECONDS = 60.0

# What rows of the program may be off by if a run is cut short, relative to its largest unknown, and
# what it gains of the objective if that runs away: more than rows can change that are off so far
_FEASIBLE = 1e-6
_AWAY = 1e3

# Part of the tolerance on the objective by which a run may end above its least value
_ABOVE = 0.1


@dataclass(frozen=True, eq=False)
class _Run:
    """One run.

    Attributes
    ----------
    outcome : how it ended.
    value : the objective there [unit of the objective].
    motion : what it reached.
    feasible : whether that meets all rows of the program.
    """

    outcome: Outcome
    value: float
    motion: Trajectory
    feasible: bool

    @property
    def solved(self) -> bool:
        return self.outcome == "solved"


def confirm(
    answer: Evidence,
    *,
    iterations: int = 150,
    seconds: float | None = None,
    solver: NlpSolver | None = None,
    progress: Progress | None = None,
) -> Iterator[Finding]:
    """What a second solve reaches, from beside the answer and on all its intervals cut.

    A diagnostic of `certify`; ``functools.partial(confirm, seconds=10)`` is one with a budget.

    Parameters
    ----------
    answer : Evidence
    iterations : int
        Of each run, at most.
    seconds : float, optional
        Of all runs together [s]: a minute by default, or the time of the solve if that was more.
        What was not finished is told as open.
    solver : NlpSolver, optional
        IPOPT by default.
    progress : callable, optional
        Receives a line of text per iteration.

    Raises
    ------
    KeyboardInterrupt
        When the user stops a run.
    """
    if seconds is None:
        seconds = max(answer.solution.seconds, _LEAST_SECONDS)
    end = clock.perf_counter() + seconds
    iterate, say = answer.iterate, progress or (lambda text: None)
    program = _program(iterate)
    size = max(abs(iterate.objective), LEAST_OF_A_SCALE * program.scales.objective)
    gap = _ABOVE * answer.allowed.gain * size / program.scales.objective
    chosen = (solver or Ipopt()).within_gap(gap)

    # options that stray less where the solver's own come to no end, and from then on
    options = [chosen, *chosen.alternatives(warm=False)]
    runs: list[_Run] = []
    for distance in _BESIDE:
        while (left := end - clock.perf_counter()) > 0.0:
            say(f"{iterate.problem.name}: {SECOND_SOLVE}, run {len(runs) + 1}")
            runs.append(_run(iterate, program, options[0].within(iterations, left), distance, say))
            if len(options) == 1 or any(run.solved for run in runs):
                break
            del options[0]
    yield _finding(answer, runs, size)


def _run(
    iterate: Iterate,
    program: Transcription,
    solver: NlpSolver,
    distance: float,
    progress: Progress,
) -> _Run:
    """One run from so far beside a motion."""
    problem, parameters = iterate.problem, iterate.parameters
    limits = program.limits(parameters)
    guess = initial_guess(problem, parameters, iterate.trajectory)
    x = decision_vector(program, guess, limits, parameters.vector)
    direction = np.random.default_rng(0).normal(size=x.size)

    def listen(iteration: int, objective: float, x: Array, rows: Array) -> bool:
        progress(f"{problem.name}: {SECOND_SOLVE}, iteration {iteration}")
        return False

    start = StartingPoint(np.clip(x + distance * direction, *limits.columns))
    result = solver.solve(program.program, start, limits, parameters.vector, listen)
    if result.outcome == "interrupted":
        raise KeyboardInterrupt

    # what rows are off by, within the solver's tolerance, is no gain; before a run's end its
    # multipliers say nothing
    objective, values = program.program.oracle(result.x, parameters.vector)
    rows = np.asarray(values.full()).ravel()
    beyond = rows - np.clip(rows, *limits.rows)
    priced = float(result.row_multipliers @ beyond) if result.outcome == "solved" else 0.0
    value = problem.sense * (float(objective) + priced) * program.scales.objective
    motion = trajectory_of(program, result.x, parameters)
    largest = np.abs(result.x).max(initial=1.0)  # of what runs away, too
    feasible = bool(np.abs(beyond).max(initial=0.0) <= _FEASIBLE * largest)
    return _Run(result.outcome, value, motion, feasible)


def _program(iterate: Iterate) -> Transcription:
    """The program on all intervals cut, with nothing added to them, in the scales of the motion."""
    problem, motion = iterate.problem, iterate.trajectory
    cut = cut_in_two(iterate.fixed_mesh, _SHARE)
    mesh = Mesh(tuple(PhaseMesh(phase.breakpoints, phase.degrees) for phase in cut.phases))

    # limits and stated sizes may be far from what the motion has
    names = {signal.name for own in problem.signals.values() for signal in own}
    names |= {unknown.name for unknown in problem.unknowns}
    guess = initial_guess(problem, iterate.parameters, motion)
    scales = scales_of(problem, guess, iterate.parameters, names)
    moves, _ = size_or_one(variation_of_objective(problem, scales, iterate.parameters), "")
    scales = replace(scales, objective=moves)
    return transcribe(problem, mesh, iterate.scheme, iterate.controls, scales)


def _finding(answer: Evidence, runs: Sequence[_Run], size: float) -> Finding:
    """What the runs say together: the best of those that came to an end counts.

    Parameters
    ----------
    size : float
        What changes of the objective are relative to.
    """
    iterate, sense, tolerance = answer.iterate, answer.iterate.problem.sense, answer.allowed.gain

    def gain_of(run: _Run) -> float:
        return float(sense * (iterate.objective - run.value) / size)

    solved = [run for run in runs if run.solved]
    if not solved:
        away = any(run.feasible and gain_of(run) > _AWAY for run in runs)
        return _without_end(runs, tolerance, away=away)

    best = max(solved, key=gain_of)
    gain = gain_of(best) / (1.0 - _LEFT)
    reached = f"the best of {len(runs)} runs from perturbed starts reached {best.value:.10g}"
    if gain < -tolerance:
        sentence = (
            f"{reached}: they ended at worse motions, which neither confirms nor refutes this one"
        )
        return Finding(SECOND_SOLVE, math.nan, tolerance, sentence, open=True)
    sentence = (
        f"on a mesh that is twice as fine, {reached}; this is the relative error of the objective, "
        "if it decreases in proportion to the interval widths"
    )
    start = answer.solution.form.stated(best.motion) if gain > tolerance else None
    return Finding(SECOND_SOLVE, abs(gain), tolerance, sentence, start)


def _without_end(runs: Sequence[_Run], tolerance: float, *, away: bool) -> Finding:
    """What runs say of which none was solved; one may have left all sizes behind."""
    outcomes = {run.outcome for run in runs}
    if away or "unbounded" in outcomes:
        sentence = "from a perturbed start, the objective diverges"
        return Finding(SECOND_SOLVE, math.inf, tolerance, sentence)
    if outcomes == {"infeasible"}:
        sentence = (
            "on a mesh that is twice as fine, all runs from perturbed starts ended infeasible"
        )
        return Finding(SECOND_SOLVE, math.inf, tolerance, sentence)
    ends = ", ".join(sorted(outcomes)) or "no time was left"
    sentence = f"no run from a perturbed start converged ({ends})"
    return Finding(SECOND_SOLVE, math.nan, tolerance, sentence, open=True)
