"""A profile of the arm, by angles or by torques: replayed on the full model, and what it leaves.

Nothing of the profile is optimised. It is set beside the smoothest motion of the same stage, in the
same time and under the same caps, and beside the paper's two laws.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from models.ancf.joints import Driven, Joint, Torque
from models.errors import ModelError
from ocp.arrays import Array
from studies.arm.config import ArmStudy, as_dictionary, study_from
from studies.arm.laws.unit_laws import unit_law
from studies.arm.optimal.solve import check_bending, solve_stage
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.questions.baselines import replay_law
from studies.arm.replay.full_model import (
    Drive,
    LockedMotion,
    Motion,
    followed,
    replay,
    steps_for,
)
from studies.arm.replay.loads import loads
from studies.arm.report.quantities import (
    caps_by_quantity,
    latch_checks,
    quantities_of,
    table_rows,
    wheel_checks,
)
from studies.arm.report.traces import Trace
from studies.arm.stage import JOINT_NAMES, Stage
from studies.check.judgement import PROFILE, judged
from studies.check.reading.profile import MeasuredProfile
from studies.check.reading.table import refusal, refuse
from studies.check.smoothing.recovery import Recovered, how_smoothed, recover
from studies.common.comparison_table import TableRow
from studies.common.configuration import as_number, choice, nearest
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.result import Criterion, Result, Series, outcome

OPTIMUM = "optimum"
LAWS = ("Step5", "Bezier")
LATCH = 0.01  # [rad], 0.6 deg: what a joint may miss its end by where no latch is stated
START = 0.01  # [rad] by which an angle may start off the stage's own; it is shifted by it
MOVES = 1e-3  # of the largest column: below it a joint counts as still
TORQUE_NOISE = 1e-3  # of the peak torque, below which rows are taken as exact
# part of what the smoothed torque misses the file's own angles by, for exact rows; noise of 0.3 %
# of the peak makes both miss them alike, and an optimal torque sampled every 0.02 s takes a tenth
EXACT = 1 / 3
RESOLVED = 0.05  # of the peak torque: with all rows a spline is off by a sixteenth of it
CAP_EXCESS = 1e-3  # of a cap, relative: what rows between the peaks may hide
AFTER = 401  # instants of the quarter of a stage that is followed after the lock
WORTH_SAYING = ("residual_energy", "peak_root_torque", "peak_elbow_torque", "peak_root_moment")


@dataclass(frozen=True, eq=False)
class DrivingColumns:
    """The columns by which a profile drives the joints that turn.

    Attributes
    ----------
    kind : "torque" or "angle".
    values : (m,) of each joint, as in the file [N m] or [rad].
    recovered : the motion behind each.
    smoothed : whether that is taken in place of the rows.
    """

    kind: Drive
    values: Mapping[int, Array]
    recovered: Mapping[int, Recovered]
    smoothed: Mapping[int, bool]

    @property
    def unit(self) -> str:
        """Of all columns."""
        return {"torque": "N m", "angle": "rad"}[self.kind]


def arm_study(
    measured: MeasuredProfile, raw: Mapping[str, Any], stage: str | None, torque_cap: str | None
) -> ArmStudy:
    """The study of a profile of the arm: its stage from the columns that move, if none is stated.

    Raises
    ------
    StudyError
        Naming the key or flag, its value and the remedy.
    """
    stated: dict[str, Any] = {**raw, "duration": measured.duration}
    if stage is not None:
        stated["stage"] = stage
    if "stage" not in stated:
        stated["stage"] = _stage_of(measured.values)
    if torque_cap is not None:
        stated["torque_cap"] = as_number(torque_cap)
    sample = min(float(stated.get("sample_time", 0.1)), measured.duration)
    return study_from({**stated, "sample_time": sample})


def _stage_of(values: Mapping[str, Array]) -> str:
    """The stage in which the joints turn whose angle or torque changes."""
    span = {name: float(np.ptp(array)) for name, array in values.items()}
    moving = [
        joint
        for joint in JOINT_NAMES
        if any(
            size > MOVES * max(s for n, s in span.items() if n.endswith(name.split("_")[1]))
            for name, size in span.items()
            if name.startswith(joint)
        )
    ]
    return {"root": "big", "elbow": "small"}.get(" ".join(moving), "both")


def check_arm(
    measured: MeasuredProfile,
    study: ArmStudy,
    drive: str | None = None,
    console: Console | None = None,
    optimum: bool = True,
    still: bool = False,
) -> Result:
    """Replay a profile of the arm and hold it against caps, an optimum and the paper's laws.

    Parameters
    ----------
    measured : MeasuredProfile
    study : ArmStudy
        Of the profile's own duration.
    drive : "torque" or "angle", optional
        Which columns drive the joints; torques by default, where there are any.
    console : Console, optional
        Where progress is said.
    optimum : bool
        Whether the optimum is put beside it.
    still : bool
        Whether it may leave no more than the study's `residual_energy`.

    Returns
    -------
    Result
        Of the kind "check-arm".

    Raises
    ------
    StudyError
        If a column is missing, the arm would not start at rest, or the model cannot follow it.
    """
    console = console or Console()
    stage = study.slew
    check_bending(stage)
    driving = _driving(measured, stage, drive)

    console.progress(f"replaying {measured.path.name} on the full model")
    replayed = _replayed(measured, _motion(measured, stage, driving, exported=still), study)
    if still and any(driving.smoothed.values()):
        console.live("replaying its rows without smoothing")
        driving, replayed = _as_exported(measured, study, driving, replayed)
    beside, remark = _beside(study, console, optimum)

    table = _table(study, [replayed, *beside])
    arrays = _series(measured, driving)
    for traced in (replayed, *beside):
        arrays |= Trace.of(traced).series()
    return judged(
        measured,
        kind="check-arm",
        question=f"Does the profile {measured.path.name} keep the limits of the {stage.name} arm, "
        f"and how large is its residual energy? {stage.duration:.6g} s, {driving.kind} drive",
        configuration=as_dictionary(study),
        arrays=arrays,
        table=table,
        checks=_criteria(study, replayed, driving, still),
        size=_size(table),
        remarks=[
            *_noise(driving),
            *_predicted(measured, stage, driving.kind, replayed),
            remark,
            *_comparison(table),
        ],
        details={
            "drive": driving.kind,
            "stage": {"duration": stage.duration, "start": stage.start, "end": stage.end},
            "noise": {
                JOINT_NAMES[k]: found.noise._asdict() for k, found in driving.recovered.items()
            },
        },
    )


def _driving(measured: MeasuredProfile, stage: Stage, drive: str | None) -> DrivingColumns:
    """The columns that drive, and the motion behind them."""
    kind, values = _columns(measured, stage, drive)
    recovered = {k: recover(measured.time, x, np.ones(x.size)) for k, x in values.items()}
    smoothed = {k: _is_noisy(found, values[k], kind) for k, found in recovered.items()}
    return DrivingColumns(kind, values, recovered, smoothed)


def _as_exported(
    measured: MeasuredProfile, study: ArmStudy, driving: DrivingColumns, replayed: LockedMotion
) -> tuple[DrivingColumns, LockedMotion]:
    """The rows as they stand, where the file's own angles say that no noise is among them.

    The steep edges of an optimal torque look like noise. Of a measured torque the rows and the
    smoothed curve turn the joints alike, as the arm's inertia averages; of an export the curve
    misses what was taken away.
    """
    stage = study.slew
    exact = dataclasses.replace(driving, smoothed=dict.fromkeys(driving.smoothed, False))
    try:
        again = _replayed(measured, _motion(measured, stage, exact, exported=True), study)
    except StudyError:  # what the model cannot follow is noise
        return driving, replayed
    by_curve = max(_angles_off(measured, stage, replayed).values(), default=0.0)
    by_rows = max(_angles_off(measured, stage, again).values(), default=0.0)
    return (exact, again) if by_rows < EXACT * by_curve else (driving, replayed)


def _replayed(measured: MeasuredProfile, motion: Motion, study: ArmStudy) -> LockedMotion:
    """The profile on the full model, followed for a quarter of its time after the lock."""
    T = motion.stage.duration
    after = np.linspace(T, 1.25 * T, AFTER)
    try:
        settings = steps_for(study.residual_energy)
        done = replay(motion, elements=study.elements, settings=settings, modes=study.modes)
        return followed(done, after)
    except ModelError as error:
        raise StudyError(
            f"the profile {measured.path} cannot be replayed ({error}); look for jumps in it",
            ExitCode.NOT_SOLVED,
        ) from error


def _table(study: ArmStudy, motions: Sequence[LockedMotion]) -> tuple[TableRow, ...]:
    """What each motion leaves and needs, the profile's first, with the caps of the study."""
    laws = {}
    for replayed in motions:
        bears = loads(replayed)  # fine enough to be compared with
        laws[replayed.motion.name] = quantities_of(replayed, bears, study.arm, study.pointing_error)
    return table_rows(laws, caps_by_quantity(study))


def _columns(
    measured: MeasuredProfile, stage: Stage, drive: str | None
) -> tuple[Drive, dict[int, Array]]:
    """What drives the joints that turn, and its column for each."""
    if drive is not None:
        drive = choice(get_args(Drive))("--drive", drive)
    found: tuple[Drive, ...] = tuple(
        kind
        for kind in get_args(Drive)
        if all(f"{JOINT_NAMES[k]}_{kind}" in measured.values for k in stage.moving)
        and drive in (None, kind)
    )
    if found:
        kind = found[0]
        return kind, {k: measured.values[f"{JOINT_NAMES[k]}_{kind}"] for k in stage.moving}

    wanted = [f"{JOINT_NAMES[k]}_{drive or 'torque'}" for k in stage.moving]
    known = ", ".join(measured.values)
    near = nearest(wanted[0], measured.values)
    hint = f"did you mean '{near}'? " if near and near not in wanted else ""
    raise refusal(
        measured.path,
        f"has {known}, but the stage '{stage.name}' needs {' and '.join(wanted)}; {hint}give "
        "--stage big, small or both, or the missing columns",
    )


def _motion(
    measured: MeasuredProfile, stage: Stage, driving: DrivingColumns, *, exported: bool
) -> Motion:
    joints: dict[int, Joint] = {}
    for k, found in driving.recovered.items():
        if driving.kind == "torque":
            rows = driving.values[k]
            smoothed = found if driving.smoothed[k] else None
            joints[k] = _torque(measured.time, rows, smoothed, exported)
        else:
            joints[k] = _angle(measured, stage, k, found)
    return Motion(PROFILE, driving.kind, stage, joints)


def _is_noisy(found: Recovered, values: Array, kind: Drive) -> bool:
    """Whether a column is smoothed: of a torque no derivative is needed."""
    if kind == "torque":
        return found.noise.deviation > TORQUE_NOISE * float(np.abs(values).max())
    return found.fit is not None


def _torque(time: Array, values: Array, found: Recovered | None, exported: bool) -> Torque:
    """The torque as a drive gives it: through exact rows, smoothed where they scatter."""
    curve = _through(time, values, exported) if found is None else found.law.spline
    return Torque(lambda t: np.asarray(curve(np.clip(t, time[0], time[-1]))))


def _through(time: Array, values: Array, exported: bool) -> Any:
    """A spline where the rows resolve the torque, monotone where it jumps.

    An export of ours states its spline, which has no slope at either end, and is taken by its word
    however steep the torque is. Other files say nothing of that.
    """
    if exported:
        return CubicSpline(time, values, bc_type="clamped")
    peak = float(np.abs(values).max())
    half = np.unique(np.append(np.arange(0, time.size, 2), time.size - 1))
    # every other row has to tell the rest
    misfit = float(np.abs(CubicSpline(time[half], values[half])(time) - values).max())
    if misfit > RESOLVED * peak:
        return PchipInterpolator(time, values)
    return CubicSpline(time, values)


def _angle(measured: MeasuredProfile, stage: Stage, k: int, found: Recovered) -> Driven:
    """The angle of a joint with its derivatives, from rest at the stage's own start."""
    spline, end = found.law.spline, found.law.duration
    shift = stage.start[k] - float(spline(0.0))
    if abs(shift) > START + found.deviation(0.0, 0):
        refuse(
            measured.path,
            f"starts with the {JOINT_NAMES[k]} at {math.degrees(-shift + stage.start[k]):.4g} "
            f"deg, but the stage '{stage.name}' starts at {math.degrees(stage.start[k]):.4g} deg; "
            f"give the stage, or {JOINT_NAMES[k]}_start_deg in a study",
        )
    if found.rest[0] == 0:
        refuse(
            measured.path,
            f"starts with the {JOINT_NAMES[k]} at {float(spline(0.0, 1)):.4g} rad/s, but the arm "
            "is replayed from rest; give a profile that starts at rest",
        )

    def until_end(order: int) -> Callable[[Array], Array]:
        curve = spline if order == 0 else spline.derivative(order)
        offset = shift if order == 0 else 0.0
        return lambda t: np.asarray(curve(np.clip(t, 0.0, end))) + offset

    return Driven(until_end(0), until_end(1), until_end(2))


def _beside(study: ArmStudy, console: Console, optimum: bool) -> tuple[list[LockedMotion], str]:
    """The optimum and the paper's laws, on the full model."""
    stage, found, remark = study.slew, [], ""
    if optimum:
        try:
            best = solve_stage(stage, caps=study.caps, solver=StudySolver(live=console.live))
            replayed = best.replay("torque", elements=study.elements, modes=study.modes)
            named = dataclasses.replace(replayed.motion, name=OPTIMUM)
            found.append(dataclasses.replace(replayed, motion=named))
            remark = "optimum: the smoothest motion under the same caps, local"
        except (StudyError, ModelError) as error:
            remark = f"the profile is compared with no optimum: {error}"
    laws = (replay_law(stage, unit_law(name, stage.duration), "torque") for name in LAWS)
    return [*found, *laws], remark


def _criteria(
    study: ArmStudy, replayed: LockedMotion, driving: DrivingColumns, still: bool
) -> tuple[Criterion, ...]:
    caps = {k: study.caps.torque[k] for k in driving.recovered}
    left, allowed = replayed.residual_energy, study.residual_energy
    name = "residual energy after the lock"
    return (
        *latch_checks(replayed, LATCH if study.latch is None else study.latch),
        *([Criterion(name, "J", left, allowed, left <= allowed)] if still else []),
        *(_torque_cap(k, cap, replayed, driving) for k, cap in caps.items() if cap is not None),
        *wheel_checks(study, loads(replayed)),
    )


def _torque_cap(k: int, cap: float, replayed: LockedMotion, driving: DrivingColumns) -> Criterion:
    """Whether the torque of a joint stays below its cap [N m], noise taken off."""
    run, name = replayed.run.before, f"peak {JOINT_NAMES[k]} torque"
    place = int(np.argmax(np.abs(run.torque[k])))
    value, slack = abs(float(run.torque[k, place])), 0.0
    if driving.kind == "torque" and driving.smoothed[k]:
        slack = float(driving.recovered[k].band(0)[1].max())

    held = value - slack <= cap * (1 + CAP_EXCESS)
    decided = not held or value + slack <= cap * (1 + CAP_EXCESS)
    more = "" if decided else ", but noise may hide that it is exceeded"
    if not held:
        more = f", exceeded by {100 * (value / cap - 1):.3g} %"
    noise = f" +- {slack:.3g}" if slack else ""
    sentence = (
        f"{outcome(held, decided)}: {name} {value:.6g}{noise} N m at "
        f"{run.times[place]:.5g} s (cap {cap:.6g}{more})"
    )
    return Criterion(name, "N m", value, cap, held, sentence, decided)


def _noise(driving: DrivingColumns) -> list[str]:
    """What scatters, and what was done about it."""
    kind, unit, lines = driving.kind, driving.unit, []
    for k, found in driving.recovered.items():
        head = f"noise of the {JOINT_NAMES[k]}'s {kind}"
        if found.fit is None or not driving.smoothed[k]:
            lines.append(f"{head}: negligible ({found.noise.deviation:.1e} {unit})")
        else:
            lines.append(
                f"{head}: {found.fit.noise:.3g} {unit} (standard deviation); "
                f"{how_smoothed(found.fit)}; the vibration of the arm after the lock depends on "
                "the part removed by the smoothing"
            )
    return lines


def _predicted(
    measured: MeasuredProfile, stage: Stage, kind: Drive, replayed: LockedMotion
) -> list[str]:
    """How far a column that did not drive the replay is from what the replay gives."""
    if kind == "angle":
        return []
    return [
        f"the file's own {JOINT_NAMES[k]} angle differs from the replayed one by at most "
        f"{off:.3g} rad"
        for k, off in _angles_off(measured, stage, replayed).items()
    ]


def _angles_off(
    measured: MeasuredProfile, stage: Stage, replayed: LockedMotion
) -> dict[int, float]:
    """Largest difference of each angle column that the file has from the replay [rad]."""
    run = replayed.run.before
    angles = run.joint_angles()
    columns = {k: measured.values.get(f"{JOINT_NAMES[k]}_angle") for k in stage.moving}
    return {
        k: float(np.abs(np.interp(measured.time, run.times, angles[k]) - column).max())
        for k, column in columns.items()
        if column is not None
    }


def _comparison(table: tuple[TableRow, ...]) -> list[str]:
    """What the profile leaves and needs, beside each other law."""
    lines = []
    for row in table:
        if row.key not in WORTH_SAYING:
            continue
        own, *others = row.values.items()
        beside = [f"{own[1] / value:.3g} times that of {law}" for law, value in others if value > 0]
        lines.append(f"{row.title} {own[1]:.4g} {row.unit}: {', '.join(beside)}")
    return lines


def _size(table: tuple[TableRow, ...]) -> str:
    """What the profile comes to, for its verdict."""
    left = next(row for row in table if row.key == "residual_energy")
    energy = next(iter(left.values.values()))
    return f"its residual energy after the lock is {energy:.3g} J"


def _series(measured: MeasuredProfile, driving: DrivingColumns) -> dict[str, Series]:
    arrays = {"time": Series("s", "time", measured.time, "since the release")}
    for k, values in driving.values.items():
        name = f"{JOINT_NAMES[k]}_{driving.kind}"
        arrays[name] = Series(driving.unit, "time", values, "as in the file")
    return arrays
