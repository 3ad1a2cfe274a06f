"""The optimum beside each baseline: same duration, same drive, no higher peak torque."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.ancf.integrate import StepControl
from models.ancf.joints import Joint
from models.errors import ModelError
from studies.arm.laws.baselines import baseline_law, baseline_names, shaper_note
from studies.arm.laws.rigid import angle_drives, torque_drives
from studies.arm.laws.unit_laws import NamedLaw
from studies.arm.optimal.phase import is_slow
from studies.arm.optimal.solve import FLOOR, Refined, capped, refine, solve_stage
from studies.arm.replay.full import JUMPS, SMOOTH, Drive, Motion, Replay, replay
from studies.arm.stage import Stage
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError

Say = Callable[[str], None]
Array = NDArray[np.float64]
_HIGHEST = 7.5  # cap [J D/T^2] above which a looser one brings nothing, Step5's own
_SLACK = 0.998  # of a cap, for peaks between the points and a reaction that is not B21's torque
QUICK = StepControl(1e-7)
_STEPS = (0.004, 0.002, 0.001, 0.0005)  # [s]


@dataclass(frozen=True, eq=False)
class Pair:
    """A baseline and the optimum of no higher peak torque, under one drive.

    Attributes
    ----------
    baseline, optimum : replays; the optimum None where none was found.
    limit : share of the baseline's E_res that the optimum may leave, None where that is so near
        the numerical floor that a ratio means nothing and the optimum has `FLOOR` to stay under.
    """

    baseline: Replay
    optimum: Replay | None
    refined: Refined | None
    limit: float | None

    @property
    def ratio(self) -> float:
        """E_res of the optimum over the baseline's, nan where it means nothing."""
        if self.optimum is None or self.limit is None:
            return math.nan
        return self.optimum.residual_energy / self.baseline.residual_energy

    @property
    def holds(self) -> bool:
        """Whether the residual is within the limit at no higher peak torque."""
        if self.optimum is None:
            return False
        peaks = [r.peak_torque[list(r.motion.stage.moving)] for r in (self.optimum, self.baseline)]
        still = (
            self.optimum.residual_energy <= FLOOR
            if self.limit is None
            else (self.ratio <= self.limit)
        )
        return still and bool((peaks[0] <= peaks[1] * (1 + 1e-9)).all())


def replay_law(stage: Stage, law: NamedLaw, drive: Drive, *, follow: bool = True) -> Replay:
    """A baseline on the full model, and the motion it leaves if that is to be followed.

    The finest tolerance is for slow stages, whose laws leave hardly anything. Laws that jump take
    the longest fixed step that converges: with steps of any length their fast modes take minutes.
    """
    drives: dict[int, Joint] = {}
    drives |= (torque_drives if drive == "torque" else angle_drives)(stage, law.law)
    motion = Motion(law.name, drive, stage, drives, law.jumps)
    after = after_lock(stage) if follow else None
    tries = [SMOOTH] if is_slow(stage) else []
    if law.jumps:
        tries = [dataclasses.replace(JUMPS, fixed_step=step) for step in _STEPS]
    for settings in tries:
        with suppress(ModelError):
            return replay(motion, settings=settings, after=after)
    return replay(motion, settings=QUICK, after=after)


def after_lock(stage: Stage) -> Array:
    """Instants after the lock that the figures show, a quarter of the stage [s]."""
    return np.linspace(stage.duration, 1.25 * stage.duration, 251)


def compare(
    stage: Stage, drive: Drive, limit: float | None, say: Say, *, follow: bool = False
) -> list[Pair]:
    """Every baseline with an optimum of no higher peak torque, looser caps first.

    A tighter motion also serves a looser cap. `follow` also computes what the baselines leave.
    """
    motions: dict[float, Refined] = {}
    replays = []
    for name in baseline_names(drive):
        law = baseline_law(stage, name, drive)
        replays.append(replay_law(stage, law, drive, follow=follow))
        say(f"{stage.name}, {drive} drive: {law.name} leaves {replays[-1].residual_energy:.2e} J")
    pairs = []
    for baseline in sorted(replays, key=lambda r: -r.peak_torque[stage.moving[0]]):
        found = motion_under(stage, baseline, motions, say)
        if found is None:
            pairs.append(Pair(baseline, None, None, limit))
            continue
        best = found.replay if drive == "torque" else found.solved.replay("angle")
        pairs.append(Pair(baseline, best, found, limit))
    return pairs


def motion_under(
    stage: Stage, baseline: Replay, motions: dict[float, Refined], say: Say
) -> Refined | None:
    """A refined motion whose peak torque does not exceed the baseline's."""
    k = stage.moving[0]
    units = stage.torque_units
    caps = [float(baseline.peak_torque[j] / units[j]) for j in stage.moving]
    cap = min(_HIGHEST, *caps)
    fitting = [c for c in motions if c <= cap and c > 0.97 * cap]
    if fitting:
        return motions[max(fitting)]
    limits = capped(stage, _SLACK * cap)
    try:
        solved = solve_stage(stage, limits=limits, name="optimum")
    except StudyError as error:
        say(f"{stage.name}, at most {cap:.4g} J D/T^2 on joint {k}: {error}")
        return None
    motions[cap] = refine(solved, limits, say=say)
    return motions[cap]


def table(stage: Stage, drive: Drive, pairs: Sequence[Pair]) -> Table:
    """What the pairs show, in figures."""
    limit = pairs[0].limit
    asked = f"limit of the optimum's E_res: {FLOOR:g} J, so near the numerical floor that ratios "
    asked += "mean nothing"
    notes = [
        asked if limit is None else f"limit of the ratio: {limit:g}",
        "amplitudes are those the first three locked modes can reach together",
        shaper_note(stage, drive),
    ]
    if any(p.refined is not None and not p.refined.agrees for p in pairs):
        notes.append("mesh: the optimum's replay on B21 is not yet small beside the full model's")
    return Table(
        f"{stage.name} arm, {stage.duration:g} s, {drive} drive, full ANCF model, "
        "8 elements a link",
        (
            "baseline", "peak [N m]", "E_res [J]", "tip [m]", "elbow [m]", "root moment [N m]",
            "miss [rad]", "optimum: peak", "E_res [J]", "on B21 [J]", "ratio", "",
        ),
        [_row(pair) for pair in pairs],
        notes,
    )  # fmt: skip


def _row(pair: Pair) -> list[str]:
    b, o = pair.baseline, pair.optimum
    moving = list(b.motion.stage.moving)
    cells = [b.motion.name, _peaks(b, moving), number(b.residual_energy, 3)]
    cells += [number(x, 3) for x in (b.tip_amplitude, b.elbow_amplitude, b.moment_amplitude)]
    cells.append(number(b.miss, 2))
    if o is None or pair.refined is None:
        return [*cells, "-", "-", "-", "-", "none found"]
    verdict = ("holds" if pair.holds else "FAILS") + ("" if pair.refined.agrees else ", mesh")
    own = number(pair.refined.rounds[-1][1], 2)
    left = number(o.residual_energy, 3)
    return [*cells, _peaks(o, moving), left, own, number(pair.ratio, 2), verdict]


def _peaks(replayed: Replay, moving: list[int]) -> str:
    return " / ".join(number(float(replayed.peak_torque[k]), 4) for k in moving)
