"""A sequence as drives follow it: both torques sampled, replayed, and what a result holds of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from models.ancf.joints import Torque, joint_rates
from ocp.arrays import Array
from studies.arm.questions.sequence.replay import SequenceReplay, replay_drives
from studies.arm.questions.sequence.solve import SequenceLaw
from studies.arm.replay import sampled
from studies.arm.replay.full_model import LockedMotion, steps_for
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
    replay : on the full model, interpolated between the samples.
    """

    times: Array
    torques: Array
    replay: SequenceReplay

    @property
    def step(self) -> float:
        """Sample time [s]."""
        return float(self.times[1])


def sampled_to(law: SequenceLaw, residual: float, step: float | None) -> SampledSequence:
    """The profile at a sample time [s], or at the longest of `STEPS` that keeps a residual [J].

    Where none keeps it, at the shortest.
    """
    big, dwell, _ = durations = law.durations
    for tried in STEPS if step is None else (step,):
        times = sampled.sample_times(sum(durations), tried)
        torques = np.array(torques_at(law, times))
        root, elbow = (CubicSpline(times, x, bc_type="clamped") for x in torques)
        drives = Torque(_from(root, 0.0)), Torque(_from(elbow, big + dwell))
        again = replay_drives(law.case, durations, drives, settings=steps_for(residual))
        if again.left <= residual:
            break
    return SampledSequence(times, torques, again)


def _from(curve: CubicSpline, start: float) -> Callable[[Array], Array]:
    """A torque over the time since its motion began."""
    return partial(_shifted, curve, start)


def _shifted(curve: CubicSpline, start: float, t: Array) -> Array:
    return np.asarray(curve(t + start))


def torques_at(law: SequenceLaw, times: Array) -> tuple[Array, Array]:
    """Torques of root and elbow (m,) [N m], zero while their joint is locked."""
    root, elbow = law.torques
    lock, released_at, _ = np.cumsum(law.durations)
    return (
        np.where(times <= lock, root(np.clip(times, 0, lock)), 0.0),
        np.where(times >= released_at, elbow(np.clip(times - released_at, 0, elbow.x[-1])), 0.0),
    )


def profile_series(found: SampledSequence, replayed: SequenceReplay) -> dict[str, Series]:
    """Torque, angle and rate of both joints at the sample times: what is handed on."""
    times = found.times
    released_at = float(replayed.first.run.runs[-1].times[-1])
    arrays = {"time": Series("s", "time", times, "since the release of the root")}
    for k, motion, start in ((ROOT, replayed.first, 0.0), (ELBOW, replayed.second, released_at)):
        angle, rate = _joint(motion, k, times - start)
        name = JOINT_NAMES[k]
        arrays[f"{name}_torque"] = Series("N m", "time", found.torques[k], f"of the {name}'s drive")
        arrays[f"{name}_angle"] = Series("rad", "time", angle, f"of the {name}")
        arrays[f"{name}_rate"] = Series("rad/s", "time", rate, f"of the {name}'s angle")
    return arrays


def _joint(motion: LockedMotion, k: int, times: Array) -> tuple[Array, Array]:
    """Angle [rad] and rate [rad/s] (m,) of a joint that rests before and after its motion."""
    run = motion.run.before
    angles, rates = run.joint_angles()[k], joint_rates(run.chain, run.q, run.v)[k]
    curve = CubicHermiteSpline(run.times, angles, rates)
    inside = np.clip(times, run.times[0], run.times[-1])
    return np.asarray(curve(inside)), np.where(times == inside, curve(inside, 1), 0.0)


def torque_series(law: SequenceLaw) -> dict[str, Series]:
    """Both torques densely, for the figure."""
    axis = "figure/time"
    times = np.linspace(0.0, sum(law.durations), _FIGURE_SAMPLES)
    arrays = {axis: Series("s", axis, times, "since the release of the root")}
    for joint, torque in zip(JOINT_NAMES, torques_at(law, times), strict=True):
        arrays[f"figure/{joint}_torque"] = Series("N m", axis, torque, f"of the {joint}'s drive")
    return arrays


def load_series(
    replayed: SequenceReplay, durations: tuple[float, float, float]
) -> dict[str, Series]:
    """What the satellite and the links bear, from the release of the root on."""
    big, small = (
        profile.load_series(loads(motion), motion) for motion in (replayed.first, replayed.second)
    )
    shift = durations[0] + durations[1]
    arrays = {}
    for name, series in big.items():
        later = small[name].values + (shift if series.unit == "s" else 0.0)
        values = np.concatenate([series.values, later])
        arrays[name] = Series(series.unit, series.axis, values, series.meaning)
    return arrays
