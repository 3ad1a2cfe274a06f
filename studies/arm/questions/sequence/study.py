"""A sequence of both stages from its configuration to its result."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ocp.arrays import Array
from studies.arm.config import SequenceStudy, as_dictionary
from studies.arm.questions.sequence.problem import SMOOTHING, Sequence, sequence
from studies.arm.questions.sequence.solve import (
    OptimalSequence,
    SequenceReplay,
    alone,
    lighter_smoothing,
    replay_reduced,
    replay_sequence,
    solve_sequence,
)
from studies.arm.report.quantities import CAP_EXCESS, Metric, table_rows
from studies.arm.stage import ROOT
from studies.common.console import Console
from studies.common.exit_codes import StudyError
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict
from studies.common.scene.chain_shapes import shape_series

AGREE = 0.2  # share of the full model's energy by which B21 may differ
STILL = 1e-8  # [J] below which both count as still
PAPER = (86.0, 112.0)  # [s]
_PACE = 1.1  # of the rigid bound, at which the guess under a cap moves
_FIGURE_SAMPLES = 4001


def find_sequence(study: SequenceStudy, console: Console) -> Result:
    """Big arm, locked dwell and small arm as one problem.

    Raises
    ------
    StudyError
        If no motion is found.
    """
    case = stated_case(study)
    solved = solve_sequence(case, study.least, study.torque_cap, progress=console.live)
    console.progress("solved; replaying on B21 and on the full model")
    replayed = replay_sequence(solved)

    beside, left_out = _beside(study, solved, console)
    agrees = agree(replayed)
    return Result(
        kind="arm-sequence",
        question=study.question,
        configuration=as_dictionary(study),
        arrays=_series(solved, study.sample_time)
        | shape_series((*replayed.first.runs, *replayed.second.runs)),
        table=table_rows({"optimum": [*_facts(solved, replayed), *beside]}),
        bounds={"rigid arm of this time, best split: peak torque [N m]": solved.rigid_bound},
        verdict=Verdict(
            "local" if agrees else "unverified",
            "local: one optimum of the reduced model B21, replayed on the full ANCF model; others "
            "were not sought"
            if agrees
            else "unverified: B21 and the full model differ in what the last lock leaves",
        ),
        checks=_criteria(study, solved, replayed),
        remarks=(
            f"both arms' smoothness counts {SMOOTHING:g} beside the objective; the total is that "
            "of both motions, the dwell on top",
            *left_out,
        ),
        details={"durations": solved.durations, "rigid_bound_Nm": solved.rigid_bound},
        provenance=provenance(),
    )


def stated_case(study: SequenceStudy) -> Sequence:
    """The sequence that is asked for, as the rigid bound splits it."""
    case = sequence(study.total, study.dwell, study.arm.parameters)
    # the guess moves at the pace of the cap, whatever total time is stated
    return case if study.torque_cap is None else paced(case, study.torque_cap)


def paced(case: Sequence, cap: float) -> Sequence:
    """The sequence at the pace of a cap, a tenth above the rigid bound."""
    total = case.moving_time * float(np.sqrt(_PACE * case.rigid_bound / cap))
    return sequence(total, case.dwell, case.first.arm)


def agree(replayed: SequenceReplay) -> bool:
    """Whether both models leave the same energy, or next to none."""
    full, reduced = replayed.at_end, replayed.reduced[1]
    return max(full, reduced) <= STILL or abs(full - reduced) <= AGREE * full


def _criteria(
    study: SequenceStudy, solved: OptimalSequence, replayed: SequenceReplay
) -> tuple[Criterion, ...]:
    held = agree(replayed)
    name = "the replays on B21 and on the full model agree in residual energy"
    off = abs(replayed.at_end - replayed.reduced[1])
    checks = [Criterion(name, "J", off, AGREE * replayed.at_end, held, _sentence(held, name))]
    if study.torque_cap is not None:
        peak = max(solved.peaks)
        held = peak <= study.torque_cap * (1 + CAP_EXCESS)
        name = "the torque is within its cap between the points"
        checks.append(Criterion(name, "N m", peak, study.torque_cap, held, _sentence(held, name)))
    return tuple(checks)


def _sentence(held: bool, name: str) -> str:
    return f"{'verified' if held else 'FAILED'}: {name}"


def _facts(solved: OptimalSequence, replayed: SequenceReplay) -> list[Metric]:
    """Times, torques and what the locks leave."""
    case, bound = solved.case, solved.rigid_bound
    big, dwell, small = solved.durations
    root, elbow = solved.peaks

    # the bounds of a rigid arm, in this time and in the paper's
    over = 100 * (max(solved.peaks) / bound - 1)
    inertia_turns = case.first.inertias[0] * np.pi / 2, case.second.inertias[1] * np.pi
    paper = max(4.0 * turn / T**2 for turn, T in zip(inertia_turns, PAPER, strict=True))

    first = "energy after the first lock"
    last = "energy after the last lock"
    lock, impulse = replayed.first.engagement, "impulse of the first lock at the root"
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
        Metric("first_lock_energy_B21", f"{first}, B21", "J", replayed.reduced[0]),
        Metric("residual_energy", f"{last}, full model", "J", replayed.at_end),
        Metric("residual_energy_B21", f"{last}, B21", "J", replayed.reduced[1]),
        Metric("lost_first", "kinetic energy lost in the first lock", "J", lock.lost_energy),
        Metric("impulse_first", impulse, "N m s", float(lock.impulse[ROOT]), "neither"),
        Metric("angle_miss_root", "angle miss, root", "rad", replayed.root_miss),
        Metric("angle_miss_elbow", "angle miss, elbow", "rad", replayed.elbow_miss),
    ]


def _beside(
    study: SequenceStudy, solved: OptimalSequence, console: Console
) -> tuple[list[Metric], list[str]]:
    """What rest and smoothness cost, and a sentence for each part that was not found."""
    cap, left = study.torque_cap, study.lock_energy
    parts: list[Callable[[], list[Metric]]] = []
    if cap is not None:
        parts.append(lambda: _sums(solved, cap, console))
    else:
        parts.append(lambda: _smoothing_costs(solved, console))
    if left is not None:
        parts.append(lambda: _without_rest(study, solved, left, console))

    entries: list[Metric] = []
    left_out = []
    for part in parts:
        try:
            entries += part()
        except StudyError as error:
            left_out.append(f"left out: {error}")
    return entries, left_out


def _sums(solved: OptimalSequence, cap: float, console: Console) -> list[Metric]:
    """What the sequence gains over both stages alone."""
    first, second = alone(solved.case, cap, console.live)
    less = solved.moving_time - first - second
    return [
        Metric("big_arm_alone", "big arm alone", "s", first, "neither"),
        Metric("small_arm_alone", "small arm alone", "s", second, "neither"),
        Metric("sum_alone", "sum of both alone", "s", first + second, "neither"),
        Metric("less_than_sum", "sequence less the sum", "s", less, "neither"),
    ]


def _smoothing_costs(solved: OptimalSequence, console: Console) -> list[Metric]:
    """Common peak torque, and its surcharge, where the smoothness weighs less and less."""
    quantities = []
    for number, (weight, lighter) in enumerate(lighter_smoothing(solved, console.live), start=1):
        # the common peak is what is least: the larger of both
        peak = max(lighter.peaks)
        over = 100 * (peak / solved.case.rigid_bound - 1)
        tail = f"smoothness at {weight:g}"
        quantities += [
            Metric(f"peak_lighter_{number}", f"peak torque, {tail}", "N m", peak),
            Metric(
                f"surcharge_lighter_{number}", f"surcharge over the rigid bound, {tail}", "%", over
            ),
        ]
    return quantities


def _without_rest(
    study: SequenceStudy, solved: OptimalSequence, left: float, console: Console
) -> list[Metric]:
    """The same sequence where the first lock may meet an energy [J], rest only after the last."""
    freed = solve_sequence(
        solved.case,
        study.least,
        study.torque_cap,
        guess=solved.trajectory,
        left=left,
        progress=console.live,
    )
    at_lock, at_end = replay_reduced(freed)

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


def _series(solved: OptimalSequence, step: float) -> dict[str, Series]:
    """Both torques at a sample time, from the start of the big arm, and densely for the figure."""
    end = float(np.sum(solved.durations))
    arrays: dict[str, Series] = {}
    for axis, count in (
        ("time", max(2, round(end / step) + 1)),
        ("figure/time", _FIGURE_SAMPLES),
    ):
        times = np.linspace(0.0, end, count)
        # the figure is finer than what is handed on
        head = axis.removesuffix("time")
        arrays[axis] = Series("s", axis, times, "since the release of the root")
        for joint, torque in zip(("root", "elbow"), _torques(solved, times), strict=True):
            name = f"{head}{joint}_torque"
            arrays[name] = Series("N m", axis, torque, f"of the {joint}'s drive")
    return arrays


def _torques(solved: OptimalSequence, times: Array) -> tuple[Array, Array]:
    """Torques of root and elbow (m,) [N m], zero while their joint is locked."""
    root, elbow = solved.torques
    lock, released_at, _ = np.cumsum(solved.durations)
    return (
        np.where(times <= lock, root(np.clip(times, 0, lock)), 0.0),
        np.where(times >= released_at, elbow(np.clip(times - released_at, 0, elbow.x[-1])), 0.0),
    )
