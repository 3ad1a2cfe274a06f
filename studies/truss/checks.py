"""Caps that no motion meets, found before any solve; each with the nearest value that works."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from models.laws import least_jerk_cap
from models.truss import TrussParameters, far_end_ratio, static_force
from studies.common.exit_codes import ExitCode, StudyError
from studies.truss.bounds import least_time
from studies.truss.config import DEPLOYED, TrussStudy

if TYPE_CHECKING:  # SciPy loads with it, and only where it is needed
    from studies.truss.phase_plane import LeastForce

ROUNDING = 1e-12  # relative: a cap set to the printed bound itself passes


def check_feasible(study: TrussStudy, least_force: Callable[[], LeastForce]) -> None:
    """Raise StudyError if a closed form or the phase plane shows that no motion meets the caps.

    Parameters
    ----------
    least_force : callable
        Computes the phase-plane bound; called only if a force cap makes it matter.
    """
    _check_jerk(study)
    _check_kinematics(study)
    _check_tension(study)
    if study.caps.force is not None:
        _check_end_forces(study, study.caps.force)
        try:
            least = least_force()
        except StudyError:  # no bound to be had
            return
        _check_force(study, study.caps.force, least)


def _infeasible(sentence: str) -> StudyError:
    return StudyError(sentence, ExitCode.INFEASIBLE)


def _check_jerk(study: TrussStudy) -> None:
    jerk, duration = study.caps.jerk, study.duration[1]
    least = least_jerk_cap(study.stroke, duration)
    if jerk is not None and jerk < least * (1 - ROUNDING):
        raise _infeasible(
            f"no motion deploys in {duration:g} s with a jerk cap of {jerk:.6g} rad/s^3; "
            f"the least feasible cap is 32 D/T^3 = {least:.6g} rad/s^3, or lengthen the duration"
        )


def _check_kinematics(study: TrussStudy) -> None:
    caps, duration = study.caps, study.duration[1]
    least = least_time(study.stroke, caps)
    if least > duration * (1 + ROUNDING):
        named = [
            f"{name} {value:g} {unit}"
            for name, value, unit in (
                ("speed", caps.speed, "rad/s"),
                ("acceleration", caps.acceleration, "rad/s^2"),
                ("jerk", caps.jerk, "rad/s^3"),
            )
            if value is not None
        ]
        raise _infeasible(
            f"no motion deploys in {duration:g} s under the caps on {', '.join(named)}; "
            f"they need at least {least:.6g} s: lengthen the duration or raise a cap"
        )


def end_forces(truss: TrussParameters) -> tuple[tuple[str, float, float], ...]:
    """Where the truss stands still, its static rope force [N] and the far end's share of it."""
    return tuple(
        (where, float(static_force(truss, angle)), float(far_end_ratio(truss, angle)))
        for where, angle in (("start", truss.stowed_angle), ("end", DEPLOYED))
    )


def _check_tension(study: TrussStudy) -> None:
    floor = study.caps.least_tension
    for where, force, share in end_forces(study.truss):
        tension = force * share
        if study.caps.jerk is not None and floor > tension * (1 + ROUNDING):
            raise _infeasible(
                f"no motion keeps every rope segment above {floor:g} N: at rest at the {where} "
                f"statics fix the tension of the last one to {tension:.6g} N; lower least_tension "
                "to that, or remove the jerk cap, with which the acceleration is zero there"
            )
        if study.caps.force is not None and floor / share > study.caps.force:
            raise _infeasible(
                f"a least tension of {floor:g} N needs a motor force of {floor / share:.6g} N at "
                f"the {where}, above the force cap of {study.caps.force:g} N; lower the one or "
                "raise the other"
            )


def _check_end_forces(study: TrussStudy, cap: float) -> None:
    where, least, _ = max(end_forces(study.truss), key=lambda end: end[1])
    if study.caps.jerk is not None and cap < least * (1 - ROUNDING):
        raise _infeasible(
            f"no motion meets the force cap of {cap:g} N: at rest at the {where} statics need "
            f"{least:.6g} N on each rope; raise the cap to more than that, or remove the jerk cap"
        )


def _check_force(study: TrussStudy, cap: float, least: LeastForce) -> None:
    if cap >= least.force * (1 - ROUNDING) and (least.attained or cap > least.force):
        return
    limit = "" if least.attained else ", a limit that no motion attains"
    raise _infeasible(
        f"no motion deploys in {study.duration[1]:g} s with at most {cap:g} N on each rope; the "
        f"least force without other caps is {least.force:.6g} N{limit} (phase plane, global)"
    )


def check_speed_sense(study: TrussStudy, speeds: tuple[float, float]) -> None:
    """Raise StudyError if a profile runs backwards with pulley friction."""
    if study.truss.pulley_friction > 0 and min(speeds) < -1e-6 * max(map(math.fabs, speeds)):
        raise StudyError(
            f"the profile runs backwards ({min(speeds):g} rad/s), but pulley friction is modelled "
            "for a rope hauled in only; keep the speed non-negative or set pulley_friction to 0"
        )
