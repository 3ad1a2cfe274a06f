"""One motion of the arm: solved, refined, replayed, and set beside two of the paper's laws."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from time import process_time
from typing import Any

import numpy as np

from models.ancf.analysis import natural_modes
from models.ancf.joints import Locked
from models.ancf.state import posed
from models.errors import ModelError
from models.laws.unit_turns import quintic
from studies.arm.config import ArmStudy, as_dictionary
from studies.arm.laws.rigid import feed_forward
from studies.arm.laws.unit_laws import unit_law
from studies.arm.optimal.objectives import first_duration
from studies.arm.optimal.phase import is_slow
from studies.arm.optimal.refinement import Refined, refine
from studies.arm.optimal.solve import check_bending, check_caps, solve_stage
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.questions.baselines import replay_law
from studies.arm.replay.full_model import (
    ELEMENTS,
    MODES,
    Drive,
    LockedMotion,
    after_lock,
    followed,
    steps_for,
)
from studies.arm.replay.loads import Loads, loads
from studies.arm.replay.numerical_floor import numerical_floor
from studies.arm.replay.sampled import SampledProfile, sampled_to
from studies.arm.report.profile import (
    accuracy,
    load_series,
    profile_check,
    profile_series,
    reduced_series,
)
from studies.arm.report.quantities import (
    ASSUMPTIONS,
    Metric,
    caps_by_quantity,
    criteria,
    off_time_quantities,
    optimum_quantities,
    quantities_of,
    table_rows,
    verdict_on,
)
from studies.arm.report.traces import Trace, snapshot_series, snapshots_of
from studies.arm.stage import Stage, TorqueCaps
from studies.common.comparison_table import costs_elsewhere
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.common.finished import FinishedSteps
from studies.common.folder import provenance
from studies.common.result import Result
from studies.common.scene.chain_shapes import shape_series

OPTIMUM = "optimum"
LAWS = ("Step5", "Bezier")
"""The paper's own laws, beside which the optimum's costs are seen."""
FINER = 3  # halves of the elements of a link, on which the residual is found again
_DENSE = 1001  # instants at which a peak is looked for
_LONG = 30.0  # seconds of the processor, from which on a motion says why it took them


def check_study(study: ArmStudy) -> None:
    """Refuse what cannot be met, before any work.

    Raises
    ------
    StudyError
        With the remedy.
    """
    if study.objective == "time":
        first_duration(study.slew, study.caps)  # needs both caps; the stage's own does not matter
    else:
        check_bending(study.slew)
        check_caps(study.slew, study.caps)
    check_mesh(study)


def check_mesh(study: ArmStudy) -> None:
    """Refuse a full model too coarse for the modes that are asked for.

    Raises
    ------
    StudyError
        With the number of elements that would do.
    """
    stage = study.slew
    chain = stage.arm.chain(study.elements)
    joints = [Locked(angle) for angle in stage.end]
    try:
        natural_modes(chain, joints, posed(chain, list(stage.end)), count=study.modes)
    except ModelError as error:
        raise StudyError(str(error)) from error


def solve_motion(study: ArmStudy, console: Console, kept: FinishedSteps) -> Result:
    """The motion that a study asks for; `kept` are its solves of an earlier run.

    Raises
    ------
    StudyError
        If no motion is found.
    """
    begin, solver = process_time(), StudySolver(console.progress, console.live, kept)
    refined = _refined(study, solver)
    stage = refined.motion.stage  # least time has its own duration
    replayed = _followed_replay(study, refined)
    refined = dataclasses.replace(refined, replays=(replayed,))
    history = loads(replayed)

    # the optimum's own column of the table, then those of the laws beside it
    asked = study.residual_energy, study.sample_time, study.elements
    profile = sampled_to(replayed, *asked, kept)
    columns = {OPTIMUM: _column_of_optimum(study, refined, history, profile)}
    beside = [_baseline(stage, name, study.drive, console) for name in LAWS]
    for baseline in beside:
        columns[baseline.motion.name] = quantities_of(
            baseline, loads(baseline), study.arm, study.pointing_error
        )
    if study.objective == "time":
        columns = with_duration(columns, stage)
    rows = table_rows(columns, caps_by_quantity(study))

    # all that the figures show: they are drawn from the result alone
    snapshots = snapshots_of(replayed)
    arrays = profile_series(profile) | load_series(history, replayed)
    for motion in (replayed, *beside):
        arrays |= Trace.of(motion).series()
    arrays |= reduced_series(refined.motion.reduced) | snapshot_series(snapshots)
    arrays |= shape_series(replayed.run.runs)

    seconds = process_time() - begin
    if seconds > _LONG:
        console.progress(_why_long(seconds, solver))
    remarks = [ASSUMPTIONS]
    details: dict[str, Any] = {
        "stage": {"duration": stage.duration, "start": stage.start, "end": stage.end},
        "snapshot_times": [snapshot.time for snapshot in snapshots],
        "rounds": [dataclasses.asdict(entry) for entry in refined.rounds],
        "accuracy": accuracy(profile),
    }
    if is_slow(stage):
        # so little is left that rounding may be all of it
        floor = numerical_floor(refined.motion.motion(study.drive))
        details["numerical_floor_J"] = floor.energy
        remarks.append(str(floor))

    return Result(
        kind="arm",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=arrays,
        table=rows,
        bounds=_bounds(study, stage),
        verdict=verdict_on(refined),
        checks=(
            *criteria(study, refined, history),
            profile_check(profile, study.residual_energy),
        ),
        costs_elsewhere=costs_elsewhere(rows),
        remarks=tuple(remarks),
        details=details,
        provenance=provenance(),
    )


def with_duration(columns: Mapping[str, list[Metric]], stage: Stage) -> dict[str, list[Metric]]:
    """Columns of a table below the least time that was found, in which the laws move, too [s]."""
    lasting = Metric("duration", "duration", "s", stage.duration)
    return {name: [lasting, *column] for name, column in columns.items()}


def _column_of_optimum(
    study: ArmStudy, refined: Refined, history: Loads, profile: SampledProfile
) -> list[Metric]:
    """The quantities of the optimum, also where something is not as planned."""
    # under angle drive the torque is the reaction that the replay finds
    peaks = refined.motion.peak_torque if study.drive == "torque" else None
    metrics = quantities_of(refined.replay, history, study.arm, study.pointing_error, peaks)
    metrics += optimum_quantities(refined.motion, refined.replay)
    metrics += off_time_quantities(refined.replay)
    title = f"residual energy of the profile sampled every {profile.step:.4g} s"
    return [*metrics, Metric("sampled_residual_energy", title, "J", profile.residual_energy)]


def _why_long(seconds: float, solver: StudySolver) -> str:
    """Where the processor's seconds of a motion went, and why."""
    return (
        f"it took {seconds:.0f} s of processor time: {solver.seconds:.0f} s for {solver.count} "
        "solves on B21, whose accelerations are differentiated twice at every point of the mesh; "
        "most of the rest is for replays on the full model, whose fast modes require short steps"
    )


def _followed_replay(study: ArmStudy, refined: Refined) -> LockedMotion:
    """The motion on the study's own model, and the vibration that follows it."""
    stage, replayed = refined.motion.stage, refined.replay
    if (study.elements, study.modes) != (ELEMENTS, MODES):
        replayed = refined.motion.replay(
            study.drive,
            elements=study.elements,
            settings=steps_for(study.residual_energy, study.drive),
            modes=study.modes,
        )
    return followed(replayed, after_lock(stage))


def _refined(study: ArmStudy, solver: StudySolver) -> Refined:
    try:
        motion = solve_stage(
            study.slew.under(study.drive),
            caps=study.caps,
            objective=study.objective,
            solver=solver,
        )
    except StudyError as error:
        hint = duration_to_try(study.slew, study.caps)
        raise StudyError(f"{error}{hint}", error.exit_code) from error
    return refine(
        motion,
        residual=study.residual_energy,
        drive=study.drive,
        elements=FINER * study.elements // 2,
        solver=solver,
    )


def duration_to_try(stage: Stage, caps: TorqueCaps) -> str:
    """What to do where no motion was found: how long a rigid arm takes if torque caps are low."""
    times = np.linspace(0.0, stage.duration, _DENSE)
    peaks = np.abs(feed_forward(stage, quintic(stage.duration))(times)).max(axis=1)
    over = [float(peaks[k]) / cap for k in stage.moving if (cap := caps.torque[k]) is not None]
    longer = stage.duration * max(over, default=0.0) ** 0.5  # torques fall as 1/T^2
    if longer <= stage.duration:
        return "; on the command line: give a longer duration, higher caps or another objective"
    return (
        f"; under this torque cap a rigid arm needs {longer:.4g} s with the quintic step: give "
        "such a duration or a higher cap"
    )


def _baseline(stage: Stage, name: str, drive: Drive, console: Console) -> LockedMotion:
    console.live(f"{name}, compared with the optimum")
    return replay_law(stage, unit_law(name, stage.duration), drive)


def _bounds(study: ArmStudy, stage: Stage) -> dict[str, float]:
    """What no motion of the rigid arm can beat, where one joint turns."""
    if len(stage.moving) > 1:
        return {}
    bounds = {"rigid arm: peak torque [N m]": float(4.0 * stage.torque_units[stage.moving[0]])}
    cap = study.torque_cap
    if cap is not None:
        bounds["rigid arm under the cap: duration [s]"] = stage.least_duration(cap)
    return bounds
