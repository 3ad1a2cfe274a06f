"""Sensitivities of the optimum to named numbers, from the multipliers on the solved mesh.

By the envelope theorem ``dJ/dp`` is the partial derivative of the Lagrangian: through the
functions for a constant, ``-mu`` for a limit (`ocp.optimality.multipliers` has the sign).  Nothing
is solved
again.  Breakpoints that the optimiser moved are unknowns like others and drop out.  Where several
sets of multipliers fit, the optimum has a kink: `ocp.analysis.one_sided` finds the slope on either
side.

The names are those of the statement: a constant's own; ``"x upper"`` for a bound of a signal,
unknown or `Bound` of the problem; ``"phase: power upper"`` for a `Bound` of a phase;
``"phase: x initial"``, ``"phase: start"`` for boundary values and times, with ``upper`` or
``lower`` behind where they are free between limits; an equation carries its bare name.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.mesh.initial_guess import evaluate_limit
from ocp.optimality.multipliers import SolvedProgram, column_multipliers, path_rows
from ocp.problem.statement import Problem
from ocp.problem.symbols import Between, resolve, scalar
from ocp.transcription.boundary import terminal_block
from ocp.transcription.defects import phase_blocks
from ocp.transcription.kernel_builder import Context
from ocp.transcription.kernels import Block, evaluated
from ocp.transcription.limits import Limits
from ocp.transcription.transcribe import inline_weights
from ocp.transcription.variables import PhaseLayout

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_STEP = 1e-3  # of the duration, in differences of fourth order: error 1e-12
_NEAR = 1e-4  # scaled distance from a limit below which it is touched


@dataclass(frozen=True, eq=False)
class Slope:
    """Derivative of the Lagrangian by a named number: ``direct + by_multiplier @ multipliers``.

    Attributes
    ----------
    by_multiplier : (rows + unknowns,) factors of the scaled multipliers of rows and bounds.
    touching : whether it is a limit that the solution touches.
    """

    name: str
    direct: float
    by_multiplier: Array
    touching: bool = False


@dataclass(frozen=True, eq=False)
class Limited:
    """A named pair of limits and the entries, rows then unknowns, that it holds back."""

    name: str
    lower: Any
    upper: Any
    at_lower: Integers
    at_upper: Integers


def all_multipliers(solved: SolvedProgram, constants: Mapping[str, float]) -> Array:
    """Scaled multipliers of the rows, then of the unknowns' bounds."""
    return np.concatenate([solved.row_multipliers, column_multipliers(solved, dict(constants))])


def slopes(solved: SolvedProgram, constants: Mapping[str, float]) -> list[Slope]:
    """Derivatives of the Lagrangian by all named numbers, linear in the multipliers.

    `J` is taken as it is minimised.  Fixed times of a phase with values at named instants are left
    out, as these instants would have to move too.
    """
    direct = {s.name: s for s in constant_slopes(solved, constants)}
    units, room = per_unit(solved), distances(solved, constants)
    both = all_multipliers(solved, constants)
    found: list[Slope] = []
    for item in limited(solved, constants):
        low, high = (evaluate_limit(v, constants) for v in (item.lower, item.upper))
        if low == high:
            sides = [("", item.upper, item.at_upper, False)]
        else:
            at_lower, at_upper = item.at_lower, item.at_upper
            sides = [(" lower", item.lower, at_lower[both[at_lower] < 0],
                      bool((room[0][at_lower] <= _NEAR).any())),
                     (" upper", item.upper, at_upper[both[at_upper] > 0],
                      bool((room[1][at_upper] <= _NEAR).any()))]  # fmt: skip
        for suffix, limit, ids, touching in sides:
            if not math.isfinite(evaluate_limit(limit, constants)):
                continue
            vector = np.zeros(units.size)
            vector[ids] = -units[ids]
            found.append(Slope(item.name + suffix, 0.0, vector, touching))
            for name, share in limit_slopes(limit, constants).items():
                own = direct[name]
                direct[name] = replace(own, by_multiplier=own.by_multiplier + share * vector)
    return [*found, *direct.values(), *time_slopes(solved, constants)]


def per_unit(solved: SolvedProgram) -> Array:
    """Multipliers in the user's units per scaled multiplier, of limited rows and of unknowns."""
    made, size = solved.transcription, solved.scales.objective
    rows = np.zeros(made.rows.count)
    for n, b in enumerate((*solved.problem.bounds, *solved.problem.links)):
        rows[made.blocks[-1].rows[:, n]] = size / solved.scales.bounds["", b.name]
    for p in path_rows(made):
        rows[p.rows] = size / made.constraints[p.phase][p.constraint].scale
    return np.concatenate([rows, size / made.sizes])


def distances(solved: SolvedProgram, constants: Mapping[str, float]) -> tuple[Array, Array]:
    """Scaled distances of rows and unknowns from their lower and upper limits."""
    made = solved.transcription
    values = ca.DM([constants[c.name] for c in solved.problem.constants] or ca.DM(0, 1))
    rows = np.array(made.program.oracle(solved.x, values)[1]).ravel()
    at = np.concatenate([rows, solved.x])
    limits = np.hstack([made.rows.evaluate(constants), made.columns.evaluate(constants)])
    return at - limits[0], limits[1] - at


def constant_slopes(solved: SolvedProgram, constants: Mapping[str, float]) -> list[Slope]:
    """Slopes of the Lagrangian through its functions by each constant."""
    made, named = solved.transcription, solved.problem.constants
    values = np.array([constants[c.name] for c in named])
    direct = np.zeros(len(named))
    table = np.zeros((made.rows.count + made.columns.count, len(named)))
    for block in made.blocks if named else ():
        kernel = block.kernel.whole
        w, d, c = (ca.SX.sym(s, kernel.sparsity_in(i)) for i, s in enumerate("wdc"))
        f, g = kernel(w, d, c)
        parts = [ca.densify(ca.gradient(f, c)), ca.densify(ca.vec(ca.jacobian(g, c)))]
        slope = ca.Function("slope", [w, d, c], parts)
        by_f, by_g = slope(solved.x[block.columns].T, block.data.T, values)
        direct += np.array(ca.sum2(by_f)).ravel()
        if block.rows.size:
            entries = np.array(by_g).reshape(len(named), -1, block.count).transpose(2, 1, 0)
            np.add.at(table, block.rows, entries)
    size = solved.scales.objective
    return [
        Slope(c.name, float(v) * size, column * size)
        for c, v, column in zip(named, direct, table.T, strict=True)
    ]


def limit_slopes(limit: Any, constants: Mapping[str, float]) -> dict[str, float]:
    """Derivatives of a limit by the constants it depends on."""
    sx = scalar(limit, "a limit")
    symbols = resolve(sx, "a limit")
    if not symbols:
        return {}
    inputs = ca.vertcat(*[s.symbol for s in symbols])
    slope = ca.Function("slope", [inputs], [ca.densify(ca.jacobian(sx, inputs))])
    values = np.array(slope([constants[s.name] for s in symbols])).ravel()
    return {s.name: float(v) for s, v in zip(symbols, values, strict=True)}


def limited(solved: SolvedProgram, constants: Mapping[str, float]) -> Iterator[Limited]:
    """All named limits of a problem with the rows and unknowns they hold back."""
    made = solved.transcription
    first = made.rows.count
    bounds = (*solved.problem.bounds, *solved.problem.links)
    for n, b in enumerate(bounds):
        yield _either(b.name, b.lower, b.upper, made.blocks[-1].rows[:, n])
    for u, column in zip(solved.problem.unknowns, made.unknown_ids, strict=True):
        yield _either(u.name, u.lower, u.upper, first + np.array([column]))
    signals: dict[Any, list[tuple[Integers, Integers]]] = {}
    named: dict[str, tuple[Any, Any, list[Integers]]] = {}
    for part in path_rows(made):
        constraint = made.constraints[part.phase][part.constraint]
        layout = made.layouts[part.phase]
        if not constraint.sampled:
            signal = next(s for s in layout.signals if s.name == constraint.name)
            signals.setdefault(signal, []).append((part.rows, part.rows))
        elif constraint.peak is None:
            name = f"{layout.phase.name}: {constraint.name}"
            named.setdefault(name, (constraint.lower, constraint.upper, []))[2].append(part.rows)
    for name, (lower, upper, parts) in named.items():
        yield _either(name, lower, upper, np.concatenate(parts))
    for layout in made.layouts:
        yield from _boundary(layout, first, constants, signals)
        yield from _times(layout, first)
    for signal, pairs in signals.items():
        low, high = (np.concatenate(side) for side in zip(*pairs, strict=True))
        yield Limited(signal.name, signal.lower, signal.upper, low, high)


def _either(name: str, lower: Any, upper: Any, ids: Integers) -> Limited:
    return Limited(name, lower, upper, ids, ids)


def _boundary(
    layout: PhaseLayout, first: int, constants: Mapping[str, float],
    signals: dict[Any, list[tuple[Integers, Integers]]],
) -> Iterator[Limited]:  # fmt: skip
    """Boundary values; the rest of the unknowns of a signal is held by its own bounds."""
    none = np.empty(0, dtype=np.int64)
    for j, state in enumerate(layout.states):
        inner = [group.support[:, :, j].ravel() for group in layout.groups]
        ids = np.unique(np.concatenate([layout.nodes[:, j], *inner]))
        low, high = ids, ids
        for node, what, values in ((0, "initial", layout.phase.initial),
                                   (-1, "final", layout.phase.final)):  # fmt: skip
            value = values.get(state)
            if value is None:
                continue
            pair = value if isinstance(value, tuple) else (value, value)
            own, at = _numbers(pair, constants), layout.nodes[node, [j]]
            wide = _numbers((state.lower, state.upper), constants)
            fixed = own[0] == own[1]
            mine_low, mine_high = fixed or own[0] >= wide[0], fixed or own[1] <= wide[1]
            yield Limited(f"{layout.phase.name}: {state.name} {what}", pair[0], pair[1],
                          first + at if mine_low else none,
                          first + at if mine_high else none)  # fmt: skip
            low = np.setdiff1d(low, at) if mine_low else low
            high = np.setdiff1d(high, at) if mine_high else high
        signals.setdefault(state, []).append((first + low, first + high))
    held = [(layout.constant, layout.steps), (layout.linear, layout.ramps)]
    for group in layout.groups:
        held += [(layout.polynomial, group.controls), (layout.algebraics, group.algebraics)]
    for kind, table in held:
        for j, signal in enumerate(kind):
            own_ids = first + table[..., j].ravel()
            signals.setdefault(signal, []).append((own_ids, own_ids))


def _numbers(pair: tuple[Any, Any], constants: Mapping[str, float]) -> tuple[float, float]:
    return evaluate_limit(pair[0], constants), evaluate_limit(pair[1], constants)


def _times(layout: PhaseLayout, first: int) -> Iterator[Limited]:
    if layout.ends is None:
        return
    phase = layout.phase
    for value, column, what in zip(
        (phase.start, phase.end), layout.ends, ("start", "end"), strict=True
    ):
        pair = (value.lower, value.upper) if isinstance(value, Between) else (value, value)
        yield _either(f"{phase.name}: {what}", *pair, first + np.array([column]))


def time_slopes(solved: SolvedProgram, constants: Mapping[str, float]) -> Iterator[Slope]:
    """Slopes by the initial and final times of phases in which both are fixed.

    The kernels are written anew for times a little off, and the Lagrangian is differenced.
    """
    made, size = solved.transcription, solved.scales.objective
    values = np.array([constants[c.name] for c in solved.problem.constants])
    unknowns = np.zeros(made.columns.count)
    for i, layout in enumerate(made.layouts):
        name = layout.phase.name
        instants = any(
            f.kind == "value" and f.pieces[0][0] == name for f in solved.problem.functionals
        )
        if layout.ends is not None or instants:
            continue
        step = _STEP * (layout.fixed_times[1] - layout.fixed_times[0])
        for what in ("start", "end"):
            at = {
                n: evaluated(_retimed(solved, i, what, n * step), solved.x, values, made.rows.count)
                for n in (-2, -1, 1, 2)
            }
            direct, rows = (
                size * (8 * (at[1][p] - at[-1][p]) - (at[2][p] - at[-2][p])) / (12 * step)
                for p in (0, 1)
            )
            yield Slope(f"{name}: {what}", float(direct), np.concatenate([rows, unknowns]))


def _retimed(solved: SolvedProgram, index: int, what: str, shift: float) -> tuple[Block, ...]:
    """The blocks of the same program with one fixed time of a phase shifted."""
    made, old = solved.transcription, solved.problem
    phases = list(old.phases)
    phases[index] = replace(phases[index], **{what: getattr(phases[index], what) + shift})
    problem = Problem(old.name, phases, old.minimise, old.maximise, old.bounds, old.links)
    layouts = list(made.layouts)
    layouts[index] = replace(layouts[index], phase=phases[index])
    scales, rows, weights = solved.scales, Limits(), inline_weights(problem)
    context = Context(
        problem, scales.signals, made.unknown_ids,
        tuple(scales.unknowns[u.name] for u in problem.unknowns), scales.time,
    )  # fmt: skip
    blocks: list[Block] = []
    for layout, found, extra in zip(layouts, made.constraints, made.mesh.extra, strict=True):
        blocks += phase_blocks(context, layout, found, scales, weights, made.peak_ids, rows, extra)
    blocks.append(terminal_block(context, layouts, scales, weights, made.peak_ids, rows))
    return tuple(blocks)
