"""What a statement looks like as text."""

from __future__ import annotations

import casadi as ca

from ocp.numerics.expression_graph import expression_text
from ocp.problem.functionals import (
    BoundaryValue,
    Functional,
    Integral,
    Peak,
    PhaseTime,
    PointValue,
)
from ocp.problem.symbols import Symbol, resolve, scalar


def text_of(expression: ca.SX, longest: int = 160) -> str:
    """An expression as one writes it, values of the motion with what they are values of."""
    symbols = {s.symbol.element_hash(): s for s in resolve(expression, "an expression")}
    return expression_text(
        scalar(expression, "an expression"),
        lambda symbol: _name(symbols[symbol.element_hash()]),
        longest,
    )


def _name(symbol: Symbol) -> str:
    return symbol.accept(_FunctionalText()) if isinstance(symbol, Functional) else symbol.name


class _FunctionalText:
    """A functional as one writes it."""

    def integral(self, functional: Integral) -> str:
        return f"integral of {text_of(functional.expression)} over {functional.phase}"

    def peak(self, functional: Peak) -> str:
        pieces = (
            f"{f'|{text_of(e)}|' if functional.absolute else text_of(e)} over {phase}"
            for phase, e in functional.pieces
        )
        return f"peak of {', '.join(pieces)}"

    def boundary_value(self, functional: BoundaryValue) -> str:
        return f"{text_of(functional.expression)} at the {functional.end} of {functional.phase}"

    def point_value(self, functional: PointValue) -> str:
        return f"{text_of(functional.expression)} at {functional.instant:g} s"

    def phase_time(self, functional: PhaseTime) -> str:
        return f"{functional.end} of {functional.phase}"
