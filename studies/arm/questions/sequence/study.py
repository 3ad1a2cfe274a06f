"""A sequence of both stages from its configuration to its result."""

from __future__ import annotations

import dataclasses
import functools
import time as clock
from collections.abc import Callable

import numpy as np

from models.ancf.integrate import StepControl
from models.arm.reduced_simulation import reduced_modes
from studies.arm.config import SequenceStudy, as_dictionary
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.refinement import Refined, refine
from studies.arm.optimal.solve import MOST_PERIODS, solved
from studies.arm.optimal.study_solver import StudySolver
from studies.arm.questions.sequence.problem import (
    SMOOTHING,
    Sequence,
    locked,
    sequence,
    sequence_problem,
    stage_alone,
    turning,
)
from studies.arm.questions.sequence.profile import (
    INTERPOLATION,
    SampledSequence,
    load_series,
    profile_series,
    sampled_to,
    torque_series,
)
from studies.arm.questions.sequence.replay import replay_reduced
from studies.arm.replay.full_model import (
    ELEMENTS,
    LockedMotion,
    Motion,
    after_lock,
    followed,
    in_turn,
    steps_for,
)
from studies.arm.report.quantities import (
    CAP_EXCESS,
    Metric,
    refinement_checks,
    table_rows,
    verdict_on,
    verified,
)
from studies.arm.report.traces import Trace
from studies.arm.search_limits import SEQUENCE_INTERVALS, SEQUENCE_WINDOW, UNRESOLVED
from studies.arm.stage import ROOT
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.processes.side_by_side import Part, side_by_side
from studies.common.result import Criterion, Result, Verdict
from studies.common.scene.chain_shapes import shape_series

Law = tuple[Motion, ...]
"""Both motions."""
PAPER = (86.0, 112.0)  # [s]
FINER = 3  # halves of the elements of a link, on which the residuals are found again
_PACE = 1.1  # of the rigid bound, at which the guess under a cap moves


def find_sequence(
    study: SequenceStudy, console: Console, kept: FinishedSteps = NOTHING_KEPT
) -> Result:
    """Big arm, locked dwell and small arm as one problem; `kept` are its earlier solves.

    Raises
    ------
    StudyError
        If no motion is found, or none that comes near to rest.
    """
    case = stated_case(study)
    until = clock.monotonic() + study.seconds
    solver = StudySolver(console.progress, console.live, kept, until)
    stated = sequence_problem(case, study.least, study.torque_cap)
    solve = functools.partial(solved, "sequence", solver=solver)
    found = refine(
        solve(stated, SMOOTHING, None, SEQUENCE_INTERVALS),
        residual=study.residual_energy,
        solver=solver,
    )
    late = clock.monotonic() >= until
    check_rest(found, late)

    motion = found.motion
    [dwell], law = motion.dwells, motion.motions("torque")
    console.live("replaying on a finer full model, and sampled")
    parts = [
        Part(_finer, (law, dwell, steps_for(study.residual_energy))),
        Part(_sampled, (law, dwell, study.residual_energy, study.sample_time)),
        Part(_on_B21, (law, dwell)),
    ]
    finer, sampled, on_B21 = side_by_side(parts, console)
    found = dataclasses.replace(found, finer=finer)

    # what goes on swinging after the last lock
    big, small = found.replays
    replays = big, followed(small, after_lock(small.motion.stage))

    moved = Sequence(motion.stages[0], motion.stages[1], dwell)
    beside, left_out = _beside(study, found, solve)
    arrays = profile_series(sampled, replays) | torque_series(law, dwell)
    arrays |= load_series(replays, moved.first.duration + dwell)
    for one in replays:
        arrays |= Trace.of(one).series()
    arrays |= shape_series([run for one in replays for run in one.run.runs])
    return Result(
        kind="arm-sequence",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=arrays,
        table=table_rows({"optimum": [*_facts(found, moved, sampled, on_B21), *beside]}),
        bounds={"rigid arm of this time, best split: peak torque [N m]": moved.rigid_bound},
        verdict=_verdict(found, study.seconds if late else None),
        checks=_criteria(study, found, sampled),
        remarks=("the total is the time of both motions, without the dwell", *left_out),
        details={
            "durations": moved.durations,
            "rigid_bound_Nm": moved.rigid_bound,
            "rounds": [dataclasses.asdict(entry) for entry in found.rounds],
            "accuracy": {
                "residual_energy_of_the_sampled_profile_J": sampled.left,
                "sample_time_s": sampled.step,
                "interpolation": INTERPOLATION,
            },
        },
        provenance=provenance(),
    )


def _finer(
    law: Law, dwell: float, settings: StepControl, console: Console
) -> tuple[LockedMotion, ...]:
    """Its replays with half as many elements again."""
    return in_turn(law, (dwell,), elements=FINER * ELEMENTS // 2, settings=settings)


def _sampled(
    law: Law, dwell: float, residual: float, step: float | None, console: Console
) -> SampledSequence:
    """Its profile."""
    return sampled_to(law, dwell, residual, step)


def _on_B21(law: Law, dwell: float, console: Console) -> tuple[float, float]:
    """What both locks leave on B21 [J]."""
    return replay_reduced(law, dwell)


def check_rest(found: Refined, late: bool) -> None:
    """Refuse a sequence that the mesh does not resolve: its finer replays take hours.

    Raises
    ------
    StudyError
        With what the best round leaves.
    """
    left, allowed = found.left, found.residual
    if left > UNRESOLVED * allowed:
        more = "more --seconds, " if late else ""
        raise StudyError(
            f"no sequence was found that comes to rest: the best of {len(found.rounds)} rounds "
            f"has a residual energy of {left:.2e} J on the full model, but {allowed:g} J are "
            f"allowed; give {more}a longer total or dwell, or allow more residual energy",
            ExitCode.NOT_SOLVED,
        )


def stated_case(study: SequenceStudy) -> Sequence:
    """The sequence that is asked for, as the rigid bound splits it."""
    case = sequence(study.total, study.dwell, study.arm.parameters)
    # the guess moves at the pace of the cap, whatever total time is stated
    return case if study.torque_cap is None else paced(case, study.torque_cap)


def check_sequence(study: SequenceStudy, case: Sequence) -> None:
    """Refuse a dwell that the model cannot tell from none, and an energy that limits nothing.

    Raises
    ------
    StudyError
        With the limit and its reason.
    """
    model = locked(case)
    period = 1.0 / float(reduced_modes(model, model.at(*case.first.end))[0][-1])
    if study.dwell < period:
        raise StudyError(
            f"dwell is {study.dwell:g} s, less than a period of the locked arm's fastest mode; "
            f"give at least {period:.3g} s"
        )

    # least torque without rest is constant torque: it ends at twice the mean rate
    shortest = SEQUENCE_WINDOW[0] * case.first.duration
    fastest = 2.0 * turning(case.first) * float(abs(case.first.turn[ROOT])) / shortest**2
    if study.lock_energy is not None and study.lock_energy > fastest:
        raise StudyError(
            f"lock_energy is {study.lock_energy:g} J, but a rigid arm that a constant torque "
            f"accelerates until its lock, for the shortest time tried of {shortest:.3g} s, has "
            f"{fastest:.3g} J; give less"
        )


def check_pace(study: SequenceStudy, case: Sequence) -> None:
    """Refuse a torque cap under which the arm is so slow that no mesh resolves its modes.

    Raises
    ------
    StudyError
        With the least cap.
    """
    cap = study.torque_cap
    if cap is None:
        return
    fastest = max(
        float(reduced_modes(stage.model, stage.model.at(*stage.start))[0][-1])
        for stage in (case.first, case.second)
    )
    longest = max(case.first.duration, case.second.duration)
    if fastest * longest > MOST_PERIODS:
        # a motion takes as long as one over the cap's root
        least = cap * (fastest * longest / MOST_PERIODS) ** 2
        raise StudyError(
            f"under a torque cap of {cap:g} N m the longer motion takes about {longest:.3g} s, "
            f"{fastest * longest:.3g} periods of the arm's fastest mode, but the mesh resolves up "
            f"to {MOST_PERIODS:g}; give a torque cap of at least {1.01 * least:.3g} N m"
        )


def paced(case: Sequence, cap: float) -> Sequence:
    """The sequence at the pace of a cap, a tenth above the rigid bound."""
    total = case.moving_time * float(np.sqrt(_PACE * case.rigid_bound / cap))
    return sequence(total, case.dwell, case.first.arm)


def _verdict(found: Refined, seconds: float | None) -> Verdict:
    """In words; `seconds` are those of a search that was ended by them."""
    if seconds is not None and not found.resolved:
        return Verdict(
            "unverified",
            f"unverified: the search reached its limit of {seconds:g} s before all of its rounds "
            "were done; give more --seconds",
        )
    return verdict_on(found)


def _criteria(
    study: SequenceStudy, found: Refined, sampled: SampledSequence
) -> tuple[Criterion, ...]:
    """What must hold: each lock by itself, the same on a finer model, sampled, caps, angles."""
    allowed = found.residual
    checks = [
        verified(
            f"the residual energy after the {which} lock is within the allowed one",
            "J",
            replayed.residual_energy,
            allowed,
        )
        for which, replayed in zip(("first", "last"), found.replays, strict=True)
    ]
    name = (
        f"the residual energy of the profile sampled every {sampled.step:.4g} s is within the "
        "allowed one"
    )
    checks += [
        verified(f"{name} allowed", "J", sampled.left, allowed),
        *refinement_checks(found),
    ]

    cap, peak = study.torque_cap, float(found.motion.peak_torque.max())
    if cap is not None:
        name = "the torque is within its cap between the points"
        checks.append(verified(name, "N m", peak, cap, CAP_EXCESS))
    return tuple(checks)


def _facts(
    found: Refined, moved: Sequence, sampled: SampledSequence, on_B21: tuple[float, float]
) -> list[Metric]:
    """Times, torques and what the locks leave."""
    bound, (big, dwell, small) = moved.rigid_bound, moved.durations
    at_lock, at_end = found.replays
    weight, (root, elbow) = found.motion.weight, found.motion.peak_torque.tolist()

    # the bounds of a rigid arm, in this time and in the paper's
    over = 100 * (max(root, elbow) / bound - 1)
    turns = [turning(stage) for stage in (moved.first, moved.second)]
    paper = max(4.0 * turn / T**2 for turn, T in zip(turns, PAPER, strict=True))

    first = "energy after the first lock"
    last = "energy after the last lock"
    lock, impulse = at_lock.run.engagement, "impulse of the first lock at the root"
    return [
        Metric("big_arm_time", "big arm", "s", big, "neither"),
        Metric("dwell", "dwell", "s", dwell, "neither"),
        Metric("small_arm_time", "small arm", "s", small, "neither"),
        Metric("moving_time", "both motions", "s", moved.moving_time),
        Metric("peak_root_torque", "peak torque, root", "N m", root),
        Metric("peak_elbow_torque", "peak torque, elbow", "N m", elbow),
        Metric("rigid_bound", "rigid bound of this time, best split", "N m", bound, "neither"),
        Metric("surcharge", "excess over the rigid bound", "%", over),
        Metric("paper_bound", "rigid bound of the paper's 86 and 112 s", "N m", paper, "neither"),
        Metric("first_lock_energy", f"{first}, full model", "J", at_lock.residual_energy),
        Metric(
            "first_lock_energy_B21",
            f"{first}, B21, with the corrected target",
            "J",
            on_B21[0],
            "neither",
        ),
        Metric("residual_energy", f"{last}, full model", "J", at_end.residual_energy),
        Metric(
            "residual_energy_B21",
            f"{last}, B21, with the corrected target",
            "J",
            on_B21[1],
            "neither",
        ),
        Metric("lost_first", "kinetic energy lost in the first lock", "J", lock.lost_energy),
        Metric("impulse_first", impulse, "N m s", float(lock.impulse[ROOT]), "neither"),
        Metric("angle_miss_root", "angle miss, root", "rad", at_lock.miss),
        Metric("angle_miss_elbow", "angle miss, elbow", "rad", at_end.miss),
        Metric("smoothness_weight", "weight of the smoothness", "1", weight, "neither"),
        Metric(
            "sampled_residual_energy",
            f"the larger energy after a lock, sampled every {sampled.step:.4g} s",
            "J",
            sampled.left,
        ),
    ]


def _beside(
    study: SequenceStudy, found: Refined, solve: Callable[..., OptimalMotion]
) -> tuple[list[Metric], list[str]]:
    """What rest and smoothness cost, and a sentence for each part that was not found."""
    cap, left = study.torque_cap, study.lock_energy
    parts: list[Callable[[], list[Metric]]] = []
    if cap is not None:
        parts.append(lambda: _sums(stated_case(study), found.motion, cap, solve))
    if left is not None:
        parts.append(lambda: _without_rest(study, found.motion, left, solve))

    entries: list[Metric] = []
    left_out = []
    for part in parts:
        try:
            entries += part()
        except StudyError as error:
            left_out.append(f"comparison with the sequence left out: {error}")
    return entries, left_out


def _sums(
    case: Sequence, motion: OptimalMotion, cap: float, solve: Callable[..., OptimalMotion]
) -> list[Metric]:
    """What the sequence gains over both stages alone, each in its least time under a cap [N m]."""
    intervals = SEQUENCE_INTERVALS[0], SEQUENCE_INTERVALS[2]
    first, second = (
        solve(stage_alone(stage, cap, case.moving_time), SMOOTHING, None, (count,)).stage.duration
        for stage, count in zip((case.first, case.second), intervals, strict=True)
    )
    less = sum(stage.duration for stage in motion.stages) - first - second
    return [
        Metric("big_arm_alone", "big arm alone", "s", first, "neither"),
        Metric("small_arm_alone", "small arm alone", "s", second, "neither"),
        Metric("sum_alone", "sum of both alone", "s", first + second, "neither"),
        Metric("less_than_sum", "sequence less the sum", "s", less, "neither"),
    ]


def _without_rest(
    study: SequenceStudy, motion: OptimalMotion, left: float, solve: Callable[..., OptimalMotion]
) -> list[Metric]:
    """The same sequence where the first lock may meet an energy [J], rest only after the last."""
    stated = sequence_problem(stated_case(study), study.least, study.torque_cap, left)
    freed = solve(stated, motion.weight, None, SEQUENCE_INTERVALS, motion.trajectory)
    at_lock, at_end = replay_reduced(freed.motions("torque"), freed.dwells[0])

    head = "no rest at the first lock"
    quantities = [
        Metric("freed_allowed", f"{head}: allowed energy", "J", left, "neither"),
        Metric("freed_first", f"{head}: energy after the first lock, B21", "J", at_lock),
        Metric("freed_last", f"{head}: energy after the last lock, B21", "J", at_end),
    ]

    if study.least == "time":
        time, before = (sum(s.duration for s in one.stages) for one in (freed, motion))
        quantities += [
            Metric("freed_time", f"{head}: both motions", "s", time),
            Metric("freed_gain", f"{head}: gain", "s", before - time, "more"),
        ]
    else:
        peak, before = (float(one.peak_torque.max()) for one in (freed, motion))
        gain = 100 * (1 - peak / before)
        quantities += [
            Metric("freed_peak", f"{head}: peak torque", "N m", peak),
            Metric("freed_gain", f"{head}: gain", "%", gain, "more"),
        ]
    return quantities
