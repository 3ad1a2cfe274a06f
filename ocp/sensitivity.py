"""Sensitivities of the optimum to named numbers, from the multipliers on the solved mesh.

By the envelope theorem ``dJ/dp`` is the partial derivative of the Lagrangian: through the
functions for a constant, ``-mu`` for a limit (`ocp.multipliers` has the sign).  Nothing is solved
again.  Breakpoints that the optimiser moved are unknowns like others and drop out.

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

from ocp.blocks import Block
from ocp.guess import evaluate_limit
from ocp.layout import PhaseLayout
from ocp.limits import Limits
from ocp.local import Context
from ocp.multipliers import SolvedProgram, column_multipliers, lagrangian, path_rows
from ocp.phase_blocks import phase_blocks
from ocp.statement import Problem
from ocp.symbols import Between, resolve, scalar
from ocp.terminal import terminal_block
from ocp.transcribe import Transcription, inline_weights

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
_STEP = 1e-3  # of the duration, in differences of fourth order: error 1e-12


@dataclass(frozen=True)
class Limited:
    """A named pair of limits and the multipliers that belong to it.

    Attributes
    ----------
    at_lower, at_upper : (m,) multipliers [unit of the objective per unit of the limit].
    """

    name: str
    lower: Any
    upper: Any
    at_lower: Array
    at_upper: Array


def sensitivities(solved: SolvedProgram, constants: Mapping[str, float]) -> dict[str, float]:
    """Change of the optimum per unit of every named number, in the user's sign.

    Parameters
    ----------
    constants : the values of the named constants in the solve.

    Returns
    -------
    dict
        ``dJ/dvalue`` by name, `J` as it is minimised or maximised.  One-sided where the active
        set is about to change.  Fixed times of a phase with values at named instants are left
        out, as these instants would have to move too.
    """
    found, sense = {}, solved.problem.sense
    direct = constant_slopes(solved, constants)
    for item in limited(solved, dict(constants)):
        low, high = (evaluate_limit(v, constants) for v in (item.lower, item.upper))
        if low == high:
            slopes = {"": (item.upper, -float((item.at_lower + item.at_upper).sum()))}
        else:
            slopes = {" lower": (item.lower, -float(item.at_lower.sum())),
                      " upper": (item.upper, -float(item.at_upper.sum()))}  # fmt: skip
        for suffix, (limit, slope) in slopes.items():
            if math.isfinite(evaluate_limit(limit, constants)):
                found[item.name + suffix] = sense * slope
                for name, share in limit_slopes(limit, constants).items():
                    direct[name] += slope * share
    found.update({name: sense * slope for name, slope in direct.items()})
    found.update({name: sense * slope for name, slope in time_slopes(solved, constants)})
    return found


def constant_slopes(solved: SolvedProgram, constants: Mapping[str, float]) -> dict[str, float]:
    """Slope of the Lagrangian through its functions by constant."""
    named = solved.problem.constants
    total = np.zeros(len(named))
    values = np.array([constants[c.name] for c in named])
    for block in solved.transcription.blocks if named else ():
        kernel = block.kernel
        w, d, c = (ca.SX.sym(s, kernel.sparsity_in(i)) for i, s in enumerate("wdc"))
        f, g = kernel(w, d, c)
        nu = ca.SX.sym("nu", g.shape[0])
        slope = ca.densify(ca.gradient(f + ca.dot(nu, g), c))
        many = ca.Function("slope", [w, d, c, nu], [slope]).map(
            block.count, [False, False, True, False]
        )
        rows = solved.row_multipliers[block.rows].T
        out = many(solved.x[block.columns].T, block.data.T, values, rows)
        total += np.array(ca.sum2(out)).ravel()
    total *= solved.scales.objective
    return {c.name: float(v) for c, v in zip(named, total, strict=True)}


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


def limited(solved: SolvedProgram, constants: dict[str, float]) -> Iterator[Limited]:
    """All named limits of a problem with their multipliers."""
    made, size = solved.transcription, solved.scales.objective
    columns = column_multipliers(solved, constants) * size / made.sizes
    rows = solved.row_multipliers * size
    bounds = (*solved.problem.bounds, *solved.problem.links)
    for n, b in enumerate(bounds):
        mu = rows[made.blocks[-1].rows[:, n]] / solved.scales.bounds["", b.name]
        yield _split(b.name, b.lower, b.upper, mu)
    for u, column in zip(solved.problem.unknowns, made.unknown_ids, strict=True):
        yield _split(u.name, u.lower, u.upper, columns[[column]])
    signals: dict[Any, list[tuple[Array, Array]]] = {}
    named: dict[str, tuple[Any, Any, list[Array]]] = {}
    for i, j, mu in _path_multipliers(made, rows):
        constraint, phase = made.constraints[i][j], made.layouts[i].phase
        if not constraint.sampled:
            signal = next(s for s in made.layouts[i].signals if s.name == constraint.name)
            signals.setdefault(signal, []).append((np.minimum(mu, 0), np.maximum(mu, 0)))
        elif constraint.peak is None:
            name = f"{phase.name}: {constraint.name}"
            named.setdefault(name, (constraint.lower, constraint.upper, []))[2].append(mu)
    for name, (lower, upper, parts) in named.items():
        yield _split(name, lower, upper, np.concatenate(parts))
    for layout in made.layouts:
        yield from _boundary(layout, columns, constants, signals)
        yield from _times(layout, columns)
    for signal, pairs in signals.items():
        low, high = (np.concatenate(side) for side in zip(*pairs, strict=True))
        yield Limited(signal.name, signal.lower, signal.upper, low, high)


def _split(name: str, lower: Any, upper: Any, mu: Array) -> Limited:
    return Limited(name, lower, upper, np.minimum(mu, 0.0), np.maximum(mu, 0.0))


def _path_multipliers(made: Transcription, rows: Array) -> Iterator[tuple[int, int, Array]]:
    for p in path_rows(made):
        yield p.phase, p.constraint, rows[p.rows] / made.constraints[p.phase][p.constraint].scale


def _boundary(
    layout: PhaseLayout, columns: Array, constants: Mapping[str, float],
    signals: dict[Any, list[tuple[Array, Array]]],
) -> Iterator[Limited]:  # fmt: skip
    """Boundary values; what is left of the multipliers goes to the signals' own bounds."""
    for j, state in enumerate(layout.states):
        low, high = np.minimum(columns, 0.0), np.maximum(columns, 0.0)
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
                          low[at] * mine_low, high[at] * mine_high)  # fmt: skip
            low[at], high[at] = low[at] * (not mine_low), high[at] * (not mine_high)
        inner = [group.support[:, :, j].ravel() for group in layout.groups]
        ids = np.unique(np.concatenate([layout.nodes[:, j], *inner]))
        signals.setdefault(state, []).append((low[ids], high[ids]))
    held = [(layout.constant, layout.steps), (layout.linear, layout.ramps)]
    for group in layout.groups:
        held += [(layout.polynomial, group.controls), (layout.algebraics, group.algebraics)]
    for kind, table in held:
        for j, signal in enumerate(kind):
            mu = columns[table[..., j].ravel()]
            signals.setdefault(signal, []).append((np.minimum(mu, 0.0), np.maximum(mu, 0.0)))


def _numbers(pair: tuple[Any, Any], constants: Mapping[str, float]) -> tuple[float, float]:
    return evaluate_limit(pair[0], constants), evaluate_limit(pair[1], constants)


def _times(layout: PhaseLayout, columns: Array) -> Iterator[Limited]:
    if layout.ends is None:
        return
    phase = layout.phase
    for value, column, what in zip(
        (phase.start, phase.end), layout.ends, ("start", "end"), strict=True
    ):
        pair = (value.lower, value.upper) if isinstance(value, Between) else (value, value)
        yield _split(f"{phase.name}: {what}", *pair, columns[[column]])


def time_slopes(
    solved: SolvedProgram, constants: Mapping[str, float]
) -> Iterator[tuple[str, float]]:
    """Slopes by the initial and final times of phases in which both are fixed.

    The kernels are written anew for times a little off, and the Lagrangian is differenced.
    """
    made = solved.transcription
    values = np.array([constants[c.name] for c in solved.problem.constants])
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
                n: lagrangian(_retimed(solved, i, what, n * step), solved, values)
                for n in (-2, -1, 1, 2)
            }
            slope = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * step)
            yield f"{name}: {what}", slope * solved.scales.objective


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
