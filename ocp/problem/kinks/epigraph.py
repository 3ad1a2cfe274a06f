"""Controls above several expressions, which take the place of the largest of these.

Where a larger value only costs, such a control is the largest of its sides, at all times. So a kink
becomes a control and a few limits (the epigraph form: Boyd and Vandenberghe, "Convex Optimization",
section 4.1.3).

The size of a vector is the largest of infinitely many expressions. One curved limit stands for all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import casadi as ca

from ocp.numerics.linearity import is_linear
from ocp.problem.bounds import Bound
from ocp.problem.functionals import AnyFunctional, Integral, pieces_over
from ocp.problem.kinks.time_factors import at_some_times
from ocp.problem.phase import Phase
from ocp.problem.symbols import Constant, Control, Symbol, is_limited, resolve

# Of its typical value: what keeps the limit of a size smooth at zero. A size is too small by half
# of it at most. Where a motion is at its typical size for a two-thousandth of the time, and at rest
# for all else, the objective is off by what a certificate allows.
_ROUNDED = 1e-8


@dataclass(frozen=True, eq=False, repr=False)
class Epigraph(Control):
    """A control that is nowhere below its sides.

    Parameters
    ----------
    sides : sequence of SX
        Expressions of signals, unknowns and constants [unit].
    largest : SX
        The largest of the sides, as it was stated [unit].

    Attributes
    ----------
    limits : tuple of Bound
        That hold it above the sides, for every phase that has it.
    symbols : tuple of Symbol
        What the sides depend on.
    """

    sides: Sequence[ca.SX] = ()
    largest: ca.SX = field(default_factory=lambda: ca.SX(-math.inf))
    limits: tuple[Bound, ...] = field(init=False, repr=False)
    symbols: tuple[Symbol, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "limits", self._limits())
        object.__setattr__(self, "symbols", resolve(self.largest, f"a side of '{self.name}'"))

    def _limits(self) -> tuple[Bound, ...]:
        """That hold it above its sides."""
        return tuple(
            Bound(f"{self.name}, lower limit {number}", self.symbol - side, self.unit, lower=0.0)
            for number, side in enumerate(self.sides, start=1)
            if not side.is_constant()
        )


@dataclass(frozen=True, eq=False, repr=False)
class VectorSize(Epigraph):
    """A control s that is nowhere below the size of a vector a.

    With ``s >= 0`` its limit is ``s - |a|^2 / (s + e) >= 0``. Of the ways to state this cone it is
    the one that is convex and has bounded slopes (Benson and Vanderbei, "Solving problems with
    semidefinite and related constraints using interior-point methods for nonlinear programming",
    Mathematical Programming 95, 2003). The least such s is ``sqrt(|a|^2 + (e/2)^2) - e/2``. It is
    zero where a is, and elsewhere below the size by less than ``e/2``.

    Parameters
    ----------
    square : SX
        Of the size [unit^2].
    scale : float
        A typical size [unit], of which e is a small part.
    """

    square: ca.SX = field(default_factory=lambda: ca.SX(0.0))

    def _limits(self) -> tuple[Bound, ...]:
        """That holds it above the size."""
        assert self.scale is not None
        ratio = self.square / (self.symbol + _ROUNDED * self.scale)
        # it acts nearly everywhere, so that its values do not tell what an excess is a part of
        limit = Bound(f"{self.name}, size", self.symbol - ratio, self.unit, 0.0, scale=self.scale)
        return (limit,)


def epigraphs(symbols: Iterable[Symbol]) -> tuple[Epigraph, ...]:
    """Those of some symbols that are controls above expressions."""
    return tuple(symbol for symbol in symbols if isinstance(symbol, Epigraph))


def limited_by(bound: Bound) -> tuple[Epigraph, ...]:
    """The controls that a bound holds above an expression."""
    return tuple(
        own for own in epigraphs(bound.symbols) if bound.name in {b.name for b in own.limits}
    )


def limited_for_cost(
    bound: Bound, phase: Phase, functionals: Iterable[AnyFunctional]
) -> Epigraph | None:
    """The control that a bound holds above an expression, if it only costs; None for other bounds.

    What such a bound leaks is worth what the cost is less by. No limit of the plant is exceeded.

    Parameters
    ----------
    phase : Phase
        Of the bound.
    functionals : iterable of Functional
        All in use.
    """
    own = limited_by(bound)
    if len(own) != 1:
        return None
    (control,) = own
    others = [*phase.dynamics.values(), *(b.expression for b in without_limits(phase.bounds))]
    for functional, expression in pieces_over(functionals, phase.name):
        adds_it_up = isinstance(functional, Integral) and any(
            each is control for each in raised_in(functional)
        )
        if not adds_it_up:
            others.append(expression)
    used = ca.depends_on(ca.vertcat(*others, ca.SX(0, 1)), control.symbol)
    return None if used else control


def is_limit_of_size(bound: Bound) -> bool:
    """Whether a bound holds a control above the size of a vector."""
    return any(isinstance(own, VectorSize) for own in limited_by(bound))


def with_limits(bounds: Sequence[Bound], controls: Iterable[Epigraph]) -> list[Bound]:
    """The bounds of a phase with the limits of its controls, each once."""
    names = {bound.name for bound in bounds}
    further = [limit for control in controls for limit in control.limits]
    return [*bounds, *(limit for limit in further if limit.name not in names)]


def without_limits(bounds: Iterable[Bound]) -> list[Bound]:
    """The bounds of a phase but the limits of controls above expressions."""
    return [bound for bound in bounds if not limited_by(bound)]


def raised_in(integral: Integral) -> tuple[Epigraph, ...]:
    """Controls that took the place of kinks of an integral, which are only added there."""
    return tuple(
        control
        for control in epigraphs(integral.symbols)
        if is_linear(integral.expression, control.symbol)
    )


@lru_cache(maxsize=256)
def as_stated(integral: Integral) -> Integral:
    """The integral with the kinks whose place controls took; itself where none did."""
    controls = raised_in(integral)
    if not controls:
        return integral
    expression = ca.substitute(
        integral.expression,
        ca.vertcat(*[control.symbol for control in controls]),
        ca.vertcat(*[control.largest for control in controls]),
    )
    symbols = resolve(expression, integral.name)
    return replace(integral, pieces=((integral.phase, expression),), symbols=symbols)


def prices(
    integrals: Iterable[Integral],
    phases: Iterable[Phase],
    objective: ca.SX,
    constraints: Iterable[Bound],
) -> list[tuple[Epigraph, ca.SX]]:
    """What a larger value costs of each control that took the place of a kink.

    It is nothing less than zero. Where a constant changes its sign, the optimum has no largest
    value of the control. Prices without a constant are left out.

    Returns
    -------
    list of (control, expression of constants)
    """
    by_name = {phase.name: phase for phase in phases}
    terms = [(objective, 1.0)]
    for bound in constraints:
        terms.append((bound.expression, 1.0 if is_limited(-math.inf, bound.upper) else -1.0))
    found = []
    for integral in integrals:
        for control in raised_in(integral):
            own = ca.jacobian(integral.expression, control.symbol)
            for expression, sign in terms:
                price = sign * ca.jacobian(expression, integral.symbol) * own
                if any(isinstance(s, Constant) for s in resolve(ca.densify(price), "a price")):
                    at_times = at_some_times(ca.densify(price), by_name[integral.phase])
                    found += [(control, at_time) for at_time in at_times]
    return found
