"""Jumps of controls, and where they are.

A switch of a control inside an interval shows as a steep step between two samples of the control.
It is located by the area under the control, which the optimiser gets right before the switch is
resolved. A polynomial swings beside a switch, so that the levels on both sides are those of the
intervals beside the ones that hold it, where these agree with the step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ocp.arrays import Array, Flags
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.numerics.schemes import Collocation

# A step between two samples counts as a jump from this part of the control's range on, and goes on
# while the steps have its sign and at least a third of this.
_STEEP = 0.15
_CONTINUED = 0.3 * _STEEP
# It is a slope and no jump if it takes more than so many steps, or if a step beside it in the same
# direction is more than this part of it.
_MOST_STEPS = 4
_NEIGHBOUR = 0.25
# Part of a jump by which the levels of the intervals beside it have to differ at least, to be those
# of before and after it. Of two switches next to each other they are not.
_LEVELS = 0.6
# Of an interval: a jump in it is put at least so far from its ends.
_INSIDE = 0.05
# A breakpoint moves on only while the control jumps at it by this part of its range.
_FLAT = 0.02
# Of its largest value, or of its typical size if that is more: a control whose range is less is a
# constant with rounding, or with what a solver's barrier leaves of the distance to its bound.
_CONSTANT = 1e-7
# sizes of controls that are not known
_NO_SIZES: Mapping[str, float] = MappingProxyType({})
# rounding of fractions of the phase
ROUND_OFF = 1e-12


@dataclass(frozen=True)
class Jump:
    """A jump between two samples of a control.

    Attributes
    ----------
    first, last : float
        The samples around it, as fractions of the phase.
    at : float
        Where a jump keeps the control's area, as a fraction of the phase.
    size : float
        Relative to the range of the control.
    """

    first: float
    last: float
    at: float
    size: float


def control_samples(motion: PhaseTrajectory, name: str) -> tuple[Array, Array]:
    """Fractions of the phase and values at which a control shows how it varies, (m,) each."""
    control = motion.polynomial(name)
    orders, degrees = control.orders, motion.degrees
    intervals, tau = [np.empty(0, dtype=np.int64)], [np.empty(0)]
    for order, degree in sorted({*zip(orders.tolist(), degrees.tolist(), strict=True)}):
        here = np.flatnonzero((orders == order) & (degrees == degree))
        points = _sample_points(order, motion.scheme.at(degree))
        intervals.append(np.repeat(here, points.size))
        tau.append(np.tile(points, here.size))

    k, local = np.concatenate(intervals), np.concatenate(tau)
    in_time = np.lexsort((local, k))
    k, local = k[in_time], local[in_time]
    times = motion.breakpoints[k] + local * np.diff(motion.breakpoints)[k]
    return motion.fractions_of(times), control.value(k, local)[:, 0]


def _sample_points(order: int, collocation: Collocation) -> Array:
    """Local times at which a polynomial of that order is sampled."""
    if order == 0:
        return np.array([0.5])
    if order == 1:
        return np.array([0.0, 1.0])
    return collocation.points


def control_jumps(motion: PhaseTrajectory, sizes: Mapping[str, float] = _NO_SIZES) -> list[Jump]:
    """Jumps of all controls of a phase.

    Parameters
    ----------
    sizes : mapping of str to float
        Typical sizes of the controls [unit of the control]. One that varies by next to nothing of
        its size does not jump.
    """
    found: list[Jump] = []
    for name in motion.controls:
        times, values = control_samples(motion, name)
        if not _is_constant(values, sizes.get(name, 0.0)):
            found += jumps(times, values, motion.fractions, _interval_means(motion, name))
    return found


def _is_constant(values: Array, size: float) -> bool:
    """Whether samples of a control vary by no more than rounding."""
    largest = max(size, float(np.abs(values).max(initial=0.0)))
    return float(np.ptp(values)) <= _CONSTANT * largest if values.size else True


def _interval_means(motion: PhaseTrajectory, name: str) -> Array | None:
    """Mean of a control over each interval, (N,); None where it is too simple to swing."""
    powers = motion.polynomial(name).powers()[:, 0, :]
    if powers.shape[1] <= 2:
        return None
    return np.asarray(powers @ (1.0 / np.arange(1, powers.shape[1] + 1)))


def jumps(
    times: Array, values: Array, breakpoints: Array, means: Array | None = None
) -> list[Jump]:
    """Jumps of a sampled control: steep, and much steeper than next to them.

    Parameters
    ----------
    times, values : (m,)
        Samples in order; times are fractions of the phase.
    breakpoints : (N + 1,)
        Of the mesh, as fractions of the phase.
    means : (N,), optional
        Of the control over the intervals, which locate its jumps more closely than the samples.
    """
    if not np.isfinite(values).all() or _is_constant(values, 0.0):
        return []
    size = float(np.ptp(values))
    steps = np.diff(values) / size

    located: list[Jump] = []
    first = 0
    while first < steps.size:
        if abs(steps[first]) < _STEEP:
            first += 1
            continue
        last = _end_of_rise(steps, first)
        total = abs(values[last + 1] - values[first]) / size
        if last - first < _MOST_STEPS and _stands_out(steps, first, last, total):
            around = slice(first, last + 2)
            if _is_one_line(times, first, last, breakpoints):
                located += _within_line(times, values, first, total)
            else:
                located.append(_located(times[around], values[around], breakpoints, total, means))
        first = last + 1
    return located


def _end_of_rise(steps: Array, first: int) -> int:
    """The last step that goes on in the direction of the first one."""
    last = first
    while last + 1 < steps.size:
        following = steps[last + 1]
        if following * steps[first] <= 0 or abs(following) < _CONTINUED:
            break
        last += 1
    return last


def _stands_out(steps: Array, first: int, last: int, total: float) -> bool:
    """Whether the steps beside a rise, in its direction, are much smaller than it."""
    beside = [
        abs(steps[j])
        for j in (first - 1, last + 1)
        if 0 <= j < steps.size and steps[j] * steps[first] > 0
    ]
    return all(step <= _NEIGHBOUR * total for step in beside)


def _is_one_line(times: Array, first: int, last: int, breakpoints: Array) -> bool:
    """Whether a rise is the slope of one interval, of a control that is linear in each of them."""
    if times.size != 2 * (breakpoints.size - 1) or last > first or first % 2:
        return False
    ends = breakpoints[first // 2 : first // 2 + 2]
    return bool(np.abs(times[first : first + 2] - ends).max() <= ROUND_OFF)


def _within_line(times: Array, values: Array, first: int, size: float) -> list[Jump]:
    """The jump that a sloping line stands for, between the levels beside it; none if none fits.

    The levels are the means of the neighbours, and at an end of the phase the end of the control's
    range. The line's own mean tells the place of the jump, its slope says nothing.
    """
    mean, falls = values[first : first + 2].mean(), values[first] > values[first + 1]
    highest, lowest = values.max(), values.min()
    outer = (highest, lowest) if falls else (lowest, highest)
    before = values[first - 2 : first].mean() if first > 0 else outer[0]
    after = values[first + 2 : first + 4].mean() if first + 2 < values.size else outer[1]

    if not min(before, after) < mean < max(before, after):
        return []
    part = float(np.clip((mean - after) / (before - after), _INSIDE, 1.0 - _INSIDE))
    begin, end = float(times[first]), float(times[first + 1])
    return [Jump(begin, end, begin + part * (end - begin), size)]


def _located(
    times: Array, values: Array, breakpoints: Array, size: float, means: Array | None
) -> Jump:
    first, last = float(times[0]), float(times[-1])

    # between two intervals there is one place for it
    inside = breakpoints[(breakpoints >= first) & (breakpoints <= last)]
    if times.size == 2 and inside.size == 1:
        return Jump(first, last, float(inside[0]), size)

    area = float(np.trapezoid(values, times))
    at = (area - values[-1] * last + values[0] * first) / (values[0] - values[-1])
    if means is not None:
        closer = _between_levels(first, last, float(values[0] - values[-1]), breakpoints, means)
        at = closer if first < closer < last else at
    return Jump(first, last, float(np.clip(at, first, last)), size)


def _between_levels(
    first: float, last: float, fall: float, breakpoints: Array, means: Array
) -> float:
    """Where a jump keeps the area of the intervals that hold it, nan where that does not tell.

    Parameters
    ----------
    first, last : float
        The samples around it, as fractions of the phase.
    fall : float
        Of the control from the one to the other.
    breakpoints, means
        As of `jumps`.
    """
    left = int(np.searchsorted(breakpoints, first + ROUND_OFF)) - 1
    right = int(np.searchsorted(breakpoints, last - ROUND_OFF)) - 1
    if left < 1 or right > means.size - 2:
        return float("nan")
    before, after = means[left - 1], means[right + 1]
    if (before - after) / fall < _LEVELS:
        return float("nan")

    held = slice(left, right + 1)
    area = float(means[held] @ np.diff(breakpoints)[held])
    begin, end = breakpoints[left], breakpoints[right + 1]
    return float((area - after * end + before * begin) / (before - after))


def jumps_at(motion: PhaseTrajectory, breakpoint_index: int) -> bool:
    """Whether any control still jumps at a breakpoint."""
    return bool(steps_at_breakpoints(motion)[breakpoint_index - 1] > _FLAT)


def steps_at_breakpoints(motion: PhaseTrajectory, sizes: Mapping[str, float] = _NO_SIZES) -> Array:
    """The largest step of a control at each inner breakpoint, relative to its range, (N - 1,).

    It compares both sides of the breakpoint itself, so that a control that goes on rising behind
    its step has one, too. Sizes as of `control_jumps`.
    """
    largest = np.zeros(motion.intervals - 1)
    for name in motion.controls:
        values = control_samples(motion, name)[1]
        if not _is_constant(values, sizes.get(name, 0.0)):
            ends = motion.polynomial(name).ends()[:, :, 0]
            steps = np.abs(ends[1:, 0] - ends[:-1, 1])
            largest = np.maximum(largest, steps / float(np.ptp(values)))
    return largest


def switches_at_breakpoints(motion: PhaseTrajectory, sizes: Mapping[str, float]) -> Flags:
    """Whether a control jumps at each inner breakpoint, (N - 1,). Sizes as of `control_jumps`."""
    return np.asarray(steps_at_breakpoints(motion, sizes) > _FLAT)
