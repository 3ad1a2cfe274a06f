"""A profile of the arm, by angles or by torques: replayed on the full model, and what it leaves.

Nothing of the profile is optimised. It is set beside the smoothest motion of the same stage, in the
same time and under the same caps, and beside the paper's two laws.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any, get_args

import numpy as np
from scipy.interpolate import PchipInterpolator

from models.ancf.joints import Driven, Joint, Torque
from models.errors import ModelError
from ocp.arrays import Array
from studies.arm.config import ArmStudy, as_dictionary, study_from
from studies.arm.laws.unit_laws import baselines
from studies.arm.optimal.solve import check_bending, solve_stage
from studies.arm.questions.baselines import replay_law
from studies.arm.replay.full_model import Drive, LockedMotion, Motion, replay
from studies.arm.replay.loads import loads
from studies.arm.report.quantities import latched, quantities_of, table_rows
from studies.arm.report.traces import Trace
from studies.arm.stage import JOINT_NAMES, Stage
from studies.check.reading.profile import MeasuredProfile
from studies.check.reading.raw_table import refusal, refuse
from studies.check.smoothing.recovery import Recovered, recover
from studies.common.configuration import as_number, choice, nearest
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, TableRow, Verdict, costs_elsewhere

PROFILE, OPTIMUM = "profile", "optimum"
LAWS = ("Step5", "Bezier")
LATCH = 0.01  # [rad], 0.6 deg: what a joint may miss its end by where no latch is stated
START = 0.01  # [rad] by which an angle may start off the stage's own; it is shifted by it
MOVES = 1e-3  # of the largest column: below it a joint counts as still
TORQUE_NOISE = 1e-3  # of the peak torque, below which rows are taken as exact
CAP_EXCESS = 1e-3  # of a cap, relative: what rows between the peaks may hide
AFTER = 401  # instants of the quarter of a stage that is followed after the lock
SHAPER = 10.0  # frequency times duration of shapers that nobody asks for here
WORTH_SAYING = ("residual_energy", "peak_root_torque", "peak_elbow_torque", "peak_root_moment")


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
    kind, columns = _columns(measured, stage, drive)
    recovered = {k: recover(measured.time, x, np.ones(x.size)) for k, x in columns.items()}
    smoothed = {k: _is_noisy(found, columns[k], kind) for k, found in recovered.items()}
    motion = _motion(measured, stage, kind, columns, recovered, smoothed)

    after = np.linspace(stage.duration, 1.25 * stage.duration, AFTER)
    console.progress(f"replaying {measured.path.name} on the full model")
    try:
        replayed = replay(motion, elements=study.elements, after=after, modes=study.modes)
    except ModelError as error:
        raise StudyError(
            f"the profile {measured.path} cannot be replayed ({error}); look for jumps in it",
            ExitCode.NOT_SOLVED,
        ) from error

    beside, remark = _beside(study, console, optimum)
    laws = {motion.name: quantities_of(replayed, loads(replayed), study.arm, study.pointing_error)}
    for other in beside:
        bears = loads(other)  # fine enough to be compared with
        laws[other.motion.name] = quantities_of(other, bears, study.arm, study.pointing_error)
    caps = {f"peak_{JOINT_NAMES[k]}_torque": study.caps.torque[k] for k in stage.moving}
    table = table_rows(laws, caps)

    arrays = _series(measured, stage, kind, columns)
    for traced in (replayed, *beside):
        arrays |= Trace.of(traced).series()
    checks = _criteria(study, replayed, recovered, smoothed, kind)
    return Result(
        kind="check-arm",
        question=f"What does the profile {measured.path.name} leave on the {stage.name} arm "
        f"in {stage.duration:.6g} s, {kind} drive?",
        configuration=as_dictionary(study),
        arrays=arrays,
        table=table,
        verdict=_verdict(checks, table),
        checks=checks,
        costs_elsewhere=costs_elsewhere(table),
        remarks=(
            *measured.notes,
            *_noise(kind, recovered, smoothed),
            *_predicted(measured, stage, kind, replayed),
            *([remark] if remark else []),
            *_comparison(table),
        ),
        details={
            "profile_of": motion.name,
            "drive": kind,
            "stage": {"duration": stage.duration, "start": stage.start, "end": stage.end},
            "noise": {JOINT_NAMES[k]: found.noise._asdict() for k, found in recovered.items()},
        },
        provenance=provenance(),
    )


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
        f"has {known}, but the stage '{stage.name}' needs {' and '.join(wanted)}; {hint}state "
        "--stage big, small or both, or give the columns",
    )


def _motion(
    measured: MeasuredProfile,
    stage: Stage,
    kind: Drive,
    columns: Mapping[int, Array],
    recovered: Mapping[int, Recovered],
    smoothed: Mapping[int, bool],
) -> Motion:
    joints: dict[int, Joint] = {}
    for k, found in recovered.items():
        if kind == "torque":
            joints[k] = _torque(measured.time, columns[k], found if smoothed[k] else None)
        else:
            joints[k] = _angle(measured, stage, k, found)
    return Motion(PROFILE, kind, stage, joints)


def _is_noisy(found: Recovered, values: Array, kind: Drive) -> bool:
    """Whether a column is smoothed: of a torque no derivative is needed."""
    if kind == "torque":
        return found.noise.deviation > TORQUE_NOISE * float(np.abs(values).max())
    return found.fit is not None


def _torque(time: Array, values: Array, found: Recovered | None) -> Torque:
    """The torque as a drive gives it: monotone between exact rows, smoothed where they scatter."""
    curve = PchipInterpolator(time, values) if found is None else found.law.spline
    return Torque(lambda t: np.asarray(curve(np.clip(t, time[0], time[-1]))))


def _angle(measured: MeasuredProfile, stage: Stage, k: int, found: Recovered) -> Driven:
    """The angle of a joint with its derivatives, from rest at the stage's own start."""
    spline, end = found.law.spline, found.law.duration
    shift = stage.start[k] - float(spline(0.0))
    if abs(shift) > START + found.deviation(0.0, 0):
        refuse(
            measured.path,
            f"starts with the {JOINT_NAMES[k]} at {math.degrees(-shift + stage.start[k]):.4g} deg, "
            f"but the stage '{stage.name}' starts at {math.degrees(stage.start[k]):.4g} deg; state "
            f"the stage, or {JOINT_NAMES[k]}_start_deg in a study",
        )
    if found.rest[0] == 0:
        refuse(
            measured.path,
            f"starts with the {JOINT_NAMES[k]} at {float(spline(0.0, 1)):.4g} rad/s, but the arm "
            "is replayed from rest; give the profile from rest on",
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
            best = solve_stage(stage, caps=study.caps, objective="smoothest", progress=console.live)
            found.append(best.replay("torque", elements=study.elements, modes=study.modes))
            remark = "optimum: the smoothest motion under the same caps, local"
        except (StudyError, ModelError) as error:
            remark = f"no optimum stands beside the profile: {error}"
    laws = {law.name: law for law in baselines(stage.duration, SHAPER / stage.duration)}
    found += [replay_law(stage, laws[name], "torque") for name in LAWS]
    if found and optimum and found[0].motion.name not in LAWS:
        found[0] = dataclasses.replace(
            found[0], motion=dataclasses.replace(found[0].motion, name=OPTIMUM)
        )
    return found, remark


def _criteria(
    study: ArmStudy,
    replayed: LockedMotion,
    recovered: Mapping[int, Recovered],
    smoothed: Mapping[int, bool],
    kind: Drive,
) -> tuple[Criterion, ...]:
    width = LATCH if study.latch is None else study.latch
    checks = []
    for k, signed in replayed.run.engagement.miss.items():
        miss = abs(float(signed))
        sentence, held = latched(JOINT_NAMES[k], miss, width)
        word = "passed" if held else "FAILED"
        name = f"latch of the {JOINT_NAMES[k]}"
        checks.append(Criterion(name, "rad", miss, width, held, f"{word}: {sentence}"))

    for k, found in recovered.items():
        cap, name = study.caps.torque[k], f"peak {JOINT_NAMES[k]} torque"
        if cap is None:
            continue
        run = replayed.run.before
        place = int(np.argmax(np.abs(run.torque[k])))
        value, slack = abs(float(run.torque[k, place])), 0.0
        if kind == "torque" and smoothed[k]:
            slack = float(found.band(0)[1].max())
        held = value - slack <= cap * (1 + CAP_EXCESS)
        more = "" if held else f", broken by {100 * (value / cap - 1):.3g} %"
        noise = f" +- {slack:.3g}" if slack else ""
        sentence = (
            f"{'passed' if held else 'FAILED'}: {name} {value:.6g}{noise} N m at "
            f"{run.times[place]:.5g} s (cap {cap:.6g}{more})"
        )
        checks.append(Criterion(name, "N m", value, cap, held, sentence))
    return tuple(checks)


def _noise(
    kind: Drive, recovered: Mapping[int, Recovered], smoothed: Mapping[int, bool]
) -> list[str]:
    """What scatters, and what was done about it."""
    unit = {"torque": "N m", "angle": "rad"}[kind]
    lines = []
    for k, found in recovered.items():
        head = f"noise of the {JOINT_NAMES[k]}'s {kind}"
        if found.fit is None or not smoothed[k]:
            lines.append(f"{head}: none that matters ({found.noise.deviation:.1e} {unit})")
        else:
            lines.append(
                f"{head}: {found.fit.noise:.3g} {unit} (standard deviation); smoothed by a quintic "
                "spline whose roughness follows from restricted maximum likelihood, "
                f"{found.fit.freedom:.0f} effective parameters; what the arm does after the lock "
                "depends on what the smoothing took away"
            )
    return lines


def _predicted(
    measured: MeasuredProfile, stage: Stage, kind: Drive, replayed: LockedMotion
) -> list[str]:
    """How far a column that did not drive the replay is from what the replay gives."""
    if kind == "angle":
        return []
    run, lines = replayed.run.before, []
    angles = run.joint_angles()
    for k in stage.moving:
        column = measured.values.get(f"{JOINT_NAMES[k]}_angle")
        if column is not None:
            off = float(np.abs(np.interp(measured.time, run.times, angles[k]) - column).max())
            lines.append(
                f"the file's own {JOINT_NAMES[k]} angle differs from the replayed one by at most "
                f"{off:.3g} rad"
            )
    return lines


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


def _verdict(checks: tuple[Criterion, ...], table: tuple[TableRow, ...]) -> Verdict:
    failed = [check for check in checks if not check.passed]
    left = next(row for row in table if row.key == "residual_energy")
    energy = next(iter(left.values.values()))
    size = f"it leaves {energy:.3g} J after the lock"
    if not failed:
        return Verdict("measured", f"measured: keeps all {len(checks)} checks; {size}")
    first = failed[0].sentence.removeprefix("FAILED: ")
    more = f" and {len(failed) - 1} more" if len(failed) > 1 else ""
    return Verdict(
        "measured", f"measured: breaks {len(failed)} of {len(checks)} checks: {first}{more}; {size}"
    )


def _series(
    measured: MeasuredProfile, stage: Stage, kind: Drive, columns: Mapping[int, Array]
) -> dict[str, Series]:
    unit = {"torque": "N m", "angle": "rad"}[kind]
    arrays = {"time": Series("s", "time", measured.time, "since the release")}
    for k, values in columns.items():
        name = f"{JOINT_NAMES[k]}_{kind}"
        arrays[name] = Series(unit, "time", values, "as in the file")
    return arrays
