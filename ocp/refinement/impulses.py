"""Controls that nothing limits and that turn into impulses.

Where an optimum needs an infinite control for no time, as a thrust without a limit, each finer mesh
makes the control higher in a narrower interval. What it does there, height times width, stays. No
mesh ends that: there is no best motion, only a best impulse. A control with a pole that a motion
can follow does less in a narrower interval, by the square root of its width or so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ocp.arrays import Array
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.optimality.iterate import Iterate
from ocp.problem.symbols import Control

# Part of its width to which the interval of the highest control shrinks, and part of what the
# control did there before that it still does. A layer that is thin, but of some width, is resolved
# before; a pole of t^(-3/4) does less.
_NARROWER = 1e-4
_AS_MUCH = 0.1

# Least height, in sizes of the control on the first mesh: less is what a solver leaves of zero.
_HIGH = 10.0

# midpoints at which an interval's mean is taken
_POINTS = (np.arange(8) + 0.5) / 8


class Impulse(NamedTuple):
    """A control that has become an impulse.

    Attributes
    ----------
    phase : str
    control : Control
    height : float
        Its mean in the narrow interval, with its sign [unit of the control].
    """

    phase: str
    control: Control
    height: float


def impulse(first: Iterate, last: Iterate) -> Impulse | None:
    """A control that nothing limits and that is an impulse by now, if there is one.

    Parameters
    ----------
    first, last : Iterate
        On the first mesh and on the last one.
    """
    pairs = zip(first.trajectory.phases, last.trajectory.phases, strict=True)
    for before, after in pairs:
        for control in last.problem.controls[after.name]:
            limits = last.parameters.signal_limits[control.name]
            least = _HIGH * first.scales.signals[control.name]
            free = [s for s, limit in zip((-1.0, 1.0), limits, strict=True) if np.isinf(limit)]
            # beside an impulse a polynomial swings to the other side, too, but less in the mean
            free.sort(key=lambda sign: -_done(after, control, sign))
            for sign in free:
                (old_height, old_width), (height, width) = (
                    _highest(motion, control, sign) for motion in (before, after)
                )
                # without a part of this sign on the first mesh there is nothing to compare
                peaked = old_height > 0 and height >= least and width <= _NARROWER * old_width
                if peaked and height * width >= _AS_MUCH * old_height * old_width:
                    most = free[0]
                    return Impulse(after.name, control, most * _highest(after, control, most)[0])
    return None


def _highest(motion: PhaseTrajectory, control: Control, sign: float) -> tuple[float, float]:
    """The largest interval mean of a control's part of one sign, and that interval's width.

    The height is in the unit of the control, the width a fraction of the phase.
    """
    means = _means(motion, control, sign)
    highest = int(means.argmax())
    return float(means[highest]), float(np.diff(motion.fractions)[highest])


def _done(motion: PhaseTrajectory, control: Control, sign: float) -> float:
    """Mean over the phase of a control's part of one sign, not negative [unit of the control]."""
    return float(_means(motion, control, sign) @ np.diff(motion.fractions))


def _means(motion: PhaseTrajectory, control: Control, sign: float) -> Array:
    """Interval means of a control's part of one sign, not negative [unit of the control], (N,)."""
    intervals = np.repeat(np.arange(motion.intervals), _POINTS.size)
    tau = np.tile(_POINTS, motion.intervals)
    values = motion.polynomial(control.name).value(intervals, tau)[:, 0]
    return np.asarray(np.maximum(sign * values, 0.0).reshape(motion.intervals, -1).mean(axis=1))
