"""What is printed and recorded of a motion of the arm."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from models.ancf.analysis import natural_modes
from models.ancf.joints import Locked
from models.ancf.state import posed
from models.arm.parameters import ASSUMED_MODULUS
from models.errors import ModelError
from studies.arm.config import TUBES, ArmStudy
from studies.arm.optimal.objectives import OBJECTIVES
from studies.arm.optimal.phase import Limits
from studies.arm.optimal.rigid_time import least_rigid_duration, quintic_duration
from studies.arm.optimal.solve import Refined
from studies.arm.replay.full import Replay
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
from studies.arm.replay.satellite import FreeSatellite, free_satellite
from studies.arm.report.model_error import both_at_once
from studies.arm.stage import JOINT_NAMES, Stage
from studies.common.console import Table, number
from studies.common.exit_codes import StudyError

DAMPING = 0.005  # modal ratio of the settling time where the study states none: an assumption
BALANCE = 2e-3  # of the peak moment; differences over 2000 steps of what the fast modes add
ASSUMPTIONS = (
    "assumed where not stated, not the paper's: CFRP tubes 60 x 2 and 50 x 1.5 mm (E 70 GPa, "
    "1600 kg/m^3), an antenna of 30 kg as a particle"
)


def check_mesh(study: ArmStudy) -> None:
    """Refuse a full model too coarse for the modes that are asked for.

    Raises
    ------
    StudyError
        With the number of elements that would do.
    """
    chain = study.stage.arm.chain(study.elements)
    joints = [Locked(angle) for angle in study.stage.end]
    rest = posed(chain, list(study.stage.end))
    try:
        natural_modes(chain, joints, rest, count=study.modes)
    except ModelError as error:
        raise StudyError(str(error)) from error


def duration_to_try(stage: Stage, limits: Limits) -> str:
    """What to do where no motion was found: how long a rigid arm takes if torque caps are low."""
    longer = quintic_duration(stage, limits)
    if longer <= stage.duration:
        return "; on the command line: give a longer duration, higher caps or another objective"
    least = least_rigid_duration(stage, limits)
    shortest = "" if least is None else f"{least:.4g} s on the shortest motion found, "
    return (
        f"; under this torque cap a rigid arm takes {shortest}{longer:.4g} s on the quintic step: "
        "give such a duration or a higher cap"
    )


def facts(study: ArmStudy, found: Refined, history: Loads) -> dict[str, Any]:
    """All figures of a motion, with units in their names."""
    full, solved = found.replay, found.solved
    ratios = modal_ratios(full, DAMPING)
    out: dict[str, Any] = {
        "residual energy [J]": full.residual_energy,
        "residual energy on B21, mesh error [J]": solved.reduced_energy,
        "model error [J]": abs(full.residual_energy - solved.reduced_energy),
        "angle miss at the lock [rad]": full.miss,
        f"settling of the tip to {study.pointing_error:g} m, mode 1 damped by {ratios[0]:.3g} [s]":
            settling_time(full, study.pointing_error, ratios),
    }  # fmt: skip
    out |= _loads(study, found, history)
    for k in study.stage.moving:
        out |= _margins(study, found, k)
    out |= _off_time(study, found)
    if len(study.stage.moving) > 1:
        out |= both_at_once(study.stage, solved)
    if study.satellite_inertia is not None:
        out |= _free(free_satellite(full, history, study.satellite_inertia), study)
    for i, frequency in enumerate(full.frequencies):
        out[f"mode {i + 1}, {frequency:.4g} Hz: amplitude [m]"] = float(full.modal_amplitude[i])
    return out


def _loads(study: ArmStudy, found: Refined, history: Loads) -> dict[str, float]:
    """What satellite, links and motors bear."""
    full = found.replay
    lock, until = full.run.engagement, history.until
    modulus = study.given.get("modulus", ASSUMED_MODULUS)
    peaks = history.bending.max(axis=1)
    out = {
        "peak root force [N]": float(np.linalg.norm(history.force[:, :until], axis=0).max()),
        "peak root moment [N m]": float(np.abs(history.moment[:until]).max()),
        "peak root moment after the lock [N m]":
            float(np.abs(history.moment[until:]).max(initial=0.0)),
        "peak angular momentum passed to the satellite [N m s]":
            float(np.abs(history.angular_momentum).max()),
        "lock impulse of the root's force [N s]": float(np.hypot(*history.force_impulse)),
        "lock impulse, root [N m s]": float(lock.impulse[0]),
        "lock impulse, elbow [N m s]": float(lock.impulse[1]),
        "kinetic energy lost in the lock [J]": lock.lost_energy,
        "peak tip acceleration [m/s^2]": float(history.tip_acceleration[:until].max()),
    }  # fmt: skip
    links = (study.stage.arm.big, study.stage.arm.small)
    bent = deflections(full)
    for k, (name, link) in enumerate(zip(("big", "small"), links, strict=True)):
        diameter = study.given.get(f"{name}_diameter", TUBES[name][1])
        bend = stress(float(peaks[k]), link.bending_stiffness, diameter, modulus)
        out[f"peak bending moment, {name} arm [N m]"] = float(peaks[k])
        out[f"peak bending stress, {name} arm [MPa]"] = 1e-6 * bend
        out[f"peak deflection, {name} arm [m]"] = float(bent[k])
    out["mean square torque [N^2 m^2]"] = mean_square(full)
    out["work of the drives, nothing recovered [J]"] = work_drawn(full)
    return out


def _off_time(study: ArmStudy, found: Refined) -> dict[str, float]:
    """What a lock at the wrong instant leaves."""
    out: dict[str, float] = {}
    both = early_and_late(found.replay.motion, study.elements)
    for word, off in zip(("early", "late"), both, strict=True):
        lock = off.run.engagement
        out |= {
            f"locked {EARLY_LATE:g} s {word}: residual energy [J]": off.residual_energy,
            f"locked {EARLY_LATE:g} s {word}: angle miss [rad]": off.miss,
            f"locked {EARLY_LATE:g} s {word}: largest impulse [N m s]":
                float(np.abs(lock.impulse).max()),
        }  # fmt: skip
    return out


def _free(case: FreeSatellite, study: ArmStudy) -> dict[str, float]:
    """What changes where the satellite is free to turn."""
    head = f"satellite of {case.inertia:g} kg m^2, free"
    out = {
        f"{head}: turned at the lock [deg]": float(np.degrees(case.turned)),
        f"{head}: largest turn [deg]": float(np.degrees(case.largest_turn)),
        f"{head}: peak angular momentum [N m s]": case.largest_momentum,
        f"{head}: residual energy [J]": case.residual_energy,
        f"{head}: first frequency, locked (held {case.held_frequency:.4g}) [Hz]": case.frequency,
    }
    turns = (case.root_travel, case.elbow_travel)
    for k in study.stage.moving:
        off = turns[k] - float(study.stage.turn[k])
        out[f"{head}: {JOINT_NAMES[k]} angle off its target [deg]"] = float(np.degrees(off))
    return out


def _margins(study: ArmStudy, found: Refined, k: int) -> dict[str, float]:
    name = JOINT_NAMES[k]
    torque, rate = found.solved.peak_torque[k], found.solved.peak_rate[k]
    out = {f"peak {name} torque [N m]": float(torque), f"peak {name} rate [N m/s]": float(rate)}
    for what, value, cap in (
        ("torque", torque, study.limits.torque[k]), ("rate", rate, study.limits.rate[k]),
    ):  # fmt: skip
        if cap is not None:
            out[f"margin to the {what} cap, {name} [%]"] = 100.0 * (1.0 - float(value) / cap)
    return out


def table(study: ArmStudy, values: dict[str, Any]) -> Table:
    """The figures as a table."""
    rows = [(name, number(float(value), 5)) for name, value in values.items()]
    best = OBJECTIVES[study.objective].title
    title = f"{study.stage.name} arm in {study.stage.duration:.6g} s, {best}"
    return Table(title, ("quantity", "value"), rows, (ASSUMPTIONS,))


def checks(study: ArmStudy, found: Refined, history: Loads) -> list[tuple[str, bool]]:
    """What must hold for the result to count."""
    solved, stage = found.solved, study.stage
    out = [
        ("the replays on B21 and on the full model agree in residual energy", found.agrees),
        ("the root's moment is the rate of the angular momentum", history.imbalance <= BALANCE),
    ]
    if study.latch is not None:
        out += [latched(name, float(miss), study.latch) for name, miss in _misses(found)]
    for k in stage.moving:
        for what, value, cap in (
            ("torque", solved.peak_torque[k], study.limits.torque[k]),
            ("rate", solved.peak_rate[k], study.limits.rate[k]),
        ):
            if cap is not None:
                name = f"{JOINT_NAMES[k]} {what} within its cap between the points"
                out.append((name, bool(value <= cap * (1 + 1e-3))))
    return out


def _misses(found: Refined) -> list[tuple[str, float]]:
    return [(JOINT_NAMES[k], abs(v)) for k, v in found.replay.run.engagement.miss.items()]


def missed(replays: Sequence[Replay], width: float) -> list[str]:
    """A sentence for each motion that does not arrive at its latch."""
    out = []
    for replayed in replays:
        for k, miss in replayed.run.engagement.miss.items():
            sentence, held = latched(JOINT_NAMES[k], abs(miss), width)
            if not held:
                out.append(f"FAILED: {replayed.motion.name}: {sentence}")
    return out


def latched(name: str, miss: float, width: float) -> tuple[str, bool]:
    """Whether a joint arrives at its latch, and the sentence that says so."""
    if miss <= width:
        return f"the {name} reaches its latch within {width:g} rad", True
    return (
        f"the {name} misses its latch by {miss:.2g} rad, more than {width:g} rad; allow a wider "
        "latch, a longer duration or another law"
    ), False


def rounds(found: Refined) -> list[dict[str, float]]:
    """The meshes, for the record."""
    return [
        {"intervals": n, "residual_energy_B21_J": b, "residual_energy_full_J": f}
        for n, b, f in found.rounds
    ]
