"""Where a smooth expression changes within next to no way along a line, as ``tanh(1e6 x)`` does.

Beside such a place its slopes are zero, and no point of a mesh is in between. To all that is built
on derivatives it is a step, though no operation in it is constant piece by piece.

An expression counts as steep where its change between two places of the line is much more than
those beside, and where a short way around the steepest point still holds most of it. A mesh that
resolves the change has several places in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags
from ocp.numerics.columnwise import columnwise

# Operations that may be steep. Sums and products of what is not steep are not.
_STEEP = {
    ca.OP_TANH,
    ca.OP_ERF,
    ca.OP_ATAN,
    ca.OP_EXP,
    ca.OP_SQRT,
    ca.OP_POW,
    ca.OP_CONSTPOW,
}

# Part of its largest value that a change between two places has to be, and times that it has to be
# more than those beside
_LEAST = 1e-3
_STANDS_OUT = 4.0

# Part of what an expression is with symbols of different places, which is rounding: along a motion
# an equation is next to nothing.
_ROUNDING = 1e-6

# The way between two places is divided so often in so many sections: to 1e-6 of it
_SECTIONS, _DIVISIONS = 16, 5

# Part of the line that is next to no way, and part of the change that it has to hold
NO_WAY = 1e-5
_MOST = 0.5
# Times as much of the line, on which a steep change is no larger
_AROUND = 10.0


@dataclass(frozen=True)
class SteepChange:
    """A steep change of an expression on a line.

    Attributes
    ----------
    place : float
    column : int
        Number of the expression.
    size : float
        Relative to its largest value along the line.
    by_place : bool
        Whether it is so with all symbols as they are but that of the line itself.
    """

    place: float
    column: int
    size: float
    by_place: bool


def may_be_steep(expressions: Sequence[ca.SX]) -> bool:
    """Whether scalar expressions hold an operation that may be steep."""
    together = ca.vertcat(*expressions)
    function = ca.Function("expressions", ca.symvar(together), [together])
    codes = {function.instruction_id(k) for k in range(function.n_instructions())}
    return not codes.isdisjoint(_STEEP)


def steep_changes(
    function: ca.Function,
    symbols: Callable[[Array], Array],
    places: Array,
    jumping: Flags,
    own: Flags,
) -> Iterator[SteepChange]:
    """The steep changes of expressions along a line.

    Parameters
    ----------
    function : casadi.Function
        ``symbols (n_s,) -> expressions (k,)``.
    symbols : callable
        Of the values of the symbols (m, n_s) at places (m,).
    places : (n,)
        Of the line, in order, its ends among them.
    jumping : (n_s,)
        Which symbols may jump between places. They are held.
    own : (n_s,)
        Which symbol is that of the line itself.
    """

    def at(wanted: Array, base: Array, held: Flags) -> Array:
        """Expressions at places (m,), with symbols `base` (m, n_s) that are held; 0 at a pole."""
        found = columnwise(function, np.where(held, base, symbols(wanted)))[0]
        return np.where(np.isfinite(found), found, 0.0)

    # off the ends, where a root may be steep
    inner = places[1:-1]
    along = symbols(inner)
    values = at(inner, along, np.ones_like(jumping))
    sizes = np.maximum(np.abs(values).max(axis=0), _ROUNDING * _apart(at, inner, along))
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    steps = np.abs(at(inner[1:], along[:-1], jumping) - values[:-1]) / sizes
    beside = np.pad(steps, ((1, 1), (0, 0)))
    beside = np.maximum(beside[:-2], beside[2:])
    rows, columns = np.nonzero((steps > _LEAST) & (steps > _STANDS_OUT * beside))
    if not rows.size:
        return

    # the section with the largest change, again and again
    low, high, base, each = inner[rows], inner[rows + 1], along[rows], np.arange(rows.size)
    shares = np.linspace(0.0, 1.0, _SECTIONS + 1)
    for _ in range(_DIVISIONS):
        ends = low[:, None] + shares * (high - low)[:, None]
        found = at(ends.ravel(), np.repeat(base, shares.size, axis=0), jumping)
        found = found.reshape(rows.size, shares.size, -1)[each, :, columns]
        largest = np.abs(np.diff(found, axis=1)).argmax(axis=1)
        low, high = ends[each, largest], ends[each, largest + 1]

    middle, half = 0.5 * (low + high), 0.5 * NO_WAY * (places[-1] - places[0])

    def change(held: Flags, times: float = 1.0) -> Array:
        ends = [np.clip(middle + way, inner[0], inner[-1]) for way in (-times * half, times * half)]
        sides = [at(place, base, held)[each, columns] for place in ends]
        return np.asarray(np.abs(sides[1] - sides[0]) / sizes[columns])

    # two places next to no way apart hold nearly all of a change in between, and so of a slope
    most = _MOST * np.maximum(steps[rows, columns], change(jumping, _AROUND))
    whole, by_place = change(jumping), change(~own)
    for k in np.flatnonzero(whole >= most):
        yield SteepChange(
            place=float(middle[k]),
            column=int(columns[k]),
            size=float(whole[k]),
            by_place=bool(by_place[k] >= most[k]),
        )


def _apart(at: Callable[[Array, Array, Flags], Array], places: Array, along: Array) -> Array:
    """Largest values of expressions (k,) with each symbol from another place of the line."""
    count = along.shape[1]
    mixed = np.column_stack(
        [np.roll(along[:, j], (j + 1) * len(along) // (count + 1)) for j in range(count)]
    )
    return np.asarray(np.abs(at(places, mixed, np.ones(count, dtype=bool))).max(axis=0))
