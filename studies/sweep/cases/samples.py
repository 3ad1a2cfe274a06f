"""Where the cases of a sweep lie: grids, lists, Latin hypercubes, Sobol points, one at a time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ocp.arrays import Array
from studies.common.exit_codes import StudyError
from studies.sweep.config import MOST_CASES, Axis, SweepStudy
from studies.sweep.indices import saltelli_points

Point = tuple[Any, ...]  # a value of each axis


@dataclass(frozen=True)
class Design:
    """The points of a sweep, in the order of its table.

    Attributes
    ----------
    points : values of the axes, in their order; None leaves a key as the study states it.
    parents : of each point, the place of the one whose motion it may start from, or None.
    """

    points: Sequence[Point]
    parents: Sequence[int | None]


def design(study: SweepStudy) -> Design:
    """The points of a sweep; the same study gives the same points.

    Raises
    ------
    StudyError
        If there are too many.
    """
    axes: tuple[Axis, ...] = study.parameters
    if study.sampling == "grid":
        return _grid(axes, study.warm)
    if study.sampling == "list":
        points = list(zip(*(axis.values for axis in axes), strict=True))
    elif study.sampling == "one-at-a-time":
        points = [(None,) * len(axes)]
        for place, axis in enumerate(axes):
            before, after = (None,) * place, (None,) * (len(axes) - place - 1)
            points += [(*before, value, *after) for value in axis.values]
    else:
        points = _drawn(study, axes)
    return Design(points, [None] * len(points))


def _grid(axes: Sequence[Axis], warm: bool) -> Design:
    """All combinations, the last axis fastest.

    The parent of a point lies one step nearer to the first point, along the last axis that is not
    at its first value. So values that are added to the end of an axis change no parent.
    """
    counts = [len(axis.values) for axis in axes]
    if math.prod(counts) > MOST_CASES:
        raise StudyError(
            f"the grid has {math.prod(counts)} cases, more than {MOST_CASES}; give fewer values, "
            "or draw them by latin-hypercube or sobol"
        )
    points = list(itertools.product(*(axis.values for axis in axes)))
    if not warm:
        return Design(points, [None] * len(points))

    strides = [math.prod(counts[place + 1 :]) for place in range(len(counts))]
    parents: list[int | None] = []
    for number, steps in enumerate(itertools.product(*map(range, counts))):
        moved = [place for place, step in enumerate(steps) if step > 0]
        parents.append(number - strides[moved[-1]] if moved else None)
    return Design(points, parents)


def _drawn(study: SweepStudy, axes: Sequence[Axis]) -> list[Point]:
    """Points between the ends: a Latin hypercube, a scrambled Sobol sequence, or Saltelli's."""
    assert study.samples is not None
    if study.sampling == "sobol-indices":
        shares = saltelli_points([axis.key for axis in axes], study.samples, study.seed)
        return [_inside(axes, row) for row in shares]
    from scipy.stats import qmc  # takes long to load, and only such studies need it

    if study.sampling == "sobol":
        # a power of two keeps the sequence balanced; the first points of it are returned
        engine = qmc.Sobol(len(axes), seed=study.seed)
        shares = engine.random_base2(max(0, math.ceil(math.log2(study.samples))))
        shares = shares[: study.samples]
    else:
        shares = qmc.LatinHypercube(len(axes), seed=study.seed).random(study.samples)
    return [_inside(axes, row) for row in shares]


def _inside(axes: Sequence[Axis], shares: Array) -> Point:
    """The point at shares of the way from the low ends to the high ends."""
    return tuple(_at(axis, float(share)) for axis, share in zip(axes, shares, strict=True))


def _at(axis: Axis, share: float) -> float:
    """The value at a share of the way from the low end to the high end."""
    if axis.scale == "log":
        return float(axis.low ** (1 - share) * axis.high**share)
    return float(axis.low + (axis.high - axis.low) * share)
