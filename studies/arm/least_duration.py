"""Least durations that leave at most a given residual energy under one torque cap.

The cap is the Bezier law's peak torque over the stage's own duration. Residuals oscillate with
the duration: a baseline's figure is the first duration found on a fine scan, refined by
bisection, so that narrow dips between the points of the scan may be missed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from models.laws import peaks
from studies.arm.compare import baseline_laws, replay_law
from studies.arm.optimum import capped, solve_stage
from studies.arm.replay import Replay
from studies.arm.stage import Stage
from studies.arm.unit_laws import bezier
from studies.console import Table, number
from studies.exit_codes import StudyError

Say = Callable[[str], None]
RESIDUAL = 1e-6  # [J], the issue's
FACTORS = (5.0, 4.7, 4.5, 4.35)  # caps in J D/T^2 at which the optimum is tried, slowest first
SCAN = 1.03  # ratio of neighbouring durations of the scan
LONGEST = 3.0  # times the stage's duration at which the scan gives up
BISECTIONS = 6


@dataclass(frozen=True)
class Least:
    """Least duration [s] found, None if none was; residual [J] and peak torque [N m] there."""

    name: str
    duration: float | None
    residual: float = float("nan")
    torque: float = float("nan")


def torque_cap(stage: Stage) -> float:
    """Peak torque of the Bezier law over the stage's duration [N m]."""
    k = stage.moving[0]
    unit = peaks(bezier(stage.duration)).acceleration
    return float(stage.inertias[k] * abs(stage.turn[k]) * unit)


def least_durations(stage: Stage, say: Say) -> list[Least]:
    """The optimum and every baseline under torque drive."""
    cap = torque_cap(stage)
    found = [of_optimum(stage, cap, say)]
    for place in range(len(baseline_laws(stage, "torque", say))):
        found.append(of_baseline(stage, place, cap, say))
        say(f"{found[-1].name}: {number(found[-1].duration)} s")
    return found


def of_optimum(stage: Stage, cap: float, say: Say) -> Least:
    """Shorter and shorter until the residual, the torque or the solver forbids it."""
    k = stage.moving[0]
    best = Least("optimum", None)
    for factor in FACTORS:
        T = float(np.sqrt(factor * stage.inertias[k] * abs(stage.turn[k]) / cap))
        shorter = stage.lasting(T)
        try:
            done = solve_stage(shorter, limits=capped(shorter, factor)).replay()
        except StudyError as error:
            say(f"{T:.4g} s: {error}")
            break
        say(f"optimum in {T:.4g} s leaves {done.residual_energy:.2e} J")
        if done.residual_energy > RESIDUAL or done.peak_torque[k] > cap:
            break
        best = _least("optimum", done)
    return best


def of_baseline(stage: Stage, place: int, cap: float, say: Say) -> Least:
    """First duration of a scan at which a baseline passes, then bisected; `place` in the list."""
    k, name, before = stage.moving[0], "", None
    for T in _scan(stage):
        name, done = _run(stage, T, place, say)
        if done is not None and done.residual_energy <= RESIDUAL and done.peak_torque[k] <= cap:
            best, low, high = done, before or T, T
            for _ in range(BISECTIONS if before else 0):
                middle = 0.5 * (low + high)
                again = _run(stage, middle, place, say)[1]
                passed = again is not None and again.residual_energy <= RESIDUAL
                if again is not None and passed and again.peak_torque[k] <= cap:
                    best, high = again, middle
                else:
                    low = middle
            return _least(name, best)
        before = T
    return Least(name, None)


def _scan(stage: Stage) -> Iterator[float]:
    T = 0.8 * stage.duration
    while LONGEST * stage.duration >= T:
        yield T
        T *= SCAN


def _run(stage: Stage, T: float, place: int, say: Say) -> tuple[str, Replay | None]:
    shorter = stage.lasting(T)
    law = baseline_laws(shorter, "torque", lambda _: None)[place]
    try:
        return law.name, replay_law(shorter, law, "torque")
    except StudyError as error:
        say(str(error))
        return law.name, None


def _least(name: str, done: Replay) -> Least:
    stage = done.motion.stage
    torque = float(done.peak_torque[stage.moving[0]])
    return Least(name, stage.duration, done.residual_energy, torque)


def table(stage: Stage, found: list[Least]) -> Table:
    """The least durations as a table."""
    return Table(
        f"{stage.name} arm: least duration with E_res <= {RESIDUAL:g} J under "
        f"{torque_cap(stage):.5g} N m",
        ("law", "duration [s]", "E_res [J]", "peak torque [N m]"),
        [(x.name, number(x.duration), number(x.residual, 3), number(x.torque)) for x in found],
        (f"a dash: none up to {LONGEST:g} times {stage.duration:g} s; rigid limit 2 sqrt(J D/tau) "
         f"= {stage.least_duration(torque_cap(stage)):.4g} s",),
    )  # fmt: skip
