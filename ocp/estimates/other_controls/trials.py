"""Controls that are tried in place of a motion's own, and the least Hamiltonian among them.

At points of the motion, with its states and costates, each control is tried alone over its whole
range, and all together at random points of the box, the same in every run. What is tried is
evaluated, so that what is found is no estimate. What is not tried may be better still.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.estimates.other_controls.limits import ControlLimits, dependence_on_controls, tried_signals
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.optimality.iterate import Iterate
from ocp.optimality.unwrapping import possible_periods

# Values of each control that are tried alone, and points of the box
_ALONE = 33
_TOGETHER = 64

# and of each control where there is no other minimum to be found
_ONE_VALLEY = 9

# Part of the motion's own values that a step between those of a range may be. Where it is more,
# ranges around the motion follow, with so many of the former steps on each side: each is about an
# eighth of the one before. The most of them, and the part of its range that counts as the value of
# a control of zero.
_FINE = 0.5
_AROUND = 2.0
_MOST_RANGES = 8
_OF_ZERO = 1e-3

# Times that the bracket of a minimum is narrowed, by the golden section: to a hundredth of a step
_SECTIONS = 10
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)

# Controls (m, n_u) that were tried, and the Hamiltonian with them (m,)
_Tried = tuple[Array, Array]


@dataclass(frozen=True, eq=False, repr=False)
class ControlTrials:
    """What all trials at `m` points of a phase have in common.

    Attributes
    ----------
    function : casadi.Function
        ``(signals, time, unknowns and constants, costates) -> H``.
    motion : (m, n)
        Signals of the motion.
    columns : tuple of int
        Of the controls among the signals, those of the algebraic signals behind them.
    times : (m, 1)
        [s].
    numbers : (n,)
        Values of the unknowns and constants.
    costates : (m, n)
    shared : ControlLimits or None
        Limits that controls share.
    limits : (n_u, 2)
        Lower and upper limit of each control.
    ranges : (n_u, 2)
        First and last value of each control that is tried.
    closer : sequence of sequence of (first, last)
        For each control, further ranges around the motion's own values.
    turns : sequence of sequence of float
        For each control, possible periods of the rates, such as a whole turn of an angle.
    one_minimum : bool
        Whether the Hamiltonian and all limits are convex in the controls.
    """

    function: ca.Function
    motion: Array
    columns: tuple[int, ...]
    times: Array
    numbers: Array
    costates: Array
    shared: ControlLimits | None
    limits: Array
    ranges: Array
    closer: Sequence[Sequence[tuple[float, float]]]
    turns: Sequence[Sequence[float]]
    one_minimum: bool

    @classmethod
    def of(
        cls,
        iterate: Iterate,
        evaluator: Evaluator,
        index: int,
        points: tuple[Integers, Array],
        costates: Array,
        *,
        one_minimum: bool,
    ) -> ControlTrials:
        """Those at points of phase number `index`.

        Parameters
        ----------
        points : (intervals (m,), local times (m,))
        costates : (m, n)
            At the points.
        """
        phase, tried = iterate.trajectory.phases[index], tried_signals(iterate, index)
        dependence = dependence_on_controls(iterate, evaluator, index)
        motion, times = phase.local(*points), evaluator.times(phase, *points)[:, None]
        limits = np.array([iterate.parameters.signal_limits[signal.name] for signal in tried])
        sizes = np.array([iterate.scales.signals[signal.name] for signal in tried])
        rates = list(iterate.problem.phases[index].dynamics.values())
        own = motion[:, dependence.columns]
        ranges = _ranges(limits, own, sizes)
        return cls(
            function=dependence.hamiltonian,
            motion=motion,
            columns=dependence.columns,
            times=times,
            numbers=evaluator.numbers(iterate.trajectory),
            costates=costates,
            shared=ControlLimits.of(iterate, evaluator, index, motion, times),
            limits=limits,
            ranges=ranges,
            closer=[
                list(_closer_ranges(*of_one)) for of_one in zip(limits, ranges, own.T, strict=True)
            ],
            turns=[list(possible_periods(rates, signal)) for signal in tried],
            one_minimum=one_minimum,
        )

    @property
    def own(self) -> Array:
        """Controls of the motion, (m, n_u)."""
        return self.motion[:, self.columns]

    def best(self, value: Array) -> _Tried:
        """The best controls of all that are tried, and the Hamiltonian with them.

        The motion's own ones, with the Hamiltonian `value` (m,), where none are better.
        """
        controls, least = self.own, value.copy()
        for candidate, tried in self._all():
            better = tried < least
            least = np.where(better, tried, least)
            controls[better] = candidate[better]
        return controls, least

    def _all(self) -> Iterator[_Tried]:
        """All controls that are tried."""
        own, (first, last) = self.own, self.ranges.T
        count = own.shape[1]
        several = self.shared is not None and count > 1 and bool(self.shared.touched.any())
        for along in (False, True) if several else (False,):
            for j in range(count):
                yield from self._alone(j, along=along)
            if count > 1 and not self.one_minimum:
                for point in np.random.default_rng(0).random((_TOGETHER, count)):
                    controls = np.tile(first + point * (last - first), (len(own), 1))
                    yield self._tried(controls, None, along=along)

    def _alone(self, j: int, *, along: bool) -> Iterator[_Tried]:
        """Values of control `j` over its range, and what is tried from there."""
        for turn in (sign * period for period in self.turns[j] for sign in (1.0, -1.0)):
            yield self._with_one(j, self.own[:, j] + turn, along=along)
        whole = self.ranges[j]
        if self.one_minimum:
            for value in np.linspace(whole[0], whole[1], _ONE_VALLEY):
                yield self._with_one(j, value, along=along)
            return
        for first, last in (whole, *self.closer[j]):
            values, found = np.linspace(first, last, _ALONE), []
            for value in values:
                controls, hamiltonian = self._with_one(j, value, along=along)
                found.append(hamiltonian)
                yield controls, hamiltonian
            yield from self._to_the_bottom(j, values, np.array(found), along=along)

    def _to_the_bottom(
        self, j: int, values: Array, found: Array, *, along: bool
    ) -> Iterator[_Tried]:
        """Values of control `j` between those that were tried, towards another minimum.

        A minimum may be narrower than the steps between the values, and all of them on its slopes.

        Parameters
        ----------
        values : (k,)
            That were tried, in equal steps.
        found : (k, m)
            The Hamiltonian there.
        """
        step = values[1] - values[0]
        mine = self.own[:, j]
        elsewhere = np.where(np.abs(values[:, None] - mine) > step, found, np.inf)
        lowest = values[elsewhere.argmin(axis=0)]

        # within a step of the motion's own control it would be that one's minimum
        above = lowest > mine
        low = np.maximum(lowest - step, values[0])
        low = np.maximum(low, np.where(above, mine + step, -np.inf))
        high = np.minimum(lowest + step, values[-1])
        high = np.minimum(high, np.where(above, np.inf, mine - step))
        low, high = np.minimum(low, high), np.maximum(low, high)
        for _ in range(_SECTIONS):
            shares = (1.0 - _GOLDEN, _GOLDEN)
            pair = [self._with_one(j, low + s * (high - low), along=along) for s in shares]
            yield from pair
            (lower, at_lower), (upper, at_upper) = pair
            left = at_lower < at_upper
            low, high = np.where(left, low, lower[:, j]), np.where(left, upper[:, j], high)

    def _with_one(self, j: int, value: Array, *, along: bool) -> _Tried:
        """The motion's controls with another value, one or (m,), of control `j`."""
        controls = self.own
        controls[:, j] = value
        return self._tried(controls, j, along=along)

    def _tried(self, controls: Array, kept: int | None, *, along: bool) -> _Tried:
        """Controls within shared limits, and the Hamiltonian; infinite where it is not allowed.

        Parameters
        ----------
        kept : int or None
            Number of the control that keeps its value.
        along : bool
            Whether along the limits that the motion touches, see `ControlLimits.met`.
        """
        allowed = np.ones(len(controls), dtype=bool)
        if self.shared is not None:
            controls = self.shared.met(controls, kept, along=along)
            allowed = self.shared.allow(controls)
        allowed &= ((controls >= self.limits[:, 0]) & (controls <= self.limits[:, 1])).all(axis=1)
        signals = self.motion.copy()
        signals[:, self.columns] = controls
        (values,) = columnwise(self.function, signals, self.times, self.numbers, self.costates)
        return controls, np.where(allowed & ~np.isnan(values[:, 0]), values[:, 0], np.inf)


def evaluations(controls: int) -> int:
    """About how often the Hamiltonian is evaluated at each point, for a number of controls.

    Where limits are touched it is twice that.
    """
    return (_ALONE + 2 * _SECTIONS) * controls + _TOGETHER


def _ranges(limits: Array, own: Array, sizes: Array) -> Array:
    """First and last values that are tried of each control, (n_u, 2)."""
    low, high = own.min(axis=0), own.max(axis=0)
    # without a bound, as far again as the motion goes, and as zero is
    reach = np.maximum.reduce([high - low, sizes, np.abs(low), np.abs(high)])
    unbounded = np.column_stack([low - reach, high + reach])
    return np.where(np.isfinite(limits), limits, unbounded)


def _closer_ranges(limits: Array, whole: Array, own: Array) -> Iterator[tuple[float, float]]:
    """Further ranges of one control, where those between its limits tell little.

    Without a limit the other sign of the motion's values may lie beyond the range. And wide limits,
    such as a million for a control of one, leave steps between the values that hide all minima.

    Parameters
    ----------
    limits, whole : (2,)
        Of the control, and the first and last value of its range.
    own : (m,)
        Its values on the motion.
    """
    low, high = float(own.min()), float(own.max())
    first, last = (float(end) for end in whole)
    middle, spread = 0.5 * (low + high), high - low
    typical = max(spread, abs(low), abs(high))
    if not np.isfinite(limits).all() and typical > 0.0:
        reach = 2.0 * typical
        yield (
            float(np.clip(min(low, -high) - reach, *limits)),
            float(np.clip(max(high, -low) + reach, *limits)),
        )
    typical = typical or _OF_ZERO * (last - first)
    for _ in range(_MOST_RANGES):
        step = (last - first) / (_ALONE - 1)
        if not step > _FINE * typical:
            return
        half = 0.5 * spread + _AROUND * step
        first, last = (float(end) for end in np.clip([middle - half, middle + half], *limits))
        yield first, last
