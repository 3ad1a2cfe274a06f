"""Refine a sequence until both locks leave the full model still."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ocp import solve
from studies.arm.optimal.aim import beside_rest
from studies.arm.optimal.finished_solves import Solve
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.optimal.refinement import sentence
from studies.arm.optimal.rounds import SAME, Round, near, refined
from studies.arm.questions.sequence.replay import SequenceReplay, replay_sequence
from studies.arm.questions.sequence.solve import Aims, OptimalSequence, solved_from
from studies.arm.replay.full_model import steps_for
from studies.arm.search_limits import ITERATIONS, LIGHTER
from studies.common.exit_codes import StudyError

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class RefinedSequence:
    """A sequence that was refined.

    Attributes
    ----------
    solved : OptimalSequence
    replay : on the full model.
    rounds : all of them, in order.
    residual : that each lock may leave [J].
    change : of the objective by the last halving of weight and interval, relative; nan if that
        failed.
    late : whether the time of the search ended before it did.
    """

    solved: OptimalSequence
    replay: SequenceReplay
    rounds: tuple[Round, ...]
    residual: float
    change: float
    late: bool = False

    @property
    def still(self) -> bool:
        """Whether both locks leave no more than was allowed."""
        return self.replay.left <= self.residual

    @property
    def settled(self) -> bool:
        """Whether a finer sequence is no better by more than `SAME`."""
        return abs(self.change) <= SAME


@dataclass(frozen=True, eq=False)
class _TriedSequence:
    """A sequence with its replay, and where the next one is to be aimed."""

    solved: OptimalSequence
    replay: SequenceReplay
    aims: Aims

    @property
    def entry(self) -> Round:
        solved = self.solved
        replay = self.replay
        return Round(
            sum(solved.intervals),
            solved.weight,
            solved.objective,
            replay.left,
            max(replay.root_miss, replay.elbow_miss),
        )


def refine_sequence(
    solved: OptimalSequence,
    *,
    residual: float = RESIDUAL,
    say: Progress | None = None,
    live: Progress | None = None,
    solver: Solve = solve,
    until: float = math.inf,
) -> RefinedSequence:
    """Refine a sequence as a motion is refined, see `studies.arm.optimal.refinement`.

    Parameters
    ----------
    solved : OptimalSequence
        On one mesh.
    residual : float
        That each lock may leave [J].
    say, live : callable, optional
        Receive a line a round, and a line now and then.
    solver : callable
        In the place of `ocp.solve`, see `finished_solves`.
    until : float
        Time of the clock `time.monotonic` from which on no round is begun [s].
    """
    case = solved.case
    stages = case.first, case.second
    none = np.zeros(2 * case.first.model.size), np.zeros(2 * case.second.model.size)

    def tried(solved: OptimalSequence, aims: Aims) -> _TriedSequence:
        if live is not None:
            live(f"replaying {sum(solved.intervals)} intervals on the full model")
        replayed = replay_sequence(solved.law, settings=steps_for(residual))
        missed = [
            beside_rest(stage, motion.run.before)
            for stage, motion in zip(stages, (replayed.first, replayed.second), strict=True)
        ]
        found = _TriedSequence(solved, replayed, (aims[0] - missed[0], aims[1] - missed[1]))
        if say is not None:
            say(sentence(found.entry, "sequence"))
        return found

    def again(from_: _TriedSequence, weight: float, finer: bool) -> _TriedSequence | None:
        big, dwell, small = from_.solved.intervals
        intervals = (2 * big, dwell, 2 * small) if finer else (big, dwell, small)
        # what swings as its mesh lets it says nothing of a finer mesh, as for one motion
        astray = finer and not near(from_, residual)
        aims = none if astray else from_.aims
        # multipliers help where only the aims are others, as for one motion
        alike = weight == from_.solved.weight and not finer
        start = from_.solved.solution if alike else from_.solved.trajectory
        if clock.monotonic() >= until:
            return None
        try:
            found = solved_from(
                solved.stated, weight, aims, intervals, start, live, ITERATIONS, solver
            )
        except StudyError as error:
            if say is not None:
                say(f"this round was given up: {error}")
            return None
        return tried(found, aims)

    (best, *_), rounds, change = refined(tried(solved, none), again, residual, LIGHTER[True])
    late = clock.monotonic() >= until
    return RefinedSequence(best.solved, best.replay, rounds, residual, change, late)
