"""Expressions of a statement that jump where a comparison, a sign or a rounded number changes.

At such an instant the costates jump too, by an amount that depends on how the crossing moves
(Bryson and Ho, "Applied Optimal Control", 1975, section 3.7). The nonlinear program has no
derivative that tells: its solution holds the dynamics, and need not be an optimum. Two phases that
meet where the comparison changes state the same with derivatives.

Whether an expression jumps is found by values alone. Where a comparison changes between two points
that are drawn at random, the change is enclosed, and the expression is compared on both sides. One
that only has a kink there, or goes over to a series, has one value. A comparison that none of the
points changes is not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array
from ocp.numerics.columnwise import columnwise, enclosed
from ocp.numerics.kinks import stepwise_operations
from ocp.problem.symbols import Constant, Signal, Symbol, Time, Unknown, is_number, resolve
from ocp.problem.texts import SHORT, text_of

# Points that are drawn, and pairs of them between which a change is enclosed
_POINTS, _PAIRS = 33, 4

# Powers of ten between which the size of a symbol without limits is drawn
_SIZES = (-2.0, 3.0)

# What goes beyond limits of a range is drawn at these
_AT_LIMITS = 0.25

# Part of the largest value of an expression, up to which its two sides are the same
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Discontinuity:
    """A jump of an expression.

    Attributes
    ----------
    phase : str
        Along which it may happen; empty for an expression of numbers of the whole motion.
    what : str
        What jumps, in words.
    cause : SX
        What changes there, such as ``x < 2``.
    depends : tuple of Symbol
        What that depends on.
    size : float
        Of the jump, as a part of the largest value that was found of the expression.
    free_times : bool
        Whether the phase has a free time, so that a known one may be anywhere in it.
    """

    phase: str
    what: str
    cause: ca.SX
    depends: tuple[Symbol, ...]
    size: float
    free_times: bool = False

    @property
    def moves(self) -> bool:
        """Whether its place in the phase depends on the motion."""
        held = (Constant,) if self.free_times else (Time, Constant)
        return not all(isinstance(symbol, held) for symbol in self.depends)

    @property
    def sentence(self) -> str:
        """What is wrong, and the remedy."""
        where = f" of phase '{self.phase}'" if self.phase else ""
        remedy = "write each side as a separate problem, and compare the solutions"
        if self.phase:
            remedy = "use two phases that meet there, linked by joined(first, second)"
        if self.phase and all(isinstance(symbol, (Time, Constant)) for symbol in self.depends):
            remedy += ", the later of which may have zero duration"
        return (
            f"{self.what}{where} jumps where '{text_of(self.cause, SHORT)}' changes, and "
            f"derivatives do not contain this jump, so the solution need not be optimal: {remedy}, "
            "or use a smooth expression"
        )


def discontinuities(
    phase: str,
    named: Sequence[tuple[str, ca.SX]],
    span: tuple[float, float] = (-np.inf, np.inf),
    *,
    free_times: bool = False,
) -> tuple[Discontinuity, ...]:
    """The jumps of some expressions, for each change of a comparison the largest.

    Parameters
    ----------
    phase : str
        Whose expressions they are; empty for those of numbers of the whole motion.
    named : sequence of (str, SX)
        Expressions, and what each is in words.
    span : (float, float)
        Between which times the phase is, as far as they are stated [s].
    free_times : bool
        Whether the phase has a free time.
    """
    texts = [what for what, _ in named]
    expressions = [expression for _, expression in named]
    together = ca.vertcat(*expressions, ca.SX(0, 1))
    bare = ca.symvar(together)
    stepwise = stepwise_operations(expressions, bare)
    if stepwise is None:
        return ()

    symbols = {s.symbol.element_hash(): s for e in expressions for s in resolve(e, "a statement")}
    points = _drawn([symbols[own.element_hash()] for own in bare], span)
    inputs = [ca.vertcat(*bare, ca.SX(0, 1))]
    function = ca.Function("causes", inputs, [ca.densify(ca.vertcat(*stepwise.results))])
    (values,) = columnwise(ca.Function("values", inputs, [ca.densify(together)]), points)
    sizes = np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=0)
    sizes = np.where(sizes > 0.0, sizes, 1.0)

    def causes(points: Array) -> Array:
        return columnwise(function, points)[0]

    # both sides of each change, to rounding
    found = causes(points)
    differ = (found[1:] != found[:-1]) & np.isfinite(found[1:] + found[:-1])
    differ &= np.cumsum(differ, axis=0) <= _PAIRS
    pairs, numbers = np.nonzero(differ)
    low, high = enclosed(causes, points[pairs], points[pairs + 1], numbers)
    on_sides = [columnwise(stepwise.function, high, causes(side))[0] for side in (low, high)]
    jumps = np.nan_to_num(np.abs(on_sides[1] - on_sides[0]) / sizes, nan=0.0, posinf=0.0)

    listed = []
    for number in sorted({*numbers.tolist()}):  # `np.unique` would load masked arrays
        largest = jumps[numbers == number].max(axis=0)
        column = int(largest.argmax())
        size, cause = float(largest[column]), stepwise.results[number]
        if size > _SAME:
            depends = resolve(cause, "a comparison")
            listed.append(Discontinuity(phase, texts[column], cause, depends, size, free_times))
    return tuple(listed)


def _drawn(symbols: Sequence[Symbol], span: tuple[float, float]) -> Array:
    """Values of symbols, within limits that are numbers, the same in every run, (m, n)."""
    random = np.random.default_rng(0)
    points = random.standard_normal((_POINTS, len(symbols)))
    points *= 10.0 ** random.uniform(*_SIZES, size=points.shape)
    for column, symbol in zip(points.T, symbols, strict=True):
        if isinstance(symbol, Constant):
            column[:] = symbol.value
            continue
        lower, upper = span if isinstance(symbol, Time) else _limits(symbol)
        if np.isfinite([lower, upper]).all():
            # some values are the limits themselves: what jumps is often beside one of them
            beyond = 0.0 if isinstance(symbol, Time) else _AT_LIMITS
            shares = random.uniform(-beyond, 1.0 + beyond, size=_POINTS)
            column[:] = lower + np.clip(shares, 0.0, 1.0) * (upper - lower)
        elif np.isfinite(lower):
            column[:] = lower + np.abs(column)
        elif np.isfinite(upper):
            column[:] = upper - np.abs(column)
    return points


def _limits(symbol: Symbol) -> tuple[float, float]:
    """Those of a signal or an unknown that are numbers, infinite elsewhere."""
    if not isinstance(symbol, (Signal, Unknown)):
        return -np.inf, np.inf
    lower = float(symbol.lower) if is_number(symbol.lower) else -np.inf
    return lower, float(symbol.upper) if is_number(symbol.upper) else np.inf
