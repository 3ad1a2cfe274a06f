"""The one verb: `solve` a problem, refine its mesh, verify the answer."""

from __future__ import annotations

import dataclasses
import itertools
import logging
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ocp.assess import Assessment, assess
from ocp.chains import first_degree
from ocp.diagnose import collapsed, failure
from ocp.errors import Interrupted, SolveFailed, StatementError, Unverified
from ocp.evaluate import Evaluator
from ocp.fatrop import run_fatrop
from ocp.guess import start_of
from ocp.ipopt import IpoptOptions, NlpResult, run
from ocp.iterate import decision_vector, trajectory_of
from ocp.mesh import Mesh, bisected, uniform
from ocp.multipliers import multipliers, solved_program
from ocp.refine import next_mesh
from ocp.replay import Replay, replay, replayed
from ocp.scaling import scales_of
from ocp.sense import check_sense
from ocp.settings import Settings
from ocp.solution import Round, Solution, Verification
from ocp.statement import Problem
from ocp.symbols import Constant
from ocp.trajectory import Trajectory
from ocp.transcribe import Method, Transcription, transcribe
from ocp.verify import verify

Array = NDArray[np.float64]
Progress = Callable[[str], None]
_STRICTER_GOES = 3
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Solved:
    """One solved mesh round."""

    transcription: Transcription
    result: NlpResult
    trajectory: Trajectory
    assessment: Assessment
    objective: float
    controls_refined: bool = False


def solve(
    problem: Problem,
    *,
    settings: Settings | None = None,
    guess: Solution | Trajectory | None = None,
    mesh: Mesh | None = None,
    constants: Mapping[Constant, float] | None = None,
    bound: float | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Solve an optimal control problem and verify the answer.

    Parameters
    ----------
    guess : Solution or Trajectory, optional
        Where to start instead of the guess in the statement; its mesh may differ.
    mesh : Mesh, optional
        First mesh; by default that of the guess if it is a `Solution`, else a uniform one.
    constants : mapping of Constant to number, optional
        Values that replace those of the statement.
    bound : float, optional
        A proven bound of the optimum: a lower one when minimising, an upper one when maximising.
    progress : callable, optional
        Receives one line of text per iteration.

    Raises
    ------
    StatementError
        The statement contradicts itself.
    SolveFailed
        No solution was found; the message names the worst constraint.
    Unverified
        The solver's answer did not pass its verification; ``error.iterate`` holds it.
    Interrupted
        The user stopped the solve.
    """
    settings = settings or Settings()
    begin = clock.perf_counter()
    values = _constants(problem, constants)
    check_sense(problem, values)
    start = guess.trajectory if isinstance(guess, Solution) else guess
    if mesh is None:
        mesh = guess.mesh if isinstance(guess, Solution) else _first_mesh(problem, settings)
    evaluator = Evaluator(problem)
    record: list[Round] = []
    strict, checking = settings, 0.0
    for _ in range(_STRICTER_GOES):
        rounds = _rounds(problem, strict, values, start, mesh, evaluator, progress, record)
        last = _best(rounds, strict)
        before = clock.perf_counter()
        done = replay(problem, last.trajectory, dict(last.transcription.scales.signals))
        again = replayed(last.trajectory, done)
        verification = verify(settings, last.transcription, last.trajectory, done, again,
                              evaluator, last.objective)  # fmt: skip
        checking += clock.perf_counter() - before
        if not settings.refine or done.miss <= settings.replay_tolerance:
            break
        # every interval meets its tolerance, yet their errors add up to a miss
        strict = dataclasses.replace(strict, dynamics_tolerance=strict.dynamics_tolerance / 30.0)
        mesh, start = last.transcription.mesh, last.trajectory
    verification = dataclasses.replace(verification, seconds=checking)
    return _finished(problem, settings, last, again, done, verification, record, evaluator, bound,
                     begin)  # fmt: skip


def collocate(
    problem: Problem, *, settings: Settings | None = None, guess: Trajectory | None = None,
    mesh: Mesh | None = None, progress: Progress | None = None,
) -> tuple[Trajectory, float]:  # fmt: skip
    """Solve on one mesh and return what IPOPT found, neither refined nor verified.

    For callers who replay the answer on models of their own; others want `solve`. Arguments and
    errors are those of `solve`.

    Returns
    -------
    The trajectory and the objective's value.
    """
    settings = settings or Settings()
    values = _constants(problem, None)
    scales = scales_of(problem, start_of(problem, values, guess), values)
    method = Method(settings.scheme, settings.control_shape)
    transcription = transcribe(problem, mesh or _first_mesh(problem, settings), method, scales)
    result = _run(transcription, settings, values, guess, (), progress)
    found = trajectory_of(transcription, result.x, values)
    if result.outcome == "interrupted":
        raise Interrupted(f"'{problem.name}' was stopped", found, None, None)
    if result.outcome != "solved":
        raise _diagnosed(transcription, result, values)
    return found, problem.sense * result.objective * scales.objective


def _constants(problem: Problem, changed: Mapping[Constant, float] | None) -> dict[str, float]:
    values = {c.name: float(c.value) for c in problem.constants}
    for constant, value in (changed or {}).items():
        if constant.name not in values:
            raise StatementError(
                f"problem '{problem.name}' does not use the constant '{constant.name}'"
            )
        values[constant.name] = float(value)
    return values


def _first_mesh(problem: Problem, settings: Settings) -> Mesh:
    return Mesh(tuple(
        uniform(settings.intervals, first_degree(problem, phase, settings))
        for phase in problem.phases
    ))  # fmt: skip


def _rounds(
    problem: Problem, settings: Settings, constants: dict[str, float],
    guess: Trajectory | None, mesh: Mesh, evaluator: Evaluator, progress: Progress | None,
    record: list[Round],
) -> list[_Solved]:  # fmt: skip
    """Solve, assess and refine until all tolerances are met or the rounds are used up."""
    scales = scales_of(problem, start_of(problem, constants, guess), constants)
    method = Method(settings.scheme, settings.control_shape)
    solved: list[_Solved] = []
    most = len(record) + settings.rounds
    finer = False
    try:
        while True:
            known = solved[-1].transcription if solved else None
            transcription = transcribe(problem, mesh, method, scales, known)
            result = _run(transcription, settings, constants, guess, record, progress)
            if result.outcome == "solved":
                solved.append(
                    _examined(
                        transcription, result, constants, evaluator, finer, settings.path_tolerance
                    )
                )
                record.append(_round(solved[-1]))
                log.info("round %d: %s", len(record), record[-1])
                following = _following(solved, settings) if settings.refine else None
            else:
                record.append(_failed_round(transcription, result))
                if result.outcome == "interrupted":
                    last = trajectory_of(transcription, result.x, constants)
                    raise _interrupted(problem, solved, settings, last)
                if not solved:
                    raise _diagnosed(transcription, result, constants)
                if not any(m.movable for m in mesh.phases):
                    break
                # moving breakpoints led astray: hold them still and bisect from the last round
                settings = dataclasses.replace(settings, move_breakpoints=False)
                following = _frozen(_next_or_same(solved[-1], settings))
            if following is None or len(record) >= most:
                break
            finer = following.intervals > mesh.intervals
            mesh, guess = following, solved[-1].trajectory
    except KeyboardInterrupt as stop:
        raise _interrupted(problem, solved, settings, None) from stop
    return solved


def _examined(
    transcription: Transcription, result: NlpResult, constants: dict[str, float],
    evaluator: Evaluator, finer: bool, tolerance: float,
) -> _Solved:  # fmt: skip
    """A solved round with its errors between the points."""
    trajectory = trajectory_of(transcription, result.x, constants)
    problem = transcription.problem
    objective = problem.sense * result.objective * transcription.scales.objective
    found = assess(
        transcription, trajectory, evaluator, tolerance, result.row_multipliers, objective
    )
    return _Solved(transcription, result, trajectory, found, objective, finer)


def _next_or_same(last: _Solved, settings: Settings) -> Mesh:
    """The next mesh of a solved round, or its own."""
    found = next_mesh(last.transcription, last.trajectory, last.assessment, settings, True)
    return found or last.transcription.mesh


def _following(solved: Sequence[_Solved], settings: Settings) -> Mesh | None:
    """The mesh of the next round, or None when the last round meets all tolerances."""
    last = solved[-1]
    settled = any(
        after.controls_refined and _change(before, after) <= settings.objective_tolerance
        for before, after in itertools.pairwise(solved)
    )
    following = next_mesh(
        last.transcription, last.trajectory, last.assessment, settings,
        resolve_controls=not settled,
    )  # fmt: skip
    if following is None and not settled and settings.scheme not in ("radau", "gauss"):
        # the multipliers of these schemes meet the minimum principle on any mesh: compare two
        return bisected(last.transcription.mesh, settings.most_intervals)
    return following


def _change(before: _Solved, after: _Solved) -> float:
    """Relative change of the objective from one round to another."""
    size = max(abs(after.objective), 1e-3 * after.transcription.scales.objective)
    return abs(after.objective - before.objective) / size


def _holds(solved: _Solved, settings: Settings) -> bool:
    """Whether a round's motion meets the dynamics and all constraints between its points."""
    found = solved.assessment
    return found.dynamics <= settings.dynamics_tolerance and found.excess <= settings.path_tolerance


def _best(solved: Sequence[_Solved], settings: Settings) -> _Solved:
    """The best round whose motion holds between the points; the last one if none does."""
    holds = [s for s in solved if _holds(s, settings)]
    return min(holds, key=lambda s: s.result.objective, default=solved[-1])


def _frozen(mesh: Mesh) -> Mesh:
    return Mesh(tuple(m.frozen() for m in mesh.phases), mesh.extra)


def _run(
    transcription: Transcription, settings: Settings, constants: Mapping[str, float],
    guess: Trajectory | None, record: Sequence[Round], progress: Progress | None,
) -> NlpResult:  # fmt: skip
    start = start_of(transcription.problem, constants, guess)
    x0 = decision_vector(transcription, start, constants)
    parameters = np.array([constants[c.name] for c in transcription.problem.constants])
    options = settings.ipopt
    listener = _listener(transcription, progress, len(record)) if progress else None

    limits = transcription.columns.evaluate(constants), transcription.rows.evaluate(constants)

    def attempt(with_options: IpoptOptions) -> NlpResult:
        return run(transcription.program, x0, *limits, parameters, with_options, listener=listener)

    if settings.solver == "fatrop":
        fast = run_fatrop(transcription, x0, *limits, parameters, options)
        if fast is not None:
            return fast
    first: Literal["monotone", "adaptive"] = "monotone" if record else options.barrier
    result = attempt(dataclasses.replace(options, barrier=first))
    if record and result.outcome not in ("solved", "interrupted"):
        result = attempt(options)
    return result


def _listener(transcription: Transcription, progress: Progress, number: int) -> Any:
    scale = transcription.scales.objective * transcription.problem.sense

    def listen(iteration: int, objective: float, x: Array, rows: Array) -> bool:
        progress(
            f"{transcription.problem.name}: mesh round {number + 1} "
            f"({transcription.mesh.intervals} intervals), iteration {iteration}, "
            f"objective {objective * scale:.6g}"
        )
        return False

    return listen


def _interrupted(
    problem: Problem, solved: Sequence[_Solved], settings: Settings, last: Trajectory | None
) -> Interrupted:
    """The error of a stopped solve, with the last iterate and the best round that holds."""
    best = _best(solved, settings) if solved else None
    finished = best.trajectory if best is not None else None
    verified = finished if best is not None and _holds(best, settings) else None
    kept = "the best round so far is kept" if verified else "no round had met its tolerances"
    return Interrupted(
        f"'{problem.name}' was stopped in mesh round {len(solved) + 1}; {kept}",
        last, finished, verified,
    )  # fmt: skip


def _diagnosed(
    transcription: Transcription, result: NlpResult, constants: Mapping[str, float]
) -> SolveFailed:
    iterate = trajectory_of(transcription, result.x, constants)
    return failure(transcription, result, transcription.rows.evaluate(constants), iterate)


def _round(solved: _Solved) -> Round:
    mesh = solved.transcription.mesh
    return Round(
        mesh.intervals, sum(e.tau.size for extra in mesh.extra for e in extra),
        sum(len(m.movable) for m in mesh.phases), solved.result.iterations,
        solved.result.seconds, solved.objective, solved.assessment.dynamics,
        solved.assessment.excess, solved.assessment.gain, solved.result.status,
        solved.result.solver,
    )  # fmt: skip


def _failed_round(transcription: Transcription, result: NlpResult) -> Round:
    mesh = transcription.mesh
    return Round(
        mesh.intervals, sum(e.tau.size for extra in mesh.extra for e in extra),
        sum(len(m.movable) for m in mesh.phases), result.iterations, result.seconds,
        float("nan"), float("nan"), float("nan"), float("nan"), result.status,
    )  # fmt: skip


def _finished(
    problem: Problem, settings: Settings, last: _Solved, again: Trajectory, done: Replay,
    verification: Verification, record: Sequence[Round], evaluator: Evaluator,
    bound: float | None, begin: float,
) -> Solution:  # fmt: skip
    if error := collapsed(last.transcription, last.trajectory):
        raise error
    program = solved_program(last.transcription, last.result)
    solution = Solution(
        problem, last.objective, last.trajectory, again, done, verification,
        last.transcription.mesh, tuple(record), _verdict(last.objective, problem, bound, settings),
        evaluator, clock.perf_counter() - begin, multipliers(program, last.trajectory), program,
    )  # fmt: skip
    if not verification.passed and settings.refine:
        raise Unverified(
            f"the answer for '{problem.name}' did not pass its verification: "
            + "; ".join(verification.reasons) + "; loosen the tolerance named, allow more "
            "rounds or intervals, or look at the unverified answer in error.iterate",
            dataclasses.replace(solution, verdict="unverified"))  # fmt: skip
    return solution


def _verdict(objective: float, problem: Problem, bound: float | None, settings: Settings) -> str:
    if bound is not None:
        gap = abs(objective - bound) / max(abs(bound), 1e-300)
        if gap <= max(10 * settings.objective_tolerance, 1e-5):
            return f"global: bound met (gap {gap:.1e})"
    return "local: best of 1 start"
