"""What better controls gain in each interval, to first order.

The gain compares, at every time, the Hamiltonian with its value at the best control within the
bounds and path constraints that limit the control directly. Pontryagin's minimum principle asks for
no difference. Its integral over an interval is, to first order, what better controls could bring
there. Where it is nothing, refining the control is useless, however rough the control looks.

The costates are corrected to meet their differential equation. With those of the program a control
may seem to be the best one all through an interval, although it is not so in its last part.

Controls may share limits, as ``u1 + u2 <= F``, or ``s >= u`` and ``s >= -u``. One alone may have no
room where another one could make some. All together they gain at each time, to first order, the
value of a linear program: the most of ``-slope . step`` over all steps within the room of each
control and within the shared limits. Its dual bounds it: for any multipliers of the shared limits
the gain is no more than the multipliers times the slacks, and what each control gains alone by its
slope with the limits' parts added (Bertsimas and Tsitsiklis, "Introduction to Linear Optimization",
section 4.3). The best multipliers lie where as many of these slopes vanish as limits act.

In an interval costates are the polynomial through the values at the collocation points. They ought
to meet ``lambda' = -H_x`` between the points, too. A motion with fast states may be smooth where
they are not: at the end of a phase the costates of fast states change within a small part of the
last interval. The errors of the dynamics do not show that. By such costates a control may seem to
belong on its bound where it should leave it.

The costates at the end of each interval follow from the program. They are the slopes of its optimum
by the state there, and as accurate as the state at the end of an interval (Hager, "Runge-Kutta
methods in optimal control and the transformed adjoint system", Numerische Mathematik 87, 2000).
From them the linear differential equation of the errors is solved backwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise

import casadi as ca
import numpy as np

from ocp.arrays import Array, Flags, Integers
from ocp.mesh.trajectory import Evaluator, PhaseTrajectory
from ocp.numerics.columnwise import columnwise
from ocp.numerics.piecewise_polynomial import lagrange
from ocp.numerics.schemes import Radau
from ocp.optimality.active_set import AT
from ocp.optimality.hamiltonian import Hamiltonian, HamiltonianValues, hamiltonian_of
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import PhaseCostates, phase_costates
from ocp.transcription.path_constraints import PathConstraint

# Where the parts of an interval begin and end, as local times. The costates of stable fast states
# have their layers at the end.
_SHORTER = 8.0
PARTS = np.array([0.0, 1.0 - 1.0 / _SHORTER, 1.0 - 1.0 / _SHORTER**2, 1.0])

# The same parts, in what is left of the interval: from its end backwards
_PARTS_BACKWARDS = tuple(pairwise((1.0 - PARTS[::-1]).tolist()))

# The rule by which each part is integrated backwards: Radau's, because the equation may be stiff
_RULE = Radau().at(Radau.degree)


@dataclass(frozen=True, eq=False, repr=False)
class CostateErrors:
    """What is to be added to the costates of a phase [unit of the costates].

    Attributes
    ----------
    values : (p, N, s + 1, n)
        In each of the parts, from the last one on, and in each interval, at the support points of a
        rule that runs backwards.
    """

    values: Array

    def local(self, intervals: Integers, tau: Array) -> Array:
        """Values at local times of intervals, both (m,), shape (m, n)."""
        found = np.empty((tau.size, self.values.shape[3]))
        for values, (first, last) in zip(self.values, _PARTS_BACKWARDS, strict=True):
            here = np.flatnonzero((1.0 - tau >= first) & (1.0 - tau <= last))
            basis = lagrange(_RULE.support, (1.0 - tau[here] - first) / (last - first))
            found[here] = np.einsum("ms,msn->mn", basis, values[intervals[here]])
        return found


def costate_errors(
    iterate: Iterate, evaluator: Evaluator, index: int, acting: Flags
) -> CostateErrors:
    """What is to be added to the costates of a phase so that they meet their equation.

    It is 0 for running totals, whose costates are constant. It is 0 in intervals in which a path
    constraint acts, and in phases with equations, because their multipliers have a share in
    ``lambda'``. And it is 0 for schemes whose costates meet the minimum principle on any mesh.

    Parameters
    ----------
    index : int
        Of the phase.
    acting : (N,)
        Intervals in which a path constraint, a peak or a state's bound acts.
    """
    equation = _Equation(iterate, evaluator, index)
    states, free = equation.states, np.flatnonzero(~acting)
    parts, support = len(_PARTS_BACKWARDS), _RULE.degree + 1
    found = np.zeros((parts, acting.size, support, len(equation.costates.names)))
    with_equations = any(c.is_equation for c in iterate.transcription.constraints[index])
    if with_equations or not free.size or not iterate.scheme.informative_multipliers:
        return CostateErrors(found)

    ends = equation.costates.polynomial.ends()[free, 1, :states]
    error = equation.at_ends[free] - ends
    for part, (first, last) in enumerate(_PARTS_BACKWARDS):
        # d error / d back = step (matrix error + residual)
        step = (last - first) * np.diff(equation.motion.breakpoints)[free]
        residual, matrix = equation.along(free, 1.0 - (first + _RULE.points * (last - first)))
        known = step[:, None, None] * residual - _RULE.derivative[:, :1] * error[:, None, :]
        coupled = np.einsum("ij,ab->iajb", _RULE.derivative[:, 1:], np.eye(states))
        own = np.einsum("ij,k,kiab->kiajb", np.eye(_RULE.degree), step, matrix)

        size = _RULE.degree * states
        solved = np.linalg.solve(
            (coupled - own).reshape(-1, size, size), known.reshape(-1, size, 1)
        ).reshape(-1, _RULE.degree, states)
        found[part, free, :, :states] = np.concatenate([error[:, None], solved], axis=1)
        error = solved[:, -1]
    # a slope may be infinite at the edge of what a state may be
    return CostateErrors(np.where(np.isfinite(found), found, 0.0))


@dataclass(frozen=True, eq=False, repr=False)
class _Equation:
    """The equation of the costates of one phase."""

    iterate: Iterate
    evaluator: Evaluator
    index: int

    @property
    def motion(self) -> PhaseTrajectory:
        """The phase of the trajectory."""
        return self.iterate.trajectory.phases[self.index]

    @property
    def states(self) -> int:
        """Their number, n_x."""
        return len(self.motion.states)

    @cached_property
    def costates(self) -> PhaseCostates:
        """Those of the program."""
        return phase_costates(self.iterate, self.index)

    @cached_property
    def at_ends(self) -> Array:
        """Costates at the end of each interval, from the rows of the program, (N, n_x).

        Where no limit acts, the Lagrangian is stationary by the states at the last support point:
        ``e lambda = sum_j w_j D_j lambda_j - h w H_x``. Here ``h`` is the width of the interval,
        ``w`` and ``D`` are weights and slopes of the scheme, and ``e`` is the weight of the states
        at that point in the state at the end.
        """
        found = np.empty((self.motion.intervals, self.states))
        for group in self.iterate.transcription.columns.phases[self.index].groups:
            rule, k = group.collocation, group.intervals
            points = np.repeat(k, rule.degree), np.tile(rule.points, k.size)
            costates = self.costates.local(*points)[:, : self.states]
            of_rows = np.einsum(
                "s,ksn->kn",
                rule.weights * rule.derivative[:, -1],
                costates.reshape(k.size, rule.degree, -1),
            )
            slope, _ = self._evaluated(k, np.full(k.size, rule.points[-1]))
            widths = np.diff(self.motion.breakpoints)[k, None]
            found[k] = (of_rows - rule.weights[-1] * widths * slope) / rule.end[-1]
        return found

    def along(self, intervals: Integers, tau: Array) -> tuple[Array, Array]:
        """``lambda' + H_x`` and its derivative by the costates, at local times (m,) of intervals.

        Returns
        -------
        residual : (k, m, n_x)
        matrix : (k, m, n_x, n_x)
        """
        k, local = np.repeat(intervals, tau.size), np.tile(tau, intervals.size)
        slope, matrix = self._evaluated(k, local)
        residual = self.costates.polynomial.rate(k, local)[:, : self.states] + slope
        shape = (intervals.size, tau.size, self.states)
        return residual.reshape(shape), matrix.reshape(*shape, self.states)

    def _evaluated(self, intervals: Integers, tau: Array) -> tuple[Array, Array]:
        """``H_x`` (m, n_x) and its derivative by the costates (m, n_x, n_x)."""
        slope, matrix = columnwise(
            self._function,
            self.motion.local(intervals, tau),
            self.evaluator.times(self.motion, intervals, tau)[:, None],
            self.evaluator.numbers(self.iterate.trajectory),
            self.costates.local(intervals, tau),
        )
        # columns of a matrix follow each other in the output
        return slope, matrix.reshape(-1, self.states, self.states).transpose(0, 2, 1)

    @property
    def _function(self) -> ca.Function:
        """``(signals, time, unknowns and constants, costates) -> H_x, H_x by lambda``, kept."""
        hamiltonian = hamiltonian_of(self.evaluator, self.iterate.transcription, self.index)

        def made() -> ca.Function:
            function = hamiltonian.function
            inputs = [ca.SX.sym(f"i{i}", function.size1_in(i)) for i in range(function.n_in())]
            value = function(*inputs)[0]
            slope = ca.gradient(value, inputs[0])[: self.states]
            matrix = ca.jacobian(slope, inputs[3])[:, : self.states]
            outputs = [ca.densify(slope), ca.densify(ca.vec(matrix))]
            return ca.Function("costates", inputs, ca.cse(outputs))

        key = ("equation of the costates", self.index, self.motion.signals)
        return self.evaluator.once(key, made)


@dataclass(frozen=True, eq=False, repr=False)
class SharedLimit:
    """A limit of several controls at m times.

    Attributes
    ----------
    slopes : (m, n_u)
        Of what is limited by each control.
    to_lower, to_upper : (m,)
        From what is limited to its limits; infinite where there is none.
    """

    slopes: Array
    to_lower: Array
    to_upper: Array

    @property
    def held(self) -> list[int]:
        """Numbers of the controls that it holds."""
        return [int(j) for j in np.flatnonzero(self.slopes.any(axis=0))]

    def of(self, controls: Sequence[int]) -> SharedLimit:
        """The same one for some controls alone."""
        return replace(self, slopes=self.slopes[:, controls])


def limits_by_group(
    limits: Sequence[SharedLimit], count: int
) -> Iterator[tuple[list[int], list[SharedLimit]]]:
    """Controls that limits hold together, by number, each group with its limits of these controls.

    Every control is in one group, one that shares nothing in a group of its own.

    Parameters
    ----------
    count : int
        Of all controls.
    """
    groups = [{control} for control in range(count)]
    for limit in limits:
        held = set(limit.held)
        joined = [group for group in groups if group & held]
        groups = [group for group in groups if not group & held]
        if joined:
            groups.append(set().union(*joined))
    for group in groups:
        own = sorted(group)
        yield own, [limit.of(own) for limit in limits if set(limit.held) & group]


def traded_gain(slope: Array, room: tuple[Array, Array], limits: Sequence[SharedLimit]) -> Array:
    """What controls can gain at most, (m,); infinite where no limit is shared.

    It is the most that they gain where one limit acts at a time, or two that share a control.
    Where more act it is a bound.

    Parameters
    ----------
    slope : (m, n_u)
        Of what is minimised by each control.
    room : (m, n_u), (m, n_u)
        How far each control may move down and up.
    """

    def at_most(multipliers: Mapping[int, Array]) -> Array:
        bound, remaining = np.zeros(slope.shape[0]), slope
        for i, multiplier in multipliers.items():
            limit = limits[i]
            slack = np.maximum(np.where(multiplier > 0, limit.to_upper, limit.to_lower), 0.0)
            # a limit that is not there costs nothing where its multiplier is zero
            bound = bound + np.where(multiplier == 0.0, 0.0, np.abs(multiplier) * slack)
            remaining = remaining + multiplier[:, None] * limit.slopes
        gained = np.abs(remaining) * np.where(remaining > 0, *room)
        return np.asarray(bound + gained.sum(axis=1))

    least = np.full(slope.shape[0], np.inf)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for multipliers in _multipliers(slope, limits):
            least = np.fmin(least, at_most(multipliers))
    return least


def _multipliers(slope: Array, limits: Sequence[SharedLimit]) -> Iterator[dict[int, Array]]:
    """Multipliers (m,) of one limit or two, by number, with which as many slopes vanish."""
    for i, limit in enumerate(limits):
        for j in limit.held:
            yield {i: -slope[:, j] / limit.slopes[:, j]}

    for (i, first), (k, second) in combinations(enumerate(limits), 2):
        if not set(first.held) & set(second.held):
            continue
        one, other = first.slopes, second.slopes
        for j, n in combinations(sorted({*first.held, *second.held}), 2):
            # Cramer's rule
            determinant = one[:, j] * other[:, n] - one[:, n] * other[:, j]
            of_first = other[:, j] * slope[:, n] - other[:, n] * slope[:, j]
            of_second = one[:, n] * slope[:, j] - one[:, j] * slope[:, n]
            yield {i: of_first / determinant, k: of_second / determinant}


# Gauss points in a part of an interval: twice the usual degree of the controls, whose error
# oscillates
_POINTS = 2 * Radau.degree

# Part of a control's size that it may move at least, where all of its values are the same
_LEAST_REACH = 1e-3


def gains(iterate: Iterate, evaluator: Evaluator, index: int, strongly_acting: Flags) -> Array:
    """What each finer control gains in each part of each interval of a phase, (N, p, n_u).

    In the unit of the objective. The parts are those of `ocp.optimality.control_gains.PARTS`, the
    controls in the order of a trajectory. Where controls that share a limit cannot all have what
    each would gain alone, each has the same part of it.

    Parameters
    ----------
    index : int
        Of the phase.
    strongly_acting : (N,)
        Intervals in which a path constraint, a peak or a state's bound is strongly active, however
        small its multiplier is. There the costates are those of the program. The multipliers are
        a part of the costates' equation, and would count as errors of the costates.
    """
    phase = iterate.trajectory.phases[index]
    hamiltonian = hamiltonian_of(evaluator, iterate.transcription, index)
    if not hamiltonian.controls:
        return np.zeros((phase.intervals, PARTS.size - 1, 0))

    # points in each part of an interval, so that no thin layer at its end is missed
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    lengths = np.diff(PARTS)[:, None]
    local = (PARTS[:-1, None] + lengths * 0.5 * (nodes + 1.0)).ravel()
    shares = (lengths * 0.5 * weights).ravel()
    intervals = np.repeat(np.arange(phase.intervals), local.size)
    tau = np.tile(local, phase.intervals)
    costates = phase_costates(iterate, index).local(intervals, tau)
    costates += costate_errors(iterate, evaluator, index, strongly_acting).local(intervals, tau)
    values = hamiltonian.at(evaluator, iterate.trajectory, costates, intervals, tau)

    # the best control is a Newton step away where H is convex in it, else at the end of its room
    names = phase.signals
    columns = [names.index(control.name) for control in hamiltonian.controls]
    controls = phase.local(intervals, tau)[:, columns]
    down, up = _room(iterate, hamiltonian, values, controls, index)
    to_the_end = np.abs(values.slope) * np.where(values.slope > 0, down, up)
    curvature = np.einsum("muu->mu", values.curvature)
    with np.errstate(divide="ignore", invalid="ignore"):
        newton = np.where(curvature > 0, 0.5 * values.slope**2 / curvature, np.inf)

    alone = np.minimum(to_the_end, newton)
    density = np.empty_like(alone)
    shared = _shared_limits(iterate, hamiltonian, values, index)
    for group, limits in limits_by_group(shared, alone.shape[1]):
        own = alone[:, group]
        traded = traded_gain(values.slope[:, group], (down[:, group], up[:, group]), limits)
        density[:, group] = _shared_out(own, np.minimum(own.sum(axis=1), traded))
    if _share_curved_limits(iterate, hamiltonian, values, index):
        places = _PricedTimes(index, intervals, tau, costates)
        for signals in _with_levels_beside(phase, columns, intervals, tau):
            other = _by_level(iterate, evaluator, hamiltonian, values, places, signals)
            density = np.where((other.sum(axis=1) > density.sum(axis=1))[:, None], other, density)
    shape = (phase.intervals, PARTS.size - 1, _POINTS, alone.shape[1])
    of_parts = np.einsum("kpqu,pq->kpu", density.reshape(shape), shares.reshape(-1, _POINTS))
    return np.asarray(of_parts * np.diff(phase.breakpoints)[:, None, None])


@dataclass(frozen=True, eq=False, repr=False)
class _PricedTimes:
    """Local times (m,) of intervals (m,) of a phase, with costates (m, n) there."""

    index: int
    intervals: Integers
    tau: Array
    costates: Array


def _share_curved_limits(
    iterate: Iterate, hamiltonian: Hamiltonian, values: HamiltonianValues, index: int
) -> bool:
    """Whether several controls share a limit that is not linear in them, as a circle or a cone."""
    constraints = iterate.transcription.constraints[index]
    return any(
        not (constraints[number].of_controls or constraints[number].is_equation)
        and np.count_nonzero(values.path_slope[:, i].any(axis=0)) > 1
        for i, number in enumerate(hamiltonian.paths)
    )


def _with_levels_beside(
    phase: PhaseTrajectory, controls: Sequence[int], intervals: Integers, tau: Array
) -> Iterator[Array]:
    """Signals (m, n) with controls of the end of the interval before, and of the start after it.

    Where controls switch inside an interval, these are the levels between which they do.
    """
    last = phase.intervals - 1
    for beside, end in ((intervals - 1, 1.0), (intervals + 1, 0.0)):
        signals = phase.local(intervals, tau)
        levels = phase.local(np.clip(beside, 0, last), np.full(tau.size, end))
        signals[:, controls] = levels[:, controls]
        yield signals


def _by_level(
    iterate: Iterate,
    evaluator: Evaluator,
    hamiltonian: Hamiltonian,
    values: HamiltonianValues,
    places: _PricedTimes,
    signals: Array,
) -> Array:
    """What other controls gain at once, in parts of each, (m, n_u); 0 where they exceed a limit.

    Parameters
    ----------
    values : HamiltonianValues
        Those of the motion.
    signals : (m, n)
        Those of the motion, with the other controls.
    """
    phase = iterate.trajectory.phases[places.index]
    now = phase.local(places.intervals, places.tau)
    found = columnwise(
        hamiltonian.function,
        signals,
        evaluator.times(phase, places.intervals, places.tau)[:, None],
        evaluator.numbers(iterate.trajectory),
        places.costates,
    )
    value, path = found[0][:, 0], found[5]

    peaks = iterate.trajectory.peaks_of(iterate.problem)
    kept = np.ones(value.size, dtype=bool)
    for i, number in enumerate(hamiltonian.paths):
        constraint = iterate.transcription.constraints[places.index][number]
        lower, upper = constraint.limits(iterate.parameters, peaks)
        margin = AT * constraint.scale
        kept &= (path[:, i] >= lower - margin) & (path[:, i] <= upper + margin)

    columns = [phase.signals.index(control.name) for control in hamiltonian.controls]
    shares = np.abs(values.slope * (signals - now)[:, columns])
    return _shared_out(shares, np.where(kept, np.maximum(values.value - value, 0.0), 0.0))


def _shared_out(alone: Array, together: Array) -> Array:
    """What each control has of a gain (m,), in parts of what each would gain alone, (m, n_u).

    None where the gain is infinite. Where some would gain without end alone, all have the same.
    """
    total = alone.sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(np.isfinite(total), alone / total, 1.0 / alone.shape[1])
    parts = np.where(total > 0, parts, 0.0)
    return np.where(np.isfinite(together), together, 0.0)[:, None] * parts


def _shared_limits(
    iterate: Iterate, hamiltonian: Hamiltonian, values: HamiltonianValues, index: int
) -> list[SharedLimit]:
    """Limits at which one control may make room for another one."""
    peaks = iterate.trajectory.peaks_of(iterate.problem)
    limits = []
    for i, number in enumerate(hamiltonian.paths):
        constraint = iterate.transcription.constraints[index][number]
        if _shares(constraint, values.path_slope[:, i]):
            lower, upper = constraint.limits(iterate.parameters, peaks)
            path = values.path[:, i]
            limits.append(SharedLimit(values.path_slope[:, i], path - lower, upper - path))
    return limits


def _shares(constraint: PathConstraint, slopes: Array) -> bool:
    """Whether a limit is shared by several controls and by nothing else, or an equation holds one.

    At given states an equation has no slack, so that no control moves without another one.
    """
    # one control may have no slope at some times, as the force of a power at rest
    count = int(np.count_nonzero(slopes.any(axis=0)))
    return count > 0 if constraint.is_equation else constraint.of_controls and count > 1


def _room(
    iterate: Iterate,
    hamiltonian: Hamiltonian,
    values: HamiltonianValues,
    controls: Array,
    index: int,
) -> tuple[Array, Array]:
    """How far each control may move down and up at each time, (m, n_u) each."""
    parameters = iterate.parameters
    down, up = np.empty_like(controls), np.empty_like(controls)

    # within its bounds, and no farther than its whole range on the trajectory; one that never moves
    # may be wanted at its other bound
    for j, control in enumerate(hamiltonian.controls):
        least = _LEAST_REACH * iterate.scales.signals[control.name]
        reach = max(float(np.ptp(controls[:, j])), least)
        lower, upper = parameters.signal_limits[control.name]
        if reach == least and np.isfinite(upper - lower):
            reach = upper - lower
        down[:, j] = np.minimum(controls[:, j] - lower, reach)
        up[:, j] = np.minimum(upper - controls[:, j], reach)

    # until the linearised path constraint meets its limit
    peaks = iterate.trajectory.peaks_of(iterate.problem)
    for i, number in enumerate(hamiltonian.paths):
        constraint = iterate.transcription.constraints[index][number]
        if constraint.is_equation or not hamiltonian.limits_controls[i]:
            continue
        if _shares(constraint, values.path_slope[:, i]):
            continue  # one control may move more where another one makes room, see `_traded`
        lower, upper = constraint.limits(parameters, peaks)
        slope, path = values.path_slope[:, i], values.path[:, [i]]
        with np.errstate(divide="ignore", invalid="ignore"):
            to_upper, to_lower = (upper - path) / slope, (lower - path) / slope
        rising, falling = slope > 0, slope < 0
        step_up = np.where(rising, to_upper, np.where(falling, to_lower, np.inf))
        step_down = -np.where(rising, to_lower, np.where(falling, to_upper, -np.inf))
        down, up = np.minimum(down, step_down), np.minimum(up, step_up)
    return np.maximum(down, 0.0), np.maximum(up, 0.0)
