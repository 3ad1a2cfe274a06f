"""From a course to the table of a drive: times, rounded positions, and velocities that fit them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.drive.course import Course

DIGITS = 14  # of a time that is a multiple of a step: what a user writes, without its last bit
MOST_POINTS = 2_000_000  # of a table: a thousand a second for half an hour
CLOSEST = 0.5  # of an even segment, between two switches of a rounded table


@dataclass(frozen=True, eq=False)
class SetPoints:
    """The table of a drive.

    Attributes
    ----------
    times : 0 = t_0 < ... < t_m [s].
    positions : at them [m or rad]; whole multiples of `count` where there is one.
    velocities : at them, fitting the positions; zero at the end and, but for a motion that
        is under way, at the start.
    accelerations : at them, of the course.
    count : one count of the encoder [m or rad]; None if positions are not rounded.
    velocity_step : to whole multiples of which velocities are rounded; 0 if they are not.
    """

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    count: float | None = None
    velocity_step: float = 0.0

    @property
    def counts(self) -> Array:
        """Positions in counts, as whole numbers.

        Raises
        ------
        StudyError
            If there is no encoder to count with.
        """
        if self.count is None:
            raise StudyError(
                "this format is written in counts; give drive.counts for each turn of the drum"
            )
        return np.rint(self.positions / self.count).astype(np.int64)

    @property
    def shortest(self) -> float:
        """Shortest step [s]."""
        return float(np.diff(self.times).min())

    @property
    def longest(self) -> float:
        """Longest step [s]."""
        return float(np.diff(self.times).max())


def uniform_times(course: Course, step: float) -> Array:
    """Times k times `step`, until the course has ended, to `DIGITS` digits of the last one.

    Raises
    ------
    StudyError
        If the step is longer than the course, or makes more than `MOST_POINTS` points.
    """
    if step > course.duration * (1 + 1e-9):
        raise StudyError(
            f"the step of the table is {step:g} s, but the motion lasts {course.duration:g} s; "
            "give a shorter step"
        )
    if course.duration / step > MOST_POINTS:
        raise StudyError(
            f"steps of {step:g} s make {course.duration / step:.3g} points of a motion of "
            f"{course.duration:g} s, but a table may have up to {MOST_POINTS:.3g}; give a step of "
            f"{course.duration / MOST_POINTS:.2g} s or more"
        )
    # a duration that is a multiple but for rounding needs no further point
    last = math.ceil(course.duration / step - 1e-9)
    times = step * np.arange(max(last, 1) + 1, dtype=float)
    decimals = DIGITS - 1 - math.floor(math.log10(times[-1]))
    rounded: Array = np.around(times, decimals)
    return rounded


def switch_point_times(
    course: Course,
    segments: int,
    grid: float | None = None,
    longest: float | None = None,
    rounded: bool = False,
) -> Array:
    """Times on all switches, with as many segments in all, shared out by length.

    Parameters
    ----------
    segments : the most segments.
    grid : whole multiple of which each time has to be [s], as of a controller's sample.
    longest : the longest segment [s].
    rounded : whether positions are. Then a switch closer than `CLOSEST` to the one before gets no
        time of its own: what rounding adds grows with the square of a short segment, and more than
        what such a switch inside of a segment costs.

    Raises
    ------
    StudyError
        If the switches alone need more segments, none may be as long as they would have to be, or
        there are more than `MOST_POINTS`.
    """
    if segments > MOST_POINTS:
        raise StudyError(
            f"{segments + 1} points are too many for a table, which may have up to "
            f"{MOST_POINTS:.3g}; give fewer"
        )
    edges = np.array(course.switches)
    if rounded and edges.size <= segments + 1:
        edges = _apart(edges, CLOSEST * course.duration / segments)
    if grid is not None:
        edges = grid * np.rint(edges / grid)
        edges[-1] = grid * math.ceil(course.duration / grid - 1e-9)
        edges = np.unique(edges)

    lengths = np.diff(edges)
    if lengths.size > segments:
        raise StudyError(
            f"the motion switches {lengths.size - 1} times, but the table may have only {segments} "
            f"segments; allow {lengths.size}, or use a fixed step"
        )
    shares = _shares(lengths, segments)
    times = _spread(edges, shares, grid)

    step = float(np.diff(times).max())
    if longest is not None and step > longest * (1 + 1e-9):
        raise StudyError(
            f"{segments} segments of {course.duration:g} s are up to {step:.4g} s long, but "
            f"drive.longest_segment is {longest:g} s; use a buffer of "
            f"{math.ceil(course.duration / longest) + lengths.size}"
        )
    return times


def _apart(edges: Array, closest: float) -> Array:
    """The first edge, the last one, and of those between what is no closer to its neighbours."""
    kept = [float(edges[0])]
    for edge in edges[1:-1].tolist():
        if edge - kept[-1] >= closest and edges[-1] - edge >= closest:
            kept.append(edge)
    return np.array([*kept, float(edges[-1])])


def _shares(lengths: Array, segments: int) -> list[int]:
    """Segments of each piece: at least one, and the next one where they are longest."""
    shares = np.ones(lengths.size, dtype=int)
    spare = segments - lengths.size
    shares += np.floor(spare * lengths / lengths.sum()).astype(int)
    for _ in range(segments - int(shares.sum())):
        shares[int(np.argmax(lengths / shares))] += 1
    return [int(share) for share in shares]


def _spread(edges: Array, shares: list[int], grid: float | None) -> Array:
    pieces = [
        np.linspace(left, right, share + 1)
        for (left, right), share in zip(itertools.pairwise(edges), shares, strict=True)
    ]
    times = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
    # on a coarse grid two times may fall together
    return times if grid is None else np.unique(grid * np.rint(times / grid))


def sampled(course: Course, times: Array, count: float | None = None) -> SetPoints:
    """The table of a course at given times; the last of them may lie behind its end.

    Each position is rounded by itself. So the increments between them lose no count: they add up
    to the rounded travel. The velocities get what the rounding adds to the slope, from a cubic
    spline through what was rounded off, whose own slopes are zero at both ends.
    """
    inside = np.minimum(times, course.duration)
    exact, velocity, acceleration, _ = course.derivatives(inside)
    acceleration = np.where(times > course.duration, 0.0, acceleration)

    positions = exact if count is None else count * np.rint(exact / count)
    # between the rests alone: no slope reaches into them
    moving = np.flatnonzero((velocity != 0.0) | (acceleration != 0.0))
    if moving.size:
        part = slice(max(int(moving[0]) - 1, 0), int(moving[-1]) + 2)
        velocity[part] += _slopes(times[part], (positions - exact)[part])
    velocity[[0, -1]] = course.start_speed, 0.0
    return SetPoints(times, positions, velocity, acceleration, count)


def _slopes(times: Array, residual: Array) -> Array:
    """Slopes of the cubic spline through the residuals, zero at both ends."""
    if times.size < 3 or not residual.any():
        return np.zeros_like(times)
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(times, residual, bc_type="clamped")
    slopes: Array = spline(times, nu=1)
    return slopes
