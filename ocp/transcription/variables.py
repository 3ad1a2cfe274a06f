"""Where each unknown of a phase sits in the decision vector.

The unknowns of a phase are stacked interval by interval, so that neighbours in time are
neighbours in the linear algebra.  All index sets are arrays over the intervals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocp.errors import StatementError
from ocp.mesh.mesh import PhaseMesh, distinct
from ocp.numerics.schemes import FIXED_DEGREE, Scheme, SchemeName, scheme
from ocp.problem.integrator_chains import shape_of
from ocp.problem.statement import Phase, Problem
from ocp.problem.symbols import Algebraic, Between, Control, ControlShape, State
from ocp.problem.terms import Functional

Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Group:
    """The intervals of one degree whose breakpoints all stay, or all have a movable end.

    Attributes
    ----------
    intervals : (m,) their numbers.
    moving : whether they have a movable end.
    support : (m, degree + 1, n_x) state unknowns at the support points.
    controls : (m, choices, n_p) Bernstein coefficients of polynomial controls, so that bounds on
        them bound the control at all times.
    algebraics : (m, degree, n_z) algebraic signals at the collocation points.
    """

    scheme: Scheme
    intervals: Integers
    moving: bool
    support: Integers
    controls: Integers
    algebraics: Integers


@dataclass(frozen=True, eq=False)
class PhaseLayout:
    """Index sets of one phase.

    Attributes
    ----------
    nodes : (N + 1, n_x) states at the breakpoints.
    ramps : (N, 2, n_l) piecewise linear controls at both ends of each interval.
    totals : (N + 1, n_q) running values of integrals that enter non-linearly or in bounds.
    steps : (N, n_c) piecewise constant controls.
    ends : (2,) initial and final time, or None where both are fixed.
    moved : (N + 1,) breakpoints of moving intervals as fractions of the phase, -1 elsewhere.
    """

    phase: Phase
    mesh: PhaseMesh
    states: tuple[State, ...]
    constant: tuple[Control, ...]
    linear: tuple[Control, ...]
    polynomial: tuple[Control, ...]
    algebraics: tuple[Algebraic, ...]
    integrals: tuple[Functional, ...]
    nodes: Integers
    ramps: Integers
    totals: Integers
    steps: Integers
    groups: tuple[Group, ...]
    ends: Integers | None
    moved: Integers
    stop: int

    @property
    def intervals(self) -> int:
        """Number of intervals."""
        return self.mesh.intervals

    @property
    def fixed_times(self) -> tuple[float, float]:
        """Initial and final time of a phase whose times are fixed [s]."""
        start, end = self.phase.start, self.phase.end
        assert not isinstance(start, Between)
        assert not isinstance(end, Between)
        return float(start), float(end)

    @property
    def signals(self) -> tuple[State | Control | Algebraic, ...]:
        """All signals in the order of a trajectory."""
        return (*self.states, *self.constant, *self.linear, *self.polynomial, *self.algebraics)


def _by_shape(
    problem: Problem, phase: Phase, mesh: PhaseMesh, name: SchemeName, default: ControlShape,
    determined: bool,
) -> dict[str, list[Control]]:  # fmt: skip
    """The controls of a phase by the shape that they take on a mesh."""
    controls: dict[str, list[Control]] = {"constant": [], "linear": [], "polynomial": []}
    for control in problem.signals_of(phase, Control):
        shape = shape_of(control, phase, default, name, int(mesh.degrees.min()))
        if shape not in controls:
            raise StatementError(
                f"the shape of control '{control.name}' is {shape!r}; choose constant, linear, "
                "polynomial or automatic"
            )
        if shape == "polynomial" and name in FIXED_DEGREE and scheme(name, 1).choices == 1:
            shape = "polynomial" if determined else "constant"
        controls[shape].append(control)
    return controls


def lay_out(
    problem: Problem,
    phase: Phase,
    mesh: PhaseMesh,
    name: SchemeName,
    default_shape: ControlShape,
    integrals: tuple[Functional, ...],
    first: int,
) -> PhaseLayout:
    """Assign the unknowns of a phase, starting at column `first`."""
    determined = any(bound.is_equation for bound in phase.bounds)  # as many equations as points
    controls = _by_shape(problem, phase, mesh, name, default_shape, determined)
    algebraics = problem.signals_of(phase, Algebraic)
    n_x, n_c, n_l, n_p = len(phase.states), *(len(c) for c in controls.values())
    n_z, n_q, count = len(algebraics), len(integrals), mesh.intervals
    degrees = distinct(mesh.degrees)
    schemes = {int(d): scheme(name, int(d)) for d in degrees}
    choices = {d: s.degree if determined else s.choices for d, s in schemes.items()}
    sizes = np.array([n_x + 2 * n_l + n_q + n_c
                      + schemes[int(d)].inner * n_x
                      + choices[int(d)] * n_p + schemes[int(d)].degree * n_z
                      for d in degrees])  # fmt: skip
    lengths = sizes[np.searchsorted(degrees, mesh.degrees)]
    offsets = first + np.concatenate([[0], np.cumsum(lengths)])

    def at_breakpoints(skip: int, size: int) -> Integers:
        return np.asarray(offsets[:, None] + skip + np.arange(size))

    nodes = at_breakpoints(0, n_x)
    groups = []
    for degree, moving in sorted({*zip(mesh.degrees.tolist(), mesh.moving.tolist(), strict=True)}):
        own = np.flatnonzero((mesh.degrees == degree) & (mesh.moving == moving))
        begin = offsets[own] + n_x + n_q + 2 * n_l + n_c
        groups.append(_group(
            schemes[degree], own, moving, nodes, begin, (choices[degree], n_p), n_z
        ))  # fmt: skip
    stop = int(offsets[-1]) + n_x + n_q
    ends = None
    if isinstance(phase.start, Between) or isinstance(phase.end, Between):
        ends = np.array([stop, stop + 1])
        stop += 2
    moved = _moved(mesh, stop)
    stop += int(np.count_nonzero(moved >= 0))
    return PhaseLayout(
        phase=phase, mesh=mesh, states=phase.states,
        constant=tuple(controls["constant"]), linear=tuple(controls["linear"]),
        polynomial=tuple(controls["polynomial"]), algebraics=algebraics, integrals=integrals,
        nodes=nodes, totals=at_breakpoints(n_x, n_q),
        ramps=at_breakpoints(n_x + n_q, 2 * n_l)[:-1].reshape(count, 2, n_l),
        steps=at_breakpoints(n_x + n_q + 2 * n_l, n_c)[:-1],
        groups=tuple(groups), ends=ends, moved=moved, stop=stop,
    )  # fmt: skip


def _group(
    method: Scheme, own: Integers, moving: bool, nodes: Integers, begin: Integers,
    controls: tuple[int, int], n_z: int,
) -> Group:  # fmt: skip
    """The intervals `own` (m,), whose unknowns between their nodes start at columns `begin` (m,).

    One after another: inner states, polynomial controls of shape `controls`, algebraic signals.
    """
    n_x, begin = nodes.shape[1], begin[:, None, None]
    support = [nodes[own][:, None, :], begin + _table(method.inner, n_x)]
    if method.ends_on_support:
        support.append(nodes[own + 1][:, None, :])
    begin = begin + method.inner * n_x
    return Group(
        method, own, moving, np.concatenate(support, axis=1), begin + _table(*controls),
        begin + math.prod(controls) + _table(method.degree, n_z),
    )  # fmt: skip


def _table(rows: int, columns: int) -> Integers:
    """Numbers from zero row by row, (rows, columns)."""
    return np.arange(rows * columns).reshape(rows, columns)


def _moved(mesh: PhaseMesh, first: int) -> Integers:
    """(N + 1,) columns from `first` on of the breakpoints of moving intervals, -1 elsewhere."""
    moved = np.full(mesh.intervals + 1, -1)
    touched = np.flatnonzero(np.append(mesh.moving, False) | np.insert(mesh.moving, 0, False))
    moved[touched] = first + np.arange(touched.size)
    return moved
