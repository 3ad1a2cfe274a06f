"""Functionals: numbers that a whole motion has, such as an integral, a peak or an end value.

Each kind is a class. What differs between the kinds is said by visitors: an object with one method
a kind (`FunctionalVisitor`), which `Functional.accept` calls. Their values on a trajectory, their
expressions in the nonlinear program and their typical sizes are such visitors.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeVar

import casadi as ca

from ocp.problem.symbols import Symbol, check_scale

End = Literal["start", "end"]
Result = TypeVar("Result", covariant=True)


class FunctionalVisitor(Protocol[Result]):
    """One answer for each kind of functional."""

    def integral(self, functional: Integral) -> Result: ...

    def peak(self, functional: Peak) -> Result: ...

    def boundary_value(self, functional: BoundaryValue) -> Result: ...

    def point_value(self, functional: PointValue) -> Result: ...

    def phase_time(self, functional: PhaseTime) -> Result: ...


@dataclass(frozen=True, eq=False, repr=False)
class Functional(Symbol):
    """A number that a motion has; it stands in the objective, in bounds and in links.

    Attributes
    ----------
    name, unit : str
    pieces : ((phase name, expression), ...)
        One piece, except for a peak over several phases.
    symbols : tuple of Symbol
        What the expressions depend on.
    scale : float or None
        Typical size [unit]. It is derived from the guess if None.
    phase, expression : str, SX
        Of the first piece.
    """

    name: str
    unit: str
    pieces: tuple[tuple[str, ca.SX], ...]
    symbols: tuple[Symbol, ...] = ()
    scale: float | None = None
    symbol: ca.SX = field(init=False, repr=False)
    phase: str = field(init=False, repr=False)
    expression: ca.SX = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._declare()
        check_scale(self.name, self.scale)
        phase, expression = self.pieces[0]
        object.__setattr__(self, "phase", phase)
        object.__setattr__(self, "expression", expression)

    def __repr__(self) -> str:
        from ocp.problem.display import functional_text

        return f"{type(self).__name__}({functional_text(self)})"

    def accept(self, visitor: FunctionalVisitor[Result]) -> Result:
        """Call the visitor's method for this kind."""
        raise TypeError(f"{type(self).__name__} is no kind of functional")


@dataclass(frozen=True, eq=False, repr=False)
class Integral(Functional):
    """Integral of an expression over a phase."""

    def accept(self, visitor: FunctionalVisitor[Result]) -> Result:
        return visitor.integral(self)


@dataclass(frozen=True, eq=False, repr=False)
class Peak(Functional):
    """Largest value of expressions over all times of their phases.

    Attributes
    ----------
    absolute : bool
        Whether the largest absolute value is meant.
    """

    absolute: bool = False

    def accept(self, visitor: FunctionalVisitor[Result]) -> Result:
        return visitor.peak(self)

    @property
    def signs(self) -> tuple[float, ...]:
        """The sides from which the peak bounds its expression: 1 above, -1 below."""
        return (1.0, -1.0) if self.absolute else (1.0,)


@dataclass(frozen=True, eq=False, repr=False)
class BoundaryValue(Functional):
    """Value of an expression at the start or the end of a phase."""

    end: End = "end"

    def accept(self, visitor: FunctionalVisitor[Result]) -> Result:
        return visitor.boundary_value(self)


@dataclass(frozen=True, eq=False, repr=False)
class PointValue(Functional):
    """Value of an expression at a given time [s] inside a phase of fixed times."""

    instant: float = 0.0

    def accept(self, visitor: FunctionalVisitor[Result]) -> Result:
        return visitor.point_value(self)


@dataclass(frozen=True, eq=False, repr=False)
class PhaseTime(Functional):
    """Initial or final time of a phase [s]."""

    end: End = "end"

    def accept(self, visitor: FunctionalVisitor[Result]) -> Result:
        return visitor.phase_time(self)
