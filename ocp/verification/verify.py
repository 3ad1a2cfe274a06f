"""The verdict on a solved round: what its replay and its values between the points say."""

from __future__ import annotations

import numpy as np

from ocp.mesh.evaluation import Evaluator
from ocp.mesh.initial_guess import evaluate_limit
from ocp.mesh.trajectory import Trajectory
from ocp.problem.terms import Functional
from ocp.refinement.between import dense_peak
from ocp.refinement.error_estimate import Assessment, assess
from ocp.settings import Settings
from ocp.solution.solution import Verification
from ocp.transcription.transcribe import Transcription
from ocp.verification.bernstein_bounds import Margin, rigorous_excess
from ocp.verification.simulation import Replay

_SLACK = 10.0  # a replay may exceed what the solve was held to by this factor


def verify(
    settings: Settings, transcription: Transcription, trajectory: Trajectory, done: Replay,
    again: Trajectory, evaluator: Evaluator, objective: float,
) -> Verification:  # fmt: skip
    """Check a trajectory and its replay against everything that the problem states."""
    problem = transcription.problem
    own, found = (
        assess(transcription, t, evaluator, settings.path_tolerance) for t in (trajectory, again)
    )
    peaks = {f: dense_peak(evaluator, again, f) for f in transcription.peak_ids}
    replayed = problem.sense * evaluator.number(again, problem.objective, peaks)
    size = max(abs(objective), 1e-3 * transcription.scales.objective)
    margins = _margins(transcription, trajectory, evaluator, own)
    reasons = [
        _over(done.miss, settings.replay_tolerance,
              "the replay misses the end state by {} of its size"),
        _over(found.excess, _SLACK * settings.path_tolerance,
              "a path constraint or peak of the replay is exceeded by {} of its size"),
        _over(own.dynamics, _SLACK * settings.dynamics_tolerance,
              "the dynamics, an integral or an equation is off by {} between the points"),
        _over(abs(replayed - objective) / size, _SLACK * settings.replay_tolerance,
              "the objective of the replay differs from the solver's by {} of its size"),
        *[_over(m.rigorous or 0.0, _SLACK * settings.path_tolerance,
                f"by its bound '{m.name}' in phase '{m.phase}' may be exceeded by {{}} of its size")
          for m in margins],
        *_terminal(settings, transcription, again, evaluator, peaks),
    ]  # fmt: skip
    given = tuple(reason for reason in reasons if reason)
    listed = tuple(
        (f.name, value, peaks[f])
        for f, value in zip(transcription.peak_ids, trajectory.peaks, strict=True)
    )
    return Verification(
        done.miss, found.excess, listed, objective, replayed,
        max(p.error for p in done.phases), not given, given, margins=margins,
        amplification=done.amplification, restarts=done.restarts,
    )  # fmt: skip


def _margins(
    transcription: Transcription, trajectory: Trajectory, evaluator: Evaluator, found: Assessment
) -> tuple[Margin, ...]:
    """Dense and rigorous excess of all continuous constraints but equations."""
    peaks = dict(zip(transcription.peak_ids, trajectory.peaks, strict=True))
    margins = []
    for layout, assessed, constraints in zip(
        transcription.layouts, found.phases, transcription.constraints, strict=True
    ):
        phase = layout.phase.name
        for dense, c in zip(assessed.excess, constraints, strict=True):
            if not c.is_equation:
                bound = rigorous_excess(evaluator, trajectory, phase, c, peaks)
                margins.append(Margin(phase, c.name, float(dense.values.max()), bound))
    return tuple(margins)


def unverified(objective: float) -> Verification:
    """What stands where no verification was asked for."""
    nan = float("nan")
    return Verification(nan, nan, (), objective, nan, nan, False, ("verify=False",))


def _over(value: float, allowed: float, words: str) -> str:
    """Why a value does not pass, or nothing."""
    if value <= allowed:
        return ""
    return words.format(f"{value:.2e}") + f" (tolerance {allowed:.0e})"


def _terminal(
    settings: Settings, transcription: Transcription, again: Trajectory, evaluator: Evaluator,
    peaks: dict[Functional, float],
) -> list[str]:  # fmt: skip
    """Bounds and links of the problem that the replay does not meet."""
    reasons, problem = [], transcription.problem
    for bound in (*problem.bounds, *problem.links):
        value = evaluator.number(again, bound.expression, peaks)
        lower, upper = (evaluate_limit(v, again.constants) for v in (bound.lower, bound.upper))
        size = max(
            abs(value), *[abs(v) for v in (lower, upper) if np.isfinite(v)],
            transcription.scales.bounds["", bound.name],
        )  # fmt: skip
        excess = max(value - upper, lower - value) / size
        reasons.append(_over(excess, _SLACK * settings.replay_tolerance,
                             f"'{bound.name}' is exceeded by {{}} of its size"))  # fmt: skip
    return reasons
