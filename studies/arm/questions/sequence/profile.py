"""A sequence as drives follow it: both torques sampled, replayed, and what a result holds of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocp.arrays import Array
from studies.arm.optimal.refinement import most_left
from studies.arm.replay import sampled
from studies.arm.replay.full_model import LockedMotion, Motion, in_turn, steps_for
from studies.arm.replay.loads import loads
from studies.arm.report import profile
from studies.arm.stage import ELBOW, JOINT_NAMES, ROOT
from studies.common.result import Series

STEPS = (0.1, *sampled.STEPS)  # [s] sample times tried: a sequence may be slow
INTERPOLATION = sampled.INTERPOLATION["torque"]
_FIGURE_SAMPLES = 4001


@dataclass(frozen=True, eq=False)
class SampledSequence:
    """Both torques over one time, and their replay.

    Attributes
    ----------
    times : (m,) even, from the release of the root to the last lock [s].
    torques : (2, m) of root and elbow, zero while their joint is locked [N m].
    replays : of both motions on the full model, interpolated between the samples.
    """

    times: Array
    torques: Array
    replays: tuple[LockedMotion, ...]

    @property
    def step(self) -> float:
        """Sample time [s]."""
        return float(self.times[1])

    @property
    def left(self) -> float:
        """The most that a lock leaves [J]."""
        return most_left(self.replays)


def sampled_to(
    motions: tuple[Motion, ...], dwell: float, residual: float, step: float | None
) -> SampledSequence:
    """The profile at a sample time [s], or at the longest of `STEPS` that keeps a residual [J].

    Where none keeps it, at the shortest.
    """
    big, small = (motion.stage.duration for motion in motions)
    for tried in STEPS if step is None else (step,):
        times = sampled.sample_times(big + dwell + small, tried)
        torques = torques_at(motions, dwell, times)
        driven = [
            replace(motion, joints={k: sampled.interpolated("torque", times, torques[k], start)})
            for k, motion, start in zip((ROOT, ELBOW), motions, (0.0, big + dwell), strict=True)
        ]
        again = in_turn(driven, (dwell,), settings=steps_for(residual))
        if most_left(again) <= residual:
            break
    return SampledSequence(times, torques, again)


def torques_at(motions: Sequence[Motion], dwell: float, times: Array) -> Array:
    """Torques of root and elbow (2, m) [N m], zero while their joint is locked."""
    starts = 0.0, motions[0].stage.duration + dwell
    drives = [motion.joints[k] for k, motion in zip((ROOT, ELBOW), motions, strict=True)]
    # each starts and ends with none
    return np.array(
        [sampled.sampled(drive, times - start) for drive, start in zip(drives, starts, strict=True)]
    )


def profile_series(found: SampledSequence, replays: Sequence[LockedMotion]) -> dict[str, Series]:
    """Torque, angle and rate of both joints at the sample times: what is handed on."""
    times = found.times
    released_at = float(replays[0].run.runs[-1].times[-1])
    arrays = {"time": Series("s", "time", times, "since the release of the root")}
    for k, motion, start in zip((ROOT, ELBOW), replays, (0.0, released_at), strict=True):
        angle, rate = profile.joint_path(motion, k, times - start)
        arrays |= profile.joint_series("", k, found.torques[k], angle, rate, "of the drive at the")
    return arrays


def torque_series(motions: Sequence[Motion], dwell: float) -> dict[str, Series]:
    """Both torques densely, for the figure."""
    axis = "figure/time"
    whole = dwell + sum(motion.stage.duration for motion in motions)
    times = np.linspace(0.0, whole, _FIGURE_SAMPLES)
    arrays = {axis: Series("s", axis, times, "since the release of the root")}
    for joint, torque in zip(JOINT_NAMES, torques_at(motions, dwell, times), strict=True):
        arrays[f"figure/{joint}_torque"] = Series("N m", axis, torque, f"of the {joint}'s drive")
    return arrays


def load_series(replays: Sequence[LockedMotion], shift: float) -> dict[str, Series]:
    """What the satellite and the links bear, from the release of the root on.

    `shift` is the time from there to the release of the elbow [s].
    """
    big, small = (profile.load_series(loads(motion), motion) for motion in replays)
    arrays = {}
    for name, series in big.items():
        later = small[name].values + (shift if series.unit == "s" else 0.0)
        values = np.concatenate([series.values, later])
        arrays[name] = Series(series.unit, series.axis, values, series.meaning)
    return arrays
