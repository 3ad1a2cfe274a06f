"""A motion as a drive follows it: sampled, joined by a spline, and replayed on the full model.

What is exported are samples. Between them the drive interpolates, so the arm is left with another
energy than by the motion itself, and the sample time is chosen by it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from models.ancf.analysis import LockedRun
from models.ancf.joints import Driven, Joint, Torque
from ocp.arrays import Array
from studies.arm.replay.full_model import (
    ELEMENTS,
    SMOOTH,
    Drive,
    LockedMotion,
    Motion,
    replay,
    rough_steps_for,
)
from studies.common.finished import NOTHING_KEPT, FinishedSteps

STEPS = (0.02, 0.005, 0.001)  # [s] sample times tried, the longest first
_ASKED = 0.9  # of the residual that a rough replay may leave, which is right to some per cent
INTERPOLATION: dict[Drive, str] = {
    "torque": "cubic spline through the torques, with no slope at either end",
    "angle": "cubic spline through the angles, with no slope at either end",
}


@dataclass(frozen=True, eq=False)
class SampledProfile:
    """A sampled motion and its replay.

    Attributes
    ----------
    exact : replay of the motion that was sampled.
    times : (m,) even, both ends included [s].
    values : (m,) of each joint that turns: torques [N m] or angles [rad], by the drive.
    replay : on the full model, interpolated between the samples.
    """

    exact: LockedMotion
    times: Array
    values: Mapping[int, Array]
    replay: LockedMotion

    @property
    def drive(self) -> Drive:
        """What is sampled."""
        return self.exact.motion.drive

    @property
    def step(self) -> float:
        """Sample time [s]."""
        return float(self.times[1])

    @property
    def residual_energy(self) -> float:
        """What a drive leaves that follows the samples [J]."""
        return self.replay.residual_energy


def sampled_to(
    replayed: LockedMotion,
    residual: float,
    step: float | None = None,
    elements: int = ELEMENTS,
    kept: FinishedSteps = NOTHING_KEPT,
) -> SampledProfile:
    """The profile at a sample time [s], or at the longest of `STEPS` that keeps a residual [J].

    Where none keeps it, at the shortest. Its replay is a step of a study.
    """
    motion = replayed.motion
    tried, run = kept.step(
        f"{motion.name}, sampled", lambda: _replayed(motion, residual, step, elements)
    )
    times, values, follows = _samples(motion, tried)
    return SampledProfile(replayed, times, values, LockedMotion(follows, run))


def _samples(motion: Motion, step: float) -> tuple[Array, dict[int, Array], Motion]:
    """Times of samples, what each joint is given at them, and the motion that follows them."""
    times = sample_times(motion.stage.duration, step)
    values = {k: sampled(joint, times) for k, joint in motion.joints.items()}
    joints = {k: interpolated(motion.drive, times, x) for k, x in values.items()}
    name = f"{motion.name}, sampled every {times[1]:.4g} s"
    return times, values, Motion(name, motion.drive, motion.stage, joints)


def _replayed(
    motion: Motion, residual: float, step: float | None, elements: int
) -> tuple[float, LockedRun]:
    """The sample time of `sampled_to` [s], and what the samples do."""
    rough = rough_steps_for(residual, motion.drive)
    for tried in STEPS if step is None else (step,):
        _, _, follows = _samples(motion, tried)

        # what is stated of an export is finer than what chooses its steps, or as fine
        last = tried == STEPS[-1] or step is not None
        again = replay(follows, elements=elements, settings=SMOOTH if last else rough)
        if not last and again.residual_energy > _ASKED * residual:
            continue
        if not last and rough != SMOOTH:
            again = replay(follows, elements=elements, settings=SMOOTH)
        if again.residual_energy <= residual:
            break
    return tried, again.fixed


def sample_times(duration: float, step: float) -> Array:
    """Even times [s] about a step apart, from 0 to the duration."""
    return np.linspace(0.0, duration, max(2, round(duration / step) + 1))


def sampled(joint: Joint, times: Array) -> Array:
    """What a joint is given at times (m,): a torque [N m] or an angle [rad]."""
    if not isinstance(joint, Torque | Driven):
        raise ValueError("sampled: the joint is neither under torque nor on an angle")
    return np.asarray((joint.torque if isinstance(joint, Torque) else joint.angle)(times))


def interpolated(drive: Drive, times: Array, values: Array, start: float = 0.0) -> Joint:
    """The joint of a drive that interpolates samples, see `INTERPOLATION`.

    Its time begins with that of the samples, or at a `start` among them [s].
    """
    # torques and angles start and end with no rate
    curve = CubicSpline(times, values, bc_type="clamped")
    value, rate, acceleration = (partial(_within, curve, start, order) for order in (0, 1, 2))
    return Torque(value) if drive == "torque" else Driven(value, rate, acceleration)


def _within(curve: CubicSpline, start: float, order: int, t: Array) -> Array:
    """A derivative of a spline between its ends."""
    return np.asarray(curve(np.clip(t + start, curve.x[0], curve.x[-1]), order))
