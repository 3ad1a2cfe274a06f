"""Functionals: numbers that a whole motion has, such as an integral, a peak or an end value.

Each kind is a class, and `AnyFunctional` is all of them. What differs between the kinds is told
apart by one `match` over them that the type checker holds to be complete: for the values on a
trajectory, the expressions in the nonlinear program, the typical sizes and the texts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeVar, assert_never

import casadi as ca

from ocp.problem.symbols import State, Symbol, check_scale
from ocp.problem.texts import text_of

End = Literal["start", "end"]


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
    phase_dynamics : tuple of mapping of State to SX
        Rates of the states of the phase from which each piece was made. A piece itself only has the
        name of its phase, and two phases may have the same name. Empty where the functional was not
        made from a phase, as when it was read from a file.
    """

    name: str
    unit: str
    pieces: tuple[tuple[str, ca.SX], ...]
    symbols: tuple[Symbol, ...] = ()
    scale: float | None = None
    symbol: ca.SX = field(init=False, repr=False)
    phase: str = field(init=False, repr=False)
    expression: ca.SX = field(init=False, repr=False)
    phase_dynamics: tuple[Mapping[State, ca.SX], ...] = field(init=False, repr=False, default=())

    def __post_init__(self) -> None:
        self._declare()
        check_scale(self.name, self.scale)
        phase, expression = self.pieces[0]
        object.__setattr__(self, "phase", phase)
        object.__setattr__(self, "expression", expression)

    def remember_phases(self, dynamics: Iterable[Mapping[State, ca.SX]]) -> None:
        """Set `phase_dynamics`, one for each piece: what makes a functional from phases calls it.

        It is no field of the constructor, so that neither a file nor a copy with other pieces has
        the dynamics of phases that it was not made from.
        """
        object.__setattr__(self, "phase_dynamics", tuple(dynamics))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.text})"

    @property
    def text(self) -> str:
        """What it is, such as ``integral of u^2 over flight``."""
        assert isinstance(self, AnyFunctional)
        return functional_text(self)


class Integral(Functional):
    """Integral of an expression over a phase."""


@dataclass(frozen=True, eq=False, repr=False)
class Peak(Functional):
    """Largest value of expressions over all times of their phases.

    Attributes
    ----------
    absolute : bool
        Whether the largest absolute value is meant.
    """

    absolute: bool = False

    @property
    def signs(self) -> tuple[float, ...]:
        """The sides from which the peak bounds its expression: 1 above, -1 below."""
        return (1.0, -1.0) if self.absolute else (1.0,)


@dataclass(frozen=True, eq=False, repr=False)
class BoundaryValue(Functional):
    """Value of an expression at the start or the end of a phase."""

    end: End = "end"

    @property
    def value_of(self) -> ca.SX:
        """The expression."""
        return self.expression


@dataclass(frozen=True, eq=False, repr=False)
class PointValue(Functional):
    """Value of an expression at a given time [s] inside a phase of fixed times."""

    instant: float = 0.0

    @property
    def value_of(self) -> ca.SX:
        """The expression."""
        return self.expression


@dataclass(frozen=True, eq=False, repr=False)
class PhaseTime(Functional):
    """Initial or final time of a phase [s]."""

    end: End = "end"


AnyFunctional = Integral | Peak | BoundaryValue | PointValue | PhaseTime

_Kind = TypeVar("_Kind", bound=Functional)


def pieces_over(functionals: Iterable[_Kind], phase: str) -> Iterator[tuple[_Kind, ca.SX]]:
    """Functionals that have a piece over a phase, given by its name, with its expression."""
    for functional in functionals:
        for name, expression in functional.pieces:
            if name == phase:
                yield functional, expression


def functional_text(functional: AnyFunctional) -> str:
    """A functional as one writes it, such as ``integral of u^2 over flight``."""
    match functional:
        case Integral():
            return f"integral of {text_of(functional.expression)} over {functional.phase}"
        case Peak():
            bar = "|" if functional.absolute else ""
            texts = [f"{bar}{text_of(e)}{bar} over {phase}" for phase, e in functional.pieces]
            return f"peak of {', '.join(texts)}"
        case BoundaryValue():
            expression = text_of(functional.expression)
            return f"{expression} at the {functional.end} of {functional.phase}"
        case PointValue():
            return f"{text_of(functional.expression)} at {functional.instant:g} s"
        case PhaseTime():
            return f"{functional.end} of {functional.phase}"
        case _:
            assert_never(functional)
