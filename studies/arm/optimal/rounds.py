"""Rounds of a refinement: aimed anew, at a lighter smoothness, on a finer mesh.

What a round is of is left open: one motion, or a sequence of them, with a replay that says how far
the full model is from rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from studies.arm.search_limits import HOPELESS, ROUNDS

SAME = 0.01  # relative change of the objective that counts as none
MISS = 1e-3  # [rad] by which a joint may miss its angle, 5 mm at the tip of a straight arm
ASKED = 0.9  # share of the residual allowed that a round may leave: its replay is right to some %
_SMALL_STEP = 2.0  # by which the smoothness is made lighter where a larger step leads astray


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


class MotionTrial(Protocol):
    """A motion with its replay, from which the next one is solved."""

    @property
    def entry(self) -> Round:
        """What it leaves."""


_T = TypeVar("_T", bound=MotionTrial)
Again = Callable[[_T, float, bool], "_T | None"]
"""Solve from a trial: with a weight of the smoothness, and with half the interval or the same."""


def refined(
    first: _T, again: Again[_T], residual: float, lighter: float
) -> tuple[tuple[_T, ...], tuple[Round, ...], float]:
    """Aim, lighten and refine until the full model rests and nothing more is gained.

    Parameters
    ----------
    first : MotionTrial
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
        best = aimed(first, residual, rounds, noted)
        finer = noted(best, 0.0, True) if best.entry.off(residual) > 1.0 else None
        if finer is not None:
            finer = aimed(finer, residual, rounds, noted)
            best = min(best, finer, key=lambda tried: tried.entry.off(residual))
        return (best,), tuple(rounds), 0.0
    best = first
    if not near(first, residual):
        # a mesh with an interval or so for a period of the first mode lets a motion swing as the
        # arm does not; half its interval holds it
        finer = noted(first, first.entry.weight, True)
        resolved = finer is not None and near(finer, residual)
        best = finer if finer and resolved else aimed(first, residual, rounds, noted)
    answers, change = _lighter(best, residual, lighter, rounds, noted)
    return answers, tuple(rounds), change


def _lighter(
    heavy: _T, residual: float, lighter: float, rounds: list[Round], again: Again[_T]
) -> tuple[tuple[_T, ...], float]:
    """The lightest smoothness whose motion leaves the full model still, as far as it gains.

    Also what the last halving of weight and interval changes of the objective, nan if that fails.
    """
    weight = heavy.entry.weight / lighter
    while near(heavy, residual) and len(rounds) < ROUNDS:
        found = again(heavy, weight, False)
        # an aim brings a factor of ten to a hundred, not more
        if found is not None and near(found, residual):
            found = aimed(found, residual, rounds, again)
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

    return _finer(aimed(heavy, residual, rounds, again), residual, rounds, again)


def _finer(
    heavy: _T, residual: float, rounds: list[Round], again: Again[_T], more: int = 1
) -> tuple[tuple[_T, ...], float]:
    """The motion with half the weight and half the interval, if it leaves the full model still.

    Behind it the one that it comes from, where that is still and as good. Also the change of the
    objective, nan if there is no such motion. Where that is too much, the same is done again, so
    many times as `more` says.
    """
    finer = again(heavy, 0.5 * heavy.entry.weight, True)
    if finer is None or not near(finer, residual):
        # one after the other is easier
        first = again(heavy, heavy.entry.weight, True)
        if first is not None and not near(first, residual):
            # a mesh leaves a fast mode out, or resolves it; one with a point or two in a period of
            # it does neither, and half its interval does
            first = again(first, heavy.entry.weight, True)
        if first is None or not near(first, residual):
            return (heavy,), float("nan")
        finer = again(first, 0.5 * first.entry.weight, False)
        if finer is None or not near(finer, residual):
            return _as_light_as_can_be(heavy, first, residual, rounds, again)

    change = finer.entry.objective / heavy.entry.objective - 1.0
    finer = aimed(finer, residual, rounds, again)  # another mesh misses rest by something else
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
    if twice is None or not near(twice, residual):
        return (heavy,), float("nan")
    best = aimed(finer, residual, rounds, again)
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


def near(found: MotionTrial, residual: float) -> bool:
    """Whether the full model comes so near to rest that an aim can do the rest.

    What is far from it is a motion that the mesh does not resolve, whatever its objective.
    """
    return found.entry.on_full_model <= HOPELESS * residual


def aimed(first: _T, residual: float, rounds: list[Round], again: Again[_T]) -> _T:
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
