"""The optimum beside each baseline: same duration, same drive, no higher peak torque."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from models.ancf.integrator import Settings
from models.ancf.joint import Joint, Locked
from models.ancf.modes import natural_modes
from models.ancf.state import posed
from models.arm.reduced_run import reduced_modes, simulate_reduced
from models.errors import ModelError
from models.laws import Law
from studies.arm.optimum import Refined, capped, reduced_residual, refine, solve_stage
from studies.arm.replay import Drive, Motion, Replay, replay
from studies.arm.rigid import angle_drives, torque_drives
from studies.arm.stage import ELBOW, ROOT, Stage
from studies.arm.unit_laws import NamedLaw, ShaperKind, baselines, shaped_bang_bang
from studies.console import Table, number
from studies.exit_codes import StudyError

Say = Callable[[str], None]
Array = NDArray[np.float64]
_TRIES = 11  # constants tried for a frequency that varies along the stage
_HIGHEST = 7.5  # cap [J D/T^2] above which a looser one brings nothing, Step5's own
_COARSE = Settings(1e-7)
_FINE = Settings(1e-9)


@dataclass(frozen=True, eq=False)
class Pair:
    """A baseline and the optimum of no higher peak torque, under one drive.

    Attributes
    ----------
    baseline, optimum : replays; the optimum None where none was found.
    limit : share of the baseline's E_res that the optimum may leave, by the issue.
    """

    baseline: Replay
    optimum: Replay | None
    refined: Refined | None
    limit: float

    @property
    def ratio(self) -> float:
        """E_res of the optimum over the baseline's."""
        if self.optimum is None:
            return math.nan
        return self.optimum.residual_energy / self.baseline.residual_energy

    @property
    def holds(self) -> bool:
        """Whether the residual is within the limit at no higher peak torque."""
        if self.optimum is None:
            return False
        peaks = [r.peak_torque[list(r.motion.stage.moving)] for r in (self.optimum, self.baseline)]
        return self.ratio <= self.limit and bool((peaks[0] <= peaks[1] * (1 + 1e-9)).all())


def locked_frequency(stage: Stage) -> float:
    """First frequency of the arm locked at the stage's end [Hz]: the angle drive's."""
    chain = stage.arm.chain(8)
    rest = posed(chain, list(stage.end))
    joints = [Locked(angle) for angle in stage.end]
    return float(natural_modes(chain, joints, rest, count=1).frequencies[0])


def free_frequencies(stage: Stage) -> tuple[float, float]:
    """Least and largest first frequency of the joints left free along the stage [Hz]."""
    found = []
    for share in np.linspace(0.0, 1.0, 25):
        angles = np.array(stage.start) + share * stage.turn
        found.append(reduced_modes(stage.model, stage.model.at(*angles))[0][0])
    return float(min(found)), float(max(found))


def shaper_frequency(stage: Stage, kind: ShaperKind, drive: Drive) -> float:
    """Frequency of a shaper: the locked one under angle drive; else the best constant."""
    if drive == "angle":
        return locked_frequency(stage)
    low, high = free_frequencies(stage)
    if high - low < 1e-6 * high:
        return high

    def left(frequency: float) -> float:
        return reduced_baseline(stage, shaped_bang_bang(stage.duration, frequency, kind))

    shortest = {"ZV": 0.5, "ZVD": 1.0}[kind] / (0.8 * stage.duration)
    tried = np.geomspace(max(low, shortest), high, _TRIES)
    values = [left(f) for f in tried]
    best = int(np.argmin(values))
    around = tried[max(best - 1, 0)], tried[min(best + 1, _TRIES - 1)]
    finer = minimize_scalar(left, bounds=around, method="bounded", options={"maxiter": 5})
    return float(finer.x if finer.fun < values[best] else tried[best])


def reduced_baseline(stage: Stage, law: Law) -> float:
    """E_res on B21 of a law under torque drive [J]."""
    drives = torque_drives(stage, law)
    motion = simulate_reduced(
        stage.model, stage.model.at(*stage.start), np.array([0.0, stage.duration]),
        root=drives.get(ROOT), elbow=drives.get(ELBOW), tolerance=1e-6,
    )  # fmt: skip
    return reduced_residual(stage, motion)


def baseline_laws(stage: Stage, drive: Drive, say: Say) -> list[NamedLaw]:
    """All baselines of a stage under a drive; linear torque under torque drive only."""
    found = baselines(stage.duration, 10.0 / stage.duration, linear=drive == "torque")
    for place, law in enumerate(found):
        kind: ShaperKind
        for kind in ("ZV", "ZVD"):
            if law.name == kind:
                f = shaper_frequency(stage, kind, drive)
                say(f"{stage.name}, {drive} drive: {kind} shaper of {f:.4g} Hz")
                shaped = shaped_bang_bang(stage.duration, f, kind)
                found[place] = NamedLaw(f"{kind} {f:.3f} Hz", shaped, True)
    return found


def replay_law(stage: Stage, law: NamedLaw, drive: Drive) -> Replay:
    """A baseline on the full model."""
    drives: dict[int, Joint] = {}
    drives |= (torque_drives if drive == "torque" else angle_drives)(stage, law.law)
    motion = Motion(law.name, drive, stage, drives, law.jumps)
    try:
        return replay(motion, settings=None if law.jumps else _FINE, after=after_lock(stage))
    except ModelError:
        return replay(motion, settings=_COARSE, after=after_lock(stage))


def after_lock(stage: Stage) -> Array:
    """Instants after the lock that the figures show, a quarter of the stage [s]."""
    return np.linspace(stage.duration, 1.25 * stage.duration, 251)


def compare(
    stage: Stage, drive: Drive, limit: float, say: Say, motions: dict[float, Refined] | None = None
) -> list[Pair]:
    """Every baseline with an optimum of no higher peak torque, looser caps first.

    `motions` keeps what was solved, by cap; a tighter motion also serves a looser cap.
    """
    motions = {} if motions is None else motions
    replays = [replay_law(stage, law, drive) for law in baseline_laws(stage, drive, say)]
    pairs = []
    for baseline in sorted(replays, key=lambda r: -r.peak_torque[stage.moving[0]]):
        found = motion_under(stage, baseline, drive, motions, say)
        if found is None:
            pairs.append(Pair(baseline, None, None, limit))
            continue
        best = found.replay if drive == "torque" else found.solved.replay("angle")
        pairs.append(Pair(baseline, best, found, limit))
    return pairs


def motion_under(
    stage: Stage, baseline: Replay, drive: Drive, motions: dict[float, Refined], say: Say
) -> Refined | None:
    """A refined motion whose peak torque does not exceed the baseline's."""
    k = stage.moving[0]
    units = stage.torque_units
    caps = [float(baseline.peak_torque[j] / units[j]) for j in stage.moving]
    cap = min(_HIGHEST, *caps)
    fitting = [c for c in motions if c <= cap and c > 0.97 * cap]
    if fitting:
        return motions[max(fitting)]
    if drive == "angle":
        cap *= 0.999  # the reaction of the full model is not exactly the torque of B21
    try:
        solved = solve_stage(stage, limits=capped(stage, cap), name="optimum")
    except StudyError as error:
        say(f"{stage.name}, at most {cap:.4g} J D/T^2 on joint {k}: {error}")
        return None
    motions[cap] = refine(solved, capped(stage, cap), say=say)
    return motions[cap]


def table(stage: Stage, drive: Drive, pairs: Sequence[Pair]) -> Table:
    """What the pairs show, in figures."""
    notes = [
        f"limit of the ratio: {pairs[0].limit:g}; amplitudes are those the first three locked "
        "modes can reach together"
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
