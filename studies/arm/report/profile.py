"""The sampled torque profile of a motion, its replay, and the histories that a result holds."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from models.ancf.joints import Torque, joint_rates
from models.arm.reduced_simulation import ReducedMotion
from ocp.arrays import Array
from studies.arm.replay.full_model import LockedMotion, Motion, replay
from studies.arm.replay.loads import Loads
from studies.arm.stage import JOINT_NAMES
from studies.common.result import Criterion, Result, Series

STEPS = (0.02, 0.005, 0.001)  # [s] sample times tried, the longest first
INTERPOLATION = "cubic spline through the torques, with no slope at either end"
LOAD_AXIS = "loads/time"
_REDUCED_AXIS = "B21/instant"


def sampled(replayed: LockedMotion, step: float) -> tuple[Array, dict[int, Array]]:
    """Times [s] at a sample time, the end included, and the torque of each joint there [N m]."""
    stage = replayed.motion.stage
    count = max(2, round(stage.duration / step) + 1)
    times = np.linspace(0.0, stage.duration, count)
    drives = replayed.motion.joints
    torques = {
        k: np.asarray(drive.torque(times))
        for k, drive in drives.items()
        if isinstance(drive, Torque)
    }
    return times, torques


def sampled_motion(replayed: LockedMotion, step: float) -> Motion:
    """The motion of a drive that interpolates the sampled torques, see `INTERPOLATION`."""
    times, torques = sampled(replayed, step)
    joints = {k: _interpolated(times, values) for k, values in torques.items()}
    name = f"{replayed.motion.name}, sampled every {times[1]:.4g} s"
    return Motion(name, "torque", replayed.motion.stage, joints)


def _interpolated(times: Array, values: Array) -> Torque:
    # the torque starts and ends with no rate
    curve = CubicSpline(times, values, bc_type="clamped")
    return Torque(lambda t: np.asarray(curve(np.clip(t, times[0], times[-1]))))


@dataclass(frozen=True, eq=False)
class SampledProfile:
    """A sampled torque: its sample time [s], and its replay."""

    step: float
    replay: LockedMotion

    @property
    def residual_energy(self) -> float:
        """What a drive leaves that follows the samples [J]."""
        return self.replay.residual_energy


def sampled_to(
    replayed: LockedMotion, residual: float, step: float | None, elements: int
) -> SampledProfile:
    """The profile at a sample time [s], or at the longest of `STEPS` that keeps a residual [J].

    Where none keeps it, at the shortest.
    """
    for tried in STEPS if step is None else (step,):
        motion = sampled_motion(replayed, min(tried, replayed.motion.stage.duration))
        again = replay(motion, elements=elements)
        if again.residual_energy <= residual:
            break
    return SampledProfile(tried, again)


def profile_check(profile: SampledProfile, residual: float) -> Criterion:
    """Whether a drive that follows the exported samples leaves no more than was allowed."""
    left = profile.residual_energy
    held = left <= residual
    name = (
        f"the profile sampled every {profile.step:.4g} s leaves no more than the residual allowed"
    )
    sentence = f"{'verified' if held else 'FAILED'}: {name}"
    return Criterion(name, "J", left, residual, held, sentence)


def profile_series(replayed: LockedMotion, step: float) -> dict[str, Series]:
    """Torque, angle and rate of each driven joint at a sample time: what is handed on."""
    times, torques = sampled(replayed, step)
    run = replayed.run.before
    angles, rates = run.joint_angles(), joint_rates(run.chain, run.q, run.v)

    arrays = {"time": Series("s", "time", times, "since the release")}
    for k, torque in torques.items():
        name = JOINT_NAMES[k]
        angle, rate = (np.interp(times, run.times, x[k]) for x in (angles, rates))
        arrays[f"{name}_torque"] = Series("N m", "time", torque, f"of the {name}'s drive")
        arrays[f"{name}_angle"] = Series("rad", "time", angle, f"of the {name}")
        arrays[f"{name}_rate"] = Series("rad/s", "time", rate, f"of the {name}'s angle")
    return arrays


def load_series(history: Loads, replayed: LockedMotion) -> dict[str, Series]:
    """What the satellite and the links bear, before and after the lock.

    The lock's instant stands twice, right before it and right after; the impulses are in the
    latter, and zero elsewhere.
    """
    # without a motion beyond the lock there is no row right after it
    right_after = min(history.until, len(history.times) - 1)

    def once(value: float) -> Array:
        column = np.zeros(len(history.times))
        column[right_after] = value
        return column

    impulse = replayed.run.engagement.impulse
    columns = {
        "time": ("s", history.times, "since the release"),
        "root_force_x": ("N", history.force[0], "of the satellite on the arm"),
        "root_force_y": ("N", history.force[1], "of the satellite on the arm"),
        "root_moment": ("N m", history.moment, "of the satellite on the arm, about the root"),
        "angular_momentum": ("N m s", history.angular_momentum, "of the arm about the root"),
        "bending_big": ("N m", history.bending[0], "largest bending moment of the big arm"),
        "bending_small": ("N m", history.bending[1], "largest bending moment of the small arm"),
        "tip_acceleration": ("m/s^2", history.tip_acceleration, "of the antenna"),
        "lock_impulse_force_x": ("N s", once(history.force_impulse[0]), "of the lock at the root"),
        "lock_impulse_force_y": ("N s", once(history.force_impulse[1]), "of the lock at the root"),
        "lock_impulse_root": ("N m s", once(impulse[0]), "of the lock"),
        "lock_impulse_elbow": ("N m s", once(impulse[1]), "of the lock"),
    }
    return {
        f"loads/{name}": Series(unit, LOAD_AXIS, values, meaning)
        for name, (unit, values, meaning) in columns.items()
    }


def loads_csv(result: Result) -> str:
    """The loads of a result as CSV."""
    columns = {
        f"{name.removeprefix('loads/')} [{series.unit}]": series.values.tolist()
        for name, series in result.arrays.items()
        if series.axis == LOAD_AXIS
    }
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def reduced_series(motion: ReducedMotion) -> dict[str, Series]:
    """Paths of elbow and tip on the reduced model."""
    arrays = {_REDUCED_AXIS: Series("s", _REDUCED_AXIS, motion.times, "since the release")}
    for point, path in (("elbow", motion.elbow), ("tip", motion.tip)):
        for axis, values in zip("xy", path, strict=True):
            arrays[f"B21/{point}_{axis}"] = Series("m", _REDUCED_AXIS, values, "place")
    return arrays


def read_reduced(result: Result) -> tuple[Array, dict[str, Array]] | None:
    """Times and paths (2, m) of elbow and tip on the reduced model, if a result holds them."""
    if _REDUCED_AXIS not in result.arrays:
        return None
    paths = {
        point: np.array([result.arrays[f"B21/{point}_{axis}"].values for axis in "xy"])
        for point in ("elbow", "tip")
    }
    return result.arrays[_REDUCED_AXIS].values, paths
