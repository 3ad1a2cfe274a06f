"""Which expressions of a problem have kinks, points at which their derivative jumps."""

from __future__ import annotations

from functools import lru_cache

from ocp.numerics.kinks import kinked_operations
from ocp.problem.display import functional_text
from ocp.problem.problem import Problem


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
