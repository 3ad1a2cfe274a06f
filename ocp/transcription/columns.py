"""The map of the unknowns: where each of them sits in the decision vector, its bounds and size.

The unknowns of a phase are stacked interval by interval, so that neighbours in time are neighbours
in the linear algebra: the states at the left breakpoint, running totals of integrals, constant and
linear controls, the states inside, polynomial controls, algebraic signals. The times of the phase
and the breakpoints that may move follow, then the unknowns of the problem and its peaks.

Intervals of one kind form a group, in which unknowns are counted from the first one of an interval.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ocp.arrays import Array, Integers
from ocp.errors import StatementError
from ocp.mesh.mesh import Mesh, PhaseMesh
from ocp.numerics.schemes import Collocation, Scheme
from ocp.problem.functionals import Integral, Peak
from ocp.problem.integrator_chains import enters_linearly, variation_of
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Algebraic, Between, Control, Piecewise, Signal, State
from ocp.scaling.scales import Scales
from ocp.transcription.rows import Limits


@dataclass(frozen=True, eq=False, repr=False)
class ControlSet:
    """Controls that are polynomials of the same order in an interval.

    Attributes
    ----------
    order : int or None
        None for the highest that the scheme determines, which depends on the degree.
    one_fewer : bool
        Whether controls of the highest order have one coefficient fewer than there are points.
    """

    controls: tuple[Control, ...]
    order: int | None
    one_fewer: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class IntervalGroup:
    """The intervals of one degree whose breakpoints all stay, or all have a movable end.

    Attributes
    ----------
    collocation : Collocation
    intervals : (m,)
        Their numbers.
    moving : bool
        Whether they have a movable end.
    support : (m, s + 1, n_x)
        Columns of the states at the support points.
    controls : tuple of (m, count, n)
        Columns of the Bernstein coefficients of each set of controls, so that bounds on them bound
        the controls at all times.
    algebraics : (m, s, n_z)
        Columns of the algebraic signals at the collocation points.
    """

    collocation: Collocation
    intervals: Integers
    moving: bool
    support: Integers
    controls: tuple[Integers, ...]
    algebraics: Integers


@dataclass(frozen=True, eq=False, repr=False)
class IntervalLayout:
    """Where the unknowns of an interval of one degree are, counted from its first column.

    The states and the running totals at its left breakpoint come first. Controls of a fixed order
    follow, whose columns do not depend on the degree, then the states inside, the other controls,
    and the algebraic signals.

    Attributes
    ----------
    rule : Collocation
    controls : tuple of (count, n)
        The coefficients of each set of controls, one row a coefficient.
    inner, algebraics : (m, n)
        The states inside and the algebraic signals, one row a point.
    length : int
        Number of all columns of the interval.
    """

    rule: Collocation
    controls: tuple[Integers, ...]
    inner: Integers
    algebraics: Integers
    length: int

    @classmethod
    def of(
        cls,
        rule: Collocation,
        control_sets: tuple[ControlSet, ...],
        states: int,
        totals: int,
        algebraics: int,
        determined: bool,
    ) -> IntervalLayout:
        """For numbers of signals; with `determined` equations give all coefficients of controls."""
        place = states + totals

        def table(rows: int, columns: int) -> Integers:
            nonlocal place
            begin, place = place, place + rows * columns
            return np.arange(begin, place).reshape(rows, columns)

        def of_sets(*, fixed: bool) -> dict[ControlSet, Integers]:
            return {
                members: table(_coefficients(members, rule, determined), len(members.controls))
                for members in control_sets
                if (members.order is not None) == fixed
            }

        tables = of_sets(fixed=True)
        inner = table(rule.inner, states)
        tables |= of_sets(fixed=False)
        of_algebraics = table(rule.degree, algebraics)
        controls = tuple(tables[members] for members in control_sets)
        return cls(rule, controls, inner, of_algebraics, length=place)

    def group(
        self, intervals: Integers, moving: bool, begins: Integers, nodes: Integers
    ) -> IntervalGroup:
        """The unknowns of some intervals.

        Parameters
        ----------
        intervals : (m,)
            Their numbers.
        begins : (N + 1,)
            The first columns of all intervals of the phase, and of its last breakpoint.
        nodes : (N + 1, n_x)
            Columns of the states there.
        """
        first = begins[intervals][:, None, None]
        support = [nodes[intervals][:, None, :], first + self.inner]
        if self.rule.ends_on_support:
            support.append(nodes[intervals + 1][:, None, :])
        return IntervalGroup(
            collocation=self.rule,
            intervals=intervals,
            moving=moving,
            support=np.concatenate(support, axis=1),
            controls=tuple(first + table for table in self.controls),
            algebraics=first + self.algebraics,
        )


def _coefficients(members: ControlSet, rule: Collocation, determined: bool) -> int:
    """Number of coefficients of a set of controls in an interval."""
    if members.order is not None:
        return members.order + 1
    if determined:
        return rule.degree
    return max(1, min(rule.choices, rule.degree - members.one_fewer))


_ORDERS = {"constant": 0, "linear": 1, "polynomial": None}


@dataclass(frozen=True, eq=False, repr=False)
class PhaseColumns:
    """The unknowns of one phase.

    Attributes
    ----------
    control_sets : tuple of ControlSet
        Constant, linear, polynomial controls; sets without controls are left out.
    integrals : tuple of Integral
        Those that enter the problem non-linearly or in bounds, as running totals.
    nodes : (N + 1, n_x)
        States at the breakpoints.
    totals : (N + 1, n_q)
        Running totals of the integrals.
    ends : (2,) or None
        Initial and final time; None where both are fixed.
    moved : (N + 1,)
        Breakpoints of moving intervals as positions in the phase, -1 elsewhere.
    stop : int
        The first column behind the phase.
    intervals : int
        Their number N.
    fixed_times : (2,)
        Initial and final time where they are fixed [s], nan where they are not.
    controls, signals : tuple of Control, of Signal
        In the order of a trajectory.
    coefficients : tuple of (Signal, (m,), (m, count))
        Every control and algebraic signal in the intervals of one group: their numbers, and its
        columns there.
    """

    phase: Phase
    mesh: PhaseMesh
    states: tuple[State, ...]
    control_sets: tuple[ControlSet, ...]
    algebraics: tuple[Algebraic, ...]
    integrals: tuple[Integral, ...]
    nodes: Integers
    totals: Integers
    groups: tuple[IntervalGroup, ...]
    ends: Integers | None
    moved: Integers
    stop: int
    intervals: int = field(init=False)
    fixed_times: tuple[float, float] = field(init=False)
    controls: tuple[Control, ...] = field(init=False)
    signals: tuple[Signal, ...] = field(init=False)
    coefficients: tuple[tuple[Signal, Integers, Integers], ...] = field(init=False)

    def __post_init__(self) -> None:
        times = [
            math.nan if isinstance(time, Between) else float(time)
            for time in (self.phase.start, self.phase.end)
        ]
        controls = tuple(c for members in self.control_sets for c in members.controls)
        object.__setattr__(self, "intervals", self.mesh.intervals)
        object.__setattr__(self, "fixed_times", (times[0], times[1]))
        object.__setattr__(self, "controls", controls)
        object.__setattr__(self, "signals", (*self.states, *controls, *self.algebraics))

        coefficients: list[tuple[Signal, Integers, Integers]] = []
        for group in self.groups:
            for members, table in zip(self.control_sets, group.controls, strict=True):
                for j, control in enumerate(members.controls):
                    coefficients.append((control, group.intervals, table[:, :, j]))
            for j, algebraic in enumerate(self.algebraics):
                coefficients.append((algebraic, group.intervals, group.algebraics[:, :, j]))
        object.__setattr__(self, "coefficients", tuple(coefficients))

    def stated_times(self) -> Iterator[tuple[str, float, float, Integers]]:
        """The times of a phase of which one is free.

        Yields
        ------
        end : str
            "start" or "end".
        lower, upper : float
            Its stated limits [s].
        column : (1,)
        """
        if self.ends is None:
            return
        for column, end in zip(self.ends, ("start", "end"), strict=True):
            time = getattr(self.phase, end)
            lower, upper = (time.lower, time.upper) if isinstance(time, Between) else (time, time)
            yield end, lower, upper, np.array([column])

    def group_of(self, interval: int) -> IntervalGroup:
        """The group that an interval belongs to."""
        return next(group for group in self.groups if interval in group.intervals)

    def at_points(self, name: str) -> list[tuple[Integers, Integers]]:
        """Columns of a state or an algebraic signal at the points of each group of intervals.

        Returns
        -------
        list of ((m,), (m, p))
            The intervals of a group, and the columns in each. A state at a breakpoint is found in
            both intervals that meet there.

        Raises
        ------
        KeyError
            Where the phase has no such signal.
        """
        for j, state in enumerate(self.states):
            if state.name == name:
                return [(group.intervals, group.support[:, :, j]) for group in self.groups]
        for j, algebraic in enumerate(self.algebraics):
            if algebraic.name == name:
                return [(group.intervals, group.algebraics[:, :, j]) for group in self.groups]
        raise KeyError(name)


@dataclass(frozen=True, eq=False, repr=False)
class Columns:
    """All unknowns of a program.

    Attributes
    ----------
    phases : tuple of PhaseColumns
    unknowns : (n_u,)
        Static unknowns of the problem, in its order.
    peaks : mapping of Peak to int
    sizes : (n,)
        The size by which each unknown is divided.
    limits : Limits
    count : int
        Number of unknowns.
    numbers : (k,)
        Unknowns of the problem and peaks: the columns that belong to no phase.
    """

    phases: tuple[PhaseColumns, ...]
    unknowns: Integers
    peaks: Mapping[Peak, int]
    sizes: Array
    limits: Limits
    count: int = field(init=False)
    numbers: Integers = field(init=False)

    def __post_init__(self) -> None:
        numbers = np.array([*self.unknowns, *self.peaks.values()], dtype=np.int64)
        object.__setattr__(self, "count", self.limits.count)
        object.__setattr__(self, "numbers", numbers)


def columns_of(
    problem: Problem,
    mesh: Mesh,
    scheme: Scheme,
    controls: Piecewise,
    scales: Scales,
) -> Columns:
    """Assign all unknowns of a problem on a mesh.

    Parameters
    ----------
    controls : shape of controls that do not state their own.

    Raises
    ------
    StatementError
        When a control has a shape that does not exist.
    """
    phases: list[PhaseColumns] = []
    first = 0
    for phase, phase_mesh in zip(problem.phases, mesh.phases, strict=True):
        sets = _control_sets(problem, phase, phase_mesh, scheme, controls)
        integrals = tuple(f for f in problem.integrals[phase.name] if f not in problem.summed)
        phases.append(_phase_columns(problem, phase, phase_mesh, scheme, sets, integrals, first))
        first = phases[-1].stop

    unknowns = first + np.arange(len(problem.unknowns))
    first += unknowns.size
    peaks = {peak: int(first + i) for i, peak in enumerate(problem.peaks)}
    count = first + len(peaks)

    filled = _Filled(count)
    for columns in phases:
        filled.states(columns, scales)
        for signal, _, ids in columns.coefficients:
            filled.put(ids, signal.lower, signal.upper, scales.signals[signal.name])
        filled.times(columns, scales)
    for unknown, column in zip(problem.unknowns, unknowns, strict=True):
        filled.put(column, unknown.lower, unknown.upper, scales.unknowns[unknown.name])
    for peak, place in peaks.items():
        least = 0.0 if peak.absolute else -np.inf
        filled.put(place, least, np.inf, scales.functionals[peak])
    return Columns(tuple(phases), unknowns, peaks, filled.sizes, filled.limits)


class _Filled:
    """Limits and sizes of the unknowns while they are put in."""

    def __init__(self, count: int) -> None:
        self.limits = Limits(count)
        self.sizes: Array = np.ones(count)

    def put(self, ids: Any, lower: object, upper: object, size: float) -> None:
        """Bounds, in the user's unit, and size of some unknowns."""
        self.limits.bound(ids, lower, upper, size)
        self.sizes[np.asarray(ids).ravel()] = size

    def states(self, columns: PhaseColumns, scales: Scales) -> None:
        """States with their boundary values, and running totals, which begin at zero."""
        phase = columns.phase
        for j, state in enumerate(columns.states):
            size = scales.signals[state.name]
            for group in columns.groups:
                self.put(group.support[:, :, j], state.lower, state.upper, size)
            self.put(columns.nodes[:, j], state.lower, state.upper, size)
            for node, values in ((0, phase.initial), (-1, phase.final)):
                value = values.get(state)
                if value is not None:
                    low, high = value if isinstance(value, tuple) else (value, value)
                    self.limits.bound(columns.nodes[node, j], low, high, size, narrows=True)

        for j, integral in enumerate(columns.integrals):
            size = scales.functionals[integral]
            self.put(columns.totals[1:, j], -np.inf, np.inf, size)
            self.put(columns.totals[0, j], 0.0, 0.0, size)

    def times(self, columns: PhaseColumns, scales: Scales) -> None:
        """Times of the phase, and breakpoints of moving intervals."""
        for _, lower, upper, column in columns.stated_times():
            self.put(column, lower, upper, scales.time)
        for i in np.flatnonzero(columns.moved >= 0):
            here = float(columns.mesh.breakpoints[i])
            low, high = (0.0, 1.0) if i in columns.mesh.movable else (here, here)
            self.put(columns.moved[i], low, high, 1.0)


def _control_sets(
    problem: Problem, phase: Phase, mesh: PhaseMesh, scheme: Scheme, default: Piecewise
) -> tuple[ControlSet, ...]:
    """The controls of a phase by the shape that they take on a mesh."""
    by_shape: dict[str, list[Control]] = {shape: [] for shape in _ORDERS}
    singular: list[Control] = []
    for control in problem.controls[phase.name]:
        shape = variation_of(problem, phase, control, default, scheme, int(mesh.degrees.min()))
        if shape not in by_shape:
            raise StatementError(
                f"the shape of control '{control.name}' is {shape!r}; choose constant, linear, "
                "polynomial, automatic or full"
            )
        # the trapezoidal rule determines one coefficient of a polynomial control: a constant,
        # unless equations along the phase determine as many as there are points
        single = scheme.fixed_degree and scheme.at(scheme.degree).choices == 1
        if shape == "polynomial" and single and not _has_equations(phase):
            shape = "constant"

        # Along a singular arc a control with as many coefficients as points may swing between its
        # bounds in each interval: the states at the points hardly change by that.
        automatic = (control.piecewise or default) == "automatic"
        if shape == "polynomial" and automatic and enters_linearly(problem, phase, control):
            singular.append(control)
        else:
            by_shape[shape].append(control)
    sets = [ControlSet(tuple(controls), _ORDERS[shape]) for shape, controls in by_shape.items()]
    sets.append(ControlSet(tuple(singular), None, one_fewer=True))
    return tuple(members for members in sets if members.controls)


def _has_equations(phase: Phase) -> bool:
    """Whether equations along the phase determine controls: as many equations as points."""
    return any(bound.is_equation for bound in phase.bounds)


def _phase_columns(
    problem: Problem,
    phase: Phase,
    mesh: PhaseMesh,
    scheme: Scheme,
    control_sets: tuple[ControlSet, ...],
    integrals: tuple[Integral, ...],
    first: int,
) -> PhaseColumns:
    """Assign the unknowns of a phase, starting at column `first`."""
    algebraics = problem.algebraics[phase.name]
    n_x, n_q = len(phase.states), len(integrals)
    degrees = np.array(sorted(set(mesh.degrees.tolist())))
    determined = _has_equations(phase)
    layouts = {
        int(degree): IntervalLayout.of(
            scheme.at(int(degree)), control_sets, n_x, n_q, len(algebraics), determined
        )
        for degree in degrees
    }

    # each interval begins where the one before ends; the last breakpoint has states and totals too
    lengths = np.array([layouts[int(degree)].length for degree in degrees])
    lengths = lengths[np.searchsorted(degrees, mesh.degrees)]
    begins = first + np.concatenate([[0], np.cumsum(lengths)])
    nodes = begins[:, None] + np.arange(n_x)
    stop = int(begins[-1]) + n_x + n_q

    groups = []
    for degree, moving in sorted({*zip(mesh.degrees.tolist(), mesh.moving.tolist(), strict=True)}):
        intervals = np.flatnonzero((mesh.degrees == degree) & (mesh.moving == moving))
        groups.append(layouts[degree].group(intervals, moving, begins, nodes))

    ends = None
    if not phase.has_fixed_times:
        ends = np.array([stop, stop + 1])
        stop += 2
    moved = _moved(mesh, stop)
    stop += int(np.count_nonzero(moved >= 0))
    return PhaseColumns(
        phase=phase,
        mesh=mesh,
        states=phase.states,
        control_sets=control_sets,
        algebraics=algebraics,
        integrals=integrals,
        nodes=nodes,
        totals=begins[:, None] + n_x + np.arange(n_q),
        groups=tuple(groups),
        ends=ends,
        moved=moved,
        stop=stop,
    )


def _moved(mesh: PhaseMesh, first: int) -> Integers:
    """(N + 1,) columns from `first` on of the breakpoints of moving intervals, -1 elsewhere."""
    moved = np.full(mesh.intervals + 1, -1)
    touched = np.flatnonzero(np.append(mesh.moving, False) | np.insert(mesh.moving, 0, False))
    moved[touched] = first + np.arange(touched.size)
    return moved
