"""Refine a motion until the full model rests, and until less smoothness gains nothing more.

Each round solves on B21 and replays on the full model. Three things are refined: where B21 is aimed
(see `aim`), the weight of the smoothness, and the mesh. The engine's own refinement watches the
equations of motion; what counts here is the energy that the lock finds, a small difference of
large ones, so that the replays decide.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from models.ancf.integrate import StepControl
from ocp import solve
from ocp.arrays import Array
from studies.arm.optimal.aim import beside_rest
from studies.arm.optimal.correction import added_to, correction
from studies.arm.optimal.finished_solves import Solve
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.optimal.phase import is_slow
from studies.arm.optimal.solve import solve_again
from studies.arm.replay.full_model import Drive, LockedMotion, rough_steps_for, steps_for
from studies.arm.search_limits import CALMER_ROUNDS, CORRECTIONS, HOPELESS, LIGHTER, ROUNDS
from studies.arm.stage import ELBOW
from studies.common.exit_codes import StudyError

Progress = Callable[[str], None]
SAME = 0.01  # relative change of the objective that counts as none
AGREE = 0.1  # share of the residual allowed by which two replays may differ
FLOOR = 1e-9  # [J] below which all replays count as still
_SMALL_STEP = 2.0  # by which the smoothness is made lighter where a larger step leads astray
# by which the smoothness is made heavier where a finer full model disagrees, at least and at most:
# about as much less is left on the full model
_HEAVIER = (2.0, 10.0)
ADDED = 0.005  # share of the peak torque that may be added, half of what counts as no change
MISS = 1e-3  # [rad] by which a joint may miss its angle, 5 mm at the tip of a straight arm
ASKED = 0.9  # share of the residual allowed that a round may leave: its replay is right to some %


@dataclass(frozen=True)
class Round:
    """What one solve leaves.

    Attributes
    ----------
    intervals : of the mesh.
    weight : of the smoothness.
    objective : in units of the rigid arm's.
    on_full_model : E_res [J] of the replay.
    miss : of an angle at the lock, on the full model [rad].
    """

    intervals: int
    weight: float
    objective: float
    on_full_model: float
    miss: float = 0.0

    def off(self, residual: float) -> float:
        """How far it is from rest, over what is allowed: in energy [J] or in angle."""
        return max(self.on_full_model / residual, self.miss / (ASKED * MISS))


@dataclass(frozen=True, eq=False)
class Refined:
    """A motion that was refined.

    Attributes
    ----------
    motion : OptimalMotion
    replay : on the full model.
    rounds : all of them, in order.
    residual : that the motion may leave [J].
    change : of the objective by the last halving of weight and interval, relative; nan if that
        failed, zero where nothing is weighed.
    finer : replay on a finer full model, None where none was asked for.
    lost : part of the objective by which a lighter smoothness is better, whose residual no finer
        full model confirms; zero where the lightest one is taken.
    """

    motion: OptimalMotion
    replay: LockedMotion
    rounds: tuple[Round, ...]
    residual: float
    change: float = 0.0
    finer: LockedMotion | None = None
    lost: float = 0.0

    @property
    def settled(self) -> bool:
        """Whether neither a finer nor a less smooth motion is better by more than `SAME`."""
        return abs(self.change) <= SAME and self.lost <= SAME

    @property
    def still(self) -> bool:
        """Whether the full model is left with no more than was allowed."""
        return self.replay.residual_energy <= self.residual

    @property
    def disagreement(self) -> float:
        """By how much a finer full model is left with another energy [J]; nan without one."""
        if self.finer is None:
            return float("nan")
        return abs(self.finer.residual_energy - self.replay.residual_energy)

    @property
    def confirmed(self) -> bool:
        """Whether it is still, and a finer full model, where one was asked, says the same."""
        agrees = self.finer is None or self.disagreement <= agreement(self.residual)
        return self.still and agrees

    @property
    def resolved(self) -> bool:
        """Whether the answer counts: still, and no better one beside it."""
        return self.still and self.settled


class Trial(Protocol):
    """A motion with its replay, from which the next one is solved."""

    @property
    def entry(self) -> Round:
        """What it leaves."""


_T = TypeVar("_T", bound=Trial)
Again = Callable[[_T, float, bool], "_T | None"]
"""Solve from a trial: with a weight of the smoothness, and with half the interval or the same."""


def refined(
    first: _T, again: Again[_T], residual: float, lighter: float
) -> tuple[tuple[_T, ...], tuple[Round, ...], float]:
    """Aim, lighten and refine until the full model rests and nothing more is gained.

    Parameters
    ----------
    first : Trial
        Solved on one mesh.
    again : callable
        Gives the next trial, None where the solver gives up.
    residual : float
        That the full model may be left with [J].
    lighter : float
        By which the smoothness is made lighter at once.

    Returns
    -------
    answers : the best one, and then one whose objective is worse by no more than `SAME`, if any.
    rounds : all of them, in order.
    change : of the objective by the last halving of weight and interval, see `Refined`.
    """
    rounds = [first.entry]

    def noted(from_: _T, weight: float, finer: bool) -> _T | None:
        found = again(from_, weight, finer)
        if found is not None:
            rounds.append(found.entry)
        return found

    if not first.entry.weight:
        best = _aimed(first, residual, rounds, noted)
        finer = noted(best, 0.0, True) if best.entry.off(residual) > 1.0 else None
        if finer is not None:
            finer = _aimed(finer, residual, rounds, noted)
            best = min(best, finer, key=lambda tried: tried.entry.off(residual))
        return (best,), tuple(rounds), 0.0
    best = first if _near(first, residual) else _aimed(first, residual, rounds, noted)
    answers, change = _lighter(best, residual, lighter, rounds, noted)
    return answers, tuple(rounds), change


def _lighter(
    heavy: _T, residual: float, lighter: float, rounds: list[Round], again: Again[_T]
) -> tuple[tuple[_T, ...], float]:
    """The lightest smoothness whose motion leaves the full model still, as far as it gains.

    Also what the last halving of weight and interval changes of the objective, nan if that fails.
    """
    weight = heavy.entry.weight / lighter
    while _near(heavy, residual) and len(rounds) < ROUNDS:
        found = again(heavy, weight, False)
        # an aim brings a factor of ten to a hundred, not more
        if found is not None and _near(found, residual):
            found = _aimed(found, residual, rounds, again)
            if found.entry.off(residual) <= 1.0:
                gained, heavy = _a_halving(heavy.entry, found.entry), found
                if gained <= SAME:
                    break
                weight = heavy.entry.weight / lighter
                continue
            # what no aim takes away, the mesh has left: with half the interval it goes
            answers, change = _finer(found, residual, rounds, again)
            if answers[0] is not found:
                return answers, change
        elif lighter <= _SMALL_STEP:
            break
        else:
            # it left for a motion that no mesh resolves: by smaller steps it stays where it is
            lighter = max(_SMALL_STEP, lighter / 10.0)
            weight = heavy.entry.weight / lighter
            continue
        weight = float(np.sqrt(weight * heavy.entry.weight))

    return _finer(_aimed(heavy, residual, rounds, again), residual, rounds, again)


def _finer(
    heavy: _T, residual: float, rounds: list[Round], again: Again[_T], more: int = 1
) -> tuple[tuple[_T, ...], float]:
    """The motion with half the weight and half the interval, if it leaves the full model still.

    Behind it the one that it comes from, where that is still and as good. Also the change of the
    objective, nan if there is no such motion. Where that is too much, the same is done again, so
    many times as `more` says.
    """
    finer = again(heavy, 0.5 * heavy.entry.weight, True)
    if finer is None or not _near(finer, residual):
        # one after the other is easier
        first = again(heavy, heavy.entry.weight, True)
        if first is not None and not _near(first, residual):
            # a mesh leaves a fast mode out, or resolves it; one with a point or two in a period of
            # it does neither, and half its interval does
            first = again(first, heavy.entry.weight, True)
        if first is None or not _near(first, residual):
            return (heavy,), float("nan")
        finer = again(first, 0.5 * first.entry.weight, False)
        if finer is None or not _near(finer, residual):
            return _as_light_as_can_be(heavy, first, residual, rounds, again)

    change = finer.entry.objective / heavy.entry.objective - 1.0
    finer = _aimed(finer, residual, rounds, again)  # another mesh misses rest by something else
    if finer.entry.off(residual) > 1.0:
        return (heavy,), change
    if abs(change) > SAME and more:
        return _finer(finer, residual, rounds, again, more - 1)
    as_good = abs(change) <= SAME and heavy.entry.off(residual) <= 1.0
    return ((finer, heavy) if as_good else (finer,)), change


def _as_light_as_can_be(
    heavy: _T, finer: _T, residual: float, rounds: list[Round], again: Again[_T]
) -> tuple[tuple[_T, ...], float]:
    """A motion on half the interval, where half its weight leads to one that no mesh resolves.

    What a halving of the weight changes is what the one before did, as each changes less. The
    change is that and the finer mesh's.
    """
    twice = again(finer, 2.0 * finer.entry.weight, False)
    if twice is None or not _near(twice, residual):
        return (heavy,), float("nan")
    best = _aimed(finer, residual, rounds, again)
    if best.entry.off(residual) > 1.0:
        return (heavy,), float("nan")

    reached = best.entry.objective
    change = sum(abs(reached / other.entry.objective - 1.0) for other in (heavy, twice))
    as_good = change <= SAME and heavy.entry.off(residual) <= 1.0
    return ((best, heavy) if as_good else (best,)), float(change)


def _a_halving(heavy: Round, light: Round) -> float:
    """What each halving of the weight gained of the objective, relative."""
    halvings = np.log2(heavy.weight / light.weight)
    return float(1.0 - (light.objective / heavy.objective) ** (1.0 / halvings))


def _near(found: Trial, residual: float) -> bool:
    """Whether the full model comes so near to rest that an aim can do the rest.

    What is far from it is a motion that the mesh does not resolve, whatever its objective.
    """
    return found.entry.on_full_model <= HOPELESS * residual


def _aimed(first: _T, residual: float, rounds: list[Round], again: Again[_T]) -> _T:
    """The motion aimed anew while that brings the full model nearer to rest."""
    best = first
    while best.entry.off(residual) > 1.0 and len(rounds) < ROUNDS:
        found = again(best, best.entry.weight, False)
        if found is None:
            return best
        if found.entry.off(residual) > 0.5 * best.entry.off(residual):
            return min(best, found, key=lambda tried: tried.entry.off(residual))
        best = found
    return best


@dataclass(frozen=True, eq=False)
class _TriedMotion:
    """A motion of a stage with its replay, and where the next one is to be aimed."""

    motion: OptimalMotion
    replay: LockedMotion
    aim: Array

    @property
    def entry(self) -> Round:
        motion, left = self.motion, self.replay.residual_energy
        return Round(motion.intervals, motion.weight, motion.objective, left, self.replay.miss)


def refine(
    motion: OptimalMotion,
    *,
    residual: float = RESIDUAL,
    drive: Drive = "torque",
    elements: int | None = None,
    say: Progress | None = None,
    live: Progress | None = None,
    solver: Solve = solve,
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
    say, live : callable, optional
        Receive a line a round, and a line now and then.
    solver : callable
        In the place of `ocp.solve`, see `finished_solves`.
    """

    def tried(motion: OptimalMotion, aim: Array) -> _TriedMotion:
        steps = rough_steps_for(residual, drive)
        replayed = motion.replay(drive, settings=steps)
        next_aim = aim - beside_rest(motion.stage, replayed.run.before)
        motion, replayed = _corrected(motion, replayed, residual, drive, steps)
        found = _TriedMotion(motion, replayed, next_aim)
        if say is not None:
            say(sentence(found.entry, motion.stage.name))
        return found

    def again(from_: _TriedMotion, weight: float, finer: bool) -> _TriedMotion | None:
        intervals = from_.motion.intervals * (2 if finer else 1)
        try:
            solved = solve_again(
                from_.motion,
                weight=weight,
                aim=from_.aim,
                intervals=intervals,
                progress=live,
                solver=solver,
            )
        except StudyError as error:
            if say is not None:
                say(f"this round was given up: {error}")
            return None
        return tried(solved, from_.aim)

    first = tried(motion, np.zeros(2 * motion.stage.model.size))
    lighter = LIGHTER[ELBOW in motion.stage.moving]
    answers, rounds, change = refined(first, again, ASKED * residual, lighter)

    stated = functools.partial(
        _stated, residual=residual, drive=drive, elements=elements, live=live
    )
    found = confirmed((stated(answer.motion, rounds, change) for answer in answers), say)
    if found.confirmed or elements is None or not found.settled:
        return found
    others = (
        replace(stated(tried.motion, all_rounds, change), lost=lost)
        for tried, all_rounds, lost in calmer(answers, rounds, residual, again)
    )
    return next((other for other in others if other.confirmed), found)


def _stated(
    motion: OptimalMotion,
    rounds: tuple[Round, ...],
    change: float,
    *,
    residual: float,
    drive: Drive,
    elements: int | None,
    live: Progress | None,
) -> Refined:
    """A motion of the rounds, which were replayed roughly, with the replays that are stated."""
    steps = steps_for(residual, drive)
    replayed = motion.replay(drive, settings=steps)
    if replayed.residual_energy > residual:
        # where little is allowed, the rough replay that the rounds correct misses as much itself
        motion, replayed = _corrected(motion, replayed, residual, drive, steps)
    if elements is None:
        return Refined(motion, replayed, rounds, residual, change)
    if live is not None:
        live("replaying on a finer full model")
    finer = motion.replay(drive, elements=elements, settings=steps)
    return Refined(motion, replayed, rounds, residual, change, finer)


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
        # both models are left with something else, of the order of what either is left with
        heavier = found.entry.on_full_model / (AGREE * residual)
        if heavier <= 1.0:
            yield found, rounds, lost


def confirmed(candidates: Iterable[Refined], say: Progress | None = None) -> Refined:
    """The first of motions that are as good whose residual a finer full model confirms.

    The first of all where there is none.
    """
    first: Refined | None = None
    for found in candidates:
        if found.confirmed:
            return found
        if say is not None and found.finer is not None:
            left, finer = found.replay.residual_energy, found.finer.residual_energy
            say(f"left with {left:.2e} J, and {finer:.2e} J on a finer full model")
        first = first or found
    assert first is not None
    return first


def agreement(residual: float) -> float:
    """By how much two replays may differ where a residual [J] is allowed [J]."""
    return max(AGREE * residual, FLOOR)


def _corrected(
    motion: OptimalMotion, replayed: LockedMotion, residual: float, drive: Drive, steps: StepControl
) -> tuple[OptimalMotion, LockedMotion]:
    """The motion with a little torque added, as far as that brings the full model nearer to rest.

    A motion that needs much more torque, or breaks a limit with it, is left as it is; so is one
    under angles, of both joints, or so slow that it hardly stirs the modes.
    """
    if drive != "torque" or len(motion.stage.moving) > 1 or is_slow(motion.stage):
        return motion, replayed
    best, still = motion, replayed
    for _ in range(CORRECTIONS):
        # well below what is allowed: a finer full model then agrees, too
        if not AGREE * residual < still.residual_energy <= HOPELESS * residual:
            break
        more = correction(motion.stage, still.run.before)
        added = added_to(more, best.added) if best.added else more
        tried = replace(motion, added=added)
        if tried.added_share > ADDED or not tried.within_limits:
            break
        again = tried.replay("torque", settings=steps)
        if again.residual_energy > 0.5 * still.residual_energy:
            break
        best, still = tried, again
    return best, still


def sentence(entry: Round, name: str) -> str:
    """A line of progress."""
    weight = f", smoothness at {entry.weight:.2g}" if entry.weight else ""
    objective = f", {entry.objective:.5g} of the rigid arm's" if entry.weight else ""
    return (
        f"{name}: {entry.intervals} intervals{weight}{objective}: the full model is left with "
        f"{entry.on_full_model:.2e} J"
    )
