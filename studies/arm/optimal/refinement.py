"""Refine a motion until the full model rests, and until less smoothness gains nothing more.

Each round solves on B21 and replays on the full model. Three things are refined: where B21 is aimed
(see `aim`), the weight of the smoothness, and the mesh. The engine's own refinement watches the
equations of motion; what counts here is the energy that the lock finds, a small difference of
large ones, so that the replays decide.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from models.ancf.integrate import StepControl
from ocp.arrays import Array
from studies.arm.optimal.aim import beside_rest
from studies.arm.optimal.correction import added_to, correction
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.optimal.phase import is_slow
from studies.arm.optimal.rounds import ASKED, SAME, Again, MotionTrial, Round, aimed, near, refined
from studies.arm.optimal.solve import solve_again
from studies.arm.optimal.study_solver import Say, StudySolver, unheard
from studies.arm.replay.full_model import Drive, LockedMotion, rough_steps_for, steps_for
from studies.arm.search_limits import CALMER_ROUNDS, CORRECTIONS, HOPELESS, LIGHTER
from studies.arm.stage import ELBOW
from studies.common.exit_codes import StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps

AGREE = 0.1  # share of the residual allowed by which two replays may differ
FLOOR = 1e-9  # [J] below which all replays count as still
# by which the smoothness is made heavier where a finer full model disagrees, at least and at most:
# about as much less is left on the full model
_HEAVIER = (2.0, 10.0)
ADDED = 0.005  # share of the peak torque that may be added, half of what counts as no change

_T = TypeVar("_T", bound=MotionTrial)


@dataclass(frozen=True, eq=False)
class Refined:
    """A motion that was refined.

    Attributes
    ----------
    motion : OptimalMotion
    replays : of its stages on the full model.
    rounds : all of them, in order.
    residual : that the motion may leave [J].
    change : of the objective by the last halving of weight and interval, relative; nan if that
        failed, zero where nothing is weighed.
    finer : replays on a finer full model, None where none was asked for.
    lost : part of the objective by which a lighter smoothness is better, whose residual no finer
        full model confirms; zero where the lightest one is taken.
    """

    motion: OptimalMotion
    replays: tuple[LockedMotion, ...]
    rounds: tuple[Round, ...]
    residual: float
    change: float = 0.0
    finer: tuple[LockedMotion, ...] | None = None
    lost: float = 0.0

    @property
    def replay(self) -> LockedMotion:
        """Of the last stage: that of a motion of one."""
        return self.replays[-1]

    @property
    def left(self) -> float:
        """The most that a lock leaves [J]."""
        return most_left(self.replays)

    @property
    def settled(self) -> bool:
        """Whether neither a finer nor a less smooth motion is better by more than `SAME`."""
        return abs(self.change) <= SAME and self.lost <= SAME

    @property
    def still(self) -> bool:
        """Whether the full model is left with no more than was allowed."""
        return self.left <= self.residual

    @property
    def disagreement(self) -> float:
        """By how much a finer full model is left with another energy [J]; nan without one."""
        if self.finer is None:
            return float("nan")
        pairs = zip(self.finer, self.replays, strict=True)
        return max(abs(finer.residual_energy - one.residual_energy) for finer, one in pairs)

    @property
    def confirmed(self) -> bool:
        """Whether it is still, and a finer full model, where one was asked, says the same."""
        agrees = self.finer is None or self.disagreement <= agreement(self.residual)
        return self.still and agrees

    @property
    def resolved(self) -> bool:
        """Whether the answer counts: still, and no better one beside it."""
        return self.still and self.settled


@dataclass(frozen=True, eq=False)
class _TriedMotion:
    """A motion with its replays, and where the next one is to be aimed."""

    motion: OptimalMotion
    replays: tuple[LockedMotion, ...]
    aim: Array

    @property
    def entry(self) -> Round:
        motion, missed = self.motion, max(one.miss for one in self.replays)
        left = most_left(self.replays)
        return Round(motion.intervals, motion.weight, motion.objective, left, missed)


def refine(
    motion: OptimalMotion,
    *,
    residual: float = RESIDUAL,
    drive: Drive = "torque",
    elements: int | None = None,
    solver: StudySolver | None = None,
) -> Refined:
    """Refine a motion that was solved on one mesh.

    Parameters
    ----------
    motion : OptimalMotion
    residual : float
        That the full model may be left with [J].
    drive : Drive
        Under which it is replayed.
    elements : int, optional
        Of a link in a finer full model. Of two motions that are as good, the one whose residual it
        confirms is taken.
    solver : StudySolver, optional
        Of the study; one that keeps nothing by default. Its `say` receives a line a round.
    """
    solver = solver or StudySolver()
    looked = _Rounds(residual, drive, solver, solver.say, solver.kept)
    first = looked.tried(motion, np.zeros(motion.stated.size))
    lighter = LIGHTER[ELBOW in motion.torques]
    answers, rounds, change = refined(first, looked.again, ASKED * residual, lighter)

    stated = functools.partial(looked.stated, change=change, elements=elements)
    found = confirmed((stated(answer.motion, rounds) for answer in answers), solver.say)
    if found.confirmed or elements is None or not found.settled:
        return found
    others = (
        replace(stated(tried.motion, all_rounds), lost=lost)
        for tried, all_rounds, lost in calmer(answers, rounds, residual, looked.again)
    )
    return next((other for other in others if other.confirmed), found)


def aimed_at_rest(
    motion: OptimalMotion,
    aim: Array,
    *,
    residual: float,
    solver: StudySolver | None = None,
) -> tuple[Refined, Array]:
    """A motion aimed anew until the full model rests, on its own mesh, with its own smoothness.

    For a neighbour of a motion that was refined, whose mesh and smoothness are as good for it. What
    another halving of them would change is not asked: `Refined.change` is nan.

    Parameters
    ----------
    motion : OptimalMotion
        Under torques.
    aim : (2 n,)
        Beside rest, with which it was solved.
    residual : float
        That the full model may be left with [J].
    solver : StudySolver, optional
        As of `refine`; nothing is said of the rounds, and their replays are not kept.

    Returns
    -------
    refined : with its replay.
    aim : (2 n,), where a neighbour's is best begun.
    """
    looked = _Rounds(residual, "torque", solver or StudySolver())
    first = looked.tried(motion, aim)
    rounds = [first.entry]

    def again(from_: _TriedMotion, weight: float, finer: bool) -> _TriedMotion | None:
        found = looked.again(from_, weight, finer)
        if found is not None:
            rounds.append(found.entry)
        return found

    best = aimed(first, ASKED * residual, rounds, again)
    return looked.stated(best.motion, tuple(rounds), float("nan")), best.aim


@dataclass(frozen=True, eq=False)
class _Rounds:
    """What all rounds of a motion share, see `refine`."""

    residual: float
    drive: Drive
    solver: StudySolver
    say: Say = unheard
    kept: FinishedSteps = NOTHING_KEPT

    def tried(self, motion: OptimalMotion, aim: Array) -> _TriedMotion:
        """A motion that was solved with an aim, replayed and corrected."""
        steps = rough_steps_for(self.residual, self.drive)
        if self.kept is not NOTHING_KEPT:
            motion = replace(motion, kept=self.kept)
        replays = motion.replays(self.drive, settings=steps)
        next_aim = aim - np.concatenate([beside_rest(one) for one in replays])
        motion, replays = _corrected(motion, replays, self.residual, self.drive, steps)
        found = _TriedMotion(motion, replays, next_aim)
        self.say(_sentence(found))
        return found

    def again(self, from_: _TriedMotion, weight: float, finer: bool) -> _TriedMotion | None:
        """The next one from a motion; None where the solver gives up."""
        # far from rest a motion swings as its mesh lets it: where that ends, and its multipliers,
        # say nothing of a finer mesh
        astray = finer and not near(from_, self.residual)
        aim = np.zeros_like(from_.aim) if astray else from_.aim
        try:
            solved = solve_again(
                from_.motion,
                weight=weight,
                aim=aim,
                finer=2.0 if finer else 1.0,
                multipliers=not astray,
                solver=self.solver,
            )
        except StudyError as error:
            self.say(f"this round ended without a solution: {error}")
            return None
        return self.tried(solved, aim)

    def stated(
        self,
        motion: OptimalMotion,
        rounds: tuple[Round, ...],
        change: float,
        elements: int | None = None,
    ) -> Refined:
        """A motion of the rounds, which were replayed roughly, with the replays that are stated."""
        steps = steps_for(self.residual, self.drive)
        replays, finer = motion.replays(self.drive, settings=steps), None
        if most_left(replays) > self.residual:
            # where little is allowed, the rough replay that the rounds correct misses as much
            motion, replays = _corrected(motion, replays, self.residual, self.drive, steps)
        if elements is not None:
            self.solver.live("replaying on a finer full model")
            finer = motion.replays(self.drive, elements=elements, settings=steps)
        return Refined(motion, replays, rounds, self.residual, change, finer)


def calmer(
    answers: tuple[_T, ...], rounds: tuple[Round, ...], residual: float, again: Again[_T]
) -> Iterator[tuple[_T, tuple[Round, ...], float]]:
    """Motions as good as the best answer at a heavier smoothness, with the rounds until then.

    Also the part of the objective by which the best answer is better.

    A torque with sharp edges stirs modes whose frequencies a finer full model shifts: over a stage
    of hundreds of their periods both models then end with another phase. No correction on one model
    holds for the other, so that the torque has to leave these modes alone.
    """
    best = answers[0].entry
    tried, heavier = answers[0], best.on_full_model / (AGREE * residual)
    for _ in range(CALMER_ROUNDS):
        weight = tried.entry.weight * float(np.clip(heavier, *_HEAVIER))
        found = again(tried, weight, False)
        if found is None:
            return
        tried, rounds = found, (*rounds, found.entry)
        lost = 1.0 - best.objective / found.entry.objective
        if abs(lost) > SAME:
            return
        # both models are left with something else, of the order of what either is left with; how
        # much that is, their replays say
        heavier = found.entry.on_full_model / (AGREE * residual)
        if found.entry.off(residual) <= 1.0:
            yield found, rounds, lost


def confirmed(candidates: Iterable[Refined], say: Say = unheard) -> Refined:
    """The first of motions that are as good whose residual a finer full model confirms.

    The first of all where there is none.
    """
    first: Refined | None = None
    for found in candidates:
        if found.confirmed:
            return found
        if found.finer is not None:
            finer = most_left(found.finer)
            say(f"residual energy {found.left:.2e} J, on a finer full model {finer:.2e} J")
        first = first or found
    assert first is not None
    return first


def most_left(replays: Iterable[LockedMotion]) -> float:
    """The most that a lock leaves [J]."""
    return max(one.residual_energy for one in replays)


def agreement(residual: float) -> float:
    """By how much two replays may differ where a residual [J] is allowed [J]."""
    return max(AGREE * residual, FLOOR)


def _corrected(
    motion: OptimalMotion,
    replays: tuple[LockedMotion, ...],
    residual: float,
    drive: Drive,
    steps: StepControl,
) -> tuple[OptimalMotion, tuple[LockedMotion, ...]]:
    """The motion with a little torque added, as far as that brings the full model nearer to rest.

    A motion that needs much more torque, or breaks a limit with it, is left as it is; so is one
    under angles, of both joints, or so slow that it hardly stirs the modes.
    """
    if drive != "torque" or len(motion.torques) > 1 or is_slow(motion.stage):
        return motion, replays
    best, still = motion, replays
    for _ in range(CORRECTIONS):
        # well below what is allowed: a finer full model then agrees, too
        if not AGREE * residual < most_left(still) <= HOPELESS * residual:
            break
        more = correction(motion.stage, still[0].run.before)
        added = added_to(more, best.added) if best.added else more
        tried = replace(motion, added=added)
        if tried.added_share > ADDED or not tried.within_limits:
            break
        again = tried.replays("torque", settings=steps)
        if most_left(again) > 0.5 * most_left(still):
            break
        best, still = tried, again
    return best, still


def _sentence(tried: _TriedMotion) -> str:
    """A line of progress."""
    entry, names = tried.entry, " and ".join(stage.name for stage in tried.motion.stages)
    weight = f", smoothness weight {entry.weight:.2g}" if entry.weight else ""
    objective = (
        f", objective {entry.objective:.5g} times that of the rigid arm" if entry.weight else ""
    )
    return (
        f"{names}: {entry.intervals} intervals{weight}{objective}: residual energy on the full "
        f"model {entry.on_full_model:.2e} J"
    )
