"""A turn from its configuration to its result.

What the engine finds is a drive of constant accelerations. The antenna's answer to it is worked out
anew, in sines and without an integrator, and so is that to the paper's laws.
"""

from __future__ import annotations

import dataclasses
import math
import time as clock
from collections.abc import Mapping
from typing import Any

import numpy as np

from models.laws import Bezier, Law, Step5, paper_points
from models.turn import BangTurn, TurnResponse, turn_response
from ocp import Solution
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
from studies.turn.motion import (
    best_turn,
    closed_form,
    least_duration,
    least_momentum,
    least_torque,
    least_utilisation,
)
from studies.turn.problem import rows_of

OPTIMUM = "optimum"
ROWS = 4001  # evenly spaced, beside the switches
AFTER = 6.0  # periods of the swing that are followed when the drive stands
AFTER_ROWS = 241
MET = 1e-5  # relative: so close to its closed form an optimum counts as that
SAME = 1e-3  # of what a rigid arm's drive needs: what differs by less is one arc to a reader
FEW = 12  # arcs that a sentence lists

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
                f"{least:.6g} s; state more than {up(least)} s, or raise the caps",
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

    if study.minimise == "utilisation":
        return  # which may be more than all of a cap
    for name, unit, least in (
        ("torque", "N m", least_torque(study)),
        ("wheel_torque", "N m", least_torque(study)),
        ("wheel_momentum", "N m s", least_momentum(study)),
    ):
        cap = getattr(study, name)
        if cap is not None and least > cap:
            raise StudyError(
                f"{name} is {cap:g} {unit}, but no turn of {duration:g} s needs less than "
                f"{least:.6g} {unit}; state at least {up(least)} {unit}, or a longer duration",
                ExitCode.INFEASIBLE,
            )


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
    begin = clock.monotonic()
    best = best_turn(study, console, kept)
    console.progress(f"solved in {clock.monotonic() - begin:.1f} s")
    second = second_solve(best.solution, best.statement.settings, console, kept=kept)

    drive = best.drive(second.solution)
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
        verdict=_verdict(study, second.solution),
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


def _under(study: TurnStudy, law: Law) -> TurnResponse:
    """What the antenna does if the drive follows a law."""
    time = np.union1d(np.linspace(0.0, law.duration, 4 * ROWS), law.breakpoints)
    acceleration = law.motion(time).acceleration
    return turn_response(study.parameters, time, acceleration, acceleration)


def _table(study: TurnStudy, moved: Mapping[str, TurnResponse]) -> tuple[TableRow, ...]:
    timed, J, h = study.minimise == "time", study.parameters.inertia, study.wheel_momentum
    torque_bound = None if timed else least_torque(study)

    def row(key: str, title: str, unit: str, values: Mapping[str, float], **more: Any) -> TableRow:
        cap = more.get("cap")
        broken = [
            law for law, value in values.items() if cap is not None and value > cap * (1 + CAPS)
        ]
        return TableRow(key, title, unit, values, better="less", broken_by=tuple(broken), **more)

    def peaks(name: str) -> dict[str, float]:
        return {law: float(np.abs(getattr(one, name)).max()) for law, one in moved.items()}

    handed = {law: J * value for law, value in peaks("antenna_rate").items()}
    shared: tuple[TableRow, ...] = ()
    if study.minimise == "utilisation":
        parts = {law: value / study.most_torque for law, value in peaks("torque").items()}
        if h is not None:
            parts = {law: max(part, handed[law] / h) for law, part in parts.items()}
        title, least = "utilisation (largest fraction of a cap)", least_utilisation(study)
        shared = (row("utilisation", title, "1", parts, cap=1.0, bound=least, minimised=True),)
    return (
        *shared,
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
            cap=study.most_torque,
            bound=torque_bound,
            minimised=study.minimise == "peak-torque",
        ),
        row(
            "peak_momentum",
            "peak angular momentum handed to the satellite",
            "N m s",
            handed,
            cap=h,
            bound=None if timed else least_momentum(study),
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
        at_most("peak torque", "N m", np.abs(own.torque).max(), study.most_torque * (1 + CAPS)),
        at_most(
            "peak acceleration of the drive",
            "rad/s^2",
            np.abs(own.drive_acceleration).max(),
            study.drive_acceleration * (1 + CAPS),
        ),
    ]

    if (h := study.wheel_momentum) is not None:
        handed = study.parameters.inertia * float(np.abs(own.antenna_rate).max())
        checks.append(
            at_most("peak momentum handed to the satellite", "N m s", handed, h * (1 + CAPS))
        )
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


def _verdict(study: TurnStudy, solution: Solution) -> Verdict:
    known = closed_form(study)
    if not solution.verification.passed:
        return Verdict("unverified", "; ".join(solution.verification.reasons))
    if known is None:
        return Verdict(
            "local",
            "local: one start; in a given duration dynamics and limits are linear, so that no "
            "other optimum is better",
        )
    best = known.duration if study.minimise == "time" else known.peak_torque
    if study.minimise == "utilisation":
        best /= study.most_torque
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
        *_of_the_satellite(study),
        *_arcs_in_words(drive, 4.0 * study.angle / drive.duration**2),
        "The paper gives no parameters of this stage. Assumed are a drive at the root of the big "
        "arm, a folded small arm, and a stowed ring that is a thin hoop, its centre its own radius "
        "away from the axis.",
        "Left out are bending of the arm, damping, the inertia of the tubes about the axis, and "
        "that of the drive.",
    )


def _of_the_satellite(study: TurnStudy) -> tuple[str, ...]:
    """How far the antenna turns a satellite that is free."""
    H = study.satellite_inertia
    if H is None:
        return ()
    turned = -study.parameters.inertia / H * study.angle_deg
    return (
        f"The satellite of {H:g} kg m^2 about this axis turns by {turned:.4g} deg. All angles are "
        "seen from it, and the inertia is that of the relative motion.",
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
