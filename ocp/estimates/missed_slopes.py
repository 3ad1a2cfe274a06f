"""Slopes of the Lagrangian between all points of a mesh: what a number of zero hides.

A gust that a control multiplies is nothing where the control is zero. Along such a motion rates and
limits are what their points say, and yet the control could gain by the gust. It shows in the slope
of the Lagrangian's density

    l = L + lambda . f + mu . c

by the control. The same holds for a state, whose costate misses the slope, for an unknown, which is
not where its slope vanishes, and for a constant, whose sensitivity is the integral of the slope. So
the slopes by all of them are integrated densely, and held against their integrals by the scheme.

A kink has a slope that steps. Where a signal rests on it, that is noise. So terms whose slopes step
as signals change are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ocp.arrays import Array, Integers
from ocp.estimates.dense_panels import OF_PANEL, DensePanels, finite, panels_of_phase
from ocp.estimates.narrow_features import NarrowFeature, is_smooth, may_hide
from ocp.mesh.trajectory import Evaluator
from ocp.numerics.columnwise import columnwise
from ocp.numerics.expression_graph import summands
from ocp.numerics.piecewise_polynomial import Lagrange
from ocp.numerics.stepwise_operations import stepwise_operations
from ocp.optimality.active_set import ACTING, strongly_active
from ocp.optimality.iterate import Iterate
from ocp.optimality.multipliers import phase_costates
from ocp.problem.symbols import TIME, Constant, Signal, Unknown
from ocp.scaling.scales import Scales
from ocp.transcription.transcribe import Transcription

# Part of the slope's modulus over an interval, or over all phases for a constant, that a miss has
# to be: less is what a mesh leaves of smooth slopes
_LEAST = 1e-4

# Part of its scale below which a costate or a multiplier is what the solver leaves
_NOISE = 1e-8

# Intervals that a mesh gets where it misses a slope. Nothing else may ask for finer ones there.
_PARTS = 4

# Terms into which an expression is taken apart if its slopes step, and operations of all together
_MOST_TERMS = 64
_NODES = 100_000

# Operations of a gradient per operation of what it is of, about
_GRADIENT = 4


@dataclass(frozen=True)
class MissedSlope:
    """A slope that the points of an interval do not see.

    Attributes
    ----------
    symbol : Signal, Unknown or Constant
        What the slope is by.
    feature : NarrowFeature
        Where. Its size is a part of the objective: to first order, what changing the symbol by its
        size would bring there. For a constant it is a part of its sensitivity's terms.
    """

    symbol: Signal | Unknown | Constant
    feature: NarrowFeature


def missed_slopes(iterate: Iterate, evaluator: Evaluator, allowed: float) -> Iterator[MissedSlope]:
    """The slopes by signals, unknowns and constants that the points of a mesh miss.

    Parameters
    ----------
    allowed : float
        What may be missed of a slope by a signal or an unknown, of the objective.
    """
    problem, transcription = iterate.problem, iterate.transcription
    if not may_hide(problem):
        return
    rough = [_rough_rows(transcription, index) for index in range(len(problem.phases))]
    longest = max(
        (ca.n_nodes(ca.vertcat(*[row.expression for row in rows])) for rows in rough if rows),
        default=0,
    )
    count = panels_of_phase(iterate.trajectory.phases, _GRADIENT * longest) if longest else 0
    if not count:
        return

    of_phases = [
        _PhaseSlopes.of(iterate, evaluator, index, rows, count)
        for index, rows in enumerate(rough)
        if rows
    ]
    whole: dict[str, float] = {}
    for slopes in of_phases:
        for symbol, modulus in zip(slopes.symbols, slopes.modulus, strict=True):
            whole[symbol.name] = whole.get(symbol.name, 0.0) + float(modulus.sum())
    for slopes in of_phases:
        yield from slopes.misses(iterate, whole, allowed)


@dataclass(frozen=True, eq=False, repr=False)
class _Row:
    """An expression that may hide something, and where its multiplier is found.

    Attributes
    ----------
    costate, constraint : int or None
        Number of the costate or of the path constraint; both None for what the objective adds up.
    """

    expression: ca.SX
    costate: int | None = None
    constraint: int | None = None


def _rough_rows(transcription: Transcription, index: int) -> list[_Row]:
    """Those of a phase."""
    problem, columns = transcription.problem, transcription.columns.phases[index]
    name = columns.phase.name
    rates = [*columns.phase.dynamics.values(), *[f.expression for f in columns.integrals]]
    rows = [
        *[_Row(rate, costate=i) for i, rate in enumerate(rates)],
        *[
            _Row(weight * integral.expression)
            for integral, weight in problem.summed.items()
            if integral.phase == name
        ],
        *[
            _Row(constraint.sign * constraint.expression, constraint=i)
            for i, constraint in enumerate(transcription.constraints[index])
            if constraint.sampled
        ],
    ]
    return [row for row in rows if not is_smooth(problem, name, row.expression)]


@dataclass(frozen=True, eq=False, repr=False)
class _PhaseSlopes:
    """Slopes of the density by all symbols of a phase, densely and by the scheme.

    Attributes
    ----------
    index : int
        Number of the phase.
    symbols : tuple
        Signals, then unknowns, then constants.
    by_panel : (n, P)
        How far the slopes stray from polynomials through the points [unit of the objective / unit].
    missed, modulus : (n, N)
        What the scheme misses of their integrals, and the integrals of their moduli.
    worth : (n, N)
        What moving each signal and unknown where its slope strays would bring, at most and to first
        order, within its limits and by its size [unit of the objective].
    """

    index: int
    symbols: tuple[Any, ...]
    panels: DensePanels
    by_panel: Array
    missed: Array
    modulus: Array
    worth: Array

    @classmethod
    def of(
        cls, iterate: Iterate, evaluator: Evaluator, index: int, rows: Sequence[_Row], count: int
    ) -> _PhaseSlopes:
        """Those of an iterate with about so many panels."""
        motion = iterate.trajectory.phases[index]
        symbols, gradient = _gradient_of(evaluator, iterate.transcription, index, rows)
        costates, densities = _costates(iterate, index), _densities(iterate, index)

        def slopes(intervals: Integers, tau: Array) -> Array:
            """At local times (r, q) of intervals (r,), (n, r, q)."""
            k = np.repeat(intervals, tau.shape[1])
            along = costates(k, tau.ravel())
            weights = [
                along[:, row.costate]
                if row.costate is not None
                else densities[row.constraint][k]
                if row.constraint is not None
                else np.ones(k.size)
                for row in rows
            ]
            (values,) = columnwise(
                gradient,
                motion.local(k, tau.ravel()),
                evaluator.times(motion, k, tau.ravel())[:, None],
                evaluator.numbers(iterate.trajectory),
                np.column_stack(weights),
            )
            return finite(values.T.reshape(len(symbols), *tau.shape))

        panels = DensePanels.of(motion, count)
        tau, seconds = panels.tau, panels.seconds
        values = slopes(panels.intervals, tau)
        strayed, by_scheme = np.zeros_like(values), np.zeros((len(symbols), motion.intervals))
        for degree in sorted(set(motion.degrees.tolist())):
            here, rule = np.flatnonzero(motion.degrees == degree), motion.scheme.at(degree)
            at_points = slopes(here, np.tile(rule.points, (here.size, 1)))
            by_scheme[:, here] = at_points @ rule.weights * np.diff(motion.breakpoints)[here]

            own = np.flatnonzero(motion.degrees[panels.intervals] == degree)
            basis = Lagrange(tuple(rule.points.tolist())).values(tau[own].ravel())
            basis = basis.reshape(own.size, OF_PANEL, -1)
            points = at_points[:, np.searchsorted(here, panels.intervals[own])]
            strayed[:, own] = values[:, own] - np.einsum("pqm,npm->npq", basis, points)

        # a slope that holds a signal on its limit brings nothing
        moving = [symbol for symbol in symbols if not isinstance(symbol, Constant)]
        sampled = np.repeat(panels.intervals, OF_PANEL), tau.ravel()
        room = _room(iterate, index, moving, motion.local(*sampled).T, values[: len(moving)])
        gained = np.minimum(np.abs(strayed), np.abs(values))[: len(moving)] * room * seconds

        return cls(
            index=index,
            symbols=symbols,
            panels=panels,
            by_panel=np.abs(strayed * seconds).sum(axis=2),
            missed=np.abs(panels.in_all((values * seconds).sum(axis=2)) - by_scheme),
            modulus=panels.in_all(np.abs(values * seconds).sum(axis=2)),
            worth=panels.in_all(gained.sum(axis=2)),
        )

    def misses(
        self, iterate: Iterate, whole: dict[str, float], allowed: float
    ) -> Iterator[MissedSlope]:
        """Those that count.

        Parameters
        ----------
        whole : dict of str to float
            Integrals of the slopes' moduli over all phases, by name.
        """
        motion, scales = self.panels.motion, iterate.scales
        for j, symbol in enumerate(self.symbols):
            # a constant does not move: a miss is a part of its sensitivity, and gains nothing
            if isinstance(symbol, Constant):
                size = whole[symbol.name]
                parts = self.missed[j] / size if size > 0.0 else np.zeros(motion.intervals)
                counting = parts > _LEAST
            else:
                of_size = self.missed[j] * _size(scales, symbol)
                parts = np.minimum(of_size, self.worth[j]) / iterate.objective_size
                counting = (parts > allowed) & (self.missed[j] > _LEAST * self.modulus[j])

            for k in np.flatnonzero(counting).tolist():
                first, last = self.panels.span(k, self.by_panel[j])
                yield MissedSlope(
                    symbol,
                    NarrowFeature(
                        phase=self.index,
                        where=motion.name,
                        name=f"what '{symbol.name}' acts on",
                        first=first,
                        last=last,
                        time=motion.start + 0.5 * (first + last) * (motion.end - motion.start),
                        size=float(parts[k]),
                        of="the objective",
                        parts=_PARTS,
                    ),
                )


def _size(scales: Scales, symbol: Signal | Unknown) -> float:
    """Its typical size."""
    return (scales.unknowns if isinstance(symbol, Unknown) else scales.signals)[symbol.name]


def _room(
    iterate: Iterate,
    index: int,
    moving: Sequence[Signal | Unknown],
    signals: Array,
    slopes: Array,
) -> Array:
    """How far signals and unknowns may move against their slopes, (n, P, q); by their size at most.

    Parameters
    ----------
    signals : (n_s, P q)
        Of the phase, which come first among `moving`.
    slopes : (n, P, q)
    """
    parameters, numbers = iterate.parameters, iterate.trajectory.unknowns
    names = iterate.trajectory.phases[index].signals
    room = np.empty_like(slopes)
    for j, symbol in enumerate(moving):
        if isinstance(symbol, Unknown):
            value, limits = numbers[symbol.name], parameters.unknown_limits[symbol.name]
        else:
            value = signals[names.index(symbol.name)].reshape(slopes[j].shape)
            limits = parameters.signal_limits[symbol.name]
        to_limit = np.where(slopes[j] > 0.0, value - limits[0], limits[1] - value)
        room[j] = np.clip(to_limit, 0.0, _size(iterate.scales, symbol))
    return room


def _gradient_of(
    evaluator: Evaluator, transcription: Transcription, index: int, rows: Sequence[_Row]
) -> tuple[tuple[Any, ...], ca.Function]:
    """Symbols, and ``(signals, time, unknowns and constants, weights) -> slopes by them``.

    It is built at the first call for a problem and kept, as `ocp.optimality.hamiltonian` does.
    """
    problem, signals = transcription.problem, transcription.columns.phases[index].signals

    def made() -> tuple[tuple[Any, ...], ca.Function]:
        moving = [*signals, *problem.unknowns]
        symbols = (*moving, *problem.constants)
        along = ca.vertcat(TIME.symbol, *[signal.symbol for signal in signals])
        weights = ca.SX.sym("weight", len(rows))
        by = ca.vertcat(*[s.symbol for s in moving], ca.SX(0, 1))
        fixed = ca.vertcat(*[s.symbol for s in problem.constants], ca.SX(0, 1))

        smooth, every = ca.SX(0), ca.SX(0)
        for row, weight in zip(rows, ca.vertsplit(weights), strict=True):
            every += weight * row.expression
            smooth += weight * _smooth_part(row.expression, by, along)
        slopes = ca.vertcat(ca.gradient(smooth, by), ca.gradient(every, fixed))
        numbers = [s.symbol for s in (*problem.unknowns, *problem.constants)]
        inputs = [
            ca.vertcat(*[signal.symbol for signal in signals]),
            TIME.symbol,
            ca.vertcat(*numbers, ca.SX(0, 1)),
            weights,
        ]
        function = ca.Function("slopes", inputs, ca.cse([ca.densify(slopes)]))
        return symbols, function

    names = tuple(signal.name for signal in signals)
    return evaluator.once(("missed slopes", index, names), made)


def _smooth_part(expression: ca.SX, by: ca.SX, along: ca.SX) -> ca.SX:
    """An expression without the terms whose slopes step, such as the friction beside a gust."""
    if not _steps(expression, by, along):
        return expression
    most = int(min(_MOST_TERMS, _NODES // max(1, ca.n_nodes(expression))))
    terms = summands(expression, most)
    if len(terms) < 2:
        return ca.SX(0)
    return ca.sum1(ca.vertcat(*[term for term in terms if not _steps(term, by, along)], 0))


def _steps(expression: ca.SX, by: ca.SX, along: ca.SX) -> bool:
    """Whether slopes of an expression step as a signal changes; at known times they may."""
    slopes = [slope for slope in ca.vertsplit(ca.gradient(expression, by)) if not slope.is_zero()]
    if not slopes:
        return False
    operations = stepwise_operations(slopes, ca.symvar(ca.vertcat(*slopes)))
    if operations is None:
        return False
    signals = along[1:]
    return any(bool(ca.depends_on(result, signals)) for result in operations.results)


def _costates(iterate: Iterate, index: int) -> Any:
    """A function of intervals and local times (m,): costates (m, n) without what is noise."""
    found, scales = phase_costates(iterate, index), iterate.scales
    columns = iterate.transcription.columns.phases[index]
    sizes = [scales.signals[s.name] for s in columns.states]
    sizes += [scales.functionals[f] for f in columns.integrals]
    least = _NOISE * scales.objective / np.array(sizes)

    def local(intervals: Integers, tau: Array) -> Array:
        values = found.local(intervals, tau)
        return np.asarray(np.where(np.abs(values) > least, values, 0.0))

    return local


def _densities(iterate: Iterate, index: int) -> dict[int, Array]:
    """Mean multiplier of each path constraint in each interval, (N,), by the constraint's number.

    Points that are added between those of collocation have masses and no densities. What the
    barrier leaves of a limit that does not act is none.
    """
    transcription, motion = iterate.transcription, iterate.trajectory.phases[index]
    masses: dict[int, Array] = {
        i: np.zeros(motion.intervals) for i in range(len(transcription.constraints[index]))
    }
    for rows in transcription.rows.phases[index].path:
        scaled = iterate.determined_row_multipliers[rows.rows]
        np.add.at(masses[rows.constraint], rows.intervals, scaled)
    widths = np.maximum(np.diff(motion.breakpoints), np.finfo(float).tiny)
    densities = {}
    for i, mass in masses.items():
        unit = iterate.scales.objective / transcription.constraints[index][i].scale
        acting = strongly_active(mass / widths, ACTING) & (np.abs(mass) > _NOISE)
        densities[i] = np.where(acting, mass, 0.0) * unit / widths
    return densities
