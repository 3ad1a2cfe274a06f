"""Moduli and largest values of a control in rates, by two parts of the control.

A store with losses is charged by ``0.95 max(u, 0)`` and discharged by ``max(-u, 0) / 0.95``. With
``u = u+ - u-``, both parts not negative, its rate has no kink: ``max(u, 0)`` is ``u+``, and
``max(-u, 0)`` is ``u-``. The parts say the same as u as long as one of them is zero. That is no
limit of the new statement, and is checked after a solve (`check_parts`). It
holds if both parts at once only cost, as they lose what is stored.

The control u stays, and the sum of its parts, ``s = |u|``, joins it. So ``u+ = (s + u)/2`` and ``u-
= (s - u)/2`` are not negative if ``s >= u`` and ``s >= -u``, and their product is zero if ``s`` is
``|u|``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ocp.arrays import TINY, Array
from ocp.errors import SolveFailed
from ocp.mesh.mesh import MIDPOINTS
from ocp.mesh.trajectory import PhaseTrajectory, Trajectory
from ocp.numerics.expression_graph import ExpressionGraph, graph_of
from ocp.numerics.kinks import may_have_kinks
from ocp.numerics.polynomial_expressions import is_linear
from ocp.problem.bounds import Bound
from ocp.problem.functionals import Functional
from ocp.problem.phase import Phase
from ocp.problem.problem import Problem
from ocp.problem.symbols import Constant, Control, is_number, resolve
from ocp.reformulate.costs import unlike
from ocp.reformulate.reformulation import (
    Restated,
    taken_names,
    with_functionals,
    with_limits,
)

# Operations that have a kink, with the sign of the modulus of the surface in them
_SIGNS = {"fmax": 1.0, "fmin": -1.0}
_MODULUS = "fabs"

# Mean of both parts at once over a phase, of the largest value of the control. A solver leaves
# 1e-8. What is less than this and matters is what the replay finds, which drives the stated rates.
_BOTH = 1e-4

# Of the largest value of a control, within which it is zero: what a solver leaves of it
_ZERO = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class SumOfParts(Control):
    """The sum of both parts of a control, which is its modulus where one of them is zero.

    Attributes
    ----------
    of : str
        Name of the control that has these parts.
    """

    of: str = ""


@dataclass(frozen=True)
class SplitControls:
    """Two parts of each control whose modulus is in a rate."""

    def apply(self, problem: Problem) -> Restated | None:
        """The problem whose rates have no kinks by a control; None where none has any."""
        rates = [rate for phase in problem.phases for rate in phase.dynamics.values()]
        if not may_have_kinks(*rates):
            return None
        sums, names = dict[Control, SumOfParts](), taken_names(problem)
        phases = [_split(phase, sums, names) for phase in problem.phases]
        if not sums:
            return None

        # a functional knows the rates of the phase that it was made from, and its copy does not
        pairs = zip(phases, problem.phases, strict=True)
        changed = {new.name for new, old in pairs if new is not old}
        replaced: dict[Functional, Functional] = {
            functional: replace(functional)
            for functional in problem.functionals
            if any(name in changed for name, _ in functional.pieces)
        }
        return Restated(
            with_functionals(problem, phases, replaced),
            back={old: new.symbol for old, new in replaced.items()},
            forth={made: ca.fabs(control.symbol) for control, made in sums.items()},
        )


def sums_of_parts(phase: Phase) -> tuple[SumOfParts, ...]:
    """Those that the rates of a phase depend on."""
    found = dict.fromkeys(s for symbols in phase.rate_symbols.values() for s in symbols)
    return tuple(symbol for symbol in found if isinstance(symbol, SumOfParts))


def _split(phase: Phase, sums: dict[Control, SumOfParts], names: Sequence[str]) -> Phase:
    """A phase without such kinks in its rates; itself where there are none.

    The sums of parts that it takes are added to those that there are.
    """
    rates = {state: _without_kinks(rate, sums, names) for state, rate in phase.dynamics.items()}
    if all(new is phase.dynamics[state] for state, new in rates.items()):
        return phase
    used = {symbol for rate in rates.values() for symbol in resolve(rate, "a rate")}
    limits = [
        Bound(f"{made.name}, lower limit {number}", made - side, made.unit, lower=0.0)
        for control, made in sums.items()
        if made in used
        for number, side in enumerate((control.symbol, -control.symbol), start=1)
    ]
    return replace(phase, dynamics=rates, bounds=with_limits(phase.bounds, limits))


def _without_kinks(rate: ca.SX, sums: dict[Control, SumOfParts], names: Sequence[str]) -> ca.SX:
    """A rate with the sum of its parts in place of the modulus of each control."""
    symbols = resolve(rate, "a rate")
    bare = [symbol.symbol for symbol in symbols]
    graph = graph_of([rate], bare)
    instead = dict[int, ca.SX]()
    for place, surface, others in _kinks(graph, bare):
        found = _control_of(surface)
        if found is None:
            continue
        control, factor = found
        if control not in sums:
            sums[control] = _sum_of_parts(control, [*names, *(s.name for s in sums.values())])
        modulus = ca.fabs(factor) * sums[control].symbol
        sign = _SIGNS.get(graph.instructions[place].operation)
        instead[place] = modulus if sign is None else (others + sign * modulus) / 2
    if not instead:
        return rate
    return graph.rebuilt(bare, instead)[0]


def _kinks(graph: ExpressionGraph, bare: Sequence[ca.SX]) -> Iterator[tuple[int, ca.SX, ca.SX]]:
    """Places of kinks, with the surface of each, and the sum of both sides."""
    for place, instruction in enumerate(graph.instructions):
        if instruction.operation == _MODULUS or instruction.operation in _SIGNS:
            operands = ExpressionGraph(graph.instructions, instruction.operands).rebuilt(bare)
            one, other = operands if len(operands) == 2 else (operands[0], ca.SX(0))
            yield place, one - other, one + other


def _control_of(surface: ca.SX) -> tuple[Control, ca.SX] | None:
    """The control that a surface is a multiple of, and the factor, if it is one of both signs.

    The factor is a number, or an expression of constants.
    """
    symbols = resolve(surface, "a kink")
    controls = [symbol for symbol in symbols if isinstance(symbol, Control)]
    if len(controls) != 1 or not all(isinstance(s, (Control, Constant)) for s in symbols):
        return None
    (control,) = controls
    at_zero = ca.simplify(ca.substitute(surface, control.symbol, 0))
    if not is_linear(surface, control.symbol) or not at_zero.is_zero():
        return None
    of_one_sign = (is_number(control.lower) and control.lower >= 0) or (
        is_number(control.upper) and control.upper <= 0
    )
    return None if of_one_sign else (control, ca.densify(ca.jacobian(surface, control.symbol)))


def _sum_of_parts(control: Control, names: Sequence[str]) -> SumOfParts:
    """The sum of both parts, each of which is within the limits of the control."""
    limits = (control.lower, control.upper)
    most = max(abs(limit) if is_number(limit) else math.inf for limit in limits)
    return SumOfParts(
        unlike(f"|{control.name}|", names),
        control.unit,
        lower=0.0,
        upper=most,
        scale=control.scale,
        piecewise=control.piecewise,
        of=control.name,
    )


def check_parts(problem: Problem, trajectory: Trajectory) -> None:
    """SolveFailed if a control has both of its parts at once."""
    found = [
        (float(both @ np.diff(motion.fractions)), int(both.argmax()), motion, made)
        for motion in trajectory.phases
        for made, both in _both_at_once(problem, motion)
    ]
    found.sort(key=lambda each: -each[0])
    if not found or found[0][0] <= _BOTH:
        return
    _, interval, motion, made = found[0]
    instant = float(motion.breakpoints[interval : interval + 2].mean())
    raise SolveFailed(
        f"the rates of phase '{motion.name}' of '{problem.name}' contain an absolute value or a "
        f"maximum of '{made.of}', and a positive and a negative part at the same time would be "
        f"free or an advantage, as at {instant:.3g} s, for example because of a negative price; "
        "change the problem so that losses have a cost, or, if both parts are possible at the "
        "same time, use two non-negative controls",
        trajectory,
    )


def _both_at_once(problem: Problem, motion: PhaseTrajectory) -> Iterator[tuple[SumOfParts, Array]]:
    """Means over the intervals of both parts at once, relative to the control, (N,).

    An interval in which the control changes its sign says nothing: there a polynomial is above the
    modulus.
    """
    k = np.repeat(np.arange(motion.intervals), MIDPOINTS.size)
    tau = np.tile(MIDPOINTS, motion.intervals)
    for made in sums_of_parts(problem.phase(motion.name)):
        total, control = (
            motion.polynomial(name).value(k, tau)[:, 0].reshape(motion.intervals, -1)
            for name in (made.name, made.of)
        )
        size = max(float(np.abs(control).max()), float(total.max()), TINY)
        of_one_sign = np.minimum(control.max(axis=1), -control.min(axis=1)) <= _ZERO * size
        yield made, of_one_sign * (total - np.abs(control)).mean(axis=1) / size
