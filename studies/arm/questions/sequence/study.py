"""A sequence of both stages from its configuration to its result."""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable

import numpy as np

from models.ancf.integrate import StepControl
from models.arm.reduced_simulation import reduced_modes
from studies.arm.config import SequenceStudy, as_dictionary
from studies.arm.optimal.finished_solves import FinishedSolves, Solve, within
from studies.arm.optimal.refinement import AGREE, FLOOR
from studies.arm.optimal.rounds import MISS, SAME
from studies.arm.optimal.solve import MOST_PERIODS
from studies.arm.questions.sequence.problem import Sequence, locked, sequence, turning
from studies.arm.questions.sequence.profile import (
    INTERPOLATION,
    SampledSequence,
    load_series,
    profile_series,
    sampled_to,
    torque_series,
)
from studies.arm.questions.sequence.refinement import RefinedSequence, refine_sequence
from studies.arm.questions.sequence.replay import SequenceReplay, replay_reduced, replay_sequence
from studies.arm.questions.sequence.solve import (
    OptimalSequence,
    SequenceLaw,
    alone,
    solve_sequence,
)
from studies.arm.replay.full_model import ELEMENTS, followed, steps_for
from studies.arm.report.quantities import CAP_EXCESS, Metric, table_rows
from studies.arm.report.traces import Trace
from studies.arm.search_limits import SEQUENCE_WINDOW, UNRESOLVED
from studies.arm.stage import ROOT
from studies.common.console import Console
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.processes.side_by_side import Part, side_by_side
from studies.common.result import Criterion, Result, Verdict
from studies.common.scene.chain_shapes import shape_series

PAPER = (86.0, 112.0)  # [s]
FINER = 3  # halves of the elements of a link, on which the residuals are found again
_PACE = 1.1  # of the rigid bound, at which the guess under a cap moves
_AFTER = 401  # instants of the quarter of the small arm's time that is followed after its lock


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
    solver = within(until, FinishedSolves(kept, console.progress))
    first = solve_sequence(
        case, study.least, study.torque_cap, progress=console.live, solver=solver
    )
    found = refine_sequence(
        first,
        residual=study.residual_energy,
        say=console.progress,
        live=console.live,
        solver=solver,
        until=until,
    )
    check_rest(found)
    solved, settings = found.solved, steps_for(study.residual_energy)
    console.live("replaying on a finer full model, and sampled")
    law = solved.law
    parts = [
        Part(_finer, (law, settings)),
        Part(_sampled, (law, study.residual_energy, study.sample_time)),
        Part(_on_B21, (law,)),
    ]
    finer, sampled, on_B21 = side_by_side(parts, console)

    # what goes on swinging after the last lock
    small_time = solved.durations[2]
    after = np.linspace(small_time, 1.25 * small_time, _AFTER)
    replayed = dataclasses.replace(found.replay, second=followed(found.replay.second, after))

    beside, left_out = _beside(study, solved, console, solver)
    arrays = profile_series(sampled, replayed) | torque_series(law)
    arrays |= load_series(replayed, solved.durations)
    for motion in (replayed.first, replayed.second):
        arrays |= Trace.of(motion).series()
    arrays |= shape_series((*replayed.first.run.runs, *replayed.second.run.runs))
    return Result(
        kind="arm-sequence",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=arrays,
        table=table_rows({"optimum": [*_facts(found, sampled, on_B21), *beside]}),
        bounds={"rigid arm of this time, best split: peak torque [N m]": solved.rigid_bound},
        verdict=_verdict(found, study.seconds),
        checks=_criteria(study, found, finer, sampled),
        remarks=("the total is that of both motions, the dwell on top", *left_out),
        details={
            "durations": solved.durations,
            "rigid_bound_Nm": solved.rigid_bound,
            "rounds": [dataclasses.asdict(entry) for entry in found.rounds],
            "accuracy": {
                "residual_energy_of_the_sampled_profile_J": sampled.replay.left,
                "sample_time_s": sampled.step,
                "interpolation": INTERPOLATION,
            },
        },
        provenance=provenance(),
    )


def _finer(law: SequenceLaw, settings: StepControl, console: Console) -> SequenceReplay:
    """Its replay with half as many elements again."""
    return replay_sequence(law, FINER * ELEMENTS // 2, settings)


def _sampled(
    law: SequenceLaw, residual: float, step: float | None, console: Console
) -> SampledSequence:
    """Its profile."""
    return sampled_to(law, residual, step)


def _on_B21(law: SequenceLaw, console: Console) -> tuple[float, float]:
    """What both locks leave on B21 [J]."""
    return replay_reduced(law)


def check_rest(found: RefinedSequence) -> None:
    """Refuse a sequence that the mesh does not resolve: its finer replays take hours.

    Raises
    ------
    StudyError
        With what the best round leaves.
    """
    left, allowed = found.replay.left, found.residual
    if left > UNRESOLVED * allowed:
        more = "more --seconds, " if found.late else ""
        raise StudyError(
            f"no sequence was found that comes to rest: the best of {len(found.rounds)} rounds "
            f"leaves {left:.2e} J on the full model, and {allowed:g} J are allowed; give {more}a "
            "longer total or dwell, or allow more residual energy",
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
            f"lock_energy is {study.lock_energy:g} J, but a rigid arm that constant torque speeds "
            f"up until its lock, for the shortest time tried of {shortest:.3g} s, has "
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
            f"{fastest * longest:.3g} periods of the arm's fastest mode, and up to "
            f"{MOST_PERIODS:g} are resolved; give a torque cap of at least {1.01 * least:.3g} N m"
        )


def paced(case: Sequence, cap: float) -> Sequence:
    """The sequence at the pace of a cap, a tenth above the rigid bound."""
    total = case.moving_time * float(np.sqrt(_PACE * case.rigid_bound / cap))
    return sequence(total, case.dwell, case.first.arm)


def _verdict(found: RefinedSequence, seconds: float) -> Verdict:
    if found.late and not (found.still and found.settled):
        return Verdict(
            "unverified",
            f"unverified: the {seconds:g} s of the search ended before all of its rounds "
            "were done; give more --seconds",
        )
    if not found.still:
        return Verdict(
            "unverified",
            f"unverified: a lock leaves {found.replay.left:.2e} J on the full model, more than the "
            f"{found.residual:g} J allowed; allow more, or give a longer time",
        )
    if not found.settled:
        return Verdict(
            "unverified",
            "unverified: less smoothness and a finer mesh still gain more than a per cent; allow "
            "more residual energy, or give a longer time",
        )
    return Verdict(
        "local",
        "local: one optimum of the reduced model B21, replayed on the full ANCF model; others "
        "were not sought",
    )


def _criteria(
    study: SequenceStudy,
    found: RefinedSequence,
    finer: SequenceReplay,
    sampled: SampledSequence,
) -> tuple[Criterion, ...]:
    """What must hold: each lock by itself, the same on a finer model, sampled, caps, angles."""
    replayed, allowed = found.replay, found.residual
    checks = [
        _verified(f"the {which} lock leaves no more than the residual allowed", "J", left, allowed)
        for which, left in (("first", replayed.at_lock), ("last", replayed.at_end))
    ]

    off = max(abs(finer.at_lock - replayed.at_lock), abs(finer.at_end - replayed.at_end))
    name = f"half as many elements again change what is left by {AGREE:.0%} of what is allowed"
    checks.append(_verified(f"{name} at most", "J", off, max(AGREE * allowed, FLOOR)))

    name = f"the profile sampled every {sampled.step:.4g} s leaves no more than the residual"
    checks.append(_verified(f"{name} allowed", "J", sampled.replay.left, allowed))

    miss = max(replayed.root_miss, replayed.elbow_miss)
    checks.append(_verified("the joints reach their angles", "rad", miss, MISS))
    name = (
        f"the last halving of smoothness and interval changes the objective by {SAME:.0%} at most"
    )
    checks.append(_verified(name, "1", abs(found.change), SAME))

    cap, peak = study.torque_cap, max(found.solved.peaks)
    if cap is not None:
        name = "the torque is within its cap between the points"
        checks.append(_verified(name, "N m", peak, cap, CAP_EXCESS))
    return tuple(checks)


def _verified(name: str, unit: str, value: float, limit: float, excess: float = 0.0) -> Criterion:
    held = bool(value <= limit * (1 + excess))
    sentence = f"{'verified' if held else 'FAILED'}: {name}"
    return Criterion(name, unit, float(value), float(limit), held, sentence)


def _facts(
    found: RefinedSequence, sampled: SampledSequence, on_B21: tuple[float, float]
) -> list[Metric]:
    """Times, torques and what the locks leave."""
    solved, replayed = found.solved, found.replay
    case, bound = solved.case, solved.rigid_bound
    big, dwell, small = solved.durations
    root, elbow = solved.peaks

    # the bounds of a rigid arm, in this time and in the paper's
    over = 100 * (max(solved.peaks) / bound - 1)
    inertia_turns = case.first.inertias[0] * np.pi / 2, case.second.inertias[1] * np.pi
    paper = max(4.0 * turn / T**2 for turn, T in zip(inertia_turns, PAPER, strict=True))

    first = "energy after the first lock"
    last = "energy after the last lock"
    lock, impulse = replayed.first.run.engagement, "impulse of the first lock at the root"
    return [
        Metric("big_arm_time", "big arm", "s", big, "neither"),
        Metric("dwell", "dwell", "s", dwell, "neither"),
        Metric("small_arm_time", "small arm", "s", small, "neither"),
        Metric("moving_time", "both motions", "s", solved.moving_time),
        Metric("peak_root_torque", "peak torque, root", "N m", root),
        Metric("peak_elbow_torque", "peak torque, elbow", "N m", elbow),
        Metric("rigid_bound", "rigid bound of this time, best split", "N m", bound, "neither"),
        Metric("surcharge", "surcharge over the rigid bound", "%", over),
        Metric("paper_bound", "rigid bound of the paper's 86 and 112 s", "N m", paper, "neither"),
        Metric("first_lock_energy", f"{first}, full model", "J", replayed.at_lock),
        Metric("first_lock_energy_B21", f"{first}, B21, aimed", "J", on_B21[0], "neither"),
        Metric("residual_energy", f"{last}, full model", "J", replayed.at_end),
        Metric("residual_energy_B21", f"{last}, B21, aimed", "J", on_B21[1], "neither"),
        Metric("lost_first", "kinetic energy lost in the first lock", "J", lock.lost_energy),
        Metric("impulse_first", impulse, "N m s", float(lock.impulse[ROOT]), "neither"),
        Metric("angle_miss_root", "angle miss, root", "rad", replayed.root_miss),
        Metric("angle_miss_elbow", "angle miss, elbow", "rad", replayed.elbow_miss),
        Metric("smoothness_weight", "weight of the smoothness", "1", solved.weight, "neither"),
        Metric(
            "sampled_residual_energy",
            f"the larger energy after a lock, sampled every {sampled.step:.4g} s",
            "J",
            sampled.replay.left,
        ),
    ]


def _beside(
    study: SequenceStudy, solved: OptimalSequence, console: Console, solver: Solve
) -> tuple[list[Metric], list[str]]:
    """What rest and smoothness cost, and a sentence for each part that was not found."""
    cap, left = study.torque_cap, study.lock_energy
    parts: list[Callable[[], list[Metric]]] = []
    if cap is not None:
        parts.append(lambda: _sums(solved, cap, console, solver))
    if left is not None:
        parts.append(lambda: _without_rest(study, solved, left, console, solver))

    entries: list[Metric] = []
    left_out = []
    for part in parts:
        try:
            entries += part()
        except StudyError as error:
            left_out.append(f"left out: {error}")
    return entries, left_out


def _sums(solved: OptimalSequence, cap: float, console: Console, solver: Solve) -> list[Metric]:
    """What the sequence gains over both stages alone."""
    first, second = alone(solved.case, cap, console.live, solver)
    less = solved.moving_time - first - second
    return [
        Metric("big_arm_alone", "big arm alone", "s", first, "neither"),
        Metric("small_arm_alone", "small arm alone", "s", second, "neither"),
        Metric("sum_alone", "sum of both alone", "s", first + second, "neither"),
        Metric("less_than_sum", "sequence less the sum", "s", less, "neither"),
    ]


def _without_rest(
    study: SequenceStudy,
    solved: OptimalSequence,
    left: float,
    console: Console,
    solver: Solve,
) -> list[Metric]:
    """The same sequence where the first lock may meet an energy [J], rest only after the last."""
    freed = solve_sequence(
        solved.case,
        study.least,
        study.torque_cap,
        guess=solved.trajectory,
        left=left,
        smoothing=solved.weight,
        progress=console.live,
        solver=solver,
    )
    at_lock, at_end = replay_reduced(freed.law)

    head = "no rest at the first lock"
    quantities = [
        Metric("freed_allowed", f"{head}: energy it may meet", "J", left, "neither"),
        Metric("freed_first", f"{head}: energy after the first lock, B21", "J", at_lock),
        Metric("freed_last", f"{head}: energy after the last lock, B21", "J", at_end),
    ]

    if study.least == "time":
        gain = solved.moving_time - freed.moving_time
        quantities += [
            Metric("freed_time", f"{head}: both motions", "s", freed.moving_time),
            Metric("freed_gain", f"{head}: gain", "s", gain, "more"),
        ]
    else:
        peak = max(freed.peaks)
        gain = 100 * (1 - peak / max(solved.peaks))
        quantities += [
            Metric("freed_peak", f"{head}: peak torque", "N m", peak),
            Metric("freed_gain", f"{head}: gain", "%", gain, "more"),
        ]
    return quantities
