"""Jumps of controls: where they are, and meshes whose breakpoints can move onto them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocp.mesh.mesh import PhaseMesh, distinct
from ocp.mesh.trajectory import PhaseTrajectory
from ocp.numerics.schemes import scheme

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_STEEP = 0.15
_BRACKET = 0.15
_NEIGHBOUR = 0.25
_LONGEST = 4
_FLAT = 0.02
_LEVEL, _NEAR = 1e-5, 1e-3
_VANISHED = 1e-7
_PRESSED = 0.03


@dataclass(frozen=True)
class Jump:
    """A jump between two samples of a control, located so that the control's area is kept.

    Times are fractions of the phase; `first` and `last` are the samples around it.
    """

    first: float
    last: float
    at: float
    size: float


def control_samples(own: PhaseTrajectory, column: int) -> tuple[Array, Array]:
    """Fractions of the phase and values at which a control (column of `controls`) is known."""
    name, span = own.controls[column], own.end - own.start
    left, width = own.breakpoints[:-1], np.diff(own.breakpoints)
    if name in own.constant:
        times, values = left + 0.5 * width, own.steps[:, own.constant.index(name)]
    elif name in own.linear:
        times = np.stack([left, left + width], axis=1).ravel()
        values = own.ramps[:, :, own.linear.index(name)].ravel()
    else:
        index = own.polynomial.index(name)
        t, v = [], []
        for piece in own.pieces:
            points = scheme(own.scheme, piece.degree).points
            t.append((left[piece.intervals, None] + points * width[piece.intervals, None]).ravel())
            v.append(piece.controls[:, :, index].ravel())
        times, values = np.concatenate(t), np.concatenate(v)
        order = np.argsort(times, kind="stable")
        times, values = times[order], values[order]
    return (times - own.start) / span, values


def jumps(times: Array, values: Array, breakpoints: Array) -> list[Jump]:
    """Jumps of a sampled control: steep, and much steeper than next to them."""
    size = float(np.ptp(values)) if values.size else 0.0
    if size == 0.0 or not np.isfinite(size):
        return []
    steps = np.diff(values) / size
    found, i = [], 0
    while i < steps.size:
        if abs(steps[i]) < _STEEP:
            i += 1
            continue
        last = i
        while (
            last + 1 < steps.size
            and steps[last + 1] * steps[i] > 0
            and (abs(steps[last + 1]) >= 0.3 * _STEEP)
        ):
            last += 1
        total = abs(values[last + 1] - values[i]) / size
        around = [abs(steps[j]) for j in (i - 1, last + 1) if 0 <= j < steps.size
                  and steps[j] * steps[i] > 0]  # fmt: skip
        if last - i < _LONGEST and all(s <= _NEIGHBOUR * total for s in around):
            cut = slice(i, last + 2)
            found.append(_located(times[cut], values[cut], breakpoints, total))
        i = last + 1
    return found


def _located(times: Array, values: Array, breakpoints: Array, size: float) -> Jump:
    first, last = float(times[0]), float(times[-1])
    inside = breakpoints[(breakpoints >= first) & (breakpoints <= last)]
    if times.size == 2 and inside.size == 1:
        return Jump(first, last, float(inside[0]), size)
    area = float(np.trapezoid(values, times))
    at = (area - values[-1] * last + values[0] * first) / (values[0] - values[-1])
    return Jump(first, last, float(np.clip(at, first, last)), size)


def with_jumps(mesh: PhaseMesh, found: Sequence[Jump], move: bool) -> PhaseMesh | None:
    """The mesh with every jump in a bracket; None if there is nothing new.

    A bracket is a pair of breakpoints close on both sides of the located jump; with `move`, a
    breakpoint that the optimiser may move between them stands at the jump.
    """
    points = mesh.breakpoints
    movable = {float(points[i]) for i in mesh.movable}
    new = False
    for jump in sorted(found, key=lambda j: -j.size):
        taken = any(jump.first - 1e-12 <= p <= jump.last + 1e-12 for p in movable)
        if taken or not 1e-9 < jump.at < 1 - 1e-9:
            continue
        reach = _BRACKET * _uncertainty(points, jump)
        sides = np.array([jump.at - reach, jump.at + reach])
        sides = sides[(sides > 0.0) & (sides < 1.0)]
        inside = (np.abs(points - jump.at) < 1.5 * reach) & ~np.isin(points, [0.0, 1.0, *movable])
        if inside.sum() >= 2 and not move:
            continue  # it stands already; a bracket that follows a jump to and fro undoes splits
        points = distinct(np.concatenate([points[~inside], sides, [jump.at] if move else []]))
        if move:
            movable.add(jump.at)
        new = True
    if not new:
        return None
    middle = 0.5 * (points[:-1] + points[1:])
    parents = np.clip(np.searchsorted(mesh.breakpoints, middle) - 1, 0, mesh.intervals - 1)
    moves = tuple(int(np.searchsorted(points, p)) for p in sorted(movable))
    return PhaseMesh(points, mesh.degrees[parents], moves)


def _uncertainty(points: Array, jump: Jump) -> float:
    """Width within which a jump may lie: between its samples, at least a neighbouring interval."""
    k = int(np.clip(np.searchsorted(points, jump.at) - 1, 0, points.size - 2))
    near = np.diff(points)[max(k - 1, 0) : k + 2]
    return max(jump.last - jump.first, float(near.min()))


def settled(mesh: PhaseMesh, own: PhaseTrajectory) -> tuple[PhaseMesh, bool]:
    """The mesh at the solved breakpoints, and whether a breakpoint wants to move on.

    A breakpoint that ran into a fixed neighbour takes its place, so that it can go further in the
    next round; an interval that vanished is dropped; a breakpoint without a jump stays put.
    """
    fractions = (own.breakpoints - own.start) / (own.end - own.start)
    fractions[0], fractions[-1] = 0.0, 1.0
    before, after = np.diff(mesh.breakpoints), np.diff(fractions)
    movable = {i for i in mesh.movable if _jumps_at(own, i)}
    gone: set[int] = set()
    pressed = False
    for k in np.flatnonzero(mesh.moving & (after < _PRESSED * before)):
        left, right = int(k), int(k) + 1
        if after[k] < _VANISHED:
            gone.add(right if right in movable and right < mesh.intervals else left)
            pressed = True
        elif left in movable and right not in mesh.movable and right < mesh.intervals:
            gone.add(right)
            pressed = True
        elif right in movable and left not in mesh.movable and left > 0:
            gone.add(left)
            pressed = True
        elif left in movable or right in movable:
            pressed = True
    kept = [i for i in range(mesh.intervals + 1) if i not in gone or i in (0, mesh.intervals)]
    return PhaseMesh(
        fractions[kept], mesh.degrees[np.array(kept[:-1])],
        tuple(kept.index(i) for i in sorted(movable) if i in kept),
    ), pressed  # fmt: skip


def _jumps_at(own: PhaseTrajectory, index: int) -> bool:
    """Whether any control still jumps at a breakpoint."""
    sides = own.local(np.array([index - 1, index]), np.array([1.0, 0.0]))
    n_x = len(own.states)
    for j in range(len(own.controls)):
        values = control_samples(own, j)[1]
        size = np.ptp(values)
        if size > 0 and abs(sides[1, n_x + j] - sides[0, n_x + j]) > _FLAT * size:
            return True
    return False


def control_errors(
    own: PhaseTrajectory, mesh: PhaseMesh, limits: Mapping[str, tuple[float, float]]
) -> Array:
    """Estimated error of each interval's control shape relative to the control's range, (N,).

    A level next to a jump, or a control on its bound, is no error; a value between two levels is.
    """
    worst = np.zeros(mesh.intervals)
    for j, name in enumerate(own.controls):
        size = float(np.ptp(control_samples(own, j)[1]))
        if size == 0.0:
            continue
        if name in own.constant:
            values = own.steps[:, own.constant.index(name)]
            error = _nearest_neighbour(np.abs(np.diff(values)) / 4.0, mesh)
            low, high = limits[name]
            error[np.minimum(np.abs(values - low), np.abs(values - high)) < _LEVEL * size] = 0.0
        elif name in own.linear:
            ramps, width = own.ramps[:, :, own.linear.index(name)], np.diff(own.breakpoints)
            slopes = (ramps[:, 1] - ramps[:, 0]) / width
            bend = np.abs(np.diff(slopes)) / 8.0
            error = width * _nearest_neighbour(bend, mesh)
        else:
            error = _legendre_tail(own, own.polynomial.index(name))
        worst = np.maximum(worst, error / size)
    return worst


def saturated(own: PhaseTrajectory, limits: Mapping[str, tuple[float, float]]) -> NDArray[np.bool_]:
    """Intervals in which a control stays on one of its bounds or close to it, (N,)."""
    found = np.zeros(len(own.breakpoints) - 1, dtype=bool)
    for j, name in enumerate(own.controls):
        low, high = _ranges(own, name)
        close = _NEAR * float(np.ptp(control_samples(own, j)[1]))
        for limit in limits[name]:
            found |= (np.abs(low - limit) <= close) & (np.abs(high - limit) <= close)
    return found


def _ranges(own: PhaseTrajectory, name: str) -> tuple[Array, Array]:
    """Least and largest known value of a control in each interval, (N,) each."""
    if name in own.constant:
        values = own.steps[:, own.constant.index(name)]
        return values, values
    if name in own.linear:
        ramps = own.ramps[:, :, own.linear.index(name)]
        return ramps.min(axis=1), ramps.max(axis=1)
    low, high = np.empty((2, len(own.breakpoints) - 1))
    for piece in own.pieces:
        values = piece.controls[:, :, own.polynomial.index(name)]
        low[piece.intervals], high[piece.intervals] = values.min(axis=1), values.max(axis=1)
    return low, high


def _nearest_neighbour(at_breaks: Array, mesh: PhaseMesh) -> Array:
    """Smaller of the differences at an interval's two inner breakpoints; 0 at movable ones."""
    padded = np.concatenate([[np.inf], at_breaks, [np.inf]])
    padded[list(mesh.movable)] = 0.0
    smaller = np.minimum(padded[:-1], padded[1:])
    return np.where(np.isfinite(smaller), smaller, 0.0)


def _legendre_tail(own: PhaseTrajectory, index: int) -> Array:
    tail = np.zeros(len(own.breakpoints) - 1)
    for piece in own.pieces:
        method = scheme(own.scheme, piece.degree)
        points, count = method.points, method.choices
        if points.size > 1:
            basis = np.linalg.inv(np.polynomial.legendre.legvander(2 * points - 1, points.size - 1))
            tail[piece.intervals] = np.abs(
                piece.controls[:, :, index] @ basis[max(count - 1, 1) :].T).max(axis=1)  # fmt: skip
    return tail
