"""Least durations that leave at most a given residual energy under one torque cap.

The cap is the Bezier law's peak torque over the stage's own duration, under the drive asked for.
What a law leaves oscillates with its duration: each law is scanned on B21, several durations to
each beat, and where it comes near the limit the first duration that passes is sought on the full
model, whose beats are not quite in step with B21's.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models.errors import ModelError
from ocp.arrays import Array
from studies.arm.config import LeastDurationStudy, as_dictionary
from studies.arm.laws.rigid import feed_forward
from studies.arm.laws.scan import left_by_laws
from studies.arm.laws.shapers import (
    baseline_law,
    baseline_names,
    free_frequencies,
    locked_frequency,
    needs_search,
)
from studies.arm.laws.unit_laws import NamedLaw, unit_law
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.optimal.solve import solve_stage
from studies.arm.optimal.study_solver import Say, StudySolver
from studies.arm.questions.baselines import replay_law
from studies.arm.replay.full_model import Drive, LockedMotion
from studies.arm.report.quantities import Metric, table_rows
from studies.arm.search_limits import (
    BISECTIONS,
    CANDIDATES,
    COARSE_RATIO,
    DURATIONS_A_BEAT,
    HALVINGS,
    LONGEST_SCANNED,
    NEAR,
    OPTIMUM_FACTORS,
    OPTIMUM_SEARCHES,
    SHORTEST_SCANNED,
)
from studies.arm.stage import Stage
from studies.common.comparison_table import costs_elsewhere
from studies.common.console import Console, number
from studies.common.exit_codes import StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.processes.side_by_side import side_by_side
from studies.common.result import Result, Verdict

OPTIMUM = "optimum"
_PART = 32  # durations scanned before the full model is asked
_SLACK = 0.999  # of the optimum's cap, for peaks between the points and the reaction of the model
_PEAK_SAMPLES = 2001  # instants at which the rigid arm's torque is looked at


@dataclass(frozen=True)
class LeastDuration:
    """Least duration [s] found, None if none was; residual [J] and peak torque [N m] there.

    `lowest` is the minimum residual energy found under the cap [J]: by the scan on B21, or on the
    full model where that was asked.
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
    law = unit_law("Bezier", stage.duration)
    if drive == "torque":
        return rigid_peak(stage, law)
    return float(replay_law(stage, law, drive, follow=False).peak_torque[stage.moving[0]])


def rigid_peak(stage: Stage, law: NamedLaw) -> float:
    """Largest torque of the rigid arm along a law [N m]."""
    t = np.linspace(0.0, law.law.duration, _PEAK_SAMPLES)
    t = np.concatenate((t, law.law.breakpoints))
    return float(np.abs(feed_forward(stage, law.law)(t)[stage.moving[0]]).max())


def least_durations(
    stage: Stage,
    drive: Drive,
    cap: float,
    console: Console,
    kept: FinishedSteps = NOTHING_KEPT,
) -> list[LeastDuration]:
    """The optimum and every baseline under a drive and a torque cap [N m], side by side.

    Where the user stops it the optimum, which is first, is missing, and perhaps some baselines.
    """
    names = baseline_names(drive)
    parts = [
        *(kept.part(name, of_baseline, stage, name, drive, cap) for name in reversed(names)),
        kept.part(OPTIMUM, of_optimum, stage, drive, cap, kept.within(OPTIMUM)),
    ]
    # begun with what takes longest: shapers, whose torque jumps, which are named last
    found: list[LeastDuration] = []
    try:
        found.extend(side_by_side(parts, console))
    except KeyboardInterrupt:
        if not found:
            raise
    return found[::-1]


def of_optimum(
    stage: Stage, drive: Drive, cap: float, kept: FinishedSteps, console: Console
) -> LeastDuration:
    """Bisection of the duration between one that passes and one that does not."""
    say = console.progress
    turn = stage.inertia_turns[stage.moving[0]]
    best, coarsest = LeastDuration(OPTIMUM, None), 0
    low, high = OPTIMUM_FACTORS
    factor = high  # of J D/T^2 in the cap: the larger, the longer the duration

    for _ in range(OPTIMUM_SEARCHES):
        duration = float(np.sqrt(factor * turn / cap))
        tried = functools.partial(
            _tried, stage.lasting(duration), _SLACK * factor, coarsest, drive, cap, console
        )
        found = kept.step(f"{OPTIMUM} in {duration:.9g} s", tried, say=say)
        if found.least is None:
            low = factor
        else:
            best, high = found.least, factor
            # all that follow are shorter, with less to spare under the cap: a mesh that was too
            # coarse for this one is for them
            coarsest = found.intervals

        if best.duration is None:
            break  # not even the longest passes
        factor = 0.5 * (low + high)
    return best


@dataclass(frozen=True)
class _TriedDuration:
    """An optimum that passes, and the intervals of its mesh; None if it does not."""

    least: LeastDuration | None
    intervals: int = 0


def _tried(
    stage: Stage, capped: float, coarsest: int, drive: Drive, cap: float, console: Console
) -> _TriedDuration:
    """The optimum of one duration under a cap [J D/T^2], on meshes of so many intervals at least.

    `cap` is what the full model is held to [N m].
    """
    try:
        caps = stage.capped(capped)
        solver = StudySolver(live=console.live)
        motion = solve_stage(stage, caps=caps, at_least=coarsest, solver=solver)
        done = motion.replay(drive)
    except StudyError as error:
        console.progress(f"{stage.duration:.4g} s: {error}")
        return _TriedDuration(None)
    console.progress(
        f"optimum in {stage.duration:.4g} s: residual energy {done.residual_energy:.2e} J"
    )
    if not passes(done, cap):
        return _TriedDuration(None)
    return _TriedDuration(_least(OPTIMUM, done), motion.intervals)


def passes(done: LockedMotion | None, cap: float) -> bool:
    """Whether residual and torque are within the limits."""
    if done is None:
        return False
    peak = done.peak_torque[done.motion.stage.moving[0]]
    return bool(done.residual_energy <= RESIDUAL and peak <= cap * (1 + 1e-9))


def of_baseline(
    stage: Stage, name: str, drive: Drive, cap: float, console: Console
) -> LeastDuration:
    """First duration at which a baseline passes on the full model, where B21 comes near it."""
    found = _first_that_passes(stage, name, drive, cap, console.progress, console.live)
    console.progress(f"{name}: {number(found.duration)} s")
    return found


def _first_that_passes(
    stage: Stage, name: str, drive: Drive, cap: float, say: Say, live: Say
) -> LeastDuration:
    durations, laws = scanned(stage, name, drive, cap, live)
    seen = list[float]()

    def on_full_model(duration: float) -> LockedMotion | None:
        longer = stage.lasting(duration)
        try:
            law = baseline_law(longer, name, drive)
            done = replay_law(longer, law, drive, follow=False)
        except (StudyError, ModelError) as error:
            say(str(error))
            return None
        say(f"{name} in {duration:.5g} s: residual energy {done.residual_energy:.2e} J")
        seen.append(done.residual_energy)
        return done

    # part by part: most laws pass early, and the rest of the scan is spared
    asked, left = 0, np.empty(0)
    for first in range(0, len(laws), _PART):
        some = [law.law for law in laws[first : first + _PART]]
        live(f"{name}: durations from {durations[first]:.4g} s on B21")
        left = np.append(left, left_by_laws(stage, some, drive))
        dips = windows(durations[: len(left)], left, ended=len(left) == len(laws))
        for window in dips[asked:CANDIDATES]:
            done = first_pass(on_full_model, window, cap)
            if done is not None:
                return _least(name, done, done.residual_energy)
        asked = len(dips)
    return LeastDuration(name, None, lowest=min(seen, default=float(left.min())))


def scanned(
    stage: Stage, name: str, drive: Drive, cap: float, live: Say
) -> tuple[Array, list[NamedLaw]]:
    """Durations of the scan [s] and the laws there, from the shortest under the cap."""
    low, high = SHORTEST_SCANNED * stage.duration, LONGEST_SCANNED * stage.duration
    if needs_search(stage, name, drive):
        # each duration takes a search for the shaper's frequency: fewer of them
        durations = np.geomspace(low, high, 1 + int(np.log(high / low) / np.log(COARSE_RATIO)))
    else:
        first = _shortest(stage, name, drive, cap, (low, high))
        slow = locked_frequency(stage) if drive == "angle" else np.mean(free_frequencies(stage))
        durations = np.arange(first, high, 1.0 / (DURATIONS_A_BEAT * float(slow)))

    laws = []
    for T in durations.tolist():
        live(f"{name} in {T:.4g} s")
        laws.append(baseline_law(stage.lasting(T), name, drive))
    within = np.array([rigid_peak(stage, law) <= cap * (1 + 1e-9) for law in laws])
    return durations[within], [law for law, yes in zip(laws, within, strict=True) if yes]


def _shortest(
    stage: Stage, name: str, drive: Drive, cap: float, bracket: tuple[float, float]
) -> float:
    """Shortest duration of a law under the cap on the rigid arm [s]."""
    low, high = bracket
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        law = baseline_law(stage.lasting(middle), name, drive)
        low, high = (low, middle) if rigid_peak(stage, law) <= cap else (middle, high)
    return high


def windows(
    durations: Array, left: Array, *, ended: bool = True
) -> list[tuple[float, float, float]]:
    """Each dip of a scan that comes near the limit, with a duration before and one after it [s].

    The one before is where the scan was not yet near the limit, if no dip came since. A scan
    that has not ended may dip beyond its last duration.
    """
    dips: list[tuple[float, float, float]] = []
    began = 0  # where the residual was last far from the limit, or the last dip was
    for k, energy in enumerate(left if ended else left[:-1]):
        if energy > NEAR * RESIDUAL:
            began = k
            continue
        after = min(k + 1, len(left) - 1)
        if energy <= left[max(k - 1, 0)] and energy <= left[after]:
            dips.append((float(durations[began]), float(durations[k]), float(durations[after])))
            began = k
    return dips


def first_pass(
    on_full_model: Callable[[float], LockedMotion | None],
    window: tuple[float, float, float],
    cap: float,
) -> LockedMotion | None:
    """Replay at the minimum duration found to pass about a dip, None if none does.

    Near a dip the residual is a parabola of the duration: its bottom is found from three points.
    """
    tried = dict[float, LockedMotion | None]()
    for duration in sorted(set(window)):
        tried[duration] = on_full_model(duration)
        if passes(tried[duration], cap):
            break  # longer ones are not asked for

    if not any(passes(done, cap) for done in tried.values()):
        energies = {T: done.residual_energy for T, done in tried.items() if done is not None}
        if len(energies) < len(window):
            return None
        bottom = _bottom(np.array(list(energies)), np.array(list(energies.values())))
        tried[bottom] = on_full_model(bottom)

    best = min((T for T, done in tried.items() if passes(done, cap)), default=None)
    if best is None:
        return None
    # then the least that passes, between the best and the longest below it that was tried
    fails = max((T for T in tried if best > T), default=None)
    if fails is None:
        return tried[best]

    for _ in range(BISECTIONS):
        middle = 0.5 * (fails + best)
        tried[middle] = on_full_model(middle)
        best, fails = (middle, fails) if passes(tried[middle], cap) else (best, middle)
    return tried[best]


def _bottom(times: Array, left: Array) -> float:
    """Bottom of the parabola through three residuals, at most a window away [s]."""
    curve = np.polyfit(times - times[1], left, 2)
    width = 2 * (times[2] - times[1])
    shift = -curve[1] / (2 * curve[0]) if curve[0] > 0 else width * np.sign(-curve[1])
    return float(times[1] + np.clip(shift, -width, width))


def _least(name: str, done: LockedMotion, lowest: float = float("nan")) -> LeastDuration:
    stage = done.motion.stage
    torque = float(done.peak_torque[stage.moving[0]])
    return LeastDuration(name, stage.duration, done.residual_energy, torque, lowest)


def find_least_durations(
    study: LeastDurationStudy, console: Console, kept: FinishedSteps
) -> Result:
    """The minimum durations of the optimum and of every baseline."""
    stage, drive = study.slew, study.drive
    cap = torque_cap(stage, drive)
    durations = least_durations(stage, drive, cap, console, kept)

    rows = table_rows({law.name: _quantities(law) for law in durations})
    # the optimum stands first, unless it is missing
    stopped = durations[0].name != OPTIMUM
    best, others = (None, durations) if stopped else (durations[0].duration, durations[1:])
    remarks = [
        f"each has a residual energy of at most {RESIDUAL:g} J on the full ANCF model under "
        f"{cap:.5g} N m, the peak torque of the Bezier law in {stage.duration:g} s, {drive} drive",
        "the residual energy of a law rises and falls with its duration; for a baseline the first "
        "duration found that passes is listed, often in a narrow minimum",
    ]
    if not stopped:
        remarks += [f"{other.name}: {_beside(best, other)}" for other in others]
    return Result(
        kind="arm-least-duration",
        question=study.question,
        configuration=as_dictionary(study),
        table=rows,
        bounds={"rigid arm: duration [s]": stage.least_duration(cap)},
        verdict=Verdict("unverified", f"unverified: stopped with {len(others)} laws, no optimum")
        if stopped
        else _verdict(best, others),
        costs_elsewhere=costs_elsewhere(rows),
        remarks=tuple(remarks),
        details={"drive": drive, "torque_cap_Nm": cap, "residual_limit_J": RESIDUAL},
        provenance=provenance(),
        interrupted=stopped,
    )


def _quantities(law: LeastDuration) -> list[Metric]:
    duration = math.nan if law.duration is None else law.duration
    return [
        Metric("duration", "minimum duration", "s", duration),
        Metric("residual_energy", "residual energy", "J", law.residual),
        Metric("peak_torque", "peak torque", "N m", law.torque),
        Metric(
            "lowest_residual",
            "minimum residual energy found under the cap",
            "J",
            law.lowest,
            "neither",
        ),
    ]


def _verdict(best: float | None, others: list[LeastDuration]) -> Verdict:
    if best is None:
        return Verdict(
            "unverified", "unverified: no optimum was found whose residual energy is small enough"
        )
    if any(other.duration is not None and other.duration < best for other in others):
        return Verdict("unverified", "unverified: a law of the paper needs less time")
    return Verdict(
        "local",
        "local: the optimum has the shortest duration of all, on the meshes and scans tried",
    )


def _beside(best: float | None, baseline: LeastDuration) -> str:
    """How a baseline compares with the optimum, in words."""
    if baseline.duration is None:
        longest = f"none found up to {LONGEST_SCANNED:g} times the duration of the stage"
        return f"{longest}; minimum found {number(baseline.lowest, 2)} J"
    if best is None:
        return "NOT beaten: no optimum found"
    gain = 100.0 * (1.0 - best / baseline.duration)
    return f"optimum {gain:.3g} % shorter" if gain > 0 else f"NOT beaten, {-gain:.3g} % shorter"
