"""Least durations that leave at most a given residual energy under one torque cap.

The cap is the Bezier law's peak torque over the stage's own duration, under the drive asked for.
What a law leaves oscillates with its duration: each law is scanned on B21, several durations to
each beat, and where it comes near the limit the first duration that passes is sought on the full
model, whose beats are not quite in step with B21's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.errors import ModelError
from studies.arm.laws.baselines import (
    baseline_law,
    baseline_names,
    free_frequencies,
    locked_frequency,
    needs_search,
)
from studies.arm.laws.rigid import feed_forward
from studies.arm.laws.scan import left_by_laws
from studies.arm.laws.unit_laws import NamedLaw, bezier
from studies.arm.optimal.solve import capped, solve_stage
from studies.arm.questions.baselines import replay_law
from studies.arm.replay.full import Drive, Replay
from studies.arm.stage import Stage
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError

Say = Callable[[str], None]
Array = NDArray[np.float64]
RESIDUAL = 1e-6  # [J] that a motion of least duration may leave
LONGEST = 2.5  # times the stage's duration at which the scan gives up
NEAR = 4.0  # times the limit that B21 may leave where the full model is asked
CANDIDATES = 3  # places at which the full model is asked
BISECTIONS = 4
FACTORS = (4.04, 5.0)  # caps of the optimum in J D/T^2 between which its duration is sought
SEARCHES = 6
_BEAT = 6.0  # durations scanned to a beat
_PART = 32  # durations scanned before the full model is asked
_HALVINGS = 40
_SLACK = 0.999  # of the optimum's cap, for peaks between the points and the reaction of the model
_COARSE = 1.1  # ratio of neighbouring durations of a law whose shaper is sought at each


@dataclass(frozen=True)
class Least:
    """Least duration [s] found, None if none was; residual [J] and peak torque [N m] there.

    `lowest` is the least residual seen under the cap [J]: by the scan on B21, or on the full model
    where that was asked.
    """

    name: str
    duration: float | None
    residual: float = float("nan")
    torque: float = float("nan")
    lowest: float = float("nan")


def torque_cap(stage: Stage, drive: Drive) -> float:
    """Peak torque of the Bezier law over the stage's duration [N m].

    Under angle drive that of the reaction on the full model.
    """
    law = NamedLaw("Bezier", bezier(stage.duration))
    if drive == "torque":
        return rigid_peak(stage, law)
    return float(replay_law(stage, law, drive, follow=False).peak_torque[stage.moving[0]])


def rigid_peak(stage: Stage, law: NamedLaw) -> float:
    """Largest torque of the rigid arm along a law [N m]."""
    t = np.linspace(0.0, law.law.duration, 2001)
    t = np.concatenate((t, law.law.breakpoints))
    return float(np.abs(feed_forward(stage, law.law)(t)[stage.moving[0]]).max())


def least_durations(stage: Stage, drive: Drive, cap: float, say: Say) -> list[Least]:
    """The optimum and every baseline under a drive and a torque cap [N m]."""
    found = [of_optimum(stage, drive, cap, say)]
    for name in baseline_names(drive):
        found.append(of_baseline(stage, name, drive, cap, say))
        say(f"{found[-1].name}: {number(found[-1].duration)} s")
    return found


def of_optimum(stage: Stage, drive: Drive, cap: float, say: Say) -> Least:
    """Bisection of the duration between one that passes and one that does not."""
    k = stage.moving[0]
    best = Least("optimum", None)
    low, high = FACTORS
    factor = high
    for _ in range(SEARCHES):
        T = float(np.sqrt(factor * stage.inertias[k] * abs(stage.turn[k]) / cap))
        shorter = stage.lasting(T)
        try:
            done = solve_stage(shorter, limits=capped(shorter, _SLACK * factor)).replay(drive)
        except StudyError as error:
            say(f"{T:.4g} s: {error}")
            low = factor
        else:
            say(f"optimum in {T:.4g} s leaves {done.residual_energy:.2e} J")
            if passes(done, cap):
                best, high = _least("optimum", done), factor
            else:
                low = factor
        if best.duration is None:
            break
        factor = 0.5 * (low + high)
    return best


def passes(done: Replay | None, cap: float) -> bool:
    """Whether residual and torque are within the limits."""
    if done is None:
        return False
    peak = done.peak_torque[done.motion.stage.moving[0]]
    return bool(done.residual_energy <= RESIDUAL and peak <= cap * (1 + 1e-9))


def of_baseline(stage: Stage, name: str, drive: Drive, cap: float, say: Say) -> Least:
    """First duration at which a baseline passes on the full model, where B21 comes near it."""
    durations, laws = scanned(stage, name, drive, cap)
    asked, seen = 0, list[float]()

    def on_full(T: float) -> Replay | None:
        try:
            law = baseline_law(stage.lasting(T), name, drive)
            done = replay_law(stage.lasting(T), law, drive, follow=False)
        except (StudyError, ModelError) as error:
            say(str(error))
            return None
        say(f"{name} in {T:.5g} s leaves {done.residual_energy:.2e} J")
        seen.append(done.residual_energy)
        return done

    left = np.empty(0)
    for first in range(0, len(laws), _PART):
        some = [law.law for law in laws[first : first + _PART]]
        left = np.append(left, left_by_laws(stage, some, drive))
        found = windows(durations[: len(left)], left, ended=len(left) == len(laws))
        for window in found[asked:CANDIDATES]:
            done = first_pass(on_full, window, cap)
            if done is not None:
                return _least(name, done, done.residual_energy)
        asked = len(found)
    return Least(name, None, lowest=min(seen, default=float(left.min())))


def scanned(stage: Stage, name: str, drive: Drive, cap: float) -> tuple[Array, list[NamedLaw]]:
    """Durations of the scan [s] and the laws there, from the shortest under the cap."""
    low, high = 0.5 * stage.duration, LONGEST * stage.duration
    if needs_search(stage, name, drive):
        durations = np.geomspace(low, high, 1 + int(np.log(high / low) / np.log(_COARSE)))
    else:
        first = _shortest(stage, name, drive, cap, (low, high))
        slow = locked_frequency(stage) if drive == "angle" else np.mean(free_frequencies(stage))
        durations = np.arange(first, high, 1.0 / (_BEAT * float(slow)))
    laws = [baseline_law(stage.lasting(float(T)), name, drive) for T in durations]
    within = np.array([rigid_peak(stage, law) <= cap * (1 + 1e-9) for law in laws])
    return durations[within], [law for law, yes in zip(laws, within, strict=True) if yes]


def _shortest(
    stage: Stage, name: str, drive: Drive, cap: float, bracket: tuple[float, float]
) -> float:
    """Shortest duration of a law under the cap on the rigid arm [s]."""
    low, high = bracket
    for _ in range(_HALVINGS):
        T = 0.5 * (low + high)
        fits = rigid_peak(stage, baseline_law(stage.lasting(T), name, drive)) <= cap
        low, high = (low, T) if fits else (T, high)
    return high


def windows(
    durations: Array, left: Array, *, ended: bool = True
) -> list[tuple[float, float, float]]:
    """Each dip of a scan that comes near the limit, with a duration before and one after it [s].

    The one before is where the scan was not yet near the limit, if no dip came since. A scan
    that has not ended may dip beyond its last duration.
    """
    found: list[tuple[float, float, float]] = []
    began = 0
    for k, dip in enumerate(left if ended else left[:-1]):
        if dip > NEAR * RESIDUAL:
            began = k
            continue
        after = min(k + 1, len(left) - 1)
        if dip <= left[max(k - 1, 0)] and dip <= left[after]:
            found.append((float(durations[began]), float(durations[k]), float(durations[after])))
            began = k
    return found


def first_pass(
    on_full: Callable[[float], Replay | None], window: tuple[float, float, float], cap: float
) -> Replay | None:
    """Replay at the least duration found to pass about a dip, None if none does.

    Near a dip the residual is a parabola of the duration: its bottom is found from three points.
    """
    tried = {T: on_full(T) for T in window}
    if not any(passes(done, cap) for done in tried.values()):
        known = {T: done.residual_energy for T, done in tried.items() if done is not None}
        if len(known) < len(window):
            return None
        bottom = _bottom(np.array(list(known)), np.array(list(known.values())))
        tried[bottom] = on_full(bottom)
    best = min((T for T, done in tried.items() if passes(done, cap)), default=None)
    if best is None:
        return None
    fails = max((T for T in tried if best > T), default=None)
    if fails is None:
        return tried[best]
    for _ in range(BISECTIONS):
        T = 0.5 * (fails + best)
        tried[T] = on_full(T)
        best, fails = (T, fails) if passes(tried[T], cap) else (best, T)
    return tried[best]


def _bottom(times: Array, left: Array) -> float:
    """Bottom of the parabola through three residuals, at most a window away [s]."""
    curve = np.polyfit(times - times[1], left, 2)
    width = 2 * (times[2] - times[1])
    shift = -curve[1] / (2 * curve[0]) if curve[0] > 0 else width * np.sign(-curve[1])
    return float(times[1] + np.clip(shift, -width, width))


def _least(name: str, done: Replay, lowest: float = float("nan")) -> Least:
    stage = done.motion.stage
    torque = float(done.peak_torque[stage.moving[0]])
    return Least(name, stage.duration, done.residual_energy, torque, lowest)


def table(stage: Stage, drive: Drive, cap: float, found: list[Least]) -> Table:
    """The least durations as a table."""
    best = found[0].duration
    rows = []
    for x in found:
        ahead = "" if x is found[0] else _verdict(best, x)
        rows.append((
            x.name, number(x.duration), number(x.residual, 3), number(x.torque), ahead
        ))  # fmt: skip
    return Table(
        f"{stage.name} arm, {drive} drive: least duration with E_res <= {RESIDUAL:g} J under "
        f"{cap:.5g} N m, full ANCF model",
        ("law", "duration [s]", "E_res [J]", "peak torque [N m]", ""),
        rows,
        (
            f"cap: the Bezier law's peak torque in {stage.duration:g} s, {drive} drive; rigid "
            f"limit 2 sqrt(J D/tau) = {stage.least_duration(cap):.4g} s",
            "what a law leaves falls and rises with its duration: a baseline's is the first found "
            "that passes, often a narrow dip",
        ),
    )  # fmt: skip


def _verdict(best: float | None, baseline: Least) -> str:
    if baseline.duration is None:
        longest = f"none found up to {LONGEST:g} times the stage"
        return f"{longest}; least seen {number(baseline.lowest, 2)} J"
    if best is None:
        return "NOT beaten: no optimum found"
    gain = 100.0 * (1.0 - best / baseline.duration)
    return f"optimum {gain:.3g} % shorter" if gain > 0 else f"NOT beaten, {-gain:.3g} % shorter"
