"""What is said of a motion of the arm: its quantities, and what it is held against."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.arm.config import ArmStudy
from studies.arm.optimal.motion import OptimalMotion
from studies.arm.optimal.objectives import RESIDUAL
from studies.arm.optimal.refinement import AGREE, Refined, agreement
from studies.arm.optimal.rounds import MISS, SAME
from studies.arm.replay.full_model import LockedMotion
from studies.arm.replay.loads import (
    EARLY_LATE,
    Loads,
    deflections,
    early_and_late,
    mean_square,
    modal_ratios,
    settling_time,
    stress,
    work_drawn,
)
from studies.arm.replay.satellite import SatelliteMotion
from studies.arm.stage import JOINT_NAMES
from studies.common.arm_description import ArmDescription
from studies.common.comparison_table import Better, TableRow
from studies.common.result import Criterion, Verdict

DAMPING = 0.005  # modal ratio of the settling time where the study states none: an assumption
BALANCE = 1e-3  # of the peak momentum; the trapezoidal rule over 2000 instants of a quick torque
DRIFT = 1e-6  # of the largest kinetic energy; the steps' tolerance leaves a hundredth of it
CAP_EXCESS = 1e-3  # of a cap, by which a torque may exceed it between the points
ASSUMPTIONS = (
    "assumed unless given, not from the paper: CFRP tubes 60 x 2 and 50 x 1.5 mm (E 70 GPa, 1600 "
    "kg/m^3), an antenna of 30 kg as a particle"
)


@dataclass(frozen=True)
class Metric:
    """One number by which motions are compared.

    Attributes
    ----------
    key, title, unit : what it is.
    value : nan where it is not defined.
    better : whether less or more of it is better.
    negligible : so little of it is as good as none.
    """

    key: str
    title: str
    unit: str
    value: float
    better: Better = "less"
    negligible: float = 0.0


def table_rows(
    laws: Mapping[str, Sequence[Metric]], caps: Mapping[str, float | None] | None = None
) -> tuple[TableRow, ...]:
    """Rows of a table: quantities by law, those of the first law first.

    Parameters
    ----------
    laws : quantities of each law.
    caps : by key of a quantity.
    """
    caps = caps or {}
    first: dict[str, Metric] = {}
    values: dict[str, dict[str, float]] = {}
    for law, quantities in laws.items():
        for quantity in quantities:
            first.setdefault(quantity.key, quantity)
            values.setdefault(quantity.key, {})[law] = quantity.value

    return tuple(
        TableRow(
            key=key,
            title=quantity.title,
            unit=quantity.unit,
            values=values[key],
            cap=caps.get(key),
            better=quantity.better,
            negligible=quantity.negligible,
        )
        for key, quantity in first.items()
    )


def quantities_of(
    replayed: LockedMotion,
    history: Loads,
    arm: ArmDescription,
    pointing_error: float,
    peak_torque: Array | None = None,
) -> list[Metric]:
    """What satellite, links, motors and antenna bear in any motion.

    Parameters
    ----------
    replayed : LockedMotion
    history : Loads
        Along it.
    arm : ArmDescription
    pointing_error : float
        Of the tip, for the settling time [m].
    peak_torque : (2,), optional
        Of root and elbow [N m], where it is known better than from the replay's instants.
    """
    peaks = replayed.peak_torque if peak_torque is None else peak_torque

    # with less than a search asks for, the arm is as still as one that is left with nothing
    left = replayed.residual_energy
    residual = Metric("residual_energy", "residual energy", "J", left, negligible=RESIDUAL)

    return [
        residual,
        Metric("angle_miss", "angle miss at the lock", "rad", replayed.miss),
        _settling(replayed, pointing_error),
        *_on_the_satellite(history),
        *_of_a_free_satellite(replayed.satellite),
        *_in_the_lock(replayed, history),
        Metric(
            "peak_tip_acceleration",
            "peak tip acceleration",
            "m/s^2",
            float(history.tip_acceleration[: history.until].max()),
        ),
        *_bending(replayed, history, arm),
        Metric("mean_square_torque", "mean square torque", "N^2 m^2", mean_square(replayed)),
        Metric("work", "work of the drives, without recovery", "J", work_drawn(replayed)),
        *(
            Metric(f"peak_{joint}_torque", f"peak {joint} torque", "N m", float(peaks[k]))
            for k, joint in enumerate(JOINT_NAMES)
            if k in replayed.motion.stage.moving
        ),
    ]


def _on_the_satellite(history: Loads) -> list[Metric]:
    """What the satellite bears at the root."""
    until = history.until
    force = float(np.linalg.norm(history.force[:, :until], axis=0).max())
    moment = float(np.abs(history.moment[:until]).max())
    momentum = float(np.abs(history.angular_momentum).max())

    # not defined where the replay ended with the lock
    beyond = np.abs(history.moment[until:])
    moment_after = float(beyond.max()) if beyond.size else math.nan

    passed_on = "peak angular momentum passed to the satellite"
    return [
        Metric("peak_root_force", "peak root force", "N", force),
        Metric("peak_root_moment", "peak root moment", "N m", moment),
        Metric(
            "peak_root_moment_after_lock", "peak root moment after the lock", "N m", moment_after
        ),
        Metric("peak_angular_momentum", passed_on, "N m s", momentum),
    ]


def _of_a_free_satellite(turning: SatelliteMotion | None) -> list[Metric]:
    """How far it turns; nothing of one that is held."""
    if turning is None:
        return []
    head = f"satellite of {turning.inertia:g} kg m^2, free"
    end, largest = (
        float(np.degrees(turn)) for turn in (turning.turn[-1], np.abs(turning.turn).max())
    )
    return [
        Metric("satellite_turned", f"{head}: turned at the lock", "deg", end, "neither"),
        Metric("satellite_largest_turn", f"{head}: largest turn", "deg", largest),
    ]


def _in_the_lock(replayed: LockedMotion, history: Loads) -> list[Metric]:
    """What the lock strikes."""
    lock, antenna = replayed.run.engagement, replayed.motion.stage.arm.tip_mass
    force = float(np.hypot(*history.force_impulse))
    # the joints' impulses have a sign, so that less of them is not better
    joints = [
        Metric(
            f"lock_impulse_{joint}", f"lock impulse, {joint}", "N m s", float(impulse), "neither"
        )
        for joint, impulse in zip(JOINT_NAMES, lock.impulse, strict=True)
    ]
    return [
        Metric(
            "lock_force_impulse",
            "lock impulse of the root's force",
            "N s",
            force,
            negligible=math.sqrt(2 * antenna * RESIDUAL),  # the antenna's, with that energy
        ),
        *joints,
        Metric(
            "lost_energy",
            "kinetic energy lost in the lock",
            "J",
            lock.lost_energy,
            negligible=RESIDUAL,
        ),
    ]


def _settling(replayed: LockedMotion, pointing_error: float) -> Metric:
    ratios = modal_ratios(replayed, DAMPING)
    return Metric(
        "settling_time",
        f"settling of the tip to {pointing_error:g} m, mode 1 damped by {ratios[0]:.3g}",
        "s",
        settling_time(replayed, pointing_error, ratios),
    )


def _bending(replayed: LockedMotion, history: Loads, arm: ArmDescription) -> list[Metric]:
    """What bends both links."""
    parameters = replayed.motion.stage.arm
    links = (("big", parameters.big), ("small", parameters.small))
    peaks, bent = history.bending.max(axis=1), deflections(replayed)

    entries = []
    for k, (name, link) in enumerate(links):
        moment, diameter = float(peaks[k]), getattr(arm, f"{name}_diameter")
        surface = 1e-6 * stress(moment, link.bending_stiffness, diameter, arm.modulus)
        entries += [
            Metric(f"bending_moment_{name}", f"peak bending moment, {name} arm", "N m", moment),
            Metric(f"bending_stress_{name}", f"peak bending stress, {name} arm", "MPa", surface),
            Metric(f"deflection_{name}", f"peak deflection, {name} arm", "m", float(bent[k])),
        ]
    return entries


def optimum_quantities(motion: OptimalMotion, replayed: LockedMotion) -> list[Metric]:
    """What is known of the optimum alone: its errors, its exact torque, its modes."""
    title = "residual energy on B21, with the corrected target"
    entries = [Metric("residual_energy_B21", title, "J", motion.reduced_energy, "neither")]
    if motion.weight:
        entries += _surcharges(motion)
    for k in motion.stage.moving:
        rate = float(motion.peak_rate[k])
        name = JOINT_NAMES[k]
        entries.append(
            Metric(f"peak_{name}_torque_rate", f"peak rate of {name} torque", "N m/s", rate)
        )

    vibration = replayed.vibration
    modes = zip(vibration.frequencies, vibration.modal_amplitude, strict=True)
    for i, (frequency, amplitude) in enumerate(modes, start=1):
        title = f"mode {i}, {frequency:.4g} Hz: amplitude"
        entries.append(Metric(f"mode_{i}_amplitude", title, "m", float(amplitude)))
    return entries


def _surcharges(motion: OptimalMotion) -> list[Metric]:
    """What the objective is above the rigid arm's, and how much of that is smoothness."""
    share = 100 * motion.smoothness_share
    entries = [
        Metric("smoothness_weight", "weight of the smoothness", "1", motion.weight, "neither"),
        Metric("smoothness_share", "share of smoothness in the minimised sum", "%", share),
    ]
    if motion.added:
        added = 100 * motion.added_share
        title = "torque correction on the full model, relative to the peak"
        entries.append(Metric("added_share", title, "%", added, "neither"))
    for k in motion.stage.moving if len(motion.stage.moving) == 1 else ():
        bound = 4.0 * float(motion.stage.torque_units[k])
        over = 100 * (float(motion.peak_torque[k]) / bound - 1)
        name = JOINT_NAMES[k]
        entries += [
            Metric(
                "rigid_bound", f"rigid bound of the peak {name} torque", "N m", bound, "neither"
            ),
            Metric("surcharge", "excess over the rigid bound", "%", over),
        ]
    return entries


def off_time_quantities(replayed: LockedMotion) -> list[Metric]:
    """What a lock at the wrong instant leaves."""
    off_time = early_and_late(replayed)

    entries = []
    for word, off in zip(("early", "late"), off_time, strict=True):
        head = f"locked {EARLY_LATE:g} s {word}"
        entries += [
            Metric(f"{word}_residual_energy", f"{head}: residual energy", "J", off.residual_energy),
            Metric(f"{word}_angle_miss", f"{head}: angle miss", "rad", off.miss),
            Metric(f"{word}_impulse", f"{head}: largest impulse", "N m s", off.impulse),
        ]
    return entries


def caps_by_quantity(study: ArmStudy) -> dict[str, float | None]:
    """The caps of the study, by key of the quantity that keeps them."""
    caps: dict[str, float | None] = {}
    for k in study.slew.moving:
        caps[f"peak_{JOINT_NAMES[k]}_torque"] = study.caps.torque[k]
        caps[f"peak_{JOINT_NAMES[k]}_torque_rate"] = study.caps.rate[k]
    return caps | {
        "peak_root_moment": study.wheel_torque,
        "peak_angular_momentum": study.wheel_momentum,
    }


def criteria(study: ArmStudy, refined: Refined, history: Loads) -> tuple[Criterion, ...]:
    """What must hold for the result to count."""
    motion = refined.motion
    checks = [
        verified(
            "the residual energy on the full model is within the allowed one",
            "J",
            refined.left,
            refined.residual,
        ),
        _energy_balance(refined.replay),
        verified(
            "the integral of the root's moment is the angular momentum",
            "1",
            history.imbalance,
            BALANCE,
        ),
        *refinement_checks(refined),
    ]
    if study.latch is not None:
        checks += latch_checks(refined.replay, study.latch)

    # between the points of the mesh, where the optimiser did not look
    by_torque = study.drive == "torque"
    peaks = motion.peak_torque if by_torque else refined.replay.peak_torque
    for k in motion.stage.moving:
        for what, unit, value, cap in (
            ("torque", "N m", float(peaks[k]), study.caps.torque[k]),
            ("torque rate", "N m/s", float(motion.peak_rate[k]), study.caps.rate[k]),
        ):
            if cap is not None:
                name = f"{JOINT_NAMES[k]} {what} within its cap between the points"
                checks.append(verified(name, unit, value, cap, CAP_EXCESS))
    return (*checks, *wheel_checks(study, history))


def wheel_checks(study: ArmStudy, history: Loads) -> list[Criterion]:
    """Whether a held satellite takes no more than the caps of its wheels."""
    taken = (
        ("moment", "N m", history.moment[: history.until], study.wheel_torque),
        ("momentum", "N m s", history.angular_momentum, study.wheel_momentum),
    )
    checks = []
    for what, unit, values, cap in taken:
        if cap is not None:
            value, name = float(np.abs(values).max()), f"{what} on the satellite"
            name = f"{name} within its cap on the full model"
            checks.append(verified(name, unit, value, cap, CAP_EXCESS))
    return checks


def refinement_checks(refined: Refined) -> list[Criterion]:
    """Whether a finer model, a finer mesh and less smoothness all leave a motion as it is."""
    name = (
        f"half as many elements again change the residual energy by {AGREE:.0%} of the allowed one"
    )
    limit, missed = agreement(refined.residual), max(one.miss for one in refined.replays)
    checks = [
        verified(f"{name} at most", "J", refined.disagreement, limit),
        verified("the joints reach their angles", "rad", missed, MISS),
    ]
    if refined.motion.weight:
        name = f"the last halving of smoothness and interval changes the objective by {SAME:.0%}"
        checks.append(verified(f"{name} at most", "1", abs(refined.change), SAME))
    if refined.lost:
        name = (
            f"the smoothness weight with which a finer full model agrees costs at most {SAME:.0%}"
        )
        checks.append(verified(name, "1", refined.lost, SAME))
    return checks


def _energy_balance(replayed: LockedMotion) -> Criterion:
    """Whether the replay itself is to be trusted."""
    run = replayed.run.before
    allowed = DRIFT * max(float(run.kinetic.max()), 1e-9)
    return verified("the replay keeps its energy balance", "J", run.drift, allowed)


def verdict_on(refined: Refined) -> Verdict:
    """How sure a motion is that was refined."""
    if not refined.still:
        return Verdict(
            "unverified",
            f"unverified: the residual energy on the full model is {refined.left:.2e} J, more "
            f"than the allowed {refined.residual:g} J; allow more, or give a longer duration",
        )
    if not refined.settled:
        return Verdict(
            "unverified",
            "unverified: a smaller smoothness weight and a finer mesh still improve the objective "
            "by more than 1 %; allow more residual energy, or give a longer duration",
        )
    return Verdict(
        "local",
        "local: optimum of the reduced model B21 from one start, confirmed by a replay on the "
        "full ANCF model; no other optimum was searched for",
    )


def verified(name: str, unit: str, value: float, limit: float, excess: float = 0.0) -> Criterion:
    """Whether a value is no more than a limit, or than a part `excess` above it."""
    held = bool(value <= limit * (1.0 + excess))
    sentence = f"{'verified' if held else 'FAILED'}: {name}"
    return Criterion(name, unit, float(value), float(limit), held, sentence)


def latch_checks(replayed: LockedMotion, width: float) -> list[Criterion]:
    """Whether each joint of a motion arrives at its latch, of a width [rad]."""
    checks = []
    for k, signed_miss in replayed.run.engagement.miss.items():
        miss = abs(float(signed_miss))
        sentence, held = latched(JOINT_NAMES[k], miss, width)
        verdict = "verified" if held else "FAILED"
        checks.append(
            Criterion(
                name=f"latch of the {JOINT_NAMES[k]}, {replayed.motion.name}",
                unit="rad",
                value=miss,
                limit=width,
                passed=held,
                sentence=f"{verdict}: {replayed.motion.name}: {sentence}",
            )
        )
    return checks


def latched(name: str, miss: float, width: float) -> tuple[str, bool]:
    """Whether a joint arrives at its latch, and the sentence that says so."""
    if miss <= width:
        return f"the {name} reaches its latch within {width:g} rad", True
    return (
        f"the {name} misses its latch by {miss:.2g} rad, more than {width:g} rad; allow a wider "
        "latch, a longer duration or another law"
    ), False
