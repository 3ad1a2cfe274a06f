"""A turn from its configuration to its result.

What the engine finds is a drive of constant accelerations. The antenna's answer to it is worked out
anew, in sines and without an integrator, and so is that to the paper's laws.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import time as clock
from collections.abc import Mapping
from typing import Any

import numpy as np

from models.laws import Bezier, Law, Step5, paper_points
from models.turn import (
    BangTurn,
    TurnResponse,
    least_torque_bound,
    least_torque_turn,
    least_turn_time_bound,
    torque_limited_turn,
    turn_response,
)
from ocp import OcpError, Solution, solve
from studies.common.comparison_table import TableRow, costs_elsewhere
from studies.common.configuration import as_stated
from studies.common.console import Console, at_work
from studies.common.exit_codes import ExitCode, StudyError
from studies.common.finished import NOTHING_KEPT, FinishedSteps
from studies.common.folder import provenance
from studies.common.result import Criterion, Result, Series, Verdict, at_most
from studies.common.rounding import up
from studies.common.second_solve import second_solve
from studies.truss.limits.tolerances import ANGLE_MISS, CAPS, REST
from studies.turn.config import TurnStudy
from studies.turn.problem import rows_of, state

OPTIMUM = "optimum"
ROWS = 4001  # evenly spaced, beside the switches
AFTER = 6.0  # periods of the swing that are followed when the drive stands
AFTER_ROWS = 241
MET = 1e-5  # relative: so close to its closed form an optimum counts as that
NARROW = 1e-12  # of the duration: an interval of a mesh that is left out
SAME = 1e-3  # of what a rigid arm's drive needs: what differs by less is one arc to a reader
FEW = 12  # arcs that a sentence lists
START = 1.05  # of the bound: duration of a first guess without a closed form

UNITS = {
    "time": ("s", "since the start"),
    "drive_angle": ("rad", "angle of the drive at the root"),
    "drive_rate": ("rad/s", "its rate"),
    "drive_acceleration": ("rad/s^2", "rate of that"),
    "antenna_angle": ("rad", "angle of the antenna"),
    "antenna_rate": ("rad/s", "its rate"),
    "torque": ("N m", "torque in the big arm, which the drive gives"),
}


def check(study: TurnStudy, console: Console | None = None) -> None:
    """Refuse what cannot be met, before any work.

    Raises
    ------
    StudyError
        With the number to ask for.
    """
    angle, duration = study.angle, study.duration
    if study.minimise == "time":
        least = least_duration(study)
        if least > duration:
            raise StudyError(
                f"duration is {duration:g} s, but no turn under these caps takes less than "
                f"{least:.6g} s; state more than {up(least)} s, or raise torque or "
                "drive_acceleration",
                ExitCode.INFEASIBLE,
            )
        return

    # a drive that speeds up for half of the time and brakes for the other half turns by a T^2/4
    needed = 4.0 * angle / duration**2
    if study.drive_acceleration < needed:
        raise StudyError(
            f"drive_acceleration is {study.drive_acceleration:g} rad/s^2, but a turn of "
            f"{study.angle_deg:g} deg in {duration:g} s needs more than {needed:.6g} rad/s^2; "
            f"state more than {up(needed)}, or a longer duration",
            ExitCode.INFEASIBLE,
        )

    least = least_torque(study)
    if least > study.torque:
        raise StudyError(
            f"torque is {study.torque:g} N m, but no turn of {duration:g} s needs less than "
            f"{least:.6g} N m; state at least {up(least)} N m, or a longer duration",
            ExitCode.INFEASIBLE,
        )


def closed_form(study: TurnStudy) -> BangTurn | None:
    """The best turn; None where it has no closed form."""
    turn, limit = study.parameters, study.drive_acceleration
    if study.minimise == "time":
        return torque_limited_turn(turn, study.angle, study.torque, limit)
    return least_torque_turn(turn, study.angle, study.duration, limit)


def least_torque(study: TurnStudy) -> float:
    """A bound on the peak torque in the duration [N m], by the closed form if there is one."""
    known = closed_form(study)
    if known is not None:
        return known.peak_torque
    return least_torque_bound(study.parameters, study.angle, study.duration)


def least_duration(study: TurnStudy) -> float:
    """A bound on the duration under the caps [s], by the closed form if there is one."""
    known = closed_form(study)
    if known is not None:
        return known.duration
    limits = (study.torque, study.drive_acceleration)
    return least_turn_time_bound(study.parameters, study.angle, *limits)


def run(
    study: TurnStudy, console: Console | None = None, *, kept: FinishedSteps = NOTHING_KEPT
) -> Result:
    """Find the turn, and compare it with the paper's laws for the drive.

    Parameters
    ----------
    study : TurnStudy
        What is asked.
    console : Console, optional
        Where lines of progress go: standard error by default. `silent()` shows none.
    kept : FinishedSteps, optional
        Where finished solves go to, and where those of an earlier run are read.

    Returns
    -------
    Result
        Of the kind "turn".

    Raises
    ------
    StudyError
        If no turn meets the caps, or none was found.
    """
    check(study)
    with at_work(console) as told:
        return _result(study, told, kept)


def _result(study: TurnStudy, console: Console, kept: FinishedSteps) -> Result:
    known = closed_form(study)
    statement = state(study, known or _rigid(study), known is not None)
    begin = clock.monotonic()
    problem, settings = statement.problem, statement.settings
    take = functools.partial(solve, problem, settings=settings, progress=console.live)
    try:
        found = kept.step("turn", take, problem, console.progress)
    except OcpError as error:
        raise StudyError(str(error), ExitCode.NOT_SOLVED) from error
    console.progress(f"solved in {clock.monotonic() - begin:.1f} s")
    second = second_solve(found, settings, console, kept=kept)

    drive = _drive_of(second.solution, statement.acceleration, study)
    duration = drive.duration
    moved = {OPTIMUM: turn_response(study.parameters, *rows_of(drive, ROWS))}
    start = paper_points(0.0, study.angle)
    for name, law in (
        ("Bezier", Bezier(duration, start)),
        ("Step5", Step5(duration, 0.0, study.angle)),
    ):
        moved[name] = _under(study, law)

    rows = _table(study, moved)
    own = moved[OPTIMUM]
    return Result(
        kind="turn",
        question=study.question,
        configuration=as_stated(study),
        arrays=_series(study, moved),
        table=rows,
        bounds={row.key: row.bound for row in rows if row.bound is not None},
        verdict=_verdict(study, second.solution, known),
        checks=(*_checks(study, own, second.solution), second.check),
        costs_elsewhere=costs_elsewhere(rows),
        remarks=_remarks(study, drive),
        details={
            "parameters": dataclasses.asdict(study.parameters),
            "frequency_Hz": study.parameters.frequency / (2 * math.pi),
            "switches": drive.switches,
            "accelerations": drive.accelerations,
            "engine": {"passed": second.solution.verification.passed},
        },
        provenance=provenance(),
        interrupted=second.interrupted,
    )


def _rigid(study: TurnStudy) -> BangTurn:
    """A first guess where there is no closed form: the drive pushes half of the way, and brakes."""
    duration = study.duration
    if study.minimise == "time":
        duration = min(duration, START * least_duration(study))
    push = 4.0 * study.angle / duration**2
    switches = (0.0, duration / 2, duration)
    return BangTurn(switches, (push, -push), study.parameters.inertia * push)


def _drive_of(solution: Solution, name: str, study: TurnStudy) -> BangTurn:
    """The drive that the engine found: a constant acceleration in each interval of its mesh."""
    phase = solution.trajectory.phases[0]
    kept = np.flatnonzero(np.diff(phase.breakpoints) > NARROW * phase.end)
    values = phase.polynomial(name).powers()[kept, 0, 0]
    edges = np.append(phase.breakpoints[kept], phase.end)
    edges[0] = 0.0
    # arcs of one acceleration, as far as the solver holds it, are one
    arcs = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist()]
    switches = (*edges[arcs].tolist(), float(edges[-1]))
    return BangTurn(switches, tuple(values[arcs].tolist()), study.torque)


def _under(study: TurnStudy, law: Law) -> TurnResponse:
    """What the antenna does if the drive follows a law."""
    time = np.union1d(np.linspace(0.0, law.duration, 4 * ROWS), law.breakpoints)
    acceleration = law.motion(time).acceleration
    return turn_response(study.parameters, time, acceleration, acceleration)


def _table(study: TurnStudy, moved: Mapping[str, TurnResponse]) -> tuple[TableRow, ...]:
    timed = study.minimise == "time"
    torque_bound = None if timed else least_torque(study)

    def row(key: str, title: str, unit: str, values: Mapping[str, float], **more: Any) -> TableRow:
        cap = more.get("cap")
        broken = [
            law for law, value in values.items() if cap is not None and value > cap * (1 + CAPS)
        ]
        return TableRow(key, title, unit, values, better="less", broken_by=tuple(broken), **more)

    def peaks(name: str) -> dict[str, float]:
        return {law: float(np.abs(getattr(one, name)).max()) for law, one in moved.items()}

    return (
        row(
            "duration",
            "duration",
            "s",
            {law: float(one.time[-1]) for law, one in moved.items()},
            bound=least_duration(study) if timed else None,
            minimised=timed,
        ),
        row(
            "peak_torque",
            "peak torque in the big arm",
            "N m",
            peaks("torque"),
            cap=study.torque,
            bound=torque_bound,
            minimised=not timed,
        ),
        row(
            "energy_left",
            "swing left when the drive stands",
            "J",
            {law: float(one.energy[-1]) for law, one in moved.items()},
            cap=study.residual_energy,
        ),
        row(
            "peak_drive_speed",
            "peak speed of the drive",
            "rad/s",
            peaks("drive_rate"),
        ),
        row(
            "peak_drive_acceleration",
            "peak acceleration of the drive",
            "rad/s^2",
            peaks("drive_acceleration"),
            cap=study.drive_acceleration,
        ),
        row(
            "largest_twist",
            "largest twist of the big arm",
            "rad",
            {law: value / study.parameters.stiffness for law, value in peaks("torque").items()},
        ),
    )


def _series(study: TurnStudy, moved: Mapping[str, TurnResponse]) -> dict[str, Series]:
    """Histories of the optimum by plain names, those of the laws behind theirs; and the swings."""
    arrays = {}
    for law, one in moved.items():
        head = "" if law == OPTIMUM else f"{law}-"
        for name, (unit, meaning) in UNITS.items():
            values = getattr(one, name)
            arrays[f"{head}{name}"] = Series(unit, f"{head}time", values, meaning)
    period = 2 * math.pi / study.parameters.frequency
    after = np.linspace(0.0, AFTER * period, AFTER_ROWS)
    arrays["after"] = Series("s", "after", after, "since the drive stands")
    for law, one in moved.items():
        w = study.parameters.frequency
        off = one.antenna_angle[-1] - one.drive_angle[-1]
        swing = off * np.cos(w * after) + one.antenna_rate[-1] / w * np.sin(w * after)
        meaning = f"angle of the antenna about its rest after the {law} law"
        arrays[f"{law}-swing"] = Series("rad", "after", swing, meaning)
    return arrays


def _checks(study: TurnStudy, own: TurnResponse, solution: Solution) -> tuple[Criterion, ...]:
    """The optimum by its own response, which knows nothing of the engine."""
    speed = float(np.abs(own.drive_rate).max())
    checks = [
        at_most(
            "miss of the end angle",
            "rad",
            max(abs(own.antenna_angle[-1] - study.angle), abs(own.drive_angle[-1] - study.angle)),
            ANGLE_MISS,
        ),
        at_most("speed of the drive at the end", "rad/s", abs(own.drive_rate[-1]), REST * speed),
        at_most("swing left when the drive stands", "J", own.energy[-1], study.residual_energy),
        at_most("peak torque", "N m", np.abs(own.torque).max(), study.torque * (1 + CAPS)),
        at_most(
            "peak acceleration of the drive",
            "rad/s^2",
            np.abs(own.drive_acceleration).max(),
            study.drive_acceleration * (1 + CAPS),
        ),
    ]

    verification = solution.verification
    passed, words = verification.passed, "; ".join(verification.reasons)
    sentence = "passed" if passed else f"FAILED: {words}"
    checks.append(
        Criterion(
            "the engine's verification",
            "1",
            verification.miss,
            math.nan,
            passed,
            f"{sentence}: the engine's replay and its evaluation between the points",
        )
    )
    return tuple(checks)


def _verdict(study: TurnStudy, solution: Solution, known: BangTurn | None) -> Verdict:
    if not solution.verification.passed:
        return Verdict("unverified", "; ".join(solution.verification.reasons))
    if known is None:
        return Verdict(
            "local",
            "local: one start; in a given duration dynamics and limits are linear, so that no "
            "other optimum is better",
        )
    best = known.duration if study.minimise == "time" else known.peak_torque
    off = abs(solution.objective / best - 1.0)
    if off > MET:
        return Verdict("local", f"local: {off:.1e} above the closed form, {best:.9g}")
    return Verdict("global", f"global: within {off:.1e} of the closed form, {best:.9g}")


def _remarks(study: TurnStudy, drive: BangTurn) -> tuple[str, ...]:
    turn = study.parameters
    return (
        f"The antenna has {turn.inertia:.4g} kg m^2 about the axis of the big arm, which twists by "
        f"{turn.stiffness:.5g} N m/rad: {turn.frequency / (2 * math.pi):.4g} Hz on a drive that "
        "stands.",
        *_arcs_in_words(drive, 4.0 * study.angle / drive.duration**2),
        "The paper gives no parameters of this stage. Assumed are a drive at the root of the big "
        "arm, a folded small arm, and a stowed ring that is a thin hoop, its centre its own radius "
        "away from the axis.",
        "Left out are bending of the arm, damping, the inertia of the tubes about the axis, and "
        "that of the drive.",
    )


def _arcs_in_words(drive: BangTurn, rigid: float) -> tuple[str, ...]:
    """The arcs of the drive, if they are few: neighbours of the same acceleration are one."""
    u = np.array(drive.accelerations)
    last = np.append(np.flatnonzero(np.abs(np.diff(u)) > SAME * rigid), u.size - 1)
    if last.size > FEW:
        return ()
    ends = np.array(drive.switches)[last + 1]
    arcs = (f"{a:.4g} until {end:.5g} s" for a, end in zip(u[last], ends, strict=True))
    return (f"Acceleration of the drive [rad/s^2]: {', '.join(arcs)}.",)
