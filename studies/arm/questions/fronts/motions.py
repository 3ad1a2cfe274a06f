"""The motions of a front's points in its result, which `antenna-ocp export --motion` takes.

Points are numbered from 1, the one with the least limit first, as in the rows of its profile.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ocp import FrontPoint
from studies.arm.replay.sampled import INTERPOLATION, STEPS, SampledProfile, sample_times, sampled
from studies.arm.report.profile import profile_series
from studies.common.result import Series
from studies.fronts.columns import point_name


def motion_series(points: Sequence[FrontPoint]) -> dict[str, Series]:
    """Torque, angle and rate of all points, each along a time of its own."""
    arrays: dict[str, Series] = {}
    for number, point in enumerate(points, start=1):
        arrays |= profile_series(_profile(point), point_name(number))
    return arrays


def motion_details(points: Sequence[FrontPoint]) -> dict[str, Any]:
    """What an export says of each motion; what the samples alone would leave is not asked."""
    return {
        point_name(number): {
            "profile_of": point_name(number),
            "accuracy": {
                "residual_energy_of_the_motion_before_sampling_J": (
                    point.motion.replay.residual_energy
                ),
                "sample_time_s": _profile(point).step,
                "interpolation": INTERPOLATION["torque"],
            },
        }
        for number, point in enumerate(points, start=1)
    }


def _profile(point: FrontPoint) -> SampledProfile:
    """A point's motion at the longest sample time, with the replay of the motion itself."""
    replayed = point.motion.replay
    times = sample_times(replayed.motion.stage.duration, STEPS[0])
    values = {k: sampled(joint, times) for k, joint in replayed.motion.joints.items()}
    return SampledProfile(replayed, times, values, replayed)
