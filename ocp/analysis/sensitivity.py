"""Sensitivities of the optimum to named numbers, from the multipliers on the solved mesh.

By the envelope theorem ``dJ/dp`` is the partial derivative of the Lagrangian: through the functions
for a constant, ``-mu`` for a limit (`ocp.optimality.multipliers` has the sign).  Nothing is solved
again, but for a mesh with a switch on a breakpoint that does not move: there the breakpoint is
freed first.  Breakpoints that move are unknowns like others and drop out.

Where several sets of multipliers fit the optimum, it has a kink, and the slopes on its two sides
differ:

    dJ/dp+ = max dL/dp,   dJ/dp- = min dL/dp   over all multipliers that fit the optimum

(Gauvin and Tolle, "Differential stability in nonlinear programming", SIAM J. Control Optim. 15,
1977, for a single minimiser).  Multipliers fit if the Lagrangian is stationary, their signs are
right and they belong to active limits.  That is a linear program, whose feasible set is a
single point at ordinary optima.  Where two limits change places its two ends differ.

The names are those of the statement: a constant's own; ``"x upper"`` for a bound of a signal,
unknown or `Bound` of the problem; ``"phase: power upper"`` for a `Bound` of a phase;
``"phase: x initial"``, ``"phase: start"`` for boundary values and times, with ``upper`` or
``lower`` behind where they are free between limits; an equation carries its bare name.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ocp.analysis.multiplier_sets import MULTIPLIER_SPREAD, MultiplierChanges
from ocp.arrays import Array, Integers
from ocp.diagnostics.crossed_jumps import crossed_jumps
from ocp.optimality.active_set import ACTIVE, LimitDistances, limit_distances
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import all_multipliers
from ocp.problem.checks_before_solve import sides_closed_by_ends
from ocp.problem.parameters import Parameters, limit_slopes
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem, without_repeated_warnings
from ocp.problem.symbols import Between
from ocp.refinement.mesh_solver import MeshSolver
from ocp.refinement.switch_multipliers import with_free_switches
from ocp.settings import Settings
from ocp.transcription.columns import PhaseColumns
from ocp.transcription.transcribe import Transcription, transcribe

if TYPE_CHECKING:
    from ocp.solution.solution import Solution

# Sum of scaled multipliers, below which an active limit has none.
_IDLE = 1e-4

_KINK = "several limits are active together: the active set is about to change"
_AT_END = "a prescribed end value equals its limit: a change to one side is infeasible"
_UNKNOWN = "several limits are active together, and the range of the slope was not found"
_WEAKLY_ACTIVE = (
    "the solution is at the limit, and its multiplier is zero: the active set is about to change"
)

_JUMP = "expressions of the problem jump at a movable time, which multipliers do not include"


class ActiveSetWarning(UserWarning):
    """A sensitivity is not one number: it differs on the two sides."""


@dataclass(frozen=True)
class Sided:
    """Change of the optimum per unit of a named number, for a decrease and for an increase.

    Attributes
    ----------
    below, above : float
        Equal where the optimum is smooth; infinite where it has no finite slope; nan where a jump
        of an expression moves with the number.
    note : str
        Empty, or why the value holds for small changes only.
    """

    below: float
    above: float
    note: str = ""

    @property
    def is_one(self) -> bool:
        """Whether both sides agree."""
        return self.below == self.above

    @property
    def only(self) -> float:
        """The slope of both sides, or of the only one with a motion; nan where two differ."""
        if self.note == _AT_END:
            return self.above if math.isinf(self.below) else self.below
        return self.below if self.is_one else math.nan


def sensitivities(solution: Solution) -> dict[str, float]:
    """``dJ/dvalue`` for every named number, nan where the optimum has a kink.

    `J` is meant as it is minimised or maximised, in its unit. Where a prescribed end value lies at
    its limit, the slope is that of the side where there is a motion.

    Raises
    ------
    StatementError
        When the solution was made without its multipliers.

    Warns
    -----
    ActiveSetWarning
        Where the two sides differ, where it was not found whether they do, and where the slope is
        not known because an expression jumps at a time that moves.
    """
    both_sides = one_sided_sensitivities(solution)
    doubts = [
        f"with respect to '{name}' its slope is {s.below:.6g} for a decrease and {s.above:.6g} for "
        f"an increase ({s.note})"
        for name, s in both_sides.items()
        if s.note in (_KINK, _UNKNOWN, _JUMP)
    ]
    if doubts:
        warnings.warn(
            f"the optimum has a kink, or its slope is unknown: {'; '.join(doubts)}; compare it "
            "with solves at other values",
            ActiveSetWarning,
            stacklevel=3,
        )
    return {name: s.only for name, s in both_sides.items()}


def one_sided_sensitivities(solution: Solution) -> dict[str, Sided]:
    """``dJ/dvalue`` for a decrease and for an increase of every named number.

    Raises
    ------
    StatementError
        When the solution was made without its multipliers.
    """
    iterate = solution.kept_iterate
    meshes = MeshSolver.of(
        iterate.problem, Settings(), iterate.parameters, evaluator=solution.form_evaluator
    )
    iterate = with_free_switches(meshes, iterate, all_of_them=True)
    multipliers, distances = all_multipliers(iterate), limit_distances(iterate)
    changes = MultiplierChanges.of(iterate, multipliers, distances)
    sense = iterate.problem.sense

    sided = {}
    for slope in _slopes_of_statement(solution, iterate, multipliers, distances):
        value = slope.direct + float(slope.by_multiplier @ multipliers)
        down, up = changes.range_of(slope.by_multiplier) if changes.many else (0.0, 0.0)

        # round-off is measured against the largest single share of the slope
        share = float(np.abs(slope.by_multiplier * multipliers).max(initial=0.0))
        spread = MULTIPLIER_SPREAD * max(abs(value), abs(up), abs(down), share)
        if math.isnan(down):
            sided[slope.name] = Sided(sense * value, sense * value, _UNKNOWN)
        elif up - down <= spread < math.inf:
            idle = np.abs(multipliers[slope.by_multiplier != 0]).sum() <= _IDLE
            note = _WEAKLY_ACTIVE if slope.active and idle else ""
            sided[slope.name] = Sided(sense * value, sense * value, note)
        else:
            sided[slope.name] = Sided(sense * (value + down), sense * (value + up), _KINK)

    for name, (below, above) in sides_closed_by_ends(iterate.problem, iterate.parameters).items():
        if name in sided and sided[name].is_one:
            one, endless = sided[name].below, sense * math.inf
            sided[name] = Sided(-endless if below else one, endless if above else one, _AT_END)
    for name in _not_known(solution, sided):
        sided[name] = Sided(math.nan, math.nan, _JUMP)
    return sided


def _not_known(solution: Solution, named: Iterable[str]) -> set[str]:
    """Those of named numbers whose slope lacks the share of a jump that moves with them.

    Where the time of a jump depends on the motion, these are all of them.
    """
    problem, names = solution.form.problem, set[str]()
    for found in crossed_jumps(solution.kept_iterate.trajectory, solution.form_evaluator):
        if found.moves:
            return set(named)
        names |= {symbol.name for symbol in found.depends}
        # in a phase with a free time the program holds the jump where it is
        if problem.phase(found.phase).has_fixed_times:
            names |= {f"{found.phase}: start", f"{found.phase}: end"}
    return names & set(named)


def slopes_by_multipliers(solution: Solution) -> dict[str, float]:
    """``dJ/dvalue`` for every named number by the multipliers that the solver ended with.

    Where several sets of multipliers fit the optimum these are the slopes of one of them, and
    nothing says so. It takes a fraction of a second, where the question about the others takes
    some seconds on a fine mesh.

    Parameters
    ----------
    solution : Solution

    Returns
    -------
    dict
        By the name of the number [unit of the objective by that of the number].

    Raises
    ------
    StatementError
        When the solution was made without its multipliers.
    """
    iterate = solution.kept_iterate
    multipliers, distances = all_multipliers(iterate), limit_distances(iterate)
    slopes = {
        slope.name: iterate.problem.sense
        * (slope.direct + float(slope.by_multiplier @ multipliers))
        for slope in _slopes_of_statement(solution, iterate, multipliers, distances)
    }
    return slopes | dict.fromkeys(_not_known(solution, slopes), math.nan)


def _slopes_of_statement(
    solution: Solution, iterate: Iterate, multipliers: Array, distances: LimitDistances
) -> list[Slope]:
    """Derivatives of the Lagrangian by the named numbers that the statement has."""
    slopes = lagrangian_slopes(iterate, multipliers, distances)
    if solution.form.is_statement:
        return slopes
    added = set(_names(solution.form.problem)) - set(_names(solution.problem))
    return [s for s in slopes if s.name.removesuffix(" lower").removesuffix(" upper") not in added]


def _names(problem: Problem) -> Iterator[str]:
    """Names of numbers and limits of a problem, without the side that is meant."""
    yield from (symbol.name for symbol in problem.symbols)
    yield from (bound.name for bound in problem.boundary_constraints)
    for phase in problem.phases:
        yield from (f"{phase.name}: {bound.name}" for bound in phase.bounds)
        for state in phase.states:
            yield from (f"{phase.name}: {state.name} {end}" for end in ("initial", "final"))


@dataclass(frozen=True, eq=False)
class Slope:
    """Derivative of the Lagrangian by a named number: ``direct + by_multiplier @ multipliers``.

    Attributes
    ----------
    by_multiplier : (rows + unknowns,)
        Factors of the scaled multipliers of rows and of the unknowns' bounds.
    active : bool
        Whether it is a limit at which the solution lies.
    """

    name: str
    direct: float
    by_multiplier: Array
    active: bool = False


def lagrangian_slopes(
    iterate: Iterate, multipliers: Array, distances: LimitDistances
) -> list[Slope]:
    """Derivatives of the Lagrangian by all named numbers, linear in the multipliers.

    `J` is taken as it is minimised.  Fixed times of a phase with values at named instants are left
    out, as these instants would have to move too.

    Parameters
    ----------
    multipliers : (rows + unknowns,)
        Scaled, see `ocp.optimality.multipliers.all_multipliers`.
    """
    parameters, units = iterate.parameters, _multiplier_units(iterate)
    near_lower, near_upper = distances.active(ACTIVE)
    through_functions = {s.name: s for s in _constant_slopes(iterate)}

    slopes: list[Slope] = []
    for item in _named_limits(iterate):
        if parameters.limit(item.lower) == parameters.limit(item.upper):
            sides = [("", item.upper, item.at_upper, False)]
        else:
            # the sign of the multiplier says which of the two limits is strongly active
            strong_lower = item.at_lower[multipliers[item.at_lower] < 0]
            strong_upper = item.at_upper[multipliers[item.at_upper] > 0]
            active_lower = bool(near_lower[item.at_lower].any())
            active_upper = bool(near_upper[item.at_upper].any())
            sides = [
                (" lower", item.lower, strong_lower, active_lower),
                (" upper", item.upper, strong_upper, active_upper),
            ]

        for suffix, limit, entries, active in sides:
            if not math.isfinite(parameters.limit(limit)):
                continue
            by_multiplier = np.zeros(units.size)
            by_multiplier[entries] = -units[entries]
            slopes.append(Slope(item.name + suffix, 0.0, by_multiplier, active))

            # a limit that depends on constants passes its slope on to them
            for name, share in limit_slopes(limit, parameters).items():
                before = through_functions[name]
                total = before.by_multiplier + share * by_multiplier
                through_functions[name] = replace(before, by_multiplier=total)
    return [*slopes, *through_functions.values(), *_time_slopes(iterate)]


def _multiplier_units(iterate: Iterate) -> Array:
    """Multipliers in the user's units per scaled multiplier, of limited rows and of unknowns."""
    transcription, scales = iterate.transcription, iterate.scales
    rows = np.zeros(transcription.program.rows)
    bounds = iterate.problem.boundary_constraints
    rows[transcription.rows.boundary] = [1.0 / scales.bounds["", b.name] for b in bounds]
    for part in transcription.rows.path:
        rows[part.rows] = 1.0 / transcription.constraints[part.phase][part.constraint].scale
    return np.concatenate([rows, 1.0 / transcription.columns.sizes]) * scales.objective


def _constant_slopes(iterate: Iterate) -> list[Slope]:
    """Slopes of the Lagrangian through its functions by each constant."""
    transcription, constants = iterate.transcription, iterate.problem.constants
    rows, columns = transcription.program.rows, transcription.columns.count
    direct = np.zeros(len(constants))
    table = np.zeros((rows + columns, len(constants)))

    for block in transcription.program.blocks if constants else ():
        kernel = block.kernel.function
        w, d, c = (ca.SX.sym(s, kernel.sparsity_in(i)) for i, s in enumerate("wdc"))
        f, g = kernel(w, d, c)
        parts = [ca.densify(ca.gradient(f, c)), ca.densify(ca.vec(ca.jacobian(g, c)))]
        slope = ca.Function("slope", [w, d, c], parts)
        by_f, by_g = slope(iterate.x[block.columns].T, block.data.T, iterate.parameters.vector)
        direct += np.array(ca.sum2(by_f)).ravel()
        if block.rows.size:
            entries = np.array(by_g).reshape(len(constants), -1, block.count).transpose(2, 1, 0)
            np.add.at(table, block.rows, entries)

    size = iterate.scales.objective
    return [
        Slope(constant.name, float(value) * size, column * size)
        for constant, value, column in zip(constants, direct, table.T, strict=True)
    ]


@dataclass(frozen=True, eq=False, repr=False)
class _NamedLimits:
    """A named pair of limits and the entries, rows then unknowns, that it holds back."""

    name: str
    lower: Any
    upper: Any
    at_lower: Integers
    at_upper: Integers


def _named_limits(iterate: Iterate) -> Iterator[_NamedLimits]:
    """All named limits of a problem with the rows and unknowns they hold back."""
    transcription, problem = iterate.transcription, iterate.problem
    first = transcription.program.rows  # of the unknowns, which follow the rows

    for bound, row in zip(
        problem.boundary_constraints, transcription.rows.boundary[:, None], strict=True
    ):
        yield _NamedLimits(bound.name, bound.lower, bound.upper, row, row)
    for unknown, column in zip(
        problem.unknowns, first + transcription.columns.unknowns[:, None], strict=True
    ):
        yield _NamedLimits(unknown.name, unknown.lower, unknown.upper, column, column)

    signals: dict[Any, list[tuple[Integers, Integers]]] = {}
    for i, columns in enumerate(transcription.columns.phases):
        yield from _path_limits(transcription, i, signals)
        yield from _boundary_values(columns, first, iterate.parameters, signals)
        yield from _times(columns, first)
    for signal, pairs in signals.items():
        low, high = (np.concatenate(side) for side in zip(*pairs, strict=True))
        yield _NamedLimits(signal.name, signal.lower, signal.upper, low, high)


def _path_limits(
    transcription: Transcription, index: int, signals: dict[Any, list[tuple[Integers, Integers]]]
) -> Iterator[_NamedLimits]:
    """Bounds of a phase; rows that hold a signal's own bounds between points go to `signals`."""
    columns = transcription.columns.phases[index]
    by_name = {signal.name: signal for signal in columns.signals}
    for j, constraint in enumerate(transcription.constraints[index]):
        parts = [part.rows for part in transcription.rows.of_constraint(index, j)]
        if not parts or constraint.peak is not None:
            continue
        rows = np.concatenate(parts)
        if constraint.sampled:
            name = f"{columns.phase.name}: {constraint.name}"
            yield _NamedLimits(name, constraint.lower, constraint.upper, rows, rows)
        else:
            signals.setdefault(by_name[constraint.name], []).append((rows, rows))


def _boundary_values(
    columns: PhaseColumns,
    first: int,
    parameters: Parameters,
    signals: dict[Any, list[tuple[Integers, Integers]]],
) -> Iterator[_NamedLimits]:
    """Boundary values; the rest of the unknowns of a signal is held by its own bounds."""
    phase, none = columns.phase, np.empty(0, dtype=np.int64)
    for j, state in enumerate(columns.states):
        inner = [group.support[:, :, j].ravel() for group in columns.groups]
        low = high = np.unique(np.concatenate([columns.nodes[:, j], *inner]))
        widest = parameters.signal_limits[state.name]

        for node, what, values in ((0, "initial", phase.initial), (-1, "final", phase.final)):
            value = values.get(state)
            if value is None:
                continue
            lower, upper = value if isinstance(value, tuple) else (value, value)
            least, largest = parameters.limit(lower), parameters.limit(upper)
            column = columns.nodes[node, [j]]

            # the narrower one of boundary value and bound holds the unknown
            holds_low = least == largest or least >= widest[0]
            holds_high = least == largest or largest <= widest[1]
            yield _NamedLimits(
                f"{phase.name}: {state.name} {what}",
                lower,
                upper,
                at_lower=first + column if holds_low else none,
                at_upper=first + column if holds_high else none,
            )
            low = np.setdiff1d(low, column) if holds_low else low
            high = np.setdiff1d(high, column) if holds_high else high
        signals.setdefault(state, []).append((first + low, first + high))

    for signal, _, ids in columns.coefficients:
        entries = first + ids.ravel()
        signals.setdefault(signal, []).append((entries, entries))


def _times(columns: PhaseColumns, first: int) -> Iterator[_NamedLimits]:
    """Times of a phase of which one is free."""
    for end, lower, upper, column in columns.stated_times():
        own = first + column
        yield _NamedLimits(f"{columns.phase.name}: {end}", lower, upper, own, own)


def _time_slopes(iterate: Iterate) -> Iterator[Slope]:
    """Slopes by the initial and final times of phases in which both are fixed.

    In the same program with these times among its unknowns they are columns of the derivatives.
    """
    transcription, problem = iterate.transcription, iterate.problem
    fixed = [
        i
        for i, columns in enumerate(transcription.columns.phases)
        if columns.ends is None and not problem.instants[columns.phase.name]
    ]
    if not fixed:
        return

    phases = [_released(p) if i in fixed else p for i, p in enumerate(problem.phases)]
    with without_repeated_warnings():
        free = replace(problem, phases=phases)
    released = transcribe(
        free,
        transcription.mesh,
        iterate.scheme,
        iterate.controls,
        iterate.scales,
    )
    ends: dict[int, Any] = {i: released.columns.phases[i].ends for i in fixed}
    times = {i: transcription.columns.phases[i].fixed_times for i in fixed}

    # beside the times and the rows of their order, unknowns and rows are the same in both programs
    durations = [released.rows.phases[i].duration for i in fixed]
    rows = np.setdiff1d(np.arange(released.program.rows), np.concatenate(durations))
    columns = np.setdiff1d(np.arange(released.columns.count), np.concatenate(list(ends.values())))
    x = np.empty(released.columns.count)
    x[columns] = iterate.x
    for i in fixed:
        x[ends[i]] = np.array(times[i]) / iterate.scales.time

    constants = iterate.parameters.vector
    gradient = np.array(released.program.objective_gradient(x, constants)[1]).ravel()
    jacobian = released.program.constraint_jacobian(x, constants)[1]
    factor = iterate.scales.objective / iterate.scales.time
    for i in fixed:
        for what, column in zip(("start", "end"), ends[i], strict=True):
            by_row = np.array(jacobian[:, int(column)]).ravel()[rows]
            by_multiplier = np.concatenate([by_row, np.zeros(columns.size)])
            name = f"{problem.phases[i].name}: {what}"
            yield Slope(name, float(gradient[column]) * factor, by_multiplier * factor)


def _released(phase: Phase) -> Phase:
    """The phase with its fixed times as unknowns."""
    start, end = phase.start, phase.end
    assert not isinstance(start, Between)
    assert not isinstance(end, Between)
    return replace(phase, start=Between(start, start), end=Between(end, end))
