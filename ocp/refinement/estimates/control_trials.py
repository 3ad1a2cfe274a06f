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

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.optimality.hamiltonian import Hamiltonian
from ocp.optimality.iterate import Iterate
from ocp.refinement.estimates.control_equations import ControlEquations
from ocp.refinement.unwrapping import possible_periods

# Values of each control that are tried alone, and points of the box
_ALONE = 33
_TOGETHER = 64

# Times that the bracket of a valley is narrowed, by the golden section: to a hundredth of a step
_SECTIONS = 10
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)

# Part of a constraint's size that is rounding
_ROUNDING = 1e-9

# Controls (m, n_u) that were tried, and the Hamiltonian with them (m,)
_Tried = tuple[Array, Array]


@dataclass(frozen=True, eq=False, repr=False)
class ControlTrials:
    """What all trials at `m` points of a phase have in common.

    Attributes
    ----------
    function : casadi.Function
        ``(signals, time, unknowns and constants, costates) -> H, path constraints``.
    motion : (m, n)
        Signals of the motion.
    columns : list of int
        Of the controls among the signals.
    times : (m, 1)
        [s].
    numbers : (n,)
        Values of the unknowns and constants.
    costates : (m, n)
    equations : ControlEquations or None
        That controls have to meet.
    limits : (n_u, 2)
        Lower and upper limit of each control.
    ranges : (n_u, 2)
        First and last value of each control that is tried.
    path_limits : list of (number, lower (m,), upper (m,))
        Of the path constraints in which a control is, as loose as the motion itself is.
    turns : sequence of sequence of float
        Of each control, what the rates may have for a period: a whole turn of an angle.
    """

    function: ca.Function
    motion: Array
    columns: list[int]
    times: Array
    numbers: Array
    costates: Array
    equations: ControlEquations | None
    limits: Array
    ranges: Array
    path_limits: list[tuple[int, Array, Array]]
    turns: Sequence[Sequence[float]]

    @classmethod
    def of(
        cls,
        iterate: Iterate,
        evaluator: Evaluator,
        hamiltonian: Hamiltonian,
        index: int,
        points: tuple[Integers, Array],
        costates: Array,
        path: Array,
    ) -> ControlTrials:
        """Those at points of phase number `index`.

        Parameters
        ----------
        points : (intervals (m,), local times (m,))
        costates : (m, n)
            At the points.
        path : (m, n_c)
            Path constraints there, with the motion's own controls.
        """
        phase = iterate.trajectory.phases[index]
        columns = [phase.signals.index(control.name) for control in hamiltonian.controls]
        motion = phase.local(*points)
        names = [control.name for control in hamiltonian.controls]
        limits = np.array([iterate.parameters.signal_limits[name] for name in names])
        sizes = np.array([iterate.scales.signals[name] for name in names])
        rates = list(iterate.problem.phases[index].dynamics.values())
        return cls(
            function=_values_of(evaluator, hamiltonian, index),
            motion=motion,
            columns=columns,
            times=evaluator.times(phase, *points)[:, None],
            numbers=evaluator.numbers(iterate.trajectory),
            costates=costates,
            equations=ControlEquations.of(iterate, evaluator, hamiltonian, index),
            limits=limits,
            ranges=_ranges(limits, motion[:, columns], sizes),
            path_limits=list(_path_limits(iterate, hamiltonian, path, index)),
            turns=[list(possible_periods(rates, control)) for control in hamiltonian.controls],
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
            for turn in (sign * period for period in self.turns[j] for sign in (1.0, -1.0)):
                yield self._with_one(j, own[:, j] + turn)
            values, found = np.linspace(first[j], last[j], _ALONE), []
            for value in values:
                controls, hamiltonian = self._with_one(j, value)
                found.append(hamiltonian)
                yield controls, hamiltonian
            yield from self._to_the_bottom(j, values, np.array(found))
        if count > 1:
            for point in np.random.default_rng(0).random((_TOGETHER, count)):
                yield self._tried(np.tile(first + point * (last - first), (len(own), 1)), None)

    def _to_the_bottom(self, j: int, values: Array, found: Array) -> Iterator[_Tried]:
        """Values of control `j` between those that were tried, towards the least of another valley.

        A valley may be narrower than the steps between the values, and all of them on its slopes.

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

        # within a step of the motion's own control it would be that one's valley
        above = lowest > mine
        low = np.maximum(lowest - step, values[0])
        low = np.maximum(low, np.where(above, mine + step, -np.inf))
        high = np.minimum(lowest + step, values[-1])
        high = np.minimum(high, np.where(above, np.inf, mine - step))
        low, high = np.minimum(low, high), np.maximum(low, high)
        for _ in range(_SECTIONS):
            shares = (1.0 - _GOLDEN, _GOLDEN)
            pair = [self._with_one(j, low + share * (high - low)) for share in shares]
            yield from pair
            (lower, at_lower), (upper, at_upper) = pair
            left = at_lower < at_upper
            low, high = np.where(left, low, lower[:, j]), np.where(left, upper[:, j], high)

    def _with_one(self, j: int, value: Array) -> _Tried:
        """The motion's controls with another value, one or (m,), of control `j`."""
        controls = self.own
        controls[:, j] = value
        return self._tried(controls, j)

    def _tried(self, controls: Array, kept: int | None) -> _Tried:
        """Controls on their equations, and the Hamiltonian; infinite where they are not allowed.

        Parameters
        ----------
        kept : int or None
            Number of the control that keeps its value.
        """
        if self.equations is not None:
            controls = self.equations.met(controls, kept, self.motion, self.times, self.numbers)
        signals = self.motion.copy()
        signals[:, self.columns] = controls
        values, paths = columnwise(self.function, signals, self.times, self.numbers, self.costates)
        allowed = self._allowed(controls, paths) & ~np.isnan(values[:, 0])
        return controls, np.where(allowed, values[:, 0], np.inf)

    def _allowed(self, controls: Array, paths: Array) -> Flags:
        """Whether controls (m, n_u) and path constraints with them (m, n_c) are within limits."""
        allowed = ((controls >= self.limits[:, 0]) & (controls <= self.limits[:, 1])).all(axis=1)
        for i, lower, upper in self.path_limits:
            allowed &= (paths[:, i] >= lower) & (paths[:, i] <= upper)
        return np.asarray(allowed)


def evaluations(controls: int) -> int:
    """How often the Hamiltonian is evaluated at each point for a number of controls, about."""
    return (_ALONE + 2 * _SECTIONS) * controls + _TOGETHER


def _ranges(limits: Array, own: Array, sizes: Array) -> Array:
    """First and last values that are tried of each control, (n_u, 2)."""
    low, high = own.min(axis=0), own.max(axis=0)
    # without a bound, as far again as the motion goes
    reach = np.maximum(high - low, sizes)
    unbounded = np.column_stack([low - reach, high + reach])
    return np.where(np.isfinite(limits), limits, unbounded)


def _path_limits(
    iterate: Iterate, hamiltonian: Hamiltonian, own: Array, index: int
) -> Iterator[tuple[int, Array, Array]]:
    """Limits of path constraints in which a control is, or what a motion (m, n_c) has beyond."""
    peaks = iterate.trajectory.peaks_of(iterate.problem)
    for i, number in enumerate(hamiltonian.paths):
        if hamiltonian.limits_controls[i]:
            constraint = iterate.transcription.constraints[index][number]
            lower, upper = constraint.limits(iterate.parameters, peaks)
            slack = _ROUNDING * (1.0 + np.abs(own[:, i]))
            yield i, np.minimum(lower, own[:, i]) - slack, np.maximum(upper, own[:, i]) + slack


def _values_of(evaluator: Evaluator, hamiltonian: Hamiltonian, index: int) -> ca.Function:
    """``(signals, time, unknowns and constants, costates) -> H, path constraints``, kept."""
    names = tuple(control.name for control in hamiltonian.controls)
    key = ("hamiltonian alone", index, names, hamiltonian.paths)
    if key not in evaluator.compiled:
        inputs, value, path = hamiltonian.expressions()
        function = ca.Function("hamiltonian_alone", inputs, ca.cse([value, path]))
        evaluator.compiled[key] = function
    kept: ca.Function = evaluator.compiled[key]
    return kept
