"""The torque and angle profile as CSV and JSON, and the replay of the sampled profile."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from models.ancf.joints import Torque, joint_rates
from studies.arm.config import ArmStudy
from studies.arm.replay.full import Motion, Replay, replay
from studies.arm.replay.loads import Loads
from studies.arm.stage import JOINT_NAMES
from studies.common.folder import ResultsFolder, provenance

Array = NDArray[np.float64]


def sampled(replayed: Replay, step: float) -> tuple[Array, dict[int, Array]]:
    """Times [s] at a sample time, the end included, and the torque of each joint there [N m]."""
    stage = replayed.motion.stage
    count = max(2, round(stage.duration / step) + 1)
    t = np.linspace(0.0, stage.duration, count)
    laws = replayed.motion.joints
    torques = {k: np.asarray(law.torque(t)) for k, law in laws.items() if isinstance(law, Torque)}
    return t, torques


def sampled_motion(replayed: Replay, step: float) -> Motion:
    """The motion of a drive that interpolates the sampled torques monotonically."""
    t, torques = sampled(replayed, step)
    joints = {k: _held(t, values) for k, values in torques.items()}
    name = f"{replayed.motion.name}, sampled every {t[1]:.4g} s"
    return Motion(name, "torque", replayed.motion.stage, joints)


def _held(t: Array, values: Array) -> Torque:
    curve = PchipInterpolator(t, values)
    return Torque(lambda at: np.asarray(curve(np.clip(at, t[0], t[-1]))))


def profile(replayed: Replay, step: float) -> dict[str, tuple[str, Array]]:
    """Columns (unit, values) of the profile at a sample time."""
    t, torques = sampled(replayed, step)
    before = replayed.run.before
    angles, rates = before.joint_angles(), joint_rates(before.chain, before.q, before.v)
    columns: dict[str, tuple[str, Array]] = {"time": ("s", t)}
    for k, torque in torques.items():
        name = JOINT_NAMES[k]
        columns[f"{name}_torque"] = ("N m", torque)
        columns[f"{name}_angle"] = ("rad", np.interp(t, before.times, angles[k]))
        columns[f"{name}_rate"] = ("rad/s", np.interp(t, before.times, rates[k]))
    return columns


def write_profile(
    folder: ResultsFolder, study: ArmStudy, replayed: Replay, facts: Mapping[str, Any]
) -> Replay:
    """Write `profile.csv` and `profile.json`; return the replay of the sampled profile."""
    columns = profile(replayed, study.sample_time)
    with folder.file("profile.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name} [{unit}]" for name, (unit, _) in columns.items()])
        writer.writerows(np.column_stack([v for _, v in columns.values()]).tolist())
    again = replay(sampled_motion(replayed, study.sample_time), elements=study.elements)
    folder.write_json("profile.json", {
        "study": dict(study.given),
        "interpolation": "monotone cubic (PCHIP) between the samples",
        "residual_energy_J": replayed.residual_energy,
        "residual_energy_of_the_sampled_profile_J": again.residual_energy,
        **facts,
        "made_by": provenance(),
        "columns": {n: {"unit": u, "values": v.tolist()} for n, (u, v) in columns.items()},
    })  # fmt: skip
    return again


def write_loads(folder: ResultsFolder, history: Loads, replayed: Replay) -> None:
    """Write `loads.csv`: what the satellite and the links bear, before and after the lock.

    The lock's instant has two rows, right before it and right after; the impulses are in the
    latter, and zero elsewhere.
    """
    at = min(history.until, len(history.times) - 1)

    def once(value: float) -> Array:
        column = np.zeros(len(history.times))
        column[at] = value
        return column

    impulse = replayed.run.engagement.impulse
    columns = {
        "time [s]": history.times,
        "root_force_x [N]": history.force[0], "root_force_y [N]": history.force[1],
        "root_moment [N m]": history.moment,
        "angular_momentum [N m s]": history.angular_momentum,
        "bending_big [N m]": history.bending[0], "bending_small [N m]": history.bending[1],
        "tip_acceleration [m/s^2]": history.tip_acceleration,
        "lock_impulse_force_x [N s]": once(history.force_impulse[0]),
        "lock_impulse_force_y [N s]": once(history.force_impulse[1]),
        "lock_impulse_root [N m s]": once(impulse[0]),
        "lock_impulse_elbow [N m s]": once(impulse[1]),
    }  # fmt: skip
    with folder.file("loads.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(np.column_stack(list(columns.values())).tolist())


def write_input(folder: ResultsFolder, study: ArmStudy) -> None:
    """Write `input.toml`, which reproduces the result."""
    lines = ["# Reproduces this result: antenna-ocp arm --config input.toml", ""]
    for key, value in study.given.items():
        lines.append(f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value!r}")
    folder.file("input.toml").write_text("\n".join(lines) + "\n", "utf-8")
