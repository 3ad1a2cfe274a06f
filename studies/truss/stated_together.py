"""What keys of the truss may not state together: each check refuses it in one sentence."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

from studies.common.exit_codes import StudyError
from studies.truss.limits.tolerances import PLAUSIBLE, check_plausible

if TYPE_CHECKING:
    from studies.truss.config import TrussStudy

ONE_WAY = ("joint_coulomb", "slider_coulomb", "off_load_friction", "measured_torque")
ROUNDED = 1e-9  # relative: an angle in degrees that was meant to be the stowed one


def check_plausible_values(study: TrussStudy) -> None:
    """Refuse numbers beyond the physics of the model, before any work."""
    for end in study.duration:
        check_plausible("duration", end)
    if study.caps.force is not None:
        check_plausible("caps.force", study.caps.force)
    if study.drive is not None and study.drive.force is not None:
        check_plausible("drive.force", study.drive.force)
    check_plausible("caps.least_tension", study.caps.least_tension)
    check_plausible("solver.intervals", study.solver.intervals)
    for entry in dataclasses.fields(study.truss):
        if f"truss.{entry.name}" in PLAUSIBLE:
            check_plausible(f"truss.{entry.name}", getattr(study.truss, entry.name))


def check_opening(study: TrussStudy) -> None:
    """Refuse angles that no motion has, and a start that other keys rule out."""
    truss = study.truss
    stowed = math.degrees(truss.stowed_angle)
    start = stowed if study.start_deg is None else study.start_deg
    end = 90.0 if study.end_deg is None else study.end_deg

    if start < stowed * (1 - ROUNDED):
        raise StudyError(
            f"start_deg is {start:g}, but the stowed ring is at {stowed:.6g} deg; increase "
            "start_deg, or lower truss.stowed_angle_deg"
        )
    if end > 90.0:
        raise StudyError(f"end_deg is {end:g}, but the ring is open at 90 deg; give at most 90")
    if start >= end:
        raise StudyError(
            f"the motion starts at {start:g} deg and ends at {end:g} deg; decrease start_deg, or "
            "increase end_deg up to 90"
        )
    if study.arm is not None and end < 90.0:
        raise StudyError(
            f"end_deg is {end:g}, but the residual energy of the arm is computed for the open "
            "ring; remove end_deg or [arm]"
        )

    if not study.start_rate_deg_per_s:
        return
    kept_at_rest = {
        "[arm], which is at rest at the start,": study.arm is not None,
        "drive.rope_stiffness, for which the ring must be at rest at the start,": (
            study.drive is not None and study.drive.rope_stiffness is not None
        ),
        "drive.start_dwell": study.drive is not None and study.drive.start_dwell > 0.0,
    }
    for other, stated in kept_at_rest.items():
        if stated:
            raise StudyError(
                f"start_rate_deg_per_s is {study.start_rate_deg_per_s:g}, but {other} is given; "
                "remove one of them"
            )


def check_duration(study: TrussStudy) -> None:
    """Refuse the objective time of a duration that is fixed."""
    if "time" in study.objectives and study.fixed_duration is not None:
        raise StudyError(
            f"the objective time needs bounds on the duration, but it is fixed at "
            f"{study.fixed_duration:g} s; give --duration LOW..HIGH or duration = [low, high]"
        )


def check_loads(study: TrussStudy) -> None:
    """Refuse what margins and the models of arm and yielding ropes leave out."""
    if study.arm is not None and study.margin is not None:
        raise StudyError(
            "[margin] does not include the effect of [arm] on the ropes; remove one of them"
        )
    *in_plane, _ = study.truss.gravity  # along the ring's axis nothing moves, nor does the arm
    if study.arm is not None and any(in_plane):
        raise StudyError(
            f"truss.gravity is {list(study.truss.gravity)}, but in the plane of ring and arm "
            "gravity would bend the arm, whose model includes no weight; give gravity along the "
            "ring's axis, as [0, 0, -9.81], or remove gravity or [arm]"
        )
    if curve := study.truss.measured_torque:
        from studies.margin.resistance import check_covers

        ends = study.opening.start, study.opening.end
        check_covers(curve, *ends, "truss.measured_torque")
        if study.margin is not None and study.margin.resistance is not None:
            raise StudyError(
                "margin.resistance and truss.measured_torque are both given, and each is the whole "
                "measured load; give only truss.measured_torque, which also counts in the margins"
            )
    rough = [name for name in ONE_WAY if getattr(study.truss, name)]
    if rough and study.drive is not None and study.drive.rope_stiffness is not None:
        raise StudyError(
            f"truss.{rough[0]} is given, but on flexible ropes the truss also swings back, and "
            "this load is modelled in one direction only; remove it or drive.rope_stiffness"
        )


def check_stretch(study: TrussStudy) -> None:
    """Refuse what a planned stretch of the ropes does not go with."""
    if study.plans_stretch and study.arm is not None:
        raise StudyError(
            "drive.plan_stretch requires a ring whose fixed bar is held, but [arm] is given; "
            "remove one of them"
        )
    if study.plans_stretch and not study.jerk_limited:
        raise StudyError(
            "drive.plan_stretch needs a cap on the jerk, because otherwise the tension of the "
            'ropes may jump; give caps.jerk, such as "200/T^3"'
        )
