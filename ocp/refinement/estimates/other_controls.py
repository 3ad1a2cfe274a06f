"""Controls far from those of a motion that make less of the Hamiltonian.

Pontryagin's minimum principle asks for the least value of the Hamiltonian among all controls that
are allowed, not only among those nearby. A nonlinear program compares neighbours: where the
Hamiltonian has several valleys, its answer stays in the one where it began. A control that changes
to a better valley for a short time changes the objective by the difference of the Hamiltonian times
that time, to first order (Bryson and Ho, "Applied Optimal Control", ch. 2 and 3).

Controls are tried at points of the motion, with its states and costates: each control alone over
its whole range, and all together at random points of the box, the same in every run. What is tried
is evaluated, so that what is found is no estimate. What is not tried may be better still.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.numerics.linearity import is_linear, is_quadratic
from ocp.optimality.hamiltonian import Hamiltonian, hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import duration_multiplier, phase_costates
from ocp.problem.display import with_unit
from ocp.refinement.estimates.promised_gain import CERTIFIED_GAIN
from ocp.refinement.unwrapping import possible_periods

# Controls (m, n_u) and the number of the one that keeps its value -> controls, Hamiltonian (m,)
_Trial = Callable[[Array, int | None], tuple[Array, Array]]

# Gauss points of an interval, values of each control that are tried alone, points of the box, and
# evaluations in all: on fine meshes fewer points of an interval are looked at
_POINTS = 4
_ALONE = 33
_TOGETHER = 64
_EVALUATIONS = 200_000

# Times that the bracket of a valley is narrowed, by the golden section: to a hundredth of a step
_SECTIONS = 10
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)

# Steps of Newton's method towards controls that meet equations: the first ones may begin far away
_NEWTON_STEPS = 6

# Of the typical duration: a phase that lasts no longer has shrunk to the least one. That is a
# thousandth of this (`ocp.transcription.blocks`), and the barrier of the solver keeps a little off.
_VANISHED_PHASE = 1e-6

# Part of the largest curvature, and of a constraint's size, that is rounding
_ROUNDING = 1e-9

# Part of the Hamiltonian's terms that a difference has to exceed: valleys that are as deep as each
# other, as those of an angle, differ by the errors of the costates
_LEAST = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class OtherControls:
    """The best of the controls that were tried, at `m` points of a phase.

    Attributes
    ----------
    phase : str
    names : (n_u,) str
        Of the controls.
    intervals : (m,)
        Their numbers.
    fractions : (m,)
        Of the phase's duration, in order.
    times : (m,)
        [s].
    own, best : (m, n_u)
        Controls of the motion, and the best ones; the same where none is better.
    less : (m,)
        By which the best ones make less of the Hamiltonian, not negative [unit of the objective/s].
    weights : (m,)
        Of the points [s], so that ``weights . less`` is the integral.
    vanished : bool
        Whether the phase takes no time. It counts as if it lasted the typical duration with the
        best controls, and `less` is what each second of that gains.
    """

    phase: str
    names: tuple[str, ...]
    intervals: Integers
    fractions: Array
    times: Array
    own: Array
    best: Array
    less: Array
    weights: Array
    vanished: bool

    @property
    def gain(self) -> float:
        """What the best controls promise while the rest stays as it is [unit of the objective]."""
        return float(self.weights @ self.less)

    def of_intervals(self, count: int) -> Array:
        """`gain` of each of all intervals of the phase, shape (count,)."""
        gains = np.zeros(count)
        np.add.at(gains, self.intervals, self.weights * self.less)
        return gains


def other_controls(
    iterate: Iterate, evaluator: Evaluator, acting: Sequence[Flags]
) -> Iterator[OtherControls]:
    """The best controls that were tried, for each phase in which others than neighbours may be.

    Parameters
    ----------
    acting : sequence of (N,)
        Of each phase, intervals in which a path constraint, a peak or a state's bound acts. The
        costates there say little of the controls, and nothing is tried.
    """
    for index in range(len(iterate.trajectory.phases)):
        found = others_of_phase(iterate, evaluator, index, ~acting[index])
        if found is not None:
            yield found


def promised_by(found: Sequence[OtherControls], iterate: Iterate) -> float:
    """What other controls promise to gain together, relative to the objective."""
    return sum(other.gain for other in found) / iterate.objective_size


def others_remark(found: Sequence[OtherControls], iterate: Iterate) -> str:
    """A sentence on controls that promise more than a certificate lets pass; empty if none do."""
    gain = promised_by(found, iterate)
    if not gain > CERTIFIED_GAIN:
        return ""
    most = max(found, key=lambda other: other.gain)
    k = int(np.argmax(most.less))
    units = {control.name: control.unit for control in iterate.problem.controls[most.phase]}
    changed = ", ".join(
        f"{with_unit(f'{name} = {best:.4g}', units[name])} instead of {own:.4g}"
        for name, own, best in zip(most.names, most.own[k], most.best[k], strict=True)
        if own != best
    )
    if most.vanished:
        return (
            f"phase '{most.phase}' takes no time (at {most.times[k]:.4g} s), but should take "
            f"longer: if it lasts {iterate.scales.time:.4g} s with {changed}, it promises to gain "
            f"{most.gain / iterate.objective_size:.2g} of the objective; state a guess of these "
            "controls, and of times between which the phase lasts, Between(lower, upper, guess), "
            "or state none"
        )
    return (
        f"other controls promise to gain {gain:.2g} of the objective, such as {changed} at "
        f"{most.times[k]:.4g} s; state these controls as a guess, or none where one is stated; if "
        "that promises as much again, ever faster switches gain and no motion is the best: limit "
        "how fast the control changes"
    )


def others_of_phase(
    iterate: Iterate, evaluator: Evaluator, index: int, where: Flags
) -> OtherControls | None:
    """The best of what is tried in some intervals (N,) of a phase; None if there is no need."""
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    columns = [phase.signals.index(control.name) for control in hamiltonian.controls]
    symbols, (value, path) = _called(hamiltonian)
    u = symbols[0][columns]
    vanished = bool(phase.end - phase.start <= _VANISHED_PHASE * iterate.scales.time)
    if not columns or (is_linear(value, u) and not vanished):
        return None
    intervals, tau, weights = _points_of(np.flatnonzero(where), len(hamiltonian.controls))
    if intervals.size == 0:
        return None
    costates = phase_costates(iterate, index)
    own = hamiltonian.along(evaluator, iterate.trajectory, costates, intervals, tau)
    square = is_quadratic(value, u) and is_linear(path, u)
    if square and _is_convex(own.curvature) and not vanished:
        return None

    motion = phase.local(intervals, tau)
    controls = motion[:, columns]
    fixed = (
        evaluator.times(phase, intervals, tau)[:, None],
        evaluator.numbers(iterate.trajectory),
        costates.local(intervals, tau),
    )
    function = _values_of(evaluator, hamiltonian, index)
    tied = _Equations.of(iterate, evaluator, hamiltonian, index)
    limits = _signal_limits(iterate, hamiltonian)

    def tried(candidate: Array, held: int | None) -> tuple[Array, Array]:
        """Controls on their equations, and the Hamiltonian; infinite where they are not allowed."""
        if tied is not None:
            candidate = tied.met(candidate, held, motion, fixed[:2])
        signals = motion.copy()
        signals[:, columns] = candidate
        values, paths = columnwise(function, signals, *fixed)
        allowed = _allowed(iterate, hamiltonian, paths, own.path, index)
        allowed &= ((candidate >= limits[:, 0]) & (candidate <= limits[:, 1])).all(axis=1)
        return candidate, np.where(allowed & ~np.isnan(values[:, 0]), values[:, 0], np.inf)

    least, best = own.value.copy(), controls.copy()
    rates = list(iterate.problem.phases[index].dynamics.values())
    turns = [list(possible_periods(rates, control)) for control in hamiltonian.controls]
    ranges = _ranges(iterate, hamiltonian, controls)
    for candidate, value in _tried(tried, *ranges, turns, controls):
        better = value < least
        least = np.where(better, value, least)
        best[better] = candidate[better]

    size = np.abs(own.terms).sum(axis=1)
    less = own.value - least
    widths = np.diff(phase.breakpoints)
    if vanished:
        # No control matters there, and any is stationary. What counts is whether a longer phase
        # would pay with the best ones: a second more with its own costs minus the multiplier, which
        # is negative, and the best ones make that less.
        less += duration_multiplier(iterate, index)
        widths = np.diff(phase.fractions) * iterate.scales.time
    less = np.where(less > _LEAST * size, less, 0.0)
    best = np.where((less > 0.0)[:, None], best, controls)
    return OtherControls(
        phase=phase.name,
        names=tuple(control.name for control in hamiltonian.controls),
        intervals=intervals,
        fractions=(fixed[0][:, 0] - phase.start) / (phase.end - phase.start),
        times=fixed[0][:, 0],
        own=controls,
        best=best,
        less=less,
        weights=weights * widths[intervals],
        vanished=vanished,
    )


def _points_of(intervals: Integers, controls: int) -> tuple[Integers, Array, Array]:
    """Gauss points of intervals: numbers, local times, and weights that add up to one in each."""
    tries = (_ALONE + 2 * _SECTIONS) * controls + _TOGETHER
    points = int(np.clip(_EVALUATIONS // max(tries * intervals.size, 1), 1, _POINTS))
    nodes, weights = np.polynomial.legendre.leggauss(points)
    tau, shares = np.tile(0.5 * (nodes + 1.0), intervals.size), np.tile(weights, intervals.size)
    return np.repeat(intervals, points), tau, 0.5 * shares


def _is_convex(curvature: Array) -> bool:
    """Whether symmetric matrices (m, n, n) have no negative eigenvalue beyond rounding."""
    sizes = np.abs(curvature).max(axis=(1, 2))
    return bool((np.linalg.eigvalsh(curvature)[:, 0] >= -_ROUNDING * sizes).all())


@dataclass(frozen=True, eq=False, repr=False)
class _Equations:
    """Equations of a phase that hold controls, so that none of these moves alone.

    Attributes
    ----------
    function : casadi.Function
        ``(signals, time, unknowns and constants) -> what has to vanish (n_e,), slopes (n_e n_u,)``.
    columns : list of int
        Of the controls among the signals.
    """

    function: ca.Function
    columns: list[int]

    @classmethod
    def of(
        cls, iterate: Iterate, evaluator: Evaluator, hamiltonian: Hamiltonian, index: int
    ) -> _Equations | None:
        """Those of phase number `index`, if there are any."""
        constraints = iterate.transcription.constraints[index]
        places = [
            place
            for place, number in enumerate(hamiltonian.paths)
            if constraints[number].is_equation and hamiltonian.limits_controls[place]
        ]
        if not places:
            return None
        signals = iterate.trajectory.phases[index].signals
        columns = [signals.index(control.name) for control in hamiltonian.controls]
        key = ("equations of controls", index, tuple(signals))
        if key not in evaluator.compiled:
            symbols, (_, path) = _called(hamiltonian)
            slopes = ca.vec(ca.jacobian(path[places], symbols[0][columns]))
            outputs = [ca.densify(path[places]), ca.densify(slopes)]
            evaluator.compiled[key] = ca.Function("equations", symbols[:3], ca.cse(outputs))
        return cls(evaluator.compiled[key], columns)

    def met(
        self, candidate: Array, held: int | None, motion: Array, fixed: tuple[Array, ...]
    ) -> Array:
        """Controls (m, n_u) that meet the equations as the motion does, near those given.

        Parameters
        ----------
        held : int or None
            Number of a control that keeps its value.
        motion : (m, n)
            Its signals.
        fixed : (time (m, 1), unknowns and constants (n,))
        """
        wanted, _ = columnwise(self.function, motion, *fixed)
        signals = motion.copy()
        for _ in range(_NEWTON_STEPS):
            signals[:, self.columns] = candidate
            found, slopes = columnwise(self.function, signals, *fixed)
            slopes = slopes.reshape(*candidate.shape, -1).transpose(0, 2, 1)
            if held is not None:
                slopes[:, :, held] = 0.0
            step = np.linalg.pinv(np.nan_to_num(slopes)) @ np.nan_to_num(wanted - found)[:, :, None]
            candidate = candidate + step[:, :, 0]
        return candidate


def _signal_limits(iterate: Iterate, hamiltonian: Hamiltonian) -> Array:
    """Lower and upper limit of each control, (n_u, 2)."""
    names = [control.name for control in hamiltonian.controls]
    return np.array([iterate.parameters.signal_limits[name] for name in names])


def _ranges(iterate: Iterate, hamiltonian: Hamiltonian, own: Array) -> tuple[Array, Array]:
    """First and last values that are tried of each control, (n_u,) each."""
    low, high = own.min(axis=0), own.max(axis=0)
    # without a bound, as far again as the motion goes
    sizes = [iterate.scales.signals[control.name] for control in hamiltonian.controls]
    reach = np.maximum(high - low, sizes)
    limits = _signal_limits(iterate, hamiltonian)
    first = np.where(np.isfinite(limits[:, 0]), limits[:, 0], low - reach)
    last = np.where(np.isfinite(limits[:, 1]), limits[:, 1], high + reach)
    return first, last


def _tried(
    tried: _Trial, first: Array, last: Array, turns: Sequence[Sequence[float]], own: Array
) -> Iterator[tuple[Array, Array]]:
    """Controls in place of a motion's own (m, n_u), and the Hamiltonian with them (m,).

    Parameters
    ----------
    tried : callable
        Of controls (m, n_u) and the number of the one that keeps its value.
    first, last : (n_u,)
        Of the values of each control.
    turns : sequence of sequence of float
        Of each control, what the rates may have for a period: a whole turn of an angle.
    """
    count = own.shape[1]
    for j in range(count):
        for turn in (sign * period for period in turns[j] for sign in (1.0, -1.0)):
            turned = own.copy()
            turned[:, j] += turn
            yield tried(turned, j)
        values = np.linspace(first[j], last[j], _ALONE)
        found = []
        for value in values:
            candidate = own.copy()
            candidate[:, j] = value
            candidate, hamiltonian = tried(candidate, j)
            found.append(hamiltonian)
            yield candidate, hamiltonian
        yield from _to_the_bottom(tried, j, values, np.array(found), own)
    if count > 1:
        for point in np.random.default_rng(0).random((_TOGETHER, count)):
            yield tried(np.tile(first + point * (last - first), (own.shape[0], 1)), None)


def _to_the_bottom(
    tried: _Trial, j: int, values: Array, found: Array, own: Array
) -> Iterator[tuple[Array, Array]]:
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
    mine = own[:, j]
    elsewhere = np.where(np.abs(values[:, None] - mine) > step, found, np.inf)
    lowest = values[elsewhere.argmin(axis=0)]

    # within a step of the motion's own control it would be that one's valley
    above = lowest > mine
    low = np.maximum(np.maximum(lowest - step, values[0]), np.where(above, mine + step, -np.inf))
    high = np.minimum(np.minimum(lowest + step, values[-1]), np.where(above, np.inf, mine - step))
    low, high = np.minimum(low, high), np.maximum(low, high)
    for _ in range(_SECTIONS):
        pair = []
        for share in (1.0 - _GOLDEN, _GOLDEN):
            candidate = own.copy()
            candidate[:, j] = low + share * (high - low)
            pair.append(tried(candidate, j))
        yield from pair
        (lower, at_lower), (upper, at_upper) = pair
        left = at_lower < at_upper
        low, high = np.where(left, low, lower[:, j]), np.where(left, upper[:, j], high)


def _allowed(
    iterate: Iterate, hamiltonian: Hamiltonian, path: Array, own: Array, index: int
) -> Flags:
    """Whether path constraints that depend on a control are met, or no worse than by a motion."""
    peaks = iterate.trajectory.peaks_of(iterate.problem)
    allowed = np.ones(len(path), dtype=bool)
    for i, number in enumerate(hamiltonian.paths):
        if hamiltonian.limits_controls[i]:
            constraint = iterate.transcription.constraints[index][number]
            lower, upper = constraint.limits(iterate.parameters, peaks)
            slack = _ROUNDING * (1.0 + np.abs(own[:, i]))
            allowed &= path[:, i] >= np.minimum(lower, own[:, i]) - slack
            allowed &= path[:, i] <= np.maximum(upper, own[:, i]) + slack
    return allowed


def _values_of(evaluator: Evaluator, hamiltonian: Hamiltonian, index: int) -> ca.Function:
    """``(signals, time, unknowns and constants, costates) -> H, path constraints``, kept."""
    names = tuple(control.name for control in hamiltonian.controls)
    key = ("hamiltonian alone", index, names, hamiltonian.paths)
    if key not in evaluator.compiled:
        symbols, outputs = _called(hamiltonian)
        evaluator.compiled[key] = ca.Function("hamiltonian_alone", symbols, ca.cse(outputs))
    function: ca.Function = evaluator.compiled[key]
    return function


def _called(hamiltonian: Hamiltonian) -> tuple[list[ca.SX], list[ca.SX]]:
    """Symbols for the inputs, and the expressions of the Hamiltonian and its path constraints."""
    symbols = [ca.SX.sym(f"i{i}", hamiltonian.function.size1_in(i)) for i in range(4)]
    value, *_, path, _ = hamiltonian.function(*symbols)
    return symbols, [value, path]
