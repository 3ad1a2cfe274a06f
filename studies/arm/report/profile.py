"""What a result holds of a motion: its sampled profile, its loads, and its path on B21."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from models.ancf.joints import Driven, joint_rates
from models.arm.reduced_simulation import ReducedMotion
from ocp.arrays import Array
from studies.arm.replay.full_model import LockedMotion
from studies.arm.replay.loads import Loads
from studies.arm.replay.sampled import INTERPOLATION, SampledProfile
from studies.arm.report.quantities import verified
from studies.arm.stage import JOINT_NAMES
from studies.common.result import Criterion, Result, Series

LOAD_AXIS = "loads/time"
_REDUCED_AXIS = "B21/instant"


def profile_check(profile: SampledProfile, residual: float, of: str = "") -> Criterion:
    """Whether a drive that follows the exported samples leaves no more than was allowed.

    `of` names the motion where there are several.
    """
    name = (
        f"the profile{of and f' of {of}'} sampled every {profile.step:.4g} s has a residual energy "
        "within the allowed one"
    )
    return verified(name, "J", profile.residual_energy, residual)


def profile_series(profile: SampledProfile, name: str = "") -> dict[str, Series]:
    """Torque, angle and rate of each joint that turns, at the sample times: what is handed on.

    Under `name` where the result has several profiles, else as its main one.
    """
    times, exact = profile.times, profile.exact
    head = f"{name}/" if name else ""
    axis = f"{head}time"
    arrays = {axis: Series("s", axis, times, "since the release")}
    for k, joint in exact.motion.joints.items():
        if isinstance(joint, Driven):
            angle, rate = profile.values[k], joint.rate(times)
            run, source = exact.run.before, "reaction at the"
            torque = CubicSpline(run.times, run.torque[k])(times)
        else:
            angle, rate = joint_path(exact, k, times)
            torque, source = profile.values[k], "of the drive at the"
        arrays |= joint_series(head, k, torque, angle, rate, source)
    return arrays


def joint_path(replayed: LockedMotion, k: int, times: Array) -> tuple[Array, Array]:
    """Angle [rad] and rate [rad/s] (m,) of a joint that rests before and after its motion."""
    run = replayed.run.before
    angles, rates = run.joint_angles()[k], joint_rates(run.chain, run.q, run.v)[k]
    curve = CubicHermiteSpline(run.times, angles, rates)
    inside = np.clip(times, run.times[0], run.times[-1])
    return np.asarray(curve(inside)), np.where(times == inside, curve(inside, 1), 0.0)


def joint_series(
    head: str, k: int, torque: Array, angle: Array, rate: Array, source: str
) -> dict[str, Series]:
    """What drives follow at a joint, along the axis `time` below a head."""
    axis, where = f"{head}time", JOINT_NAMES[k]
    return {
        f"{head}{where}_torque": Series("N m", axis, torque, f"{source} {where}"),
        f"{head}{where}_angle": Series("rad", axis, angle, f"of the {where}"),
        f"{head}{where}_rate": Series("rad/s", axis, rate, f"of the {where}'s angle"),
    }


def profiles_series(profiles: Mapping[str, SampledProfile]) -> dict[str, Series]:
    """Those of several profiles, the first as the main one."""
    arrays: dict[str, Series] = {}
    for number, (name, profile) in enumerate(profiles.items()):
        arrays |= profile_series(profile, name if number else "")
    return arrays


def accuracy(profile: SampledProfile) -> dict[str, Any]:
    """What an export says of its samples."""
    return {
        "residual_energy_of_the_sampled_profile_J": profile.residual_energy,
        "sample_time_s": profile.step,
        "interpolation": INTERPOLATION[profile.drive],
    }


def exported_motions(profiles: Mapping[str, SampledProfile]) -> dict[str, Any]:
    """Details of a result with several profiles: the first is its main one, the others have names.

    `antenna-ocp export --motion NAME` takes them.
    """
    if not profiles:
        return {}
    first, *others = profiles
    named = {name: {"profile_of": name, "accuracy": accuracy(profiles[name])} for name in others}
    return {"accuracy": accuracy(profiles[first]), "profiles": named}


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
    if (turning := replayed.satellite) is not None:
        before = np.interp(
            history.times[: history.until], replayed.fixed.before.times, turning.turn
        )
        turn = np.concatenate([before, turning.turn_after])
        columns["satellite_angle"] = ("rad", turn, "of the satellite, against its own at the start")
    return {
        f"loads/{name}": Series(unit, LOAD_AXIS, values, meaning)
        for name, (unit, values, meaning) in columns.items()
    }


def files(result: Result) -> dict[str, str]:
    """The loads as a further file of a results folder."""
    return {"loads.csv": loads_csv(result)}


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
