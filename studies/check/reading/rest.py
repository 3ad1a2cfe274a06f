"""The motion in a recording: what stands still before and after it is found and left out.

A recording starts before the motor does. Where the motion begins is seen only once it has left the
noise, and a smooth start leaves it late: the angle rises by a power of the time. So the first rows
that have left the noise are followed back to where that power begins. A recording without rest is
told by this from one with rest, however much of its start the noise hides.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from ocp.arrays import Array
from studies.check.reading.profile import LEAST_ROWS, MeasuredProfile
from studies.check.reading.table import refuse
from studies.check.smoothing.noise import ROUNDING, estimate_noise

OUT_OF_NOISE = 6.0  # standard deviations by which a row has left the level at rest
POWERS = (2, 3, 4)  # of the time by which an angle starts: 2 with a jump of the acceleration
LEAST_REST = 5  # rows at rest from which their level is known
FOLLOWED = 60.0  # times the noise: from there on rows count as exact
FEWEST = 6  # rows by which it is followed
HIDDEN = 1.0  # of what noise hides of a start: a rest that is shorter may be part of it
ON_A_ROW = 0.02  # of the time between two rows, by which a start is that of a row


def moving_part(
    measured: MeasuredProfile,
    begin: float | None = None,
    end: float | None = None,
    asked: tuple[float, float] | None = None,
) -> MeasuredProfile:
    """The profile from the start of its motion to its end.

    Parameters
    ----------
    measured : MeasuredProfile
        As recorded.
    begin, end : float, optional
        When the motion starts and ends by the time of the file, from the user [s].
    asked : (float, float), optional
        Least and longest duration that the study states [s]. A recording of that length is the
        motion, which may rest at its ends; a motion that ends within a row of it has that length.

    Raises
    ------
    StudyError
        If what the user states leaves too few rows.
    """
    time, last, slack = measured.time, measured.duration, measured.spacing / 2
    low, high = asked or (math.inf, -math.inf)
    start, stop = 0.0, last
    if not low - slack <= last <= high + slack:
        rests = _rests(time, measured.values)
        start, stop = _on_a_row(time, rests[0]), _on_a_row(time, last - rests[1])
        if low == high and abs(stop - start - low) <= measured.spacing:
            stop = min(start + low, last)

    # what the user states is that of a row
    if begin is not None:
        start = _nearest(time, begin - measured.origin)
    if end is not None:
        stop = _nearest(time, end - measured.origin)
    if start <= 0.0 and stop >= last:
        return measured
    return _cut(measured, start, stop)


def _nearest(time: Array, instant: float) -> float:
    return float(time[np.abs(time - instant).argmin()])


def _on_a_row(time: Array, instant: float) -> float:
    """An instant, or that of a row beside it."""
    near = _nearest(time, instant)
    step = float(np.median(np.diff(time)))
    return near if abs(near - instant) <= ON_A_ROW * step else instant


def _rests(time: Array, values: Mapping[str, Array]) -> tuple[float, float]:
    """How long all joints or the rope rest at the start and at the end [s]."""
    # without a torque the arm may coast
    moved = [x for name, x in values.items() if not name.endswith("torque")]
    start = min((_rest(time, x) for x in moved), default=math.inf)
    end = min((_rest(time[-1] - time[::-1], x[::-1]) for x in moved), default=math.inf)
    return (start, end) if max(start, end) < math.inf else (0.0, 0.0)


def _rest(time: Array, values: Array) -> float:
    """How long a column rests at the start [s]: 0 if it does not, infinite if it never moves."""
    found = estimate_noise(time, values, np.ones_like(values))
    # steps of rounding hide alike what many rows have in common
    noise = max(found.deviation, found.step / 2, ROUNDING * float(np.abs(values).max()))
    level = float(np.median(values[:LEAST_REST]))
    count = _left(values, level, noise)
    if count == values.size:
        return math.inf
    if count < LEAST_REST:
        return 0.0
    level = float(np.mean(values[:count]))
    count = _left(values, level, noise)

    onset = _onset(time, values - level, count, noise)
    hidden, step = time[count] - onset, float(np.median(np.diff(time[: count + 1])))
    return onset if onset > max(HIDDEN * hidden, 2 * step) else 0.0


def _left(values: Array, level: float, noise: float) -> int:
    """Number of the first row that has left a level, and the next one with it."""
    out = np.abs(values - level) > OUT_OF_NOISE * noise
    both = np.flatnonzero(out[:-1] & out[1:])
    return int(both[0]) if both.size else values.size


def _onset(time: Array, risen: Array, count: int, noise: float) -> float:
    """When a motion starts, whose row `count` is the first that has left the noise."""
    if abs(risen[min(count + 1, risen.size - 1)]) > FOLLOWED * noise:
        return _between_rows(time, np.abs(risen), count)
    return _within_noise(time, risen, count, noise)


def _between_rows(time: Array, risen: Array, count: int) -> float:
    """The start of exact rows: the one before is at rest."""
    seen = slice(count, count + FEWEST)
    t, best, onset = time[seen] - time[count], math.inf, 0.0
    for power in POWERS:
        root = risen[seen] ** (1 / power)
        curve = np.polynomial.Polynomial.fit(t, root, 2)
        misfit = float(np.abs(curve(t) - root).max() / root.max())
        roots = np.asarray(curve.roots(), dtype=complex)
        before = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real <= 0.0)].tolist()
        if before and misfit < best:
            best, onset = misfit, max(before)
    return float(time[count]) + max(onset, float(time[count - 1] - time[count]))


def _within_noise(time: Array, risen: Array, count: int, noise: float) -> float:
    """The start of noisy rows, which have risen by a cube of the time since then.

    From one level to one eight times as high takes as long as from the start to the first level.
    """
    high = _left(risen, 0.0, 8 * noise)
    return float(2 * time[count] - time[min(high, time.size - 1)])


def _cut(measured: MeasuredProfile, start: float, stop: float) -> MeasuredProfile:
    """The rows from start to stop, with one at each of them."""
    time = measured.time
    inside = np.flatnonzero((time > start) & (time < stop))
    if inside.size + 2 < LEAST_ROWS:
        refuse(
            measured.path,
            f"has {inside.size + 2} rows from {measured.origin + start:g} to "
            f"{measured.origin + stop:g} s; give at least {LEAST_ROWS}, by --motion-from and "
            "--motion-to",
        )
    grid = np.concatenate([[start], time[inside], [stop]])
    places = [
        int(place[0]) if (place := np.flatnonzero(time == t)).size else -1 for t in grid[[0, -1]]
    ]

    def at_grid(column: Array) -> Array:
        # between two rows it rests as these do
        return np.concatenate(
            [[np.interp(start, time, column)], column[inside], [np.interp(stop, time, column)]]
        )

    digits = max(2, math.ceil(-math.log10(measured.spacing)))
    begin, end = (f"{measured.origin + instant:.{digits}f}" for instant in (start, stop))
    return dataclasses.replace(
        measured,
        time=grid - start,
        origin=measured.origin + start,
        values={name: at_grid(column) for name, column in measured.values.items()},
        rounding={name: at_grid(half) for name, half in measured.rounding.items()},
        kept=np.concatenate([[places[0]], measured.kept[inside], [places[1]]]),
        notes=(
            *measured.notes,
            f"moves from {begin} to {end} s by the time of the file; the rest is left out",
        ),
    )
