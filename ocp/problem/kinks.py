"""Which expressions of a problem have kinks, points at which their derivative jumps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache

import casadi as ca

from ocp.numerics.expression_graph import operations_of
from ocp.numerics.kinks import KinkSurfaces, kinked_operations
from ocp.problem.functionals import Integral, functional_text
from ocp.problem.problem import Problem
from ocp.problem.symbols import Signal, State, column_of, is_number

# Of expressions that are held against each other: that of a negative signal
_DEPTH = 2


def rate_text(state: State) -> str:
    """The rate of a state in words."""
    return f"the rate of '{state.name}'"


@lru_cache
def kinks_of(problem: Problem) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Each expression that has kinks, in words, and the operations of CasADi that make them."""
    along = [entry for phase in problem.phases for entry in problem.along(phase)]
    expressions = [*along, *problem.of_numbers()]
    found = ((what, tuple(kinked_operations(expression))) for what, expression in expressions)
    return tuple((what, operations) for what, operations in found if operations)


def choices_of(problem: Problem) -> Iterator[str]:
    """Integrals that choose between values by a signal, in words: they may be a larger of two."""
    for functional in problem.functionals:
        if not isinstance(functional, Integral):
            continue
        signals = any(isinstance(symbol, Signal) for symbol in functional.symbols)
        if signals and "if_else_zero" in operations_of(functional.expression):
            yield functional_text(functional)


@lru_cache
def crossable_kinks(problem: Problem, phase: str) -> KinkSurfaces:
    """Kinks of the dynamics and integrands of a phase that its motion may cross.

    Their place depends on states, and may depend on time and numbers, but on nothing that jumps,
    as controls do. A signal that keeps its sign, as a speed that is not negative, crosses none.
    """
    integrands = [integral.expression for integral in problem.integrals[phase]]
    surfaces = KinkSurfaces.of([*problem.phase(phase).dynamics.values(), *integrands])
    signals = problem.signals[phase]
    states = column_of(s for s in signals if isinstance(s, State))
    others = column_of(s for s in signals if not isinstance(s, State))
    return surfaces.only(
        [
            ca.depends_on(g, states)
            and not ca.depends_on(g, others)
            and not _keeps_sign(g, signals)
            for g in surfaces.values
        ]
    )


def _keeps_sign(surface: ca.SX, signals: Iterable[Signal]) -> bool:
    """Whether a surface is one of some signals, or its negative, whose bounds give it one sign."""
    for signal in signals:
        if any(ca.is_equal(surface, own, _DEPTH) for own in (signal.symbol, -signal.symbol)):
            return bool(
                (is_number(signal.lower) and signal.lower >= 0)
                or (is_number(signal.upper) and signal.upper <= 0)
            )
    return False
