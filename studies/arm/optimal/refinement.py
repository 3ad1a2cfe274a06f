"""Refine a motion until the full model rests, and until less smoothness gains nothing more.

Each round solves on B21 and replays on the full model. Three things are refined: where B21 is aimed
(see `aim`), the weight of the smoothness, and the mesh. The engine's own refinement watches the
equations of motion; what counts here is the energy that the lock finds, a small difference of
large ones, so that the replays decide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.arm.optimal.aim import beside_rest
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.optimal.phase import is_slow
from studies.arm.optimal.solve import solve_stage
from studies.arm.replay.full_model import LockedMotion
from studies.arm.search_limits import HOPELESS, LIGHTER, ROUNDS
from studies.arm.stage import TorqueCaps
from studies.common.exit_codes import StudyError

Progress = Callable[[str], None]
SAME = 0.01  # relative change of the objective that counts as none
AGREE = 0.1  # share of the residual allowed by which two replays may differ
FLOOR = 1e-9  # [J] below which all replays count as still


@dataclass(frozen=True)
class Round:
    """What one solve leaves.

    Attributes
    ----------
    intervals : of the mesh.
    weight : of the smoothness.
    objective : in units of the rigid arm's.
    on_full_model : E_res [J] of the replay.
    """

    intervals: int
    weight: float
    objective: float
    on_full_model: float


@dataclass(frozen=True, eq=False)
class Refined:
    """A motion that was refined.

    Attributes
    ----------
    motion : OptimalMotion
    replay : on the full model, torque drive.
    rounds : all of them, in order.
    residual : that the motion may leave [J].
    change : of the objective by half the weight and half the interval, relative; nan if that
        failed, zero where nothing is weighed.
    """

    motion: OptimalMotion
    replay: LockedMotion
    rounds: tuple[Round, ...]
    residual: float
    change: float = 0.0

    @property
    def settled(self) -> bool:
        """Whether a finer motion is no better by more than `SAME`."""
        return abs(self.change) <= SAME

    @property
    def still(self) -> bool:
        """Whether the full model is left with no more than was allowed."""
        return self.replay.residual_energy <= self.residual

    @property
    def resolved(self) -> bool:
        """Whether the answer counts: still, and no better one beside it."""
        return self.still and self.settled


@dataclass(frozen=True, eq=False)
class _Tried:
    """A motion with its replay, and where the next one is to be aimed."""

    motion: OptimalMotion
    replay: LockedMotion
    aim: Array

    @property
    def intervals(self) -> int:
        return len(self.motion.trajectory.phases[0].breakpoints) - 1

    @property
    def left(self) -> float:
        return self.replay.residual_energy


_Again = Callable[[_Tried, float, int], _Tried | None]


def refine(
    motion: OptimalMotion,
    caps: TorqueCaps,
    *,
    objective: str = "smoothest",
    residual: float = RESIDUAL,
    say: Progress | None = None,
) -> Refined:
    """Refine a motion that was solved on one mesh.

    Parameters
    ----------
    motion : OptimalMotion
    caps : TorqueCaps
        Those that it was solved under.
    objective : str
    residual : float
        That the full model may be left with [J].
    say : callable, optional
        Receives a line a round.
    """
    rounds: list[Round] = []

    def tried(motion: OptimalMotion, aim: Array) -> _Tried:
        replayed = motion.replay()
        entry = _Tried(motion, replayed, aim - beside_rest(replayed))
        rounds.append(
            Round(
                entry.intervals,
                motion.weight,
                motion.objective,
                replayed.residual_energy,
            )
        )
        if say is not None:
            say(_sentence(rounds[-1], motion.stage.name))
        return entry

    def again(from_: _Tried, weight: float, intervals: int) -> _Tried | None:
        """Solve from a motion, aimed anew; None where the solver gives up."""
        # a slow stage hardly stirs its modes, and states their energy instead of rest
        aim = 0.0 * from_.aim if is_slow(from_.motion.stage) else from_.aim
        try:
            solved = solve_stage(
                from_.motion.stage,
                caps=caps,
                objective=objective,
                intervals=intervals,
                guess=from_.motion.trajectory,
                name=from_.motion.name,
                weight=weight,
                aim=aim,
            )
        except StudyError as error:
            if say is not None:
                say(f"this round was given up: {error}")
            return None
        return tried(solved, aim)

    best = tried(motion, np.zeros(2 * motion.stage.model.size))
    best = _aimed(best, residual, rounds, again)
    change = 0.0
    if motion.weight:
        best, change = _lighter(best, residual, rounds, again)
    return Refined(best.motion, best.replay, tuple(rounds), residual, change)


def _lighter(
    heavy: _Tried, residual: float, rounds: list[Round], again: _Again
) -> tuple[_Tried, float]:
    """The lightest smoothness whose motion leaves the full model still.

    Also what half the weight and half the interval change of the objective, nan if that fails.
    """
    lighter = heavy.motion.weight / LIGHTER
    while heavy.left <= residual and len(rounds) < ROUNDS:
        found = again(heavy, lighter, heavy.intervals)
        # an aim brings a factor of ten to a hundred, not more
        if found is not None and found.left <= HOPELESS * residual:
            found = _aimed(found, residual, rounds, again)
        if found is not None and found.left <= residual:
            heavy = found
            break
        lighter = float(np.sqrt(lighter * heavy.motion.weight))

    finer = again(heavy, 0.5 * heavy.motion.weight, 2 * heavy.intervals)
    if finer is None:
        return heavy, float("nan")
    change = finer.motion.objective / heavy.motion.objective - 1.0
    return (finer if finer.left <= residual else heavy), change


def _aimed(
    first: _Tried,
    residual: float,
    rounds: list[Round],
    again: _Again,
) -> _Tried:
    """The motion aimed anew while that brings the full model nearer to rest."""
    best = first
    while best.left > residual and len(rounds) < ROUNDS:
        found = again(best, best.motion.weight, best.intervals)
        if found is None or found.left > 0.5 * best.left:
            return best if found is None or found.left > best.left else found
        best = found
    return best


def _sentence(entry: Round, stage: str) -> str:
    weight = f", smoothness at {entry.weight:.2g}" if entry.weight else ""
    objective = f", {entry.objective:.5g} of the rigid arm's" if entry.weight else ""
    return (
        f"{stage}: {entry.intervals} intervals{weight}{objective}: the full model is left with "
        f"{entry.on_full_model:.2e} J"
    )
