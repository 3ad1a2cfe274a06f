"""Controls that are tried in place of a motion's own, and the least Hamiltonian among them.

At points of the motion, with its states and costates, each control is tried alone over its whole
range, and all together at random points of the box, the same in every run. What is tried is
evaluated, so that what is found is no estimate. What is not tried may be better still.

Limits may tie controls together. Where ``engine + battery`` has to meet a demand, or to exceed it,
another value of the one goes with another value of the other. Where a cost has to stay above a
curve of a control, it may fall along that curve only with the control. So controls that are tried
are moved to within these limits first, and along those that the motion touches, with the states as
they are. Algebraic signals are moved along with the controls that determine them, and count as
controls here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import ROUNDING, Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.optimality.hamiltonian import hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.problem.symbols import Algebraic, Control
from ocp.transcription.path_constraints import PathConstraint

# Values of each control that are tried alone, and points of the box
_ALONE = 33
_TOGETHER = 64

# Values between those where another minimum seems to be, and how often
_CLOSER = 9
_ZOOMS = 3

# About how often the Hamiltonian is evaluated at each point for each control
EVALUATIONS = _ALONE + _ZOOMS * _CLOSER + _TOGETHER

# Part of the motion's own values that a step between those of a range may be. Where it is more,
# ranges around the motion follow, with so many of the former steps on each side: each is about an
# eighth of the one before. The most of them, and the part of its range that counts as the value of
# a control of zero.
_FINE = 0.5
_AROUND = 2.0
_MOST_RANGES = 8
_OF_ZERO = 1e-3

# Steps of Newton's method towards controls within their limits: the first ones may begin far away
_NEWTON_STEPS = 6

# Part of its scale within which a limit is touched: between points a motion is a little off it
_TOUCHED = 1e-3

# Controls (m, n_u) that were tried, and the Hamiltonian with them (m,)
_Tried = tuple[Array, Array]


@dataclass(frozen=True, eq=False, repr=False)
class Dependence:
    """The Hamiltonian and `n_c` path constraints of a phase, as functions of `n_u` tried signals.

    Attributes
    ----------
    signals : tuple of Control or Algebraic
        That are tried.
    columns : tuple of int
        Their places among all signals.
    inputs : list of SX
        Signals, time, unknowns and constants, and costates.
    value : SX
        The Hamiltonian.
    path : (n_c,) SX
        The constraints that have rows at the collocation points.
    constraints : sequence of PathConstraint
        These.
    """

    signals: tuple[Control | Algebraic, ...]
    columns: tuple[int, ...]
    inputs: list[ca.SX]
    value: ca.SX
    path: ca.SX
    constraints: Sequence[PathConstraint]

    @property
    def tried(self) -> ca.SX:
        """The symbols of the tried signals, (n_u,)."""
        return self.inputs[0][list(self.columns)]


def dependence_of(iterate: Iterate, evaluator: Evaluator, index: int) -> Dependence:
    """That of phase number `index` on its controls and algebraic signals."""
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    columns, names = (
        iterate.transcription.columns.phases[index],
        iterate.trajectory.phases[index].signals,
    )
    signals = (*columns.controls, *columns.algebraics)
    places = tuple(names.index(signal.name) for signal in signals)
    constraints = [iterate.transcription.constraints[index][i] for i in hamiltonian.paths]
    return Dependence(signals, places, *hamiltonian.expressions(), constraints)


@dataclass(frozen=True, eq=False, repr=False)
class ControlTrials:
    """What all trials at `m` points of a phase have in common.

    Attributes
    ----------
    function : casadi.Function
        ``(signals, time, unknowns and constants, costates) -> H, k constraints, their slopes by the
        controls (k n_u,)``.
    motion : (m, n)
        Signals of the motion.
    columns : tuple of int
        Of the controls among the signals, those of the algebraic signals behind them.
    times : (m, 1)
        [s].
    numbers : (n,)
        Values of the unknowns and constants.
    costates : (m, n)
    limits : (n_u, 2)
        Lower and upper limit of each control.
    ranges : (n_u, 2)
        First and last value of each control that is tried.
    at_motion : (m, k)
        The constraints on the motion.
    lower, upper : (m, k)
        Their limits, as loose as the motion itself is.
    touched : (m, k)
        Which inequalities the motion touches.
    """

    function: ca.Function
    motion: Array
    columns: tuple[int, ...]
    times: Array
    numbers: Array
    costates: Array
    limits: Array
    ranges: Array
    at_motion: Array
    lower: Array
    upper: Array
    touched: Flags

    @classmethod
    def of(
        cls,
        iterate: Iterate,
        evaluator: Evaluator,
        index: int,
        dependence: Dependence,
        points: tuple[Integers, Array],
        costates: Array,
    ) -> ControlTrials:
        """Those at points of phase number `index`.

        Parameters
        ----------
        points : (intervals (m,), local times (m,))
        costates : (m, n)
            At the points.
        """
        phase, columns = iterate.trajectory.phases[index], dependence.columns
        slopes = ca.jacobian(dependence.path, dependence.tried)
        places = [i for i in range(slopes.size1()) if slopes[i, :].nnz() > 0]
        outputs = [dependence.value, dependence.path[places], ca.vec(slopes[places, :])]
        dense = ca.cse([ca.densify(output) for output in outputs])
        function = ca.Function("trials", dependence.inputs, dense)

        motion, times = phase.local(*points), evaluator.times(phase, *points)[:, None]
        numbers = evaluator.numbers(iterate.trajectory)
        _, at_motion, _ = columnwise(function, motion, times, numbers, costates)

        # with the motion's own controls a constraint may be beyond its limits by what is tolerated
        stated = [dependence.constraints[place] for place in places]
        peaks = iterate.trajectory.peaks_of(iterate.problem)
        pairs = np.array([one.limits(iterate.parameters, peaks) for one in stated]).reshape(-1, 2)
        slack = ROUNDING * (1.0 + np.abs(at_motion))
        off = np.abs(at_motion[:, :, None] - pairs).min(axis=2)
        near = off <= _TOUCHED * np.array([one.scale for one in stated])

        limits = np.array([iterate.parameters.signal_limits[s.name] for s in dependence.signals])
        sizes = np.array([iterate.scales.signals[s.name] for s in dependence.signals])
        return cls(
            function=function,
            motion=motion,
            columns=columns,
            times=times,
            numbers=numbers,
            costates=costates,
            limits=limits,
            ranges=_ranges(limits, motion[:, columns], sizes),
            at_motion=at_motion,
            lower=np.minimum(pairs[:, 0], at_motion) - slack,
            upper=np.maximum(pairs[:, 1], at_motion) + slack,
            touched=near & ~np.array([one.is_equation for one in stated], dtype=bool),
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
        for j in range(count):
            yield from self._alone(j)
        if count > 1:
            for point in np.random.default_rng(0).random((_TOGETHER, count)):
                yield self._tried(np.tile(first + point * (last - first), (len(own), 1)), None)

    def _alone(self, j: int) -> Iterator[_Tried]:
        """Values of control `j` over its range, and closer ones where another minimum seems to be.

        A minimum may be narrower than the steps between the values, and all of them on its slopes.
        """
        mine = self.own[:, j]
        for first, last in _closer_ranges(self.limits[j], self.ranges[j], mine):
            values, step = np.linspace(first, last, _ALONE), (last - first) / (_ALONE - 1)
            tried = [self._with_one(j, value) for value in values]
            yield from tried

            # within a step of the motion's own control it would be that one's minimum
            found = np.array([hamiltonian for _, hamiltonian in tried])
            elsewhere = np.where(np.abs(values[:, None] - mine) > step, found, np.inf)
            lowest = values[elsewhere.argmin(axis=0)]
            above = lowest > mine
            low = np.maximum(lowest - step, np.where(above, mine + step, first))
            high = np.minimum(lowest + step, np.where(above, last, mine - step))
            for _ in range(_ZOOMS):
                shares = np.linspace(0.0, 1.0, _CLOSER)
                closer = [self._with_one(j, low + share * (high - low)) for share in shares]
                yield from closer
                at = np.argmin([hamiltonian for _, hamiltonian in closer], axis=0)
                centre, half = low + shares[at] * (high - low), (high - low) / (_CLOSER - 1)
                low, high = np.maximum(centre - half, low), np.minimum(centre + half, high)

    def _with_one(self, j: int, value: Array) -> _Tried:
        """The motion's controls with another value, one or (m,), of control `j`."""
        controls = self.own
        controls[:, j] = value
        return self._tried(controls, j)

    def _tried(self, controls: Array, kept: int | None) -> _Tried:
        """Controls within shared limits, and the Hamiltonian; infinite where it is not allowed.

        Newton's method takes the smallest step onto the limits that are exceeded, and onto those
        that the motion touches. Where it does not converge, what comes out is not allowed.

        Parameters
        ----------
        kept : int or None
            Number of the control that keeps its value.
        """
        lower = np.where(self.touched, self.at_motion, self.lower)
        upper = np.where(self.touched, self.at_motion, self.upper)
        for step in range(_NEWTON_STEPS + 1):
            hamiltonian, found, slopes = self._evaluated(controls)
            wanted = np.nan_to_num(np.clip(found, lower, upper) - found)
            exceeded = wanted != 0.0
            if not exceeded.any() or step == _NEWTON_STEPS:
                break
            slopes = slopes.reshape(*controls.shape, -1).transpose(0, 2, 1) * exceeded[:, :, None]
            if kept is not None:
                slopes[:, :, kept] = 0.0
            change = np.linalg.pinv(np.nan_to_num(slopes)) @ wanted[:, :, None]
            controls = controls + change[:, :, 0]

        allowed = ((found >= self.lower) & (found <= self.upper)).all(axis=1)
        allowed &= ((controls >= self.limits[:, 0]) & (controls <= self.limits[:, 1])).all(axis=1)
        value = hamiltonian[:, 0]
        return controls, np.where(allowed & ~np.isnan(value), value, np.inf)

    def _evaluated(self, controls: Array) -> list[Array]:
        """What the function gives for controls (m, n_u)."""
        signals = self.motion.copy()
        signals[:, self.columns] = controls
        return columnwise(self.function, signals, self.times, self.numbers, self.costates)


def _ranges(limits: Array, own: Array, sizes: Array) -> Array:
    """First and last values that are tried of each control, (n_u, 2)."""
    low, high = own.min(axis=0), own.max(axis=0)
    # without a bound, as far again as the motion goes, and as zero is
    reach = np.maximum.reduce([high - low, sizes, np.abs(low), np.abs(high)])
    unbounded = np.column_stack([low - reach, high + reach])
    return np.where(np.isfinite(limits), limits, unbounded)


def _closer_ranges(limits: Array, whole: Array, own: Array) -> Iterator[tuple[float, float]]:
    """The range of one control, and further ones where it tells little.

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
    yield first, last
    middle, spread = 0.5 * (low + high), high - low
    typical = max(spread, abs(low), abs(high))
    if not np.isfinite(limits).all() and typical > 0.0:
        reach = 2.0 * typical
        ends = min(low, -high) - reach, max(high, -low) + reach
        yield float(np.clip(ends[0], *limits)), float(np.clip(ends[1], *limits))
    typical = typical or _OF_ZERO * (last - first)
    for _ in range(_MOST_RANGES):
        step = (last - first) / (_ALONE - 1)
        if not step > _FINE * typical:
            return
        half = 0.5 * spread + _AROUND * step
        first, last = (float(end) for end in np.clip([middle - half, middle + half], *limits))
        yield first, last
