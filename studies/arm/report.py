"""What is printed and recorded of a motion of the arm."""

from __future__ import annotations

from typing import Any

import numpy as np

from models.arm.parameters import ASSUMED_MODULUS
from studies.arm.config import TUBES, ArmStudy
from studies.arm.engineer import (
    Loads,
    deflections,
    early_and_late,
    mean_square,
    settling_time,
    stress,
    work_drawn,
)
from studies.arm.objectives import OBJECTIVES
from studies.arm.optimum import Refined
from studies.arm.stage import JOINT_NAMES
from studies.console import Table, number

DAMPING = 0.005  # modal ratio of the settling time where the study states none: an assumption
ASSUMPTIONS = (
    "assumed, not the paper's: CFRP tubes 60 x 2 and 50 x 1.5 mm (E 70 GPa, 1600 kg/m^3), an "
    "antenna of 30 kg as a particle"
)


def facts(study: ArmStudy, found: Refined, history: Loads) -> dict[str, Any]:
    """All figures of a motion, with units in their names."""
    stage, full = study.stage, found.replay
    lock = full.run.engagement
    links = (stage.arm.big, stage.arm.small)
    peaks = history.bending.max(axis=1)
    early, late = early_and_late(full.motion)
    ratio = stage.arm.damping_ratio or DAMPING
    solved = found.solved
    out: dict[str, Any] = {
        "residual energy [J]": full.residual_energy,
        "residual energy on B21, mesh error [J]": solved.reduced_energy,
        "model error [J]": abs(full.residual_energy - solved.reduced_energy),
        "angle miss at the lock [rad]": full.miss,
        "kinetic energy lost in the lock [J]": lock.lost_energy,
        "lock impulse, root [N m s]": float(lock.impulse[0]),
        "lock impulse, elbow [N m s]": float(lock.impulse[1]),
        "peak root force [N]": float(np.linalg.norm(history.force, axis=0).max()),
        "peak root moment [N m]": float(np.abs(history.moment).max()),
        "peak angular momentum passed to the satellite [N m s]":
            float(np.abs(history.angular_momentum).max()),
        "peak tip acceleration [m/s^2]": float(history.tip_acceleration.max()),
        "peak deflection, big and small arm [m]": float(deflections(full).max()),
        "mean square torque [N^2 m^2]": mean_square(full),
        "work of the drives, nothing recovered [J]": work_drawn(full),
        "residual energy, locked 0.1 s early [J]": early.residual_energy,
        "residual energy, locked 0.1 s late [J]": late.residual_energy,
        f"settling of the tip to {study.pointing_error:g} m, damping {ratio:g} [s]":
            settling_time(full, study.pointing_error, ratio),
    }  # fmt: skip
    if len(stage.moving) > 1:
        out["residual energy on B22, for comparison [J]"] = solved.energy_on_B22
    for name, link, moment in zip(("big", "small"), links, peaks, strict=True):
        diameter = study.given.get(f"{name}_diameter", TUBES[name][1])
        bend = stress(float(moment), link.bending_stiffness, diameter, ASSUMED_MODULUS)
        out[f"peak bending moment, {name} arm [N m]"] = float(moment)
        out[f"peak bending stress, {name} arm [Pa]"] = bend
    for k in stage.moving:
        out |= _margins(study, found, k)
    for i in range(len(full.frequencies)):
        label = f"mode {i + 1}, {full.frequencies[i]:.4g} Hz"
        out[f"{label}: amplitude [m]"] = float(full.modal_amplitude[i])
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


def checks(study: ArmStudy, found: Refined) -> list[tuple[str, bool]]:
    """What must hold for the result to count."""
    solved, stage = found.solved, study.stage
    out = [("the replays on B21 and on the full model agree in residual energy", found.agrees)]
    if study.latch is not None:
        name = f"every joint reaches its latch within {study.latch:g} rad"
        out.append((name, found.replay.miss <= study.latch))
    for k in stage.moving:
        for what, value, cap in (
            ("torque", solved.peak_torque[k], study.limits.torque[k]),
            ("rate", solved.peak_rate[k], study.limits.rate[k]),
        ):
            if cap is not None:
                name = f"{JOINT_NAMES[k]} {what} within its cap between the points"
                out.append((name, bool(value <= cap * (1 + 1e-3))))
    return out


def rounds(found: Refined) -> list[dict[str, float]]:
    """The meshes, for the record."""
    return [
        {"intervals": n, "residual_energy_B21_J": b, "residual_energy_full_J": f}
        for n, b, f in found.rounds
    ]
