"""Which expressions of a problem have kinks, points at which their derivative jumps."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca

from ocp.numerics.kinks import KinkSurfaces, kinked_operations
from ocp.problem.display import functional_text
from ocp.problem.functionals import Integral, pieces_over
from ocp.problem.problem import Problem
from ocp.problem.symbols import State


@lru_cache(maxsize=64)
def kinks_of(problem: Problem) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Each expression that has kinks, in words, and the operations of CasADi that make them."""
    expressions = [
        *((f"the rate of '{s.name}'", e) for p in problem.phases for s, e in p.dynamics.items()),
        *((functional_text(f), piece) for f in problem.functionals for _, piece in f.pieces),
        *((f"'{b.name}'", b.expression) for p in problem.phases for b in p.bounds),
        *((f"'{b.name}'", b.expression) for b in problem.boundary_constraints),
        ("the objective", problem.objective),
    ]
    found = ((what, tuple(kinked_operations(expression))) for what, expression in expressions)
    return tuple((what, operations) for what, operations in found if operations)


@lru_cache(maxsize=256)
def crossable_kinks(problem: Problem, phase: str) -> KinkSurfaces:
    """Kinks of the dynamics and integrands of a phase that its motion may cross.

    Their place depends on states, and may depend on time and numbers, but on nothing that jumps,
    as controls do.
    """
    integrands = [
        piece
        for functional in problem.functionals
        if isinstance(functional, Integral)
        for where, piece in functional.pieces
        if where == phase
    ]
    surfaces = KinkSurfaces.of([*problem.phase(phase).dynamics.values(), *integrands])
    signals = problem.signals[phase]
    states = ca.vertcat(*[s.symbol for s in signals if isinstance(s, State)], ca.SX(0, 1))
    others = ca.vertcat(*[s.symbol for s in signals if not isinstance(s, State)], ca.SX(0, 1))
    return surfaces.only(
        [ca.depends_on(g, states) and not ca.depends_on(g, others) for g in surfaces.values]
    )


@lru_cache(maxsize=256)
def roundable_kinks(problem: Problem, phase: str) -> KinkSurfaces:
    """Kinks of the dynamics, bounds and functionals of a phase that its signals make.

    Those of time alone are at known instants, which have breakpoints of the mesh.
    """
    surfaces = KinkSurfaces.of(
        [
            *problem.phase(phase).dynamics.values(),
            *(bound.expression for bound in problem.phase(phase).bounds),
            *(piece for _, piece in pieces_over(problem.functionals, phase)),
        ]
    )
    signals = ca.vertcat(*[signal.symbol for signal in problem.signals[phase]])
    return surfaces.only([ca.depends_on(g, signals) for g in surfaces.values])
