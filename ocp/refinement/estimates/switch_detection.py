"""Jumps of controls: where they are, and meshes whose breakpoints can move onto them.

A switch of a control inside an interval shows as a steep step between two samples of the control.
It is located by the area under the control, which the optimiser gets right before the switch is
resolved, and put in a bracket of fixed breakpoints with a movable one between them. In a bracket a
breakpoint cannot wander, nor drag others along. Where the switch may lie anywhere in an interval,
that interval is the bracket.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.mesh import SAME_POINT, PhaseMesh, distinct
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.numerics.piecewise_polynomial import PiecewisePolynomial
from ocp.numerics.schemes import Collocation
from ocp.optimality.active_set import CLOSE, share_at_limit

# A step between two samples counts as a jump from this part of the control's range on, and goes on
# while the steps have its sign and at least a third of this.
_STEEP = 0.15
_CONTINUED = 0.3 * _STEEP
# It is a slope and no jump if it takes more than so many steps, or if a step beside it in the same
# direction is more than this part of it.
_MOST_STEPS = 4
_NEIGHBOUR = 0.25
# Half the width of a bracket as a part of the width within which the jump may lie: narrow enough
# that its ends need not move, wide enough that the optimum is inside.
_BRACKET = 0.15
# Of an interval: a jump in it is put at least so far from its ends.
_INSIDE = 0.05
# A breakpoint moves on only while the control jumps at it by this part of its range.
_FLAT = 0.02
# Of its width before: an interval this narrow is pressed together by a movable breakpoint.
_PRESSED = 0.03
# Of the phase: an interval this narrow is none.
_VANISHED = 1e-7
# rounding of fractions of the phase
_SAME = 1e-12
_NOWHERE = np.empty(0)


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


def control_jumps(motion: PhaseTrajectory) -> list[Jump]:
    """Jumps of all controls of a phase."""
    return [
        jump
        for name in motion.controls
        for jump in jumps(*control_samples(motion, name), motion.fractions)
    ]


def jumps(times: Array, values: Array, breakpoints: Array) -> list[Jump]:
    """Jumps of a sampled control: steep, and much steeper than next to them.

    Parameters
    ----------
    times, values : (m,)
        Samples in order; times are fractions of the phase.
    breakpoints : (N + 1,)
        Of the mesh, as fractions of the phase.
    """
    size = float(np.ptp(values)) if values.size else 0.0
    if size == 0.0 or not np.isfinite(size):
        return []
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
                located.append(_located(times[around], values[around], breakpoints, total))
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
    return bool(np.abs(times[first : first + 2] - ends).max() <= _SAME)


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


def _located(times: Array, values: Array, breakpoints: Array, size: float) -> Jump:
    first, last = float(times[0]), float(times[-1])

    # between two intervals there is one place for it
    inside = breakpoints[(breakpoints >= first) & (breakpoints <= last)]
    if times.size == 2 and inside.size == 1:
        return Jump(first, last, float(inside[0]), size)

    area = float(np.trapezoid(values, times))
    at = (area - values[-1] * last + values[0] * first) / (values[0] - values[-1])
    return Jump(first, last, float(np.clip(at, first, last)), size)


def with_jumps(
    mesh: PhaseMesh, bracketed: Sequence[Jump], move: bool, known: Array = _NOWHERE
) -> PhaseMesh | None:
    """The mesh with every jump in a bracket; None if there is nothing new.

    A bracket is a pair of breakpoints close on both sides of the located jump. With `move`, a
    breakpoint that the optimiser may move between them stands at the jump. A jump that may lie
    anywhere in an interval has that for its bracket then. A jump at an instant that is `known`
    (m,), as a fraction of the phase, needs no bracket: a breakpoint stands there.
    """
    points = mesh.breakpoints
    movable = {float(points[i]) for i in mesh.movable}
    new = False

    for jump in sorted(bracketed, key=lambda j: -j.size):
        followed = any(jump.first - _SAME <= p <= jump.last + _SAME for p in movable)
        if followed or not 1e-9 < jump.at < 1 - 1e-9:
            continue
        if np.any(np.abs(known - jump.at) <= SAME_POINT):
            continue
        if move and _is_interval(points, jump):
            points = distinct(np.append(points, jump.at))
            movable.add(jump.at)
            new = True
            continue
        reach = _BRACKET * _uncertainty(points, jump)
        sides = np.array([jump.at - reach, jump.at + reach])
        sides = sides[(sides > 0.0) & (sides < 1.0)]

        close = np.abs(points - jump.at) < 1.5 * reach
        kept = np.abs(points[:, None] - known).min(axis=1, initial=np.inf) <= SAME_POINT
        replaced = close & ~kept & ~np.isin(points, [0.0, 1.0, *movable])
        if replaced.sum() >= 2 and not move:
            # it stands already; a bracket that follows a jump to and fro undoes splits
            continue
        middle = [jump.at] if move else []
        points = distinct(np.concatenate([points[~replaced], sides, middle]))
        movable.update(middle)
        new = True

    if not new:
        return None
    centres = 0.5 * (points[:-1] + points[1:])
    parents = np.searchsorted(mesh.breakpoints, centres) - 1
    parents = np.clip(parents, 0, mesh.intervals - 1)
    indices = tuple(int(np.searchsorted(points, p)) for p in sorted(movable))
    return PhaseMesh(points, mesh.degrees[parents], indices)


def _is_interval(points: Array, jump: Jump) -> bool:
    """Whether a jump may lie anywhere in one interval, and in no other."""
    k = int(np.clip(np.searchsorted(points, jump.at) - 1, 0, points.size - 2))
    off = max(abs(points[k] - jump.first), abs(points[k + 1] - jump.last))
    return bool(points[k] < jump.at < points[k + 1] and off <= SAME_POINT)


def _uncertainty(points: Array, jump: Jump) -> float:
    """Width within which a jump may lie: between its samples, at least a neighbouring interval."""
    k = int(np.clip(np.searchsorted(points, jump.at) - 1, 0, points.size - 2))
    near = np.diff(points)[max(k - 1, 0) : k + 2]
    return max(jump.last - jump.first, float(near.min()))


def settled(mesh: PhaseMesh, motion: PhaseTrajectory) -> tuple[PhaseMesh, bool]:
    """The mesh at the solved breakpoints, and whether a breakpoint wants to move on.

    A breakpoint that ran into a fixed neighbour takes its place, so that it can go further in the
    next round. An interval that vanished is dropped. A breakpoint without a jump stays put.
    """
    fractions = motion.fractions
    before, after = np.diff(mesh.breakpoints), np.diff(fractions)
    movable = {i for i in mesh.movable if _jumps_at(motion, i)}
    last = mesh.intervals

    gone: set[int] = set()
    pressed = False
    for k in np.flatnonzero(mesh.moving & (after < _PRESSED * before)):
        left, right = int(k), int(k) + 1
        if after[k] < _VANISHED:
            gone.add(right if right in movable and right < last else left)
            pressed = True
        elif left in movable and right not in mesh.movable and right < last:
            gone.add(right)
            pressed = True
        elif right in movable and left not in mesh.movable and left > 0:
            gone.add(left)
            pressed = True
        elif left in movable or right in movable:
            pressed = True

    kept = [i for i in range(last + 1) if i not in gone or i in (0, last)]
    indices = tuple(kept.index(i) for i in sorted(movable) if i in kept)
    return PhaseMesh(fractions[kept], mesh.degrees[np.array(kept[:-1])], indices), pressed


def _jumps_at(motion: PhaseTrajectory, breakpoint_index: int) -> bool:
    """Whether any control still jumps at a breakpoint."""
    for name in motion.controls:
        size = float(np.ptp(control_samples(motion, name)[1]))
        ends = motion.polynomial(name).ends()[:, :, 0]
        step = ends[breakpoint_index, 0] - ends[breakpoint_index - 1, 1]
        if size > 0 and abs(step) > _FLAT * size:
            return True
    return False


def control_errors(motion: PhaseTrajectory, mesh: PhaseMesh) -> Array:
    """Estimated error of each interval's control shape relative to the control's range, (N,).

    Of a constant or linear control it is what the next order would add, from the smaller of the
    differences to both neighbours: a level next to a jump is no error, a value between two levels
    is. Of a polynomial of a higher order it is its last Legendre coefficient.
    """
    worst = np.zeros(mesh.intervals)
    for _, error in _errors_by_control(motion, mesh):
        worst = np.maximum(worst, error)
    return worst


def parts_to_resolve(motion: PhaseTrajectory, mesh: PhaseMesh, allowed: float) -> Array:
    """In how many parts each interval is cut until its control shapes err by what is allowed, (N,).

    The error of a shape of order p falls with the power p + 1 of the width.
    """
    most = np.zeros(mesh.intervals)
    for orders, error in _errors_by_control(motion, mesh):
        most = np.maximum(most, (error / allowed) ** (1.0 / (orders + 1.0)))
    return most


def _errors_by_control(
    motion: PhaseTrajectory, mesh: PhaseMesh
) -> Iterator[tuple[Integers, Array]]:
    """Orders and estimated errors of each control that varies, (N,) each."""
    # a breakpoint at which nothing jumps separates no levels
    mesh = replace(mesh, movable=tuple(i for i in mesh.movable if _jumps_at(motion, i)))
    for name in motion.controls:
        size = float(np.ptp(control_samples(motion, name)[1]))
        if size == 0.0:
            continue
        control = motion.polynomial(name)
        ends, width = control.ends()[:, :, 0], np.diff(control.breakpoints)
        level = 0.5 * (ends[:, 0] + ends[:, 1])
        slope = (ends[:, 1] - ends[:, 0]) / width

        # the error of a step is a quarter of the difference of levels, that of a line an eighth of
        # the difference of slopes times the width
        by_levels = _smaller_difference(level, mesh) / 4.0
        by_slopes = width * _smaller_difference(slope, mesh) / 8.0
        error = np.where(control.orders == 0, by_levels, by_slopes)
        error = np.where(control.orders > 1, _legendre_tail(control), error)
        yield control.orders, error / size


def saturated(motion: PhaseTrajectory, limits: Mapping[str, tuple[float, float]]) -> Flags:
    """Intervals in which a control stays on one of its bounds or close to it, (N,)."""
    on_bound = np.zeros(motion.intervals, dtype=bool)
    for name in motion.controls:
        margin = CLOSE * float(np.ptp(control_samples(motion, name)[1]))
        for limit in limits[name]:
            on_bound |= share_at_limit(motion.polynomial(name), limit, margin) == 1.0
    return on_bound


def _smaller_difference(values: Array, mesh: PhaseMesh) -> Array:
    """Smaller of the differences to both neighbours, (N,); 0 beside a movable breakpoint."""
    at_breakpoints = np.concatenate([[np.inf], np.abs(np.diff(values)), [np.inf]])
    at_breakpoints[list(mesh.movable)] = 0.0
    smaller = np.minimum(at_breakpoints[:-1], at_breakpoints[1:])
    return np.where(np.isfinite(smaller), smaller, 0.0)


def _legendre_tail(control: PiecewisePolynomial) -> Array:
    """Size of the highest Legendre coefficient in each interval, (N,)."""
    orders = control.orders
    highest = np.take_along_axis(control.powers()[:, 0, :], orders[:, None], axis=1)[:, 0]
    # the leading coefficient of the Legendre polynomial on [0, 1]
    leading: Integers = np.array([comb(2 * order, order) for order in orders.tolist()])
    return np.abs(highest) / leading
