"""The optimum beside each baseline: same duration, same drive, no higher peak torque."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from models.ancf.analysis import LockedRun
from models.ancf.joints import Joint
from models.errors import ModelError
from studies.arm.config import BaselinesStudy, as_dictionary
from studies.arm.laws.rigid import angle_drives, torque_drives
from studies.arm.laws.shapers import baseline_law, baseline_names, shaper_note
from studies.arm.laws.unit_laws import NamedLaw
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.optimal.phase import is_slow
from studies.arm.optimal.refinement import FLOOR, Refined, refine
from studies.arm.optimal.solve import solve_stage
from studies.arm.optimal.study_solver import Say, StudySolver
from studies.arm.replay.full_model import (
    JUMPS,
    QUICK,
    SMOOTH,
    Drive,
    LockedMotion,
    Motion,
    after_lock,
    followed,
    replay,
)
from studies.arm.replay.numerical_floor import numerical_floor
from studies.arm.replay.sampled import SampledProfile, sampled_to
from studies.arm.report.profile import exported_motions, profile_check, profiles_series
from studies.arm.report.quantities import Metric, latch_checks, table_rows
from studies.arm.report.traces import Trace
from studies.arm.search_limits import HIGHEST_CAP, JUMP_STEPS
from studies.arm.stage import JOINT_NAMES, Stage
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.common.stops import kept_anyway

OPTIMUM = "optimum"
SHARES = {"big": 0.01, "small": 0.03, "both": 0.03}  # of a baseline's E_res
_FOLLOWED = 251  # instants after the lock that the figures show
_SLACK = 0.998  # of a cap, for peaks between the points and a reaction that is not B21's torque
_ALIKE = 0.97  # of a cap, above which a motion under a tighter one also serves the looser one


@dataclass(frozen=True, eq=False)
class Pair:
    """A baseline and the optimum of no higher peak torque, under one drive.

    Attributes
    ----------
    baseline : its replay.
    refined : how the optimum was found, None where none was.
    limit : share of the baseline's E_res that the optimum may leave, None where that is so near
        the numerical floor that a ratio means nothing and the optimum has `FLOOR` to stay under.
    """

    baseline: LockedMotion
    refined: Refined | None
    limit: float | None

    @property
    def optimum(self) -> LockedMotion | None:
        """Its replay, None where none was found."""
        return None if self.refined is None else self.refined.replay

    @property
    def ratio(self) -> float:
        """E_res of the optimum over the baseline's, nan where it means nothing."""
        if self.optimum is None or self.limit is None:
            return math.nan
        return self.optimum.residual_energy / self.baseline.residual_energy

    @property
    def resolved(self) -> bool:
        """Whether a finer mesh changes no more, and the optimum is still enough.

        One motion may be asked to leave less than its law allows: a share of what the
        stillest of all laws leaves.
        """
        refined = self.refined
        return refined is not None and refined.settled and (refined.still or self.holds)

    @property
    def holds(self) -> bool:
        """Whether the residual is within the limit at no higher peak torque."""
        if self.optimum is None:
            return False
        if self.limit is None:
            still = self.optimum.residual_energy <= FLOOR
        else:
            still = self.ratio <= self.limit

        moving = list(self.baseline.motion.stage.moving)
        highest = self.baseline.peak_torque[moving] * (1 + 1e-9)
        return still and bool((self.optimum.peak_torque[moving] <= highest).all())


def motion_along(stage: Stage, law: NamedLaw, drive: Drive) -> Motion:
    """What drives the joints of a stage along a law."""
    joints: dict[int, Joint] = {}
    joints |= (torque_drives if drive == "torque" else angle_drives)(stage, law.law)
    return Motion(law.name, drive, stage, joints, law.jumps)


def replay_law(stage: Stage, law: NamedLaw, drive: Drive, *, follow: bool = True) -> LockedMotion:
    """A baseline on the full model, and the motion it leaves if that is to be followed.

    The finest tolerance is for slow stages, whose laws leave hardly anything. Laws that jump take
    the longest fixed step that converges: with steps of any length their fast modes take minutes.
    """
    motion = motion_along(stage, law, drive)
    after = after_lock(stage, _FOLLOWED) if follow else None

    if law.jumps:
        tries = [dataclasses.replace(JUMPS, fixed_step=step) for step in JUMP_STEPS]
    else:
        tries = [SMOOTH] if is_slow(stage) else []
    for settings in tries:
        with suppress(ModelError):
            return replay(motion, settings=settings, after=after)
    return replay(motion, settings=QUICK, after=after)


def compare(stage: Stage, drive: Drive, limit: float | None, solver: StudySolver) -> list[Pair]:
    """Every baseline with an optimum of no higher peak torque, looser caps first.

    A tighter motion also serves a looser cap. Where the user stops it there are fewer pairs, but
    one at least.
    """
    replays = []
    for name in baseline_names(drive):
        solver.live(f"{name} on the full model")
        law = baseline_law(stage, name, drive)

        def replayed(law: NamedLaw = law) -> LockedRun:
            return replay_law(stage, law, drive).fixed

        run = solver.kept.step(law.name, replayed, say=solver.say)
        replays.append(LockedMotion(motion_along(stage, law, drive), run))
        left = replays[-1].residual_energy
        solver.say(f"{stage.name}, {drive} drive: {law.name} has a residual energy of {left:.2e} J")

    # still enough for whatever law leaves least
    least = min(replayed.residual_energy for replayed in replays)
    residual = max(FLOOR, min(RESIDUAL, least if limit is None else limit * least))
    motions: dict[float, Refined] = {}
    pairs = []
    try:
        for baseline in sorted(replays, key=lambda r: -r.peak_torque[stage.moving[0]]):
            refined = motion_under(stage, baseline, motions, residual, solver)
            pairs.append(Pair(baseline, refined, limit))
    except KeyboardInterrupt:
        if not pairs:
            raise
    return pairs


def motion_under(
    stage: Stage,
    baseline: LockedMotion,
    motions: dict[float, Refined],
    residual: float,
    solver: StudySolver,
) -> Refined | None:
    """A refined motion whose peak torque does not exceed the baseline's.

    `motions` are those already found, by cap [J D/T^2]; a new one is added. It may leave a
    residual [J] on the full model.
    """
    units = stage.torque_units
    cap = min(HIGHEST_CAP, *(float(baseline.peak_torque[k] / units[k]) for k in stage.moving))

    fitting = [c for c in motions if c <= cap and c > _ALIKE * cap]
    if fitting:
        return motions[max(fitting)]

    caps, drive = stage.capped(_SLACK * cap), baseline.motion.drive
    try:
        motion = solve_stage(stage.under(drive), caps=caps, solver=solver)
    except StudyError as error:
        solver.say(f"{stage.name}, at most {cap:.4g} J D/T^2 on joint {stage.moving[0]}: {error}")
        return None
    motions[cap] = refine(motion, residual=residual, drive=drive, solver=solver)
    return motions[cap]


def compare_baselines(
    study: BaselinesStudy,
    console: Console,
    kept: FinishedSteps = NOTHING_KEPT,
) -> Result:
    """An optimum of no higher peak torque beside each baseline."""
    stage = study.slew
    limit = None if is_slow(stage) else SHARES[stage.name]
    solver = StudySolver(console.progress, console.live, kept)
    pairs = compare(stage, study.drive, limit, solver)
    stopped = len(pairs) < len(baseline_names(study.drive))

    def result(whole: bool) -> Result:
        profiles = _profiles(pairs, console.live, kept) if whole else {}
        arrays = _arrays(pairs, profiles) if whole else {}
        return _result(study, pairs, profiles, arrays)

    return kept_anyway(result, stopped)


def _result(
    study: BaselinesStudy,
    pairs: Sequence[Pair],
    profiles: Mapping[str, SampledProfile],
    arrays: Mapping[str, Series],
) -> Result:
    stage, limit = study.slew, pairs[0].limit

    # a column for each law, with its own optimum below it
    columns = {pair.baseline.motion.name: _quantities(pair) for pair in pairs}
    latches: list[Criterion] = []
    if study.latch is not None:
        motions = [m for pair in pairs for m in (pair.baseline, pair.optimum) if m is not None]
        latches = [check for motion in motions for check in latch_checks(motion, study.latch)]

    remarks = ["amplitudes are the largest that the first three locked modes can reach together"]
    remarks.append(shaper_note(stage, study.drive))
    tightest = pairs[-1]
    if limit is None and tightest.optimum is not None:
        remarks.append(str(numerical_floor(tightest.optimum.motion)))

    return Result(
        kind="arm-baselines",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=arrays,
        table=table_rows(columns),
        verdict=_verdict(pairs, len(baseline_names(study.drive))),
        checks=(
            *(_holds(pair) for pair in pairs),
            *(
                profile_check(profile, _allowed(profile), f"the optimum {name}")
                for name, profile in profiles.items()
            ),
            *latches,
        ),
        remarks=tuple(remarks),
        details={
            "stage": {"duration": stage.duration, "start": stage.start, "end": stage.end},
            "drive": study.drive,
            "profile_of": f"{OPTIMUM} {_beside(tightest)}",
            **exported_motions(profiles),
            "limit": limit,
            "rounds": {
                pair.baseline.motion.name: [
                    dataclasses.asdict(entry) for entry in pair.refined.rounds
                ]
                for pair in pairs
                if pair.refined is not None
            },
        },
        provenance=provenance(),
    )


def _quantities(pair: Pair) -> list[Metric]:
    """What a baseline leaves, and what its optimum leaves."""
    baseline, optimum = pair.baseline, pair.optimum
    vibration, moving = baseline.vibration, baseline.motion.stage.moving

    def peaks(replayed: LockedMotion | None, head: str) -> list[Metric]:
        return [
            _of_pair(
                f"{head}peak_{JOINT_NAMES[k]}_torque",
                f"{head.replace('_', ': ')}peak {JOINT_NAMES[k]} torque",
                "N m",
                math.nan if replayed is None else float(replayed.peak_torque[k]),
            )
            for k in moving
        ]

    left = math.nan if optimum is None else optimum.residual_energy
    on_B21 = math.nan if pair.refined is None else pair.refined.motion.reduced_energy
    return [
        *peaks(baseline, ""),
        _of_pair("residual_energy", "residual energy", "J", baseline.residual_energy),
        _of_pair("tip_amplitude", "amplitude of the tip", "m", vibration.tip),
        _of_pair("elbow_amplitude", "amplitude of the elbow", "m", vibration.elbow),
        _of_pair("root_moment", "amplitude of the root moment", "N m", vibration.root_moment),
        _of_pair("angle_miss", "angle miss at the lock", "rad", baseline.miss),
        *peaks(optimum, "optimum_"),
        _of_pair("optimum_residual_energy", "optimum: residual energy", "J", left),
        _of_pair("optimum_on_B21", "optimum: residual energy on B21", "J", on_B21),
        _of_pair(
            "ratio", "residual energy of the optimum relative to that of the law", "1", pair.ratio
        ),
    ]


def _of_pair(key: str, title: str, unit: str, value: float) -> Metric:
    """The columns are laws, each beside its own optimum: none is compared with another."""
    return Metric(key, title, unit, value, better="neither")


def _holds(pair: Pair) -> Criterion:
    """Whether an optimum is as still as asked at no higher peak torque."""
    name, optimum = pair.baseline.motion.name, pair.optimum
    if optimum is None:
        return Criterion(name, "J", math.nan, math.nan, False, f"FAILED: {name}: no optimum found")

    # at the paper's pace nearly nothing is left, and a ratio of two such energies means nothing
    verdict = "verified" if pair.holds else "FAILED"
    if pair.limit is None:
        value, limit, unit = optimum.residual_energy, FLOOR, "J"
        what = (
            f"the residual energy of the optimum is {value:.2e} J, limit {FLOOR:g} J, near the "
            "numerical floor"
        )
    else:
        value, limit, unit = pair.ratio, pair.limit, "1"
        what = (
            f"the residual energy of the optimum is {value:.2g} times that of the law, limit "
            f"{limit:g}"
        )

    sentence = f"{verdict}: {name}: {what}, at no higher peak torque"
    return Criterion(name, unit, value, limit, pair.holds, sentence)


def _verdict(pairs: Sequence[Pair], laws: int) -> Verdict:
    if len(pairs) < laws:
        return Verdict(
            "unverified", f"unverified: stopped with an optimum for {len(pairs)} of {laws} laws"
        )
    # an optimum whose mesh is too coarse may owe its stillness to the mesh
    if loose := [pair.baseline.motion.name for pair in pairs if not pair.resolved]:
        return Verdict(
            "unverified",
            f"unverified: for {' and '.join(loose)}, no optimum was found whose residual energy "
            "is small enough and does not change on a finer mesh",
        )
    every = "every" if all(pair.holds for pair in pairs) else "NOT every"
    return Verdict(
        "local", f"local: {every} optimum has the required residual energy compared with its law"
    )


def _profiles(
    pairs: Sequence[Pair], live: Say, kept: FinishedSteps = NOTHING_KEPT
) -> dict[str, SampledProfile]:
    """The sampled optima by the laws that they stand beside, that of the tightest cap first."""
    sampled: dict[int, SampledProfile] = {}
    profiles = {}
    for pair in reversed(pairs):
        if pair.refined is None or pair.optimum is None:
            continue
        # a motion may stand beside several laws
        key = id(pair.refined)
        if key not in sampled:
            live(f"the optimum {_beside(pair)}, sampled")
            steps = kept.within(_beside(pair))
            sampled[key] = sampled_to(pair.optimum, pair.refined.residual, kept=steps)
        profiles[_beside(pair)] = sampled[key]
    return profiles


def _allowed(profile: SampledProfile) -> float:
    """What a sampled optimum may leave [J]: as much as any motion, or what it leaves itself."""
    return max(RESIDUAL, profile.exact.residual_energy)


def _beside(pair: Pair) -> str:
    """What an optimum's profile is called."""
    return f"beside {pair.baseline.motion.name}"


def _arrays(pairs: Sequence[Pair], profiles: Mapping[str, SampledProfile]) -> dict[str, Series]:
    """The profiles of all optima, the motion under the tightest cap, and all baselines."""
    arrays, last = profiles_series(profiles), pairs[-1]
    if last.optimum is not None:
        stage = last.baseline.motion.stage
        arrays |= Trace.of(followed(last.optimum, after_lock(stage, _FOLLOWED)), OPTIMUM).series()
    for pair in pairs:
        arrays |= Trace.of(pair.baseline).series()
    return arrays
